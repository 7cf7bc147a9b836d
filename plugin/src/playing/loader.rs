//! Finds, reads and prepares scenes and camera paths off the audio thread.

mod walks;
mod worn;

use crate::library::cache::{self, DrawnRoomError};
use crate::library::drawn_room::DrawnRoom;
use crate::library::error_chain::with_causes;
use crate::library::factory::{self, FactoryScene};
use crate::library::scene_key::SceneKey;
use crate::library::{self, LibraryError, LoadedScene, level};
use crate::parameter::Parameter;
use crate::parameter::cast::{index, narrow};
use crate::parameter::choices::{LatencyChoice, SceneChoice};
use crate::playing::output::{Output, Pairs};
use crate::playing::shared_worker::SharedWorker;
use crate::playing::start_pose;
use crate::project::exchange::{Choices, Exchange};
use crate::project::matching::Matching;
use crate::project::params::PromenadeParams;
use crate::project::saved_head::SavedHead;
use crate::project::scene_frame::SceneFrame;
use crate::project::source_walks::{SavedSourceWalks, SourceWalks};
use crate::project::walk::{SavedWalk, Walk, WalkError};
use crate::telemetry::attention::Attention;
use crate::worker::Task;
use crate::worker::lock::lock;
use crate::worker::repaint::Repaint;
use crossbeam_queue::ArrayQueue;
use nice_plug::{nice_error, nice_warn};
use promenade_core::headphones::{HeadphoneFilter, Headphones};
use promenade_core::{Emitters, Latency, NotAmbisonicError, RenderError, Renderer, Scene, SceneError, Trim};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, Once, Weak};
use std::time::Instant;
use thiserror::Error;

/// Room for what the audio thread no longer needs, until the loader drops it.
const RETIRED_CAPACITY: usize = 16;

/// What the audio thread plays next.
pub enum Prepared {
    /// This scene, at the host's sample rate.
    Scene(Pairs),
    /// The dry sound at a gain, the level of the scene that cannot be loaded.
    Dry(f32),
}

