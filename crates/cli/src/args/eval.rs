//! Arguments of `promenade eval`.

use super::capture::HoldOutArgs;
use super::figures::FigureFiles;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub(crate) enum PosesArg {
    /// The clip's middle, for the whole clip
    Fixed,
    /// The track's path
    Path,
}

#[derive(Debug, Args)]
pub(crate) struct EvalArgs {
    /// Scene files, each followed by the captures to judge it on: folders, or manifests ending in .json
    #[arg(required = true, num_args = 2.., value_name = "SCENE CAPTURE")]
    pub(crate) subjects: Vec<PathBuf>,
    /// Play a published model clip by clip, as it is trained, and not as a stream
    #[arg(long)]
    pub(crate) clips: bool,
    /// Where the listener is while a clip is rendered
    #[arg(long, value_enum, default_value_t = PosesArg::Fixed)]
    pub(crate) poses: PosesArg,
    /// Scale each scene by the gain that gives the training clips their energy
    #[arg(long)]
    pub(crate) fit_level: bool,
    /// Judge the scenes alone
    #[arg(long)]
    pub(crate) no_baselines: bool,
    /// Head (SOFA) for the baseline of distance and HRTF; without it a sphere for a head
    #[arg(long, alias = "hrtf", value_name = "FILE.sofa")]
    pub(crate) head: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) hold_out: HoldOutArgs,
    /// Judge by the clips of this emitter alone
    #[arg(long, value_name = "NAME")]
    pub(crate) emitter: Option<String>,
    #[command(flatten)]
    pub(crate) files: FigureFiles,
    /// Write what was recorded and what was rendered (WAV), for other metrics and for ears
    #[arg(long, value_name = "FOLDER")]
    pub(crate) wavs: Option<PathBuf>,
}
