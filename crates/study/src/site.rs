//! A study as a folder that a web server shows.

use crate::definition::{Item, Part, REFERENCE, Study};
use crate::loudness::{Loudness, matching};
use crate::page::FILES;
use fastrand::Rng;
use promenade_audio::{FileError, atomic, file, sound};
use promenade_core::{MAX_SCENE_BYTES, Scene};
use promenade_fault::Fault;
use promenade_player::Player;
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
    names: HashMap<PathBuf, String>,
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
    let (rng, names) = (Rng::with_seed(study.seed), HashMap::new());
    let mut site = Site { from, to, names, rng, match_loudness: study.match_loudness, made: Made { live, ..Made::default() } };
    std::fs::create_dir_all(to.join("stimuli")).map_err(FileError::write(to))?;
    let parts = study.parts.iter().map(|part| site.part(part)).collect::<Result<Vec<_>, _>>()?;
    let engine = if live {
        Some(engine.ok_or_else(|| Fault::new("the study plays scenes, which needs the engine as WebAssembly"))?)
    } else {
        None
    };
    let of_web = |name: &str| name == "walking.js" || (live && name.starts_with("engine/"));
    for (name, contents) in FILES.iter().chain(web_files().iter().filter(|(name, _)| of_web(name))) {
        let path = to.join(name);
        std::fs::create_dir_all(path.parent().unwrap_or(to)).map_err(FileError::write(&path))?;
        atomic::write(&path, contents.as_bytes())?;
    }
    if let Some(engine) = engine {
        atomic::write(&to.join(ENGINE_FILE), engine)?;
    }
    let page = json!({
        "study": study.study,
        "title": study.title,
        "welcome": study.welcome,
        "consent": study.consent,
        "thanks": study.thanks,
        "seed": study.seed,
        "headphones": study.headphones,
        "post": study.post.then_some(ANSWERS_PATH),
        "parts": parts,
    });
    atomic::write(&to.join(STUDY_FILE), format!("{page:#}\n").as_bytes())?;
    site.made.stimuli = site.names.len();
    Ok(site.made)
}

impl Site<'_> {
    fn part(&mut self, part: &Part) -> Result<Value, Fault> {
        let items = part.items.iter().map(|item| self.item(item)).collect::<Result<Vec<_>, _>>()?;
        let mut page = json!({ "method": part.method, "anchor": part.anchor, "items": items });
        for (key, value) in [
            ("intro", json!(part.intro)),
            ("title", json!(part.title)),
            ("question", json!(part.question)),
            ("sequence", json!(part.sequence)),
            ("seconds", json!(part.seconds)),
            ("listen_s", json!(part.listen_s)),
            ("repeats", json!(part.repeats)),
        ] {
            // The page's own value holds where there is none.
            if !value.is_null() {
                page[key] = value;
            }
        }
        Ok(page)
    }

    fn item(&mut self, item: &Item) -> Result<Value, Fault> {
        let sounds: Vec<(&str, &PathBuf)> = (item.reference.iter().map(|path| (REFERENCE, path)))
            .chain(item.conditions.iter().map(|(name, path)| (&**name, path)))
            .collect();
        let dry = item.dry.as_ref().map(|path| self.dry(path)).transpose()?;
        let mut loudness = Vec::new();
        let mut files = Vec::new();
        for (_, path) in &sounds {
            let (file, heard) = match &dry {
                Some((_, samples, rate)) => self.scene(path, samples, *rate)?,
                None => self.sound(path)?,
            };
            files.push(file);
            loudness.push(heard);
        }
        let matched = if self.match_loudness { matching(&loudness) } else { Some(vec![1.0; loudness.len()]) };
        let gains = matched.unwrap_or_else(|| {
            self.made.notes.push(format!("{}: a sound is silent or shorter than 0.4 s: its item is not matched", item.name));
            vec![1.0; loudness.len()]
        });
        let mut all: Vec<Value> = (sounds.iter().zip(files).zip(gains))
            .map(|(((name, _), file), gain)| json!({ "name": name, "file": file, "gain": gain }))
            .collect();
        let reference = item.reference.as_ref().map(|_| all.remove(0));
        Ok(json!({ "name": item.name, "dry": dry.map(|(file, ..)| file), "reference": reference, "conditions": all }))
    }

    /// Puts a file's bytes into the site, once, under a name that tells nothing.
    fn put(&mut self, path: &Path, bytes: &[u8], ending: &str) -> Result<String, Fault> {
        if let Some(name) = self.names.get(path) {
            return Ok(name.clone());
        }
        let name = format!("stimuli/{:016x}.{ending}", self.rng.u64(..));
        atomic::write(&self.to.join(&name), bytes)?;
        self.names.insert(path.to_owned(), name.clone());
        Ok(name)
    }

    fn sound(&mut self, path: &Path) -> Result<(String, Loudness), Fault> {
        let path = self.from.join(path);
        let bytes = file::read(&path, MOST_SOUND).map_err(FileError::read(&path))?;
        let heard = sound::read(&path)?;
        let ending = if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("flac")) { "flac" } else { "wav" };
        let loudness = Loudness::new(&heard.channels, heard.sample_rate_hz);
        Ok((self.put(&path, &bytes, ending)?, loudness))
    }

    /// A dry sound: its file, its samples in one channel and their rate.
    fn dry(&mut self, path: &Path) -> Result<(String, Vec<f32>, u32), Fault> {
        let (file, _) = self.sound(path)?;
        let path = self.from.join(path);
        let heard = sound::read(&path)?;
        let count = heard.channels.len().max(1) as f32;
        let frames = heard.frames().min(MEASURED_S * heard.sample_rate_hz as usize);
        let mono = (0..frames).map(|i| heard.channels.iter().map(|c| c[i]).sum::<f32>() / count).collect();
        Ok((file, mono, heard.sample_rate_hz))
    }

    /// A scene, and how loud a dry sound is at its first pose.
    fn scene(&mut self, path: &Path, dry: &[f32], rate: u32) -> Result<(String, Loudness), Fault> {
        let path = self.from.join(path);
        let bytes = file::read(&path, MAX_SCENE_BYTES as u64).map_err(FileError::read(&path))?;
        let scene = Scene::from_bytes(&bytes).map_err(|error| Fault::unreadable(&path, "scene", error))?;
        let scene = Arc::new(scene);
        let start = scene.start_pose();
        let render = || Player::new(&scene, f64::from(rate), None)?.render(dry, &mut |_| start);
        let ears = render().map_err(Fault::at(&path, "cannot be rendered"))?;
        Ok((self.put(&path, &bytes, "promenade")?, Loudness::new(&ears, rate)))
    }
}
