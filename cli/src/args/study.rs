//! Arguments of `promenade study`.

use super::values::within;
use clap::{Args, Subcommand};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct StudyArgs {
    #[command(subcommand)]
    pub(crate) what: Study,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Study {
    /// Say what answers say: votes, agreement, consistency, significant differences, strengths, ratings
    Report(StudyReportArgs),
}

#[derive(Debug, Args)]
pub(crate) struct StudyReportArgs {
    /// Files of answers, or of preference tables, CSV
    #[arg(required = true, value_name = "ANSWERS")]
    pub(crate) answers: Vec<PathBuf>,
    /// Chance at which a difference is called significant
    #[arg(long, value_name = "P", default_value_t = 0.05, value_parser = within(0.0001, 0.5))]
    pub(crate) level: f64,
    /// Keep the ratings of persons who do not hear the hidden references
    #[arg(long)]
    pub(crate) keep_all: bool,
    /// Write all figures
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
    /// Write the tables as Markdown
    #[arg(long, value_name = "FILE")]
    pub(crate) markdown: Option<PathBuf>,
    /// Write plots into this folder: votes, strengths, ratings
    #[arg(long, value_name = "FOLDER")]
    pub(crate) plots: Option<PathBuf>,
}
