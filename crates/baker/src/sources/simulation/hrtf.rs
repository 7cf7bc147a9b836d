//! Head-related transfer functions: what each ear hears of a direction.

use super::bins::Bins;
use crate::{BakeError, Responses};
use promenade_audio::resample;
use promenade_core::glam::Vec3;
use promenade_core::head::{NEIGHBOURS, lag_s, lattice, low_pass_power, near};
use promenade_fourier::num_complex::{Complex32, Complex64};
use promenade_fourier::{Fourier, floored_log};
use rayon::prelude::*;

/// Length of the transform that an image is filtered in, seconds, at least.
const FRAME_S: f64 = 0.036;
/// How long after the first arrival a head's response counts, seconds.
const RESPONSE_S: f64 = 0.010;
/// Directions that stand for the sphere in means over it.
const SPHERE: usize = 4096;
/// Range of the equalisation: below it, its end holds. Above it, responses fade away towards half the sample rate, of which the
/// upper end is a share: fractional delays would ring long otherwise.
const EQUALISED: (f64, f64) = (100.0, 0.85);
/// A head is small against the wave below here, Hz: what a measurement has there is its loudspeaker's.
const LEVEL_BELOW_HZ: f64 = 250.0;

/// Responses of a head in a free field, equalised for a diffuse field: over all directions and both ears their energy is 1 at
/// every frequency from 100 Hz to 85 % of half the sample rate, where they begin to fade away.
///
/// A direction is two levels by frequency, with the minimum phase of these, and two delays: as good as the responses themselves
/// (Kulkarni, Isabelle and Colburn 1999). Between measured directions delays and minimum-phase responses are interpolated
/// apart, of the five nearest directions with Franke and Little's weights (1980), so that a turn of the head has no steps.
/// Measured phases would cancel there: a few degrees apart on the far side of a head they differ by half a turn.
#[derive(Debug)]
pub struct Hrtf {
    pub(crate) bins: Bins,
    directions: Vec<Vec3>,
    /// Of each direction both ears' delays after the head's centre, samples.
    delays: Vec<[f32; 2]>,
    /// `[direction][ear][bin]`, of minimum phase.
    spectra: Vec<[Vec<Complex32>; 2]>,
    /// Real interaural coherence in a diffuse field, by bin.
    coherence: Vec<f32>,
    /// Which distance was taken where the set has several, in words.
    pub note: Option<String>,
    pub(crate) credit: String,
    pub(crate) licence: String,
}

impl Hrtf {
    /// HRTFs from responses of a head around it in a free field (a SOFA file of head-related responses), converted to a sample
    /// rate in Hz. The mean delay of both ears over all directions is the distance's, one for all of them, and is taken out.
    ///
    /// # Errors
    /// A rate out of range, no responses, or ones without a direction or without sound.
    pub fn new(set: &Responses, sample_rate_hz: u32) -> Result<Self, BakeError> {
        let wrong = |expected: &str, found: &str| BakeError::argument("HRTF", expected, found);
        if !(8_000..=192_000).contains(&sample_rate_hz) {
            return Err(BakeError::argument("sample rate", "8000 to 192000 Hz", format!("{sample_rate_hz} Hz")));
        }
        let rate = f64::from(sample_rate_hz);
        let (n_fft, from_hz) = (((FRAME_S * rate) as usize).next_power_of_two(), set.sample_rate_hz.round() as u32);
        let bins = Bins { n_fft, sample_rate_hz: rate };
        let mut directions = Vec::with_capacity(set.responses.len());
        let mut ears = Vec::with_capacity(2 * set.responses.len());
        let distances: Vec<f32> = set.responses.iter().map(|r| r.listener.to_head(r.source).length()).collect();
        let (kept, note) = promenade_sofa::farthest(&distances).unzip();
        let kept = |i: &usize| kept.as_ref().is_none_or(|kept: &Vec<bool>| kept[*i]);
        for response in (0..set.responses.len()).filter(kept).map(|i| &set.responses[i]) {
            let direction = response.listener.to_head(response.source).try_normalize();
            directions.push(direction.ok_or_else(|| wrong("sources apart from it", &response.name))?);
            ears.extend([response.left.clone(), response.right.clone()]);
        }
        if directions.is_empty() {
            return Err(wrong("at least one direction", "none"));
        }
        let ears = resample::response(&ears, from_hz, sample_rate_hz)?;
        let mut hrtf = Self {
            bins,
            delays: Vec::new(),
            spectra: Vec::new(),
            coherence: Vec::new(),
            note,
            directions,
            credit: set.credit.clone(),
            licence: set.licence.clone(),
        };
        let shares = hrtf.shares();
        let (cut, onsets) = hrtf.cut(&ears).ok_or_else(|| wrong("responses with sound", "silence"))?;
        hrtf.set(&cut, &onsets, &shares);
        Ok(hrtf)
    }

