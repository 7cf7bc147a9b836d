//! `promenade completions`: what shells and man know of this program.

use crate::args::{CompletionsArgs, described};
use crate::report;
use anyhow::{Context, Result};
use clap::ValueEnum;
use clap_complete::{Shell, generate, generate_to};
use promenade_baker::FileError;
use std::fs;
use std::io::{Write, stdout};
use std::path::Path;

/// The program's name.
const NAME: &str = "promenade";

pub(crate) fn run(args: &CompletionsArgs) -> Result<()> {
    if let Some(shell) = args.shell {
        let mut text = Vec::new();
        generate(shell, &mut described(), NAME, &mut text);
        return stdout().write_all(&text).context("standard output cannot be written");
    }
    args.output.as_deref().map_or(Ok(()), folder)
}

fn folder(output: &Path) -> Result<()> {
    let [completions, man] = ["completions", "man"].map(|name| output.join(name));
    for folder in [&completions, &man] {
        fs::create_dir_all(folder).map_err(FileError::write(folder))?;
    }
    for shell in Shell::value_variants() {
        generate_to(*shell, &mut described(), NAME, &completions).map_err(FileError::write(&completions))?;
    }
    clap_mangen::generate_to(described(), &man).map_err(FileError::write(&man))?;
    report::line(format_args!("{}: completions of {} shells, pages of man", output.display(), Shell::value_variants().len()));
    Ok(())
}
