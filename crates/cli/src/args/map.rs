//! Arguments of `promenade map`.

use super::air::AirArgs;
use super::simulate::RoomArgs;
use super::values::{parse_pixels, parse_pose, within};
use clap::{Args, Subcommand, ValueEnum};
use promenade_acoustics::RayOptions;
use promenade_core::Pose;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct MapArgs {
    #[command(subcommand)]
    pub(crate) what: Option<Map>,
    #[command(flatten)]
    pub(crate) room: Option<RoomArgs>,
    /// Distance of the places from each other, metres [default: a 40th of the longer side of the plan]
    #[arg(long, value_name = "M", value_parser = within(0.01_f32, 1000.0))]
    pub(crate) grid: Option<f32>,
    /// Height of the plan over the lowest point of the mesh, metres
    #[arg(long, value_name = "M", default_value_t = 1.5, value_parser = within(0.0_f32, 1000.0))]
    pub(crate) height: f32,
    /// Distance of the places from surfaces, metres
    #[arg(long, value_name = "M", default_value_t = 0.1, value_parser = within(0.0_f32, 1000.0))]
    pub(crate) margin: f32,
    /// Reflections that an image source has at most
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(0..=50))]
    pub(crate) order: u32,
    /// Beams that search the image sources
    #[arg(long, value_name = "N", default_value_t = 8192, value_parser = clap::value_parser!(u32).range(1..=1 << 22))]
    pub(crate) beams: u32,
    /// Rays of the late field [default: 65536, with --camera 262144]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 28))]
    pub(crate) rays: Option<u32>,
    #[command(flatten)]
    pub(crate) trace: TraceArgs,
    /// What a camera there sees, coloured by the sound that falls on it, instead of a plan; metres and degrees
    #[arg(long, value_name = "X,Y,Z,YAW,PITCH,ROLL", value_parser = parse_pose, allow_hyphen_values = true)]
    #[arg(conflicts_with_all = ["grid", "height", "margin", "order", "beams"])]
    pub(crate) camera: Option<Pose>,
    /// Horizontal angle of the camera's picture, degrees
    #[arg(long, value_name = "DEG", default_value_t = 90.0, requires = "camera", value_parser = within(1.0_f32, 170.0))]
    pub(crate) fov: f32,
    /// Width and height of the camera's picture, pixels
    #[arg(long, value_name = "W,H", default_value = "640,480", requires = "camera", value_parser = parse_pixels)]
    pub(crate) size: [usize; 2],
    /// Picture to write: .png, .exr, or for a plan .svg; may be given more than once
    #[arg(short, long, value_name = "FILE", required = true)]
    pub(crate) output: Vec<PathBuf>,
}

/// How rays are followed.
#[derive(Debug, Args)]
pub(crate) struct TraceArgs {
    /// How long rays are followed, seconds
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = within(0.05_f64, 30.0))]
    pub(crate) length: f64,
    /// Seed of the rays
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) air: AirArgs,
}

impl TraceArgs {
    /// The options of so many rays.
    pub(crate) fn options(&self, rays: u32) -> RayOptions<'static> {
        let air = Some(self.air.air());
        RayOptions { rays: rays as usize, length_s: self.length, air, seed: self.seed, ..RayOptions::default() }
    }
}

#[derive(Debug, Subcommand)]
pub(crate) enum Map {
    /// How much each moment of a mix stands out, and what a renderer of pictures may spend on each of its frames
    Saliency(SaliencyArgs),
    /// What a renderer of pictures may spend on each pixel, by what draws the eye in a picture and what is heard in it
    Mix(Box<MixMapArgs>),
    /// Frames of two pictures, blended at each moment's weight of a sound
    Composite(CompositeArgs),
    /// How many people would see that pictures differ from another, pixel by pixel
    Visibility(VisibilityArgs),
}

