//! `promenade-player`: a sound file through a scene, into a file or, with the feature `play`, to the sound card.

use std::process::ExitCode;

fn main() -> ExitCode {
    promenade_player::command::main("promenade-player", std::env::args_os().skip(1))
}