    /// Samples per second.
    #[must_use]
    pub fn sample_rate_hz(&self) -> u32 {
        self.bins.sample_rate_hz as u32
    }

    /// Directions that were measured.
    #[must_use]
    pub fn directions(&self) -> usize {
        self.directions.len()
    }

    /// Real interaural coherence in a diffuse field at a frequency, -1 to 1.
    pub(crate) fn coherence(&self, hz: f64) -> f32 {
        let bin = hz * self.bins.n_fft as f64 / self.bins.sample_rate_hz;
        let bin = (bin.round() as usize).min(self.coherence.len() - 1);
        self.coherence[bin]
    }

    /// The share of the sphere that each direction stands for: how much of it is nearest to it.
    fn shares(&self) -> Vec<f32> {
        let mut shares = vec![0.0; self.directions.len()];
        for i in 0..SPHERE {
            shares[self.near(lattice(i, SPHERE)).weights[0].0] += 1.0 / SPHERE as f32;
        }
        shares
    }

    /// Responses from their onsets on, each as long as counts, and the onsets in samples.
    fn cut(&self, ears: &[Vec<f32>]) -> Option<(Vec<Vec<f32>>, Vec<f32>)> {
        let rate = self.bins.sample_rate_hz;
        let [lead, length, fade] = [0.001, RESPONSE_S, 0.002].map(|s| (s * rate) as usize);
        let mut pieces = Vec::with_capacity(ears.len());
        let mut onsets = Vec::with_capacity(ears.len());
        for ear in ears {
            let onset = arrival(ear)?;
            let end = onset as usize + length;
            let start = end.saturating_sub(length + lead);
            let mut piece = vec![0.0; start];
            piece.extend(ear.iter().skip(start).take(end - start));
            let last = piece.len();
            for (i, v) in piece.iter_mut().rev().take(fade).enumerate() {
                // Only what was cut off needs an end.
                if ear.len() > last {
                    *v *= (0.5 * std::f32::consts::PI * (i as f32 + 0.5) / fade as f32).sin().powi(2);
                }
            }
            pieces.push(piece);
            onsets.push(onset);
        }
        Some((pieces, onsets))
    }

