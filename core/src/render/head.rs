//! The render head: applies a transfer function to short-time spectra.

use crate::decode::{Change, Hops, QUICK_BELOW_HZ};
use crate::number::{exponent, single, whole};
use crate::render::bass::Bass;
use crate::render::carrier::per_bin;
use crate::render::carriers::Carriers;
use crate::render::direct::DirectFilter;
use crate::render::lanes::{Accumulate, Block, EarBlocks, LANES, blocks_for, write_slot};
use crate::render::late::{LATE_HOPS, Late, Slot, SlotMut};
use crate::render::low::Low;
use crate::render::taps::{Taps, mix};
use crate::transfer::Shares;
use crate::{StftGrid, TailModel, TransferFunction, TransferShape};
use promenade_fourier::num_complex::Complex32;
use pulp::{Arch, WithSimd};
use std::ops::Range;
use std::sync::Arc;

/// Taps that share the direct sound's interaural delay. The first reflections, of floor and ceiling, come from the source's lateral
/// angle: in measured rooms the ears' coherence below 1.5 kHz is about 0.5 at that delay and 0.25 without it over these hops, and
/// the same either way later.
pub(crate) const DELAYED_TAPS: usize = 2;

/// The least amplitude that the late part leaves after one hop: its gains are stated some hops after it begins, and a room that has
/// fallen silent by then says nothing of how loud it was.
const FASTEST_DECAY: f64 = 0.1;

