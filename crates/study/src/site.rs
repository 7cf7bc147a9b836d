//! A study as a folder that a web server shows.

use crate::composite::{self, WEIGHTS_HZ};
use crate::definition::{Item, Part, REFERENCE, Stimulus, Study};
use crate::http::compressed;
use crate::loudness::{Loudness, matching};
use crate::page::{FILES, texts};
use crate::place::{self, Place};
use fastrand::Rng;
use promenade_audio::wav::{self, Format};
use promenade_audio::{FileError, atomic, file, sound};
use promenade_core::{MAX_SCENE_BYTES, Scene};
use promenade_fault::Fault;
use promenade_player::{Player, Playing};
use promenade_web::{ENGINE_FILE, files as web_files};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Name of the study in the site.
pub(crate) const STUDY_FILE: &str = "study.json";
/// Where answers are sent to.
pub(crate) const ANSWERS_PATH: &str = "answers";
/// Largest file of sound, bytes.
const MOST_SOUND: u64 = 1 << 30;
/// Seconds of a dry sound by which a scene's loudness is measured.
const MEASURED_S: usize = 20;

/// What a site was made of.
#[derive(Debug, Default)]
pub struct Made {
    /// Remarks for the author.
    pub notes: Vec<String>,
    /// Files of sound and scenes.
    pub stimuli: usize,
    /// Whether listeners walk in it.
    pub live: bool,
}

struct Site<'a> {
    from: &'a Path,
    to: &'a Path,
    /// Names by file and frames.
    names: HashMap<(PathBuf, usize), String>,
    digest: u64,
    rng: Rng,
    match_loudness: bool,
    made: Made,
}

/// Writes a study's site. Paths in it are relative to the study file. `engine`: the compiled engine (promenade.wasm), for live
/// scenes.
///
/// Files of sound and scenes get names by chance, which tell nothing.
///
/// # Errors
/// A file that cannot be read or written, is no sound or no scene; live scenes without an engine.
pub fn write_site(study: &Study, file_of_study: &Path, to: &Path, engine: Option<&[u8]>) -> Result<Made, Fault> {
    promenade_web::check_folder(to).map_err(Fault::new)?;
    let from = file_of_study.parent().unwrap_or(Path::new(""));
    let live = study.is_live();
    let (rng, names, digest) = (Rng::with_seed(study.seed), HashMap::new(), 0xcbf2_9ce4_8422_2325);
    let mut site =
        Site { from, to, names, digest, rng, match_loudness: study.match_loudness, made: Made { live, ..Made::default() } };
    std::fs::create_dir_all(to.join("stimuli")).map_err(FileError::write(to))?;
    let parts = study.parts.iter().map(|part| site.part(part)).collect::<Result<Vec<_>, _>>()?;
    let engine = if live {
        Some(engine.ok_or_else(|| Fault::new("the study plays scenes, which needs the engine as WebAssembly"))?)
    } else {
        None
    };
    let of_web = |name: &str| matches!(name, "shader.js" | "walking.js") || (live && name.starts_with("engine/"));
    for (name, contents) in FILES.iter().chain(web_files().iter().filter(|(name, _)| of_web(name))) {
        write(to, name, contents.as_bytes())?;
    }
    if let Some(engine) = engine {
        write(to, ENGINE_FILE, engine)?;
    }
    let mut page = json!({
        "study": study.study,
        "title": study.title,
        "welcome": study.welcome,
        "consent": study.consent,
        "thanks": study.thanks,
        "seed": study.seed,
        "headphones": study.headphones,
        "post": study.post.then_some(ANSWERS_PATH),
        "code": study.code,
        "questions": (!study.questions.is_empty()).then_some(&study.questions),
        "parts": parts,
    });
    // A study that was changed, or whose sounds were, is another version: its answers are other answers.
    let version = self::digest(site.digest, page.to_string().as_bytes());
    page["version"] = json!(format!("v{:08x}", (version ^ (version >> 32)) as u32));
    let (language, texts) = texts(study.language.as_deref().unwrap_or("en"), from)?;
    (page["language"], page["texts"]) = (json!(language), json!(texts));
    write(to, STUDY_FILE, format!("{page:#}\n").as_bytes())?;
    site.made.stimuli = site.names.len();
    Ok(site.made)
}

