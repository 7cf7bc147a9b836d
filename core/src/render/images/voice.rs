//! One image source as it sounds.

use super::delay_line::DelayLine;
use super::wall::Weights;
use crate::number::{single, whole};
use crate::render::ambisonic::Channels;
use crate::scene::AMBISONIC_CHANNELS;
use crate::simd::LANES;
use pulp::{Simd, WithSimd};

/// Samples that the interpolation reaches before and after its place.
pub(crate) const BEFORE: usize = 2;
pub(crate) const AFTER: usize = 3;
const POINTS: usize = BEFORE + 1 + AFTER;
/// A delay that changes faster than this, samples per sample, is a jump: 85 m/s.
const FASTEST: f64 = 0.25;
/// Up to this change over [`LANES`] samples, 5 m/s, the weights of the interpolation glide in a straight line.
const SLOW: f64 = 0.25 / LANES as f64;

/// Where an image is heard at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moment {
    /// Delay in the line, samples.
    pub(crate) delay: f64,
    /// Amplitude, linear.
    pub(crate) gain: f32,
    /// Spherical harmonics of its direction.
    pub(crate) direction: Channels,
}

impl Moment {
    /// The same, unheard.
    fn silent(self) -> Self {
        Self { gain: 0.0, ..self }
    }
}

/// Samples of all channels that are worked on at a time, `[channel][sample]`.
type Chunk = [[f32; LANES]; AMBISONIC_CHANNELS];

/// A hop of all Ambisonic channels.
pub(crate) struct Bus {
    hop: usize,
    chunks: Vec<Chunk>,
}

impl Bus {
    pub(crate) fn new(hop: usize) -> Self {
        Self { hop, chunks: vec![[[0.0; LANES]; AMBISONIC_CHANNELS]; hop.div_ceil(LANES)] }
    }

    pub(crate) fn clear(&mut self) {
        self.chunks.fill([[0.0; LANES]; AMBISONIC_CHANNELS]);
    }

    /// Writes the hop of a channel.
    pub(crate) fn read(&self, channel: usize, out: &mut [f32]) {
        for (out, chunk) in out[..self.hop].chunks_mut(LANES).zip(&self.chunks) {
            out.copy_from_slice(&chunk[channel][..out.len()]);
        }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.chunks)
    }
}

/// Plays one image over a hop, from one moment to the next.
pub(crate) struct Voice<'a> {
    pub(crate) line: &'a DelayLine,
    pub(crate) weights: &'a Weights,
    pub(crate) from: Moment,
    pub(crate) to: Moment,
    /// Room for [`scratch_len`] samples.
    pub(crate) scratch: &'a mut [f32],
    pub(crate) bus: &'a mut Bus,
}

/// Samples that a hop's stretch of the line may take.
pub(crate) fn scratch_len(hop: usize) -> usize {
    whole(hop.next_multiple_of(LANES) as f64 * (1.0 + FASTEST)) + POINTS + 3 * LANES
}

impl WithSimd for Voice<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let Self { from, to, .. } = self;
        if (to.delay - from.delay).abs() > FASTEST * self.bus.hop as f64 {
            // A jump: the old place fades out while the new one fades in.
            self.play(simd, from, from.silent());
            self.play(simd, to.silent(), to);
        } else {
            self.play(simd, from, to);
        }
    }
}

impl Voice<'_> {
    #[inline(always)]
    fn play<S: Simd>(&mut self, simd: S, from: Moment, to: Moment) {
        let Self { line, weights, scratch, bus, .. } = self;
        let (hop, lanes) = (bus.hop, S::F32_LANES);
        let slope = (to.delay - from.delay) / hop as f64;
        // Places in the stretch of the line that the hop needs.
        let first = -from.delay - slope;
        let step = 1.0 - slope;
        let back = whole((-first).ceil()) + BEFORE;
        let mut at = first + back as f64;
        let needed = (whole(at + step * (bus.chunks.len() * LANES) as f64) + POINTS).next_multiple_of(LANES);
        let stretch = &mut scratch[..needed];
        line.mix(simd, weights, back, hop, stretch);
        let slow = slope.abs() < SLOW;
        let ramp = (to.gain - from.gain) / hop as f32;
        let lane: S::f32s = S::as_simd_f32s(&LANE).0[0];
        let mut n = 0;
        for chunk in &mut bus.chunks {
            // Directions turn by a small part of a degree from one chunk to the next.
            let along = ((n + LANES / 2) as f32 / hop as f32).min(1.0);
            let mut shares = from.direction;
            for (share, to) in shares.iter_mut().zip(&to.direction) {
                *share += along * (to - *share);
            }
            for part in 0..LANES / lanes {
                let start = whole(at);
                let fraction = single(at - start as f64);
                let mut values = simd.splat_f32s(0.0);
                if slow {
                    // Lagrange's polynomial through six samples, whose weights glide from those of the first place to those of the
                    // next part's.
                    let begin = coefficients(fraction);
                    let end = coefficients(fraction - single(slope) * lanes as f32);
                    let x = &stretch[start - BEFORE..][..lanes + POINTS];
                    for j in 0..POINTS {
                        let change = simd.splat_f32s((end[j] - begin[j]) / lanes as f32);
                        let weight = simd.mul_add_e_f32s(change, lane, simd.splat_f32s(begin[j]));
                        values = simd.mul_add_e_f32s(weight, S::as_simd_f32s(&x[j..j + lanes]).0[0], values);
                    }
                } else {
                    let mut each = [0.0; LANES];
                    for (i, value) in each.iter_mut().enumerate().take(lanes) {
                        *value = interpolate_one(stretch, at + step * i as f64);
                    }
                    values = S::as_simd_f32s(&each).0[0];
                }
                at += step * lanes as f64;
                let gain = simd.splat_f32s(from.gain + ramp * (n + 1) as f32);
                values = simd.mul_f32s(values, simd.mul_add_e_f32s(simd.splat_f32s(ramp), lane, gain));
                n += lanes;
                for c in 0..AMBISONIC_CHANNELS {
                    let sums = &mut S::as_mut_simd_f32s(&mut chunk[c]).0[part];
                    *sums = simd.mul_add_e_f32s(simd.splat_f32s(shares[c]), values, *sums);
                }
            }
        }
    }
}

