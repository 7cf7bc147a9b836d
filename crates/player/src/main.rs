//! `promenade-player`: a sound file through a scene, into a file.

use std::process::ExitCode;

fn main() -> ExitCode {
    promenade_player::command::main("promenade-player", std::env::args_os().skip(1))
}
