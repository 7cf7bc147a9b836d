//! Finds, reads and prepares scenes and camera paths off the audio thread, and hands them over.

use crate::attention::Attention;
use crate::cache;
use crate::causes::in_words;
use crate::decoder::SharedWorker;
use crate::factory::{self, FactoryScene};
use crate::library::{self, Found, LibraryError};
use crate::params::{Choices, PromenadeParams, SceneChoice};
use crate::reference::SceneReference;
use crate::walk::{KeptWalk, Walk, WalkError};
use crate::worker::Chore;
use crossbeam_queue::ArrayQueue;
use nice_plug::{nice_error, nice_warn};
use nice_plug_egui::RepaintNotifier;
use promenade_core::{RenderError, Renderer, Scene, SceneError};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use thiserror::Error;

/// Room for what the audio thread has done with, until the loader drops it.
const RETIRED_CAPACITY: usize = 16;

/// What the audio thread plays next.
pub enum Stage {
    /// This scene, at the host's sample rate.
    Scene(Box<Renderer>),
    /// The dry sound, because the scene cannot be had.
    Dry,
}

/// What the audio thread has done with and must not drop itself.
pub enum Retired {
    /// A scene that has been faded out, or that was never played.
    Scene(Stage),
    /// A camera path.
    Walk(Arc<Walk>),
}

