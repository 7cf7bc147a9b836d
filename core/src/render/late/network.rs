//! The late part: an exponential tail that feeds itself, on short-time spectra.

use crate::number::{exponent, single};
use crate::render::carrier::noise::smooth_phases;
use crate::render::transform::lanes::{Block, LANES, blocks_for, part, put};
use crate::render::transform::ring::{Slot, SlotMut};
use crate::{StftGrid, TailModel};
use glam::{Quat, Vec2, Vec3};
use promenade_fourier::num_complex::{Complex32, Complex64};
use pulp::{Arch, Simd, WithSimd};

/// Hops of noise that the late part is coloured with.
pub(crate) const LATE_HOPS: usize = 8;
/// Delays of the diffusers, hops.
const DIFFUSERS: [usize; 3] = [1, 3, 5];
/// Allpass gain of each diffuser.
const DIFFUSION: f32 = 0.7;
/// Delays of the feedback network's lines, hops: mutually prime, 60 in all, hence a mode every 3 Hz at hops of 5 ms.
const LINES: [usize; 4] = [11, 13, 17, 19];
/// Level at which the diffused input is heard besides the lines, so that the energy starts as it goes on.
const HEARD_INPUT: f32 = 0.95;
/// Energy per hop that the lossless network puts out for a unit impulse, over [`LATE_HOPS`] hops of noise (measured: see the
/// test).
const STEADY_ENERGY: f32 = 0.464;
/// The most by which noise that begins earlier is louder than the late part is stated to be: 30 dB, which is what a room with a
/// reverberation time of 70 ms falls by in seven hops of 5 ms. Bands of drier rooms begin softer than they would decay.
const LOUDEST_LEAD: f64 = 31.622_776_601_683_793;
/// Below this magnitude (-240 dB) the tail counts as silence.
const SILENCE: f32 = 1e-12;

/// Feedback delay network (Jot and Chaigne 1991) whose delays are whole hops, run per bin.
///
/// Three allpass diffusers (Schroeder 1962) feed four lines that a Hadamard matrix couples. Every delay of `m` hops is followed
/// by the band's decay over `m` hops, so the tail is exactly exponential, and by a phase that varies slowly from bin to bin, so
/// that bands do not repeat one pattern. Decay and phase change so slowly over bins that frames stay compact: the network is
/// time-invariant to the ear, and tones that pass through it stay tones.
///
/// Three sums of the lines are the late field at the head: its middle, the same at both ears, and what grows from the right ear
/// to the left, along both of the world's horizontal axes, as pressure and velocity are in Ambisonics of first order. Half a
/// turn of the head exchanges the ears. The ears' coherence decides how loud the middle is. The middle and what differs are a
/// quarter of a period apart, so that both ears are as loud whatever the sums have in common, as while few lines sound.
pub(crate) struct Late {
    arch: Arch,
    diffusers: [DelayLine; 3],
    lines: [DelayLine; 4],
    /// Of each bin, how loud the middle is, and what differs.
    shares: [Vec<[f32; LANES]>; 2],
    silent_frames: usize,
}

/// A ring of spectra `[block][slot]` with what a pass through it does to each bin.
struct DelayLine {
    hops: usize,
    /// As the scene has it, and with the user's decay.
    stated: Vec<Block>,
    gain: Vec<Block>,
    ring: Vec<Block>,
    now: usize,
}

impl DelayLine {
    fn new(hops: usize, gain: &[Complex32]) -> Self {
        let blocks = blocks_for(gain.len());
        let mut packed = vec![Block::default(); blocks];
        SlotMut::of(&mut packed).write(gain);
        Self { hops, stated: packed.clone(), gain: packed, ring: vec![Block::default(); blocks * hops], now: 0 }
    }

    /// Takes by how much more than stated is left after one hop, per bin.
    fn decay_by(&mut self, ratio: &[f32]) {
        for ((gain, stated), ratio) in self.gain.iter_mut().zip(&self.stated).zip(ratio.as_chunks::<LANES>().0) {
            for (i, ratio) in ratio.iter().enumerate() {
                let all = ratio.powi(exponent(self.hops));
                gain.re[i] = all * stated.re[i];
                gain.im[i] = all * stated.im[i];
            }
        }
    }

    /// What a pass through it does to a block, and the block's slot that comes out now, for what goes in.
    #[inline(always)]
    fn at(&mut self, block: usize) -> (&Block, &mut Block) {
        (&self.gain[block], &mut self.ring[block * self.hops + self.now])
    }

    /// Moves on by a hop.
    fn step(&mut self) {
        self.now = if self.now + 1 == self.hops { 0 } else { self.now + 1 };
    }

