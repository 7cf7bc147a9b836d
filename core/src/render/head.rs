//! The render head: applies a transfer function to short-time spectra.

use crate::decode::{Change, Hops, QUICK_BELOW_HZ};
use crate::number::{single, whole};
use crate::render::bass::Bass;
use crate::render::carriers::Carriers;
use crate::render::decay::Decay;
use crate::render::direct::DirectFilter;
use crate::render::lanes::{Accumulate, Block, EarBlocks, LANES, blocks_for, write_slot};
use crate::render::late::{LATE_HOPS, Late, Slot, SlotMut, late_gain, late_lead};
use crate::render::low::Low;
use crate::render::meeting::Mixture;
use crate::render::taps::{Taps, mix};
use crate::transfer::Shares;
use crate::{EARLY_S, StftGrid, TAP_LEAD_HOPS, TailModel, TransferFunction, TransferShape, Trim};
use promenade_fourier::num_complex::Complex32;
use pulp::{Arch, WithSimd};
use std::ops::Range;
use std::sync::Arc;

/// Taps that share the direct sound's interaural delay. The first reflections, of floor and ceiling, come from the source's
/// lateral angle: in measured rooms the ears' coherence below 1.5 kHz is about 0.5 at that delay and 0.25 without it over these
/// hops, and the same either way later.
pub(crate) const DELAYED_TAPS: usize = 2;

/// Streaming form of AV-Cloud's Spatial Audio Render Head: masks and interaural delay for the direct sound, complex taps with
/// fixed carriers for the room, and an exponential late part that feeds itself.
///
/// Per bin k and frame t: `Y[k,t] = D[k] X[k,t] + sum_l g_l[k] C_l[k] X[k,t-l] + sum_j h_j[k] E_j[k] Z[k,t-j]`, with `l` from 1
/// to the number of taps and `Z` the output of [`Late`].
pub(crate) struct RenderHead {
    arch: Arch,
    shape: TransferShape,
    /// Blocks of bins that follow a pose quickly.
    quick_blocks: usize,
    direct: DirectFilter,
    taps: Taps,
    late: Taps,
    network: Late,
    low: Low,
    bass: Bass,
    /// The first hop of measured responses at the pose.
    first: Vec<EarBlocks>,
    carriers: Arc<Carriers>,
    decay: Decay,
    /// Explicit taps that are early reflections.
    early_taps: usize,
    /// Hops, the direct sound the first, that are played without waiting for a frame: all frames come so many hops earlier.
    apart: usize,
    /// The filter of these.
    joined: Vec<EarBlocks>,
    /// Gains of one late hop, of a tap and of the bass after the taps, both ears.
    late_gains: Vec<f32>,
    tap_gains: Vec<f32>,
    low_gains: Vec<f32>,
    /// How much of a mix of responses is left as it is, by ear and band.
    plain: Vec<f32>,
    /// The newest input spectra, `[block][slot]`, one more than there are taps.
    input: Vec<Block>,
    /// The newest spectra of the late network.
    tail: Vec<Block>,
    slots: Vec<usize>,
    late_slots: Vec<usize>,
    frame: usize,
    direct_sum: Vec<EarBlocks>,
    room_sum: Vec<EarBlocks>,
    /// What comes after the early reflections, where its level is another than theirs.
    late_sum: Vec<EarBlocks>,
    /// Frames since anything was heard.
    dead_frames: usize,
}