    fn set(&mut self, ears: &[Vec<f32>], onsets: &[f32], shares: &[f32]) {
        let Bins { n_fft, sample_rate_hz } = self.bins;
        let fourier = Fourier::new(n_fft);
        let mut time = vec![0.0_f32; n_fft];
        let spectra: Vec<Vec<Complex32>> = ears
            .iter()
            .zip(onsets)
            .map(|(ear, onset)| {
                // Turned round the transform so that the onset comes to lie at its beginning, where the rest follows exactly.
                time.fill(0.0);
                let whole = onset.round() as usize;
                for (i, v) in ear.iter().enumerate() {
                    if *v != 0.0 {
                        time[(i + n_fft * (1 + whole / n_fft) - whole) % n_fft] += v;
                    }
                }
                let mut spectrum = fourier.spectrum(time.iter().copied());
                delay(&mut spectrum, whole as f32 - onset, n_fft);
                spectrum
            })
            .collect();
        let pairs: Vec<&[Vec<Complex32>]> = spectra.chunks(2).collect();
        let energy: Vec<f64> = (0..self.bins.count())
            .map(|k| {
                pairs.iter().zip(shares).map(|(p, w)| f64::from(w * 0.5 * (p[0][k].norm_sqr() + p[1][k].norm_sqr()))).sum()
            })
            .collect();
        let range = EQUALISED.0..=EQUALISED.1 * 0.5 * sample_rate_hz;
        let smooth = third_octaves(&energy, sample_rate_hz / n_fft as f64);
        let equaliser = self.bins.minimum_phase(|f| {
            let bin = f.clamp(*range.start(), *range.end()) / sample_rate_hz * n_fft as f64;
            at(&smooth, bin).max(1e-12).sqrt().recip()
        });
        let fade = |k: usize| {
            let above = (self.bins.hz(k) / (0.5 * sample_rate_hz) - EQUALISED.1) / (1.0 - EQUALISED.1);
            (0.5 * std::f64::consts::PI * above.clamp(0.0, 1.0)).cos().powi(2) as f32
        };
        self.coherence = self.coherence_of(&pairs, onsets, shares);
        let equaliser: Vec<Complex64> = equaliser.iter().map(|c| Complex64::new(c.re.into(), c.im.into()).exp()).collect();
        let split = |(pair, onsets): (&&[Vec<Complex32>], &[f32])| {
            let wide = |x: &Complex32| Complex64::new(x.re.into(), x.im.into());
            let measured =
                [0, 1].map(|ear| -> Vec<Complex64> { pair[ear].iter().zip(&equaliser).map(|(x, e)| wide(x) * e).collect() });
            let minimum = measured.each_ref().map(|spectrum| self.minimum_phase_of(spectrum));
            let delays = self.delays_of(&measured, &minimum, onsets);
            let faded = |x: &Vec<Complex32>| x.iter().enumerate().map(|(k, x)| x * fade(k)).collect();
            (minimum.each_ref().map(faded), delays)
        };
        let all: Vec<([Vec<Complex32>; 2], [f32; 2])> = pairs.par_iter().zip(onsets.par_chunks(2)).map(split).collect();
        let mean = all.iter().zip(shares).map(|((_, d), w)| w * 0.5 * (d[0] + d[1])).sum::<f32>();
        (self.spectra, self.delays) = all.into_iter().map(|(spectra, delays)| (spectra, delays.map(|d| d - mean))).unzip();
    }

    /// Coherence of both ears by bin over all pairs, the delay between them taken out.
    fn coherence_of(&self, pairs: &[&[Vec<Complex32>]], onsets: &[f32], shares: &[f32]) -> Vec<f32> {
        let sample_rate_hz = self.bins.sample_rate_hz;
        (0..self.bins.count())
            .map(|k| {
                let (mut cross, mut left, mut right) = (0.0, 0.0, 0.0);
                for ((p, w), d) in pairs.iter().zip(shares).zip(onsets.chunks(2)) {
                    let lag = (2.0 * std::f64::consts::PI * self.bins.hz(k) / sample_rate_hz) as f32 * (d[0] - d[1]);
                    cross += w * (p[0][k] * p[1][k].conj() * Complex32::cis(-lag)).re;
                    left += w * p[0][k].norm_sqr();
                    right += w * p[1][k].norm_sqr();
                }
                (cross / (left * right).sqrt().max(1e-12)).clamp(-1.0, 1.0)
            })
            .collect()
    }

    /// The minimum-phase spectrum of the same magnitude, level below [`LEVEL_BELOW_HZ`].
    fn minimum_phase_of(&self, spectrum: &[Complex64]) -> Vec<Complex32> {
        let first = (0..spectrum.len()).find(|k| self.bins.hz(*k) >= LEVEL_BELOW_HZ).unwrap_or(0);
        let gain: Vec<f64> = (0..spectrum.len()).map(|k| spectrum[k.max(first)].norm()).collect();
        let logs: Vec<f64> = floored_log(&gain).collect();
        let bins_per_hz = self.bins.n_fft as f64 / self.bins.sample_rate_hz;
        self.bins.minimum_phase(|hz| at(&logs, hz * bins_per_hz).exp()).into_iter().map(Complex32::exp).collect()
    }

