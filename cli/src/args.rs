//! The command line.

use clap::{ArgGroup, Args, Parser, Subcommand, ValueEnum};
use promenade_baker::wav::Format;
use promenade_core::glam::Vec3;
use promenade_core::{LiveParams, Pose, Tier};
use std::path::PathBuf;

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
    /// Render a WAV file through a scene, along a path or at one pose
    Render(RenderArgs),
    /// Show what a scene file holds
    Inspect(InspectArgs),
    /// Compare a scene with the measurements held out of it, or measure a response
    Measure(MeasureArgs),
}

#[derive(Debug, Subcommand)]
pub(crate) enum BakeSource {
    /// From binaural room responses: a folder with a responses.json, a manifest (.json) or a SOFA file
    Responses(BakeResponsesArgs),
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
    /// Camera path, .json or .csv
    #[arg(long, conflicts_with = "pose")]
    pub(crate) path: Option<PathBuf>,
    /// One pose for the whole file: metres and degrees; without it and without a path, the scene's start pose
    #[arg(long, value_name = "X,Y,Z,YAW,PITCH,ROLL", value_parser = parse_pose, allow_hyphen_values = true)]
    pub(crate) pose: Option<Pose>,
    /// Point on the curve of speed against accuracy: draft, standard, high or reference
    #[arg(long, default_value = "standard", value_parser = parse_tier)]
    pub(crate) tier: Tier,
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
    /// Scene file, baked with --hold-out
    pub(crate) scene: Option<PathBuf>,
    /// How the comparison of a scene is written
    #[arg(long, value_enum, default_value_t = TableForm::Text, conflicts_with = "response")]
    pub(crate) format: TableForm,
    /// Length of the rendered responses, seconds; without it, one and a half times the longest decay
    #[arg(long, value_name = "S", conflicts_with = "response")]
    pub(crate) seconds: Option<f64>,
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

fn parse_pose(text: &str) -> Result<Pose, String> {
    let numbers: Result<Vec<f32>, _> = text.split(',').map(|n| n.trim().parse::<f32>()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z, yaw, pitch, roll]) if [x, y, z, yaw, pitch, roll].iter().all(|v| v.is_finite()) => {
            Ok(Pose::from_ypr(Vec3::new(x, y, z), yaw.to_radians(), pitch.to_radians(), roll.to_radians()))
        }
        Ok(numbers) if numbers.len() != 6 => Err(format!("expected 6 numbers x,y,z,yaw,pitch,roll, found {}", numbers.len())),
        _ => Err("expected 6 finite numbers x,y,z,yaw,pitch,roll".to_owned()),
    }
}

fn parse_tier(text: &str) -> Result<Tier, String> {
    Tier::from_name(text).ok_or_else(|| format!("expected one of {}", Tier::ALL.map(Tier::name).join(", ")))
}

fn parse_within<T: std::str::FromStr + PartialOrd + std::fmt::Display>(text: &str, low: T, high: T) -> Result<T, String> {
    let wrong = || format!("expected a number from {low} to {high}");
    let value = text.parse::<T>().map_err(|_| wrong())?;
    if value >= low && value <= high { Ok(value) } else { Err(wrong()) }
}

fn parse_mix(text: &str) -> Result<f32, String> {
    parse_within(text, 0.0, 1.0)
}

fn parse_decode_rate(text: &str) -> Result<f32, String> {
    parse_within(text, 1.0, 1000.0)
}

fn parse_gain(text: &str) -> Result<f32, String> {
    parse_within(text, -120.0, 60.0)
}

fn parse_speed(text: &str) -> Result<f64, String> {
    parse_within(text, -1000.0, 1000.0)
}

fn parse_bits(text: &str) -> Result<Format, String> {
    match text {
        "16" => Ok(Format::Int16),
        "24" => Ok(Format::Int24),
        "32" => Ok(Format::Int32),
        "32f" => Ok(Format::Float32),
        _ => Err("expected 16, 24, 32 or 32f".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_grammar_holds_together() {
        Cli::command().debug_assert();
    }

    #[test]
    fn poses_are_in_degrees() {
        let pose = parse_pose("1,2,3, 90,0,0").unwrap();
        assert!((pose.orientation * Vec3::X - Vec3::Y).length() < 1e-6, "yaw 90 faces left");
        assert_eq!(pose.position, Vec3::new(1.0, 2.0, 3.0));
        assert!(parse_pose("1,2,3").unwrap_err().contains("found 3"));
        assert!(parse_pose("1,2,3,inf,0,0").is_err() && parse_pose("a,b").is_err());
    }
}
