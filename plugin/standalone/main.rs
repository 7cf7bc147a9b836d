//! Promenade without a host: live input from JACK or the system's sound, or a file.

use nice_plug::prelude::nice_export_standalone_with_args;
use promenade_fault::with_causes;
use promenade_plugin::Promenade;
use promenade_plugin::playing::player;
use std::path::Path;
use std::process::ExitCode;

const HELP: &str = "\
Promenade without a host.

  --play FILE        play a file (WAV or FLAC, one or two channels) in place of the live input, over and over
  --walk FILE        walk along a camera path with the file, from its start
  --once             stop at the end of the file
  --latency NAME     begin with the latency frame (16 ms), 64 (64 samples) or none

Sound card and window:
";

fn main() -> ExitCode {
    let player = player::set_up();
    let mut rest = Vec::new();
    let (mut file, mut walk, mut latency) = (None, None, None);
    let mut args = std::env::args();
    rest.extend(args.next());
    while let Some(arg) = args.next() {
        let (name, value) = arg.split_once('=').map_or((arg.as_str(), None), |(name, value)| (name, Some(value.to_owned())));
        let (taken, expected) = match name {
            "--play" => (&mut file, "a WAV or FLAC file"),
            "--walk" => (&mut walk, "a camera path"),
            "--latency" => (&mut latency, player::LATENCIES),
            "--once" => {
                player.once.set(true);
                continue;
            }
            _ => {
                if matches!(name, "--help" | "-h") {
                    print!("{HELP}");
                }
                rest.push(arg);
                continue;
            }
        };
        *taken = value.or_else(|| args.next());
        if taken.is_none() {
            return refuse(&format!("{name}: expected {expected}, found nothing"));
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
    if let Some(latency) = latency
        && !player.begin_at(&latency)
    {
        return refuse(&format!("--latency: expected {}, found {latency:?}", player::LATENCIES));
    }
    if nice_export_standalone_with_args::<Promenade, _>(rest) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn refuse(reason: &str) -> ExitCode {
    eprintln!("promenade-standalone: {reason}");
    ExitCode::FAILURE
}
