//! The late part: an exponential tail that feeds itself, on short-time spectra.

use crate::number::{exponent, single};
use crate::render::carrier::smooth_phases;
use crate::render::lanes::{Block, LANES, blocks_for, write_slot};
use crate::{StftGrid, TailModel};
use promenade_fourier::num_complex::{Complex32, Complex64};
use pulp::{Arch, WithSimd};

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
pub(crate) struct Late {
    arch: Arch,
    diffusers: [DelayLine; 3],
    lines: [DelayLine; 4],
    silent_frames: usize,
}

/// A ring of spectra `[block][slot]` with what a pass through it does to each bin.
struct DelayLine {
    hops: usize,
    /// As the scene has it, and with the user's decay.
    stated: Vec<Block>,
    gain: Vec<Block>,
    ring: Vec<Block>,
}

impl DelayLine {
    fn new(hops: usize, gain: &[Complex32]) -> Self {
        let blocks = blocks_for(gain.len());
        let mut packed = vec![Block::default(); blocks];
        write_slot(&mut packed, 1, 0, gain);
        Self { hops, stated: packed.clone(), gain: packed, ring: vec![Block::default(); blocks * hops] }
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

    fn memory_bytes(&self) -> usize {
        (self.stated.len() + self.gain.len() + self.ring.len()) * size_of::<Block>()
    }
}

impl Late {
    /// Prepares the network for a host grid; `hop_decay` is the amplitude left after one hop per bin. In single precision it
    /// would be off by a thousandth of the decay of a room that rings for minutes.
    pub(crate) fn new(grid: &StftGrid, scene_grid: &StftGrid, tail: &TailModel, hop_decay: &[f64]) -> Self {
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

    /// Takes one frame in and puts one out, for frame number `frame`: `input[block]` at slot `from`, `output[block]` at slot
    /// `to`.
    pub(crate) fn advance(&mut self, frame: usize, input: Slot<'_>, output: SlotMut<'_>) {
        let arch = self.arch;
        let peak = arch.dispatch(Advance { late: self, frame, input, output });
        self.silent_frames = if peak == 0.0 { self.silent_frames.saturating_add(1) } else { 0 };
    }

    /// Whether nothing is left in the network.
    pub(crate) fn is_silent(&self) -> bool {
        self.silent_frames > LINES[3]
    }

    pub(crate) fn reset(&mut self) {
        let lines = self.diffusers.iter_mut().chain(&mut self.lines);
        lines.for_each(|l| l.ring.fill(Block::default()));
        self.silent_frames = usize::MAX / 2;
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        self.diffusers.iter().chain(&self.lines).map(DelayLine::memory_bytes).sum()
    }
}

/// One slot of a ring `[block][slot]`.
pub(crate) struct Slot<'a> {
    pub(crate) ring: &'a [Block],
    pub(crate) slots: usize,
    pub(crate) at: usize,
}

/// One slot of a ring `[block][slot]`, to write to.
pub(crate) struct SlotMut<'a> {
    pub(crate) ring: &'a mut [Block],
    pub(crate) slots: usize,
    pub(crate) at: usize,
}

struct Advance<'a> {
    late: &'a mut Late,
    frame: usize,
    input: Slot<'a>,
    output: SlotMut<'a>,
}

impl WithSimd for Advance<'_> {
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _simd: S) -> f32 {
        let Self { late, frame, input, output } = self;
        let mut peaks = [0.0_f32; LANES];
        let blocks = input.ring.chunks_exact(input.slots).zip(output.ring.chunks_exact_mut(output.slots));
        for (b, (input_row, output_row)) in blocks.enumerate() {
            let mut x = input_row[input.at];
            for line in &mut late.diffusers {
                let slot = &mut line.ring[b * line.hops + frame % line.hops];
                let decay = &line.gain[b].re;
                for i in 0..LANES {
                    let (re, im) = (decay[i] * slot.re[i], decay[i] * slot.im[i]);
                    slot.re[i] = audible(x.re[i] + DIFFUSION * re);
                    slot.im[i] = audible(x.im[i] + DIFFUSION * im);
                    x.re[i] = re - DIFFUSION * slot.re[i];
                    x.im[i] = im - DIFFUSION * slot.im[i];
                    peaks[i] = peaks[i].max(slot.re[i].abs()).max(slot.im[i].abs());
                }
            }
            let mut delayed = [Block::default(); 4];
            for (line, d) in late.lines.iter().zip(&mut delayed) {
                let (slot, gain) = (&line.ring[b * line.hops + frame % line.hops], &line.gain[b]);
                for i in 0..LANES {
                    d.re[i] = gain.re[i] * slot.re[i] - gain.im[i] * slot.im[i];
                    d.im[i] = gain.re[i] * slot.im[i] + gain.im[i] * slot.re[i];
                }
            }
            let out = &mut output_row[output.at];
            let [first, second, third, fourth] = &mut late.lines;
            let mut slots = [first, second, third, fourth].map(|line| &mut line.ring[b * line.hops + frame % line.hops]);
            for (i, peak) in peaks.iter_mut().enumerate() {
                let re = hadamard([delayed[0].re[i], delayed[1].re[i], delayed[2].re[i], delayed[3].re[i]]);
                let im = hadamard([delayed[0].im[i], delayed[1].im[i], delayed[2].im[i], delayed[3].im[i]]);
                for (line, slot) in slots.iter_mut().enumerate() {
                    slot.re[i] = audible(0.5 * (x.re[i] + re[line]));
                    slot.im[i] = audible(0.5 * (x.im[i] + im[line]));
                    *peak = peak.max(slot.re[i].abs()).max(slot.im[i].abs());
                }
                // The lines are fed by the matrix's first row and heard by its second. Heard by the first, every way through
                // them would add in phase with its own reverse, and the tail would grow by 3 dB once such ways are many:
                // coherent backscattering (Weaver and Lobkis 2000).
                out.re[i] = HEARD_INPUT * x.re[i] + re[1];
                out.im[i] = HEARD_INPUT * x.im[i] + im[1];
            }
        }
        peaks.iter().fold(0.0_f32, |a, b| a.max(*b))
    }
}

