//! Arguments of `promenade simulate`.

use super::air::AirArgs;
use super::capture::ClipArgs;
use super::less::LessArgs;
use super::mesh::{SCALE, UP};
use super::values::{parse_direction, parse_facing, parse_lengths, parse_part, parse_point, within};
use clap::{Args, Subcommand};
use promenade_acoustics::{Material, Materials};
use promenade_baker::simulation::{MAX_LENGTH_S, Part};
use promenade_core::glam::Vec3;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct SimulateArgs {
    #[command(subcommand)]
    pub(crate) what: Option<Simulate>,
    #[command(flatten)]
    pub(crate) room: Option<RoomArgs>,
    #[command(flatten)]
    pub(crate) mesh: Option<SimulateMeshArgs>,
    #[command(flatten)]
    pub(crate) run: Option<RunArgs>,
    #[command(flatten)]
    pub(crate) air: AirArgs,
    #[command(flatten)]
    pub(crate) clips: ClipArgs,
    #[command(flatten)]
    pub(crate) less: LessArgs,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Simulate {
    /// A box room with six walls, by image sources and rays
    Box(Box<SimulateBoxArgs>),
    /// Print the table of materials
    Materials,
}

/// A mesh, its materials and its source.
#[derive(Clone, Debug, Args)]
pub(crate) struct RoomArgs {
    /// Mesh of the room: .obj, .stl, .ply, .glb or .gltf
    #[arg(value_name = "ROOM")]
    pub(crate) mesh: PathBuf,
    /// Where the sound comes from, metres
    #[arg(long = "emitter", alias = "source", value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) source: Vec3,
    /// Materials of the mesh's groups, the first that fits: PATTERN=ABSORPTION[:SCATTERING], each a name of the table, 1 number
    /// or more with slashes between: 7 octaves from 125 Hz to 8 kHz, 8 from 63 Hz, 21, 24 or 31 thirds from 100, 50 or 20 Hz,
    /// or bands HZ@SHARE; `*` in a pattern stands for any letters. A group without a rule has the material of its own name
    #[arg(long, value_name = "RULES", value_delimiter = ',', value_parser = parse_rule)]
    pub(crate) materials: Vec<(String, String)>,
    /// Table of materials that goes before the built-in one, or a folder of tables; may be given more than once. Columns
    /// `material`, `property` (absorption or scattering) and frequencies; or one material as lines of frequencies, absorption
    /// and scattering
    #[arg(long, value_name = "FILE.csv|FOLDER")]
    pub(crate) material_table: Vec<PathBuf>,
    // Those of `MeshArgs`: what is optional as a whole cannot hold what is flattened.
    #[arg(long, help = SCALE, value_name = "M", value_parser = within(1e-6, 1e6))]
    pub(crate) scale: Option<f64>,
    #[arg(long, help = UP, value_name = "AXIS", value_parser = parse_direction, allow_hyphen_values = true)]
    pub(crate) up: Option<Vec3>,
    /// Facets whose corners lie within so many metres of a common plane are put onto it, 0 for none [default: four times the
    /// noise of a mesh of more than 500 planes, if it has any]
    #[arg(long, value_name = "M", value_parser = within(0.0, 1.0))]
    pub(crate) flatten: Option<f64>,
    /// What the source sends where: omni, subcardioid, cardioid, supercardioid, figure-of-eight or a SOFA file
    /// (FreeFieldDirectivityTF) [default: as a fit has left it beside the mesh, or omni]
    #[arg(long, value_name = "PATTERN|FILE.sofa")]
    pub(crate) directivity: Option<PathBuf>,
    /// Where the source faces: yaw from x towards y, and pitch up, degrees [default: as a fit has left it beside the mesh, or
    /// 0,0]
    #[arg(long, value_name = "YAW,PITCH", value_parser = parse_facing, allow_hyphen_values = true)]
    pub(crate) facing: Option<[f64; 2]>,
}

/// How responses of any room are made.
#[derive(Debug, Args)]
pub(crate) struct RunArgs {
    /// Head: free-field responses all around it, a SOFA file or a set of responses
    #[arg(long, value_name = "FILE.sofa")]
    pub(crate) head: PathBuf,
    /// A further emitter, whose responses go into the same set at the same level; may be given more than once
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true, conflicts_with = "part")]
    pub(crate) further: Vec<Vec3>,
    /// Walk of the listener in the room's coordinates, any form of camera path; without it or other places, random poses
    #[arg(long, value_name = "WALK")]
    pub(crate) path: Option<PathBuf>,
    /// Listener poses, evenly over the walk's time or random ones [default: the walk's keyframes, or 100 random ones]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) poses: Option<u32>,
    /// Length of the responses, seconds [default: the longest reverberation time, at most 4]
    #[arg(long, value_name = "S", value_parser = within(0.001, MAX_LENGTH_S))]
    pub(crate) length: Option<f32>,
    /// Below this frequency, Hz, the wave equation is in the place of images and rays, 0 for none [default: where a room's
    /// modes lie apart, 60 to 250 Hz, none in large or open ones]
    #[arg(long, value_name = "HZ", value_parser = within(0.0, 500.0))]
    pub(crate) waves: Option<f64>,
    /// Level of a scene's direct sound at 1 m over that of the dry sound, dB
    #[arg(long, value_name = "DB", default_value_t = 0.0, value_parser = within(-60.0, 60.0), allow_hyphen_values = true)]
    pub(crate) gain: f64,
    /// Seed of rays, noise and random poses, and with --dry of stretches and split
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Make one share of the places, part K of N, in a folder of its own in --output, named after what it is; `join` puts all
    /// together. A part that is there already is not made again
    #[arg(long, value_name = "K/N", conflicts_with = "dry", value_parser = parse_part)]
    pub(crate) part: Option<Part>,
}

