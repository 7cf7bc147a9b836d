//! The command line.

mod anchors;
mod capture;
mod eval;
mod path;
mod placement;
mod simulate;
#[cfg(feature = "train")]
mod train;
mod values;

use clap::{ArgGroup, Args, Parser, Subcommand, ValueEnum};
use promenade_baker::player::Playing;
use promenade_baker::wav::Format;
use promenade_core::glam::Vec3;
use promenade_core::network::{CloudKind, PoseConvention};
use promenade_core::published::{ConvMode, Projection};
use promenade_core::{LiveParams, Pose};
use std::path::PathBuf;
use values::{
    parse_bits, parse_bounds, parse_conv, parse_convention, parse_decode_rate, parse_gain, parse_kind, parse_mix, parse_pair,
    parse_pose, parse_projection, parse_setting, parse_speed, parse_tail, parse_tier,
};

pub(crate) use anchors::AnchorsArgs;
pub(crate) use capture::{CaptureCommand, CheckArgs, EmitterArgs, FromResponsesArgs, ImportCaptureArgs, LayoutArg, MixArgs};
pub(crate) use eval::{EvalArgs, PosesArg};
pub(crate) use path::PathArgs;
use placement::PlacementArgs;
pub(crate) use simulate::{Simulate, SimulateBoxArgs};
#[cfg(feature = "train")]
pub(crate) use train::TrainArgs;

/// Make a dry track sound as in a real, captured place, for a listener who walks and turns.
#[derive(Debug, Parser)]
#[command(name = "promenade", version)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Make a scene from measurements
    Bake {
        #[command(subcommand)]
        source: BakeSource,
    },
    /// Make a scene from a trained AV-Cloud checkpoint
    Import(Box<ImportArgs>),
    /// Render a WAV file through a scene, along a path or at one pose
    Render(RenderArgs),
    /// Render a WAV file through a plugin as a host does, with automation, or list its parameters
    Host(HostArgs),
    /// Convert a camera path, or show what it is: JSON, CSV, COLMAP cameras or a glTF animation
    Path(PathArgs),
    /// Make the anchors of a model: of a reconstruction, a cloud of points or splats, a mesh or a box
    Anchors(Box<AnchorsArgs>),
    /// Make binaural responses of a simulated room, to bake or to train on
    Simulate {
        #[command(subcommand)]
        what: Box<Simulate>,
    },
    /// Show what a scene file holds
    Inspect(InspectArgs),
    /// Compare a scene with the measurements held out of it and its streams with its model's clips, or measure a response
    Measure(MeasureArgs),
    /// Make, import and check captures: recordings of a walk beside their dry sound
    Capture {
        #[command(subcommand)]
        command: CaptureCommand,
    },
    /// Learn a scene from a capture and anchors
    #[cfg(feature = "train")]
    Train(TrainArgs),
    /// Judge scenes on the recordings of captures, beside baselines
    Eval(EvalArgs),
}

#[derive(Debug, Subcommand)]
pub(crate) enum BakeSource {
    /// From binaural room responses: a folder with a responses.json, a manifest (.json) or a SOFA file
    Responses(BakeResponsesArgs),
    /// From a scene's own anchor cloud: a table that plays in the tiers draft and standard
    Field(BakeFieldArgs),
}

#[derive(Debug, Args)]
pub(crate) struct BakeFieldArgs {
    /// Scene file with an anchor cloud
    pub(crate) scene: PathBuf,
    /// Scene file to write
    #[arg(short, long, value_name = "SCENE")]
    pub(crate) output: PathBuf,
    /// Listener positions that are tabulated, metres; without it the scene's bounds
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", value_parser = parse_bounds, allow_hyphen_values = true)]
    pub(crate) bounds: Option<(Vec3, Vec3)>,
    /// Lowest and highest pitch, degrees
    #[arg(long, value_name = "LOW,HIGH", default_value = "-90,90", value_parser = parse_pair, allow_hyphen_values = true)]
    pub(crate) pitch: (f32, f32),
    /// Lowest and highest roll, degrees
    #[arg(long, value_name = "LOW,HIGH", default_value = "-180,180", value_parser = parse_pair, allow_hyphen_values = true)]
    pub(crate) roll: (f32, f32),
    /// Error of levels at which the table is fine enough, dB
    #[arg(long, value_name = "DB", default_value_t = 0.1)]
    pub(crate) error_db: f32,
    /// Largest table, megabytes
    #[arg(long, value_name = "MB", default_value_t = 16.0)]
    pub(crate) max_mb: f32,
    /// Seed of the poses that are tried
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
}

