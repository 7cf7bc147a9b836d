//! What a clip tells of the room by itself: the response between its dry and its recorded sound, as delays and energies.

use promenade_baker::capture::{Capture, Clip, DIRECT_PRE_ROLL_S, Split};
use promenade_core::{Bands, Pose, StftGrid, TailModel};
use promenade_fourier::Fourier;
use promenade_metrics::statistics::median_high;
use promenade_metrics::{arrival, deconvolve};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;

/// The direct sound comes within this of the dry sound, before it where the two are badly aligned, seconds.
const EARLIEST_S: f64 = 0.03;
const LATEST_S: f64 = 0.15;
/// Longest part of the room's response that is asked for, seconds, and as a share of a clip.
const LONGEST_S: f64 = 0.75;
const SHARE_OF_CLIP: f64 = 0.75;
/// An arrival has to stand out so far, dB: direct sound that is softer tells nothing.
const CLEAR_DB: f64 = 7.0;
/// Where the direct sound begins, is whole, begins to end and has ended, seconds after its peak.
const DIRECT_S: [f64; 4] = [-0.002, -0.0015, 0.0025, 0.0035];
/// Hops that are averaged to see where a response sinks into its noise, and how far over that it ends, as a ratio of energies.
const AVERAGED: usize = 3;
const OVER_NOISE: f32 = 8.0;
/// A band tells something where the dry sound's power there is at least this share of its mean.
const SOUNDS: f64 = 1e-3;

/// Hops that a decay is read off, and responses that tell one, at least.
pub(crate) const FEWEST_HOPS: usize = 10;
const FEWEST_DECAYS: usize = 8;
/// No decay is surer than this, as a share of it.
const LEAST_ERROR: f64 = 1e-3;

/// The response of a clip.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ClipResponse {
    /// Samples by which the direct sound is later than the dry sound.
    pub(crate) late: i64,
    /// The direct sound's delay between the ears, seconds, positive = left ear later.
    pub(crate) delay_s: f32,
    /// Whether the dry sound has energy enough in a band to tell anything.
    pub(crate) sounds: Vec<bool>,
    /// Energy of the direct sound, mean over the bins of a band, `[ear][band]`.
    pub(crate) direct: Vec<f32>,
    /// Energy of a hop, of the noise taken off, `[ear][band][hop]`, the first hop being that of the first tap. A band ends
    /// where it has sunk into the noise.
    pub(crate) hops: Vec<Vec<f32>>,
    /// Energy of a hop of noise, mean per bin, `[ear][band]`.
    pub(crate) noise: Vec<f32>,
}

/// The response of a clip with its uncertainty: what a measurement of it would be.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedResponse {
    /// What the clip is for.
    pub split: Split,
    /// The listener.
    pub listener: Pose,
    /// Number of the emitter, where it is known.
    pub emitter: Option<usize>,
    /// Both ears, silent before the direct sound.
    pub ears: [Vec<f32>; 2],
    /// Variance of what a hop of 5.8 ms has in a band, mean per bin, `[ear][band]` of [`Bands::for_rate`]: what is heard of the
    /// recording's noise through the inverse of the dry sound's spectrum.
    pub noise: Vec<f32>,
}

/// A decay with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decay {
    /// Time in which the energy falls by 60 dB, seconds.
    pub time_s: f64,
    /// Its standard error, seconds.
    pub sd_s: f64,
}

/// The transform of the masks at a rate: four hops of about 5.8 ms.
pub(crate) fn grid(sample_rate_hz: f64) -> StftGrid {
    StftGrid::four_hops(sample_rate_hz, 128.0 * sample_rate_hz / 22_050.0)
}

/// How much a level counts beside one without noise: the inverse of its variance in dB, of which a hop of diffuse sound has as
/// much by itself as noise of a quarter of its energy adds.
pub(crate) fn certainty(energy: f32, noise: f32) -> f32 {
    if energy > 0.0 { energy / (energy + 4.0 * noise) } else { 0.0 }
}

