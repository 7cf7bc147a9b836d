//! One image source as it sounds.

use super::delay_line::{DelayLine, aligned};
use super::spline::{BEFORE, POINTS, interpolate, interpolate_one};
use super::wall::Weights;
use crate::number::{single, whole};
use crate::render::head::ambisonic::Channels;
use crate::render::head::bus::Bus;
use crate::simd::{LANE, LANES};
use pulp::{Simd, WithSimd};

/// A delay that changes faster than this, samples per sample, is a jump: 85 m/s.
const FASTEST: f64 = 0.25;
/// Up to this change over [`LANES`] samples, 5 m/s, a vector's samples are all interpolated from the same six.
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
    /// This state at a gain of zero.
    fn silent(self) -> Self {
        Self { gain: 0.0, ..self }
    }
}

/// Plays one image over a hop, from one moment to the next.
pub(crate) struct Voice<'a> {
    pub(crate) line: &'a DelayLine,
    /// Samples of the hop that are in it: all, or none.
    pub(crate) newest: usize,
    pub(crate) weights: &'a Weights,
    pub(crate) from: Moment,
    pub(crate) to: Moment,
    /// Room for [`scratch_len`] samples.
    pub(crate) scratch: &'a mut [f32],
    pub(crate) bus: &'a mut Bus,
}

/// Samples that a hop's stretch of the line may take.
pub(crate) fn scratch_len(hop: usize) -> usize {
    whole(hop.next_multiple_of(LANES) as f64 * (1.0 + FASTEST)) + POINTS + 5 * LANES
}

impl WithSimd for Voice<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { line, newest, weights, from, to, scratch, bus } = self;
        let jumps = (to.delay - from.delay).abs() > FASTEST * bus.hop() as f64;
        // After a jump the old place fades out while the new one fades in.
        let ways = if jumps { [(from, from.silent()), (to.silent(), to)] } else { [(from, to), (to, to)] };
        for (from, to) in &ways[..if jumps { 2 } else { 1 }] {
            let hop = bus.hop();
            play(simd, (line, newest), weights, (from, to), hop, scratch, bus.row(&from.direction, &to.direction));
            bus.add(simd);
        }
    }
}

/// Writes the sound of one image that goes from a moment to another in `hop` samples.
#[inline(always)]
fn play<S: Simd>(
    simd: S,
    (line, newest): (&DelayLine, usize),
    weights: &Weights,
    (from, to): (&Moment, &Moment),
    hop: usize,
    scratch: &mut [f32],
    out: &mut [[f32; LANES]],
) {
    let lanes = S::F32_LANES;
    let slope = (to.delay - from.delay) / hop as f64;
    // Places in the stretch of the line that the hop needs.
    let first = -from.delay - slope;
    let step = 1.0 - slope;
    let back = whole((-first).ceil()) + BEFORE;
    let mut at = first + back as f64;
    let needed = (whole(at + step * (out.len() * LANES) as f64) + POINTS).next_multiple_of(LANES) + LANES;
    let origin = aligned(scratch);
    let stretch = &mut scratch[origin..][..needed];
    at += line.mix(simd, weights, back, newest, stretch) as f64;
    let ramp = (to.gain - from.gain) / hop as f32;
    let mut gain = from.gain + ramp;
    let lane = S::as_simd_f32s(&LANE).0[0];
    let ramps = simd.mul_f32s(simd.splat_f32s(ramp), lane);
    let gains = |gain: f32| simd.add_f32s(simd.splat_f32s(gain), ramps);
    let parts = S::as_mut_simd_f32s(out.as_flattened_mut()).0;
    if slope.abs() < SLOW {
        let glides = simd.mul_f32s(simd.splat_f32s(single(slope)), lane);
        let mut start = whole(at);
        let mut place = single(at - start as f64);
        for part in parts {
            let places = simd.sub_f32s(simd.splat_f32s(place), glides);
            let values = interpolate(simd, &stretch[start - BEFORE..][..lanes + POINTS], places);
            *part = simd.mul_f32s(values, gains(gain));
            gain += ramp * lanes as f32;
            place -= single(slope) * lanes as f32;
            start += lanes;
            // The next six begin a sample earlier or later.
            if place < 0.0 {
                (place, start) = (place + 1.0, start - 1);
            } else if place >= 1.0 {
                (place, start) = (place - 1.0, start + 1);
            }
        }
        return;
    }
    for part in parts {
        let mut each = [0.0; LANES];
        for (i, value) in each.iter_mut().enumerate().take(lanes) {
            *value = interpolate_one(stretch, at + step * i as f64);
        }
        *part = simd.mul_f32s(S::as_simd_f32s(&each).0[0], gains(gain));
        gain += ramp * lanes as f32;
        at += step * lanes as f64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::early::images::wall::{BASES, WallFilters};
    use crate::scene::AMBISONIC_CHANNELS;
    use crate::simd::tests::arches;
    use promenade_fourier::num_complex::Complex32;

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
            let (mut bus, mut scratch) = (Bus::new(HOP, AMBISONIC_CHANNELS / 2), vec![0.0; scratch_len(HOP)]);
            let direction: Channels = std::array::from_fn(|c| c as f32);
            let moment = |delay| Moment { delay, gain: 1.0, direction };
            let mut weights = [0.0; BASES];
            weights[0] = 1.0;
            let voice = Voice {
                line: &line,
                newest: HOP,
                weights: &weights,
                from: moment(from),
                to: moment(to),
                scratch: &mut scratch,
                bus: &mut bus,
            };
            arch.dispatch(voice);
            bus.finish(arch);
            for c in 0..AMBISONIC_CHANNELS {
                let mut pair = vec![Complex32::default(); HOP];
                bus.read(c / 2, &mut pair);
                for (n, s) in pair.iter().map(|s| if c % 2 == 0 { s.re } else { s.im }).enumerate() {
                    let delay = from + (to - from) * (n + 1) as f64 / HOP as f64;
                    let want = tone(((hops - 1) * HOP + n - DelayLine::LAG) as f64 - delay);
                    found = found.max((f64::from(s) - c as f64 * want).abs() / (c as f64).max(1.0));
                }
            }
        }
        found
    }

    #[test]
    fn delays_stand_and_glide_as_stated() {
        for (from, to) in [(300.25, 300.25), (500.5, 498.0), (77.3, 79.1), (400.0, 440.0), (640.0, 590.5), (3.0, 3.0)] {
            let [low, middle, high] = [1_000.0, 8_000.0, 14_000.0].map(|hz| worst(hz, from, to));
            let found = format!("{from} to {to}: {low} at 1 kHz, {middle} at 8 kHz, {high} at 14 kHz");
            assert!(low < 2e-4 && middle < 2e-3 && high < 2e-2, "{found}");
        }
    }
}
