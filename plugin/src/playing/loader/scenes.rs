//! Scenes: what the parameters and the project choose, prepared for the audio thread.

use super::{Loader, Prepared, chooses_a_file};
use crate::budget::limit::limit_percent;
use crate::library::factory::{self, FactoryScene};
use crate::library::{self, LoadError, LoadedScene, cache, drawn_room::DrawnRoom, front, level, scene_key::SceneKey};
use crate::parameter::cast::{index, narrow};
use crate::parameter::choices::{AccuracyChoice, LatencyChoice, SceneChoice};
use crate::parameter::row::SlotKind;
use crate::playing::output::{Output, Pairs};
use crate::playing::{shared_worker::SharedWorker, start_pose};
use crate::project::{exchange::Choices, matching::Matching, saved_head::SavedHead, scene_frame::SceneFrame};
use crate::worker::lock::lock;
use nice_plug::{nice_error, nice_warn};
use promenade_core::{DecodeWorker, Emitters, FrontPoint, RenderError, Renderer, RendererConfig, Scene, Trim};
use promenade_fault::{Fault, with_causes};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Once, Weak};

/// Every block that is as long as a hop has a frame to render; a scene's hop, seconds.
const HOP_S: f64 = 0.005;
/// By so much of a hop the frames of instances are apart: however many they are, multiples of the golden section are spread
/// evenly.
const APART: f64 = 0.618_033_988_75;

/// The scene that was loaded last, so that the same request is not served again.
#[derive(Clone, PartialEq)]
pub(super) struct SceneRequest {
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
    accuracy: AccuracyChoice,
    sample_rate_bits: u64,
    /// Whether a host plays it, and whether instances render their frames in blocks of their own then.
    is_live: bool,
    is_staggered: bool,
}

/// A request that was served, and how often the host had restored parts of a state by then.
pub(super) struct Served {
    request: SceneRequest,
    restored: u64,
    /// Level of the scene that came of it, as [`level::level_cb`] has it.
    level_cb: Option<i32>,
    /// Searches that had ended by then, where it waits for one.
    awaits: Option<u32>,
}