/// The responses of a capture's clips whose direct sound stands out.
#[must_use]
pub fn recorded_responses(capture: &Capture) -> Vec<RecordedResponse> {
    let (grid, bands) = (grid(capture.sample_rate_hz), Bands::for_rate(capture.sample_rate_hz));
    let cutter = Cutter::new(&grid, &bands);
    let one = |clip: &Clip| {
        let Found { mut ears, centre, noise, .. } = cutter.found(capture, clip)?;
        let silent = direct_window(&grid, centre).1[0].max(0) as usize;
        ears.iter_mut().for_each(|ear| ear[..silent].fill(0.0));
        Some(RecordedResponse { split: clip.split, listener: clip.pose, emitter: capture.emitter_of(clip), ears, noise })
    };
    capture.clips.par_iter().filter_map(one).collect()
}

/// Reverberation times of the octaves from 125 Hz that the training clips tell: means of those of the bands in an octave, each
/// as sure as it is.
#[must_use]
pub fn recorded_decays(capture: &Capture) -> [Option<Decay>; 7] {
    let (grid, bands) = (grid(capture.sample_rate_hz), Bands::for_rate(capture.sample_rate_hz));
    let clips: Vec<Clip> = capture.split(Split::Train).cloned().collect();
    let told = decay_times(&clip_responses(capture, &clips, &grid, &bands), bands.count(), grid.hop_s());
    std::array::from_fn(|octave| {
        let middle = 125.0 * 2.0_f32.powi(octave as i32);
        let inside = |hz: f32| (hz / middle).log2().abs() <= 0.5;
        let of: Vec<Decay> =
            bands.centres_hz().iter().zip(&told).filter(|(hz, _)| inside(**hz)).filter_map(|(_, d)| *d).collect();
        let sure: f64 = of.iter().map(|d| d.sd_s.powi(-2)).sum();
        let time_s = of.iter().map(|d| d.time_s * d.sd_s.powi(-2)).sum::<f64>() / sure;
        (sure > 0.0 && sure.is_finite()).then(|| Decay { time_s, sd_s: sure.recip().sqrt() })
    })
}

/// The responses of a capture's clips by the clips' names, of those whose direct sound stands out.
pub(crate) type ClipResponses = HashMap<String, Arc<ClipResponse>>;

/// Finds the responses of clips of a capture.
#[must_use]
pub(crate) fn clip_responses(capture: &Capture, clips: &[Clip], grid: &StftGrid, bands: &Bands) -> ClipResponses {
    let cutter = Cutter::new(grid, bands);
    let one = |clip: &Clip| Some((clip.name.clone(), Arc::new(cutter.response(capture, clip)?)));
    clips.par_iter().filter_map(one).collect()
}

/// Reverberation time per band: the median over clips and ears of the slopes of lines through the levels of hops, each level as
/// sure as it is; `None` where too few responses have hops enough.
#[must_use]
pub(crate) fn decay_times(responses: &ClipResponses, bands: usize, hop_s: f64) -> Vec<Option<Decay>> {
    let of_band = |band: usize| {
        let heard = responses.values().filter(|r| r.sounds[band]);
        let lines = heard.flat_map(|r| [band, bands + band].map(|place| line(&r.hops[place], r.noise[place])));
        let slopes: Vec<f64> = lines.flatten().collect();
        if slopes.len() < FEWEST_DECAYS {
            return None;
        }
        let db_per_hop = median_high(slopes.iter().copied())?;
        let off = median_high(slopes.iter().map(|slope| (slope - db_per_hop).abs()))?;
        let time_s = -60.0 * hop_s / db_per_hop;
        // Of a normal spread, the median's standard error in terms of the median deviation: 1.483 by the root of pi / 2.
        let share = 1.858 * off / (slopes.len() as f64).sqrt() / db_per_hop.abs();
        (time_s.is_finite() && time_s > 0.0).then(|| Decay { time_s, sd_s: time_s * share.max(LEAST_ERROR) })
    };
    (0..bands).map(of_band).collect()
}

