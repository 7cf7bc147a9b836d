//! Arguments of `promenade responses`.

use super::bake::ResponsesArgs;
use super::values::{parse_point, within};
use clap::{Args, Subcommand, ValueEnum};
use promenade_core::glam::Vec3;
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(crate) enum ResponsesCommand {
    /// Write the responses.json of a folder of sound files from their names
    Manifest(ManifestArgs),
    /// Make binaural responses at all turns of the head from Ambisonic ones (orders 1 to 4, AmbiX, N3D or FuMa)
    Ambisonic(AmbisonicArgs),
}

#[derive(Debug, Args)]
pub(crate) struct ManifestArgs {
    /// Folder of two-channel sound files: WAV, FLAC or AIFF
    pub(crate) folder: PathBuf,
    /// Title of the set instead of the folder's name
    #[arg(long)]
    pub(crate) title: Option<String>,
    /// Metres to the sources, where the names have azimuths and no distances
    #[arg(long, value_name = "M", value_parser = within(0.01_f32, 100.0))]
    pub(crate) distance: Option<f32>,
    /// Where the sound came from, metres, where the names have no azimuths
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) emitter: Option<Vec3>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum NormalisationArg {
    /// As in AmbiX
    Sn3d,
    /// All channels of equal energy in a diffuse field
    N3d,
    /// Furse and Malham's, with W, X, Y, Z first
    Fuma,
}

#[derive(Debug, Args)]
pub(crate) struct AmbisonicArgs {
    #[command(flatten)]
    pub(crate) set: ResponsesArgs,
    /// Head: free-field responses all around it, a SOFA file or a set of responses
    #[arg(long, alias = "hrtf", value_name = "FILE.sofa")]
    pub(crate) head: PathBuf,
    /// Folder to write: WAV files and a responses.json
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
    /// How the channels are ordered and scaled [default: sn3d, and fuma of a file .amb]
    #[arg(long, value_enum)]
    pub(crate) normalisation: Option<NormalisationArg>,
    /// Metres to the source, where the set does not say it; its direction is then that of the direct sound
    #[arg(long, value_name = "M", value_parser = within(0.01_f32, 100.0))]
    pub(crate) distance: Option<f32>,
    /// Directions of the head, evenly around
    #[arg(long, value_name = "N", default_value_t = 72, value_parser = within(4_usize, 360))]
    pub(crate) yaws: usize,
}
