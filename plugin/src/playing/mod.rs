//! What is played: the scene and the camera path, as the audio thread takes them over from the loader.

#[cfg(test)]
mod head_tests;
#[cfg(test)]
mod headphones_tests;
pub mod loader;
pub(crate) mod monitor;
pub mod offline;
pub mod output;
#[cfg(feature = "standalone")]
pub mod player;
pub mod shared_worker;

use crate::playing::loader::{Loader, Prepared, Retired};
use crate::playing::output::Output;
use crate::project::exchange::Choices;
use crate::project::walk::Walk;
use crate::worker::{LOADER, TaskHandle};
use nice_plug::nice_error;
use promenade_core::Spatializer;
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
    /// What the listener's headphones need, last of all.
    pub(crate) headphones: HeadphoneStage,
    /// Whether the scene that is chosen is missing, so that the dry sound passes.
    pub(crate) dry: bool,
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
            headphones: HeadphoneStage::default(),
            dry: false,
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
        match self.loader.scenes.pop() {
            Some(Prepared::Scene(pairs)) => {
                pairs.install(&mut self.spatializers);
                self.dry = false;
            }
            Some(Prepared::Dry) => self.dry = true,
            None => (),
        }
        if let Some(filter) = self.loader.headphones.pop() {
            drop(self.headphones.install(filter, sample_rate_hz));
        }
        self.receive();
    }

    /// What renders the scene, or the first two channels of it.
    pub(crate) fn spatializer(&self) -> Option<&Spatializer> {
        self.spatializers.first()
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
        let hands_back = self.receive();
        // Also for choices that were made before the host was found to render offline.
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
            self.receive();
        }
    }

    /// Begins anew with the newest scene: nothing of the past is heard.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn reset(&mut self) {
        // A reset ends a running fade, so that the newest scene can be taken; the second ends the fade to it.
        self.spatializers.iter_mut().for_each(Spatializer::reset);
        self.receive();
        self.spatializers.iter_mut().for_each(Spatializer::reset);
        self.headphones.reset();
    }

    /// Begins the cross-fade to what the loader has ready. Returns whether the loader has something to drop.
    fn receive(&mut self) -> bool {
        if self.spatializers.is_empty() {
            return false;
        }
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
            self.dry = matches!(prepared, Prepared::Dry);
            if let Prepared::Scene(pairs) = prepared
                && let Err(pairs) = pairs.swap_into(&mut self.spatializers)
                // A fade is running: it stays in the queue, unless the loader has a newer one by then.
                && let Err(prepared) = self.loader.scenes.push(Prepared::Scene(pairs))
            {
                *held = retire(Retired::Scene(prepared));
            }
        }
        if held.is_none()
            && let Some(walk) = self.loader.walks.pop()
        {
            *held = std::mem::replace(&mut self.walk, walk).and_then(|old| retire(Retired::Walk(old)));
        }
        if held.is_none() {
            *held = self.headphones.take_retired().and_then(|filter| retire(Retired::Headphones(filter)));
        }
        if held.is_none()
            && self.headphones.is_free()
            && let Some(filter) = self.loader.headphones.pop()
        {
            *held = self.headphones.swap_in(filter).and_then(|filter| retire(Retired::Headphones(filter)));
        }
        hands_back
    }
}