/// The slope of a response's levels, dB per hop.
fn line(hops: &[f32], noise: f32) -> Option<f64> {
    let heard = hops.iter().enumerate().filter(|(_, energy)| **energy > 0.0);
    let points: Vec<[f64; 3]> =
        heard.map(|(l, e)| [l as f64, 10.0 * f64::from(*e).log10(), f64::from(certainty(*e, noise))]).collect();
    let sum: f64 = points.iter().map(|p| p[2]).sum();
    let mean = |i: usize| points.iter().map(|p| p[2] * p[i]).sum::<f64>() / sum;
    let (at, db) = (mean(0), mean(1));
    let square: f64 = points.iter().map(|p| p[2] * (p[0] - at).powi(2)).sum();
    let product: f64 = points.iter().map(|p| p[2] * (p[0] - at) * (p[1] - db)).sum();
    (points.len() >= FEWEST_HOPS && square > 0.0).then(|| product / square)
}

/// Energy that is left after a hop, per band of a tail.
pub(crate) fn decays(grid: &StftGrid, tail: &TailModel) -> Vec<f32> {
    let decay = |t60: &f32| 10.0_f64.powf(-6.0 * grid.hop_s() / f64::from(*t60)) as f32;
    tail.t60_s.iter().map(decay).collect()
}

/// How much of every bin belongs to a band.
pub(crate) fn band_weights(grid: &StftGrid, bands: &Bands) -> Vec<Vec<(usize, f32)>> {
    let mut weights = vec![Vec::new(); bands.count()];
    for k in 0..grid.bins() {
        let of_bin = bands.weights(grid.bin_hz(k) as f32);
        of_bin.into_iter().filter(|(_, weight)| *weight > 0.0).for_each(|(band, weight)| weights[band].push((k, weight)));
    }
    for band in &mut weights {
        let sum: f32 = band.iter().map(|(_, weight)| weight).sum();
        band.iter_mut().for_each(|(_, weight)| *weight /= sum);
    }
    weights
}

/// How much of a sample belongs to the direct sound about a centre, and the samples where that begins, is whole, begins to end
/// and has ended.
pub(crate) fn direct_window(grid: &StftGrid, centre: usize) -> (impl Fn(i64) -> f32 + use<>, [i64; 4]) {
    let edges = DIRECT_S.map(|s| (s * grid.sample_rate_hz).round() as i64 + centre as i64);
    let [from, whole, ends, to] = edges;
    let inside = move |i: i64| {
        let (rising, falling) = ((i - from) as f64 / (whole - from) as f64, (to - i) as f64 / (to - ends) as f64);
        (0.5 * std::f64::consts::PI * rising.min(falling).clamp(0.0, 1.0)).sin().powi(2) as f32
    };
    (inside, edges)
}

/// A response that a clip's dry and recorded sound give.
struct Found {
    ears: [Vec<f32>; 2],
    /// Sample of the direct sound, and how much later than the dry sound that is.
    centre: usize,
    late: i64,
    delay_s: f32,
    sounds: Vec<bool>,
    noise: Vec<f32>,
}

/// Cuts responses into the direct sound and hops.
pub(crate) struct Cutter {
    grid: StftGrid,
    weights: Vec<Vec<(usize, f32)>>,
    fourier: Fourier<f32>,
}

impl Cutter {
    pub(crate) fn new(grid: &StftGrid, bands: &Bands) -> Self {
        Self { grid: *grid, weights: band_weights(grid, bands), fourier: Fourier::new(grid.n_fft) }
    }

