//! Arguments of `promenade bake`, and of all that reads responses.

use super::less::LessArgs;
use super::values::{parse_bounds, parse_pair};
use clap::{Args, Subcommand, ValueEnum};
use promenade_baker::{BakeError, LoadOptions, Responses, Side};
use promenade_core::glam::Vec3;
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(crate) enum BakeSource {
    /// From binaural room responses: a folder with a responses.json, a manifest (.json) or a SOFA file
    Responses(BakeResponsesArgs),
    /// From a scene's own anchor cloud: a table in its place
    Field(BakeFieldArgs),
    /// From a scene: one that keeps less of what it holds and costs less, or without --within all of it with the settings that
    /// players choose from
    Less(BakeLessArgs),
}

#[derive(Debug, Args)]
pub(crate) struct BakeLessArgs {
    /// Scene file
    pub(crate) scene: PathBuf,
    #[command(flatten)]
    pub(crate) less: LessArgs,
    /// Scene file to write
    #[arg(short, long, value_name = "SCENE")]
    pub(crate) output: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct BakeFieldArgs {
    /// Scene file with an anchor cloud
    pub(crate) scene: PathBuf,
    /// Scene file to write
    #[arg(short, long, value_name = "SCENE")]
    pub(crate) output: PathBuf,
    /// Listener positions that are tabulated, metres; without it the scene's bounds
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", value_parser = parse_bounds, allow_hyphen_values = true)]
    pub(crate) bounds: Option<(Vec3, Vec3)>,
    /// Lowest and highest pitch, degrees
    #[arg(long, value_name = "LOW,HIGH", default_value = "-90,90", value_parser = parse_pair, allow_hyphen_values = true)]
    pub(crate) pitch: (f32, f32),
    /// Lowest and highest roll, degrees
    #[arg(long, value_name = "LOW,HIGH", default_value = "-180,180", value_parser = parse_pair, allow_hyphen_values = true)]
    pub(crate) roll: (f32, f32),
    /// Error of levels at which the table is fine enough, dB
    #[arg(long, value_name = "DB", default_value_t = 0.1)]
    pub(crate) error_db: f32,
    /// Largest table, megabytes
    #[arg(long, value_name = "MB", default_value_t = 16.0)]
    pub(crate) max_mb: f32,
    /// Seed of the poses that are tried
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) less: LessArgs,
}

/// A set of measured responses.
#[derive(Debug, Args)]
pub(crate) struct ResponsesArgs {
    /// Folder with a responses.json, manifest (.json) or SOFA file
    #[arg(value_name = "RESPONSES")]
    pub(crate) path: PathBuf,
    /// Folder of the WAV files that a manifest names
    #[arg(long, value_name = "DIR")]
    root: Option<PathBuf>,
    /// Emitter to use of a SOFA file with several, counted from 0
    #[arg(long = "emitter-number", alias = "source", value_name = "N")]
    pub(crate) source: Option<usize>,
}

impl ResponsesArgs {
    pub(crate) fn load(&self, azimuth_positive: Option<Side>) -> Result<Responses, BakeError> {
        Responses::load(&self.path, &self.options(azimuth_positive))
    }

    pub(crate) fn options(&self, azimuth_positive: Option<Side>) -> LoadOptions {
        LoadOptions { root: self.root.clone(), azimuth_positive, source: self.source }
    }
}

#[derive(Debug, Args)]
pub(crate) struct BakeResponsesArgs {
    #[command(flatten)]
    pub(crate) set: ResponsesArgs,
    /// Scene file to write
    #[arg(short, long, value_name = "SCENE")]
    pub(crate) output: PathBuf,
    /// Responses to keep for judging the scene: azimuth=odd5, azimuth=-85..85/10, every=5+2, names=A,B, yaw=40, joined by ';'
    #[arg(long, value_name = "RULE", default_value = "none")]
    pub(crate) hold_out: String,
    /// Title of the scene instead of the set's
    #[arg(long)]
    pub(crate) title: Option<String>,
    /// Side to which azimuths grow, where the data say it wrongly
    #[arg(long, value_name = "SIDE")]
    pub(crate) azimuth_positive: Option<SideArg>,
    /// Levels of responses beside each other: as they were measured, or one gain each from the late sound, as where each was
    /// normalised by itself [default: what the manifest says, else what late levels say]
    #[arg(long, value_name = "LEVELS")]
    pub(crate) levels: Option<LevelsArg>,
    /// Frame of the short-time transform, milliseconds; 13/16 of it are the scene's latency
    #[arg(long, value_name = "MS", default_value_t = 20.0)]
    pub(crate) window_ms: f64,
    /// Seed of the tail's pseudo-random phases
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// SOFA file of the head that the responses were measured with: another one takes its place more truly later
    #[arg(long, value_name = "FILE")]
    pub(crate) head: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) less: LessArgs,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum LevelsArg {
    Measured,
    Even,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum SideArg {
    Left,
    Right,
}