impl RenderHead {
    /// Prepares for a host grid; `scene_grid` is the one the transfer functions are sampled on.
    pub(crate) fn new(
        grid: StftGrid,
        scene_grid: &StftGrid,
        shape: TransferShape,
        tail: &TailModel,
        carriers: Arc<Carriers>,
    ) -> Self {
        let blocks = blocks_for(grid.bins());
        let apart = carriers.pace.early_hops();
        let places = &carriers.places;
        let decay = Decay::new(&grid, tail, places, Arc::clone(&carriers.curve), shape.taps);
        Self {
            arch: Arch::new(),
            shape,
            quick_blocks: blocks_for(whole(QUICK_BELOW_HZ / grid.bin_hz(1))).min(blocks),
            direct: DirectFilter::new(&grid, scene_grid, carriers.top_hz),
            taps: Taps::new(shape.taps, places, shape.bands),
            late: Taps::new(LATE_HOPS, places, shape.bands),
            network: Late::new(&grid, scene_grid, tail, decay.stated_bins()),
            low: Low::new(carriers.measured.as_ref().map_or(0, |m| m.low.hops()), shape.taps - apart),
            bass: Bass::new(carriers.measured.as_ref().map(|m| &m.bass), apart),
            first: vec![EarBlocks::default(); blocks],
            carriers,
            decay,
            early_taps: whole(EARLY_S / grid.hop_s() - TAP_LEAD_HOPS).min(shape.taps).max(apart),
            apart,
            joined: vec![EarBlocks::default(); if apart > 0 { blocks } else { 0 }],
            late_gains: vec![0.0; shape.tap_len()],
            tap_gains: vec![0.0; shape.tap_len()],
            low_gains: vec![1.0; shape.tap_len()],
            plain: vec![0.0; shape.tap_len()],
            input: vec![Block::default(); blocks * (shape.taps + 1)],
            tail: vec![Block::default(); blocks * LATE_HOPS],
            slots: vec![0; shape.taps],
            late_slots: vec![0; LATE_HOPS],
            frame: 0,
            direct_sum: vec![EarBlocks::default(); blocks],
            room_sum: vec![EarBlocks::default(); blocks],
            late_sum: vec![EarBlocks::default(); blocks],
            dead_frames: usize::MAX / 2,
        }
    }

    /// Explicit taps, late hops and hops of the bass together: what [`RenderHead::update`] counts.
    pub(crate) fn filter_hops(&self) -> usize {
        self.shape.taps + LATE_HOPS + self.low.hops()
    }

    /// What the taps are made of.
    pub(crate) fn carriers(&self) -> Arc<Carriers> {
        Arc::clone(&self.carriers)
    }

    /// Sets the reverberation time as a multiple of the scene's. Returns whether it has changed: then all time filters are to
    /// be brought up to date.
    pub(crate) fn set_decay(&mut self, times: f32) -> bool {
        let changed = self.decay.set(times);
        if changed {
            self.network.decay_by(self.decay.ratio_bins());
        }
        changed
    }

    /// Takes what has changed in a transfer function; `room` says whether more than the direct sound is wanted.
    pub(crate) fn update(&mut self, tf: &TransferFunction, change: &Change, room: bool) {
        if change.direct {
            self.bass.forget_pose();
            self.direct.set(tf);
            if let Some(measured) = &self.carriers.measured {
                let (blocks, shares) = (0..self.first.len(), tf.shares.entries());
                let lost = measured.lifted(0, &tf.shares);
                mix(self.arch, &measured.first, 0, blocks, (shares, lost), &mut self.first);
                self.direct.add(&self.first, tf.shares.direct_gain);
            }
        }
        if let Some(measured) = self.carriers.measured.as_ref().filter(|_| !room) {
            self.bass.set(&measured.bass, tf.shares.entries(), tf.shares.direct_gain);
        }
        if *change == (Change { direct: change.direct, ..Change::default() }) {
            return;
        }
        let (taps, len) = (self.shape.taps, self.shape.tap_len());
        let carriers = Arc::clone(&self.carriers);
        let mut plain = std::mem::take(&mut self.plain);
        let mixture = carriers.measured.as_ref().map(|m| m.meeting.mixture(tf.shares.entries(), &mut plain));
        for hop in change.quick.iter().flat_map(|hops| hops.iter()) {
            self.update_tap(tf, mixture.as_ref(), hop, 0..self.quick_blocks);
        }
        // The bass goes on with the gains of the last tap.
        let last = tf.taps.rchunks_exact(len).next().filter(|_| change.filters != Hops::default());
        if let Some((last, mixture)) = last.zip(mixture.as_ref()) {
            self.low_gains.copy_from_slice(last);
            mixture.apply(self.arch, taps, &tf.late, &mut self.low_gains);
        }
        for hop in change.filters.iter() {
            if hop < taps {
                self.update_tap(tf, mixture.as_ref(), hop, self.quick_blocks..self.direct_sum.len());
            } else if hop < taps + LATE_HOPS {
                self.update_late(tf, hop - taps);
            } else if let Some(measured) = &self.carriers.measured {
                let hop = hop - taps - LATE_HOPS;
                let gains = self.taps.lowest_of(self.decay.gains(&self.low_gains, taps + 1 + hop));
                self.low.set(hop, &measured.low, tf.shares.entries(), &gains);
            }
        }
        self.plain = plain;
    }

