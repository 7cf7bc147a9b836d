//! Where figures go.

use clap::Args;
use std::path::PathBuf;

/// Figures as JSON.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct JsonFile {
    /// All figures as JSON, into a file that ends in .json or, without one, instead of the text on standard output
    #[arg(long, value_name = "FILE.json", num_args = 0..=1, default_missing_value = "-", value_parser = parse_json)]
    pub(crate) json: Option<PathBuf>,
}

/// Tables as Markdown.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct MarkdownFile {
    /// Tables as Markdown, into a file that ends in .md or, without one, instead of the text on standard output
    #[arg(long, value_name = "FILE.md", num_args = 0..=1, default_missing_value = "-", value_parser = parse_markdown)]
    pub(crate) markdown: Option<PathBuf>,
}

/// All of it, with a plot for each figure.
#[derive(Debug, Args)]
pub(crate) struct FigureFiles {
    #[command(flatten)]
    pub(crate) json: JsonFile,
    #[command(flatten)]
    pub(crate) markdown: MarkdownFile,
    /// Write a plot (SVG) for each figure into this folder
    #[arg(long, alias = "plots", value_name = "FOLDER")]
    pub(crate) plot: Option<PathBuf>,
}

fn parse_json(text: &str) -> Result<PathBuf, String> {
    ending_in(text, "json")
}

fn parse_markdown(text: &str) -> Result<PathBuf, String> {
    ending_in(text, "md")
}

/// A name with an ending: what comes after an option without a value is taken for one, and may be a scene.
fn ending_in(text: &str, ending: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let fits = text == "-" || path.extension().is_some_and(|found| found.eq_ignore_ascii_case(ending));
    fits.then_some(path).ok_or_else(|| format!("expected a name that ends in .{ending}, or this option at the end of the line"))
}
