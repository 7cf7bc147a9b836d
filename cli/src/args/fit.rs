//! Arguments of `promenade fit`.

use super::simulate::parse_rule;
use super::values::{parse_point, within};
use clap::{Args, ValueEnum};
use promenade_core::glam::Vec3;
use promenade_fit::{Convention, LoadOptions};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct FitArgs {
    /// Room and measurements, or measurements alone to judge what needs no room. ROOM: length, width and height from a corner
    /// at the origin, metres, X,Y,Z. MEASUREMENTS: a .sofa file, or a folder with measurements.json or laid out as R3VIVAL,
    /// Real Acoustic Fields, Hearing Anything Anywhere or MeshRIR are
    #[arg(value_name = "[ROOM] MEASUREMENTS", required = true, num_args = 1..=2)]
    pub(crate) of: Vec<PathBuf>,
    /// What to write: NAME.obj, with NAME.materials.json, NAME.report.md, NAME.report.json and NAME.report.svg beside it; or
    /// NAME.promenade, a scene, with all of these beside it
    #[arg(short, long, value_name = "NAME.obj|NAME.promenade", required_unless_present_any = ["evaluate", "changed"])]
    pub(crate) output: Option<PathBuf>,
    /// Head of a scene: free-field responses all around it
    #[arg(long, value_name = "FILE.sofa")]
    pub(crate) head: Option<PathBuf>,
    /// Emitter of a scene, metres [default: the first measurement's source]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point)]
    pub(crate) emitter: Option<Vec3>,
    /// Compare what is foretold at places that are held out, and print it as a table with all baselines
    #[arg(long)]
    pub(crate) evaluate: bool,
    /// Measurements of the same room with changed walls, which --materials says; what the fitted room foretells of them is
    /// judged
    #[arg(long, value_name = "MEASUREMENTS")]
    pub(crate) changed: Option<PathBuf>,
    /// Setting of the changed room, of a set with several
    #[arg(long, value_name = "NAME", requires = "changed")]
    pub(crate) changed_setting: Option<String>,
    /// Walls that are changed (x0, x1, y0, y1, floor, ceiling), as in `simulate`
    #[arg(long, value_name = "RULES", value_delimiter = ',', value_parser = parse_rule)]
    pub(crate) materials: Vec<(String, String)>,
    /// Whose definitions of loudness, C50, EDT and T60
    #[arg(long, value_enum, default_value_t = ConventionArg::AvDar)]
    pub(crate) convention: ConventionArg,
    /// Places that are fitted to in --evaluate; the others are held out [default: a third of all]
    #[arg(long, value_name = "N")]
    pub(crate) places: Option<usize>,
    /// Draws of the places that are fitted to
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub(crate) splits: u32,
    /// Seed of draws and rays
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Tables as Markdown
    #[arg(long)]
    pub(crate) markdown: bool,
    #[command(flatten)]
    pub(crate) set: MeasurementArgs,
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
    /// Where the source is, if the set does not say so, metres
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point)]
    pub(crate) source: Option<Vec3>,
    /// Which of several sources, counted from 0
    #[arg(long, value_name = "N")]
    pub(crate) source_number: Option<usize>,
    /// Standard deviation of places where the set says none, metres
    #[arg(long, value_name = "M", default_value_t = 0.01, value_parser = within(0.0, 10.0))]
    pub(crate) uncertainty: f64,
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
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum ConventionArg {
    /// AV-DAR on Hearing Anything Anywhere
    AvDar,
    /// AVR on Real Acoustic Fields
    Avr,
}

impl From<ConventionArg> for Convention {
    fn from(arg: ConventionArg) -> Self {
        match arg {
            ConventionArg::AvDar => Self::AvDar,
            ConventionArg::Avr => Self::Avr,
        }
    }
}
