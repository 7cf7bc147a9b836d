//! A decoder whose poses take longer than a hop: it asks a worker now and then and cross-fades the answers.

use crate::decode::{Change, Decoder, LiveParams};
use crate::number;
use crate::published::StreamTaps;
use crate::{Pose, Scene, TransferFunction};

/// What a live decoder makes of one pose.
///
/// Filled by a [`DecodeWorker`] in the background, taken by the renderer on the audio thread, and handed back to be filled
/// again.
#[derive(Clone, Debug)]
pub struct Decoded {
    /// Masks and time filters for the streaming head.
    pub transfer: TransferFunction,
    /// The answer as the published head takes it, where the scene has convolution layers.
    pub published: Option<PublishedFrame>,
}

impl Decoded {
    /// Values of [`Decoded::write_to`].
    #[must_use]
    pub fn flat_len(&self) -> usize {
        self.parts().iter().map(|part| part.len()).sum::<usize>() + self.published_taps().map_or(0, StreamTaps::flat_len)
    }

    /// Writes all values into a row, for a decoder that shares no memory with the stream; the order is this library's own.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O. What has no room in `row` is left out.
    pub fn write_to(&self, row: &mut [f32]) {
        let mut rest = row;
        for part in self.parts() {
            let Some((to, after)) = rest.split_at_mut_checked(part.len()) else { return };
            to.copy_from_slice(part);
            rest = after;
        }
        if let Some(taps) = self.published_taps() {
            taps.write_to(rest);
        }
    }

    /// Takes the values of a row that [`Decoded::write_to`] has written for the same scene. Returns whether it has as many;
    /// otherwise nothing changes.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn read_from(&mut self, row: &[f32]) -> bool {
        if row.len() != self.flat_len() {
            return false;
        }
        let mut rest = row;
        for part in self.parts_mut() {
            let (values, after) = rest.split_at(part.len());
            part.copy_from_slice(values);
            rest = after;
        }
        if let Some(taps) = self.published.as_mut().and_then(|p| p.taps.as_mut()) {
            taps.read_from(rest);
        }
        true
    }

    fn published_taps(&self) -> Option<&StreamTaps> {
        self.published.as_ref().and_then(|p| p.taps.as_ref())
    }
}

/// What the published render head takes for one listener.
///
/// Part of a [`Decoded`], and goes between the worker and the audio thread with it.
#[derive(Clone, Debug)]
pub struct PublishedFrame {
    /// Mixture mask per bin, linear gain, of either sign.
    pub mixture: Vec<f32>,
    /// Difference mask per bin, in (-1, 1); positive = right louder.
    pub difference: Vec<f32>,
    /// Time filter, where the model has one.
    pub taps: Option<StreamTaps>,
}

/// Something that decodes poses, here or on another thread.
pub trait DecodeWorker: Send {
    /// Room for an answer, which says that nothing is heard.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    fn blank(&self) -> Decoded;

    /// Asks for a pose; it takes the place of an older one that has not been decoded yet. With `wait` it is decoded on return.
    ///
    /// # Real-time
    /// Audio thread without `wait`: no allocation, lock or I/O. With it, as long as a decode takes.
    fn request(&mut self, pose: &Pose, wait: bool);

    /// What has been decoded since this was last asked, the newest.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    fn take(&mut self) -> Option<&Decoded>;
}

/// Follows a listener by decodes that come now and then. Lives on the audio thread; its [`DecodeWorker`] may be on another.
pub(crate) struct LiveDecoder {
    worker: Box<dyn DecodeWorker>,
    hop_s: f64,
    /// The most decodes a second.
    most_hz: f64,
    /// What is heard now, where the running cross-fade came from, and where it goes to.
    shown: Decoded,
    from: Decoded,
    to: Decoded,
    /// What is heard where the scene starts.
    first: Decoded,
    /// Hops of the running cross-fade that are done, and all of them.
    done: usize,
    hops: usize,
    asked: Option<Pose>,
    /// Hops since the last question.
    since: usize,
    /// Whether anything has been decoded yet.
    heard: bool,
}

impl LiveDecoder {
    /// Begins with what the scene's start pose sounds like.
    pub(crate) fn new(mut worker: Box<dyn DecodeWorker>, scene: &Scene, hop_s: f64) -> Self {
        let silent = worker.blank();
        let mut first = silent.clone();
        worker.request(&scene.start_pose(), true);
        let heard = worker.take().map(|d| first.copy_from(d)).is_some();
        let (to, shown) = (first.clone(), first.clone());
        let most_hz = scene.parts().decodes as f64;
        Self { worker, hop_s, most_hz, from: silent, to, shown, first, done: 1, hops: 1, asked: None, since: 0, heard }
    }

    /// Is as new again; an answer that is still on its way belongs to the past.
    pub(crate) fn reset(&mut self) {
        let _ = self.worker.take();
        self.shown.copy_from(&self.first);
        (self.done, self.hops, self.since, self.asked) = (1, 1, 0, None);
    }

    /// What is heard now.
    pub(crate) fn shown(&self) -> &Decoded {
        &self.shown
    }
}

