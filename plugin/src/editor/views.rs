//! What an open editor has worked out in the background: the response of what is heard, its map, loudness.

use crate::answers::response::{Listening, Response};
use crate::answers::reverberation::Wanted;
use crate::answers::room_map::{Mapped, RoomMap};
use crate::answers::settled::{Question, Settled};
use crate::telemetry::loudness::{Loudness, LoudnessMeter, SoundQueue};
use crate::worker::{JUDGE, MAPPER, METER, RESPONDER, TaskHandle, Worker, repaint::Repaint};
use nice_plug::nice_error;
use promenade_room::Matched;
use std::sync::Arc;

/// Questions of one kind and the worker that answers them.
struct Asker<Q: Question> {
    settled: Arc<Settled<Q>>,
    task: Option<TaskHandle>,
}

impl<Q: Question + 'static> Asker<Q> {
    fn new(repaint: &Repaint, worker: &'static Worker) -> Self {
        let settled = Settled::new(repaint.clone());
        let task = worker.add(settled.clone()).inspect_err(|error| nice_error!("no thread for a view: {error}")).ok();
        Self { settled, task }
    }

    fn ask(&self, question: Q) {
        if self.settled.ask(question)
            && let Some(task) = &self.task
        {
            task.schedule();
        }
    }
}

impl<Q: Question> Drop for Asker<Q> {
    /// The worker gives up what nobody waits for.
    fn drop(&mut self) {
        self.settled.withdraw();
    }
}

/// The views of one window.
pub struct Views {
    response: Asker<Listening>,
    reverberation: Asker<Wanted>,
    map: Asker<Mapped>,
    loudness: Option<(Arc<LoudnessMeter>, TaskHandle)>,
}

impl Views {
    /// Nothing is asked yet; loudness of what comes through the queue is measured from now on.
    pub(super) fn new(repaint: &Repaint, sound: &Arc<SoundQueue>, sample_rate_hz: f64) -> Self {
        let meter = LoudnessMeter::new(Arc::clone(sound), sample_rate_hz);
        let task = METER.add(meter.clone()).inspect_err(|error| nice_error!("no thread to measure loudness: {error}"));
        Self {
            response: Asker::new(repaint, &RESPONDER),
            reverberation: Asker::new(repaint, &JUDGE),
            map: Asker::new(repaint, &MAPPER),
            loudness: task.ok().map(|task| (meter, task)),
        }
    }

    /// The newest response, and whether it is that of what is heard now.
    pub(super) fn response(&self, listening: Listening) -> Option<(Arc<Response>, bool)> {
        self.response.ask(listening);
        let fresh = self.response.settled.is_fresh();
        self.response.settled.newest().map(|(_, response)| (response, fresh))
    }

    /// How much the walls of a room have to absorb, once that is known.
    pub(super) fn reverberation(&self, wanted: Wanted) -> Option<Arc<Result<Matched, String>>> {
        self.reverberation.ask(wanted);
        let fresh = self.reverberation.settled.is_fresh();
        self.reverberation.settled.newest().filter(|_| fresh).map(|(_, found)| found)
    }

    /// Measures over the plan of a scene; none until they are known.
    pub(super) fn map(&self, mapped: Mapped) -> Option<Arc<Result<RoomMap, String>>> {
        self.map.ask(mapped);
        let fresh = self.map.settled.is_fresh();
        self.map.settled.newest().filter(|_| fresh).map(|(_, map)| map)
    }

    /// Measures what was heard since this was last called.
    pub(super) fn measure_loudness(&self) {
        if let Some((_, task)) = &self.loudness {
            task.schedule();
        }
    }

    /// The newest loudness.
    pub(super) fn loudness(&self) -> Loudness {
        self.loudness.as_ref().map_or_else(Loudness::default, |(meter, _)| meter.newest())
    }

    /// Begins to measure loudness anew.
    pub(super) fn restart_loudness(&self) {
        if let Some((meter, _)) = &self.loudness {
            meter.restart();
        }
    }
}
