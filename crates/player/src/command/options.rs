//! What is rendered, and how: the options of a command line.

use super::values::{bits, latency, point, pose, tier, within};
use crate::{Mix, Playing};
use lexopt::{Arg, Parser};
use promenade_audio::wav::Format;
use promenade_core::glam::Vec3;
use promenade_core::{Latency, LiveParams, Pose, Trim};
use std::ffi::OsString;
use std::path::PathBuf;

/// Where a further sound comes from.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Place {
    /// A point of the scene, metres.
    Point(Vec3),
    /// Along the camera path of a file.
    Path(PathBuf),
}

/// What is rendered, and how. [`super::HELP`] says what each is.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Options {
    pub(super) scene: PathBuf,
    pub(super) input: PathBuf,
    /// The file that is written; without it the sound card plays.
    pub(super) output: Option<PathBuf>,
    pub(super) path: Option<PathBuf>,
    pub(super) pose: Option<Pose>,
    pub(super) looping: bool,
    pub(super) speed: f64,
    pub(super) head: Option<PathBuf>,
    pub(super) headphones: Option<PathBuf>,
    pub(super) emitter: Option<Vec3>,
    pub(super) sources: Vec<(Place, PathBuf)>,
    pub(super) tier: Option<Playing>,
    pub(super) decode_rate_hz: f32,
    pub(super) latency: Latency,
    /// Order of Ambisonics, where that is written instead of both ears.
    pub(super) ambix: Option<u8>,
    pub(super) bits: Format,
    pub(super) block: usize,
    pub(super) mix: f32,
    pub(super) gain_db: f32,
    pub(super) trim: Trim,
    /// Degrees.
    pub(super) stereo_spread: f32,
    /// The room alone.
    pub(super) wet_solo: bool,
}

impl Options {
    /// Parses a command line without the program's name; `None` where help is asked for.
    ///
    /// # Errors
    /// What is not understood, in words.
    pub(super) fn parse(args: impl IntoIterator<Item = OsString>) -> Result<Option<Self>, String> {
        let mut options = Self {
            scene: PathBuf::new(),
            input: PathBuf::new(),
            output: None,
            path: None,
            pose: None,
            looping: false,
            speed: 1.0,
            head: None,
            headphones: None,
            emitter: None,
            sources: Vec::new(),
            tier: None,
            decode_rate_hz: LiveParams::default().rate_hz,
            latency: Latency::Frame,
            ambix: None,
            bits: Format::Int24,
            block: 4096,
            mix: 1.0,
            gain_db: 0.0,
            trim: Trim::NEUTRAL,
            stereo_spread: 0.0,
            wet_solo: false,
        };
        let mut seen = Seen::default();
        let mut parser = Parser::from_args(args);
        while let Some(arg) = parser.next().map_err(|e| e.to_string())? {
            match arg {
                Arg::Short('h') | Arg::Long("help") => return Ok(None),
                Arg::Value(file) => seen.files.push(file.into()),
                Arg::Long(name) => {
                    let name = name.to_owned();
                    options.take(&name, &mut seen, &mut parser)?;
                }
                Arg::Short(letter) => return Err(format!("-{letter}: expected an option that there is")),
            }
        }
        options.complete(seen)?;
        Ok(Some(options))
    }

    /// Takes an option and its value.
    fn take(&mut self, name: &str, seen: &mut Seen, parser: &mut Parser) -> Result<(), String> {
        let mut given = Given { name, parser };
        match name {
            "path" => self.path = Some(given.file()?),
            "pose" => self.pose = Some(given.value(pose)?),
            "loop" => self.looping = true,
            "speed" => {
                self.speed = given.value(|text| within(text, -1000.0, 1000.0))?;
                seen.speed = true;
            }
            "head" => self.head = Some(given.file()?),
            "headphones" => self.headphones = Some(given.file()?),
            "emitter" => self.emitter = Some(given.value(point)?),
            "source" => self.sources.push(given.value(source)?),
            "tier" => self.tier = Some(given.value(tier)?),
            "decode-rate" => self.decode_rate_hz = given.value(|text| within(text, 1.0, 1000.0))?,
            "latency" => self.latency = given.value(latency)?,
            "format" => {
                seen.ambix = given.value(|text| match text {
                    "binaural" => Ok(false),
                    "ambix" => Ok(true),
                    _ => Err("expected binaural or ambix".to_owned()),
                })?;
            }
            "order" => seen.order = given.value(|text| within(text, 1, 3))?,
            "bits" => self.bits = given.value(bits)?,
            "block" => self.block = given.value(|text| within(text, 1, 1 << 20))?,
            "mix" => self.mix = given.value(|text| within(text, 0.0, 1.0))?,
            "gain" => self.gain_db = given.value(|text| within(text, -120.0, 60.0))?,
            "direct" => self.trim.direct = given.value(level)?,
            "early" => self.trim.early = given.value(level)?,
            "late" => self.trim.late = given.value(level)?,
            "decay" => self.trim.decay = given.value(|text| within(text, 0.5, 2.0))?,
            "distance-law" => self.trim.distance_law = given.value(|text| within(text, 0.0, 2.0))?,
            "width" => self.trim.width = given.value(|text| within(text, 0.0, 2.0))?,
            "low-cut" => self.trim.low_cut_hz = given.value(|text| within(text, 10.0, 1000.0))?,
            "stereo-spread" => self.stereo_spread = given.value(|text| within(text, 0.0, 180.0))?,
            "wet-solo" => self.wet_solo = true,
            "play" => seen.play = true,
            _ => return Err(format!("--{name}: expected an option that there is")),
        }
        Ok(())
    }

