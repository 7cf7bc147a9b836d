//! Finds, reads and prepares scenes and camera paths off the audio thread.

mod scenes;
mod walks;
mod worn;

use self::scenes::Served;
use crate::budget::Account;
use crate::library::LoadError;
use crate::listener::leader::Leader;
use crate::parameter::Parameter;
use crate::parameter::cast::{index, narrow};
use crate::playing::output::{Output, Pairs};
use crate::project::exchange::{Choices, Exchange};
use crate::project::params::PromenadeParams;
use crate::project::source_walks::{SavedSourceWalks, SourceWalks};
use crate::project::walk::{SavedWalk, Walk};
use crate::telemetry::attention::Attention;
use crate::worker::{Task, lock::lock, repaint::Repaint};
use crossbeam_queue::ArrayQueue;
use promenade_core::headphones::{HeadphoneFilter, Headphones};
use promenade_core::{Emitters, Scene};
use std::sync::atomic::{AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, Weak};
use std::time::Instant;

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
    /// A leader.
    Leader(Arc<Leader>),
    /// A filter of headphones.
    Headphones(Box<HeadphoneFilter>),
}

/// One per instance. Every method but the queues' `pop` and `push` is for threads that may wait.
pub struct Loader {
    params: Arc<PromenadeParams>,
    /// Its share of the budget.
    pub account: Arc<Account>,
    /// What it is asked for and what it reports.
    pub exchange: Arc<Exchange>,
    /// Bits of the host's sample rate, Hz; 0 before activation.
    sample_rate_bits: AtomicU64,
    /// Its number among those of the process.
    number: usize,
    /// Samples of the longest block that is played live, 0 where none is.
    live_block: AtomicU32,
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
    /// What the project has saved of the group's leader; it replaces one that was not fetched.
    pub leaders: ArrayQueue<Option<Arc<Leader>>>,
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
    /// The scene, which nothing else holds where what is played was made of it: Ambisonics.
    held: Option<Arc<Scene>>,
    walk: Weak<Walk>,
    source_walks: Option<Weak<[Option<Walk>]>>,
    level_cb: Option<i32>,
}

impl Loader {
    /// Loads nothing yet.
    pub fn new(params: Arc<PromenadeParams>) -> Arc<Self> {
        static NEXT: AtomicUsize = AtomicUsize::new(0);
        let loader = Arc::new(Self {
            params,
            number: NEXT.fetch_add(1, Ordering::Relaxed),
            live_block: AtomicU32::new(0),
            account: Arc::default(),
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
            leaders: ArrayQueue::new(1),
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
        loader.params.leader.saved.on_restore(&loader, |loader| {
            let saved = loader.params.leader.saved.get().0;
            drop(loader.leaders.force_push(saved.map(|saved| Arc::new(Leader::from(&saved)))));
        });
        loader
    }

    /// Notes the longest block that the host plays live from the next activation on, samples; 0 where it renders offline.
    pub fn play_live(&self, block: u32) {
        self.live_block.store(block, Ordering::Release);
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

    /// The choices of files as they are now, within the budget.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn choices(&self) -> Choices {
        let choices = self.exchange.choices(&self.params);
        Choices { accuracy: choices.accuracy.coarser(self.account.accuracy()), ..choices }
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
    !matches!(result, Err(LoadError::NoneChosen(_)))
}
