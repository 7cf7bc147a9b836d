//! `promenade`: bake scenes, render sound through them and through plugins, convert camera paths, make captures, inspect,
//! measure and evaluate.
//!
//! Results go to standard output, progress and remarks to standard error. The exit status is 0 for success, 1 for failure with
//! a line `error: ...`, and 2 for a command line that is not understood.

#![deny(clippy::print_stderr, clippy::print_stdout)]

mod anchors;
mod args;
mod bake;
mod capture;
mod completions;
mod eval;
mod fit;
mod host;
mod hrtf;
mod import;
mod inspect;
mod map;
mod measure;
mod path;
mod picture;
mod plot;
mod reconstruction;
#[cfg(feature = "train")]
mod refine;
mod report;
mod responses;
mod scene;
mod simulate;
mod study;
mod surface;
mod t20;
#[cfg(feature = "train")]
mod train;
#[cfg(any(test, not(feature = "train")))]
mod untrained;
mod web;

use promenade_baker::file::keep_inputs;
use std::process::ExitCode;

fn main() -> ExitCode {
    keep_inputs();
    let done = match args::Cli::of_command_line().command {
        args::Command::Bake { source } => bake::run(&source),
        args::Command::Responses { command } => responses::run(&command),
        args::Command::Import(a) => import::run(&a),
        args::Command::Render(rest) => return promenade_player::command::main("promenade render", rest.words),
        args::Command::Host(a) => host::run(&a),
        args::Command::Path(a) => path::run(&a),
        args::Command::Anchors(a) => anchors::run(&a),
        args::Command::Surface(args) => surface::run(&args),
        args::Command::Simulate(args) => simulate::run(&args),
        args::Command::Join(args) => simulate::join::run(&args),
        args::Command::Map(args) => map::run(&args),
        args::Command::Fit(a) => a.t20.as_ref().map_or_else(|| fit::run(&a), |t20| t20::run(&a, t20)),
        args::Command::Inspect(a) => inspect::run(&a),
        args::Command::Measure(a) => measure::run(&a),
        args::Command::Capture { command } => capture::run(&command),
        #[cfg(feature = "train")]
        args::Command::Train(a) => train::run(&a),
        #[cfg(feature = "train")]
        args::Command::Learn(a) => train::run_learn(&a),
        #[cfg(feature = "train")]
        args::Command::Refine(a) => refine::run(&a),
        #[cfg(not(feature = "train"))]
        args::Command::Train(rest) | args::Command::Learn(rest) | args::Command::Refine(rest) => {
            untrained::without_training(&rest.words)
        }
        args::Command::Eval(a) => eval::run(&a),
        args::Command::Study(a) => study::run(&a),
        args::Command::Web(args) => web::run(&args),
        args::Command::Completions(args) => completions::run(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // From the general to the particular.
            report::line(format_args!("error: {error:#}"));
            ExitCode::FAILURE
        }
    }
}