    /// Takes the files, and refuses what does not go together.
    fn complete(&mut self, seen: Seen) -> Result<(), String> {
        let mut files = seen.files.into_iter();
        let found = files.len();
        let (expected, names) = if seen.play { (2, "SCENE DRY") } else { (3, "SCENE DRY OUT") };
        if found != expected {
            return Err(format!("expected {expected} files {names}, found {found}"));
        }
        (self.scene, self.input) = (files.next().unwrap_or_default(), files.next().unwrap_or_default());
        self.output = files.next();
        self.ambix = seen.ambix.then_some(seen.order);
        if self.wet_solo {
            self.trim.direct = 0.0;
        }
        let walks = [("--loop", self.looping), ("--speed", seen.speed)];
        if let Some((name, _)) = walks.iter().find(|(_, given)| *given && self.path.is_none()) {
            return Err(format!("{name}: expected --path with it"));
        }
        let wrong = [
            ("--pose", "--path", self.path.is_some() && self.pose.is_some()),
            ("--play", "--format ambix", seen.play && seen.ambix),
        ];
        match wrong.iter().find(|(.., both)| *both) {
            Some((one, other, _)) => Err(format!("{one}: expected without {other}")),
            None => Ok(()),
        }
    }

    /// Levels of what is rendered and of the dry sound.
    pub(super) fn mix(&self) -> Mix {
        let mix = Mix::new(self.mix, self.gain_db);
        if self.wet_solo { mix.without_dry() } else { mix }
    }

    /// All files that are read.
    pub(super) fn inputs(&self) -> impl Iterator<Item = &PathBuf> {
        let places = self.sources.iter().filter_map(|(place, _)| if let Place::Path(file) = place { Some(file) } else { None });
        let sounds = self.sources.iter().map(|(_, sound)| sound);
        let given = [&self.path, &self.head, &self.headphones].into_iter().flatten();
        [&self.scene, &self.input].into_iter().chain(given).chain(places).chain(sounds)
    }
}

/// What has been given of what is looked at together.
struct Seen {
    files: Vec<PathBuf>,
    play: bool,
    speed: bool,
    ambix: bool,
    order: u8,
}

impl Default for Seen {
    fn default() -> Self {
        Self { files: Vec::new(), play: false, speed: false, ambix: false, order: 3 }
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

    fn value<T>(&mut self, parse: impl Fn(&str) -> Result<T, String>) -> Result<T, String> {
        let text = self.file()?.into_os_string().into_string();
        let text = text.map_err(|text| format!("--{}: expected text, found {}", self.name, text.display()))?;
        parse(&text).map_err(|why| format!("--{} {text}: {why}", self.name))
    }
}

/// Parses `X,Y,Z=SOUND` or `PATH=SOUND`.
fn source(text: &str) -> Result<(Place, PathBuf), String> {
    let (place, sound) = text.split_once('=').ok_or("expected X,Y,Z=SOUND or PATH=SOUND")?;
    Ok((point(place).map_or_else(|_| Place::Path(place.into()), Place::Point), sound.into()))
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
        assert_eq!((options.gain_db, options.speed, options.looping), (-3.0, -2.0, true));
        assert_eq!((&*options.scene, options.output.as_deref()), ("a".as_ref(), Some("c".as_ref())));
        assert_eq!(options.sources, [(Place::Point(Vec3::NEG_X), "d".into())]);
        assert!((options.trim.late - 1e-6).abs() < 1e-9 && options.trim.direct == 1.0);
        let names: Vec<_> = options.inputs().map(|path| path.to_str().unwrap()).collect();
        assert_eq!(names, ["a", "b", "p", "d"]);
        assert_eq!(parsed("a b c --wet-solo --direct 3").unwrap().unwrap().trim.direct, 0.0);
        assert_eq!(parsed("a b c --order 1 --format ambix").unwrap().unwrap().ambix, Some(1));
        assert_eq!(parsed("a b --play").unwrap().unwrap().output, None);
        assert!(parsed("a --help").unwrap().is_none() && parsed("-h").unwrap().is_none());
    }

    #[test]
    fn what_is_not_understood_is_said() {
        for (line, clue) in [
            ("", "expected 3 files SCENE DRY OUT, found 0"),
            ("a b c d", "found 4"),
            ("a b c --play", "expected 2 files SCENE DRY, found 3"),
            ("a b c --mix 2", "--mix 2: expected a number from 0 to 1"),
            ("a b c --mix NaN", "--mix NaN"),
            ("a b c --block 0", "from 1 to 1048576"),
            ("a b c --order 4 --format ambix", "from 1 to 3"),
            ("a b c --bits 12", "expected 16, 24, 32 or 32f"),
            ("a b c --tier best", "expected one of draft"),
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
