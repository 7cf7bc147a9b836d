//! What the benchmark is asked to do.

use crate::house::ROOMS;
use crate::runs::METHODS;
use promenade_baker::{BakeError, FileError, atomic};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// How it is called.
pub(crate) const USAGE: &str = "\
cargo bench -p promenade-trainer --bench rwavs_gen -- OUT --head FILE.sofa [OPTIONS]

  OUT                  folder of everything that is made; what is there already is not made again
  --head FILE.sofa     ears that record, and that simulate
  --part K/N           run every Nth run, from the Kth on; the table is made of all runs that are there
  --rooms, --methods   names, with commas between [default: all]
  --splits N           emitters that are the first to be heard, at most 4 [default: 4]
  --heard N            emitters that are heard in training, at most 3; the others are judged [default: 1, as RWAVS-Gen]
  --seeds N            seeds of each method that has one [default: 2]
  --steps N            steps of each training [default: 400]
  --places N           places of the walk, a clip of 1 s of each emitter at each [default: 60]
  --rate HZ            sample rate [default: 16000]
  --keep-every N       steps after which a training is kept [default: 50]
  --promenade FILE     the command line, with training [default: it is built]
  --table              print the table alone";

/// What decides the results; a folder has one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Protocol {
    pub(crate) head: PathBuf,
    pub(crate) heard: usize,
    pub(crate) steps: usize,
    pub(crate) places: usize,
    pub(crate) rate: usize,
}

/// All that is asked.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Options {
    pub(crate) out: PathBuf,
    pub(crate) protocol: Protocol,
    pub(crate) rooms: Vec<String>,
    pub(crate) methods: Vec<String>,
    pub(crate) splits: usize,
    pub(crate) seeds: usize,
    pub(crate) part: [usize; 2],
    pub(crate) keep_every: usize,
    pub(crate) promenade: Option<PathBuf>,
    pub(crate) only_table: bool,
}

impl Options {
    /// # Errors
    /// Arguments that are not understood, each with what is expected.
    pub(crate) fn of(arguments: impl Iterator<Item = String>) -> Result<Self, BakeError> {
        let rooms = ROOMS.iter().map(|room| room.name.to_owned()).collect();
        let protocol = Protocol { head: PathBuf::new(), heard: 1, steps: 400, places: 60, rate: 16_000 };
        let mut options = Self {
            out: PathBuf::new(),
            protocol,
            rooms,
            methods: METHODS.map(str::to_owned).to_vec(),
            splits: 4,
            seeds: 2,
            part: [1, 1],
            keep_every: 50,
            promenade: None,
            only_table: false,
        };
        // Cargo tells benches that they are some.
        let mut arguments = arguments.filter(|argument| argument != "--bench");
        while let Some(name) = arguments.next() {
            if !name.starts_with("--") {
                options.out = PathBuf::from(name);
            } else if name == "--table" {
                options.only_table = true;
            } else {
                let value = arguments.next().ok_or_else(|| BakeError::argument(&name, "a value", "none"))?;
                options.set(&name, &value)?;
            }
        }
        for (what, path) in [("OUT", &options.out), ("--head", &options.protocol.head)] {
            if path.as_os_str().is_empty() {
                return Err(BakeError::argument(what, format!("a path\n{USAGE}"), "none"));
            }
        }
        Ok(options)
    }

    fn set(&mut self, name: &str, value: &str) -> Result<(), BakeError> {
        let number = |low: usize, high: usize| {
            let found = value.parse().ok().filter(|n| (low..=high).contains(n));
            found.ok_or_else(|| BakeError::argument(name, format!("a number from {low} to {high}"), value))
        };
        let names = |known: &[String]| {
            let all: Vec<String> = value.split(',').map(str::to_owned).collect();
            let unknown = all.iter().find(|name| !known.contains(name));
            unknown.map_or(Ok(all.clone()), |found| Err(BakeError::argument(name, format!("names of {known:?}"), found)))
        };
        match name {
            "--head" => self.protocol.head = absolute(value)?,
            "--promenade" => self.promenade = Some(absolute(value)?),
            "--rooms" => self.rooms = names(&ROOMS.map(|room| room.name.to_owned()))?,
            "--methods" => self.methods = names(&METHODS.map(str::to_owned))?,
            "--splits" => self.splits = number(1, 4)?,
            "--heard" => self.protocol.heard = number(1, 3)?,
            "--seeds" => self.seeds = number(1, 1000)?,
            "--steps" => self.protocol.steps = number(1, 1_000_000)?,
            "--places" => self.protocol.places = number(4, 100_000)?,
            "--rate" => self.protocol.rate = number(8000, 48_000)?,
            "--keep-every" => self.keep_every = number(1, 1_000_000)?,
            "--part" => {
                let parts = value.split_once('/').and_then(|(k, n)| Some([k.parse().ok()?, n.parse().ok()?]));
                let fits = |[k, n]: &[usize; 2]| (1..=*n).contains(k);
                self.part = parts.filter(fits).ok_or_else(|| BakeError::argument(name, "K/N with K from 1 to N", value))?;
            }
            _ => return Err(BakeError::argument("option", format!("one of\n{USAGE}"), name)),
        }
        Ok(())
    }

    /// Makes the folder one of this protocol.
    ///
    /// # Errors
    /// A folder of another.
    pub(crate) fn claim(&self) -> Result<(), BakeError> {
        std::fs::create_dir_all(&self.out).map_err(FileError::write(&self.out))?;
        let file = self.out.join("protocol.json");
        if file.is_file() {
            let bytes = std::fs::read(&file).map_err(FileError::read(&file))?;
            let found: Protocol = serde_json::from_slice(&bytes).map_err(BakeError::json(&file))?;
            if found != self.protocol {
                return Err(BakeError::content(&file, format!("{:?}", self.protocol), format!("{found:?}")));
            }
            return Ok(());
        }
        let text = serde_json::to_string_pretty(&self.protocol).map_err(BakeError::of)?;
        atomic::write(&file, (text + "\n").as_bytes())
    }
}

fn absolute(path: &str) -> Result<PathBuf, BakeError> {
    Path::new(path).canonicalize().map_err(BakeError::read(path))
}
