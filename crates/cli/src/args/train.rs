//! Arguments of `promenade train`.

use super::capture::HoldOutArgs;
use super::less::LessArgs;
use super::simulation::SimulationArgs;
use super::values::within;
use clap::Args;
use std::path::PathBuf;

/// Threads of a training, at most: each holds the buffers of a clip.
pub(crate) const MAX_THREADS: usize = 256;

#[derive(Debug, Args)]
pub(crate) struct TrainArgs {
    /// Captures of one place to learn from: folders, or manifests ending in .json
    #[arg(required = true, value_name = "CAPTURE")]
    pub(crate) captures: Vec<PathBuf>,
    /// Anchors of the place, as `promenade anchors` writes them [default with --simulate: of the box around the room]
    #[arg(long, value_name = "FILE", required_unless_present = "simulate")]
    pub(crate) anchors: Option<PathBuf>,
    /// Scene file to write; the training is kept beside it, ending in .training, and goes on from there when it was stopped
    #[arg(short, long, value_name = "SCENE")]
    pub(crate) output: PathBuf,
    /// Sizes of the network, terms of the loss and course of the training (JSON)
    #[arg(long, value_name = "FILE")]
    pub(crate) settings: Option<PathBuf>,
    /// Steps in all
    #[arg(long)]
    pub(crate) steps: Option<usize>,
    /// Seed of weights, order and carriers
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// Clips rendered at a time, 1 to 256; without it as many as there are processors
    #[arg(long, value_parser = within(1_usize, MAX_THREADS))]
    pub(crate) threads: Option<usize>,
    /// Steps after which the training is kept
    #[arg(long, default_value_t = std::num::NonZero::<usize>::MIN.saturating_add(99))]
    pub(crate) keep_every: std::num::NonZero<usize>,
    /// Begin anew even where a training is kept
    #[arg(long)]
    pub(crate) restart: bool,
    /// Run the network on a graphics card
    #[arg(long)]
    pub(crate) gpu: bool,
    /// Write the course of the training as a picture (SVG)
    #[arg(long, value_name = "FILE")]
    pub(crate) curve: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) hold_out: HoldOutArgs,
    #[command(flatten)]
    pub(crate) simulation: SimulationArgs,
    #[command(flatten)]
    pub(crate) less: LessArgs,
    /// Emitter that the scene is of, a name of the captures [default: the first]; `render --emitter` moves it where the scene
    /// was trained with several
    #[arg(long, value_name = "NAME")]
    pub(crate) emitter: Option<String>,
    /// Name of the scene; without it the capture's
    #[arg(long)]
    pub(crate) title: Option<String>,
}