/// Why a scene or a camera path cannot be played.
#[derive(Debug, Error)]
pub enum LoadError {
    /// The file cannot be found or read.
    #[error(transparent)]
    Library(#[from] LibraryError),
    /// A factory scene is damaged.
    #[error("factory scene {id}: {error}")]
    Factory {
        /// The scene's id.
        id: &'static str,
        /// What is wrong with it.
        error: SceneError,
    },
    /// The scene cannot be played at the host's sample rate.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// There is no thread to decode poses on.
    #[error("no thread to decode poses on")]
    Thread(#[source] std::io::Error),
    /// The camera path is none.
    #[error(transparent)]
    Walk(#[from] WalkError),
}

/// What was loaded last, to do nothing when the same is asked for again.
#[derive(Clone, PartialEq)]
struct Wish<T> {
    choices: Choices,
    kept: T,
    sample_rate_bits: u64,
}

/// One per instance. Every method but the queues' `pop` and `push` is for threads that may wait.
pub struct Loader {
    params: Arc<PromenadeParams>,
    /// Bits of the host's sample rate, Hz; 0 before activation.
    sample_rate_bits: AtomicU64,
    scene_wish: Mutex<Option<Wish<SceneReference>>>,
    walk_wish: Mutex<Option<Wish<KeptWalk>>>,
    /// The newest stage; a newer one takes the place of one that was not fetched.
    pub stages: ArrayQueue<Stage>,
    /// The newest camera path, or that there is none any more.
    pub walks: ArrayQueue<Option<Arc<Walk>>>,
    /// From the audio thread, to be dropped.
    pub retired: ArrayQueue<Retired>,
    /// What was handed over last, for the editor. It does not keep them in memory.
    shown: Mutex<Shown>,
    /// What the scene's decoder attends to.
    pub attention: Arc<Attention>,
    /// Asks an open editor for its next picture.
    pub repaint: RepaintNotifier,
}

/// What is played or about to be.
#[derive(Default)]
struct Shown {
    scene: Weak<Scene>,
    walk: Weak<Walk>,
}

impl Loader {
    /// Loads nothing yet.
    #[must_use]
    pub fn new(params: Arc<PromenadeParams>) -> Arc<Self> {
        let loader = Arc::new(Self {
            params,
            sample_rate_bits: AtomicU64::new(0),
            scene_wish: Mutex::new(None),
            walk_wish: Mutex::new(None),
            stages: ArrayQueue::new(1),
            walks: ArrayQueue::new(1),
            retired: ArrayQueue::new(RETIRED_CAPACITY),
            shown: Mutex::default(),
            attention: Arc::default(),
            repaint: RepaintNotifier::new(),
        });
        // A host that restores a state and bounces at once hears the restored scene from the first sample.
        let (scenes, walks) = (Arc::downgrade(&loader), Arc::downgrade(&loader));
        loader.params.scene_reference.on_restore(move || {
            if let Some(loader) = scenes.upgrade() {
                loader.refresh_scene();
            }
        });
        loader.params.kept_walk.on_restore(move || {
            if let Some(loader) = walks.upgrade() {
                loader.refresh_walk();
            }
        });
        loader
    }

    /// Takes the host's sample rate, gives what failed another try, and loads what is wanted and not yet loaded.
    pub fn activate(&self, sample_rate_hz: f64) {
        self.sample_rate_bits.store(sample_rate_hz.to_bits(), Ordering::Release);
        self.retry();
        self.refresh();
    }

    /// Gives what failed another try at the next refresh.
    pub fn retry(&self) {
        if !self.params.scene_report.text().is_empty() {
            *lock(&self.scene_wish) = None;
        }
        if !self.params.walk_report.text().is_empty() {
            *lock(&self.walk_wish) = None;
        }
    }

    /// Loads scene and camera path again at the next refresh.
    #[cfg(test)]
    pub(crate) fn forget(&self) {
        *lock(&self.scene_wish) = None;
        *lock(&self.walk_wish) = None;
    }

    /// Drops what the audio thread has done with, and loads what is wanted and not yet loaded.
    pub fn refresh(&self) {
        while self.retired.pop().is_some() {}
        self.refresh_scene();
        self.refresh_walk();
    }

    /// The scene that is played or about to be.
    pub fn scene(&self) -> Option<Arc<Scene>> {
        lock(&self.shown).scene.upgrade()
    }

    /// The camera path at hand.
    pub fn walk(&self) -> Option<Arc<Walk>> {
        lock(&self.shown).walk.upgrade()
    }

    fn refresh_scene(&self) {
        let mut last = lock(&self.scene_wish);
        loop {
            let (reference, restores) = self.params.scene_reference.get();
            let sample_rate_bits = self.sample_rate_bits.load(Ordering::Acquire);
            let wish = Wish { choices: self.scene_choices(), kept: reference, sample_rate_bits };
            if sample_rate_bits == 0 || last.as_ref() == Some(&wish) {
                return;
            }
            let result = find_scene(wish.choices, &wish.kept);
            let result = result.and_then(|found| {
                let renderer = Renderer::new(Arc::clone(&found.scene), f64::from_bits(sample_rate_bits))?;
                let decoder = SharedWorker::new(&found.scene, &self.attention).map_err(LoadError::Thread)?;
                Ok((
                    found,
                    match decoder {
                        Some(decoder) => renderer.with_worker(Box::new(decoder)),
                        None => renderer,
                    },
                ))
            });
            let (stage, report, reference) = match result {
                Ok((found, renderer)) => (Stage::Scene(Box::new(renderer)), found.note, found.reference),
                Err(error) => (Stage::Dry, in_words(&error), wish.kept.clone()),
            };
            // A state restored meanwhile asks for another scene: begin again.
            if self.params.scene_reference.replace(reference.clone(), restores) {
                match &stage {
                    Stage::Dry => nice_error!("{report}"),
                    Stage::Scene(_) if !report.is_empty() => nice_warn!("{report}"),
                    Stage::Scene(_) => (),
                }
                self.params.scene_report.say(report);
                lock(&self.shown).scene = match &stage {
                    Stage::Scene(renderer) => Arc::downgrade(renderer.scene()),
                    Stage::Dry => Weak::new(),
                };
                drop(self.stages.force_push(stage));
                self.repaint.request_repaint();
                *last = Some(Wish { kept: reference, ..wish });
                return;
            }
        }
    }

    fn refresh_walk(&self) {
        let mut last = lock(&self.walk_wish);
        loop {
            let (file, restores) = self.params.kept_walk.get();
            let wish = Wish { choices: self.walk_choices(), kept: file, sample_rate_bits: 0 };
            if last.as_ref() == Some(&wish) {
                return;
            }
            let result = find_walk(wish.choices.walk_slot, &wish.kept);
            let (walk, report, file) = match result.and_then(|file| Ok((file.to_walk()?, file))) {
                Ok((walk, file)) => (walk.map(Arc::new), String::new(), file),
                Err(error) => (None, in_words(&error), wish.kept.clone()),
            };
            if self.params.kept_walk.replace(file.clone(), restores) {
                if !report.is_empty() {
                    nice_error!("{report}");
                }
                self.params.walk_report.say(report);
                lock(&self.shown).walk = walk.as_ref().map_or_else(Weak::new, Arc::downgrade);
                drop(self.walks.force_push(walk));
                self.repaint.request_repaint();
                *last = Some(Wish { kept: file, ..wish });
                return;
            }
        }
    }

    /// The choices without what the scene does not depend on.
    fn scene_choices(&self) -> Choices {
        let choices = self.params.choices();
        let scene_slot = if choices.scene == SceneChoice::Library { choices.scene_slot } else { 0 };
        Choices { scene_slot, walk_slot: 0, ..choices }
    }

    /// The choices without what the camera path does not depend on.
    fn walk_choices(&self) -> Choices {
        Choices { scene: SceneChoice::Library, scene_slot: 0, walk_slot: self.params.choices().walk_slot }
    }
}

impl Chore for Loader {
    fn serve(&self) {
        self.refresh();
    }
}

fn find_scene(choices: Choices, reference: &SceneReference) -> Result<Found, LoadError> {
    match choices.scene {
        SceneChoice::RoomA => factory_scene(factory::ROOM_A, reference),
        SceneChoice::RoomB => factory_scene(factory::ROOM_B, reference),
        SceneChoice::Library if choices.scene_slot == 0 || choices.scene_slot == reference.slot => {
            Ok(library::scene_of(&library::folders(), reference)?)
        }
        SceneChoice::Library => Ok(library::scene_in_slot(&library::folders(), choices.scene_slot)?),
    }
}

/// A factory scene leaves the reference as it is, so that going back to the library finds the same scene again.
fn factory_scene(scene: FactoryScene, reference: &SceneReference) -> Result<Found, LoadError> {
    let read = cache::scene_from(scene.bytes);
    let (scene, _) = read.map_err(|error| LoadError::Factory { id: scene.id, error })?;
    Ok(Found { scene, reference: reference.clone(), note: String::new() })
}

fn find_walk(slot: u32, kept: &KeptWalk) -> Result<KeptWalk, LoadError> {
    if slot == 0 || slot == kept.slot {
        return Ok(kept.clone());
    }
    let path = library::file_in_slot(&library::folders(), library::WALKS, slot)?;
    Ok(KeptWalk { slot, ..KeptWalk::from_file(&path)?.0 })
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