    /// A clip's response as a sound; `None` where none stands out, and of a mix, of which none can be found.
    fn found(&self, capture: &Capture, clip: &Clip) -> Option<Found> {
        if capture.is_mix(clip) {
            return None;
        }
        let rate = capture.sample_rate_hz;
        let samples = |s: f64| (s * rate).round() as usize;
        let (pre_roll, before) = (samples(DIRECT_PRE_ROLL_S), samples(EARLIEST_S));
        let length = samples(LONGEST_S).min((SHARE_OF_CLIP * clip.len as f64) as usize);
        let first = samples(EARLIEST_S + LATEST_S).min(length);
        if length < 2 * before {
            return None;
        }
        let dry = capture.dry(clip, pre_roll);
        let ears = deconvolve(&dry, pre_roll, capture.binaural(clip), before, length)?;
        let direct = arrival(ears.each_ref().map(|h| &h[..first]), rate).filter(|a| a.clarity_db >= CLEAR_DB)?;
        let centre = (direct.time_s * rate).round() as usize;
        let quiet = (centre.saturating_sub(samples(-DIRECT_S[0]))) / self.grid.hop;
        let mut noise = Vec::new();
        for ear in &ears {
            let hops: Vec<Vec<f32>> = (0..quiet).map(|l| self.by_band(&self.window(ear, l * self.grid.hop))).collect();
            noise.extend((0..self.weights.len()).map(|b| hops.iter().map(|hop| hop[b]).sum::<f32>() / quiet.max(1) as f32));
        }
        let (late, delay_s) = (centre as i64 - before as i64, direct.delay_s as f32);
        Some(Found { ears, centre, late, delay_s, sounds: self.sounds(&dry), noise })
    }

    fn response(&self, capture: &Capture, clip: &Clip) -> Option<ClipResponse> {
        let Found { ears, centre, late, delay_s, sounds, noise } = self.found(capture, clip)?;
        let (mut direct, mut all) = (Vec::new(), Vec::new());
        for (ear, noise) in ears.iter().zip(noise.chunks_exact(self.weights.len())) {
            direct.extend(self.by_band(&self.direct(ear, centre)));
            let hops = self.hops(ear, centre);
            for (band, floor) in noise.iter().enumerate() {
                let energies: Vec<f32> = hops.iter().map(|hop| hop[band]).collect();
                let loud = |w: &[f32]| w.iter().sum::<f32>() > OVER_NOISE * floor * AVERAGED as f32;
                let end = energies.windows(AVERAGED).position(|w| !loud(w)).unwrap_or(energies.len());
                all.push(energies[..end].iter().map(|e| e - floor).collect());
            }
        }
        Some(ClipResponse { late, delay_s, sounds, direct, hops: all, noise })
    }

    /// Power of one ear's direct sound, per bin.
    pub(crate) fn direct(&self, ear: &[f32], centre: usize) -> Vec<f32> {
        let (inside, [from, .., to]) = direct_window(&self.grid, centre);
        let piece = (from.max(0)..to.max(0)).map(|i| inside(i) * ear.get(i as usize).copied().unwrap_or(0.0));
        self.powers(piece)
    }

    /// One ear's energies after the direct sound, mean per bin of each band, `[hop][band]`; what ends of the direct sound
    /// begins with the first hop.
    pub(crate) fn hops(&self, ear: &[f32], centre: usize) -> Vec<Vec<f32>> {
        let (inside, [_, _, ends, _]) = direct_window(&self.grid, centre);
        let hop = self.grid.hop;
        let first = centre + hop - self.grid.lead();
        let begin = (ends as usize).min(first);
        let first_hop =
            self.powers((begin..first + hop).map(|i| (1.0 - inside(i as i64)) * ear.get(i).copied().unwrap_or(0.0)));
        let later = (1..ear.len().saturating_sub(first) / hop).map(|l| self.window(ear, first + l * hop));
        let all = std::iter::once(first_hop).chain(later).map(|powers| self.by_band(&powers));
        all.take(ear.len().saturating_sub(first) / hop).collect()
    }

    /// Power of a hop of one ear, per bin.
    fn window(&self, ear: &[f32], start: usize) -> Vec<f32> {
        self.powers((start..start + self.grid.hop).map(|i| ear.get(i).copied().unwrap_or(0.0)))
    }

