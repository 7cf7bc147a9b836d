//! What is played: the scene and the camera path, as the audio thread takes them over from the loader.

mod gap;
#[cfg(test)]
mod head_tests;
#[cfg(test)]
mod headphones_tests;
pub mod loader;
pub(crate) mod monitor;
pub mod output;
#[cfg(feature = "standalone")]
pub mod player;
pub mod shared_worker;
#[cfg(test)]
mod sources_tests;
mod start_pose;

use crate::listener::leader::Leader;
use crate::playing::gap::Gap;
use crate::playing::loader::{Loader, Prepared, Retired};
use crate::playing::output::{Output, Pairs};
use crate::project::{exchange::Choices, scene_frame::SceneFrame, source_walks::SourceWalks, walk::Walk};
use crate::worker::{LOADER, TaskHandle};
use nice_plug::nice_error;
use promenade_core::Spatializer;
use promenade_core::glam::Vec3;
use promenade_core::headphones::HeadphoneStage;
use std::sync::Arc;
use std::time::Duration;

/// Time between two looks at the loader, offline.
const POLL: Duration = Duration::from_micros(200);

/// The scene and the camera path of one instance. The audio thread owns it.
pub(crate) struct Playing {
    loader: Arc<Loader>,
    /// Wakes the loader; from the first activation on.
    task: Option<TaskHandle>,
    /// What comes out.
    output: Output,
    /// Render the scene, one for each pair of output channels; from the first activation on.
    pub(crate) spatializers: Vec<Spatializer>,
    /// The camera path, if there is one.
    pub(crate) walk: Option<Arc<Walk>>,
    /// The paths of the sources, if there are any.
    pub(crate) source_walks: Option<SourceWalks>,
    /// What is followed where nobody leads the group.
    pub(crate) leader: Option<Arc<Leader>>,
    /// What the listener's headphones need, last of all.
    pub(crate) headphones: HeadphoneStage,
    /// The gain at which the dry sound passes, because the scene that is chosen is missing.
    pub(crate) dry: Option<f32>,
    /// The silence before a scene of another latency, and that scene.
    gap: Gap,
    next: Option<Pairs>,
    /// Whether something was played since the last activation or reset.
    began: bool,
    /// What could not be handed back yet, because the loader has fallen behind.
    held: Option<Retired>,
    /// The choices that the loader was last woken for.
    choices: Option<Choices>,
}

impl Playing {
    /// Plays nothing yet, and allocates nothing.
    pub(crate) fn new(loader: Arc<Loader>) -> Self {
        Self {
            loader,
            task: None,
            output: Output::default(),
            spatializers: Vec::new(),
            walk: None,
            source_walks: None,
            leader: None,
            headphones: HeadphoneStage::default(),
            dry: None,
            gap: Gap::default(),
            began: false,
            next: None,
            held: None,
            choices: None,
        }
    }

    /// Loads what `choices` ask for. The sound begins with the scene, not with a fade to it: a bounce starts here.
    pub(crate) fn activate(&mut self, sample_rate_hz: f64, output: Output, choices: Choices) {
        self.choices = Some(choices);
        // Hosts activate several times in a row; only another sample rate or layout makes all that was prepared useless.
        if output != self.output || self.spatializer().is_none_or(|played| played.sample_rate_hz() != sample_rate_hz) {
            (self.output, self.spatializers) = (output, output.spatializers(sample_rate_hz));
        }
        if self.task.is_none() {
            let task = LOADER.add(self.loader.clone());
            self.task = task.inspect_err(|error| nice_error!("no thread to load scenes while playing: {error}")).ok();
        }
        self.loader.activate(sample_rate_hz, output);
        let waiting = self.next.take().filter(|pairs| pairs.count() == self.spatializers.len());
        match self.loader.scenes.pop().or(waiting.map(Prepared::Scene)) {
            Some(Prepared::Scene(pairs)) => {
                pairs.install(&mut self.spatializers);
                self.dry = None;
            }
            Some(Prepared::Dry(gain)) => self.dry = Some(gain),
            None => (),
        }
        self.gap.begin(self.latency());
        self.began = false;
        if let Some(filter) = self.loader.headphones.pop() {
            drop(self.headphones.install(filter, sample_rate_hz));
        }
        self.receive(false);
    }

    fn latency(&self) -> usize {
        self.spatializer().map_or(0, Spatializer::latency_samples)
    }

