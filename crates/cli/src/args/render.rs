//! Arguments of `promenade render`.

use super::sound::SoundArgs;
use super::values::{parse_bits, parse_latency, parse_point, parse_pose, parse_tier, within};
use clap::{Args, ValueEnum};
use promenade_baker::player::Playing;
use promenade_baker::wav::Format;
use promenade_core::glam::Vec3;
use promenade_core::{Latency, LiveParams, Pose};
use std::path::PathBuf;

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum OutputFormat {
    /// Both ears
    Binaural,
    /// Ambisonics: channels in ACN order, SN3D, along the axes of the listener's head
    Ambix,
}

/// Where a further sound comes from.
#[derive(Clone, Debug)]
pub(crate) enum Place {
    /// A point of the scene, metres.
    Point(Vec3),
    /// Along the camera path of a file.
    Path(PathBuf),
}

/// Parses `X,Y,Z=SOUND` or `PATH=SOUND`.
fn parse_source(text: &str) -> Result<(Place, PathBuf), String> {
    let (place, sound) = text.split_once('=').ok_or("expected X,Y,Z=SOUND or PATH=SOUND")?;
    Ok((parse_point(place).map_or_else(|_| Place::Path(place.into()), Place::Point), sound.into()))
}

#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    /// Scene file
    pub(crate) scene: PathBuf,
    /// Dry sound, WAV or FLAC, mono or stereo
    pub(crate) input: PathBuf,
    /// WAV file to write
    pub(crate) output: PathBuf,
    /// Camera path: .json, .csv, a COLMAP model's folder or images.txt or .bin, a NeRF tool's transforms.json, .gltf or .glb
    #[arg(long, conflicts_with = "pose")]
    pub(crate) path: Option<PathBuf>,
    /// One pose for the whole file: metres and degrees; without it and without --path, the scene's start pose
    #[arg(long, value_name = "X,Y,Z,YAW,PITCH,ROLL", value_parser = parse_pose, allow_hyphen_values = true)]
    pub(crate) pose: Option<Pose>,
    /// Tier: draft, standard, high or reference, or clip for the published model clip by clip [default: standard, or the
    /// cheapest that the scene has]
    #[arg(long, value_parser = parse_tier)]
    pub(crate) tier: Option<Playing>,
    /// Decodes a second of the tiers high and reference
    #[arg(long, value_name = "HZ", default_value_t = LiveParams::default().rate_hz, value_parser = within(1.0_f32, 1000.0))]
    pub(crate) decode_rate: f32,
    /// How the scene is played: in frames, or with a latency of 64 samples or none, as the plugin can; no latency is heard in
    /// the file, poses are up to a hop and a half later
    #[arg(long, default_value = "frame", value_parser = parse_latency)]
    pub(crate) latency: Latency,
    /// What is written; Ambisonics of scenes of image sources alone
    #[arg(long, value_enum, default_value = "binaural")]
    pub(crate) format: OutputFormat,
    /// Order of Ambisonics: 4, 9 or 16 channels
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u8).range(1..=3))]
    pub(crate) order: u8,
    /// Where the sound comes from, metres, instead of the scene's own emitter; of scenes that were trained with several
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) emitter: Option<Vec3>,
    /// A further sound in the same room and where it is, metres, or a camera path for it to move along; may be given up to 63
    /// times. Each has its own direct sound and early reflections, and they share what comes later
    #[arg(long, value_name = "X,Y,Z|PATH=SOUND", value_parser = parse_source, allow_hyphen_values = true)]
    pub(crate) source: Vec<(Place, PathBuf)>,
    /// SOFA file of head-related responses: your own head in the place of the scene's
    #[arg(long, value_name = "FILE")]
    pub(crate) head: Option<PathBuf>,
    /// What headphones need: a text by AutoEq (ParametricEQ.txt, GraphicEQ.txt) or a SOFA file of headphone responses
    #[arg(long, value_name = "FILE")]
    pub(crate) headphones: Option<PathBuf>,
    /// Share of the rendered sound, 0 to 1
    #[arg(long, default_value_t = 1.0, value_parser = within(0.0_f32, 1.0))]
    pub(crate) mix: f32,
    /// Output gain, dB
    #[arg(long, value_name = "DB", default_value_t = 0.0, value_parser = within(-120.0_f32, 60.0), allow_hyphen_values = true)]
    pub(crate) gain: f32,
    /// Start the path over at its end
    #[arg(long = "loop", requires = "path")]
    pub(crate) looping: bool,
    /// Path seconds per second of sound; negative runs backwards
    #[arg(long, default_value_t = 1.0, requires = "path", allow_hyphen_values = true)]
    #[arg(value_parser = within(-1000.0_f64, 1000.0))]
    pub(crate) speed: f64,
    /// Sample format: 16, 24, 32 or 32f (float)
    #[arg(long, default_value = "24", value_parser = parse_bits)]
    pub(crate) bits: Format,
    /// Samples rendered at a time
    #[arg(long, default_value_t = 4096, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub(crate) block: u32,
    #[command(flatten)]
    pub(crate) sound: SoundArgs,
}
