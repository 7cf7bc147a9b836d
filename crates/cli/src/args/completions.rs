//! Arguments of `promenade completions`.

use clap::{ArgGroup, Args};
use clap_complete::Shell;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(group(ArgGroup::new("where").args(["shell", "output"]).required(true)))]
pub(crate) struct CompletionsArgs {
    /// Shell whose completions are printed
    pub(crate) shell: Option<Shell>,
    /// Folder to write to: `completions` of all shells, and `man` with a page for each command
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: Option<PathBuf>,
}