impl Site<'_> {
    fn part(&mut self, part: &Part) -> Result<Value, Fault> {
        let items = part.items.iter().map(|item| self.item(item)).collect::<Result<Vec<_>, _>>()?;
        let mut page = json!({
            "method": part.method, "anchor": part.anchor, "training": part.training, "no_preference": part.no_preference,
            "items": items,
        });
        for (key, value) in [
            ("intro", json!(part.intro)),
            ("title", json!(part.title)),
            ("question", json!(part.question)),
            ("sequence", json!(part.sequence)),
            ("seconds", json!(part.seconds)),
            ("listen_s", json!(part.listen_s)),
            ("repeats", json!(part.repeats)),
            ("pairs", json!(part.pairs)),
            ("words", json!(part.words)),
        ] {
            // The page's own value holds where there is none.
            if !value.is_null() {
                page[key] = value;
            }
        }
        Ok(page)
    }

    fn item(&mut self, item: &Item) -> Result<Value, Fault> {
        let reference = item.reference.clone().map(Stimulus::One);
        let (names, stimuli): (Vec<&str>, Vec<Vec<PathBuf>>) = (reference.iter().map(|stimulus| (REFERENCE, stimulus)))
            .chain(item.conditions.iter().map(|(name, stimulus)| (&**name, stimulus)))
            .map(|(name, stimulus)| (name, stimulus.files().iter().map(|file| self.from.join(file)).collect()))
            .unzip();
        let paths: Vec<PathBuf> = stimuli.iter().map(|files: &Vec<PathBuf>| files[0].clone()).collect();
        let mut page = json!({ "name": item.name });
        let (files, loudness): (Vec<String>, Vec<Loudness>) = match (&item.dry, &item.sound) {
            (Some(dry), _) => {
                let (file, dry, rate) = self.dry(&self.from.join(dry))?;
                let scenes = paths.iter().map(read_scene).collect::<Result<Vec<_>, _>>()?;
                let place = place::common(item, &scenes, &paths)?;
                page["dry"] = json!(file);
                page["place"] = place.page();
                let at = |(path, scene): (&PathBuf, &Arc<Scene>)| self.scene(path, scene, &place, &dry, rate);
                paths.iter().zip(&scenes).map(at).collect::<Result<Vec<_>, _>>()?
            }
            (None, Some(sound)) => {
                let path = self.from.join(sound);
                page["weights"] = json!({ "hz": WEIGHTS_HZ, "of": composite::weights(&path)? });
                vec![self.sounds(&[path])?.remove(0); paths.len()]
            }
            (None, None) => self.sounds(&paths)?,
        }
        .into_iter()
        .unzip();
        let matched = if self.match_loudness { matching(&loudness) } else { Some(vec![1.0; loudness.len()]) };
        let gains = matched.unwrap_or_else(|| {
            self.made.notes.push(format!("{}: a sound is silent or shorter than 0.4 s: its item is not matched", item.name));
            vec![1.0; loudness.len()]
        });
        let mut all: Vec<Value> = (names.iter().zip(files).zip(gains))
            .map(|((name, file), gain)| json!({ "name": name, "file": file, "gain": gain }))
            .collect();
        if item.sound.is_some() {
            let pictures = self.pictures(&stimuli)?;
            all.iter_mut().zip(pictures).for_each(|(sound, pictures)| sound["pictures"] = json!(pictures));
        }
        page["reference"] = item.reference.as_ref().map_or(Value::Null, |_| all.remove(0));
        page["conditions"] = json!(all);
        Ok(page)
    }

    /// A name that tells nothing for a file that is heard to so many frames, and whether it is new. Its bytes are part of the
    /// version.
    fn name(&mut self, path: &Path, frames: usize, bytes: &[u8], ending: &str) -> (String, bool) {
        let key = (path.to_owned(), frames);
        if let Some(name) = self.names.get(&key) {
            return (name.clone(), false);
        }
        self.digest = digest(self.digest, bytes);
        let name = format!("stimuli/{:016x}.{ending}", self.rng.u64(..));
        self.names.insert(key, name.clone());
        (name, true)
    }

    /// Puts a file's bytes into the site, once.
    fn put(&mut self, path: &Path, frames: usize, bytes: &[u8], ending: &str) -> Result<String, Fault> {
        let (name, new) = self.name(path, frames, bytes, ending);
        if new {
            write(self.to, &name, bytes)?;
        }
        Ok(name)
    }

    /// Sounds that are compared with each other, which go round together: they have one rate, and the shorter ones end in
    /// silence.
    fn sounds(&mut self, paths: &[PathBuf]) -> Result<Vec<(String, Loudness)>, Fault> {
        let heard = paths.iter().map(|path| sound::read(path)).collect::<Result<Vec<_>, _>>()?;
        let rate = heard[0].sample_rate_hz;
        let frames = heard.iter().map(|sound| sound.frames()).max().unwrap_or(0);
        let mut found = Vec::new();
        for (path, mut heard) in paths.iter().zip(heard) {
            let loudness = Loudness::new(&heard.channels, heard.sample_rate_hz);
            if heard.sample_rate_hz != rate {
                let expected = format!("{rate} Hz, as {} has", paths[0].display());
                return Err(FileError::content(path, expected, format_args!("{} Hz", heard.sample_rate_hz)));
            }
            let bytes = file::read(path, MOST_SOUND).map_err(FileError::read(path))?;
            let file = if heard.frames() == frames {
                self.put(path, frames, &bytes, ending(path))?
            } else {
                let seconds = |frames: usize| frames as f64 / f64::from(rate);
                let [from, to] = [heard.frames(), frames].map(seconds);
                self.made
                    .notes
                    .push(format!("{}: {from:.3} s, with silence to {to:.3} s as others of its item", path.display()));
                heard.channels.iter_mut().for_each(|channel| channel.resize(frames, 0.0));
                let (name, new) = self.name(path, frames, &bytes, "wav");
                if new {
                    let channels: Vec<&[f32]> = heard.channels.iter().map(Vec::as_slice).collect();
                    wav::write(&self.to.join(&name), rate, &channels, Format::Float32)?;
                }
                name
            };
            found.push((file, loudness));
        }
        Ok(found)
    }

    /// Pictures that are compared with each other: they have one size.
    fn pictures(&mut self, stimuli: &[Vec<PathBuf>]) -> Result<Vec<Vec<String>>, Fault> {
        let mut first = None;
        let mut picture = |path: &PathBuf| {
            let bytes = file::read(path, MOST_SOUND).map_err(FileError::read(path))?;
            // A PNG begins with eight bytes of its own, the head's length and name, width and height.
            let size = bytes.get(16..24).filter(|_| bytes.starts_with(b"\x89PNG\r\n\x1a\n"));
            let size = size.ok_or_else(|| FileError::content(path, "a picture (PNG)", "another file"))?.to_vec();
            let expected = first.get_or_insert_with(|| size.clone());
            if *expected != size {
                return Err(FileError::content(path, "a picture of the size of the others of its item", "another"));
            }
            self.put(path, 0, &bytes, "png")
        };
        stimuli.iter().map(|paths| paths.iter().map(&mut picture).collect()).collect()
    }

    /// A dry sound: its file, its samples in one channel and their rate.
    fn dry(&mut self, path: &Path) -> Result<(String, Vec<f32>, u32), Fault> {
        let bytes = file::read(path, MOST_SOUND).map_err(FileError::read(path))?;
        let heard = sound::read(path)?;
        let count = heard.channels.len().max(1) as f32;
        let frames = heard.frames().min(MEASURED_S * heard.sample_rate_hz as usize);
        let mono = (0..frames).map(|i| heard.channels.iter().map(|c| c[i]).sum::<f32>() / count).collect();
        Ok((self.put(path, heard.frames(), &bytes, ending(path))?, mono, heard.sample_rate_hz))
    }

    /// A scene, and how loud a dry sound is where listeners begin.
    fn scene(
        &mut self,
        path: &Path,
        scene: &Arc<Scene>,
        place: &Place,
        dry: &[f32],
        rate: u32,
    ) -> Result<(String, Loudness), Fault> {
        let bytes = file::read(path, MAX_SCENE_BYTES as u64).map_err(FileError::read(path))?;
        let render = || Player::new(scene, f64::from(rate), Playing::Stream)?.render(dry, &mut |_| place.start);
        let ears = render().map_err(Fault::at(path, "cannot be rendered"))?;
        Ok((self.put(path, 0, &bytes, "promenade")?, Loudness::new(&ears, rate)))
    }
}

fn read_scene(path: &PathBuf) -> Result<Arc<Scene>, Fault> {
    let bytes = file::read(path, MAX_SCENE_BYTES as u64).map_err(FileError::read(path))?;
    Scene::from_bytes(&bytes).map(Arc::new).map_err(|error| Fault::unreadable(path, "scene", error))
}

fn ending(path: &Path) -> &'static str {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("flac")) { "flac" } else { "wav" }
}

/// Writes a file of the site, and beside it what servers send instead to browsers that take it.
fn write(site: &Path, name: &str, bytes: &[u8]) -> Result<(), Fault> {
    let path = site.join(name);
    std::fs::create_dir_all(path.parent().unwrap_or(site)).map_err(FileError::write(&path))?;
    let beside = site.join(format!("{name}.gz"));
    match compressed(name, bytes) {
        Some(smaller) => atomic::write(&beside, &smaller)?,
        // That of an older site would be sent.
        None if beside.is_file() => std::fs::remove_file(&beside).map_err(FileError::write(&beside))?,
        None => (),
    }
    atomic::write(&path, bytes)
}

/// FNV-1a, from what came before.
fn digest(before: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(before, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3))
}