impl Decoder for LiveDecoder {
    fn follow(&mut self, pose: &Pose, whole: bool, params: &LiveParams) -> bool {
        let rate = f64::from(params.rate_hz).max(1e-3).min(self.most_hz);
        let interval = number::whole((1.0 / (rate * self.hop_s)).round().clamp(1.0, 1e6));
        self.since = self.since.saturating_add(1);
        if whole {
            self.heard = false;
        }
        if whole || (self.since >= interval && self.asked.as_ref() != Some(pose)) {
            self.worker.request(pose, params.wait);
            self.asked = Some(*pose);
            self.since = 0;
        }
        if let Some(answer) = self.worker.take() {
            self.from.copy_from(&self.shown);
            self.to.copy_from(answer);
            // The first answer after a jump is not glided to.
            (self.done, self.hops) = if self.heard { (0, interval) } else { (0, 1) };
            self.heard = true;
        }
        let glides = self.done < self.hops;
        if glides {
            self.done += 1;
            self.shown.blend(&self.from, &self.to, self.done as f32 / self.hops as f32);
        }
        glides || whole
    }

    fn update_filters(&mut self, _change: &Change) {
        // An answer brings all of them.
    }

    fn transfer(&self) -> &TransferFunction {
        &self.shown.transfer
    }
}

impl Decoded {
    /// Takes the values of another answer of the same scene without allocating.
    pub fn copy_from(&mut self, other: &Self) {
        self.blend(other, other, 0.0);
    }

    /// Becomes `from + share * (to - from)`, exactly at both ends.
    fn blend(&mut self, from: &Self, to: &Self, share: f32) {
        for ((out, a), b) in self.parts_mut().into_iter().zip(from.parts()).zip(to.parts()) {
            for ((o, a), b) in out.iter_mut().zip(a).zip(b) {
                *o = if share < 1.0 { a + share * (b - a) } else { *b };
            }
        }
        if let (Some(out), Some(a), Some(b)) = (&mut self.published, &from.published, &to.published)
            && let (Some(out), Some(a), Some(b)) = (&mut out.taps, &a.taps, &b.taps)
        {
            out.blend(a, b, share);
        }
    }

    /// All values but the taps of the published head.
    fn parts(&self) -> [&[f32]; 8] {
        let t = &self.transfer;
        let [m, d]: [&[f32]; 2] = self.published.as_ref().map_or([&[], &[]], |s| [&s.mixture, &s.difference]);
        [&t.mixture, &t.difference, &t.phase, std::slice::from_ref(&t.delay_s), &t.taps, &t.late, m, d]
    }

    fn parts_mut(&mut self) -> [&mut [f32]; 8] {
        let t = &mut self.transfer;
        let [m, d]: [&mut [f32]; 2] =
            self.published.as_mut().map_or([&mut [], &mut []], |s| [&mut s.mixture, &mut s.difference]);
        [&mut t.mixture, &mut t.difference, &mut t.phase, std::slice::from_mut(&mut t.delay_s), &mut t.taps, &mut t.late, m, d]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TransferShape;

    /// Answers with the place along x as every level, so many hops after it was asked.
    struct Late {
        answer: Decoded,
        asked: Option<(usize, f32)>,
        hops: usize,
    }

    impl DecodeWorker for Late {
        fn blank(&self) -> Decoded {
            self.answer.clone()
        }

        fn request(&mut self, pose: &Pose, _wait: bool) {
            self.asked = Some((self.hops, pose.position.x));
        }

        fn take(&mut self) -> Option<&Decoded> {
            let (left, level) = self.asked?;
            self.asked = (left > 0).then(|| (left - 1, level));
            if left > 0 {
                return None;
            }
            self.answer.transfer.mixture.fill(level);
            Some(&self.answer)
        }
    }

    #[test]
    fn an_answer_that_comes_late_is_faded_to_in_equal_steps() {
        const HOPS: usize = 8;
        let silent = Decoded { transfer: TransferShape { bins: 4, bands: 2, taps: 1 }.silent(), published: None };
        let worker = Late { answer: silent.clone(), asked: None, hops: 3 };
        let mut live = LiveDecoder {
            worker: Box::new(worker),
            hop_s: 0.005,
            most_hz: 1e3,
            shown: silent.clone(),
            from: silent.clone(),
            to: silent.clone(),
            first: silent,
            done: 1,
            hops: 1,
            asked: None,
            since: 0,
            heard: true,
        };
        let params = LiveParams { rate_hz: (1.0 / (HOPS as f64 * 0.005)) as f32, wait: false };
        let at = |x: f32| Pose { position: glam::Vec3::X * x, ..Pose::IDENTITY };
        let mut levels = vec![0.0];
        for hop in 0..60 {
            // One step of the listener, there and back.
            let pose = at(if (10..30).contains(&hop) { 1.0 } else { 0.0 });
            live.follow(&pose, false, &params);
            levels.push(live.transfer().mixture[0]);
        }
        let steps: Vec<f32> = levels.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step != 0.0).collect();
        let (up, down) = steps.split_at(HOPS);
        let step = 1.0 / HOPS as f32;
        assert_eq!(down.len(), HOPS, "{steps:?}");
        assert!(up.iter().all(|s| (s - step).abs() < 1e-6) && down.iter().all(|s| (s + step).abs() < 1e-6), "{steps:?}");
    }
}
