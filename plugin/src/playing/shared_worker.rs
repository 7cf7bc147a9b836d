//! Decodes an instance's poses on the shared background thread; the network is shared by all instances that play the same
//! scene.

use crate::telemetry::attention::{Attention, AttentionWeights};
use crate::worker::shared::{OfScene, Shared};
use crate::worker::{DECODER, Task, TaskHandle, lock::lock};
use crossbeam_queue::ArrayQueue;
use promenade_core::decode::CloudDecoder;
use promenade_core::{DecodeWorker, Decoded, Pose, Scene};
use std::sync::{Arc, Mutex, Weak};
use std::time::{Duration, Instant};

/// Results of one instance: one that is heard, one that waits to be taken, one that is being made, and one to spare.
const RESULTS: usize = 4;
/// How long an offline render sleeps between two polls for its result.
const POLL: Duration = Duration::from_micros(50);

/// Decoders of scenes.
static DECODERS: Shared<OfScene, Mutex<CloudDecoder>> = Shared::new();

/// What was decoded for the request of a number, so that the result of an older request is recognised.
struct Numbered {
    number: u64,
    decoded: Decoded,
}

/// What the audio thread and the worker share.
struct DecodeTask {
    decoder: Arc<Mutex<CloudDecoder>>,
    /// The newest request.
    request: ArrayQueue<(u64, Pose)>,
    /// The newest result.
    result: ArrayQueue<Box<Numbered>>,
    spare: ArrayQueue<Box<Numbered>>,
    scene: Weak<Scene>,
    attention: Arc<Attention>,
}

impl DecodeTask {
    fn decode(&self, pose: &Pose, out: &mut Decoded) {
        let mut decoder = lock(&self.decoder);
        match self.scene.upgrade().filter(|_| self.attention.watched.is_on()) {
            Some(scene) => {
                let mut weights = vec![0.0; scene.cloud().map_or(0, |cloud| cloud.model.sizes().anchors)];
                decoder.decode_with_attention(pose, &mut weights, out);
                self.attention.publish(AttentionWeights { scene: Weak::clone(&self.scene), weights });
            }
            None => decoder.decode(pose, out),
        }
    }
}

impl Task for DecodeTask {
    fn run(&self) -> Option<Instant> {
        // There is a spare one: no more than three are elsewhere.
        while let Some((number, pose)) = self.request.pop() {
            let mut result = self.spare.pop()?;
            result.number = number;
            self.decode(&pose, &mut result.decoded);
            if let Some(untaken) = self.result.force_push(result) {
                drop(self.spare.push(untaken));
            }
        }
        None
    }
}

/// The audio thread's end.
pub struct SharedWorker {
    task: Arc<DecodeTask>,
    handle: TaskHandle,
    /// Number of the newest request.
    requested: u64,
    newest: Option<Box<Numbered>>,
    /// Whether the newest result has not been taken yet.
    fresh: bool,
}

impl SharedWorker {
    /// For a scene with an anchor cloud; `None` for others. Attention weights are published to `attention` while it is watched.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn new(scene: &Arc<Scene>, attention: &Arc<Attention>) -> std::io::Result<Option<Self>> {
        let Some(decoder) = decoder_of(scene) else { return Ok(None) };
        let spare = ArrayQueue::new(RESULTS);
        let blank = lock(&decoder).blank();
        for _ in 0..RESULTS {
            drop(spare.push(Box::new(Numbered { number: 0, decoded: blank.clone() })));
        }
        let task = Arc::new(DecodeTask {
            decoder,
            request: ArrayQueue::new(1),
            result: ArrayQueue::new(1),
            spare,
            scene: Arc::downgrade(scene),
            attention: Arc::clone(attention),
        });
        let handle = DECODER.add(task.clone())?;
        Ok(Some(Self { task, handle, requested: 0, newest: None, fresh: false }))
    }

    /// Takes the newest result from the worker, if there is one.
    fn fetch(&mut self) {
        if let Some(result) = self.task.result.pop() {
            self.fresh = true;
            if let Some(old) = self.newest.replace(result) {
                // There is room for all results.
                drop(self.task.spare.push(old));
            }
        }
    }
}

impl DecodeWorker for SharedWorker {
    fn blank(&self) -> Decoded {
        lock(&self.task.decoder).blank()
    }

    fn request(&mut self, pose: &Pose, wait: bool) {
        self.requested += 1;
        let _older = self.task.request.force_push((self.requested, *pose));
        self.handle.schedule();
        while wait && self.newest.as_ref().is_none_or(|r| r.number != self.requested) {
            std::thread::sleep(POLL);
            self.fetch();
        }
    }

    fn take(&mut self) -> Option<&Decoded> {
        self.fetch();
        std::mem::take(&mut self.fresh).then_some(())?;
        self.newest.as_ref().map(|r| &r.decoded)
    }
}

/// The decoder of a scene, made once for all instances that play it.
fn decoder_of(scene: &Arc<Scene>) -> Option<Arc<Mutex<CloudDecoder>>> {
    DECODERS.of(scene.into(), || CloudDecoder::new(scene).map(Mutex::new).ok_or(())).ok()
}