/// A value, or zero where it is too faint to be heard: each bin falls silent by itself, long before it turns subnormal.
#[inline(always)]
fn audible(value: f32) -> f32 {
    if value.abs() < SILENCE { 0.0 } else { value }
}

/// The Hadamard matrix of order 4 without its factor of 1/2.
#[inline(always)]
fn hadamard([a, b, c, d]: [f32; 4]) -> [f32; 4] {
    let (ab, a_b, cd, c_d) = (a + b, a - b, c + d, c - d);
    [ab + cd, a_b + c_d, ab - cd, a_b - c_d]
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
        let tail = TailModel { seed: 1, t60_s: vec![1.0; 2], coherence: vec![0.0; 2] };
        let bins = grid.bins();
        // The upper bins die within a few hops, the lower ones linger.
        let decay: Vec<f64> = (0..bins).map(|k| if k < 100 { 0.97 } else { 0.1 }).collect();
        let mut late = Late::new(&grid, &grid, &tail, &decay);
        let mut input = vec![Block::default(); blocks_for(bins)];
        write_slot(&mut input, 1, 0, &vec![1.0.into(); bins]);
        let mut out = input.clone();
        for frame in 0..3_000 {
            late.advance(frame, Slot { ring: &input, slots: 1, at: 0 }, SlotMut { ring: &mut out, slots: 1, at: 0 });
            input.fill(Block::default());
            let rings = late.diffusers.iter().chain(&late.lines).flat_map(|l| &l.ring);
            assert!(rings.flat_map(|b| b.re.iter().chain(&b.im)).all(|v| !v.is_subnormal()), "frame {frame}");
        }
        assert!(late.is_silent() && out.iter().all(|b| *b == Block::default()));
    }

    #[test]
    fn rooms_decay_at_the_stated_rate_however_long_they_ring() {
        let grid = StftGrid { sample_rate_hz: 48_000.0, n_fft: 960, hop: 240 };
        for t60_s in [0.01, 1.0, 30.0, 1000.0_f64] {
            let tail = TailModel { seed: 1, t60_s: vec![single(t60_s); 2], coherence: vec![0.0; 2] };
            let late = Late::new(&grid, &grid, &tail, &vec![10.0_f64.powf(-3.0 * grid.hop_s() / t60_s); grid.bins()]);
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
        let tail = TailModel { seed: 1, t60_s: vec![1.0; 2], coherence: vec![0.0; 2] };
        let bins = grid.bins();
        let mut late = Late::new(&grid, &grid, &tail, &vec![1.0; bins]);
        let blocks = blocks_for(bins);
        let mut input = vec![Block::default(); blocks];
        write_slot(&mut input, 1, 0, &vec![1.0.into(); bins]);
        let mut out = vec![Block::default(); blocks];
        let mut energies = Vec::new();
        for frame in 0..400 {
            let x = Slot { ring: &input, slots: 1, at: 0 };
            late.advance(frame, x, SlotMut { ring: &mut out, slots: 1, at: 0 });
            input.fill(Block::default());
            let energy: f32 =
                (0..bins).map(|k| out[k / LANES].re[k % LANES].powi(2) + out[k / LANES].im[k % LANES].powi(2)).sum();
            energies.push(energy / bins as f32);
        }
        let over = |from: usize| energies[from..from + LATE_HOPS].iter().sum::<f32>();
        for from in 0..380 {
            let db = 10.0 * (over(from) / STEADY_ENERGY).log10();
            assert!(db.abs() < 1.5, "hops {from} on: {db:.1} dB");
        }
        let late_mean = energies[100..400].iter().sum::<f32>() / 300.0 * LATE_HOPS as f32;
        assert!((late_mean / STEADY_ENERGY - 1.0).abs() < 0.1, "{late_mean}");
        late.reset();
        assert!(late.is_silent());
    }
}