#[derive(Debug, Args)]
pub(crate) struct ImportArgs {
    /// Checkpoint of the published trainer (.pth), or what export_avcloud.py wrote (.safetensors)
    pub(crate) checkpoint: PathBuf,
    /// Scene file to write
    #[arg(short, long, value_name = "SCENE")]
    pub(crate) output: PathBuf,
    /// Anchor positions and features (.safetensors or .npz), which a checkpoint does not hold
    #[arg(long, value_name = "FILE")]
    pub(crate) anchors: Option<PathBuf>,
    /// Distance that relative vectors were divided by in training
    #[arg(long, value_name = "UNITS")]
    pub(crate) max_norm: Option<f32>,
    /// Sample rate of the training, hertz; otherwise the file's or 22050
    #[arg(long, value_name = "HZ")]
    pub(crate) sample_rate: Option<f64>,
    /// Transform length, samples; otherwise the file's or 512
    #[arg(long, value_name = "SAMPLES")]
    pub(crate) n_fft: Option<usize>,
    /// Hop, samples; otherwise the file's or 127
    #[arg(long, value_name = "SAMPLES")]
    pub(crate) hop: Option<usize>,
    /// Attention heads; otherwise the file's or 4
    #[arg(long)]
    pub(crate) heads: Option<usize>,
    /// Decoder: full, sh or simple-sh; otherwise the weights tell
    #[arg(long, value_parser = parse_kind)]
    pub(crate) kind: Option<CloudKind>,
    /// How the head's rotation was applied in training: published or physical
    #[arg(long, value_parser = parse_convention)]
    pub(crate) convention: Option<PoseConvention>,
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
    /// Convolution layers in the tier reference: off, causal, or look-ahead, which adds 5 hops of latency to all tiers
    #[arg(long, default_value = "look-ahead", value_parser = parse_conv)]
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

#[derive(Debug, Args)]
pub(crate) struct BakeResponsesArgs {
    /// Folder, manifest or SOFA file
    pub(crate) source: PathBuf,
    /// Scene file to write
    #[arg(short, long, value_name = "SCENE")]
    pub(crate) output: PathBuf,
    /// Folder of the WAV files that a manifest names
    #[arg(long, value_name = "DIR")]
    pub(crate) root: Option<PathBuf>,
    /// Responses to keep for judging the scene: azimuth=odd5, azimuth=-85..85/10, every=5+2, names=A,B, yaw=40, joined by ';'
    #[arg(long, value_name = "RULE", default_value = "none")]
    pub(crate) hold_out: String,
    /// Title of the scene instead of the set's
    #[arg(long)]
    pub(crate) title: Option<String>,
    /// Side to which azimuths grow, where the data say it wrongly
    #[arg(long, value_name = "SIDE")]
    pub(crate) azimuth_positive: Option<SideArg>,
    /// Emitter to use of a SOFA file with several, counted from 0
    #[arg(long = "source", value_name = "N")]
    pub(crate) source_number: Option<usize>,
    /// Frame of the short-time transform, milliseconds; 13/16 of it are the scene's latency
    #[arg(long, value_name = "MS", default_value_t = 20.0)]
    pub(crate) window_ms: f64,
    /// Explicit part of the room's sound, milliseconds; an exponential part follows it
    #[arg(long, value_name = "MS", default_value_t = 160.0)]
    pub(crate) early_ms: f64,
    /// Seed of the tail's pseudo-random phases
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum SideArg {
    Left,
    Right,
}

#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    /// Scene file
    pub(crate) scene: PathBuf,
    /// Dry WAV file, mono or stereo
    pub(crate) input: PathBuf,
    /// Binaural WAV file to write
    pub(crate) output: PathBuf,
    /// Camera path: .json, .csv, a COLMAP model's folder or images.txt or .bin, .gltf or .glb
    #[arg(long, conflicts_with = "pose")]
    pub(crate) path: Option<PathBuf>,
    /// One pose for the whole file: metres and degrees; without it and without a path, the scene's start pose
    #[arg(long, value_name = "X,Y,Z,YAW,PITCH,ROLL", value_parser = parse_pose, allow_hyphen_values = true)]
    pub(crate) pose: Option<Pose>,
    /// Point on the curve of speed against accuracy: draft, standard, high or reference, or clip for the published model clip by
    /// clip; without it standard, or the cheapest that the scene has
    #[arg(long, value_parser = parse_tier)]
    pub(crate) tier: Option<Playing>,
    /// Decodes a second of the tiers high and reference
    #[arg(long, value_name = "HZ", default_value_t = LiveParams::default().rate_hz, value_parser = parse_decode_rate)]
    pub(crate) decode_rate: f32,
    /// Share of the rendered sound, 0 to 1
    #[arg(long, default_value_t = 1.0, value_parser = parse_mix)]
    pub(crate) mix: f32,
    /// Output gain, dB
    #[arg(long, value_name = "DB", default_value_t = 0.0, value_parser = parse_gain, allow_hyphen_values = true)]
    pub(crate) gain: f32,
    /// Start the path over at its end
    #[arg(long = "loop", requires = "path")]
    pub(crate) looping: bool,
    /// Path seconds per second of sound; negative runs backwards
    #[arg(long, default_value_t = 1.0, requires = "path", value_parser = parse_speed, allow_hyphen_values = true)]
    pub(crate) speed: f64,
    /// Sample format: 16, 24, 32 or 32f (float)
    #[arg(long, default_value = "24", value_parser = parse_bits)]
    pub(crate) bits: Format,
    /// Samples rendered at a time
    #[arg(long, default_value_t = 4096, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub(crate) block: u32,
}

#[derive(Debug, Args)]
pub(crate) struct HostArgs {
    /// Plugin: a file or folder whose name ends in .clap or .vst3
    pub(crate) bundle: PathBuf,
    /// Dry WAV file, mono or stereo
    #[arg(required_unless_present = "list")]
    pub(crate) input: Option<PathBuf>,
    /// Stereo WAV file to write, 32-bit float
    #[arg(required_unless_present = "list")]
    pub(crate) output: Option<PathBuf>,
    /// Name, vendor, version, latency and parameters of the plugin instead of a rendering
    #[arg(long, conflicts_with_all = ["input", "output", "automation", "tail", "save_state"])]
    pub(crate) list: bool,
    /// Plugin of a bundle with several, by name or id; without it the first
    #[arg(long, value_name = "NAME")]
    pub(crate) plugin: Option<String>,
    /// Values of parameters over time, JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) automation: Option<PathBuf>,
    /// State to start from: a VST3 preset (.vstpreset), or what --save-state has written
    #[arg(long, value_name = "FILE")]
    pub(crate) state: Option<PathBuf>,
    /// Value of a parameter, by name or number, as the plugin writes it
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = parse_setting)]
    pub(crate) settings: Vec<(String, String)>,
    /// Write the plugin's state as it is at the start
    #[arg(long, value_name = "FILE")]
    pub(crate) save_state: Option<PathBuf>,
    /// Sample rate of the plugin and the output, hertz, to which the input is converted; without it the input's
    #[arg(long, value_name = "HZ", value_parser = clap::value_parser!(u32).range(1_000..=1_000_000))]
    pub(crate) rate: Option<u32>,
    /// Samples played at a time
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub(crate) block: u32,
    /// Tell the plugin that it plays in real time; it still runs as fast as it can
    #[arg(long)]
    pub(crate) realtime: bool,
    /// Silence after the input, seconds
    #[arg(long, value_name = "S", default_value_t = 0.0, value_parser = parse_tail)]
    pub(crate) tail: f64,
}