#[derive(Debug, Args)]
pub(crate) struct SimulateMeshArgs {
    /// A listener at this place; may be given more than once
    #[arg(long, value_name = "X,Y,Z", conflicts_with_all = ["path", "grid", "poses"], value_parser = parse_point)]
    #[arg(allow_hyphen_values = true)]
    pub(crate) at: Vec<Vec3>,
    /// Listeners on a grid of this spacing, metres [default for a scene: about 60 places]
    #[arg(long, value_name = "M", conflicts_with_all = ["path", "poses"], value_parser = within(0.01_f32, 1000.0))]
    pub(crate) grid: Option<f32>,
    /// Height of the grid over the lowest point of the mesh, metres
    #[arg(long, value_name = "M", default_value_t = 1.5, value_parser = within(0.0_f32, 1000.0))]
    pub(crate) height: f32,
    /// Directions that a listener of --at or --grid looks in, evenly round the circle [default: 24 at a place, 1 on a grid]
    #[arg(long, value_name = "N", conflicts_with_all = ["path", "poses"])]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=3600))]
    pub(crate) turns: Option<u32>,
    /// Distance of random poses and of a grid from surfaces, metres
    #[arg(long, value_name = "M", default_value_t = 0.3, value_parser = within(0.0_f32, 1000.0))]
    pub(crate) margin: f32,
    /// Name of a scene or set [default: the mesh's file name]
    #[arg(long, value_name = "TEXT")]
    pub(crate) title: Option<String>,
    /// Whom to credit for the head [default: as its file says]
    #[arg(long, value_name = "TEXT")]
    pub(crate) credit: Option<String>,
    /// Terms of the head's data [default: as its file says]
    #[arg(long, value_name = "TEXT")]
    pub(crate) licence: Option<String>,
    /// Image sources that a scene plays at most, the strongest; the others are part of its late field
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) images: u32,
    /// Turns of the head for which a scene stores what comes more from one side; 1 leaves that out and makes it half as large
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=36))]
    pub(crate) head_turns: u32,
    /// Reflections that an image source has at most
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u32).range(0..=50))]
    pub(crate) order: u32,
    /// Beams that search the image sources
    #[arg(long, value_name = "N", default_value_t = 8192, value_parser = clap::value_parser!(u32).range(1..=1 << 22))]
    pub(crate) beams: u32,
    /// Rays of the late field [default: 32768, of responses up to 16 times as many for a T30 within 5 %]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 28))]
    pub(crate) rays: Option<u32>,
    /// Sample rate of the responses, hertz
    #[arg(long, value_name = "HZ", default_value_t = 48_000, value_parser = clap::value_parser!(u32).range(8_000..=192_000))]
    pub(crate) rate: u32,
    /// What to write: a scene if it ends in .promenade, which can be walked in; with --dry a capture, a folder with a
    /// capture.json; else a folder of responses, WAV files and a responses.json
    #[arg(short, long, value_name = "FILE.promenade|FOLDER")]
    pub(crate) output: PathBuf,
}

