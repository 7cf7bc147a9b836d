//! The render head: applies a transfer function to short-time spectra.

use crate::carrier::{band_places, hop_carriers, per_bin};
use crate::lanes::{Accumulate, Block, EarBlocks, LANES, blocks_for, write_slot};
use crate::late::{LATE_HOPS, Late, Slot, SlotMut};
use crate::{Bands, StftGrid, TailModel, TransferFunction, TransferShape};
use pulp::Arch;
use realfft::num_complex::Complex32;
use std::ops::Range;

/// Streaming form of AV-Cloud's Spatial Audio Render Head: masks and interaural delay for the direct sound, complex taps with fixed
/// carriers for the room, and an exponential late part that feeds itself.
///
/// Per bin k and frame t: `Y[k,t] = D[k] X[k,t] + sum_l g_l[k] C_l[k] X[k,t-l] + sum_j h_j[k] E_j[k] Z[k,t-j]`, with `l` from 1 to the
/// number of taps and `Z` the output of [`Late`].
pub(crate) struct RenderHead {
    arch: Arch,
    grid: StftGrid,
    shape: TransferShape,
    fractions: Vec<f32>,
    /// Bins of each interval between two bands.
    intervals: Vec<Range<usize>>,
    /// Per host bin: scene bin below it and the fraction towards the next.
    scene_bins: Vec<(usize, f32)>,
    /// The direct sound's phasors of both ears on the scene's bins.
    phasors: [Vec<Complex32>; 2],
    tap_carriers: Vec<EarBlocks>,
    late_carriers: Vec<EarBlocks>,
    /// Per band, amplitude left after one hop.
    hop_decay: Vec<f32>,
    network: Late,
    direct: Vec<EarBlocks>,
    taps: Vec<EarBlocks>,
    late: Vec<EarBlocks>,
    input: Vec<Block>,
    tail: Vec<Block>,
    slots: Vec<usize>,
    late_slots: Vec<usize>,
    frame: usize,
    direct_sum: Vec<EarBlocks>,
    room_sum: Vec<EarBlocks>,
    /// Gains of one tap per bin, left and right.
    gains: [Vec<f32>; 2],
    room_gain: f32,
    dead_frames: usize,
}

impl RenderHead {
    /// Prepares for a host grid; `scene_grid` is the one the transfer functions are sampled on.
    pub(crate) fn new(
        grid: StftGrid,
        scene_grid: &StftGrid,
        shape: TransferShape,
        bands: &Bands,
        tail: &TailModel,
        top_hz: f32,
    ) -> Self {
        let bins = grid.bins();
        let blocks = blocks_for(bins);
        // Within the scene's own band the masks hold up to its Nyquist frequency, where anti-alias filters close;
        // a wider host band must not inherit that closing edge.
        let wider = grid.sample_rate_hz > 1.05 * scene_grid.sample_rate_hz;
        let top_hz = if wider { top_hz } else { f32::INFINITY };
        let places = band_places(&grid, bands, top_hz);
        let scene_bins: Vec<_> = (0..bins)
            .map(|k| {
                let hz = grid.bin_hz(k).min(f64::from(top_hz));
                let along = (hz / scene_grid.bin_hz(1)).min((shape.bins - 1) as f64);
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the scene's bins")]
                let below = (along as usize).min(shape.bins - 2);
                #[expect(clippy::cast_possible_truncation, reason = "a fraction")]
                let fraction = (along - below as f64) as f32;
                (below, fraction)
            })
            .collect();
        #[expect(clippy::cast_possible_truncation, reason = "a gain in [0, 1]")]
        let hop_decay: Vec<f32> =
            tail.t60_s.iter().map(|t| 10.0_f64.powf(-3.0 * grid.hop_s() / f64::from(*t)) as f32).collect();
        let network = Late::new(&grid, tail, &per_bin(&places, &hop_decay));
        let pack = |carriers: &[[Vec<Complex32>; 2]]| {
            let mut out = vec![EarBlocks::default(); blocks * carriers.len()];
            for (l, ears) in carriers.iter().enumerate() {
                for (ear, spectrum) in ears.iter().enumerate() {
                    for (k, x) in spectrum.iter().enumerate() {
                        let block = &mut out[k / LANES * carriers.len() + l].ears[ear];
                        block.re[k % LANES] = x.re;
                        block.im[k % LANES] = x.im;
                    }
                }
            }
            out
        };
        let intervals = (0..bands.count() - 1)
            .map(|b| {
                let first = places.partition_point(|p| p.band < b);
                first..places.partition_point(|p| p.band <= b)
            })
            .collect();
        Self {
            arch: Arch::new(),
            grid,
            shape,
            fractions: places.iter().map(|p| p.fraction).collect(),
            intervals,
            scene_bins,
            phasors: [vec![Complex32::ONE; shape.bins], vec![Complex32::ONE; shape.bins]],
            tap_carriers: pack(&hop_carriers(&grid, &places, tail, 0, shape.taps)),
            late_carriers: pack(&hop_carriers(&grid, &places, tail, 1, LATE_HOPS)),
            hop_decay,
            network,
            direct: vec![EarBlocks::default(); blocks],
            taps: vec![EarBlocks::default(); blocks * shape.taps],
            late: vec![EarBlocks::default(); blocks * LATE_HOPS],
            input: vec![Block::default(); blocks * (shape.taps + 1)],
            tail: vec![Block::default(); blocks * LATE_HOPS],
            slots: vec![0; shape.taps],
            late_slots: vec![0; LATE_HOPS],
            frame: 0,
            direct_sum: vec![EarBlocks::default(); blocks],
            room_sum: vec![EarBlocks::default(); blocks],
            gains: [vec![0.0; blocks * LANES], vec![0.0; blocks * LANES]],
            room_gain: 1.0,
            dead_frames: usize::MAX / 2,
        }
    }

