//! `promenade surface`: a reconstruction becomes a room's mesh.

use crate::args::{Shape, SurfaceArgs};
use crate::reconstruction::points_of;
use crate::report;
use anyhow::{Context, Result, bail};
use promenade_acoustics::Mesh;
use promenade_baker::atomic;

/// A wall with a smaller share of the points is pointed out.
const FEW: f64 = 0.01;
/// The walls of a box, in the order in which they are reported.
const WALLS: [&str; 6] = ["back", "front", "right", "left", "floor", "ceiling"];
/// Seed of a mesh's points.
const SEED: u64 = 1;

pub(crate) fn run(args: &SurfaceArgs) -> Result<()> {
    if args.output.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("obj")) {
        bail!("{}: expected a file ending in .obj", args.output.display());
    }
    if !(args.cell > 0.0 && args.cell.is_finite()) {
        bail!("--cell: expected more than 0 m, found {}", args.cell);
    }
    let mut notes = Vec::new();
    let (points, placement, what) = points_of(&args.source, &args.world, args.cell, SEED, &mut notes)?;
    let points: Vec<[f64; 3]> = points.iter().map(|p| placement.to_scene(p.position).as_dvec3().to_array()).collect();
    let mesh = match args.shape {
        Shape::Box => {
            let found = Mesh::box_around(&points).with_context(|| what.clone())?;
            let [length, width, height] = found.size_m;
            notes.push(format!(
                "{length:.2} x {width:.2} x {height:.2} m, turned by {:.1} degrees",
                found.turn_rad.to_degrees()
            ));
            let shares = WALLS.iter().zip(found.on_wall).map(|(name, share)| format!("{name} {:.0} %", 100.0 * share));
            notes.push(format!("points on the walls: {}", shares.collect::<Vec<_>>().join(", ")));
            for (name, _) in WALLS.iter().zip(found.on_wall).filter(|(_, share)| *share < FEW) {
                notes.push(format!("hardly a point lies on the {name}: where it is was guessed"));
            }
            found.mesh
        }
        Shape::Hull => Mesh::hull_around(&points, args.cell.into()).with_context(|| what.clone())?,
    };
    atomic::write(&args.output, mesh.to_obj().as_bytes())?;
    report::notes(&notes);
    report::line(format_args!(
        "{}: {} triangles around {} points, groups {}",
        args.output.display(),
        mesh.triangles.len(),
        points.len(),
        mesh.groups.join(", ")
    ));
    Ok(())
}
