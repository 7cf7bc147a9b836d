//! What is done to one voice's spectra: its direct sound filtered and its explicit taps added.

use crate::decode::{Change, Hops, QUICK_BELOW_HZ, TURNS};
use crate::number::whole;
use crate::render::carrier::likeness::Mixture;
use crate::render::carriers::Carriers;
use crate::render::early::direct_sound::DirectFilter;
use crate::render::early::taps::{Taps, add_mix};
use crate::render::early::taps_ahead::Applied;
use crate::render::late::decay::Decay;
use crate::render::late::network::LATE_HOPS;
use crate::render::low::lowest_bins::Low;
use crate::render::transform::lanes::{Accumulate, Block, EarBlocks, LANES, blocks_for};
use crate::render::transform::ring::Ring;
use crate::{EARLY_S, StftGrid, TAP_LEAD_HOPS, TailModel, TransferFunction, TransferShape, Trim};
use promenade_fourier::num_complex::Complex32;
use pulp::{Arch, WithSimd};
use std::ops::Range;
use std::sync::Arc;

/// Taps that share the direct sound's interaural delay. The first reflections, of floor and ceiling, come from the source's
/// lateral angle: in measured rooms the ears' coherence below 1.5 kHz is about 0.5 at that delay and 0.25 without it over these
/// hops, and the same either way later.
pub(crate) const DELAYED_TAPS: usize = 2;

/// What every part of a room's sound is made for: a scene on a host's grid.
#[derive(Clone, Copy)]
pub(crate) struct Plan<'a> {
    pub(crate) grid: &'a StftGrid,
    pub(crate) scene_grid: &'a StftGrid,
    pub(crate) shape: TransferShape,
    pub(crate) tail: &'a TailModel,
    pub(crate) carriers: &'a Arc<Carriers>,
    /// Explicit taps that each voice has of its own; the room has the others.
    pub(crate) own_taps: usize,
}

impl Plan<'_> {
    fn decay(&self) -> Decay {
        let Carriers { places, curve, .. } = &**self.carriers;
        Decay::new(self.grid, self.tail, places, Arc::clone(curve), self.shape.taps)
    }

    /// Explicit taps that are early reflections.
    pub(crate) fn early_taps(&self) -> usize {
        whole(EARLY_S / self.grid.hop_s() - TAP_LEAD_HOPS).min(self.shape.taps).max(self.apart())
    }

    /// Hops, the direct sound the first, that are played without waiting for a frame: all frames come so many hops earlier.
    pub(crate) fn apart(&self) -> usize {
        self.carriers.pace.early_hops()
    }

    /// Blocks of bins, and those of them that follow a pose quickly.
    pub(crate) fn blocks(&self) -> (usize, usize) {
        let blocks = blocks_for(self.grid.bins());
        (blocks, blocks_for(whole(QUICK_BELOW_HZ / self.grid.bin_hz(1))).min(blocks))
    }

    /// Hops of the lowest bins as measured responses have them, after all taps.
    pub(crate) fn low_hops(&self) -> usize {
        self.carriers.measured.as_ref().map_or(0, |measured| measured.low.hops())
    }
}

/// Some explicit taps, coloured by a transfer function.
pub(crate) struct ColouredTaps {
    arch: Arch,
    numbers: Range<usize>,
    tap_len: usize,
    pub(crate) taps: Taps,
    /// Blocks of bins that follow a pose quickly, and the others.
    pub(crate) quick: Range<usize>,
    pub(crate) slow: Range<usize>,
    pub(crate) decay: Decay,
    carriers: Arc<Carriers>,
    gains: Vec<f32>,
    /// How much of a mix of responses is left as it is, by ear and band.
    pub(crate) plain: Vec<[f32; LANES]>,
}

impl ColouredTaps {
    /// Of these numbers.
    pub(crate) fn new(plan: &Plan<'_>, numbers: Range<usize>) -> Self {
        let Plan { shape, carriers, .. } = *plan;
        let (blocks, quick) = plan.blocks();
        Self {
            arch: Arch::new(),
            tap_len: shape.tap_len(),
            taps: Taps::new(numbers.len(), &carriers.places, shape.bands),
            numbers,
            quick: 0..quick,
            slow: quick..blocks,
            decay: plan.decay(),
            carriers: Arc::clone(carriers),
            gains: vec![0.0; shape.tap_len()],
            plain: vec![[0.0; LANES]; carriers.measured.as_ref().map_or(0, |m| m.meeting.vectors())],
        }
    }