    /// Fades what was rendered of a block around a change of the latency, and changes the scene in the silence.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn fade(&mut self, outputs: &mut [&mut [f32]]) {
        let rate_hz = self.spatializer().map_or(0.0, Spatializer::sample_rate_hz);
        self.gap.fade(outputs, rate_hz);
        self.began = true;
        if self.gap.is_silent() {
            self.change_in_silence();
        }
    }

    /// Puts the next scene in the place of the old one; does nothing while what was played before is not handed back.
    fn change_in_silence(&mut self) {
        let Some(next) = self.next.take() else {
            self.gap.wait();
            return;
        };
        // Without a past a scene plays at once.
        self.spatializers.iter_mut().for_each(Spatializer::reset);
        match next.swap_into(&mut self.spatializers) {
            Ok(()) => self.gap.wait(),
            Err(next) => self.next = Some(next),
        }
    }

    /// What renders the scene, or the first two channels of it.
    pub(crate) fn spatializer(&self) -> Option<&Spatializer> {
        self.spatializers.first()
    }

    /// Where the listener of the scene that is played starts, and where its emitter is.
    pub(crate) fn frame(&self) -> Option<SceneFrame> {
        Some(SceneFrame::of(self.spatializer()?.renderer()?.scene()))
    }

    /// Where the scene has its emitter, if it knows that, metres.
    pub(crate) fn emitter(&self) -> Option<Vec3> {
        self.spatializer()?.renderer()?.scene().emitter()
    }

    /// Whether both ears come out.
    pub(crate) fn is_binaural(&self) -> bool {
        self.output == Output::Binaural
    }

    /// Takes over what the loader has ready, and wakes it for other choices or to drop what is no longer needed. With `wait`
    /// the choices are loaded on return.
    ///
    /// # Real-time
    /// Audio thread without `wait`: no allocation, lock or I/O. With it, as long as loading takes.
    pub(crate) fn update(&mut self, choices: Choices, wait: bool) {
        let changed = self.choices != Some(choices);
        // A rendering begins with its scene.
        let gaps = self.began || !wait;
        let hands_back = self.receive(gaps);
        // Also for choices that were made before the host said that it renders offline.
        let behind = wait && !self.loader.is_up_to_date();
        let Some(task) = self.task.as_ref().filter(|_| changed || hands_back || behind) else { return };
        self.choices = Some(choices);
        task.schedule();
        if behind {
            while !self.loader.is_up_to_date() {
                // Other threads may change the choices meanwhile.
                task.schedule();
                std::thread::sleep(POLL);
            }
            self.receive(gaps);
        }
    }

    /// Begins anew with the newest scene: nothing of the past is heard.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn reset(&mut self) {
        // A reset ends a running fade, so that the newest scene can be taken; the second ends the fade to it.
        self.spatializers.iter_mut().for_each(Spatializer::reset);
        self.receive(false);
        if self.next.is_some() {
            self.change_in_silence();
        }
        self.spatializers.iter_mut().for_each(Spatializer::reset);
        self.headphones.reset();
        self.gap.begin(self.latency());
        self.began = false;
    }

    /// Begins the cross-fade to what the loader has ready, or with `gaps` a silence where the latency is another one. Returns
    /// whether the loader has something to drop.
    fn receive(&mut self, gaps: bool) -> bool {
        if self.spatializers.is_empty() {
            return false;
        }
        let latency = self.latency();
        // While something is held nothing new is taken, so that its place is free.
        let (retired, held) = (&self.loader.retired, &mut self.held);
        let mut hands_back = false;
        let mut retire = |item: Retired| {
            hands_back = true;
            retired.push(item).err()
        };
        *held = held.take().and_then(&mut retire);
        for spatializer in &mut self.spatializers {
            if held.is_none() {
                *held = spatializer.take_retired().and_then(|emitters| retire(Retired::Emitters(emitters)));
            }
        }
        if held.is_none()
            && let Some(prepared) = self.loader.scenes.pop()
        {
            self.dry = if let Prepared::Dry(gain) = &prepared { Some(*gain) } else { None };
            let apart = |pairs: &Pairs| pairs.first().is_some_and(|next| next.renderer().latency_samples() != latency);
            match prepared {
                Prepared::Dry(_) => (),
                Prepared::Scene(pairs) if self.next.is_some() || (gaps && apart(&pairs)) => {
                    self.gap.open();
                    let old = self.next.replace(pairs);
                    *held = old.and_then(|old| retire(Retired::Scene(Prepared::Scene(old))));
                }
                Prepared::Scene(pairs) => {
                    if let Err(pairs) = pairs.swap_into(&mut self.spatializers)
                        // A fade is running: it stays in the queue, unless the loader has a newer one by then.
                        && let Err(prepared) = self.loader.scenes.push(Prepared::Scene(pairs))
                    {
                        *held = retire(Retired::Scene(prepared));
                    }
                }
            }
        }
        macro_rules! receive {
            ($queue:ident, $kind:ident, |$new:ident| $old:expr) => {
                if held.is_none()
                    && let Some($new) = self.loader.$queue.pop()
                {
                    *held = $old.and_then(|old| retire(Retired::$kind(old)));
                }
            };
        }
        receive!(walks, Walk, |walk| std::mem::replace(&mut self.walk, walk));
        receive!(source_walks, SourceWalks, |walks| self.source_walks.replace(walks));
        receive!(leaders, Leader, |leader| std::mem::replace(&mut self.leader, leader));
        if held.is_none() {
            *held = self.headphones.take_retired().and_then(|filter| retire(Retired::Headphones(filter)));
        }
        if self.headphones.is_free() {
            receive!(headphones, Headphones, |filter| self.headphones.swap_in(filter));
        }
        hands_back
    }
}
