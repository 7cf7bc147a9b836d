//! Arguments of `promenade responses`.

use super::bake::ResponsesArgs;
use super::values::within;
use clap::{Args, Subcommand, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(crate) enum ResponsesCommand {
    /// Make binaural responses at all turns of the head from Ambisonic ones (orders 1 to 4, AmbiX, N3D or FuMa)
    Ambisonic(AmbisonicArgs),
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
