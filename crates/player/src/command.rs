//! The command line of `promenade-player` and of `promenade render`.

mod ambix;
#[cfg(feature = "play")]
mod card;
mod options;
mod read;
mod render;
mod setup;
pub mod terminal;
pub mod values;

pub use read::{read_path, read_scene};

use options::Options;
use promenade_audio::file::keep_inputs;
use std::ffi::OsString;
use std::process::ExitCode;

/// What there is to say of a command line, on one screen: a line for each option, its name and its value, two spaces or more,
/// and what it does.
pub const HELP: &str = "\
SCENE DRY -o OUT [options]   plays DRY (WAV, AIFF, FLAC) in SCENE, into OUT (WAV)
SCENE DRY --play             plays to the sound card (feature `play`)
  -o, --output OUT          what is written; - stands for standard input and output here and in DRY

The listener
  --path FILE               walks: .json, .csv, .gltf, .glb, COLMAP, transforms.json or ADM
  --loop                    starts the path over at its end
  --speed N                 seconds of the path per second of sound [1]
  --pose X,Y,Z,YAW,PITCH,ROLL   stands still, metres and degrees [the scene's start pose]
  --head FILE               hears with the head of a SOFA file
  --headphones FILE         what they need: a text by AutoEq or a SOFA file
The sources
  --further X,Y,Z@DB=SOUND  a further sound in the same room, at a level; PATH=SOUND moves it
  --emitter X,Y,Z           where DRY comes from, in scenes trained with several emitters
  --stereo-spread DEG       angle between emitters of left and right [one for their mean]
The sound
  --mix SHARE               of the rendered sound, 0 to 1; the rest is dry [1]
  --gain DB                 of all [0]
  --direct, --early, --late DB   level of direct sound, reflections up to 80 ms, the rest [0]
  --decay TIMES             the scene's reverberation time, 0.5 to 2 [1]
  --distance-law EXPONENT   by which the direct sound falls, 0 to 2 [1]
  --width TIMES             the difference between the ears in the room's sound, 0 to 2 [1]
  --low-cut HZ              takes the bass off below, 12 dB an octave [none]
  --wet-solo                the room alone, as on a send
How it is played
  --within JND              the cheapest setting of the scene so near to all of it [all]
  --decode-rate HZ          decodes a second of a trained scene [40]
  --clips                   plays a published model clip by clip
  --latency NAME            frame, 64 or none: when poses are heard; OUT begins on time [frame]
  --format ambix            Ambisonics, of scenes of image sources [binaural]
  --order N                 of Ambisonics, 1 to 3 [3]
  --bits FORMAT             16, 24, 32 or 32f [24]
  --block N                 samples rendered at a time [4096]
  --play                    to the sound card
Examples
  promenade render loft.promenade phrase.flac -o walk.wav --path loft.json
  sox speech.wav -t wav - | promenade render loft.promenade - -o - | play -
";

/// Runs a command line, `args` without the program's name: exit status 0 for success, 1 for failure with a line `error: ...`,
/// and 2 for a command line that is not understood.
#[expect(clippy::print_stdout, reason = "help is what was asked for")]
pub fn main(program: &str, args: impl IntoIterator<Item = OsString>) -> ExitCode {
    keep_inputs();
    match Options::parse(args) {
        Ok(None) => {
            print!(
                "{program} {}",
                HELP.replacen("\nSCENE", &format!("\n{program} SCENE"), 1).replace("promenade render", program)
            );
            ExitCode::SUCCESS
        }
        Ok(Some(options)) => match render::run(&options) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                terminal::line(format_args!("error: {}", terminal::chain(&error)));
                ExitCode::FAILURE
            }
        },
        Err(why) => {
            terminal::line(format_args!("error: {why}; {program} --help lists all options"));
            ExitCode::from(2)
        }
    }
}
