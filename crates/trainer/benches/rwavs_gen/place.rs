//! A made room with its recordings: of the true room with a microphone's noise to learn from, and without to judge by; of its
//! scan as simulation alone has it.

use crate::house::{DEFAULT_MATERIALS, Room};
use crate::options::{Options, Protocol};
use promenade_baker::capture::{Capture, Split};
use promenade_baker::{BakeError, FileError};
use promenade_core::random::Random;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Level of the noise in recordings under that of all recordings, dB.
const NOISE_DB: f32 = -40.0;
/// Seed of walks, scans and noise, the same for all runs.
const SEED: u64 = 7;
/// Points that INRAS has on surfaces, as published.
pub(crate) const POINTS: usize = 256;

/// A program that is called.
pub(crate) struct Tool {
    program: PathBuf,
}

impl Tool {
    /// The command line that was named, or one that is built.
    pub(crate) fn of(options: &Options) -> Result<Self, BakeError> {
        if let Some(program) = &options.promenade {
            return Ok(Self { program: program.clone() });
        }
        let root = root();
        let build = ["build", "--release", "-p", "promenade", "--features", "train"];
        Self { program: PathBuf::from(env!("CARGO")) }.run(&root, &build.map(str::to_owned))?;
        let folder = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from);
        Ok(Self { program: folder.join("release/promenade") })
    }

    /// Runs it in a folder.
    ///
    /// # Errors
    /// That it fails, with what it says.
    pub(crate) fn run(&self, folder: &Path, arguments: &[String]) -> Result<(), BakeError> {
        let out = Command::new(&self.program).args(arguments).current_dir(folder).output();
        let out = out.map_err(BakeError::read(&self.program))?;
        if out.status.success() {
            return Ok(());
        }
        let called = format!("{} {}", self.program.display(), arguments.join(" "));
        Err(BakeError::argument(called, "to succeed", format!("{}\n{}", out.status, String::from_utf8_lossy(&out.stderr))))
    }
}

/// The repository.
fn root() -> PathBuf {
    // Cargo says where the crate is now.
    let own = std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into());
    Path::new(&own).join("../..")
}

/// Words of a command.
pub(crate) fn words(text: &str) -> Vec<String> {
    text.split_whitespace().map(str::to_owned).collect()
}

/// A room on disk.
pub(crate) struct Place {
    pub(crate) room: &'static Room,
    pub(crate) folder: PathBuf,
    /// As recorded, with noise.
    pub(crate) recorded: Capture,
    /// Without.
    pub(crate) clean: Capture,
    /// The same clips in the scan.
    pub(crate) simulated: Capture,
}

impl Place {
    /// Makes a room's folder where it is not there, whole or not at all.
    ///
    /// # Errors
    /// What simulating, reading and writing meet.
    pub(crate) fn of(room: &'static Room, options: &Options, tool: &Tool) -> Result<Self, BakeError> {
        let folder = options.out.join(room.name);
        if !folder.is_dir() {
            let making = options.out.join(format!("{}.{}", room.name, std::process::id()));
            make(room, &options.protocol, tool, &making)?;
            // Another share may have been faster; both have made the same.
            if std::fs::rename(&making, &folder).is_err() {
                std::fs::remove_dir_all(&making).map_err(FileError::write(&making))?;
            }
        }
        let capture = |name: &str| Capture::load(&folder.join(name));
        let (recorded, clean, simulated) = (capture("recorded")?, capture("clean")?, capture("simulated")?);
        Ok(Self { room, folder, recorded, clean, simulated })
    }

    /// Names of the emitters that are heard in training, from a first on, and of the others.
    pub(crate) fn split(&self, first: usize, heard: usize) -> [Vec<String>; 2] {
        let names: Vec<String> = self.clean.emitters.iter().map(|emitter| emitter.name.clone()).collect();
        let name = |i: usize| names[(first + i) % names.len()].clone();
        [(0..heard).map(name).collect(), (heard..names.len()).map(name).collect()]
    }

    /// A capture whose clips of some emitters are to judge by.
    ///
    /// # Errors
    /// Names that no emitter has.
    pub(crate) fn held_out(capture: &Capture, emitters: &[String]) -> Result<Capture, BakeError> {
        let mut out = capture.clone();
        out.clips.iter_mut().for_each(|clip| clip.split = Split::Train);
        out.hold_out(emitters, &[])?;
        Ok(out)
    }
}

fn make(room: &Room, protocol: &Protocol, tool: &Tool, folder: &Path) -> Result<(), BakeError> {
    std::fs::create_dir_all(folder).map_err(FileError::write(folder))?;
    for (name, text) in [("true.obj", room.mesh()), ("scan.obj", room.scan(SEED)), ("walk.csv", room.walk())] {
        let file = folder.join(name);
        std::fs::write(&file, text).map_err(FileError::write(&file))?;
    }
    let emitters = room.emitters.map(|[x, y, z]| format!("{x},{y},{z}"));
    let further = emitters[1..].iter().map(|at| format!(" --further {at}")).collect::<String>();
    let sounds = ["speech.wav", "phrase.flac"].map(|name| root().join("data").join(name).display().to_string());
    for (mesh, materials, out) in [("true.obj", room.materials, "clean"), ("scan.obj", DEFAULT_MATERIALS, "simulated")] {
        let mut arguments = words(&format!(
            "simulate {mesh} --emitter {}{further} --path walk.csv --poses {} --rate {} --rays 16384 --seed {SEED} \
             --test-share 0 -o {out} --title {} --materials {materials}",
            emitters[0], protocol.places, protocol.rate, room.name
        ));
        arguments.extend(["--head".to_owned(), protocol.head.display().to_string(), "--dry".to_owned()]);
        arguments.extend(sounds.clone());
        tool.run(folder, &arguments)?;
    }
    let mut recorded = Capture::load(&folder.join("clean"))?;
    with_noise(&mut recorded);
    recorded.write(&folder.join("recorded"))?;
    let [low, high] = room.bounds();
    let size = high - low;
    tool.run(folder, &words(&format!("anchors --box {},{},{} -n 64 -o anchors.safetensors", size.x, size.y, size.z)))
}

/// Adds a microphone's noise at [`NOISE_DB`].
fn with_noise(capture: &mut Capture) {
    let ears = || capture.tracks.iter().flat_map(|track| track.binaural.iter().flatten());
    let power = ears().map(|x| f64::from(x * x)).sum::<f64>() / ears().count().max(1) as f64;
    let level = power.sqrt() as f32 * 10.0_f32.powf(NOISE_DB / 20.0);
    let mut random = Random::new(SEED);
    capture.tracks.iter_mut().flat_map(|track| track.binaural.iter_mut().flatten()).for_each(|x| *x += level * random.normal());
}