    /// Brings them to a pose as a change names them; the first are delayed at the ears by `turn` where it is given.
    pub(crate) fn update(
        &mut self,
        tf: &TransferFunction,
        change: &Change,
        mixture: Option<&Mixture<'_>>,
        turn: Option<&[Block]>,
    ) {
        for tap in self.numbers.clone().filter(|tap| change.names_tap(*tap)) {
            self.colour(tf, mixture, tap);
            let gains = self.decay.gains(&self.gains, tap + 1);
            let lost = self.carriers.measured.as_ref().and_then(|measured| measured.lifted(tap + 1, &tf.shares));
            let hop = tap - self.numbers.start;
            for blocks in change.blocks_of(tap, &self.quick, &self.slow) {
                self.taps.set(hop, (&self.carriers.taps, tap), tf.shares.entries(), gains, blocks.clone(), lost);
                if let Some(turn) = turn.filter(|_| tap < DELAYED_TAPS) {
                    self.taps.turn(hop, turn, blocks);
                }
            }
        }
    }

    /// Gains of the lowest bins of any tap, both ears.
    fn lowest(&mut self, tf: &TransferFunction, mixture: Option<&Mixture<'_>>, tap: usize) -> [[f32; LANES]; 2] {
        self.colour(tf, mixture, tap);
        self.taps.lowest_of(self.decay.gains(&self.gains, tap + 1))
    }

    /// Those of gains per band, so many hops after the direct sound.
    fn lowest_of(&mut self, gains: &[f32], hops: usize) -> [[f32; LANES]; 2] {
        self.taps.lowest_of(self.decay.gains(gains, hops))
    }

    fn colour(&mut self, tf: &TransferFunction, mixture: Option<&Mixture<'_>>, tap: usize) {
        self.gains.copy_from_slice(&tf.taps[tap * self.tap_len..(tap + 1) * self.tap_len]);
        if let Some(mixture) = mixture {
            mixture.apply(self.arch, tap, &tf.late, &mut self.gains);
        }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        self.taps.memory_bytes() + self.decay.memory_bytes()
    }
}

/// The filters of one voice, in the streaming form of AV-Cloud's Spatial Audio Render Head: masks and interaural delay for the
/// direct sound, complex taps with fixed carriers for the room. What comes after them is the `Room`.
///
/// Per bin k and frame t: `Y[k,t] = D[k] X[k,t] + sum_l g_l[k] C_l[k] X[k,t-l]`, with `l` from 1 to the number of taps.
pub(crate) struct VoiceFilters {
    arch: Arch,
    shape: TransferShape,
    /// Explicit taps of its own, and others that it has in the lowest bins.
    own: usize,
    own_low: usize,
    direct: DirectFilter,
    taps: ColouredTaps,
    low: Low,
    carriers: Arc<Carriers>,
    /// Hops that are played without waiting for a frame.
    apart: usize,
    /// The filter of these, and the levels that it was added up with, as long as its parts have not changed.
    joined: Vec<EarBlocks>,
    joined_at: Option<Trim>,
    /// Gains of the lowest bins after the taps, both ears.
    low_gains: Vec<f32>,
    /// The newest input spectra, at least one more than it has taps.
    input: Ring,
    /// Whether anything of its frames is heard, the gain of its direct sound, and the gains by band at which the shared part of
    /// the room hears it.
    pub(crate) is_heard: bool,
    pub(crate) direct_gain: f32,
    pub(crate) gains: Vec<f32>,
}

impl VoiceFilters {
    pub(crate) fn new(plan: &Plan<'_>) -> Self {
        let Plan { grid, shape, carriers, own_taps: own, .. } = *plan;
        let ((blocks, _), apart) = (plan.blocks(), plan.apart());
        let own_low = if carriers.measured.is_some() { shape.taps - own } else { 0 };
        Self {
            arch: Arch::new(),
            shape,
            own,
            own_low,
            direct: DirectFilter::new(grid, plan.scene_grid, carriers.top_hz),
            taps: ColouredTaps::new(plan, 0..own),
            low: Low::new(own_low + plan.low_hops(), own - apart),
            apart,
            joined: vec![EarBlocks::default(); if apart > 0 { blocks } else { 0 }],
            joined_at: None,
            low_gains: vec![1.0; shape.tap_len()],
            // What the shared taps hear comes after its own.
            input: Ring::new(blocks, own + 1 + usize::from(own < shape.taps)),
            is_heard: false,
            direct_gain: 1.0,
            gains: vec![1.0; shape.bands],
            carriers: Arc::clone(carriers),
        }
    }

