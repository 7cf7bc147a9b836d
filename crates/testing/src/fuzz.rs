//! Searches for inputs that a reader does not survive.
//!
//! An input is changed where readers decide: numbers become extremes, chunks, entries and lines are lost, repeated and
//! exchanged, and checksums and lengths are then mended ([`change`]). What a reader says of an input, without its digits,
//! stands for the way that it took: an input with a new answer is changed further.

mod allocated;
mod bytes;
mod change;
mod flac;
mod hdf5;
mod json;
mod riff;
mod tensors;
mod text;

pub use allocated::Counting;

use cpu_time::ThreadTime;
use fastrand::Rng;
use std::any::Any;
use std::cell::{Cell, RefCell};
use std::collections::HashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Once;
use std::time::Duration;
use std::{env, fs};

/// A file, or what else comes from outside.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// Its name, whose ending many readers go by.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

impl Input {
    /// An input of this name.
    pub fn new(name: impl Into<String>, bytes: impl Into<Vec<u8>>) -> Self {
        Self { name: name.into(), bytes: bytes.into() }
    }
}

/// What is searched.
#[derive(Clone, Debug)]
pub struct Search {
    /// Name of the target: `crates/testing/fuzz/NAME/whole/` has more seeds, `crates/testing/fuzz/NAME/found/` the inputs that
    /// were once at fault, each after a number and a dash.
    pub name: &'static str,
    /// Changed inputs that are read, unless `PROMENADE_CASES` or `PROMENADE_MINUTES` say otherwise.
    pub cases: u64,
    /// The most that reading an input may have allocated at a time on its thread, bytes; counted where [`Counting`] is the
    /// allocator.
    pub most_bytes: usize,
}

/// The most processor time for an input, seconds, in a search by minutes; a longer reading is a finding.
const MOST_S: f64 = 5.0;
/// Inputs that are changed further.
const POOL: usize = 400;
/// Larger inputs are not: they only take time.
const LARGEST: usize = 1 << 18;

thread_local! {
    static READING: Cell<bool> = const { Cell::new(false) };
    static PLACE: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Has panics of a thread that reads noted by their place instead of printed.
fn note_places() {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if READING.get() {
                PLACE.set(panic.location().map(ToString::to_string).unwrap_or_default());
            } else {
                usual(panic);
            }
        }));
    });
}

/// What the search has come by so far.
struct Faults {
    folder: PathBuf,
    what: Vec<(String, PathBuf)>,
}

impl Faults {
    /// Keeps an input, unless its fault is known already.
    fn add(&mut self, input: &Input, fault: String) {
        // Panics are known by their place, the rest by the words.
        let of = |fault: &str| fault.split_once(": ").map_or_else(|| without_digits(fault), |(place, _)| place.to_owned());
        if self.what.iter().any(|(known, _)| of(known) == of(&fault)) {
            return;
        }
        let path = self.folder.join(format!("{}-{}", self.what.len() + 1, input.name));
        fs::write(&path, &input.bytes).expect("a finding can be written");
        eprintln!("{}: {fault}", path.display());
        self.what.push((fault, path));
    }
}

