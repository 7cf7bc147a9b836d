//! What all voices of a renderer share: the explicit taps that are not their own, the late part, and what both ears hear.

use crate::decode::{Change, TURNS};
use crate::render::carriers::Carriers;
use crate::render::early::taps_ahead::{Ahead, Applied, FRAMES};
use crate::render::late::network::{LATE_HOPS, late_lead};
use crate::render::reverberation::Later;
use crate::render::transform::lanes::{Accumulate, Block, EarBlocks, LANES};
use crate::render::transform::ring::Ring;
use crate::render::voice_filters::{ColouredTaps, Gains, Plan, VoiceFilters, add};
use crate::{TransferFunction, TransferShape, Trim};
use glam::Quat;
use promenade_fourier::num_complex::Complex32;
use pulp::{Arch, WithSimd};
use std::ops::Range;
use std::sync::Arc;

/// The room of some voices. A renderer makes it with itself, and renders it hop by hop on the audio thread.
///
/// A lone voice has all explicit taps of its own. Each of several has the first ones, and what they pass on is added up for the
/// taps that come after them, which are shared.
pub(crate) struct Room {
    arch: Arch,
    shape: TransferShape,
    own: usize,
    apart: usize,
    early_taps: usize,
    /// Taps after those of the voices.
    shared: ColouredTaps,
    /// What the voices' own taps pass on, where there are taps after them.
    input: Ring,
    later: Later,
    /// Later taps and the late part in the bins that follow slowly, where they are worked out for several frames at once.
    ahead: Option<Ahead>,
    /// The group of these bins whose turn it is.
    turn: usize,
    carriers: Arc<Carriers>,
    sums: Sums,
    /// Frames since anything was heard.
    dead_frames: usize,
}

/// Sums of a frame's parts.
struct Sums {
    /// Room to work in.
    work: Vec<EarBlocks>,
    direct: Vec<EarBlocks>,
    /// Early reflections, with all that comes later where that has no sum of its own.
    room: Vec<EarBlocks>,
    /// What comes after the early reflections, where its level is another than theirs.
    late: Vec<EarBlocks>,
}

impl Room {
    pub(crate) fn new(plan: &Plan<'_>) -> Self {
        let Plan { shape, carriers, own_taps: own, .. } = *plan;
        let ((blocks, quick_blocks), apart) = (plan.blocks(), plan.apart());
        let has_time = shape.taps + 1 >= late_lead(shape.taps) + apart + FRAMES - 1 && apart + FRAMES - 2 < own;
        let lead = if has_time { FRAMES - 1 } else { 0 };
        let (coloured, shared) = (ColouredTaps::new(plan, own..shape.taps), shape.taps - own);
        let silent = || vec![EarBlocks::default(); blocks];
        Self {
            arch: Arch::new(),
            shape,
            own,
            apart,
            early_taps: plan.early_taps(),
            input: Ring::new(if shared > 0 { blocks } else { 0 }, shared + lead + 1),
            later: Later::new(plan, &coloured.decay, lead),
            shared: coloured,
            ahead: has_time.then(|| Ahead::new(quick_blocks..blocks)),
            turn: 0,
            carriers: Arc::clone(carriers),
            sums: Sums { work: silent(), direct: silent(), room: silent(), late: silent() },
            dead_frames: usize::MAX / 2,
        }
    }

    /// Hops of all time filters that a voice is heard through.
    pub(crate) fn filter_hops(&self, voice: &VoiceFilters) -> usize {
        voice.filter_hops() + self.shared.taps.hops() + LATE_HOPS
    }

    /// What the taps are made of.
    pub(crate) fn carriers(&self) -> &Arc<Carriers> {
        &self.carriers
    }

    /// Sets the reverberation time as a multiple of the scene's.
    pub(crate) fn set_decay(&mut self, times: f32) {
        if self.shared.decay.set(times) {
            self.later.decay_by(&self.shared.decay);
        }
    }

    /// Turns the late field with the head, at once or as the frames come.
    pub(crate) fn face(&mut self, orientation: Quat, at_once: bool) {
        self.later.face(orientation, at_once);
    }