/// Streaming form of AV-Cloud's Spatial Audio Render Head: masks and interaural delay for the direct sound, complex taps with fixed
/// carriers for the room, and an exponential late part that feeds itself.
///
/// Per bin k and frame t: `Y[k,t] = D[k] X[k,t] + sum_l g_l[k] C_l[k] X[k,t-l] + sum_j h_j[k] E_j[k] Z[k,t-j]`, with `l` from 1 to the
/// number of taps and `Z` the output of [`Late`].
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
    /// Per band, amplitude left after one hop.
    hop_decay: Vec<f64>,
    /// Gains of one late hop, both ears.
    late_gains: Vec<f32>,
    /// The newest input spectra, `[block][slot]`, one more than there are taps.
    input: Vec<Block>,
    /// The newest spectra of the late network.
    tail: Vec<Block>,
    slots: Vec<usize>,
    late_slots: Vec<usize>,
    frame: usize,
    direct_sum: Vec<EarBlocks>,
    room_sum: Vec<EarBlocks>,
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
        let places = &carriers.places;
        let hop_decay: Vec<f64> =
            tail.t60_s.iter().map(|t| 10.0_f64.powf(-3.0 * grid.hop_s() / f64::from(*t)).max(FASTEST_DECAY)).collect();
        Self {
            arch: Arch::new(),
            shape,
            quick_blocks: blocks_for(whole(QUICK_BELOW_HZ / grid.bin_hz(1))).min(blocks),
            direct: DirectFilter::new(&grid, scene_grid, carriers.top_hz),
            taps: Taps::new(shape.taps, places, shape.bands),
            late: Taps::new(LATE_HOPS, places, shape.bands),
            network: Late::new(&grid, scene_grid, tail, &per_bin(places, &hop_decay)),
            low: Low::new(carriers.measured.as_ref().map_or(0, |m| m.low.hops()), shape.taps),
            bass: Bass::new(carriers.measured.as_ref().map(|m| &m.bass)),
            first: vec![EarBlocks::default(); blocks],
            carriers,
            hop_decay,
            late_gains: vec![0.0; shape.tap_len()],
            input: vec![Block::default(); blocks * (shape.taps + 1)],
            tail: vec![Block::default(); blocks * LATE_HOPS],
            slots: vec![0; shape.taps],
            late_slots: vec![0; LATE_HOPS],
            frame: 0,
            direct_sum: vec![EarBlocks::default(); blocks],
            room_sum: vec![EarBlocks::default(); blocks],
            dead_frames: usize::MAX / 2,
        }
    }

    /// Explicit taps, late hops and hops of the bass together: what [`RenderHead::update`] counts.
    pub(crate) fn filter_hops(&self) -> usize {
        self.shape.taps + LATE_HOPS + self.low.hops()
    }

    /// Takes what has changed in a transfer function; `room` says whether more than the direct sound is wanted.
    pub(crate) fn update(&mut self, tf: &TransferFunction, change: &Change, room: bool) {
        if change.direct {
            self.bass.forget_pose();
            self.direct.set(tf);
            if let Some(measured) = &self.carriers.measured {
                let blocks = 0..self.first.len();
                mix(self.arch, &measured.first, 0, blocks, tf.shares.entries(), &mut self.first);
                self.direct.add(&self.first, tf.shares.direct_gain);
            }
        }
        if let Some(measured) = self.carriers.measured.as_ref().filter(|_| !room) {
            self.bass.set(&measured.bass, tf.shares.entries(), tf.shares.direct_gain);
        }
        let (taps, len) = (self.shape.taps, self.shape.tap_len());
        for hop in change.quick.iter().flat_map(|hops| hops.iter()) {
            self.update_tap(tf, hop, 0..self.quick_blocks);
        }
        // The bass goes on with the gains of the last tap.
        let last =
            tf.taps.rchunks_exact(len).next().filter(|_| self.carriers.measured.is_some() && change.filters != Hops::default());
        let low_gains = last.map_or([[1.0; LANES]; 2], |last| self.taps.lowest_of(last));
        for hop in change.filters.iter() {
            if hop < taps {
                self.update_tap(tf, hop, self.quick_blocks..self.direct_sum.len());
            } else if hop < taps + LATE_HOPS {
                self.update_late(tf, hop - taps);
            } else if let Some(measured) = &self.carriers.measured {
                self.low.set(hop - taps - LATE_HOPS, &measured.low, tf.shares.entries(), &low_gains);
            }
        }
    }

    /// Brings some blocks of bins of a tap to the pose.
    fn update_tap(&mut self, tf: &TransferFunction, hop: usize, blocks: Range<usize>) {
        let gains = &tf.taps[hop * self.shape.tap_len()..(hop + 1) * self.shape.tap_len()];
        self.taps.set(hop, &self.carriers.taps, tf.shares.entries(), gains, blocks.clone());
        if hop < DELAYED_TAPS && self.carriers.measured.is_none() {
            self.taps.turn(hop, self.direct.turn(), blocks);
        }
    }

    fn update_late(&mut self, tf: &TransferFunction, hop: usize) {
        // The late part starts early enough to be at full level one hop after the last tap; its gain is stated there.
        let power = late_power(hop, self.shape.taps);
        let ears = self.late_gains.chunks_exact_mut(self.shape.bands).zip(tf.late.chunks_exact(self.shape.bands));
        for (gains, stated) in ears {
            for ((g, s), decay) in gains.iter_mut().zip(stated).zip(&self.hop_decay) {
                *g = Late::carrier_gain() * s * single(decay.powi(power));
            }
        }
        let blocks = 0..self.direct_sum.len();
        self.late.set(hop, &self.carriers.late, Shares::FIRST.entries(), &self.late_gains, blocks);
        if self.carriers.measured.is_some() {
            self.late.silence_lowest(hop);
        }
    }

    /// Applies the filters to the newest frame, everything but the direct sound at `room_gain`, 0 to 1. `None` when nothing sounds any more: both ears are silent.
    pub(crate) fn render(&mut self, spectrum: &[Complex32], room_gain: f32, ears: [&mut [Complex32]; 2]) -> Option<()> {
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
            *slot = (now + slots - 1 - l) % slots;
        }
        if has_room {
            self.advance_late(now);
        }
        let dead = silent && (!has_room || self.network.is_silent());
        self.dead_frames = if dead { self.dead_frames.saturating_add(1) } else { 0 };

        self.direct_sum.fill(EarBlocks::default());
        let (arch, input, tail) = (self.arch, &self.input, &self.tail);
        let add = |slots: &[usize], ring: &[Block], ring_len: usize, filter: &[EarBlocks], sums: &mut [EarBlocks]| {
            Accumulate { arch, slots, ring_len, ring, filter, sums }.run();
        };
        add(&[now], input, slots, self.direct.blocks(), &mut self.direct_sum);
        self.bass.add(input, slots, now, 1.0 - room_gain, &mut self.direct_sum);
        if has_room {
            self.room_sum.fill(EarBlocks::default());
            add(&self.slots, input, slots, self.taps.filters(), &mut self.room_sum);
            add(&self.late_slots, tail, LATE_HOPS, self.late.filters(), &mut self.room_sum);
            self.low.add(&mut self.room_sum);
        }
        for (ear, out) in ears.into_iter().enumerate() {
            arch.dispatch(Mix { ear, direct: &self.direct_sum, room: &self.room_sum, room_gain, out });
        }
        self.frame = self.frame.wrapping_add(1);
        Some(())
    }

    /// Feeds the late network from the ring of input, whose newest frame is in slot `now`.
    fn advance_late(&mut self, now: usize) {
        let slots = self.shape.taps + 1;
        let tail_now = self.frame % LATE_HOPS;
        for (j, slot) in self.late_slots.iter_mut().enumerate() {
            *slot = (tail_now + LATE_HOPS - j) % LATE_HOPS;
        }
        let fed = (now + slots - (self.shape.taps + 1 - late_lead(self.shape.taps))) % slots;
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
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let ear_blocks = self.first.len() + self.direct_sum.len() + self.room_sum.len() + self.direct.blocks().len();
        ear_blocks * size_of::<EarBlocks>()
            + (self.input.len() + self.tail.len()) * size_of::<Block>()
            + self.taps.memory_bytes()
            + self.late.memory_bytes()
            + self.network.memory_bytes()
            + self.low.memory_bytes()
            + self.bass.memory_bytes()
    }
}

/// Adds one ear's direct sound and room.
struct Mix<'a> {
    ear: usize,
    direct: &'a [EarBlocks],
    room: &'a [EarBlocks],
    room_gain: f32,
    out: &'a mut [Complex32],
}

impl WithSimd for Mix<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _simd: S) {
        for ((chunk, direct), room) in self.out.chunks_mut(LANES).zip(self.direct).zip(self.room) {
            let (d, r) = (&direct.ears[self.ear], &room.ears[self.ear]);
            for (i, x) in chunk.iter_mut().enumerate() {
                *x = Complex32::new(d.re[i] + self.room_gain * r.re[i], d.im[i] + self.room_gain * r.im[i]);
            }
        }
    }
}

/// Hops by which the late part starts before the hop after the last tap.
pub(crate) fn late_lead(taps: usize) -> usize {
    (LATE_HOPS - 1).min(taps)
}

/// Hops of decay of a late hop's gain, from the hop after the last tap on.
pub(crate) fn late_power(hop: usize, taps: usize) -> i32 {
    exponent(hop) - exponent(late_lead(taps))
}

#[cfg(test)]
mod tests;