/// One material for all walls, or six of them.
fn parse_walls(text: &str) -> Result<[Material; 6], String> {
    let table = Materials::default();
    let walls: Result<Vec<Material>, String> =
        text.split(';').map(|wall| table.material(wall.trim()).map_err(|error| error.to_string())).collect();
    let walls = walls?;
    match &walls[..] {
        [all] => Ok(std::array::from_fn(|_| all.clone())),
        _ => walls.try_into().map_err(|walls: Vec<Material>| format!("expected 1 or 6 materials, found {}", walls.len())),
    }
}

pub(super) fn parse_rule(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((pattern, material)) if !pattern.trim().is_empty() && !material.trim().is_empty() => {
            Ok((pattern.trim().to_owned(), material.trim().to_owned()))
        }
        _ => Err(format!("expected PATTERN=MATERIAL, such as *={} for all surfaces, found {text:?}", text.trim())),
    }
}

#[derive(Debug, Args)]
pub(crate) struct SimulateBoxArgs {
    /// Length, width and height, metres; the room is the box from the origin to this corner
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_lengths)]
    pub(crate) size: Vec3,
    /// Where the sound comes from, metres
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point)]
    pub(crate) emitter: Vec3,
    /// Materials of the walls, ABSORPTION[:SCATTERING] each, names of `simulate materials` or numbers, 1 or with slashes
    /// between 7 for the octaves from 125 Hz to 8 kHz: of all walls or of six parted by semicolons: x = 0, x = X, y = 0, y = Y,
    /// floor, ceiling
    #[arg(long, value_name = "M", default_value = "0.2", value_parser = parse_walls)]
    pub(crate) materials: [Material; 6],
    #[command(flatten)]
    pub(crate) run: RunArgs,
    #[command(flatten)]
    pub(crate) air: AirArgs,
    #[command(flatten)]
    pub(crate) clips: ClipArgs,
    #[command(flatten)]
    pub(crate) less: LessArgs,
    /// Scale and move the walk so that it fills the room up to this margin, metres; without it, it is in the room's coordinates
    #[arg(long, value_name = "M", requires = "path", value_parser = within(0.0_f32, 1000.0))]
    pub(crate) fit: Option<f32>,
    /// Distance of random poses from the walls, metres
    #[arg(long, value_name = "M", default_value_t = 0.5, conflicts_with = "path", value_parser = within(0.0_f32, 1000.0))]
    pub(crate) margin: f32,
    /// Walls that an image source has met at most
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u32).range(0..=20))]
    pub(crate) order: u32,
    /// Rays of the late field of responses [default: 32768, up to 16 times as many for a T30 within 5 %]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 28))]
    pub(crate) rays: Option<u32>,
    /// Sample rate, hertz [default: 24000 of responses, 48000 of a scene]
    #[arg(long, value_name = "HZ", value_parser = clap::value_parser!(u32).range(8_000..=192_000))]
    pub(crate) rate: Option<u32>,
    /// Name shown to the user [default: the room's lengths]
    #[arg(long, value_name = "TEXT")]
    pub(crate) title: Option<String>,
    /// What to write: a scene if it ends in .promenade, as the editor's Room makes it; else a folder: WAV files and a
    /// responses.json, with --dry a capture
    #[arg(short, long, value_name = "FILE.promenade|FOLDER")]
    pub(crate) output: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct JoinArgs {
    /// Folders of all parts of one simulation
    #[arg(required = true)]
    pub(crate) parts: Vec<PathBuf>,
    /// Folder to write: WAV files and a responses.json
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
}
