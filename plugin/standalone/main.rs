//! Promenade without a host: live input from JACK or the system's sound, or a file.

use nice_plug::prelude::nice_export_standalone_with_args;
use promenade_plugin::Promenade;
use promenade_plugin::library::error_chain::with_causes;
use promenade_plugin::playing::player;
use std::path::Path;
use std::process::ExitCode;

const HELP: &str = "\
Promenade without a host.

  --play FILE        play a file (WAV or FLAC, one or two channels) in place of the live input, over and over
  --walk FILE        walk along a camera path with the file, from its start
  --once             stop at the end of the file

Sound card and window:
";

fn main() -> ExitCode {
    let player = player::set_up();
    let mut rest = Vec::new();
    let (mut file, mut walk) = (None, None);
    let mut args = std::env::args();
    rest.extend(args.next());
    while let Some(arg) = args.next() {
        match (arg.as_str(), arg.strip_prefix("--play=")) {
            (_, Some(path)) => file = Some(path.to_owned()),
            ("--play", _) => match args.next() {
                Some(path) => file = Some(path),
                None => return refuse("--play: expected a WAV or FLAC file, found nothing"),
            },
            ("--walk", _) => match args.next() {
                Some(path) => walk = Some(path),
                None => return refuse("--walk: expected a camera path, found nothing"),
            },
            ("--once", _) => player.once.set(true),
            ("--help" | "-h", _) => {
                print!("{HELP}");
                rest.push(arg);
            }
            _ => rest.push(arg),
        }
    }
    if let Some(file) = file
        && let Err(error) = player.open(Path::new(&file))
    {
        return refuse(&with_causes(&error));
    }
    if let Some(walk) = walk
        && let Err(error) = player.follow(Path::new(&walk))
    {
        return refuse(&with_causes(&error));
    }
    if nice_export_standalone_with_args::<Promenade, _>(rest) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn refuse(reason: &str) -> ExitCode {
    eprintln!("promenade-standalone: {reason}");
    ExitCode::FAILURE
}
