//! Arguments of `promenade measure`.

use super::figures::{JsonFile, MarkdownFile};
use super::values::within;
use clap::{ArgGroup, Args};
use promenade_baker::measure::RESPONSE_S;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(group(ArgGroup::new("subject").args(["scene", "response"]).required(true)))]
pub(crate) struct MeasureArgs {
    /// Scene file, baked with --hold-out, or any with --trade
    pub(crate) scene: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) json: JsonFile,
    #[command(flatten)]
    pub(crate) markdown: MarkdownFile,
    /// Length of the rendered responses, seconds; without it, one and a half times the longest decay
    #[arg(long, value_name = "S", conflicts_with = "response", value_parser = within(*RESPONSE_S.start(), *RESPONSE_S.end()))]
    pub(crate) seconds: Option<f64>,
    /// Further poses at which settings are compared
    #[arg(long, value_name = "N", requires = "trade", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) poses: Option<u32>,
    /// Responses that the scene was baked and held out from (folder with a responses.json, manifest or SOFA file): also how far
    /// off a listener points who knows their head
    #[arg(long, value_name = "RESPONSES", conflicts_with_all = ["response", "trade"])]
    pub(crate) listener: Option<PathBuf>,
    /// Folder of the WAV files that their manifest names
    #[arg(long, value_name = "DIR", requires = "listener")]
    pub(crate) root: Option<PathBuf>,
    /// What less of the scene costs and how far it is off: fewer taps and images, a lower order, slower refreshing
    #[arg(long, conflicts_with_all = ["response", "seconds"])]
    pub(crate) trade: bool,
    /// Recommend the cheapest setting with at most this error, in differences that are just noticed
    #[arg(long, value_name = "JND", default_value_t = 1.0, requires = "trade", value_parser = within(0.0_f32, 1000.0))]
    pub(crate) within: f32,
    /// Binaural impulse response (WAV) to measure, as JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) response: Option<PathBuf>,
    /// Response or rendering (WAV) to compare the other with
    #[arg(long, value_name = "FILE", requires = "response")]
    pub(crate) reference: Option<PathBuf>,
    /// Also the power beside a tone of this frequency, hertz
    #[arg(long, value_name = "HZ", requires = "response")]
    pub(crate) tone_hz: Option<f64>,
}