    /// Brings some blocks of bins of a tap to the pose.
    fn update_tap(&mut self, tf: &TransferFunction, mixture: Option<&Mixture<'_>>, hop: usize, blocks: Range<usize>) {
        self.tap_gains.copy_from_slice(&tf.taps[hop * self.shape.tap_len()..(hop + 1) * self.shape.tap_len()]);
        if let Some(mixture) = mixture {
            mixture.apply(self.arch, hop, &tf.late, &mut self.tap_gains);
        }
        let gains = self.decay.gains(&self.tap_gains, hop + 1);
        let lost = self.carriers.measured.as_ref().and_then(|measured| measured.lifted(hop + 1, &tf.shares));
        self.taps.set(hop, &self.carriers.taps, tf.shares.entries(), gains, blocks.clone(), lost);
        if hop < DELAYED_TAPS && self.carriers.measured.is_none() {
            self.taps.turn(hop, self.direct.turn(), blocks);
        }
    }

    fn update_late(&mut self, tf: &TransferFunction, hop: usize) {
        // The late part starts early enough to be at full level one hop after the last tap; its gain is stated there.
        self.late_gains.copy_from_slice(self.decay.gains(&tf.late, self.shape.taps + 1));
        for gains in self.late_gains.chunks_exact_mut(self.shape.bands) {
            for (gain, (decay, ratio)) in gains.iter_mut().zip(self.decay.hops()) {
                *gain = Late::carrier_gain() * *gain * single(late_gain(decay, ratio, hop, self.shape.taps));
            }
        }
        let blocks = 0..self.direct_sum.len();
        self.late.set(hop, &self.carriers.late, Shares::FIRST.entries(), &self.late_gains, blocks, None);
        if self.carriers.measured.is_some() {
            self.late.silence_lowest(hop);
        }
    }

    /// Applies the filters to the newest frame, everything but the direct sound at `room_gain`, 0 to 1, and each part at its
    /// level. `None` when nothing sounds any more: both ears are silent.
    pub(crate) fn render(
        &mut self,
        spectrum: &[Complex32],
        room_gain: f32,
        trim: &Trim,
        ears: [&mut [Complex32]; 2],
    ) -> Option<()> {
        let has_room = room_gain > 0.0;
        let silent = spectrum.iter().all(|x| x.re == 0.0 && x.im == 0.0);
        if silent && self.dead_frames > self.filter_hops() + 1 {
            return None;
        }
        let slots = self.shape.taps + 1;
        let now = self.frame % slots;
        write_slot(&mut self.input, slots, now, spectrum);
        self.low.write(self.frame, spectrum);
        for (l, slot) in self.slots.iter_mut().enumerate() {
            *slot = (now + slots + self.apart - 1 - l) % slots;
        }
        if has_room {
            self.advance_late(now);
        }
        let dead = silent && (!has_room || self.network.is_silent());
        self.dead_frames = if dead { self.dead_frames.saturating_add(1) } else { 0 };

        self.direct_sum.fill(EarBlocks::default());
        let (arch, input, tail) = (self.arch, &self.input, &self.tail);
        let add =
            |slots: &[usize], ring: &[Block], ring_len: usize, filter: &[EarBlocks], first: usize, sums: &mut [EarBlocks]| {
                // A filter has as many hops as its ring has slots, but the taps, whose ring holds the newest frame too.
                let hops = filter.len() / sums.len();
                Accumulate { arch, slots, ring_len, ring, filter, hops, first, sums }.run();
            };
        // What is played apart is the direct sound and the taps before this one.
        let first = self.apart.saturating_sub(1);
        if self.apart == 0 {
            add(&[now], input, slots, self.direct.blocks(), 0, &mut self.direct_sum);
        }
        self.bass.add(input, slots, now, 1.0 - room_gain, &mut self.direct_sum);
        let apart = trim.early != trim.late;
        if has_room {
            let early = if apart { self.early_taps } else { self.shape.taps };
            self.room_sum.fill(EarBlocks::default());
            add(&self.slots[first..early], input, slots, self.taps.filters(), first, &mut self.room_sum);
            let sums = if apart { &mut self.late_sum } else { &mut self.room_sum };
            if apart {
                sums.fill(EarBlocks::default());
                add(&self.slots[early..], input, slots, self.taps.filters(), early, sums);
            }
            add(&self.late_slots, tail, LATE_HOPS, self.late.filters(), 0, sums);
            self.low.add(sums);
        }
        let gains = Gains::new(room_gain, trim);
        let (direct, room) = (&self.direct_sum, &self.room_sum);
        let late = if apart { Some(&*self.late_sum) } else { None };
        for (ear, out) in ears.into_iter().enumerate() {
            arch.dispatch(Mix { ear, direct, room, late, gains, out });
        }
        self.frame = self.frame.wrapping_add(1);
        Some(())
    }

