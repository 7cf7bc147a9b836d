//! The room that is fitted, as it is stated.

use crate::args::{FitArgs, Per};
use crate::{report, simulate};
use anyhow::{Context, Result, bail};
use promenade_fit::{FlatRoom, Form, Measurements, Searched, WALLS, Walls, search_box};
use std::path::Path;

/// Endings of meshes.
const MESHES: [&str; 7] = ["obj", "stl", "ply", "glb", "gltf", "ac", "dxf"];

/// Whether a file is a mesh by its ending.
pub(super) fn is_mesh(path: &Path) -> bool {
    path.extension().is_some_and(|e| MESHES.iter().any(|m| e.eq_ignore_ascii_case(m)))
}

/// What is stated of a room.
pub(super) enum Stated {
    /// All of it.
    Room(FlatRoom),
    /// That it is a box.
    Nothing,
}

impl Stated {
    /// Lengths of a box, the word `box`, or a mesh.
    pub(super) fn new(room: &Path, args: &FitArgs) -> Result<Self> {
        Ok(match room.to_str() {
            Some("box") => Self::Nothing,
            _ if is_mesh(room) => Self::Room(mesh(room, args)?),
            _ => Self::Room(FlatRoom::of_box(walls(room)?)?),
        })
    }

    /// The room; of a box that is not stated, the one that is found.
    pub(super) fn room(&self, set: &Measurements) -> Result<FlatRoom> {
        if let Self::Room(room) = self {
            return Ok(room.clone());
        }
        let Searched { walls, scanned } = search_box(set)?;
        let [x, y, z] = walls.size_m();
        let [from_x, from_y, from_z] = walls.low_m;
        report::line(format_args!(
            "a box of {x:.2} x {y:.2} x {z:.2} m from {from_x:.2},{from_y:.2},{from_z:.2} m explains the echoes best"
        ));
        let open: Vec<&str> = WALLS.iter().zip(&scanned).filter(|(_, s)| !s.found).map(|(name, _)| *name).collect();
        if !open.is_empty() {
            report::note(format_args!("no single echo stands out for {}: they may be elsewhere", open.join(", ")));
        }
        Ok(FlatRoom::of_box(walls)?)
    }
}

pub(crate) fn walls(room: &Path) -> Result<Walls> {
    let text = room.to_string_lossy();
    let lengths: Result<Vec<f64>, _> = text.split([',', 'x']).map(|n| n.trim().parse::<f64>()).collect();
    match lengths.as_deref() {
        Ok([x, y, z]) => Ok(Walls::of_size([*x, *y, *z])?),
        _ => bail!(
            "{text}: expected the room's length, width and height in metres, X,Y,Z, a mesh, or the word box for one that is \
             searched"
        ),
    }
}

/// The walls of a box.
pub(super) fn of_box(room: &FlatRoom) -> Result<Walls> {
    match &room.form {
        Form::Box(walls) => Ok(*walls),
        Form::Mesh(_) => bail!("--quick: expected a box, found a mesh; without it meshes are fitted too"),
    }
}

fn mesh(path: &Path, args: &FitArgs) -> Result<FlatRoom> {
    let (mesh, _) = simulate::mesh(path, &args.world, None, |_| false)?;
    let room = FlatRoom::of_mesh(mesh).with_context(|| format!("{}: cannot be fitted", path.display()))?;
    Ok(match args.per {
        Per::Material | Per::Voxels => room,
        Per::Wall => room.per_wall(),
    })
}
