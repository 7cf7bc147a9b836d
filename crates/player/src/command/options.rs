//! What is rendered, and how: the options of a command line.

use super::values::{bits, latency, point, pose, within};
use crate::{Mix, Playing};
use lexopt::{Arg, Parser};
use promenade_audio::wav::Format;
use promenade_core::glam::Vec3;
use promenade_core::{Latency, Pose, Trim};
use std::ffi::OsString;
use std::fmt::Display;
use std::path::PathBuf;
use std::str::FromStr;

/// Where a further sound comes from.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Place {
    /// A point of the scene, metres.
    Point(Vec3),
    /// Along the camera path of a file.
    Path(PathBuf),
}

/// What is rendered, and how; [`super::HELP`] says what each is, and what holds where it is not given.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Options {
    /// Scene and dry sound, and the file that is written; without that the sound card plays.
    pub(super) files: Vec<PathBuf>,
    pub(super) path: Option<PathBuf>,
    pub(super) pose: Option<Pose>,
    pub(super) looping: bool,
    pub(super) speed: Option<f64>,
    pub(super) head: Option<PathBuf>,
    pub(super) headphones: Option<PathBuf>,
    pub(super) emitter: Option<Vec3>,
    /// Further sounds with their places and gains.
    pub(super) sources: Vec<(Place, f32, PathBuf)>,
    pub(super) playing: Playing,
    pub(super) decode_rate_hz: Option<f32>,
    /// Differences that are just noticed.
    pub(super) within: Option<f32>,
    pub(super) latency: Latency,
    pub(super) ambix: bool,
    /// Of Ambisonics.
    pub(super) order: Option<u8>,
    pub(super) bits: Option<Format>,
    pub(super) block: Option<usize>,
    pub(super) share: Option<f32>,
    pub(super) gain_db: f32,
    pub(super) trim: Trim,
    /// Degrees.
    pub(super) stereo_spread: f32,
    /// The room alone.
    pub(super) wet_solo: bool,
    output: Option<PathBuf>,
    play: bool,
}

impl Options {
    /// Parses a command line without the program's name; `None` where help is asked for.
    ///
    /// # Errors
    /// What is not understood, in words.
    pub(super) fn parse(args: impl IntoIterator<Item = OsString>) -> Result<Option<Self>, String> {
        let mut options = Self::default();
        let mut parser = Parser::from_args(args);
        while let Some(arg) = parser.next().map_err(|e| e.to_string())? {
            match arg {
                Arg::Short('h') | Arg::Long("help") => return Ok(None),
                Arg::Value(file) => options.files.push(file.into()),
                Arg::Long(name) => {
                    let name = name.to_owned();
                    options.take(&mut Given { name: &name, parser: &mut parser })?;
                }
                Arg::Short('o') => options.output = Some(parser.value().map_err(|e| e.to_string())?.into()),
                Arg::Short(letter) => return Err(format!("-{letter}: expected an option that there is")),
            }
        }
        if options.wet_solo {
            options.trim.direct = 0.0;
        }
        options.files.extend(options.output.take());
        options.check().map(|()| Some(options))
    }

    /// Takes an option and its value.
    fn take(&mut self, given: &mut Given<'_>) -> Result<(), String> {
        match given.name {
            "path" => self.path = Some(given.file()?),
            "pose" => self.pose = Some(given.value(pose)?),
            "loop" => self.looping = true,
            "speed" => self.speed = Some(given.within(-1000.0, 1000.0)?),
            "head" => self.head = Some(given.file()?),
            "headphones" => self.headphones = Some(given.file()?),
            "emitter" => self.emitter = Some(given.value(point)?),
            // The second is an older name.
            "further" | "source" => self.sources.push(given.value(source)?),
            "clips" => self.playing = Playing::Clips,
            "within" => self.within = Some(given.within(0.0, 1000.0)?),
            "decode-rate" => self.decode_rate_hz = Some(given.within(1.0, 1000.0)?),
            "latency" => self.latency = given.value(latency)?,
            "format" => self.ambix = given.value(is_ambix)?,
            "order" => self.order = Some(given.within(1, 3)?),
            "bits" => self.bits = Some(given.value(bits)?),
            "block" => self.block = Some(given.within(1, 1 << 20)?),
            "mix" => self.share = Some(given.within(0.0, 1.0)?),
            "gain" => self.gain_db = given.within(-120.0, 60.0)?,
            "direct" => self.trim.direct = given.value(level)?,
            "early" => self.trim.early = given.value(level)?,
            "late" => self.trim.late = given.value(level)?,
            "decay" => self.trim.decay = given.within(0.5, 2.0)?,
            "distance-law" => self.trim.distance_law = given.within(0.0, 2.0)?,
            "width" => self.trim.width = given.within(0.0, 2.0)?,
            "low-cut" => self.trim.low_cut_hz = given.within(10.0, 1000.0)?,
            "stereo-spread" => self.stereo_spread = given.within(0.0, 180.0)?,
            "wet-solo" => self.wet_solo = true,
            "output" => self.output = Some(given.file()?),
            "play" => self.play = true,
            name => return Err(format!("--{name}: expected an option that there is")),
        }
        Ok(())
    }