    /// Explicit taps and late hops together: the range that [`RenderHead::set_taps`] counts in.
    pub(crate) fn filter_hops(&self) -> usize {
        self.shape.taps + LATE_HOPS
    }

    /// Takes masks, phase and interaural delay of the direct sound.
    pub(crate) fn set_direct(&mut self, tf: &TransferFunction) {
        for ((phasors, phases), sign) in self.phasors.iter_mut().zip(tf.phase.chunks_exact(self.shape.bins)).zip([-1.0, 1.0]) {
            let gains = tf.mixture.iter().zip(&tf.difference).map(|(m, d)| m * (1.0 + sign * d));
            for ((p, phase), gain) in phasors.iter_mut().zip(phases).zip(gains) {
                let (sin, cos) = phase.sin_cos();
                *p = Complex32::new(gain * cos, gain * sin);
            }
        }
        // Half the interaural delay to each ear, so that the head's centre stays where it is.
        let turn_per_bin = -std::f64::consts::PI * f64::from(tf.delay_s) * self.grid.bin_hz(1);
        #[expect(clippy::cast_possible_truncation, reason = "points on the unit circle")]
        let unit = |k: usize| {
            let (s, c) = (turn_per_bin * k as f64).sin_cos();
            Complex32::new(c as f32, s as f32)
        };
        let steps: [Complex32; LANES] = std::array::from_fn(unit);
        let [left, right] = &self.phasors;
        for ((b, block), places) in self.direct.iter_mut().enumerate().zip(self.scene_bins.chunks(LANES)) {
            let base = unit(b * LANES);
            for (i, (&(below, fraction), step)) in places.iter().zip(&steps).enumerate() {
                // A positive delay means that the left ear is later.
                let turn = base * step;
                let l = (left[below] + (left[below + 1] - left[below]) * fraction) * turn;
                let r = (right[below] + (right[below + 1] - right[below]) * fraction) * turn.conj();
                block.ears[0].re[i] = l.re;
                block.ears[0].im[i] = l.im;
                block.ears[1].re[i] = r.re;
                block.ears[1].im[i] = r.im;
            }
        }
    }

    /// Takes the gains of a range of [`RenderHead::filter_hops`].
    pub(crate) fn set_taps(&mut self, tf: &TransferFunction, range: Range<usize>) {
        let (taps, bands) = (self.shape.taps, self.shape.bands);
        for hop in range {
            let (row, level, power, carriers, filters, stride, at) = if hop < taps {
                let row = &tf.taps[hop * 2 * bands..(hop + 1) * 2 * bands];
                (row, 1.0, 0, &self.tap_carriers, &mut self.taps, taps, hop)
            } else {
                // The late part starts early enough to be at full level one hop after the last tap; its gain is stated there.
                let power = i32_of(hop - taps) - i32_of(self.late_lead());
                (&tf.late[..], Late::carrier_gain(), power, &self.late_carriers, &mut self.late, LATE_HOPS, hop - taps)
            };
            for (gains, ear_row) in self.gains.iter_mut().zip(row.chunks_exact(bands)) {
                for (interval, (pair, decay)) in
                    self.intervals.iter().zip(ear_row.windows(2).zip(self.hop_decay.windows(2)))
                {
                    let low = level * pair[0] * decay[0].powi(power);
                    let step = level * pair[1] * decay[1].powi(power) - low;
                    let fractions = &self.fractions[interval.clone()];
                    for (g, f) in gains[interval.clone()].iter_mut().zip(fractions) {
                        *g = low + f * step;
                    }
                }
            }
            let [left, right] = &self.gains;
            let rows = left.as_chunks::<LANES>().0.iter().zip(right.as_chunks::<LANES>().0);
            for (b, (left, right)) in rows.enumerate() {
                let carrier = &carriers[b * stride + at].ears;
                let filter = &mut filters[b * stride + at].ears;
                for i in 0..LANES {
                    filter[0].re[i] = carrier[0].re[i] * left[i];
                    filter[0].im[i] = carrier[0].im[i] * left[i];
                    filter[1].re[i] = carrier[1].re[i] * right[i];
                    filter[1].im[i] = carrier[1].im[i] * right[i];
                }
            }
        }
    }

