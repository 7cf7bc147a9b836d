//! Arguments of `promenade import`.

use super::placement::PlacementArgs;
use super::values::{named, parse_bounds, parse_pose, parse_projection};
use clap::Args;
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use promenade_core::published::{ConvMode, Projection};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct ImportArgs {
    /// Checkpoint of the published trainer as export_avcloud.py writes it (.safetensors)
    pub(crate) checkpoint: PathBuf,
    /// Scene file to write
    #[arg(short, long, value_name = "SCENE")]
    pub(crate) output: PathBuf,
    /// Anchor positions and features (.safetensors) in place of those beside the weights
    #[arg(long, value_name = "FILE")]
    pub(crate) anchors: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) placement: PlacementArgs,
    /// Listener positions that the scene is for, metres; without it the anchors' box
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", value_parser = parse_bounds, allow_hyphen_values = true)]
    pub(crate) bounds: Option<(Vec3, Vec3)>,
    /// Pose to start at: metres and degrees; without it the middle of the bounds
    #[arg(long, value_name = "X,Y,Z,YAW,PITCH,ROLL", value_parser = parse_pose, allow_hyphen_values = true)]
    pub(crate) start: Option<Pose>,
    /// Taps that the time filter becomes, one a hop
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub(crate) taps: u32,
    /// Play the published head with its convolution layers: off, causal, or look-ahead, which adds 5 hops of latency
    #[arg(long, default_value = "off", value_parser = named(ConvMode::from_name, "off, causal or look-ahead"))]
    pub(crate) conv: ConvMode,
    /// How the time filter becomes taps: diagonal, or row=N for one output frame of the clip
    #[arg(long, default_value = "diagonal", value_parser = parse_projection)]
    pub(crate) projection: Projection,
    /// Seed of the taps' pseudo-random phases
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Title of the scene instead of the file's name
    #[arg(long)]
    pub(crate) title: Option<String>,
    /// Whom to credit
    #[arg(long, default_value = "")]
    pub(crate) credit: String,
    /// Licence of the recordings behind the scene
    #[arg(long, default_value = "")]
    pub(crate) licence: String,
}