    fn memory_bytes(&self) -> usize {
        (self.stated.len() + self.gain.len() + self.ring.len()) * size_of::<Block>()
    }
}

impl Late {
    /// Prepares the network for a host grid; `hop_decay` is the amplitude left after one hop per bin. In single precision it
    /// would be off by a thousandth of the decay of a room that rings for minutes. `coherence` is that of the ears, per bin.
    pub(crate) fn new(grid: &StftGrid, scene_grid: &StftGrid, tail: &TailModel, hop_decay: &[f64], coherence: &[f32]) -> Self {
        let share = |sign: f32| {
            let of =
                |block: &[f32]| std::array::from_fn(|i| block.get(i).map_or(0.0, |c| (0.5 + 0.5 * sign * c).max(0.0).sqrt()));
            coherence.chunks(LANES).map(of).collect()
        };
        let mut stream = 16;
        let mut line = |hops: usize, turning: bool| {
            stream += 1;
            let phases = smooth_phases(grid, scene_grid, tail.seed, stream);
            let gain: Vec<_> = hop_decay
                .iter()
                .zip(phases)
                .map(|(r, turn)| {
                    let decay = r.powi(exponent(hops));
                    let turn = if turning { Complex64::new(turn.re.into(), turn.im.into()) } else { Complex64::from(1.0) };
                    let gain = turn * (decay / turn.norm());
                    Complex32::new(single(gain.re), single(gain.im))
                })
                .collect();
            DelayLine::new(hops, &gain)
        };
        Self {
            arch: Arch::new(),
            diffusers: DIFFUSERS.map(|m| line(m, false)),
            lines: LINES.map(|m| line(m, true)),
            shares: [share(1.0), share(-1.0)],
            silent_frames: usize::MAX / 2,
        }
    }

    /// Takes by how much more than at first is left after one hop, per bin, in whole blocks.
    pub(crate) fn decay_by(&mut self, ratio: &[f32]) {
        self.diffusers.iter_mut().chain(&mut self.lines).for_each(|line| line.decay_by(ratio));
    }

    /// Amplitude by which carriers are scaled so that the late part's energy per hop is that of its gain.
    pub(crate) fn carrier_gain() -> f32 {
        1.0 / STEADY_ENERGY.sqrt()
    }

    /// Takes one frame in and puts one out for each ear of a head whose left ear is toward `left`, a horizontal direction of
    /// unit length.
    pub(crate) fn advance(&mut self, input: Slot<'_>, left: Vec2, outputs: [SlotMut<'_>; 2]) {
        let arch = self.arch;
        let peak = arch.dispatch(Advance { late: self, input, left, outputs });
        self.diffusers.iter_mut().chain(&mut self.lines).for_each(DelayLine::step);
        self.silent_frames = if peak < SILENCE { self.silent_frames.saturating_add(1) } else { 0 };
    }

    /// Whether nothing is left in the network.
    pub(crate) fn is_silent(&self) -> bool {
        self.silent_frames > LINES[3]
    }

    pub(crate) fn reset(&mut self) {
        let lines = self.diffusers.iter_mut().chain(&mut self.lines);
        for line in lines {
            line.ring.fill(Block::default());
            line.now = 0;
        }
        self.silent_frames = usize::MAX / 2;
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let lines = self.diffusers.iter().chain(&self.lines).map(DelayLine::memory_bytes);
        lines.sum::<usize>() + self.shares.iter().map(|share| size_of_val(&**share)).sum::<usize>()
    }
}

struct Advance<'a> {
    late: &'a mut Late,
    input: Slot<'a>,
    left: Vec2,
    outputs: [SlotMut<'a>; 2],
}

