//! Arguments of `promenade host`.

use super::values::{parse_setting, within};
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct HostArgs {
    /// Plugin: a file or folder whose name ends in .clap or .vst3
    pub(crate) bundle: PathBuf,
    /// Dry WAV file, mono or stereo
    #[arg(required_unless_present_any = ["list", "presets"])]
    pub(crate) input: Option<PathBuf>,
    #[arg(hide = true, conflicts_with = "output")]
    pub(crate) named: Option<PathBuf>,
    /// WAV file to write, 32-bit float, stereo unless --outputs says more
    #[arg(short, long, value_name = "FILE.wav", required_unless_present_any = ["list", "presets", "named"])]
    pub(crate) output: Option<PathBuf>,
    /// Name, vendor, version, latency and parameters of the plugin instead of a rendering
    #[arg(long, conflicts_with_all = ["input", "output", "tracks", "automation", "tail", "save_state"])]
    pub(crate) list: bool,
    /// The presets that a host's browser gets of the plugin instead of a rendering
    #[arg(
        long,
        conflicts_with_all = ["input", "output", "list", "tracks", "automation", "tail", "save_state", "state", "settings"]
    )]
    pub(crate) presets: bool,
    /// Plugin of a bundle with several, by name or id; without it the first
    #[arg(long, value_name = "NAME")]
    pub(crate) plugin: Option<String>,
    /// Mono WAV or FLAC file for the plugin's next input after the main one; may be repeated
    #[arg(long = "track", value_name = "FILE")]
    pub(crate) tracks: Vec<PathBuf>,
    /// Values of parameters over time, JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) automation: Option<PathBuf>,
    /// State to start from: a VST3 preset (.vstpreset), or what --save-state has written
    #[arg(long, value_name = "FILE")]
    pub(crate) state: Option<PathBuf>,
    /// Preset to start from, by a name that --presets lists
    #[arg(long, value_name = "NAME", conflicts_with = "state")]
    pub(crate) preset: Option<String>,
    /// Value of a parameter, by name or number, as the plugin writes it
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = parse_setting)]
    pub(crate) settings: Vec<(String, String)>,
    /// Play what stays within this error of all of the scene, in just noticeable differences, as Promenade does live
    #[arg(long, value_name = "JND", value_parser = ["0.25", "0.5", "1", "2"])]
    pub(crate) within: Option<String>,
    /// Write the plugin's state as it is at the start
    #[arg(long, value_name = "FILE")]
    pub(crate) save_state: Option<PathBuf>,
    /// Sample rate of the plugin and the output, hertz, to which all sound is converted; without it the input's
    #[arg(long, value_name = "HZ", value_parser = clap::value_parser!(u32).range(1_000..=1_000_000))]
    pub(crate) rate: Option<u32>,
    /// Samples played at a time
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub(crate) block: u32,
    /// Channels of the plugin's output: 4, 9 and 16 ask Promenade for Ambisonics
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=256))]
    pub(crate) outputs: u16,
    /// Tell the plugin that it plays in real time; it still runs as fast as it can
    #[arg(long)]
    pub(crate) realtime: bool,
    /// Silence after the input, seconds
    #[arg(long, value_name = "S", default_value_t = 0.0, value_parser = within(0.0_f64, 3600.0))]
    pub(crate) tail: f64,
}