impl Search {
    /// Reads the seeds, the inputs that were found before, and changed ones. `read` gets an input and the path of a file that
    /// holds it, alone in its folder unless `read` puts others there, and returns the reader's error; what is wrong with what
    /// it read is a panic.
    ///
    /// `PROMENADE_SEED` makes it another search, `PROMENADE_CASES` one of another length, and `PROMENADE_MINUTES` one that ends
    /// by processor time and takes more than 5 s for an input as a fault.
    ///
    /// # Panics
    /// A seed is refused, or an input is at fault: a panic in `read`, or more memory than it may have. The message names files
    /// with the inputs.
    pub fn run(&self, seeds: Vec<Input>, mut read: impl FnMut(&Input, &Path) -> Result<(), String>) {
        let number = |name: &str| env::var(name).ok().and_then(|text| text.parse::<f64>().ok());
        let folder = env::temp_dir().join(format!("promenade-fuzz-{}-{}", self.name, std::process::id()));
        // The input is here before it is read, so that it is still there if the process ends.
        let reading = folder.join("reading");
        fs::create_dir_all(&reading).expect("a folder for inputs can be made");
        let minutes = number("PROMENADE_MINUTES");
        note_places();
        let mut slowest = (0.0, String::new());
        let mut largest = 0;
        let mut judge = |input: &Input| -> Result<Result<(), String>, String> {
            let path = reading.join(&input.name);
            fs::write(&path, &input.bytes).expect("an input can be written");
            READING.set(true);
            allocated::start();
            let started = ThreadTime::now();
            let result = catch_unwind(AssertUnwindSafe(|| read(input, &path)));
            let (seconds, bytes) = (started.elapsed().as_secs_f64(), allocated::most());
            READING.set(false);
            let _gone_already = fs::remove_file(&path);
            if seconds > slowest.0 {
                slowest = (seconds, input.name.clone());
            }
            largest = largest.max(bytes);
            let answer = result.map_err(|panic| format!("panicked at {}: {}", PLACE.take(), text_of(&*panic)))?;
            if bytes > self.most_bytes {
                return Err(format!("took {bytes} bytes, at most {} are expected", self.most_bytes));
            }
            if minutes.is_some() && seconds > MOST_S {
                return Err(format!("took {seconds:.1} s, at most {MOST_S} are expected"));
            }
            Ok(answer)
        };
        let mut found = Faults { folder: folder.clone(), what: Vec::new() };
        let mut pool = [seeds, files(self.name, "whole")].concat();
        assert!(!pool.is_empty(), "{}: there is no seed", self.name);
        for seed in &pool {
            match judge(seed) {
                Ok(answer) => assert_eq!(answer, Ok(()), "{}: the seed {} is refused", self.name, seed.name),
                Err(fault) => found.add(seed, fault),
            }
        }
        let whole = pool.len();
        for mut once in files(self.name, "found") {
            once.name = once.name.split_once('-').expect("a number, a dash, and the name of the input").1.to_owned();
            if let Err(fault) = judge(&once) {
                found.add(&once, fault);
            }
            pool.push(once);
        }
        let cases = number("PROMENADE_CASES").map_or(self.cases, |cases| cases as u64);
        let mut rng = Rng::with_seed(number("PROMENADE_SEED").map_or(1, |seed| seed as u64));
        let (mut done, mut accepted, started) = (0_u64, 0_u64, ThreadTime::now());
        let mut answers = HashSet::new();
        let goes_on = |done: u64| minutes.map_or(done < cases, |m| started.elapsed() < Duration::from_secs_f64(60.0 * m));
        while goes_on(done) && found.what.len() < 50 {
            // The first, whole ones as often as all that came of them.
            let from = if rng.bool() { &pool[rng.usize(..whole)] } else { &pool[rng.usize(..pool.len())] };
            let other = &pool[rng.usize(..pool.len())];
            let changed = Input { bytes: change::changed(&mut rng, &from.bytes, &other.bytes), name: from.name.clone() };
            done += 1;
            match judge(&changed) {
                Err(fault) => found.add(&changed, fault),
                Ok(answer) => {
                    accepted += u64::from(answer.is_ok());
                    let way = (changed.name.clone(), answer.map_err(|error| without_digits(&error)));
                    if changed.bytes.len() <= LARGEST && answers.insert(way) {
                        if pool.len() < POOL {
                            pool.push(changed);
                        } else {
                            let place = rng.usize(whole..POOL);
                            pool[place] = changed;
                        }
                    }
                }
            }
        }
        println!(
            "{}: {done} cases in {:.0} s, {accepted} accepted, {} answers, {} findings; at most {largest} bytes, {:.2} s for \
             {}",
            self.name,
            started.elapsed().as_secs_f64(),
            answers.len(),
            found.what.len(),
            slowest.0,
            slowest.1,
        );
        assert!(found.what.is_empty(), "{}: {:#?}", self.name, found.what);
        fs::remove_dir_all(&folder).expect("the folder for inputs can be removed");
    }
}