/// By what samples are shared out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Strategy {
    /// Each pixel the same
    Uniform,
    /// What draws the eye
    Image,
    /// The sound that falls on what is seen
    Sound,
    /// Both, by how much the moment of the mix stands out
    Mix,
}

#[derive(Debug, Args)]
pub(crate) struct MixMapArgs {
    #[command(flatten)]
    pub(crate) room: RoomArgs,
    /// A picture, for all of the sound, or a picture for each frame: .png, .jpg, or .exr in linear light
    #[arg(value_name = "PICTURE", required = true)]
    pub(crate) pictures: Vec<PathBuf>,
    /// The mix that is heard, WAV or FLAC
    #[arg(long, value_name = "MIX")]
    pub(crate) sound: PathBuf,
    /// Where the pictures were taken from; metres and degrees
    #[arg(long, value_name = "X,Y,Z,YAW,PITCH,ROLL", value_parser = parse_pose, allow_hyphen_values = true)]
    pub(crate) camera: Pose,
    /// Horizontal angle of the pictures, degrees
    #[arg(long, value_name = "DEG", default_value_t = 90.0, value_parser = within(1.0_f32, 170.0))]
    pub(crate) fov: f32,
    /// Pictures a second
    #[arg(long, value_name = "N", default_value_t = 25.0, value_parser = within(0.01, 240.0))]
    pub(crate) fps: f64,
    /// Samples per pixel that each picture has on average
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) samples: u32,
    /// Samples per pixel where nothing stands out [default: half of --samples]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=100_000))]
    pub(crate) least: Option<u32>,
    /// By what samples are shared out; may be given more than once
    #[arg(long, value_enum, default_value = "mix")]
    pub(crate) strategy: Vec<Strategy>,
    /// Rays of the sound
    #[arg(long, value_name = "N", default_value_t = 262_144, value_parser = clap::value_parser!(u32).range(1..=1 << 28))]
    pub(crate) rays: u32,
    #[command(flatten)]
    pub(crate) trace: TraceArgs,
    /// Folder to write to: for each strategy and picture samples per pixel as .exr, and as .png to look at
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct CompositeArgs {
    /// The picture that is shown while the sound has no weight: .png, .jpg, or .exr in linear light
    #[arg(value_name = "FIRST")]
    pub(crate) first: PathBuf,
    /// The picture that is shown at full weight
    #[arg(value_name = "SECOND")]
    pub(crate) second: PathBuf,
    /// The sound, WAV or FLAC
    #[arg(long, value_name = "MIX")]
    pub(crate) sound: PathBuf,
    /// Pictures a second
    #[arg(long, value_name = "N", default_value_t = 25.0, value_parser = within(1.0, 240.0))]
    pub(crate) fps: f64,
    /// Folder to write to: 0001.png and so on
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct VisibilityArgs {
    /// What the others are compared with: .png, .jpg, or .exr in linear light
    #[arg(value_name = "REFERENCE")]
    pub(crate) reference: PathBuf,
    /// Pictures of its size
    #[arg(value_name = "PICTURE", required = true)]
    pub(crate) pictures: Vec<PathBuf>,
    /// Folder for maps: by picture the share of people who see a difference at each pixel, as .png and as .exr
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct SaliencyArgs {
    /// The mix, WAV or FLAC
    #[arg(value_name = "MIX")]
    pub(crate) mix: PathBuf,
    /// Pictures a second
    #[arg(long, value_name = "N", default_value_t = 25.0, value_parser = within(1.0, 240.0))]
    pub(crate) fps: f64,
    /// Samples per pixel that all pictures have on average
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) samples: u32,
    /// Samples per pixel where nothing stands out [default: half of --samples]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=1_000_000))]
    pub(crate) least: Option<u32>,
    /// What to write: weights and samples per picture as .json, curves as .svg; may be given more than once
    #[arg(short, long, value_name = "FILE", required = true)]
    pub(crate) output: Vec<PathBuf>,
}
