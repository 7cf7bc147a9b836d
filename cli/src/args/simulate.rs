//! Arguments of `promenade simulate`.

use super::values::{parse_absorption, parse_point, within};
use clap::{Args, Subcommand};
use promenade_baker::simulation::{Absorption, MAX_LENGTH_S};
use promenade_core::glam::Vec3;
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(crate) enum Simulate {
    /// A box room with six walls, by image sources and a statistical tail
    Box(SimulateBoxArgs),
}

#[derive(Debug, Args)]
pub(crate) struct SimulateBoxArgs {
    /// Length, width and height, metres; the room is the box from the origin to this corner
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point)]
    pub(crate) size: Vec3,
    /// Where the sound comes from, metres
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point)]
    pub(crate) emitter: Vec3,
    /// Share of the energy that walls absorb: 1 number or 7 for the octaves from 125 Hz to 8 kHz, of all walls or of six parted by
    /// semicolons: x = 0, x = X, y = 0, y = Y, floor, ceiling
    #[arg(long, value_name = "A", default_value = "0.2", value_parser = parse_absorption)]
    pub(crate) absorption: [Absorption; 6],
    /// Head: free-field responses all around it, a SOFA file or a set of responses
    #[arg(long, value_name = "FILE.sofa")]
    pub(crate) head: PathBuf,
    /// Walk of the listener, any form of camera path; without it random poses
    #[arg(long, value_name = "WALK")]
    pub(crate) path: Option<PathBuf>,
    /// Scale and move the walk so that it fills the room up to this margin, metres; without it, it is in the room's coordinates
    #[arg(long, value_name = "M", requires = "path", value_parser = within(0.0_f32, 1000.0))]
    pub(crate) fit: Option<f32>,
    /// Listener poses, evenly over the walk's time or random ones [default: the walk's keyframes, or 100 random ones]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) poses: Option<u32>,
    /// Distance of random poses from the walls, metres
    #[arg(long, value_name = "M", default_value_t = 0.5, conflicts_with = "path", value_parser = within(0.0_f32, 1000.0))]
    pub(crate) margin: f32,
    /// Walls that an image source has met at most
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u32).range(0..=20))]
    pub(crate) order: u32,
    /// Length of the responses, seconds [default: the longest reverberation time, at most 4]
    #[arg(long, value_name = "S", value_parser = within(0.001, MAX_LENGTH_S))]
    pub(crate) length: Option<f32>,
    /// Sample rate of the responses, hertz
    #[arg(long, value_name = "HZ", default_value_t = 24_000, value_parser = clap::value_parser!(u32).range(8_000..=192_000))]
    pub(crate) rate: u32,
    /// Seed of the tails' noise and of random poses
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Folder to write: WAV files and a responses.json
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
}