    /// Refuses what does not go together.
    fn check(&self) -> Result<(), String> {
        let (expected, names) = if self.play { (2, "SCENE DRY") } else { (3, "SCENE DRY -o OUT") };
        let found = self.files.len();
        let still = self.path.is_none();
        let wrong = [
            (found != expected, format!("expected {names}, {expected} files, found {found}")),
            (still && self.looping, "--loop: expected --path with it".to_owned()),
            (still && self.speed.is_some(), "--speed: expected --path with it".to_owned()),
            (!still && self.pose.is_some(), "--pose: expected without --path".to_owned()),
            (self.play && self.ambix, "--play: expected without --format ambix".to_owned()),
        ];
        wrong.into_iter().find(|(wrong, _)| *wrong).map_or(Ok(()), |(_, why)| Err(why))
    }

    /// Levels of what is rendered and of the dry sound.
    pub(super) fn mix(&self) -> Mix {
        let mix = Mix::new(self.share.unwrap_or(1.0), self.gain_db);
        if self.wet_solo { mix.without_dry() } else { mix }
    }

    /// Samples rendered at a time.
    pub(super) fn block(&self) -> usize {
        self.block.unwrap_or(4096)
    }
}

/// An option that is given, and where its value comes from.
struct Given<'a> {
    name: &'a str,
    parser: &'a mut Parser,
}

impl Given<'_> {
    fn file(&mut self) -> Result<PathBuf, String> {
        self.parser.value().map(PathBuf::from).map_err(|e| e.to_string())
    }

    fn within<T: FromStr + PartialOrd + Display + Copy>(&mut self, low: T, high: T) -> Result<T, String> {
        self.value(|text| within(text, low, high))
    }

    fn value<T>(&mut self, parse: impl Fn(&str) -> Result<T, String>) -> Result<T, String> {
        let text = self.file()?.into_os_string().into_string();
        let text = text.map_err(|text| format!("--{}: expected text, found {}", self.name, text.display()))?;
        parse(&text).map_err(|why| format!("--{} {text}: {why}", self.name))
    }
}

/// Whether what is written is Ambisonics.
fn is_ambix(text: &str) -> Result<bool, String> {
    match text {
        "binaural" => Ok(false),
        "ambix" => Ok(true),
        _ => Err("expected binaural or ambix".to_owned()),
    }
}

/// Parses `X,Y,Z=SOUND` or `PATH=SOUND`, the former part with `@DB` where the sound has another level.
fn source(text: &str) -> Result<(Place, f32, PathBuf), String> {
    let (place, sound) =
        text.split_once('=').ok_or("expected X,Y,Z=SOUND or PATH=SOUND (the place of DRY is --emitter X,Y,Z)")?;
    let levelled = place.rsplit_once('@').and_then(|(place, db)| Some((place, level(db).ok()?)));
    let (place, gain) = levelled.unwrap_or((place, 1.0));
    Ok((point(place).map_or_else(|_| Place::Path(place.into()), Place::Point), gain, sound.into()))
}