    /// Delays that leave a pair of minimum-phase spectra as late as the measured one is, below 1.5 kHz and between the ears,
    /// samples. Measured spectra are about their onsets.
    fn delays_of(&self, measured: &[Vec<Complex64>; 2], minimum: &[Vec<Complex32>; 2], onsets: &[f32]) -> [f32; 2] {
        let wide = |x: &Complex32| Complex64::new(x.re.into(), x.im.into());
        let lag = |cross: &mut dyn Iterator<Item = Complex64>| {
            let hz = |k: usize| self.bins.hz(k);
            (lag_s(cross.enumerate().map(|(k, x)| (hz(k), low_pass_power(hz(k)) * x))) * self.bins.sample_rate_hz) as f32
        };
        let single = |ear: usize| {
            let pairs = measured[ear].iter().zip(&minimum[ear]);
            onsets[ear] + lag(&mut pairs.map(|(x, m)| x * wide(m).conj()))
        };
        let mean = 0.5 * (single(0) + single(1));
        let apart = lag(&mut measured[0].iter().zip(&measured[1]).map(|(l, r)| l * r.conj()))
            - lag(&mut minimum[0].iter().zip(&minimum[1]).map(|(l, r)| wide(&(l * r.conj()))));
        let half = 0.5 * (onsets[0] - onsets[1] + apart);
        [mean + half, mean - half]
    }

    /// What is measured near a direction of unit length: forward, left, up.
    pub(crate) fn near(&self, direction: Vec3) -> Near<'_> {
        Near { hrtf: self, weights: near(&self.directions, direction) }
    }
}

/// Measured directions with their weights, the nearest first.
#[derive(Debug)]
pub(crate) struct Near<'a> {
    hrtf: &'a Hrtf,
    weights: [(usize, f32); NEIGHBOURS],
}

impl Near<'_> {
    /// Delay of an ear after the head's centre, samples.
    pub(crate) fn delay(&self, ear: usize) -> f32 {
        self.weights.iter().map(|(i, w)| w * self.hrtf.delays[*i][ear]).sum()
    }

    /// Spectrum of an ear without its delay.
    pub(crate) fn spectrum(&self, ear: usize, out: &mut [Complex32]) {
        out.fill(Complex32::default());
        for (direction, weight) in self.weights.iter().filter(|(_, w)| *w > 1e-4) {
            for (o, s) in out.iter_mut().zip(&self.hrtf.spectra[*direction][ear]) {
                *o += s * weight;
            }
        }
    }
}

/// Sample of the first peak of at least half the highest, between samples by a parabola; `None` for silence.
fn arrival(ear: &[f32]) -> Option<f32> {
    let peak = ear.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
    if peak <= 0.0 {
        return None;
    }
    let at = |i: usize| ear.get(i).map_or(0.0, |v| v.abs());
    let i = (0..ear.len()).find(|i| at(*i) >= 0.5 * peak && at(*i) >= at(i + 1))?;
    let before = if i > 0 { at(i - 1) } else { 0.0 };
    let (middle, after) = (at(i), at(i + 1));
    let curvature = before - 2.0 * middle + after;
    let offset = if curvature < 0.0 { (0.5 * (before - after) / curvature).clamp(-0.5, 0.5) } else { 0.0 };
    Some(i as f32 + offset)
}

/// Delays a spectrum by a fraction of a sample.
fn delay(spectrum: &mut [Complex32], samples: f32, n_fft: usize) {
    for (k, s) in spectrum.iter_mut().enumerate() {
        *s *= Complex32::cis(-2.0 * std::f32::consts::PI * k as f32 * samples / n_fft as f32);
    }
}

/// Means over a third of an octave about each bin.
fn third_octaves(energy: &[f64], bin_hz: f64) -> Vec<f64> {
    let edge = 2.0_f64.powf(1.0 / 6.0);
    let last = energy.len() - 1;
    (0..energy.len())
        .map(|k| {
            let hz = (k as f64 * bin_hz).max(0.5 * bin_hz);
            let (low, high) = ((hz / edge / bin_hz).round() as usize, ((hz * edge / bin_hz).round() as usize).min(last));
            let low = low.min(high);
            energy[low..=high].iter().sum::<f64>() / (high - low + 1) as f64
        })
        .collect()
}

/// A value between bins.
fn at(values: &[f64], bin: f64) -> f64 {
    let below = (bin as usize).min(values.len() - 2);
    values[below] + (bin - below as f64) * (values[below + 1] - values[below])
}
