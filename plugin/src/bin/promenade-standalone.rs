//! Promenade without a host: live input from JACK or the system's sound, `--help` lists the options.

use nice_plug::prelude::nice_export_standalone;
use promenade_plugin::Promenade;
use std::process::ExitCode;

fn main() -> ExitCode {
    if nice_export_standalone::<Promenade>() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
