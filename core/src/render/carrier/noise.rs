//! Fixed pseudo-random spectra that carry the time filters.

use crate::bands::{BandPlace, Bands};
use crate::number::{single, whole, whole_signed};
use crate::random::{Random, mix};
use crate::render::carrier::decorrelated::Decorrelated;
use crate::{StftGrid, TailModel};
use promenade_fourier::num_complex::Complex32;
use promenade_fourier::{ComplexToReal, RealToComplex, spectrum};
use std::ops::{Add, Mul, Sub};
use std::sync::Arc;

/// Bins from one random angle of [`smooth_phases`] to the next.
const PHASE_BINS: usize = 10;
/// Turns of setting levels and cutting to length.
const LEVEL_ROUNDS: usize = 8;
/// Samples of the host that a fractional delay reaches to either side.
const DELAY_REACH: i64 = 6;

/// Numbers of the sets of carriers of the taps and of the late part.
pub(crate) const TAP_SET: u64 = 0;
/// See [`TAP_SET`].
pub(crate) const LATE_SET: u64 = 1;

/// Spectra of both ears for one hop of a room's response.
pub(crate) type EarSpectra = [Vec<Complex32>; 2];

/// Where every bin of a host grid lies among a scene's bands.
pub(crate) fn band_places(grid: &StftGrid, bands: &Bands, top_hz: f32) -> Vec<BandPlace> {
    (0..grid.bins()).map(|k| bands.place(single(grid.bin_hz(k)).min(top_hz))).collect()
}

/// Carriers of explicit taps: noise one hop long, from [`StftGrid::lead`] before its tap on, of about unit energy in every
/// band; bands narrower than a hop resolves are off by some dB. Sets with different `set` numbers are unrelated.
///
/// Filters this short fit the room that frames leave for them, so they are time-invariant: no echo ahead of the direct sound,
/// no modulation at the hop rate, and tones stay tones, which phases drawn anew for every bin would not leave.
///
/// The noise is that of the scene's own grid at every host rate, so that a scene sounds and measures the same; above the
/// scene's Nyquist frequency its spectrum repeats.
pub(crate) fn hop_carriers(
    grid: &StftGrid,
    scene_grid: &StftGrid,
    bands: &Bands,
    tail: &TailModel,
    set: u64,
    hops: usize,
) -> Vec<EarSpectra> {
    let places = band_places(scene_grid, bands, f32::INFINITY);
    // What differs between the ears in the late part comes from the network.
    let coherence = if set == LATE_SET { vec![1.0; places.len()] } else { per_bin(&places, &tail.coherence) };
    let draws = |index: u64| {
        [2 * set, 2 * set + 1].map(|stream| {
            let mut noise = Noise::new(tail.seed, stream, index);
            std::iter::repeat_with(move || noise.gaussian())
        })
    };
    let by_phase = (set == TAP_SET && tail.by_phase).then(|| Decorrelated::new(draws(0), scene_grid.hop, hops));
    let mut shaper = Shaper::new(scene_grid);
    let ears = |hop: usize| -> [Vec<f32>; 2] {
        if let Some(noise) = &by_phase {
            let [middle, side] = noise.hop(hop).map(|samples| shaper.spectrum(&samples));
            let ears = [1.0, -1.0].map(|sign| apart(&middle, &side, &coherence, sign));
            return shaper.level(ears, &places, bands.count());
        }
        let scale = 1.0 / (scene_grid.hop as f32).sqrt();
        let [left, other] = draws(hop as u64).map(|noise| {
            let samples: Vec<f32> = noise.take(scene_grid.hop).map(|x| scale * x).collect();
            shaper.spectrum(&samples)
        });
        let right = blend_ears(&left, &other, &coherence);
        [left, right].map(|ear| {
            let [samples] = shaper.level([ear], &places, bands.count());
            samples
        })
    };
    let samples: Vec<[Vec<f32>; 2]> = (0..hops).map(ears).collect();
    samples.iter().map(|ears| ears.each_ref().map(|samples| shaper.spectrum_at(grid, samples))).collect()
}

/// Keeps noise one hop long while its bands are brought to one energy.
pub(crate) struct Shaper {
    grid: StftGrid,
    forward: Arc<dyn RealToComplex<f32>>,
    inverse: Arc<dyn ComplexToReal<f32>>,
}