    /// Level of everything but the direct sound: moves towards 1 or 0 by at most `step` a frame, or jumps with a step of 1.
    pub(crate) fn glide_room(&mut self, on: bool, step: f32) {
        let target = if on { 1.0 } else { 0.0 };
        self.room_gain += (target - self.room_gain).clamp(-step, step);
    }

    /// Applies the filters to the newest frame. `None` when nothing sounds any more: both ears are silent.
    pub(crate) fn render(&mut self, spectrum: &[Complex32], ears: [&mut [Complex32]; 2]) -> Option<()> {
        let silent = spectrum.iter().all(|x| x.re == 0.0 && x.im == 0.0);
        if silent && self.dead_frames > self.filter_hops() + 2 {
            return None;
        }
        let slots = self.shape.taps + 1;
        let now = self.frame % slots;
        write_slot(&mut self.input, slots, now, spectrum);
        for (l, slot) in self.slots.iter_mut().enumerate() {
            *slot = (now + slots - 1 - l) % slots;
        }
        let tail_slot = self.frame % LATE_HOPS;
        for (j, slot) in self.late_slots.iter_mut().enumerate() {
            *slot = (tail_slot + LATE_HOPS - j) % LATE_HOPS;
        }
        let fed = (now + slots - (self.shape.taps + 1 - self.late_lead())) % slots;
        self.network.advance(
            self.frame,
            Slot { ring: &self.input, slots, at: fed },
            SlotMut { ring: &mut self.tail, slots: LATE_HOPS, at: tail_slot },
        );
        let dead = silent && self.network.is_silent();
        self.dead_frames = if dead { self.dead_frames.saturating_add(1) } else { 0 };

        self.direct_sum.fill(EarBlocks::default());
        Accumulate {
            arch: self.arch,
            slots: &[now],
            ring_len: slots,
            ring: &self.input,
            filter: &self.direct,
            sums: &mut self.direct_sum,
        }
        .run();
        if self.room_gain > 0.0 {
            self.room_sum.fill(EarBlocks::default());
            Accumulate {
                arch: self.arch,
                slots: &self.slots,
                ring_len: slots,
                ring: &self.input,
                filter: &self.taps,
                sums: &mut self.room_sum,
            }
            .run();
            Accumulate {
                arch: self.arch,
                slots: &self.late_slots,
                ring_len: LATE_HOPS,
                ring: &self.tail,
                filter: &self.late,
                sums: &mut self.room_sum,
            }
            .run();
        }
        let room_gain = self.room_gain;
        for (ear, out) in ears.into_iter().enumerate() {
            for ((chunk, direct), room) in out.chunks_mut(LANES).zip(&self.direct_sum).zip(&self.room_sum) {
                let (d, r) = (&direct.ears[ear], &room.ears[ear]);
                for (i, x) in chunk.iter_mut().enumerate() {
                    *x = Complex32::new(d.re[i] + room_gain * r.re[i], d.im[i] + room_gain * r.im[i]);
                }
            }
        }
        self.frame = self.frame.wrapping_add(1);
        Some(())
    }

    /// Hops by which the late part starts before the hop after the last tap.
    fn late_lead(&self) -> usize {
        (LATE_HOPS - 1).min(self.shape.taps)
    }

    pub(crate) fn reset(&mut self) {
        self.input.fill(Block::default());
        self.tail.fill(Block::default());
        self.network.reset();
        self.dead_frames = usize::MAX / 2;
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let ear_blocks = self.tap_carriers.len()
            + self.late_carriers.len()
            + self.taps.len()
            + self.late.len()
            + self.direct.len()
            + self.direct_sum.len()
            + self.room_sum.len();
        ear_blocks * size_of::<EarBlocks>()
            + (self.input.len() + self.tail.len()) * size_of::<Block>()
            + self.network.memory_bytes()
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "a count of hops below a few thousand")]
fn i32_of(hops: usize) -> i32 {
    hops as i32
}