    /// Takes what has changed in the transfer function that the room is heard by.
    pub(crate) fn update(&mut self, tf: &TransferFunction, change: &Change) {
        match change.turn {
            Some(turn) => self.turn = turn,
            None => self.forget_ahead(),
        }
        if change.keeps_filters() {
            return;
        }
        let (taps, carriers) = (self.shape.taps, Arc::clone(&self.carriers));
        if self.own < taps {
            let mut plain = std::mem::take(&mut self.shared.plain);
            let mixture = carriers.measured.as_ref().map(|m| m.meeting.mixture(tf.shares.entries(), &mut plain));
            self.shared.update(tf, change, mixture.as_ref(), None);
            self.shared.plain = plain;
        }
        for hop in change.filters[1].iter().filter(|hop| (taps..taps + LATE_HOPS).contains(hop)) {
            // Each hop has one turn in which the bins that follow quickly have it too.
            let is_due = change.turn.is_none_or(|turn| hop % TURNS == turn);
            let quick = Some(self.shared.quick.clone()).filter(|_| is_due);
            let slow = change.group(&self.shared.slow);
            self.later.set(hop - taps, tf, &mut self.shared.decay, &carriers, quick, slow);
        }
    }

    /// Forgets what was worked out for frames to come: other voices are heard, or filters have changed out of turn.
    pub(crate) fn forget_ahead(&mut self) {
        self.ahead.iter_mut().for_each(Ahead::forget);
    }

    /// Applies all filters to the newest frames of some voices, each part at its level; `silent` says that nothing is in these
    /// frames. `None` when nothing sounds any more: both ears are silent.
    pub(crate) fn render<V: AsRef<VoiceFilters> + AsMut<VoiceFilters>>(
        &mut self,
        voices: &mut [V],
        silent: bool,
        trim: &Trim,
        ears: [&mut [Complex32]; 2],
    ) -> Option<()> {
        let hops = heard(voices).map(VoiceFilters::hops).max().unwrap_or(0) + self.shared.taps.hops() + LATE_HOPS;
        if silent && self.dead_frames > hops + 1 {
            return None;
        }
        self.feed(voices);
        let dead = silent && self.later.is_silent();
        self.dead_frames = if dead { self.dead_frames.saturating_add(1) } else { 0 };

        let mut sums = std::mem::replace(&mut self.sums, Sums { work: vec![], direct: vec![], room: vec![], late: vec![] });
        let Sums { work, direct, room, late } = &mut sums;
        direct.fill(EarBlocks::default());
        for voice in voices.iter_mut().map(AsMut::as_mut).filter(|voice| voice.is_heard) {
            voice.add_direct(work, direct);
        }
        let apart = trim.early != trim.late;
        room.fill(EarBlocks::default());
        // What is played apart is the direct sound and the taps before this one.
        let first = self.apart.saturating_sub(1);
        let early = if apart { self.early_taps } else { self.shape.taps };
        // The first tap whose frame is the newest for the last of the frames that are worked out ahead.
        let next = self.apart + FRAMES - 2;
        match self.ahead.take_if(|_| !apart) {
            Some(mut ahead) => {
                self.add_taps(voices, first..next, room);
                let quick = &mut room[..ahead.first()];
                self.add_taps(voices, next..early, quick);
                self.later.add(quick);
                add_low(voices, quick);
                let own = heard(voices).map(|voice| voice.applied(next));
                let shared = Some(self.applied()).filter(|applied| applied.hops > 0);
                ahead.add(self.turn, own.chain(shared).chain([self.later.applied()]), room);
                self.ahead = Some(ahead);
            }
            None => {
                self.add_taps(voices, first..early, room);
                let rest = if apart { &mut *late } else { &mut *room };
                if apart {
                    rest.fill(EarBlocks::default());
                    self.add_taps(voices, early..self.shape.taps, rest);
                }
                self.later.add(rest);
                add_low(voices, rest);
            }
        }
        if apart {
            self.forget_ahead();
        }
        let gains = Gains::from(trim);
        for (ear, out) in ears.into_iter().enumerate() {
            let late = if apart { Some(&late[..]) } else { None };
            self.arch.dispatch(Mix { ear, direct, room, late, gains, out });
        }
        self.sums = sums;
        Some(())
    }

