//! Arguments of `promenade refine`.

use super::simulation::SimulationArgs;
use super::values::{parse_point, within};
use clap::Args;
use promenade_core::glam::Vec3;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct RefineArgs {
    /// Measured responses: of two ears, a .sofa file or a folder with a responses.json; a capture, whose
    /// responses are found; or of microphones, as `fit` takes them
    pub(crate) measured: PathBuf,
    /// Scene to write, of the refined simulation of --emitter; needs a head
    #[arg(short, long, value_name = "SCENE", requires = "emitter", required_unless_present = "evaluate")]
    pub(crate) output: Option<PathBuf>,
    /// Where the scene's sound comes from, metres: any place in the room
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) emitter: Option<Vec3>,
    #[command(flatten)]
    pub(crate) simulation: SimulationArgs,
    /// The flow of pi-AVAS instead of a regression
    #[arg(long, conflicts_with = "evaluate")]
    pub(crate) flow: bool,
    /// Steps of the training
    #[arg(long, default_value_t = 350, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) steps: u32,
    /// Seed of weights and order
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Judge by emitters that are held out of the training, and print a table
    #[arg(long)]
    pub(crate) evaluate: bool,
    /// Seeds of the judgement, whose mean and standard deviation are printed
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=100), requires = "evaluate")]
    pub(crate) seeds: u64,
    /// Responses of two ears to judge by, of the same emitters in the same order [default: what is held out]
    #[arg(long, value_name = "RESPONSES", requires = "evaluate")]
    pub(crate) judge_by: Option<PathBuf>,
    /// Emitters that are held out: those farther than this from where it is measured, metres
    #[arg(long, value_name = "M", value_parser = within(0.0_f32, 1000.0), conflicts_with = "test_source")]
    pub(crate) test_beyond: Option<f32>,
    /// An emitter that is held out, counted from 1 in the order of the set; may be given more than once
    #[arg(long = "test-emitter", alias = "test-source", value_name = "N")]
    pub(crate) test_source: Vec<usize>,
    /// Setting of a set of microphones with several, part of its files' names
    #[arg(long, value_name = "NAME")]
    pub(crate) setting: Option<String>,
    /// Sample rate at which a set of microphones is refined, hertz [default: its own]
    #[arg(long, value_name = "HZ", value_parser = clap::value_parser!(u32).range(8_000..=192_000))]
    pub(crate) rate: Option<u32>,
}