    /// The filter of the hops that are played apart, on the host's bins, each hop at its time; empty where none are.
    pub(crate) fn joined(&mut self, room_gain: f32, trim: &Trim) -> &[EarBlocks] {
        let (taps, gains) = (self.taps.filters(), Gains::new(room_gain, trim));
        let bass = (self.bass.filters(), self.bass.hops(), 1.0 - room_gain);
        let hops = self.shape.taps;
        self.arch.dispatch(Join {
            direct: self.direct.blocks(),
            taps: (taps, hops),
            bass,
            count: self.apart,
            gains,
            out: &mut self.joined,
        });
        &self.joined
    }

    /// Feeds the late network from the ring of input, whose newest frame is in slot `now`.
    fn advance_late(&mut self, now: usize) {
        let slots = self.shape.taps + 1;
        let tail_now = self.frame % LATE_HOPS;
        for (j, slot) in self.late_slots.iter_mut().enumerate() {
            *slot = (tail_now + LATE_HOPS - j) % LATE_HOPS;
        }
        let fed = (now + slots + self.apart - (self.shape.taps + 1 - late_lead(self.shape.taps))) % slots;
        let from = Slot { ring: &self.input, slots, at: fed };
        let to = SlotMut { ring: &mut self.tail, slots: LATE_HOPS, at: tail_now };
        self.network.advance(self.frame, from, to);
    }

    /// Empties the late part.
    pub(crate) fn forget_late(&mut self) {
        self.tail.fill(Block::default());
        self.network.reset();
    }

    pub(crate) fn reset(&mut self) {
        self.input.fill(Block::default());
        self.low.reset();
        self.forget_late();
        self.dead_frames = usize::MAX / 2;
        self.frame = 0;
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let ear_blocks = self.joined.len()
            + self.first.len()
            + self.direct_sum.len()
            + self.room_sum.len()
            + self.late_sum.len()
            + self.direct.blocks().len();
        ear_blocks * size_of::<EarBlocks>()
            + (self.input.len() + self.tail.len()) * size_of::<Block>()
            + self.taps.memory_bytes()
            + self.late.memory_bytes()
            + self.network.memory_bytes()
            + self.low.memory_bytes()
            + self.bass.memory_bytes()
            + self.decay.memory_bytes()
    }
}

/// Levels of the parts of what is heard.
#[derive(Clone, Copy)]
struct Gains {
    direct: f32,
    early: f32,
    late: f32,
    /// Level of the difference between the ears in the room's sound.
    width: f32,
}

impl Gains {
    fn new(room_gain: f32, trim: &Trim) -> Self {
        Self { direct: trim.direct, early: room_gain * trim.early, late: room_gain * trim.late, width: trim.width }
    }

    /// What an ear hears of its own sum, and of the other ear's.
    fn across(&self) -> [f32; 2] {
        [0.5 + 0.5 * self.width, 0.5 - 0.5 * self.width]
    }
}