    /// Explicit taps of its own and hops of the lowest bins.
    pub(crate) fn filter_hops(&self) -> usize {
        self.own + self.low.hops()
    }

    /// Hops for which it sounds on after its input.
    pub(crate) fn hops(&self) -> usize {
        self.filter_hops().max(self.input.slots())
    }

    /// Sets the reverberation time as a multiple of the scene's. Returns whether it has changed: then all time filters are to
    /// be brought up to date.
    pub(crate) fn set_decay(&mut self, times: f32) -> bool {
        self.taps.decay.set(times)
    }

    /// Takes what has changed in a transfer function.
    pub(crate) fn update(&mut self, tf: &TransferFunction, change: &Change) {
        if change.direct || (1..self.apart).any(|hop| change.names_tap(hop - 1)) {
            self.joined_at = None;
        }
        if change.direct {
            self.direct.set(tf);
            if let Some(measured) = &self.carriers.measured {
                let mixed = (tf.shares.entries(), measured.lifted(0, &tf.shares));
                add_mix(self.arch, &measured.first, 0, mixed, tf.shares.direct_gain, self.direct.blocks_mut());
            }
        }
        if change.keeps_filters() {
            return;
        }
        let carriers = Arc::clone(&self.carriers);
        let mut plain = std::mem::take(&mut self.taps.plain);
        let mixture = carriers.measured.as_ref().map(|m| m.meeting.mixture(tf.shares.entries(), &mut plain));
        let turn = if carriers.measured.is_none() { Some(self.direct.turn()) } else { None };
        self.taps.update(tf, change, mixture.as_ref(), turn);
        if let (Some(measured), Some(mixture)) = (&carriers.measured, &mixture)
            && change.filters != <[Hops; 2]>::default()
        {
            // The lowest bins after the taps go on with the gains of the last.
            if let Some(last) = tf.taps.rchunks_exact(self.shape.tap_len()).next() {
                self.low_gains.copy_from_slice(last);
                mixture.apply(self.arch, self.shape.taps, &tf.late, &mut self.low_gains);
            }
            // Each hop has one turn of four.
            let is_due = |hop: &usize| change.turn.is_none_or(|turn| hop % TURNS == turn);
            let first = self.shape.taps + LATE_HOPS;
            for hop in change.filters[1].iter().filter(|hop| *hop >= first).filter(is_due) {
                let gains = self.taps.lowest_of(&self.low_gains, self.shape.taps + 1 + hop - first);
                let (at, set) = (self.own_low + hop - first, (&measured.low, hop - first));
                self.low.set(at, set, (tf.shares.entries(), None), &gains);
            }
        }
        if let Some(measured) = &carriers.measured {
            // The lowest bins follow quickly.
            for tap in (self.own..self.shape.taps).filter(|tap| change.quick.iter().any(|hops| hops.contains(*tap))) {
                let gains = self.taps.lowest(tf, mixture.as_ref(), tap);
                let parts = (tf.shares.entries(), measured.lifted(tap + 1, &tf.shares));
                self.low.set(tap - self.own, (&carriers.taps, tap), parts, &gains);
            }
        }
        self.taps.plain = plain;
    }

    /// Takes the newest frame.
    pub(crate) fn write(&mut self, spectrum: &[Complex32]) {
        self.input.write(spectrum);
        self.low.write(spectrum);
    }

    /// The newest frames.
    pub(crate) fn input(&self) -> &Ring {
        &self.input
    }

    /// Adds the direct sound of the newest frame to what is heard; `work` is room to work in.
    pub(crate) fn add_direct(&mut self, work: &mut [EarBlocks], heard: &mut [EarBlocks]) {
        let (arch, newest, gain) = (self.arch, [self.input.at(0)], self.direct_gain);
        let (filter, hops, taps) = (self.direct.blocks(), 1, 0..1);
        if self.apart > 0 {
            return;
        }
        if gain == 1.0 {
            Accumulate { arch, newest, filter, hops, taps, sums: heard }.run();
            return;
        }
        work.fill(EarBlocks::default());
        Accumulate { arch, newest, filter, hops, taps, sums: work }.run();
        arch.dispatch(AddScaled { from: work, gain, to: heard });
    }

