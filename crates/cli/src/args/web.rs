//! Arguments of `promenade web`.

use super::placement::PlacementArgs;
use clap::{ArgGroup, Args};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(group(ArgGroup::new("to").args(["output", "serve"]).required(true).multiple(true)))]
pub(crate) struct WebArgs {
    /// Scene files; the first is heard first
    #[arg(required = true, value_name = "SCENE")]
    pub(crate) scenes: Vec<PathBuf>,
    /// Dry sounds to choose from, of any form that browsers play; without one, a file that the listener chooses or a microphone
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub(crate) dry: Vec<PathBuf>,
    /// Camera paths to walk, of any form that `promenade render` takes
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub(crate) path: Vec<PathBuf>,
    /// Heads to choose from: SOFA files of head-related responses
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub(crate) head: Vec<PathBuf>,
    /// Headphones to choose from: texts by AutoEq or SOFA files of headphone responses
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub(crate) headphones: Vec<PathBuf>,
    /// Photographs of the scenes as 3D Gaussian splats, .ply or .splat: the first for the first scene, and so on
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub(crate) splats: Vec<PathBuf>,
    /// Where the splats lie in the scenes
    #[command(flatten)]
    pub(crate) placement: PlacementArgs,
    /// Title of the page [default: that of the first scene]
    #[arg(long)]
    pub(crate) title: Option<String>,
    /// The engine, if it is not beside this program: promenade.wasm of an archive, or of `cargo xtask web`
    #[arg(long, value_name = "FILE")]
    pub(crate) engine: Option<PathBuf>,
    /// Folder to write, made if it is not there; files of an older page in it are replaced
    #[arg(short, long, value_name = "SITE")]
    pub(crate) output: Option<PathBuf>,
    /// Show the page to browsers on this machine, until this command is ended
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = "8000")]
    pub(crate) serve: Option<u16>,
}
