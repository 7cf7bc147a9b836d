//! Arguments of `promenade fit`.

use super::air::AirArgs;
use super::figures::MarkdownFile;
use super::less::LessArgs;
use super::mesh::MeshArgs;
use super::pictures::PictureArgs;
use super::simulate::parse_rule;
use super::values::{parse_point, within};
use clap::{Args, ValueEnum};
use promenade_core::glam::Vec3;
use promenade_fit::LoadOptions;
use promenade_room::Some7;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct FitArgs {
    /// Room and measurements, or measurements alone to judge what needs no room. ROOM: length, width and height from a corner
    /// at the origin, metres, X,Y,Z; a mesh of flat walls, .obj, .stl, .ply, .glb or .gltf; or the word
    /// `box`, of which all six walls are searched, as without a room [a folder of that name is ./box]. MEASUREMENTS: a .sofa
    /// file, or a folder with measurements.json or laid out as R3VIVAL is
    #[arg(value_name = "[ROOM] MEASUREMENTS", required = true, num_args = 1..=2)]
    pub(crate) of: Vec<PathBuf>,
    /// What to write: NAME.obj, with NAME.materials.json, NAME.report.md, NAME.report.json and
    /// NAME.report.decays.svg beside it; or NAME.promenade, a scene, with all of these beside it
    #[arg(short, long, value_name = "NAME.obj|NAME.promenade", required_unless_present_any = ["evaluate", "changed", "t20"])]
    pub(crate) output: Option<PathBuf>,
    /// What stays as it is stated: walls, places, source (which then sends the same everywhere)
    #[arg(long, value_enum, value_name = "WHAT", value_delimiter = ',')]
    pub(crate) hold: Vec<Hold>,
    /// What has a material of its own
    #[arg(long, value_enum, default_value_t = Per::Material)]
    pub(crate) per: Per,
    /// Edge of voxels at most, metres, with --per voxels [default: 0.25]
    #[arg(long, value_name = "METRES", value_parser = within(0.01, 100.0))]
    pub(crate) voxel: Option<f64>,
    #[command(flatten)]
    pub(crate) appearance: PictureArgs,
    /// Reflections of images
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=20))]
    pub(crate) order: u32,
    #[command(flatten)]
    pub(crate) world: MeshArgs,
    /// Reverberation times that the room's walls are given, with ROOM alone: T20 in seconds in seven octaves from 125 Hz, `-`
    /// for one that stays as it is, or a measured response. --materials says what the walls are made of; they all come to
    /// absorb more or less in the same proportion [without: 0.1 everywhere]
    #[arg(
        long,
        value_name = "S,S,S,S,S,S,S|FILE.wav|FILE.sofa",
        value_parser = parse_t20,
        allow_hyphen_values = true,
        conflicts_with_all = ["evaluate", "changed", "within"]
    )]
    pub(crate) t20: Option<T20>,
    /// Head of a scene: free-field responses all around it
    #[arg(long, value_name = "FILE.sofa")]
    pub(crate) head: Option<PathBuf>,
    /// Emitter of a scene, metres [default: the first measurement's source]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) emitter: Option<Vec3>,
    #[command(flatten)]
    pub(crate) less: LessArgs,
    /// Compare what is predicted at two thirds of the places by the others, three times, and print it as a table with baselines
    #[arg(long)]
    pub(crate) evaluate: bool,
    /// Measurements of the same room with changed walls, which --materials says; what the fitted room predicts of them is
    /// judged
    #[arg(long, value_name = "MEASUREMENTS")]
    pub(crate) changed: Option<PathBuf>,
    /// Setting of the changed room, of a set with several
    #[arg(long, value_name = "NAME", requires = "changed")]
    pub(crate) changed_setting: Option<String>,
    /// Walls that are changed (of a box x0, x1, y0, y1, floor, ceiling; of a mesh its groups), as in `simulate`
    #[arg(long, value_name = "RULES", value_delimiter = ',', value_parser = parse_rule)]
    pub(crate) materials: Vec<(String, String)>,
    /// Walls or groups that differ between MEASUREMENTS and --changed, and are alike before and alike after: what they absorb
    /// then is found from the reverberation of both, and printed as rules for --materials
    #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "changed", conflicts_with = "materials")]
    pub(crate) alike: Vec<String>,
    /// Seed of draws and rays
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) markdown: MarkdownFile,
    #[command(flatten)]
    pub(crate) set: MeasurementArgs,
}

/// What stays as it is stated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Hold {
    /// Walls
    Walls,
    /// Sources, microphones and their clocks' offsets within what is known of them
    Places,
    /// What the source sends where
    Source,
}

/// What has a material of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Per {
    /// Each group of a mesh, each wall of a box
    Material,
    /// Each flat wall
    Wall,
    /// Each patch of a surface that lies in one voxel, after whole surfaces are fitted
    Voxels,
}

/// Where reverberation times come from.
#[derive(Clone, Debug)]
pub(crate) enum T20 {
    /// By octave, seconds.
    Typed(Some7),
    /// A measured response.
    File(PathBuf),
}

fn parse_t20(text: &str) -> Result<T20, String> {
    if [".wav", ".sofa"].iter().any(|end| text.to_lowercase().ends_with(end)) {
        return Ok(T20::File(text.into()));
    }
    let time = |part: &str| match part.trim() {
        "-" => Ok(None),
        part => part.parse().map(Some).map_err(|_| format!("expected seconds or `-`, found {part:?}")),
    };
    let times: Vec<Option<f64>> = text.split(',').map(time).collect::<Result<_, _>>()?;
    let count = times.len();
    times.try_into().map(T20::Typed).map_err(|_| format!("expected seven times or a file .wav or .sofa, found {count}"))
}

/// What files of measurements do not say.
#[derive(Debug, Args)]
pub(crate) struct MeasurementArgs {
    /// Sample rate to work at, hertz
    #[arg(long, value_name = "HZ", default_value_t = 16_000, value_parser = clap::value_parser!(u32).range(4_000..=96_000))]
    pub(crate) rate: u32,
    /// Which setting of a set with several, such as 000 of R3VIVAL
    #[arg(long, value_name = "NAME")]
    pub(crate) setting: Option<String>,
    /// Channel of files with several that are neither ears nor AmbiX, counted from 1
    #[arg(long, value_name = "N")]
    pub(crate) channel: Option<usize>,
    /// Where the sound of the measurements came from, if the set does not say so, metres
    #[arg(long = "measured-emitter", alias = "source", value_name = "X,Y,Z", value_parser = parse_point)]
    pub(crate) source: Option<Vec3>,
    /// Which of several emitters that were measured, counted from 0
    #[arg(long = "emitter-number", alias = "source-number", value_name = "N")]
    pub(crate) source_number: Option<usize>,
    /// Standard deviation of places where the set says none, metres
    #[arg(long, value_name = "M", default_value_t = 0.01, value_parser = within(0.0, 10.0))]
    pub(crate) uncertainty: f64,
    #[command(flatten)]
    pub(crate) air: AirArgs,
}

impl MeasurementArgs {
    pub(crate) fn options(&self) -> LoadOptions {
        LoadOptions {
            rate_hz: Some(self.rate),
            setting: self.setting.clone(),
            channel: self.channel,
            source_m: self.source.map(|s| s.as_dvec3().to_array()),
            source_number: self.source_number,
            sd_m: self.uncertainty,
            air: self.air.air(),
        }
    }
}
