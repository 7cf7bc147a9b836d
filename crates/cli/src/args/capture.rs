//! Arguments of `promenade capture`.

use super::bake::ResponsesArgs;
use super::figures::JsonFile;
use super::placement::PlacementArgs;
use super::values::{parse_point, within};
use clap::{Args, Subcommand, ValueEnum};
use promenade_core::glam::Vec3;
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(crate) enum CaptureCommand {
    /// Make a capture of measured responses and dry sound, to judge or train with
    FromResponses(FromResponsesArgs),
    /// Make a capture of recordings as a data set lays them out
    Import(ImportCaptureArgs),
    /// Show what a capture holds: levels, split, what is left out
    Check(CheckArgs),
    /// Estimate where the sound of a capture came from, by its training clips
    Emitter(EmitterArgs),
}

/// Clips of dry sound.
#[derive(Debug, Args)]
pub(crate) struct ClipArgs {
    /// Dry sounds, WAV or FLAC; channels are averaged
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub(crate) dry: Vec<PathBuf>,
    /// Clips of each response
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub(crate) clips: u32,
    /// Length of a clip, seconds
    #[arg(long, value_name = "S", default_value_t = 1.0)]
    pub(crate) clip: f64,
    /// Share of the clips that are for testing
    #[arg(long, value_name = "SHARE", default_value_t = 0.2, value_parser = within(0.0_f64, 1.0))]
    pub(crate) test_share: f64,
}

/// Clips that are for testing, besides those that a capture has for it.
#[derive(Debug, Args)]
pub(crate) struct HoldOutArgs {
    /// Emitter of which nothing is learnt: all clips that it plays in are for testing
    #[arg(long, value_name = "NAME")]
    pub(crate) test_emitter: Vec<String>,
    /// Track of which nothing is learnt: all its clips are for testing
    #[arg(long, value_name = "NAME")]
    pub(crate) test_track: Vec<String>,
}

#[derive(Debug, Args)]
pub(crate) struct FromResponsesArgs {
    #[command(flatten)]
    pub(crate) set: ResponsesArgs,
    /// Folder to write
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) clips: ClipArgs,
    /// Seed of the choice of stretches and of the split
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Sample rate of the capture, hertz; without it the responses'
    #[arg(long, value_name = "HZ", value_parser = clap::value_parser!(u32).range(1_000..=1_000_000))]
    pub(crate) rate: Option<u32>,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub(crate) enum LayoutArg {
    /// One walk with a pose a second: source_syn_re.wav, binaural_syn_re.wav, gs_cameras.json or transforms_scale_*.json
    Rwavs,
}

#[derive(Debug, Args)]
pub(crate) struct ImportCaptureArgs {
    /// Folder of the data set: one scene or room
    pub(crate) folder: PathBuf,
    /// How it is laid out
    #[arg(long, value_enum)]
    pub(crate) layout: LayoutArg,
    /// Folder to write
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
    /// Where the sound came from, metres in the capture's world
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) emitter: Option<Vec3>,
    #[command(flatten)]
    pub(crate) placement: PlacementArgs,
    /// Title of the capture instead of the folder's name
    #[arg(long)]
    pub(crate) title: Option<String>,
    /// Whom to credit
    #[arg(long, default_value = "")]
    pub(crate) credit: String,
    /// Terms of the data
    #[arg(long, default_value = "")]
    pub(crate) licence: String,
    /// Sample rate of the capture, hertz [default: 22050]
    #[arg(long, value_name = "HZ", value_parser = clap::value_parser!(u32).range(1_000..=1_000_000))]
    pub(crate) rate: Option<u32>,
}

#[derive(Debug, Args)]
pub(crate) struct CheckArgs {
    /// Folder with a capture.json
    pub(crate) capture: PathBuf,
    #[command(flatten)]
    pub(crate) json: JsonFile,
}

#[derive(Debug, Args)]
pub(crate) struct EmitterArgs {
    /// Folder with a capture.json
    pub(crate) capture: PathBuf,
    #[command(flatten)]
    pub(crate) json: JsonFile,
    /// Put the position into the capture's manifest
    #[arg(long)]
    pub(crate) write: bool,
    /// Replace the emitter that the manifest has
    #[arg(long, requires = "write")]
    pub(crate) force: bool,
}