    /// Feeds the late network, and the shared taps with what the voices' own have passed on.
    fn feed(&mut self, voices: &[impl AsRef<VoiceFilters>]) {
        let (taps, lead) = (self.shape.taps, self.later.ahead());
        let after = taps - late_lead(taps);
        if self.shared.taps.hops() == 0 {
            if let Some(voice) = voices.first() {
                self.later.advance(voice.as_ref().input().at(after + 1 - self.apart - lead));
            }
            return;
        }
        self.input.advance().blocks().for_each(|block| *block = Block::default());
        for voice in heard(voices) {
            let passed = voice.input().at(self.own + 1 - self.apart - lead);
            self.shared.taps.inject(&voice.gains, passed, self.input.at_mut(0));
        }
        if self.carriers.measured.is_some() {
            // Each voice has the lowest bins of its own.
            self.input.at_mut(0).blocks().take(1).for_each(|block| *block = Block::default());
        }
        self.later.advance(self.input.at(after - self.own));
    }

    /// Adds explicit taps of all voices, their own and the shared ones.
    fn add_taps(&self, voices: &[impl AsRef<VoiceFilters>], taps: Range<usize>, sums: &mut [EarBlocks]) {
        for voice in heard(voices) {
            voice.add_taps(taps.clone(), sums);
        }
        let shared = taps.start.max(self.own)..taps.end.max(self.own);
        if !shared.is_empty() {
            let (hops, from) = (self.shared.taps.hops(), shared.start - self.own);
            let newest = [self.input.at(from + self.later.ahead())];
            let taps = from..shared.end - self.own;
            Accumulate { arch: self.arch, newest, filter: self.shared.taps.filters(), hops, taps, sums }.run();
        }
    }

    /// The shared taps, for frames that are worked out ahead.
    fn applied(&self) -> Applied<'_> {
        Applied {
            newest: self.input.at(0),
            right: None,
            filter: self.shared.taps.filters(),
            hops: self.shared.taps.hops(),
            first_tap: 0,
        }
    }

    pub(crate) fn reset(&mut self) {
        self.later.reset();
        self.input.reset();
        self.forget_ahead();
        self.dead_frames = usize::MAX / 2;
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        4 * size_of_val(&*self.sums.room)
            + self.input.memory_bytes()
            + self.shared.memory_bytes()
            + self.later.memory_bytes()
            + self.ahead.as_ref().map_or(0, Ahead::memory_bytes)
    }
}

/// The voices of which anything is heard.
fn heard(voices: &[impl AsRef<VoiceFilters>]) -> impl Iterator<Item = &VoiceFilters> + Clone {
    voices.iter().map(AsRef::as_ref).filter(|voice| voice.is_heard)
}

fn add_low(voices: &[impl AsRef<VoiceFilters>], sums: &mut [EarBlocks]) {
    heard(voices).for_each(|voice| voice.add_low(sums));
}

/// Writes what one ear hears: direct sound, room and, where it has a sum of its own, what comes later.
struct Mix<'a> {
    ear: usize,
    /// At its level.
    direct: &'a [EarBlocks],
    room: &'a [EarBlocks],
    late: Option<&'a [EarBlocks]>,
    gains: Gains,
    out: &'a mut [Complex32],
}

impl WithSimd for Mix<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _simd: S) {
        let Self { ear, direct, room, late, gains, out } = self;
        let [own, other] = gains.across();
        for (block, out) in out.chunks_mut(LANES).enumerate() {
            let mut sum = direct[block].ears[ear];
            add(&mut sum, &room[block], ear, [own * gains.early, other * gains.early]);
            if let Some(late) = late {
                add(&mut sum, &late[block], ear, [own * gains.late, other * gains.late]);
            }
            for (i, x) in out.iter_mut().enumerate() {
                *x = Complex32::new(sum.re[i], sum.im[i]);
            }
        }
    }
}

#[cfg(test)]
#[path = "room_tests.rs"]
pub(crate) mod tests;