impl Served {
    /// Whether what came of it serves another request: the same, or one for a level at which the scene is played already.
    fn serves(&mut self, other: &SceneRequest) -> bool {
        if self.awaits.is_some_and(|ended| ended != front::ended()) {
            return false;
        }
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

/// What came of a request.
struct Made {
    /// As it is heard; `None` where it cannot be.
    scene: Option<Arc<Scene>>,
    prepared: Prepared,
    /// What the user is told; empty where there is nothing to say.
    report: String,
    /// Whether there was a file to load.
    chosen: bool,
    key: SceneKey,
    level_cb: Option<i32>,
}

impl Loader {
    pub(super) fn refresh_scene(&self) {
        let mut last = lock(&self.last_scene);
        loop {
            let (restored, ended) = (self.params.restores(), front::ended());
            let (request, restores) = self.scene_request(last.as_ref());
            if request.sample_rate_bits == 0 || last.as_mut().is_some_and(|last| last.serves(&request)) {
                if let Some(scene) = self.scene() {
                    self.offer(&scene, &request);
                }
                return;
            }
            let before = self.scene();
            let mut made = self.made(&request);
            // Another setting of what is played is faded in when its room sounds as well.
            let is_setting = |last: &Served| SceneRequest { accuracy: request.accuracy, ..last.request.clone() } == request;
            if let (Prepared::Scene(pairs), true) = (&mut made.prepared, last.as_ref().is_some_and(is_setting)) {
                pairs.fade_in_sounding();
            }
            // A state that was restored meanwhile wants another scene: begin again.
            if self.params.scene_key.replace(made.key.clone(), restores) {
                self.report(&made);
                if let Some(scene) = &made.scene {
                    *lock(&self.exchange.frame) = SceneFrame::of(scene);
                    if self.is_chosen(&request, restored, last.as_ref()) {
                        let before = before.map(|scene| scene.start_pose());
                        start_pose::begin(&self.params, before.as_ref(), &scene.start_pose());
                    }
                    self.exchange.opened.set(false);
                }
                let (saved, level_cb) = (made.key.clone(), made.level_cb);
                let awaits = self.is_limited(&request) && made.scene.as_ref().is_some_and(front::is_awaited);
                let awaits = awaits.then_some(ended);
                self.hand_over(made, &request);
                *last = Some(Served { request: SceneRequest { saved, ..request }, restored, level_cb, awaits });
                return;
            }
        }
    }

    /// What is asked for now, and how often a host had restored the scene's key by then.
    fn scene_request(&self, last: Option<&Served>) -> (SceneRequest, u64) {
        let (saved, restores) = self.params.scene_key.get();
        let sample_rate_bits = self.sample_rate_bits.load(Ordering::Acquire);
        let Choices { scene, scene_slot, stereo, latency, accuracy, .. } = self.choices();
        let stereo = stereo || last.is_some_and(|last| last.request.stereo);
        // A factory scene does not depend on the slot.
        let slot = if scene == SceneChoice::Library { scene_slot } else { 0 };
        let (head, _) = self.params.head.get();
        // A drawn room is the project's own scene.
        let room = self.params.room.get().0.filter(|_| scene == SceneChoice::Library && slot == 0);
        let output = self.output();
        let matching = self.params.matching.get().0;
        let live_block = f64::from(self.live_block.load(Ordering::Acquire));
        // Bounces are of all of a scene.
        let accuracy = if live_block > 0.0 { accuracy } else { AccuracyChoice::All };
        let is_staggered = live_block > 0.0 && live_block < HOP_S * f64::from_bits(sample_rate_bits);
        let request = SceneRequest {
            scene,
            slot,
            saved,
            room,
            head,
            matching,
            stereo,
            output,
            latency,
            accuracy,
            sample_rate_bits,
            is_live: live_block > 0.0,
            is_staggered,
        };
        (request, restores)
    }

    /// Prepares what is asked for, or the dry sound where that cannot be played.
    fn made(&self, request: &SceneRequest) -> Made {
        self.exchange.sources_report.set_text(String::new());
        let result = self.found(request).and_then(|found| Ok((self.pairs(&found, request)?, found)));
        let chosen = chooses_a_file(&result);
        match result {
            Ok((pairs, Found { scene, note, key, level_cb })) => {
                Made { scene: Some(scene), prepared: Prepared::Scene(pairs), report: note, chosen, key, level_cb }
            }
            Err(error) => {
                let of_place = || factory::place(request.saved.file_name()).map(|place| place.level_cb);
                let level_cb = request.saved.level_cb.or_else(of_place).filter(|_| request.room.is_none());
                let level_cb = level_cb.map(|level_cb| level_cb + request.matching.change_cb(Some(level_cb)));
                let prepared = Prepared::Dry(level_cb.map_or(1.0, level::gain_of));
                let report = with_causes(&error);
                Made { scene: None, prepared, report, chosen, key: request.saved.clone(), level_cb: None }
            }
        }
    }

    /// What renders the pairs of channels that are asked for.
    fn pairs(&self, found: &Found, request: &SceneRequest) -> Result<Pairs, LoadError> {
        let gain = request.matching.gain(found.level_cb);
        let emitters = |scene: &Arc<Scene>| Ok::<_, LoadError>(self.emitters(scene, request)?.with_level(gain));
        let points = self.offer(&found.scene, request);
        let point = request.accuracy.jnds().and_then(|jnds| FrontPoint::within(&points, jnds).copied());
        let near = point.and_then(|point| Some((cache::with_setting(&found.scene, point.setting)?, point.cost)));
        let (played, share) = near.unwrap_or_else(|| (Arc::clone(&found.scene), 1.0));
        self.account.play(share);
        match request.output {
            Output::Binaural => Ok(Pairs::from_iter([emitters(&played)?])),
            Output::Ambisonic(_) => {
                let no_field = |error| Fault::because("the track's output is Ambisonic", error);
                let pair = |pair| emitters(&cache::ambisonic(&played, pair).map_err(no_field)?);
                (0..request.output.pairs()).map(pair).collect()
            }
        }
    }

    /// Whether less than all of a scene may be asked for, so that what that costs has to be known.
    fn is_limited(&self, request: &SceneRequest) -> bool {
        request.accuracy != AccuracyChoice::All || (request.is_live && limit_percent().is_some())
    }

    /// Offers the budget what a scene can be played with; what that costs is searched for where it is wanted.
    fn offer(&self, scene: &Arc<Scene>, request: &SceneRequest) -> Vec<FrontPoint> {
        if self.is_limited(request) {
            front::search(scene);
        }
        let points = front::known(scene).unwrap_or_default();
        self.account.offer(points.clone());
        points
    }

    /// Tells the user and the host's log what came of a request.
    fn report(&self, Made { prepared, report, chosen, .. }: &Made) {
        static NONE_CHOSEN: Once = Once::new();
        match prepared {
            // Hosts activate several times in a row: it has been said.
            _ if self.exchange.scene_report.text() == *report => (),
            Prepared::Dry(_) if !chosen => NONE_CHOSEN.call_once(|| nice_warn!("{report}")),
            Prepared::Dry(_) => nice_error!("{report}"),
            Prepared::Scene(_) if !report.is_empty() => nice_warn!("{report}"),
            Prepared::Scene(_) => (),
        }
        self.exchange.scene_report.set_text(report.clone());
    }

    /// Gives the audio thread and the editor what came of a request.
    fn hand_over(&self, Made { scene, prepared, level_cb, .. }: Made, request: &SceneRequest) {
        let mut current = lock(&self.current);
        if let (Prepared::Scene(pairs), Some(scene)) = (&prepared, &scene) {
            let decay = f64::from(scene.tail().longest_t60_s()) * f64::from_bits(request.sample_rate_bits);
            let first = pairs.first().map(Emitters::renderer);
            current.delays =
                first.map(|first| [first.latency_samples(), first.tail_samples_with(&Trim::NEUTRAL), index(narrow(decay))]);
        }
        current.level_cb = level_cb;
        current.scene = scene.as_ref().map_or_else(Weak::new, Arc::downgrade);
        current.held = scene.filter(|_| request.output != Output::Binaural || request.accuracy != AccuracyChoice::All);
        drop(current);
        drop(self.scenes.force_push(prepared));
        self.repaint.request_repaint();
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
    fn emitters(&self, scene: &Arc<Scene>, request: &SceneRequest) -> Result<Emitters, Fault> {
        let sample_rate_hz = f64::from_bits(request.sample_rate_bits);
        let carriers = cache::carriers(scene, sample_rate_hz, request.latency.into()).map_err(Fault::of)?;
        let stereo = request.stereo && scene.emitter().is_some();
        let hop = scene.grid().hop as f64 * sample_rate_hz / scene.grid().sample_rate_hz;
        let phase = if request.is_staggered { (self.number as f64 * APART).fract() * hop } else { 0.0 };
        let phase = index(narrow(phase));
        let own = if stereo { 2 } else { 1 };
        let renderer = |voices: usize| {
            let no_thread = |error| Fault::because("no thread to decode poses on", error);
            // The editor shows what the first one attends to.
            let attentions = [Arc::clone(&self.attention), Arc::default()];
            let mut workers: Vec<Box<dyn DecodeWorker>> = Vec::new();
            for attention in &attentions[..own] {
                if let Some(decoder) = SharedWorker::new(scene, attention).map_err(no_thread)? {
                    workers.push(Box::new(decoder));
                }
            }
            let config = RendererConfig { voices, workers, phase, ..(sample_rate_hz, Arc::clone(&carriers)).into() };
            Ok::<_, Fault>(Renderer::new(Arc::clone(scene), config))
        };
        let further = self.params.further();
        let renderer = match renderer(own + further)? {
            Err(error @ RenderError::Voices) if further > 0 => {
                self.exchange.sources_report.set_text(format!("only the first is heard: {error}"));
                renderer(own)?
            }
            made => made,
        };
        let emitters = Emitters::from(renderer.map_err(Fault::of)?);
        Ok(if stereo { emitters.with_second() } else { emitters })
    }

    /// The scene that is asked for, heard with the project's head.
    fn found(&self, request: &SceneRequest) -> Result<Found, LoadError> {
        let saved = &request.saved;
        if let Some(room) = &request.room {
            let scene = self.drawn(room, &request.head)?;
            return Ok(Found { scene, note: String::new(), key: saved.clone(), level_cb: None });
        }
        let mut found = self.find_scene(request)?;
        let level_cb = if request.scene == SceneChoice::Library {
            let known = found.key.level_cb;
            found.key.level_cb = known.or_else(|| level::level_of(&found.scene, &found.hash));
            found.key.level_cb
        } else {
            level::level_of(&found.scene, &found.hash)
        };
        Ok(Found { scene: self.heard(&found, &request.head), note: found.note, key: found.key, level_cb })
    }

    fn find_scene(&self, SceneRequest { scene, slot, saved, .. }: &SceneRequest) -> Result<LoadedScene, LoadError> {
        match scene {
            SceneChoice::RoomA => factory_scene(factory::ROOM_A, saved),
            SceneChoice::RoomB => factory_scene(factory::ROOM_B, saved),
            SceneChoice::Library if *slot == 0 || *slot == saved.slot => library::scene_of(&library::folders(), saved),
            SceneChoice::Library => library::scene_in_slot(&self.params.slots.file(SlotKind::Scene, *slot)?, *slot),
        }
    }
}

/// A factory scene leaves the key as it is, so that going back to the library finds the same scene again.
fn factory_scene(scene: FactoryScene, key: &SceneKey) -> Result<LoadedScene, LoadError> {
    let (scene, hash) = cache::factory_scene(scene)?;
    Ok(LoadedScene { scene, hash, key: key.clone(), note: String::new() })
}