/// Adds up the filters of the first hops, each hop at its time, in frames of four hops.
struct Join<'a> {
    direct: &'a [EarBlocks],
    /// Filters as `[block][hop]`, and how many hops there are: of the taps and of the direct sound's bass with its level.
    taps: (&'a [EarBlocks], usize),
    bass: (&'a [EarBlocks], usize, f32),
    count: usize,
    gains: Gains,
    out: &'a mut [EarBlocks],
}

/// By what each bin of a block turns in a quarter of the frame, times so many hops: real and imaginary part.
fn quarter_turns(hops: usize) -> [[f32; LANES]; 2] {
    let turn = |i: usize| [(1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (0.0, 1.0)][i * hops % 4];
    [std::array::from_fn(|i| turn(i).0), std::array::from_fn(|i| turn(i).1)]
}

impl WithSimd for Join<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _simd: S) {
        let Self { direct, taps: (taps, hops), bass: (bass, bass_hops, bass_gain), count, gains, out } = self;
        let [own, other] = gains.across().map(|share| share * gains.early);
        for ((block, out), direct) in out.iter_mut().enumerate().zip(direct) {
            for ear in 0..2 {
                out.ears[ear] = scaled(&direct.ears[ear], gains.direct);
            }
            for hop in 0..count {
                let mut here = EarBlocks::default();
                if let Some(bass) = bass.get(block * bass_hops + hop).filter(|_| hop < bass_hops && bass_gain != 0.0) {
                    for ear in 0..2 {
                        add(&mut here.ears[ear], bass, ear, [bass_gain * gains.direct, 0.0]);
                    }
                }
                if let Some(tap) = hop.checked_sub(1).and_then(|tap| taps.get(block * hops + tap)) {
                    for ear in 0..2 {
                        add(&mut here.ears[ear], tap, ear, [own, other]);
                    }
                }
                let [cos, sin] = quarter_turns(hop);
                for (out, here) in out.ears.iter_mut().zip(&here.ears) {
                    for i in 0..LANES {
                        out.re[i] += cos[i] * here.re[i] - sin[i] * here.im[i];
                        out.im[i] += cos[i] * here.im[i] + sin[i] * here.re[i];
                    }
                }
            }
        }
    }
}

/// Adds one ear's direct sound and room.
struct Mix<'a> {
    ear: usize,
    direct: &'a [EarBlocks],
    /// Early reflections, with all that comes later where that has no sum of its own.
    room: &'a [EarBlocks],
    late: Option<&'a [EarBlocks]>,
    gains: Gains,
    out: &'a mut [Complex32],
}

impl Mix<'_> {
    /// Sets a block of what comes out: direct sound, room and, where it has a sum of its own, what comes later.
    #[inline(always)]
    fn block(&self, block: usize, out: &mut [Complex32]) {
        let Self { ear, direct, room, late, gains, .. } = self;
        let mut sum = scaled(&direct[block].ears[*ear], gains.direct);
        let [own, other] = gains.across();
        add(&mut sum, &room[block], *ear, [own * gains.early, other * gains.early]);
        if let Some(late) = late {
            add(&mut sum, &late[block], *ear, [own * gains.late, other * gains.late]);
        }
        for (i, x) in out.iter_mut().enumerate() {
            *x = Complex32::new(sum.re[i], sum.im[i]);
        }
    }
}

#[inline(always)]
fn scaled(block: &Block, gain: f32) -> Block {
    let mut out = *block;
    for i in 0..LANES {
        out.re[i] *= gain;
        out.im[i] *= gain;
    }
    out
}

/// Adds some of an ear's sound and of the other's, which mostly has no share.
#[inline(always)]
fn add(sum: &mut Block, ears: &EarBlocks, ear: usize, [own, other]: [f32; 2]) {
    for (ear, gain) in [(ear, own), (1 - ear, other)] {
        if gain != 0.0 {
            let part = &ears.ears[ear];
            for i in 0..LANES {
                sum.re[i] += gain * part.re[i];
                sum.im[i] += gain * part.im[i];
            }
        }
    }
}

impl WithSimd for Mix<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(mut self, _simd: S) {
        let out = std::mem::take(&mut self.out);
        let (whole, rest) = out.as_chunks_mut::<LANES>();
        for (block, out) in whole.iter_mut().enumerate() {
            self.block(block, out);
        }
        if !rest.is_empty() {
            self.block(whole.len(), rest);
        }
    }
}

#[cfg(test)]
mod tests;