impl WithSimd for Advance<'_> {
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f32 {
        let Self { late: Late { diffusers, lines, shares, .. }, input, left: Vec2 { x, y }, outputs: [left, right] } = self;
        let zero = simd.splat_f32s(0.0);
        let mut peak = zero;
        // What the last two diffusers keep is as loud as what the last one passes on.
        let [passed, kept_gain] = [1.0, (1.0 - DIFFUSION * DIFFUSION).sqrt()].map(|gain| simd.splat_f32s(HEARD_INPUT * gain));
        let along = [[-x, -y], [x, y]].map(|along| along.map(|along| simd.splat_f32s(along)));
        let outputs = left.blocks().zip(right.blocks());
        for (block, (input, (left, right))) in input.blocks().zip(outputs).enumerate() {
            let mut diffusers = diffusers.each_mut().map(|line| line.at(block));
            let mut lines = lines.each_mut().map(|line| line.at(block));
            for v in 0..LANES / S::F32_LANES {
                let mut x = [part::<S>(&input.re, v), part::<S>(&input.im, v)];
                let mut kept = [x; 3];
                for ((gain, slot), kept) in diffusers.iter_mut().zip(&mut kept) {
                    let decay = part::<S>(&gain.re, v);
                    for ((x, kept), slot) in x.iter_mut().zip(kept).zip([&mut slot.re, &mut slot.im]) {
                        let delayed = simd.mul_f32s(decay, part::<S>(slot, v));
                        let fed = simd.mul_add_e_f32s(simd.splat_f32s(DIFFUSION), delayed, *x);
                        let fed = audible(simd, fed, &mut peak);
                        put::<S>(slot, v, fed);
                        *x = simd.mul_add_e_f32s(simd.splat_f32s(-DIFFUSION), fed, delayed);
                        *kept = fed;
                    }
                }
                let mut delayed = [[zero; 4]; 2];
                for (line, (gain, slot)) in lines.iter().enumerate() {
                    let (cos, sin) = (part::<S>(&gain.re, v), part::<S>(&gain.im, v));
                    let (re, im) = (part::<S>(&slot.re, v), part::<S>(&slot.im, v));
                    delayed[0][line] = simd.sub_f32s(simd.mul_f32s(cos, re), simd.mul_f32s(sin, im));
                    delayed[1][line] = simd.mul_add_e_f32s(cos, im, simd.mul_f32s(sin, re));
                }
                let coupled = [hadamard(simd, delayed[0]), hadamard(simd, delayed[1])];
                let half = simd.splat_f32s(0.5);
                for (line, (_, slot)) in lines.iter_mut().enumerate() {
                    for (part, slot) in [&mut slot.re, &mut slot.im].into_iter().enumerate() {
                        let fed = simd.mul_f32s(half, simd.add_f32s(x[part], coupled[part][line]));
                        put::<S>(slot, v, audible(simd, fed, &mut peak));
                    }
                }
                // The lines are fed by the matrix's first row and heard by the others. Heard by the first, every way through
                // them would add in phase with its own reverse, and the tail would grow by 3 dB once such ways are many:
                // coherent backscattering (Weaver and Lobkis 2000).
                let [middle, apart] = [part::<S>(&shares[0][block], v), part::<S>(&shares[1][block], v)];
                let ears = [&mut left.re, &mut left.im].into_iter().zip([&mut right.re, &mut right.im]);
                for (i, (left, right)) in ears.enumerate() {
                    let first = simd.mul_add_e_f32s(passed, x[i], coupled[i][1]);
                    let mut differs = zero;
                    for axis in 0..2 {
                        let other = simd.mul_add_e_f32s(kept_gain, kept[2 - axis][1 - i], coupled[1 - i][2 + axis]);
                        differs = simd.mul_add_e_f32s(along[i][axis], other, differs);
                    }
                    let (first, differs) = (simd.mul_f32s(middle, first), simd.mul_f32s(apart, differs));
                    put::<S>(left, v, simd.add_f32s(first, differs));
                    put::<S>(right, v, simd.sub_f32s(first, differs));
                }
            }
        }
        simd.reduce_max_f32s(peak)
    }
}

/// A value, or zero where it is too faint to be heard: each bin falls silent by itself, long before it turns subnormal. Takes
/// the value's magnitude into a peak.
#[inline(always)]
fn audible<S: Simd>(simd: S, value: S::f32s, peak: &mut S::f32s) -> S::f32s {
    let magnitude = simd.abs_f32s(value);
    let heard = simd.greater_than_or_equal_f32s(magnitude, simd.splat_f32s(SILENCE));
    *peak = simd.max_f32s(*peak, magnitude);
    simd.select_f32s(heard, value, simd.splat_f32s(0.0))
}

/// The Hadamard matrix of order 4 without its factor of 1/2.
#[inline(always)]
fn hadamard<S: Simd>(simd: S, [a, b, c, d]: [S::f32s; 4]) -> [S::f32s; 4] {
    let [sum, difference] = [S::add_f32s, S::sub_f32s];
    let (ab, a_b, cd, c_d) = (sum(simd, a, b), difference(simd, a, b), sum(simd, c, d), difference(simd, c, d));
    [sum(simd, ab, cd), sum(simd, a_b, c_d), difference(simd, ab, cd), difference(simd, a_b, c_d)]
}

/// The horizontal direction of the left ear of a head that is turned; `before` where it is above or below the head.
pub(crate) fn left_ear(orientation: Quat, before: Vec2) -> Vec2 {
    (orientation * Vec3::Y).truncate().try_normalize().unwrap_or(before)
}