impl Shaper {
    pub(crate) fn new(grid: &StftGrid) -> Self {
        Self { grid: *grid, forward: promenade_fourier::forward(grid.n_fft), inverse: promenade_fourier::inverse(grid.n_fft) }
    }

    /// Spectrum of a hop of samples, the first of which lies [`StftGrid::lead`] before time 0.
    fn spectrum(&self, samples: &[f32]) -> Vec<Complex32> {
        let mut time = vec![0.0; self.grid.n_fft];
        for (i, x) in samples.iter().enumerate() {
            time[self.place(i)] = *x;
        }
        let mut spectrum = vec![Complex32::default(); self.grid.bins()];
        // The lengths fit, which is all that could be wrong.
        let done = self.forward.process(&mut time, &mut spectrum);
        debug_assert!(done.is_ok());
        spectrum
    }

    /// The spectrum of a carrier at the bins of another grid.
    pub(crate) fn spectrum_at(&self, grid: &StftGrid, samples: &[f32]) -> Vec<Complex32> {
        if *grid == self.grid { self.spectrum(samples) } else { spectrum_on(grid, samples, &self.grid) }
    }

    /// Where a sample of the hop lies in a frame.
    fn place(&self, sample: usize) -> usize {
        (sample + self.grid.n_fft - self.grid.lead()) % self.grid.n_fft
    }

    /// The hops of samples whose bands have unit energy in the mean of all of them: levels are set and what then lies outside
    /// the hop is cut off, in turns. Setting them once would leave filters whose ends wrap round in the frame 20 dB below
    /// themselves.
    fn level<const N: usize>(&mut self, mut spectra: [Vec<Complex32>; N], places: &[BandPlace], bands: usize) -> [Vec<f32>; N] {
        let mut samples = [(); N].map(|()| vec![0.0; self.grid.hop]);
        let mut time = vec![0.0; self.grid.n_fft];
        for _ in 0..LEVEL_ROUNDS {
            let levels = per_bin(places, &band_levels(&spectra, places, bands));
            for (spectrum, samples) in spectra.iter_mut().zip(&mut samples) {
                spectrum.iter_mut().zip(&levels).for_each(|(x, g)| *x *= g / self.grid.n_fft as f32);
                if let [first, .., last] = spectrum.as_mut_slice() {
                    (first.im, last.im) = (0.0, 0.0);
                }
                let done = self.inverse.process(spectrum, &mut time);
                debug_assert!(done.is_ok());
                for (i, x) in samples.iter_mut().enumerate() {
                    *x = time[self.place(i)];
                }
                *spectrum = self.spectrum(samples);
            }
        }
        samples
    }
}

/// Spectrum of noise sampled on the scene's grid, at the bins of another grid.
///
/// Between two samples of the host a sample of the scene becomes a short fractional delay: its spectrum alone would stand for
/// one that never ends, which would wrap round in the frame, and tones would not stay tones.
fn spectrum_on(grid: &StftGrid, noise: &[f32], scene_grid: &StftGrid) -> Vec<Complex32> {
    let ratio = grid.sample_rate_hz / scene_grid.sample_rate_hz;
    let at = |i: usize| (i as f64 - scene_grid.lead() as f64) * ratio;
    let mut frame = vec![0.0_f64; grid.n_fft];
    for (i, x) in noise.iter().enumerate() {
        let nearest = at(i).round();
        for tap in -DELAY_REACH..=DELAY_REACH {
            // A frame's transform is periodic: samples before time 0 lie at its end.
            let place = (whole_signed(nearest) + tap).rem_euclid(whole_signed(grid.n_fft as f64));
            frame[whole(place as f64)] += f64::from(*x) * delayed(nearest - at(i) + tap as f64);
        }
    }
    spectrum(frame, grid.n_fft).iter().map(|x| Complex32::new(single(x.re), single(x.im))).collect()
}

/// Fractional delay: a sinc under a Hann window, at a distance in samples; exactly 1 or 0 at whole ones.
fn delayed(distance: f64) -> f64 {
    if distance == distance.round() {
        return if distance == 0.0 { 1.0 } else { 0.0 };
    }
    let (x, reach) = (std::f64::consts::PI * distance, (DELAY_REACH + 1) as f64);
    x.sin() / x * (0.5 + 0.5 * (x / reach).cos())
}

