//! How much of a scene is written.

use super::values::within;
use anyhow::{Result, ensure};
use clap::Args;
use std::path::Path;

#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct LessArgs {
    /// Write the least of the scene that stays within this error of all of it, in just noticeable differences
    #[arg(long, value_name = "JND", requires = "output", value_parser = within(0.0_f32, 1000.0))]
    pub(crate) within: Option<f32>,
}

impl LessArgs {
    /// Refuses a limit where a file to write is no scene by its name.
    pub(crate) fn check(self, output: &Path) -> Result<()> {
        let is_scene = output.extension().is_some_and(|ending| ending == "promenade");
        ensure!(
            self.within.is_none() || is_scene,
            "{}: expected a scene to write for --within, found another",
            output.display()
        );
        Ok(())
    }
}