/// Numbers of the lanes.
const LANE: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];

#[inline(always)]
fn interpolate_one(x: &[f32], at: f64) -> f32 {
    let start = whole(at);
    let c = coefficients(single(at - start as f64));
    x[start - BEFORE..].iter().zip(c).map(|(x, c)| x * c).sum()
}

/// Weights of the samples at -2 to 3 for a place near 0 to 1.
#[inline(always)]
fn coefficients(d: f32) -> [f32; POINTS] {
    let (a, b, c, e, f) = (d + 2.0, d + 1.0, d - 1.0, d - 2.0, d - 3.0);
    let (ab, ef) = (a * b, e * f);
    let (bd, dc) = (b * d, d * c);
    [
        bd * c * ef * (-1.0 / 120.0),
        a * dc * ef * (1.0 / 24.0),
        ab * c * ef * (-1.0 / 12.0),
        ab * d * ef * (1.0 / 12.0),
        ab * dc * f * (-1.0 / 24.0),
        ab * dc * e * (1.0 / 120.0),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::images::wall::{BASES, WallFilters};
    use crate::simd::tests::arches;

    const HOP: usize = 243;
    const RATE: f64 = 48_000.0;

    /// What a voice plays of a tone, against the tone at its delays.
    fn worst(hz: f64, from: f64, to: f64) -> f64 {
        let walls = WallFilters::new(RATE);
        let mut found = 0.0_f64;
        for arch in arches() {
            let mut line = DelayLine::new(&walls, 2000, HOP);
            let tone = |n: f64| (std::f64::consts::TAU * hz / RATE * n).sin();
            let hops = 12;
            for h in 0..hops {
                let samples: Vec<f32> = (0..HOP).map(|n| single(tone((h * HOP + n) as f64))).collect();
                line.write(&samples);
            }
            let (mut bus, mut scratch) = (Bus::new(HOP), vec![0.0; scratch_len(HOP)]);
            let direction: Channels = std::array::from_fn(|c| c as f32);
            let moment = |delay| Moment { delay, gain: 1.0, direction };
            let mut weights = [0.0; BASES];
            weights[0] = 1.0;
            let voice = Voice {
                line: &line,
                weights: &weights,
                from: moment(from),
                to: moment(to),
                scratch: &mut scratch,
                bus: &mut bus,
            };
            arch.dispatch(voice);
            for c in 0..AMBISONIC_CHANNELS {
                let mut channel = vec![0.0; HOP];
                bus.read(c, &mut channel);
                for (n, s) in channel.iter().enumerate() {
                    let delay = from + (to - from) * (n + 1) as f64 / HOP as f64;
                    let want = tone(((hops - 1) * HOP + n) as f64 - delay);
                    found = found.max((f64::from(*s) - c as f64 * want).abs() / (c as f64).max(1.0));
                }
            }
        }
        found
    }

    #[test]
    fn delays_stand_and_glide_as_stated() {
        for (from, to) in [(300.25, 300.25), (500.5, 498.0), (77.3, 79.1), (400.0, 440.0), (640.0, 590.5), (3.0, 3.0)] {
            // The polynomial's own error at 1 kHz is below 1e-6, at 8 kHz about 1e-2; at 4 m/s the glide of its weights adds 1e-4.
            let (low, high) = (worst(1_000.0, from, to), worst(8_000.0, from, to));
            assert!(low < 2e-4 && high < 2e-2, "{from} to {to}: {low} at 1 kHz, {high} at 8 kHz");
        }
    }
}
