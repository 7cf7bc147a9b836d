//! Headphones' compensation while it is exchanged, switched off and on.

use super::HeadphoneFilter;
use crate::number::single;

/// The fade from or to what is not compensated, seconds.
const FADE_S: f64 = 0.02;
/// Samples that are filtered at once.
const CHUNK: usize = 64;

/// The last stage of a stream: a filter that may be put in, exchanged or taken out at any time without a click.
///
/// The last object of an instance on its audio thread, made and dropped with it.
///
/// What is heard fades to what is not filtered, and from there to the new filter. Without a filter, samples stay bit for bit as
/// they are.
#[derive(Default)]
pub struct HeadphoneStage {
    filter: Option<Box<HeadphoneFilter>>,
    /// What comes when the fade has ended.
    next: Option<Option<Box<HeadphoneFilter>>>,
    retired: Option<Box<HeadphoneFilter>>,
    /// Share of what is filtered.
    share: f32,
    step: f32,
    /// Whether anything has been heard since the beginning; before, nothing fades.
    began: bool,
}

impl HeadphoneStage {
    /// Puts a filter in, or takes it out, at once. Returns what was there.
    pub fn install(&mut self, filter: Option<Box<HeadphoneFilter>>, sample_rate_hz: f64) -> [Option<Box<HeadphoneFilter>>; 2] {
        self.step = single(1.0 / (FADE_S * sample_rate_hz).max(1.0));
        self.began = false;
        let waiting = self.next.take().flatten();
        [std::mem::replace(&mut self.filter, filter), waiting]
    }

    /// Whether another filter can be taken: none waits, and none is to be handed back.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    #[must_use]
    pub fn is_free(&self) -> bool {
        self.next.is_none() && self.retired.is_none()
    }

    /// Fades to a filter, or to none, once [`HeadphoneStage::is_free`]; one that still waits is replaced and returned.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn swap_in(&mut self, filter: Option<Box<HeadphoneFilter>>) -> Option<Box<HeadphoneFilter>> {
        self.next.replace(filter).flatten()
    }

    /// A filter that is no longer needed, for another thread to drop.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn take_retired(&mut self) -> Option<Box<HeadphoneFilter>> {
        self.retired.take()
    }

    /// Filters both ears in place; fades to what is not filtered while `on` is false.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn process(&mut self, [left, right]: [&mut [f32]; 2], on: bool) {
        if self.filter.is_none() && self.next.is_none() {
            return;
        }
        if !std::mem::replace(&mut self.began, true) {
            self.share = if on && self.filter.is_some() && self.next.is_none() { 1.0 } else { 0.0 };
        }
        for (left, right) in left.chunks_mut(CHUNK).zip(right.chunks_mut(CHUNK)) {
            if self.share == 0.0 && self.next.is_some() && self.retired.is_none() {
                self.retired = self.filter.take();
                self.filter = self.next.take().flatten();
            }
            let target = if on && self.filter.is_some() && self.next.is_none() { 1.0 } else { 0.0 };
            let Some(filter) = &mut self.filter else { continue };
            if self.share == 0.0 && target == 0.0 {
                continue;
            }
            if self.share == 0.0 {
                filter.reset();
            }
            let mut plain = [[0.0; CHUNK]; 2];
            let [first, second] = &mut plain;
            first[..left.len()].copy_from_slice(left);
            second[..right.len()].copy_from_slice(right);
            filter.process([&mut *left, &mut *right]);
            if self.share == 1.0 && target == 1.0 {
                continue;
            }
            for (i, (l, r)) in left.iter_mut().zip(right.iter_mut()).enumerate() {
                self.share =
                    if target > self.share { (self.share + self.step).min(1.0) } else { (self.share - self.step).max(0.0) };
                for (filtered, plain) in [(l, plain[0][i]), (r, plain[1][i])] {
                    *filtered = plain + self.share * (*filtered - plain);
                }
            }
        }
    }

    /// Forgets the past, and ends fades.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn reset(&mut self) {
        if self.next.is_some() && self.retired.is_none() {
            self.retired = self.filter.take();
            self.filter = self.next.take().flatten();
        }
        self.began = false;
        self.filter.iter_mut().for_each(|filter| filter.reset());
    }
}