#[derive(Debug, Args)]
pub(crate) struct InspectArgs {
    /// Scene file
    pub(crate) scene: PathBuf,
    /// As JSON
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(group(ArgGroup::new("subject").args(["scene", "response"]).required(true)))]
pub(crate) struct MeasureArgs {
    /// Scene file, baked with --hold-out or with an anchor cloud
    pub(crate) scene: Option<PathBuf>,
    /// How the comparison of a scene is written
    #[arg(long, value_enum, default_value_t = TableForm::Text, conflicts_with = "response")]
    pub(crate) format: TableForm,
    /// Length of the rendered responses, seconds; without it, one and a half times the longest decay
    #[arg(long, value_name = "S", conflicts_with = "response")]
    pub(crate) seconds: Option<f64>,
    /// Dry mono sound (WAV) that an anchor cloud's streams are compared on; without it, noise bursts and tone clicks
    #[arg(long, value_name = "FILE", conflicts_with = "response")]
    pub(crate) input: Option<PathBuf>,
    /// Poses that an anchor cloud's streams are compared at, the start pose and random ones; without it, 6
    #[arg(long, value_name = "N", conflicts_with = "response", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) poses: Option<u32>,
    /// Binaural impulse response (WAV) to measure, as JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) response: Option<PathBuf>,
    /// Response or rendering (WAV) to compare the other with
    #[arg(long, value_name = "FILE", requires = "response")]
    pub(crate) reference: Option<PathBuf>,
    /// Also the modulation of the tail at this hop rate, hertz
    #[arg(long, value_name = "HZ", requires = "response")]
    pub(crate) hop_hz: Option<f64>,
    /// Start of that tail, seconds
    #[arg(long, value_name = "S", default_value_t = 0.5, requires = "hop_hz")]
    pub(crate) from: f64,
    /// End of that tail, seconds
    #[arg(long, value_name = "S", default_value_t = 0.9, requires = "hop_hz")]
    pub(crate) to: f64,
    /// Also the power beside a tone of this frequency, hertz
    #[arg(long, value_name = "HZ", requires = "response")]
    pub(crate) tone_hz: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub(crate) enum TableForm {
    Text,
    Markdown,
    Json,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_grammar_holds_together() {
        Cli::command().debug_assert();
    }
}
