//! `promenade surface`: a reconstruction becomes a room's mesh.

use crate::args::{Shape, SurfaceArgs};
use crate::reconstruction::{Found, points_of};
use crate::{path, report};
use anyhow::{Context, Result, bail};
use promenade_acoustics::{Floor, Material, Mesh, Room, Sights};
use promenade_baker::atomic;
use promenade_baker::simulation::along;
use promenade_core::glam::Vec3;
use promenade_core::network::Placement;
use promenade_metrics::statistics::median_high;
use promenade_paths::ImportOptions;

/// A wall with a smaller share of the points is pointed out.
const FEW: f64 = 0.01;
/// The walls of a box, in the order in which they are reported.
const WALLS: [&str; 6] = ["back", "front", "right", "left", "floor", "ceiling"];
/// Seed of a mesh's points.
const SEED: u64 = 1;

/// Facets of free space lie on one plane within this share of a cell.
const FLAT: f64 = 0.8;
/// Triangles become fewer as long as the surface moves by no more than this share of a cell.
const EVEN: f64 = 0.25;
/// Places of a walk for each of its keyframes.
const BETWEEN: usize = 8;
/// Cells of free space unless told, about.
const MOST_CELLS: f64 = 5e5;
/// Edges of cells unless told, metres: of a mesh's sampling, and of free space.
const CELLS_M: [f32; 2] = [0.25, 0.1];

pub(crate) fn run(args: &SurfaceArgs) -> Result<()> {
    if args.output.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("obj")) {
        bail!("{}: expected a file ending in .obj", args.output.display());
    }
    let cell = args.cell.unwrap_or(CELLS_M[usize::from(args.shape == Shape::Free)]);
    if !(cell > 0.0 && cell.is_finite()) {
        bail!("--cell: expected more than 0 m, found {cell}");
    }
    let mut notes = Vec::new();
    let Found { points, cameras, sights, placement, what } = points_of(&args.source, &args.world, cell, SEED, &mut notes)?;
    let points: Vec<[f64; 3]> = points.iter().map(|p| placement.to_scene(p.position).as_dvec3().to_array()).collect();
    let eyes: Vec<[f64; 3]> =
        cameras.iter().map(|camera| placement.to_scene(camera.centre().as_vec3()).as_dvec3().to_array()).collect();
    let walk = match &args.path {
        None => Vec::new(),
        Some(file) => {
            let walk = path::read(file, &ImportOptions::default())?;
            notes.extend(walk.notes);
            let count = BETWEEN * walk.path.keyframes().len();
            along(&walk.path, count).iter().map(|pose| pose.position.as_dvec3().to_array()).collect()
        }
    };
    notes.push(floor(&points, &placement));
    let held = [&eyes[..], &walk].concat();
    let mesh = match args.shape {
        Shape::Box => {
            let found = Mesh::box_around(&points, &held).with_context(|| what.clone())?;
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
        Shape::Free => {
            let cell = args.cell.unwrap_or_else(|| free_cell(&points, &held));
            notes.push(format!("cells of {cell:.2} m"));
            free(&points, &eyes, &sights, &walk, cell.into(), &mut notes).with_context(|| what.clone())?
        }
    };
    said_of(&mesh, &eyes, &walk, &mut notes)?;
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

/// Where the floor is, and what up would be were it level.
fn floor(points: &[[f64; 3]], placement: &Placement) -> String {
    let Some(Floor { normal, height_m, share }) = Mesh::floor_of(points) else {
        return "no floor was found: no plane that is about level has 2 % of the points".to_owned();
    };
    let up = Vec3::from_array(normal.map(|c| c as f32));
    let up = placement.to_foreign(up) - placement.to_foreign(Vec3::ZERO);
    let up = up.normalize_or_zero();
    format!(
        "floor: {:.0} % of the points lie on a plane at {height_m:.2} m, {:.1} degrees off level; --up {:.4},{:.4},{:.4} makes \
         it level",
        100.0 * share,
        normal[2].clamp(-1.0, 1.0).acos().to_degrees(),
        up.x,
        up.y,
        up.z
    )
}

/// The edge of cells of free space, unless told: that of [`CELLS_M`], or as large as [`MOST_CELLS`] ask for.
fn free_cell(points: &[[f64; 3]], held: &[[f64; 3]]) -> f32 {
    let volume: f64 = [0, 1, 2]
        .map(|axis| {
            let mut all: Vec<f64> = points.iter().map(|p| p[axis]).collect();
            all.sort_by(f64::total_cmp);
            let out = all.len() / 50;
            let ends = [all.get(out), all.get(all.len().saturating_sub(1 + out))].map(|end| end.copied().unwrap_or(0.0));
            let [low, high] = held.iter().fold(ends, |[low, high], p| [low.min(p[axis]), high.max(p[axis])]);
            high - low
        })
        .iter()
        .product();
    CELLS_M[1].max((volume / MOST_CELLS).cbrt() as f32)
}

/// The surface of the space that is seen to be free, with planes where it is about flat.
fn free(
    points: &[[f64; 3]],
    eyes: &[[f64; 3]],
    sights: &[[u32; 2]],
    walk: &[[f64; 3]],
    cell_m: f64,
    notes: &mut Vec<String>,
) -> Result<Mesh> {
    // Without cameras a walk, else the middle, is where the points are seen from.
    let middle = [middle(points)];
    let (eyes, held) = match (eyes, walk) {
        ([], []) => {
            notes.push("no camera and no --path say where the points are seen from: their middle is taken".to_owned());
            (&middle[..], walk)
        }
        ([], walk) => (walk, &[][..]),
        _ => (eyes, walk),
    };
    let mut mesh = Mesh::around_free_space(&Sights { points, eyes, lines: sights, held }, cell_m)?;
    notes.extend(mesh.flatten(Some(FLAT * cell_m)).map(|done| done.to_string()));
    let facets = mesh.triangles.len();
    mesh.simplify(EVEN * cell_m);
    notes.push(format!("{} triangles of {facets} say the same to {:.0} mm", mesh.triangles.len(), 1000.0 * EVEN * cell_m));
    mesh.group_by_direction();
    Ok(mesh)
}

/// The median along each axis.
fn middle(points: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|axis| median_high(points.iter().map(|p| p[axis])).unwrap_or(0.0))
}

/// Says which cameras and places of a walk are in the room, and how large it is.
fn said_of(mesh: &Mesh, eyes: &[[f64; 3]], walk: &[[f64; 3]], notes: &mut Vec<String>) -> Result<()> {
    let size = mesh.report();
    if let Some(volume) = size.volume_m3 {
        notes.push(format!("{volume:.1} m3, {:.1} m2", size.area_m2));
    }
    let room = Room::new(mesh, &vec![Material::even("", 0.1, 0.1); mesh.groups.len()])?;
    for (what, places) in [("cameras", eyes), ("places of the walk", walk)].into_iter().filter(|(_, places)| !places.is_empty())
    {
        let mut inside = 0;
        for place in places {
            inside += usize::from(room.encloses(*place)?);
        }
        notes.push(format!("{inside} of {} {what} are inside", places.len()));
    }
    Ok(())
}