    /// Adds some taps: its own, and the lowest bins of others where it has them.
    pub(crate) fn add_taps(&self, taps: Range<usize>, sums: &mut [EarBlocks]) {
        let low = taps.start.max(self.own)..taps.end.max(self.own);
        if self.own_low > 0 && !low.is_empty() {
            self.low.add(low.start - self.own..low.end - self.own, sums);
        }
        let taps = taps.start.min(self.own)..taps.end.min(self.own);
        let newest = [self.input.at(taps.start + 1 - self.apart)];
        Accumulate { arch: self.arch, newest, filter: self.taps.taps.filters(), hops: self.own, taps, sums }.run();
    }

    /// Its own taps from one on whose frame is the newest for the last of the frames that are worked out ahead.
    pub(crate) fn applied(&self, first_tap: usize) -> Applied<'_> {
        Applied { newest: self.input.at(0), right: None, filter: self.taps.taps.filters(), hops: self.own, first_tap }
    }

    /// Adds the lowest bins of measured responses after all taps.
    pub(crate) fn add_low(&self, sums: &mut [EarBlocks]) {
        self.low.add(self.own_low..self.low.hops(), sums);
    }

    /// The filter of the hops that are played apart, on the host's bins, each hop at its time, where it has changed since
    /// it was asked for.
    pub(crate) fn joined(&mut self, trim: &Trim) -> Option<&[EarBlocks]> {
        if self.apart == 0 || self.joined_at.replace(*trim) == Some(*trim) {
            return None;
        }
        let gains = Gains::from(trim);
        self.arch.dispatch(Join {
            direct: self.direct.blocks(),
            taps: (self.taps.taps.filters(), self.own),
            count: self.apart,
            gains,
            out: &mut self.joined,
        });
        Some(&self.joined)
    }

    /// That filter is to be added up again.
    pub(crate) fn forget_joined(&mut self) {
        self.joined_at = None;
    }

    pub(crate) fn reset(&mut self) {
        self.input.reset();
        self.low.reset();
        self.forget_joined();
        self.is_heard = false;
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let ear_blocks = self.joined.len() + self.direct.blocks().len();
        ear_blocks * size_of::<EarBlocks>() + self.input.memory_bytes() + self.taps.memory_bytes() + self.low.memory_bytes()
    }
}

/// Adds blocks at a gain.
struct AddScaled<'a> {
    from: &'a [EarBlocks],
    gain: f32,
    to: &'a mut [EarBlocks],
}

impl WithSimd for AddScaled<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _simd: S) {
        for (to, from) in self.to.iter_mut().zip(self.from) {
            for ear in 0..2 {
                add(&mut to.ears[ear], from, ear, [self.gain, 0.0]);
            }
        }
    }
}

/// Levels of the parts of what is heard.
#[derive(Clone, Copy)]
pub(crate) struct Gains {
    direct: f32,
    pub(crate) early: f32,
    pub(crate) late: f32,
    /// Level of the difference between the ears in the room's sound.
    width: f32,
}

impl From<&Trim> for Gains {
    fn from(trim: &Trim) -> Self {
        Self { direct: trim.direct, early: trim.early, late: trim.late, width: trim.width }
    }
}

impl Gains {
    /// What an ear hears of its own sum, and of the other ear's.
    pub(crate) fn across(&self) -> [f32; 2] {
        [0.5 + 0.5 * self.width, 0.5 - 0.5 * self.width]
    }
}

/// Adds up the filters of the first hops, each hop at its time, in frames of four hops.
struct Join<'a> {
    direct: &'a [EarBlocks],
    /// Filters as `[block][hop]`, and their hops.
    taps: (&'a [EarBlocks], usize),
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
        let Self { direct, taps: (taps, taps_hops), count, gains, out } = self;
        let [own, other] = gains.across().map(|share| share * gains.early);
        for ((block, out), direct) in out.iter_mut().enumerate().zip(direct) {
            for ear in 0..2 {
                out.ears[ear] = scaled(&direct.ears[ear], gains.direct);
            }
            for hop in 0..count {
                let mut here = EarBlocks::default();
                if let Some(tap) = hop.checked_sub(1).map(|tap| &taps[block * taps_hops + tap]) {
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
pub(crate) fn add(sum: &mut Block, ears: &EarBlocks, ear: usize, [own, other]: [f32; 2]) {
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
