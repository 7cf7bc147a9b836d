//! A decoder that is somewhere else: questions and answers lie here until the page carries them.

use promenade_core::decode::CloudDecoder;
use promenade_core::{DecodeWorker, Decoded, Pose};
use std::sync::{Arc, Mutex, PoisonError};

/// A question and an answer, each the newest.
pub(crate) struct Mailbox {
    asked: Option<Pose>,
    answer: Decoded,
    fresh: bool,
}

/// What stream and page share of a mailbox. There is one thread, so the lock is never waited for.
#[derive(Clone)]
pub(crate) struct SharedMailbox(Arc<Mutex<Mailbox>>);

impl SharedMailbox {
    /// With an answer to a first pose, which the stream asks for when it is made.
    pub(crate) fn new(decoder: &mut CloudDecoder, first: &Pose) -> Self {
        let mut answer = decoder.blank();
        decoder.decode(first, &mut answer);
        Self(Arc::new(Mutex::new(Mailbox { asked: None, answer, fresh: true })))
    }

    /// The pose that is asked for, once.
    pub(crate) fn asked(&self) -> Option<Pose> {
        self.with(|mailbox| mailbox.asked.take())
    }

    /// Takes an answer as a row. Returns whether it has as many values as one.
    pub(crate) fn answer(&self, row: &[f32]) -> bool {
        self.with(|mailbox| {
            mailbox.fresh = mailbox.answer.read_from(row);
            mailbox.fresh
        })
    }

    fn with<T>(&self, work: impl FnOnce(&mut Mailbox) -> T) -> T {
        work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// The stream's end of a mailbox.
pub(crate) struct Correspondent {
    mailbox: SharedMailbox,
    /// The newest answer that was taken.
    newest: Decoded,
}

impl Correspondent {
    pub(crate) fn new(mailbox: SharedMailbox) -> Self {
        let newest = mailbox.with(|mailbox| mailbox.answer.clone());
        Self { mailbox, newest }
    }
}

impl DecodeWorker for Correspondent {
    fn blank(&self) -> Decoded {
        self.newest.clone()
    }

    fn request(&mut self, pose: &Pose, _wait: bool) {
        self.mailbox.with(|mailbox| mailbox.asked = Some(*pose));
    }

    fn take(&mut self) -> Option<&Decoded> {
        let newest = &mut self.newest;
        let fresh = self.mailbox.with(|mailbox| {
            let fresh = std::mem::take(&mut mailbox.fresh);
            if fresh {
                newest.copy_from(&mailbox.answer);
            }
            fresh
        });
        fresh.then_some(&self.newest)
    }
}