/// Files that are kept for a target.
fn files(target: &str, what: &str) -> Vec<Input> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz").join(target).join(what);
    let mut paths: Vec<PathBuf> = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    paths.sort();
    let input = |path: PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str()).expect("a name that is text");
        Input::new(name, fs::read(&path).expect("a kept input can be read"))
    };
    paths.into_iter().map(input).collect()
}

fn text_of(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("something that is no text").chars().take(300).collect()
}

/// What a message has beside numbers and what is quoted from the input.
fn without_digits(text: &str) -> String {
    let words = text.split('"').step_by(2).collect::<String>();
    words.chars().filter(|c| !c.is_ascii_digit() && c.is_ascii()).take(160).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[global_allocator]
    static ALLOCATOR: Counting = Counting;

    /// What a search says at its end, and the findings that it names.
    fn search(name: &'static str, read: impl FnMut(&Input, &Path) -> Result<(), String>) -> String {
        let seed = Input::new("a.json", r#"{"width": 3, "names": ["one", "two"]}"#);
        let search = Search { name, cases: 2000, most_bytes: 1 << 20 };
        let run = AssertUnwindSafe(|| search.run(vec![seed], read));
        let folder = env::temp_dir().join(format!("promenade-fuzz-{name}-{}", std::process::id()));
        let panic = catch_unwind(run).err();
        assert_eq!(folder.exists(), panic.is_some(), "findings stay, and nothing else");
        let _none = fs::remove_dir_all(folder);
        panic.map(|panic| text_of(&*panic)).unwrap_or_default()
    }

    fn width(input: &Input) -> Result<u64, String> {
        let value: serde_json::Value = serde_json::from_slice(&input.bytes).map_err(|e| e.to_string())?;
        value["width"].as_u64().ok_or_else(|| "no width".to_owned())
    }

    #[test]
    fn a_panic_behind_a_check_is_found_and_named() {
        let says = search("panics", |input, _| {
            let width = width(input)?;
            assert!(width != 65_535, "too wide");
            Ok(())
        });
        assert!(says.contains("too wide") && says.contains("1-a.json"), "{says}");
    }

    #[test]
    fn memory_that_an_input_asks_for_is_found() {
        let says = search("memory", |input, _| {
            let width = width(input)?.min(1 << 24);
            drop(vec![1_u8; usize::try_from(width).unwrap()]);
            Ok(())
        });
        assert!(says.contains("bytes, at most"), "{says}");
    }

    #[test]
    fn a_reader_without_a_fault_has_no_findings() {
        assert_eq!(search("sound-reader", |input, _| width(input).map(|_| ())), "");
    }

    #[test]
    fn changed_inputs_are_mostly_still_of_their_form() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let read = |path: &str| fs::read(folder.join(path)).unwrap();
        type Reads = fn(&[u8]) -> bool;
        let cases: [(&str, Reads); 3] = [
            ("crates/baker/tests/checkpoint/exported.safetensors", |b| safetensors::SafeTensors::deserialize(b).is_ok()),
            ("crates/testing/fuzz/path/whole/p.json", |b| serde_json::from_slice::<serde_json::Value>(b).is_ok()),
            ("crates/testing/fuzz/sound/whole/int16.wav", |b| {
                b.get(4..8) == Some(&(b.len() as u32).wrapping_sub(8).to_le_bytes())
            }),
        ];
        let mut rng = Rng::with_seed(1);
        for (path, reads) in cases {
            let whole = read(path);
            let changed: Vec<_> = (0..400).map(|_| change::changed(&mut rng, &whole, &whole)).collect();
            let (different, good) =
                (changed.iter().filter(|c| **c != whole).count(), changed.iter().filter(|c| reads(c)).count());
            assert!(different > 300 && good > 120, "{path}: {different} of 400 differ, {good} are of the form");
        }
    }
}