/// What the audio thread no longer needs and must not drop itself.
pub enum Retired {
    /// What rendered a scene that has been faded out.
    Emitters(Box<Emitters>),
    /// A scene that was never played.
    Scene(Prepared),
    /// A camera path.
    Walk(Arc<Walk>),
    /// Paths of sources.
    SourceWalks(SourceWalks),
    /// A filter of headphones.
    Headphones(Box<HeadphoneFilter>),
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
    /// The drawn room makes no scene.
    #[error(transparent)]
    Room(#[from] DrawnRoomError),
    /// The scene cannot be played at the host's sample rate.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The scene has no Ambisonic form.
    #[error("the track's output is Ambisonic")]
    Ambisonic(#[from] NotAmbisonicError),
    /// There is no thread to decode poses on.
    #[error("no thread to decode poses on")]
    Thread(#[source] std::io::Error),
    /// The camera path cannot be used.
    #[error(transparent)]
    Walk(#[from] WalkError),
}

/// The scene that was loaded last, so that the same request is not served again.
#[derive(Clone, PartialEq)]
struct SceneRequest {
    scene: SceneChoice,
    slot: u32,
    saved: SceneKey,
    room: Option<DrawnRoom>,
    head: SavedHead,
    matching: Matching,
    /// Whether there is a second emitter: from the time on that one is first needed.
    stereo: bool,
    output: Output,
    latency: LatencyChoice,
    sample_rate_bits: u64,
}

/// A request that was served, and how often the host had restored parts of a state by then.
struct Served {
    request: SceneRequest,
    restored: u64,
    /// Level of the scene that came of it, as [`level::level_cb`] has it.
    level_cb: Option<i32>,
}

impl Served {
    /// Whether what came of it serves another request: the same, or one for a level at which the scene is played already.
    fn serves(&mut self, other: &SceneRequest) -> bool {
        let [old, new] = [self.request.matching, other.matching];
        self.request.matching = new;
        let serves = self.request == *other && old.gain(self.level_cb) == new.gain(self.level_cb);
        if !serves {
            self.request.matching = old;
        }
        serves
    }
}

/// A scene that was found.
struct Found {
    /// As it is heard.
    scene: Arc<Scene>,
    /// A remark for the user.
    note: String,
    key: SceneKey,
    /// Its level, as [`level::level_cb`] has it; `None` for a drawn room, which changes while it is heard.
    level_cb: Option<i32>,
}

/// One per instance. Every method but the queues' `pop` and `push` is for threads that may wait.
pub struct Loader {
    params: Arc<PromenadeParams>,
    /// What it is asked for and what it reports.
    pub exchange: Arc<Exchange>,
    /// Bits of the host's sample rate, Hz; 0 before activation.
    sample_rate_bits: AtomicU64,
    /// What comes out of the instance.
    output: Mutex<Output>,
    last_scene: Mutex<Option<Served>>,
    /// The headphones that were made a filter of last, and the bits of its sample rate.
    last_headphones: Mutex<Option<(Option<Headphones>, u64)>>,
    /// The slot and the path that were loaded last.
    last_walk: Mutex<Option<(u32, SavedWalk)>>,
    /// The paths of sources that were made ready last.
    last_source_walks: Mutex<Option<SavedSourceWalks>>,
    /// The newest scene; it replaces one that was not fetched.
    pub scenes: ArrayQueue<Prepared>,
    /// The newest camera path, or that there is none any more; it replaces one that was not fetched.
    pub walks: ArrayQueue<Option<Arc<Walk>>>,
    /// The newest paths of sources; they replace those that were not fetched.
    pub source_walks: ArrayQueue<SourceWalks>,
    /// The newest filter of headphones, or that there is none any more; it replaces one that was not fetched.
    pub headphones: ArrayQueue<Option<Box<HeadphoneFilter>>>,
    /// From the audio thread, to be dropped.
    pub retired: ArrayQueue<Retired>,
    /// The choices that were loaded last, or could not be.
    loaded: Mutex<Option<Choices>>,
    /// What was prepared last, for the editor. It does not keep them in memory.
    current: Mutex<Current>,
    /// The attention weights of the scene's decoder.
    pub attention: Arc<Attention>,
    /// Asks an open editor for its next picture.
    pub repaint: Repaint,
}

/// What is played or about to be.
#[derive(Default)]
struct Current {
    scene: Weak<Scene>,
    /// Samples by which it is late, for which it sounds on beyond that with its own decay, and how many of these are its decay.
    delays: Option<[usize; 3]>,
    /// The same where something else is played that was made of it: Ambisonics.
    held: Option<Arc<Scene>>,
    walk: Weak<Walk>,
    source_walks: Option<Weak<[Option<Walk>]>>,
    level_cb: Option<i32>,
}

impl Loader {
    /// Loads nothing yet.
    #[must_use]
    pub fn new(params: Arc<PromenadeParams>) -> Arc<Self> {
        let loader = Arc::new(Self {
            params,
            exchange: Arc::default(),
            sample_rate_bits: AtomicU64::new(0),
            output: Mutex::default(),
            last_scene: Mutex::new(None),
            last_headphones: Mutex::new(None),
            last_walk: Mutex::new(None),
            last_source_walks: Mutex::new(None),
            scenes: ArrayQueue::new(1),
            walks: ArrayQueue::new(1),
            source_walks: ArrayQueue::new(1),
            headphones: ArrayQueue::new(1),
            retired: ArrayQueue::new(RETIRED_CAPACITY),
            loaded: Mutex::default(),
            current: Mutex::default(),
            attention: Arc::default(),
            repaint: Repaint::default(),
        });
        // A host that restores a state and bounces at once hears the restored scene from the first sample.
        loader.params.scene_key.on_restore(&loader, Self::refresh_scene);
        loader.params.room.on_restore(&loader, Self::refresh_scene);
        loader.params.matching.on_restore(&loader, Self::refresh_scene);
        loader.params.head.on_restore(&loader, Self::restored_head);
        loader.params.headphones.on_restore(&loader, Self::restored_headphones);
        loader.params.saved_walk.on_restore(&loader, Self::refresh_walk);
        loader.params.source_walks.on_restore(&loader, Self::refresh_source_walks);
        loader
    }

    /// Takes the host's sample rate and layout, tries again what failed, and loads what the parameters choose unless it is
    /// loaded.
    pub fn activate(&self, sample_rate_hz: f64, output: Output) {
        *lock(&self.output) = output;
        self.sample_rate_bits.store(sample_rate_hz.to_bits(), Ordering::Release);
        self.retry();
        self.refresh();
    }

    /// Tries again at the next refresh what failed.
    pub fn retry(&self) {
        if !self.exchange.scene_report.text().is_empty() {
            *lock(&self.last_scene) = None;
        }
        if !self.exchange.walk_report.text().is_empty() {
            *lock(&self.last_walk) = None;
        }
        if !self.exchange.head_report.text().is_empty() {
            self.exchange.head_wish.again();
        }
        if !self.exchange.headphones_report.text().is_empty() {
            self.exchange.headphones_wish.again();
        }
    }

    /// Loads scene and camera path again at the next refresh.
    #[cfg(test)]
    pub(crate) fn forget(&self) {
        *lock(&self.last_scene) = None;
        *lock(&self.last_walk) = None;
        *lock(&self.last_source_walks) = None;
    }

    /// Drops what the audio thread no longer needs, and loads what the parameters choose unless it is loaded.
    pub fn refresh(&self) {
        while self.retired.pop().is_some() {}
        let choices = self.choices();
        self.refresh_head();
        self.read_headphones();
        self.refresh_headphones();
        self.refresh_scene();
        self.refresh_walk();
        self.refresh_source_walks();
        *lock(&self.loaded) = Some(choices);
    }

    /// The choices of files as they are now.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    #[must_use]
    pub fn choices(&self) -> Choices {
        self.exchange.choices(&self.params)
    }

    /// Whether everything that the parameters choose now has been loaded, or could not be.
    pub fn is_up_to_date(&self) -> bool {
        *lock(&self.loaded) == Some(self.choices())
    }

    /// Samples by which what is played or about to be is late, and for which it sounds on, latency included.
    pub fn delays(&self) -> Option<[usize; 2]> {
        let [latency, tail, decay] = lock(&self.current).delays?;
        let longer = f64::from(self.params.heard(Parameter::Decay)) - 1.0;
        let tail = index(narrow(tail as f64 + longer * decay as f64));
        Some([latency, latency + tail])
    }

    /// The scene that is played or about to be.
    pub fn scene(&self) -> Option<Arc<Scene>> {
        lock(&self.current).scene.upgrade()
    }

    /// Level of the scene that is played or about to be, as it is by itself: tenths of a decibel over the dry sound. `None`
    /// without a scene, and of a drawn room.
    pub fn level_cb(&self) -> Option<i32> {
        lock(&self.current).level_cb
    }

    /// The camera path that is ready, followed or not.
    pub fn walk(&self) -> Option<Arc<Walk>> {
        lock(&self.current).walk.upgrade()
    }

    /// The paths of sources that are ready, followed or not.
    pub fn source_walks(&self) -> Option<SourceWalks> {
        lock(&self.current).source_walks.as_ref()?.upgrade()
    }

    /// What comes out of the instance.
    pub fn output(&self) -> Output {
        *lock(&self.output)
    }

    /// The host's sample rate, Hz, once it is known.
    pub fn sample_rate_hz(&self) -> Option<f64> {
        let rate_hz = f64::from_bits(self.sample_rate_bits.load(Ordering::Acquire));
        (rate_hz > 0.0).then_some(rate_hz)
    }

    fn refresh_scene(&self) {
        let mut last = lock(&self.last_scene);
        loop {
            let restored = self.params.restores();
            let (saved, restores) = self.params.scene_key.get();
            let sample_rate_bits = self.sample_rate_bits.load(Ordering::Acquire);
            let Choices { scene, scene_slot, stereo, latency, .. } = self.choices();
            let stereo = stereo || last.as_ref().is_some_and(|last| last.request.stereo);
            // A factory scene does not depend on the slot.
            let slot = if scene == SceneChoice::Library { scene_slot } else { 0 };
            let (head, _) = self.params.head.get();
            // A drawn room is the project's own scene.
            let room = self.params.room.get().0.filter(|_| scene == SceneChoice::Library && slot == 0);
            let output = self.output();
            let matching = self.params.matching.get().0;
            let request = SceneRequest { scene, slot, saved, room, head, matching, stereo, output, latency, sample_rate_bits };
            if sample_rate_bits == 0 || last.as_mut().is_some_and(|last| last.serves(&request)) {
                return;
            }
            let before = self.scene();
            self.exchange.sources_report.set_text(String::new());
            let result = self.found(&request).and_then(|found| {
                let sample_rate_hz = f64::from_bits(sample_rate_bits);
                let gain = matching.gain(found.level_cb);
                let emitters = |scene: &Arc<Scene>| {
                    Ok::<_, LoadError>(self.emitters(scene, sample_rate_hz, latency.into(), stereo)?.with_level(gain))
                };
                let pairs = match output {
                    Output::Binaural => Pairs::from_iter([emitters(&found.scene)?]),
                    Output::Ambisonic(_) => {
                        let pair = |pair| emitters(&cache::ambisonic(&found.scene, pair)?);
                        (0..output.pairs()).map(pair).collect::<Result<_, _>>()?
                    }
                };
                Ok((found, pairs))
            });
            let chosen = chooses_a_file(&result);
            let (scene, prepared, report, key, level_cb) = match result {
                Ok((Found { scene, note, key, level_cb }, pairs)) => (Some(scene), Prepared::Scene(pairs), note, key, level_cb),
                Err(error) => {
                    let level_cb = request.saved.level_cb.filter(|_| request.room.is_none());
                    let level_cb = level_cb.map(|level_cb| level_cb + matching.change_cb(Some(level_cb)));
                    let gain = level_cb.map_or(1.0, level::gain_of);
                    (None, Prepared::Dry(gain), with_causes(&error), request.saved.clone(), None)
                }
            };
            // A state that was restored meanwhile wants another scene: begin again.
            if self.params.scene_key.replace(key.clone(), restores) {
                static NONE_CHOSEN: Once = Once::new();
                match &prepared {
                    // Hosts activate several times in a row: it has been said.
                    _ if self.exchange.scene_report.text() == report => (),
                    Prepared::Dry(_) if !chosen => NONE_CHOSEN.call_once(|| nice_warn!("{report}")),
                    Prepared::Dry(_) => nice_error!("{report}"),
                    Prepared::Scene(_) if !report.is_empty() => nice_warn!("{report}"),
                    Prepared::Scene(_) => (),
                }
                self.exchange.scene_report.set_text(report);
                if let Some(scene) = &scene {
                    self.exchange.frame.set_frame(SceneFrame::of(scene));
                    if self.is_chosen(&request, restored, last.as_ref()) {
                        let before = before.map(|scene| scene.start_pose());
                        start_pose::begin(&self.params, before.as_ref(), &scene.start_pose());
                    }
                    self.exchange.opened.set(false);
                }
                let mut current = lock(&self.current);
                if let (Prepared::Scene(pairs), Some(scene)) = (&prepared, &scene) {
                    let decay = f64::from(scene.tail().longest_t60_s()) * f64::from_bits(sample_rate_bits);
                    current.delays = pairs
                        .first()
                        .map(Emitters::first)
                        .map(|first| [first.latency_samples(), first.tail_samples_with(&Trim::NEUTRAL), index(narrow(decay))]);
                }
                current.level_cb = level_cb;
                current.scene = scene.as_ref().map_or_else(Weak::new, Arc::downgrade);
                current.held = scene.filter(|_| output != Output::Binaural);
                drop(current);
                drop(self.scenes.force_push(prepared));
                self.repaint.request_repaint();
                *last = Some(Served { request: SceneRequest { saved: key, ..request }, restored, level_cb });
                return;
            }
        }
    }

    /// Whether a scene was chosen for itself: by its parameters or as a file, not with a state that says where the listener is.
    fn is_chosen(&self, request: &SceneRequest, restored: u64, last: Option<&Served>) -> bool {
        let SceneRequest { scene, slot, saved, room, .. } = request;
        let chosen = |last: &Served| last.restored == restored && (last.request.scene, last.request.slot) != (*scene, *slot);
        let by_slot = *slot != 0 && *slot != saved.slot;
        let is_new = by_slot || last.is_some_and(chosen) || self.exchange.opened.is_on();
        is_new && room.is_none() && !self.exchange.restoring.is_on()
    }

    /// What renders a scene.
    fn emitters(&self, scene: &Arc<Scene>, sample_rate_hz: f64, latency: Latency, stereo: bool) -> Result<Emitters, LoadError> {
        let carriers = cache::carriers(scene, sample_rate_hz, latency)?;
        let renderer = |attention| {
            let renderer = Renderer::with_carriers(Arc::clone(scene), sample_rate_hz, Arc::clone(&carriers))?;
            let decoder = SharedWorker::new(scene, attention).map_err(LoadError::Thread)?;
            Ok::<_, LoadError>(match decoder {
                Some(decoder) => renderer.with_worker(Box::new(decoder)),
                None => renderer,
            })
        };
        let first = renderer(&self.attention)?;
        let first = match (self.params.further(), first.takes_further()) {
            (0, _) => first,
            (count, Ok(())) => first.with_further(count)?,
            (_, Err(error)) => {
                self.exchange.sources_report.set_text(format!("only the first is heard: {error}"));
                first
            }
        };
        let emitters = Emitters::from(first);
        if stereo && scene.emitter().is_some() {
            // The editor shows what the first one attends to.
            return Ok(emitters.with_second(renderer(&Arc::default())?));
        }
        Ok(emitters)
    }

    /// The scene that is asked for, heard with the project's head.
    fn found(&self, request: &SceneRequest) -> Result<Found, LoadError> {
        let saved = &request.saved;
        if let Some(room) = &request.room {
            let scene = self.drawn(room, &request.head)?;
            return Ok(Found { scene, note: String::new(), key: saved.clone(), level_cb: None });
        }
        let mut found = find_scene(request)?;
        let level_cb = if request.scene == SceneChoice::Library {
            let known = found.key.level_cb;
            found.key.level_cb = known.or_else(|| level::level_of(&found.scene, &found.hash));
            found.key.level_cb
        } else {
            level::level_of(&found.scene, &found.hash)
        };
        Ok(Found { scene: self.heard(&found, &request.head), note: found.note, key: found.key, level_cb })
    }
}

impl Task for Loader {
    fn run(&self) -> Option<Instant> {
        self.refresh();
        None
    }
}

/// Whether there was a file to load. That a slot is empty is written to the log once in the process: automation passes through
/// all slots.
fn chooses_a_file<T>(result: &Result<T, LoadError>) -> bool {
    !matches!(result, Err(LoadError::Library(LibraryError::EmptySlot { .. } | LibraryError::NoScene)))
}

fn find_scene(SceneRequest { scene, slot, saved, .. }: &SceneRequest) -> Result<LoadedScene, LoadError> {
    match scene {
        SceneChoice::RoomA => factory_scene(factory::ROOM_A, saved),
        SceneChoice::RoomB => factory_scene(factory::ROOM_B, saved),
        SceneChoice::Library if *slot == 0 || *slot == saved.slot => Ok(library::scene_of(&library::folders(), saved)?),
        SceneChoice::Library => Ok(library::scene_in_slot(&library::folders(), *slot)?),
    }
}

/// A factory scene leaves the key as it is, so that going back to the library finds the same scene again.
fn factory_scene(scene: FactoryScene, key: &SceneKey) -> Result<LoadedScene, LoadError> {
    let read = cache::scene_from(scene.bytes);
    let (scene, hash) = read.map_err(|error| LoadError::Factory { id: scene.id, error })?;
    Ok(LoadedScene { scene, hash, key: key.clone(), note: String::new() })
}