/// Parses a level in dB; the gain comes back.
fn level(text: &str) -> Result<f32, String> {
    let db: f32 = within(text, -120.0, 24.0)?;
    Ok(if db == 0.0 { 1.0 } else { 10.0_f32.powf(db / 20.0) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(line: &str) -> Result<Option<Options>, String> {
        Options::parse(line.split(' ').filter(|word| !word.is_empty()).map(OsString::from))
    }

    #[test]
    fn options_stand_anywhere_and_negative_numbers_are_values() {
        let options = parsed("--gain -3 a --pose=-1,2,3,-90,0,0 b --speed -2 c").unwrap_err();
        assert!(options.contains("--speed: expected --path"), "{options}");
        let options = parsed("--gain -3 a --late -120 b --path p --speed -2 --loop c --source -1,0,0=d").unwrap().unwrap();
        assert_eq!((options.gain_db, options.speed, options.looping), (-3.0, Some(-2.0), true));
        assert_eq!(options.files, ["a", "b", "c"].map(PathBuf::from));
        assert_eq!(options.sources, [(Place::Point(Vec3::NEG_X), 1.0, "d".into())]);
        let levelled = parsed("a b c --source 0,1,0@-20=d --source a@b.csv=e").unwrap().unwrap();
        let placed = [(Place::Point(Vec3::Y), 0.1, "d".into()), (Place::Path("a@b.csv".into()), 1.0, "e".into())];
        assert_eq!(levelled.sources, placed);
        assert!((options.trim.late - 1e-6).abs() < 1e-9 && options.trim.direct == 1.0);
        assert_eq!(options.path, Some("p".into()));
        assert_eq!(parsed("a b c --wet-solo --direct 3").unwrap().unwrap().trim.direct, 0.0);
        let options = parsed("a b c --order 1 --format ambix").unwrap().unwrap();
        assert_eq!((options.ambix, options.order), (true, Some(1)));
        assert_eq!(parsed("a - -o - --further 1,0,0=d").unwrap(), parsed("a - - --source 1,0,0=d").unwrap());
        assert_eq!(parsed("a b --play").unwrap().unwrap().files.len(), 2);
        assert!(parsed("a --help").unwrap().is_none() && parsed("-h").unwrap().is_none());
    }

    #[test]
    fn commands_of_the_documents_are_understood() {
        let mut all = promenade_testing::documents::commands("cargo run --release -p promenade-player --");
        assert!(!all.is_empty(), "the README has one");
        let renders = promenade_testing::documents::commands("promenade").into_iter();
        all.extend(renders.filter(|(_, words)| words[0] == "render").map(|(path, words)| (path, words[1..].to_vec())));
        assert!(all.len() > 5, "{} commands", all.len());
        for (path, words) in all {
            let parsed = Options::parse(words.iter().map(OsString::from));
            assert!(parsed.is_ok(), "{}: {words:?}: {}", path.display(), parsed.unwrap_err());
        }
    }

    #[test]
    fn what_is_not_understood_is_said() {
        for (line, clue) in [
            ("", "expected SCENE DRY -o OUT, 3 files, found 0"),
            ("a b c d", "found 4"),
            ("a b c -o d", "found 4"),
            ("a b c --play", "expected SCENE DRY, 2 files, found 3"),
            ("a b c --mix 2", "--mix 2: expected a number from 0 to 1"),
            ("a b c --mix NaN", "--mix NaN"),
            ("a b c --block 0", "from 1 to 1048576"),
            ("a b c --order 4 --format ambix", "from 1 to 3"),
            ("a b c --bits 12", "expected 16, 24, 32 or 32f"),
            ("a b c --pose 1,2", "expected 6 numbers"),
            ("a b c --source 1,2,3", "expected X,Y,Z=SOUND"),
            ("a b c --source", "missing argument"),
            ("a b c --loop", "--loop: expected --path"),
            ("a b c --path p --pose 0,0,0,0,0,0", "--pose: expected without --path"),
            ("a b --play --format ambix", "--play: expected without --format ambix"),
            ("a b c --wet-solo=3", "unexpected argument"),
            ("a b c --verbose", "--verbose: expected an option that there is"),
            ("a b c -v", "-v: expected an option"),
        ] {
            let said = parsed(line).unwrap_err();
            assert!(said.contains(clue), "{line}: {said}");
        }
    }
}