/// Unit phasors that turn slowly over frequency: a random angle every [`PHASE_BINS`] bins of the scene's grid, with a raised
/// cosine in between.
pub(crate) fn smooth_phases(grid: &StftGrid, scene_grid: &StftGrid, seed: u64, stream: u64) -> Vec<Complex32> {
    let mut noise = Noise::new(seed, stream, 0);
    let knot_hz = scene_grid.bin_hz(PHASE_BINS);
    let place = |k: usize| grid.bin_hz(k) / knot_hz;
    let knots: Vec<f32> = (0..whole(place(grid.bins())) + 2).map(|_| noise.phase()).collect();
    (0..grid.bins())
        .map(|k| {
            let (knot, along) = (whole(place(k)), single(place(k).fract()));
            let share = 0.5 - 0.5 * (std::f32::consts::PI * along).cos();
            Complex32::from_polar(1.0, knots[knot] + share * (knots[knot + 1] - knots[knot]))
        })
        .collect()
}

/// A value per band, spread over bins.
pub(crate) fn per_bin<T>(places: &[BandPlace], bands: &[T]) -> Vec<T>
where
    T: Copy + From<f32> + Add<Output = T> + Sub<Output = T> + Mul<Output = T>,
{
    places.iter().map(|p| bands[p.band] + T::from(p.fraction) * (bands[p.band + 1] - bands[p.band])).collect()
}

/// The right ear's carrier with the wanted interaural coherence (real, per bin) to the left's.
fn blend_ears(left: &[Complex32], other: &[Complex32], coherence: &[f32]) -> Vec<Complex32> {
    left.iter().zip(other).zip(coherence).map(|((l, o), c)| l * c + o * (1.0 - c * c).max(0.0).sqrt()).collect()
}

/// An ear's carrier: what is common to both, and with its sign what they do not share.
fn apart(middle: &[Complex32], side: &[Complex32], coherence: &[f32], sign: f32) -> Vec<Complex32> {
    let shares = coherence.iter().map(|c| [0.5 * (1.0 + c), 0.5 * (1.0 - c)].map(|energy| energy.max(0.0).sqrt()));
    middle.iter().zip(side).zip(shares).map(|((m, s), [a, b])| m * a + s * (sign * b)).collect()
}

/// Gain per band that brings the mean energy of spectra to 1 there, whatever the draw.
fn band_levels(spectra: &[Vec<Complex32>], places: &[BandPlace], bands: usize) -> Vec<f32> {
    let (mut energy, mut weight) = (vec![0.0_f32; bands], vec![1e-9_f32; bands]);
    for (x, p) in spectra.iter().flat_map(|spectrum| spectrum.iter().zip(places)) {
        for (band, w) in [(p.band, 1.0 - p.fraction), (p.band + 1, p.fraction)] {
            energy[band] += w * x.norm_sqr();
            weight[band] += w;
        }
    }
    energy.iter().zip(&weight).map(|(e, w)| if *e > 0.0 { (w / e).sqrt() } else { 0.0 }).collect()
}

/// Counter-based noise: the same numbers for the same seed, stream and index on every machine.
struct Noise(Random);

impl Noise {
    fn new(seed: u64, stream: u64, index: u64) -> Self {
        Self(Random::new(mix(mix(mix(seed) ^ stream) ^ index)))
    }

    /// Uniform in (0, 1).
    fn uniform(&mut self) -> f32 {
        ((self.0.bits() >> 40) as f32 + 0.5) / 16_777_216.0
    }

    fn phase(&mut self) -> f32 {
        std::f32::consts::TAU * self.uniform()
    }

