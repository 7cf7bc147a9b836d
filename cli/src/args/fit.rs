//! Arguments of `promenade fit`.

use super::values::{parse_point, within};
use clap::{Args, ValueEnum};
use promenade_core::glam::Vec3;
use promenade_fit::{Convention, LoadOptions};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct FitArgs {
    /// Measurements: a .sofa file, or a folder with measurements.json or laid out as R3VIVAL, Real Acoustic Fields, Hearing
    /// Anything Anywhere or MeshRIR are
    pub(crate) measurements: PathBuf,
    /// Compare what can be foretold at places that are held out, and print it as a table with all baselines
    #[arg(long, required = true)]
    pub(crate) evaluate: bool,
    /// Whose definitions of loudness, C50, EDT and T60
    #[arg(long, value_enum, default_value_t = ConventionArg::AvDar)]
    pub(crate) convention: ConventionArg,
    /// Places that are fitted to; the others are held out [default: a third of all]
    #[arg(long, value_name = "N")]
    pub(crate) places: Option<usize>,
    /// Draws of the places that are fitted to
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub(crate) splits: u32,
    /// Seed of draws
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// As Markdown
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