/// Hops by which the late part starts before the hop after the last tap.
pub(crate) fn late_lead(taps: usize) -> usize {
    (LATE_HOPS - 1).min(taps)
}

/// Share of the late part's noise that has begun by a hop after the direct sound, 0 to 1, in a scene of so many taps.
#[must_use]
pub fn late_share(hop: usize, taps: usize) -> f64 {
    let begun = (hop + late_lead(taps)).saturating_sub(taps).min(LATE_HOPS);
    begun as f64 / LATE_HOPS as f64
}

/// Amplitude of a late hop's noise over that which is stated for the hop after the last tap; `decay` is what a room leaves
/// after a hop, and the user's decay leaves `ratio` times as much.
///
/// What begins before that hop is louder by as much as it decays until then, but in the room by no more than [`LOUDEST_LEAD`]:
/// one that falls within a hop would begin with any level whatever.
pub(crate) fn late_gain(decay: f64, ratio: f64, hop: usize, taps: usize) -> f64 {
    let hops = exponent(hop) - exponent(late_lead(taps));
    decay.powi(hops).min(LOUDEST_LEAD) * ratio.powi(hops)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_band_falls_silent_without_subnormal_numbers() {
        let grid = StftGrid { sample_rate_hz: 48_000.0, n_fft: 960, hop: 240 };
        let tail = TailModel { seed: 1, t60_s: vec![1.0; 2], coherence: vec![0.0; 2], by_phase: false };
        let bins = grid.bins();
        // The upper bins die within a few hops, the lower ones linger.
        let decay: Vec<f64> = (0..bins).map(|k| if k < 100 { 0.97 } else { 0.1 }).collect();
        let mut late = Late::new(&grid, &grid, &tail, &decay, &vec![0.3; bins]);
        let mut input = vec![Block::default(); blocks_for(bins)];
        SlotMut::of(&mut input).write(&vec![1.0.into(); bins]);
        let [mut out, mut right] = [input.clone(), input.clone()];
        for frame in 0..3_000 {
            late.advance(Slot::of(&input), Vec2::Y, [&mut out, &mut right].map(|ear| SlotMut::of(ear)));
            input.fill(Block::default());
            let rings = late.diffusers.iter().chain(&late.lines).flat_map(|l| &l.ring);
            assert!(rings.flat_map(|b| b.re.iter().chain(&b.im)).all(|v| !v.is_subnormal()), "frame {frame}");
        }
        assert!(late.is_silent() && out.iter().chain(&right).all(|b| *b == Block::default()));
    }

    #[test]
    fn rooms_decay_at_the_stated_rate_however_long_they_ring() {
        let grid = StftGrid { sample_rate_hz: 48_000.0, n_fft: 960, hop: 240 };
        for t60_s in [0.01, 1.0, 30.0, 1000.0_f64] {
            let tail = TailModel { seed: 1, t60_s: vec![single(t60_s); 2], coherence: vec![0.0; 2], by_phase: false };
            let decay = vec![10.0_f64.powf(-3.0 * grid.hop_s() / t60_s); grid.bins()];
            let late = Late::new(&grid, &grid, &tail, &decay, &vec![0.0; grid.bins()]);
            for line in late.diffusers.iter().chain(&late.lines) {
                let nepers = -3.0 * std::f64::consts::LN_10 * grid.hop_s() / t60_s * line.hops as f64;
                for k in 0..grid.bins() {
                    let (re, im) = (line.gain[k / LANES].re[k % LANES], line.gain[k / LANES].im[k % LANES]);
                    let found = f64::from(re).hypot(f64::from(im)).ln();
                    // What is left is the rounding of the gain itself, which two hops of the longest room show most.
                    let most = 1e-4_f64.max(1e-7 / nepers.abs());
                    assert!((found / nepers - 1.0).abs() < most, "{t60_s} s, {} hops: {found} for {nepers}", line.hops);
                }
            }
        }
    }

    #[test]
    fn a_lossless_network_keeps_its_energy_and_the_stated_level() {
        let grid = StftGrid { sample_rate_hz: 48_000.0, n_fft: 960, hop: 240 };
        let tail = TailModel { seed: 1, t60_s: vec![1.0; 2], coherence: vec![0.0; 2], by_phase: false };
        let bins = grid.bins();
        let mut late = Late::new(&grid, &grid, &tail, &vec![1.0; bins], &vec![0.0; bins]);
        let blocks = blocks_for(bins);
        let mut input = vec![Block::default(); blocks];
        SlotMut::of(&mut input).write(&vec![1.0.into(); bins]);
        let mut out = [(); 2].map(|()| vec![Block::default(); blocks]);
        let mut energies = [(); 2].map(|()| Vec::new());
        for _ in 0..400 {
            let [left, right] = &mut out;
            late.advance(Slot::of(&input), Vec2::Y, [left, right].map(|ear| SlotMut::of(ear)));
            input.fill(Block::default());
            for (energies, out) in energies.iter_mut().zip(&out) {
                let energy: f32 =
                    (0..bins).map(|k| out[k / LANES].re[k % LANES].powi(2) + out[k / LANES].im[k % LANES].powi(2)).sum();
                energies.push(energy / bins as f32);
            }
        }
        for energies in energies {
            let over = |from: usize| energies[from..from + LATE_HOPS].iter().sum::<f32>();
            for from in 0..380 {
                let db = 10.0 * (over(from) / STEADY_ENERGY).log10();
                assert!(db.abs() < 2.0, "hops {from} on: {db:.1} dB");
            }
            let late_mean = energies[100..400].iter().sum::<f32>() / 300.0 * LATE_HOPS as f32;
            assert!((late_mean / STEADY_ENERGY - 1.0).abs() < 0.1, "{late_mean}");
        }
        late.reset();
        assert!(late.is_silent());
    }

    /// Both ears' frames of the answer to an impulse.
    fn heard(coherence: f32, decay: f64, left: Vec2) -> [Vec<Block>; 2] {
        let grid = StftGrid { sample_rate_hz: 48_000.0, n_fft: 960, hop: 240 };
        let tail = TailModel { seed: 1, t60_s: vec![1.0; 2], coherence: vec![0.0; 2], by_phase: false };
        let bins = grid.bins();
        let mut late = Late::new(&grid, &grid, &tail, &vec![decay; bins], &vec![coherence; bins]);
        let mut input = vec![Block::default(); blocks_for(bins)];
        SlotMut::of(&mut input).write(&vec![1.0.into(); bins]);
        let mut ears = [(); 2].map(|()| vec![Block::default(); blocks_for(bins)]);
        let mut frames = [Vec::new(), Vec::new()];
        for _ in 0..150 {
            let [l, r] = &mut ears;
            late.advance(Slot::of(&input), left, [SlotMut::of(l), SlotMut::of(r)]);
            input.fill(Block::default());
            frames.iter_mut().zip(&ears).for_each(|(frames, ear)| frames.extend_from_slice(ear));
        }
        frames
    }

    /// The correlation of two signals of complex spectra.
    fn correlation(a: &[Block], b: &[Block]) -> f32 {
        let product = |a: &[Block], b: &[Block]| -> f32 {
            a.iter().zip(b).map(|(a, b)| (0..LANES).map(|i| a.re[i] * b.re[i] + a.im[i] * b.im[i]).sum::<f32>()).sum()
        };
        product(a, b) / (product(a, a) * product(b, b)).sqrt()
    }

    #[test]
    fn the_three_sums_have_little_in_common() {
        let [[middle, _], [along, _], [across, _]] =
            [(1.0, Vec2::Y), (-1.0, Vec2::X), (-1.0, Vec2::Y)].map(|(coherence, left)| heard(coherence, 0.98, left));
        for (a, b) in [(&middle, &along), (&middle, &across), (&along, &across)] {
            let quarter = a.len() / 4;
            for part in [0..quarter, quarter..a.len()] {
                let found = correlation(&a[part.clone()], &b[part]);
                println!("{found}");
                assert!(found.abs() < 0.2, "{found}");
            }
        }
    }

    #[test]
    fn ears_have_as_much_in_common_as_is_stated() {
        for coherence in [-0.5, 0.0, 0.3, 0.9_f32] {
            for left in [Vec2::Y, Vec2::X, Vec2::new(-0.6, 0.8)] {
                let [l, r] = heard(coherence, 0.98, left);
                let found = correlation(&l, &r);
                println!("{found} at {coherence}, {left}");
                assert!((found - coherence).abs() < 0.1, "{found} at {coherence}, {left}");
            }
        }
    }

    #[test]
    fn the_late_field_stays_where_it_is_when_the_head_turns() {
        let [ahead, turned, about] = [Vec2::Y, Vec2::X, -Vec2::Y].map(|left| heard(0.0, 0.98, left));
        // Half a turn exchanges the ears; a quarter shares the middle with both.
        assert_eq!([&ahead[0], &ahead[1]], [&about[1], &about[0]]);
        let found = correlation(&ahead[0], &turned[0]);
        assert!((found - 0.5).abs() < 0.1, "{found}");
    }
}