    /// Standard normal (Box and Muller 1958).
    fn gaussian(&mut self) -> f32 {
        (-2.0 * self.uniform().ln()).sqrt() * self.phase().cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn carriers_are_a_hop_long_and_level_at_any_rate() {
        for (n_fft, hop, rate, host) in
            [(320, 80, 16_000.0, 16_000.0), (512, 127, 22_050.0, 22_050.0), (512, 127, 22_050.0, 48_000.0)]
        {
            let scene_grid = StftGrid { sample_rate_hz: rate, n_fft, hop };
            let grid = scene_grid.at_rate(host);
            let bands = Bands::for_rate(rate);
            let tail =
                TailModel { seed: 4, t60_s: vec![1.0; bands.count()], coherence: vec![0.3; bands.count()], by_phase: false };
            let inverse = promenade_fourier::inverse::<f32>(grid.n_fft);
            let places = band_places(&grid, &bands, f32::INFINITY);
            for ears in hop_carriers(&grid, &scene_grid, &bands, &tail, TAP_SET, 4) {
                for mut ear in ears {
                    // The last band holds above the scene's own, where nothing is set.
                    let levels = band_levels(std::slice::from_ref(&ear), &places, bands.count());
                    let worst = levels[..bands.count() - 1].iter().fold(0.0_f32, |w, g| w.max((20.0 * g.log10()).abs()));
                    assert!(worst < 4.0, "{n_fft}/{hop} at {host}: a band is {worst} dB off");
                    let mut time = vec![0.0; grid.n_fft];
                    let last = ear.len() - 1;
                    (ear[0].im, ear[last].im) = (0.0, 0.0);
                    inverse.process(&mut ear, &mut time).unwrap();
                    let inside = |i: &usize| *i < grid.hop - grid.lead() + 1 || *i + grid.lead() + 1 >= grid.n_fft;
                    let energy =
                        |pick: bool| (0..grid.n_fft).filter(|i| inside(i) == pick).map(|i| time[i].powi(2)).sum::<f32>();
                    let outside = 10.0 * (energy(false) / energy(true)).log10();
                    assert!(
                        outside < -20.0 - if host > rate { 0.0 } else { 60.0 },
                        "{n_fft}/{hop} at {host}: {outside} dB outside"
                    );
                }
            }
        }
    }

    /// A decaying room at both ears, at the bins of a frame.
    fn room(seed: u64, by_phase: bool) -> EarSpectra {
        let (grid, hops) = (StftGrid { sample_rate_hz: 16_000.0, n_fft: 320, hop: 80 }, 60);
        let bands = Bands::for_rate(16_000.0);
        let tail = TailModel { seed, t60_s: vec![0.5; bands.count()], coherence: vec![0.3; bands.count()], by_phase };
        let mut sum = [(); 2].map(|()| vec![Complex32::default(); grid.bins()]);
        for (hop, ears) in hop_carriers(&grid, &grid, &bands, &tail, TAP_SET, hops).iter().enumerate() {
            let level = 10.0_f32.powf(-3.0 * hop as f32 * single(grid.hop_s()) / 0.5);
            for (sum, ear) in sum.iter_mut().zip(ears) {
                for (k, (sum, x)) in sum.iter_mut().zip(ear).enumerate() {
                    let turns = (k * hop * grid.hop % grid.n_fft) as f32 / grid.n_fft as f32;
                    *sum += x * Complex32::from_polar(level, -std::f32::consts::TAU * turns);
                }
            }
        }
        sum
    }

    #[test]
    fn noise_by_phase_is_as_loud_at_both_ears_at_every_frequency_and_as_coherent_as_other_noise() {
        let of = |by_phase: bool| {
            let (mut square_db, mut common, mut energy, mut count) = (0.0, 0.0, 0.0, 0.0);
            for seed in 0..12 {
                let [left, right] = room(97 * seed, by_phase);
                for (l, r) in left.iter().zip(&right).skip(4).take(150) {
                    square_db += (10.0 * (l.norm_sqr() / r.norm_sqr()).log10()).powi(2);
                    common += (l * r.conj()).re;
                    energy += 0.5 * (l.norm_sqr() + r.norm_sqr());
                    count += 1.0;
                }
            }
            (f32::sqrt(square_db / count), common / energy)
        };
        let ([apart_db, apart], [alike_db, alike]) = (<[f32; 2]>::from(of(false)), <[f32; 2]>::from(of(true)));
        assert!(apart_db > 6.0 && alike_db < 0.65 * apart_db, "{apart_db} and {alike_db} dB");
        assert!((apart - 0.3).abs() < 0.1 && (alike - 0.3).abs() < 0.1, "{apart} and {alike}");
    }
}
