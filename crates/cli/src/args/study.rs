//! Arguments of `promenade study`.

use super::figures::FigureFiles;
use clap::{Args, Subcommand};
use std::net::SocketAddr;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct StudyArgs {
    #[command(subcommand)]
    pub(crate) what: Option<Study>,
    #[command(flatten)]
    pub(crate) site: Option<StudySiteArgs>,
}

#[derive(Debug, Args)]
pub(crate) struct StudySiteArgs {
    /// What is asked, JSON
    #[arg(value_name = "STUDY.json")]
    pub(crate) study: PathBuf,
    /// Folder to write the site to
    #[arg(short, long, value_name = "SITE")]
    pub(crate) output: PathBuf,
    /// The engine as WebAssembly, for live scenes [default: promenade.wasm beside this program, or in ../web]
    #[arg(long, value_name = "FILE.wasm")]
    pub(crate) engine: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Study {
    /// Show a site and take its answers into one file
    Serve(StudyServeArgs),
    /// Say what answers say: votes, agreement, consistency, significant differences, strengths, ratings
    Report(StudyReportArgs),
}

#[derive(Debug, Args)]
pub(crate) struct StudyServeArgs {
    /// Folder of the site
    #[arg(value_name = "SITE")]
    pub(crate) site: PathBuf,
    /// File that answers are added to, CSV
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) answers: PathBuf,
    /// Address and port to listen at; 0.0.0.0 is reached from other machines
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8090")]
    pub(crate) listen: SocketAddr,
    /// A name that listeners have for this machine, as often as there are, where a web server in front of it passes names on
    #[arg(long, value_name = "NAME")]
    pub(crate) host: Vec<String>,
}

#[derive(Debug, Args)]
pub(crate) struct StudyReportArgs {
    /// Files of answers, or of preference tables, CSV
    #[arg(required = true, value_name = "ANSWERS")]
    pub(crate) answers: Vec<PathBuf>,
    /// Keep persons who failed the headphone check
    #[arg(long)]
    pub(crate) keep_failed: bool,
    /// Keep the ratings of persons who do not hear the hidden references, or rate mid anchors as high
    #[arg(long)]
    pub(crate) keep_all: bool,
    #[command(flatten)]
    pub(crate) files: FigureFiles,
}