    fn sounds(&self, dry: &[f32]) -> Vec<bool> {
        let length = dry.len().next_power_of_two();
        let spectrum = promenade_fourier::spectrum(dry.iter().copied(), length);
        let power: Vec<f64> = spectrum.iter().map(|x| f64::from(x.norm_sqr())).collect();
        let least = SOUNDS * power.iter().sum::<f64>() / power.len() as f64;
        // Of each of the grid's bins the bins of the whole sound that lie about it.
        let finer = length as f64 / self.grid.n_fft as f64;
        let about = |k: usize| {
            let at = |k: f64| ((k * finer) as usize).min(power.len() - 1);
            let near = &power[at((k as f64 - 0.5).max(0.0))..=at(k as f64 + 0.5)];
            near.iter().sum::<f64>() / near.len() as f64
        };
        let mean = |band: &Vec<(usize, f32)>| band.iter().map(|(k, weight)| f64::from(*weight) * about(*k)).sum::<f64>();
        self.weights.iter().map(|band| mean(band) >= least).collect()
    }

    fn powers(&self, piece: impl Iterator<Item = f32>) -> Vec<f32> {
        self.fourier.spectrum(piece).iter().map(|x| x.norm_sqr()).collect()
    }

    /// Mean per bin of each band.
    pub(crate) fn by_band(&self, powers: &[f32]) -> Vec<f32> {
        let mean = |band: &Vec<(usize, f32)>| band.iter().map(|(k, weight)| weight * powers[*k]).sum();
        self.weights.iter().map(mean).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_baker::capture::{Track, Voice};
    use promenade_core::{CameraPath, Keyframe};
    use promenade_testing::noise;

    const RATE: f64 = 16_000.0;

    #[test]
    fn a_clip_of_noise_tells_delay_level_and_decay() {
        let (late, ears_apart, t60) = (100, 8, 0.3);
        let room = |seed: u64, direct: usize| -> Vec<f32> {
            let decay = |i: usize| 10.0_f32.powf(-3.0 * i as f32 / (t60 * RATE as f32));
            let tail = noise(seed, 8000).into_iter().enumerate().map(|(i, x)| if i < 100 { 0.0 } else { 0.05 * decay(i) * x });
            let mut h: Vec<f32> = std::iter::repeat_n(0.0, late).chain(tail).collect();
            h[late + direct] = 1.0;
            h
        };
        let (mut tracks, mut clips) = (Vec::new(), Vec::new());
        for i in 0..4 {
            let dry: Vec<f32> = noise(10 + i, 24_000).iter().map(|x| 0.3 * x).collect();
            let spectrum = |x: &[f32]| promenade_fourier::spectrum(x.iter().copied(), 40_000);
            let heard = |h: Vec<f32>| -> Vec<f32> {
                let product = spectrum(&dry).iter().zip(&spectrum(&h)).map(|(a, b)| a * b).collect();
                promenade_fourier::signal(product, 40_000)[..24_000].to_vec()
            };
            let binaural = [heard(room(20 + i, ears_apart)), heard(room(30 + i, 0))];
            let path = CameraPath::new(vec![Keyframe { t_s: 0.0, pose: Pose::IDENTITY }]).unwrap();
            let name = i.to_string();
            clips.push(Clip {
                name: name.clone(),
                track: i as usize,
                start: 8000,
                len: 16_000,
                pose: Pose::IDENTITY,
                split: Split::Train,
            });
            tracks.push(Track { name, voices: vec![Voice { emitter: None, dry }], binaural, path });
        }
        let capture = Capture { sample_rate_hz: RATE, tracks, clips, ..Capture::default() };
        let (grid, bands) = (super::grid(RATE), Bands::for_rate(RATE));
        let responses = clip_responses(&capture, &capture.clips, &grid, &bands);
        assert_eq!(responses.len(), 4);
        for response in responses.values() {
            assert!((response.late - 104).abs() <= 2, "late by {}", response.late);
            assert!((f64::from(response.delay_s) - ears_apart as f64 / RATE).abs() < 1e-5, "{}", response.delay_s);
            assert!(response.direct.iter().all(|e| (10.0 * e.log10()).abs() < 0.5), "{:?}", response.direct);
        }
        for time in decay_times(&responses, bands.count(), grid.hop_s()).iter().skip(2) {
            let Decay { time_s, sd_s } = time.unwrap();
            assert!((time_s / f64::from(t60) - 1.0).abs() < 0.15 && sd_s > 0.0 && sd_s < 0.05, "{time:?}");
        }
    }
}
