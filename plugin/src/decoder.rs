//! Poses decoded on the background thread, for one instance each; the weights are shared by all that play the same scene.

use crate::attention::{Attended, Attention};
use crate::worker::{Chore, DECODER, Desk};
use crossbeam_queue::ArrayQueue;
use promenade_core::decode::CloudDecoder;
use promenade_core::{DecodeWorker, Decoded, Pose, Scene};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Duration;

/// Answers of one instance: one that is heard, one that waits to be, one that is being made, and one to spare.
const ANSWERS: usize = 4;
/// How long an offline render sleeps between two looks for its answer.
const LOOK: Duration = Duration::from_micros(50);

/// A decoder and the scene that it is for, as long as an instance plays it.
type Held = (Weak<Scene>, Weak<Mutex<CloudDecoder>>);

/// Decoders of the scenes that are played in this process.
static DECODERS: Mutex<Vec<Held>> = Mutex::new(Vec::new());

/// A question is numbered, so that an answer to an older one is told apart.
struct Answer {
    number: u64,
    decoded: Decoded,
}

/// What the audio thread and the worker share.
struct Exchange {
    decoder: Arc<Mutex<CloudDecoder>>,
    /// The newest question.
    question: ArrayQueue<(u64, Pose)>,
    /// The newest answer.
    answer: ArrayQueue<Box<Answer>>,
    spare: ArrayQueue<Box<Answer>>,
    scene: Weak<Scene>,
    attention: Arc<Attention>,
}

impl Exchange {
    fn decode(&self, pose: &Pose, out: &mut Decoded) {
        let mut decoder = self.decoder.lock().unwrap_or_else(PoisonError::into_inner);
        match self.scene.upgrade().filter(|_| self.attention.is_watched()) {
            Some(scene) => {
                let mut shares = vec![0.0; scene.cloud().map_or(0, |cloud| cloud.model.sizes().anchors)];
                decoder.decode_with_attention(pose, &mut shares, out);
                self.attention.tell(Attended { scene: Weak::clone(&self.scene), shares });
            }
            None => decoder.decode(pose, out),
        }
    }
}

impl Chore for Exchange {
    fn serve(&self) {
        // Whoever answers has one to spare: no more than three are elsewhere.
        while let Some((number, pose)) = self.question.pop() {
            let Some(mut answer) = self.spare.pop() else { return };
            answer.number = number;
            self.decode(&pose, &mut answer.decoded);
            if let Some(unheard) = self.answer.force_push(answer) {
                drop(self.spare.push(unheard));
            }
        }
    }
}

/// The audio thread's end.
pub struct SharedWorker {
    exchange: Arc<Exchange>,
    desk: Desk,
    asked: u64,
    heard: Option<Box<Answer>>,
    /// Whether the answer has come but not been taken.
    fresh: bool,
}

impl SharedWorker {
    /// For a scene with an anchor cloud; `None` for others. What is attended to is told to `attention` while that is watched.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn new(scene: &Arc<Scene>, attention: &Arc<Attention>) -> std::io::Result<Option<Self>> {
        let Some(decoder) = decoder_of(scene) else { return Ok(None) };
        let spare = ArrayQueue::new(ANSWERS);
        let blank = decoder.lock().unwrap_or_else(PoisonError::into_inner).blank();
        for _ in 0..ANSWERS {
            drop(spare.push(Box::new(Answer { number: 0, decoded: blank.clone() })));
        }
        let exchange = Arc::new(Exchange {
            decoder,
            question: ArrayQueue::new(1),
            answer: ArrayQueue::new(1),
            spare,
            scene: Arc::downgrade(scene),
            attention: Arc::clone(attention),
        });
        let desk = Desk::new(&DECODER, exchange.clone())?;
        Ok(Some(Self { exchange, desk, asked: 0, heard: None, fresh: false }))
    }

    /// Takes the newest answer from the worker, if there is one.
    fn fetch(&mut self) {
        if let Some(answer) = self.exchange.answer.pop() {
            self.fresh = true;
            if let Some(old) = self.heard.replace(answer) {
                // There is room for all answers.
                drop(self.exchange.spare.push(old));
            }
        }
    }
}

impl DecodeWorker for SharedWorker {
    fn blank(&self) -> Decoded {
        self.exchange.decoder.lock().unwrap_or_else(PoisonError::into_inner).blank()
    }

    fn request(&mut self, pose: &Pose, wait: bool) {
        self.asked += 1;
        let _older = self.exchange.question.force_push((self.asked, *pose));
        self.desk.call();
        while wait && self.heard.as_ref().is_none_or(|a| a.number != self.asked) {
            std::thread::sleep(LOOK);
            self.fetch();
        }
    }

    fn take(&mut self) -> Option<&Decoded> {
        self.fetch();
        std::mem::take(&mut self.fresh).then_some(())?;
        self.heard.as_ref().map(|a| &a.decoded)
    }
}

/// The decoder of a scene, made once for all instances that play it.
fn decoder_of(scene: &Arc<Scene>) -> Option<Arc<Mutex<CloudDecoder>>> {
    let mut decoders = DECODERS.lock().unwrap_or_else(PoisonError::into_inner);
    decoders.retain(|(_, decoder)| decoder.strong_count() > 0);
    let same = |held: &Weak<Scene>| held.upgrade().is_some_and(|held| Arc::ptr_eq(&held, scene));
    if let Some(decoder) = decoders.iter().find(|(held, _)| same(held)).and_then(|(_, decoder)| decoder.upgrade()) {
        return Some(decoder);
    }
    let decoder = Arc::new(Mutex::new(CloudDecoder::new(scene)?));
    decoders.push((Arc::downgrade(scene), Arc::downgrade(&decoder)));
    Some(decoder)
}
