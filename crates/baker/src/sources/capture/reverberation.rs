//! Reverberation times from recordings beside their dry sound.

use super::{Capture, Split};
use crate::signal::spectrum::Analyser;
use nalgebra::{DMatrix, DVector};
use promenade_core::{Bands, StftGrid};

/// Seconds of dry sound before a clip that still sound in it.
const PRE_ROLL_S: f64 = 1.5;
/// Clips that are enough.
const MOST_CLIPS: usize = 200;
/// Reverberation times that are tried, seconds: from the shortest, each longer by the ratio.
const SHORTEST_S: f64 = 0.1;
const RATIO: f64 = 1.15;
const TRIED: usize = 29;
/// Energies below this share of a clip's highest are no more exact than it.
const FLOOR: f64 = 1e-4;
/// Mean squares of dry and recorded sound below this are silence.
const SILENT: f64 = 1e-12;

/// Reverberation time per band, seconds, estimated from the training clips; `None` for a band in which nothing sounds.
///
/// The energy of a band in a frame of a recording is taken as that of the dry sound's frame, that of an exponential decay after
/// all frames before it, and a constant, each with a factor of its own per clip that is not negative. Of the times tried, the
/// one with the least squares of relative deviations over all clips is refined by a parabola through its neighbours.
#[must_use]
pub fn reverberation_times(capture: &Capture, grid: &StftGrid, bands: &Bands) -> Vec<Option<f32>> {
    let times: Vec<f64> = (0..TRIED).map(|i| SHORTEST_S * RATIO.powf(i as f64)).collect();
    let mut costs = vec![[0.0; TRIED]; bands.count()];
    let mut heard = vec![0_usize; bands.count()];
    let pre_roll = (PRE_ROLL_S * grid.sample_rate_hz) as usize / grid.hop * grid.hop;
    let energies = Energies::new(*grid, bands);
    let every = capture.split(Split::Train).count().div_ceil(MOST_CLIPS).max(1);
    for clip in capture.split(Split::Train).step_by(every) {
        let dry = energies.of(&capture.dry(clip, pre_roll));
        let [left, right] = capture.binaural(clip).map(|ear| energies.of(ear));
        let before = pre_roll / grid.hop;
        for band in 0..bands.count() {
            let dry: Vec<f64> = dry.iter().map(|frame| frame[band]).collect();
            let wet: Vec<f64> = left.iter().zip(&right).map(|(l, r)| l[band] + r[band]).collect();
            let loudest = |x: &[f64]| x.iter().copied().fold(0.0, f64::max);
            if loudest(&dry) < SILENT || loudest(&wet) < SILENT {
                continue;
            }
            heard[band] += 1;
            for (cost, time) in costs[band].iter_mut().zip(&times) {
                *cost += misfit(&dry, &wet, before, 10.0_f64.powf(-6.0 * grid.hop_s() / time));
            }
        }
    }
    let least = |costs: &[f64; TRIED]| {
        let at = (0..TRIED).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).unwrap_or(0);
        let [a, b, c] = [at.saturating_sub(1), at, (at + 1).min(TRIED - 1)].map(|i| costs[i]);
        let bend = a - 2.0 * b + c;
        let beside = if at == 0 || at == TRIED - 1 || bend <= 0.0 { 0.0 } else { 0.5 * (a - c) / bend };
        (SHORTEST_S * RATIO.powf(at as f64 + beside)) as f32
    };
    costs.iter().zip(heard).map(|(costs, heard)| (heard > 0).then(|| least(costs))).collect()
}

/// Mean squares of a signal by frame and band.
struct Energies<'a> {
    grid: StftGrid,
    bands: &'a Bands,
    analyser: Analyser,
    window: Vec<f64>,
}

impl<'a> Energies<'a> {
    fn new(grid: StftGrid, bands: &'a Bands) -> Self {
        let n = grid.n_fft;
        let window = (0..n).map(|i| 0.5 - 0.5 * (std::f64::consts::TAU * i as f64 / n as f64).cos()).collect();
        Self { grid, bands, analyser: Analyser::new(grid), window }
    }

    fn of(&self, signal: &[f32]) -> Vec<Vec<f64>> {
        let frames = signal.windows(self.grid.n_fft).step_by(self.grid.hop);
        let scale = 1.0 / (self.grid.n_fft as f64).powi(2);
        frames
            .map(|frame| {
                let piece: Vec<f64> = frame.iter().zip(&self.window).map(|(x, w)| f64::from(*x) * w).collect();
                let mut energies = vec![0.0; self.bands.count()];
                for (k, x) in self.analyser.spectrum(&piece).iter().enumerate() {
                    for (band, weight) in self.bands.weights(self.grid.bin_hz(k) as f32) {
                        energies[band] += scale * f64::from(weight) * x.norm_sqr();
                    }
                }
                energies
            })
            .collect()
    }
}

/// What is left of a clip's energies, as a mean of squared relative deviations, where they decay by `per_hop` from hop to hop.
/// The dry sound begins `before` frames earlier.
fn misfit(dry: &[f64], wet: &[f64], before: usize, per_hop: f64) -> f64 {
    let mut decay = 0.0;
    let mut parts = Vec::with_capacity(wet.len());
    for (t, x) in dry.iter().enumerate() {
        if let Some(y) = t.checked_sub(before).and_then(|t| wet.get(t)) {
            parts.push((*y, [*x, decay, 1.0]));
        }
        decay = per_hop * (decay + x);
    }
    let floor = FLOOR * wet.iter().copied().fold(0.0, f64::max);
    let mut products = [[0.0; 4]; 4];
    for (y, x) in &parts {
        let weight = 1.0 / (y + floor);
        let row = [x[0] * weight, x[1] * weight, x[2] * weight, y * weight];
        for (products, a) in products.iter_mut().zip(row) {
            products.iter_mut().zip(row).for_each(|(p, b)| *p += a * b);
        }
    }
    least_squares(&products) / parts.len().max(1) as f64
}

/// The least sum of squares of `y - f x` over factors f of 0 or more, from the products of the three parts of x and of y: the
/// best choice of parts whose factors are all 0 or more.
fn least_squares(products: &[[f64; 4]; 4]) -> f64 {
    let mut best = products[3][3];
    for choice in 1..8_usize {
        let parts: Vec<usize> = (0..3).filter(|i| choice >> i & 1 == 1).collect();
        if let Some(factors) = solve(&parts, products).filter(|f| f.iter().all(|f| *f >= 0.0)) {
            let explained: f64 = factors.iter().zip(&parts).map(|(f, i)| f * products[*i][3]).sum();
            best = best.min(products[3][3] - explained);
        }
    }
    best.max(0.0)
}

/// Solves the normal equations of some parts; `None` where they depend on each other.
fn solve(parts: &[usize], products: &[[f64; 4]; 4]) -> Option<DVector<f64>> {
    let n = parts.len();
    let system = DMatrix::from_fn(n, n, |i, j| products[parts[i]][parts[j]]);
    let wanted = DVector::from_fn(n, |i, _| products[parts[i]][3]);
    let factor = system.clone().cholesky()?;
    let pivot = |i: usize| factor.l_dirty()[(i, i)].powi(2);
    (0..n).all(|i| pivot(i) > 1e-12 * system[(i, i)]).then(|| factor.solve(&wanted))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::convolve::convolve;
    use crate::sources::capture::{Clip, Track, Voice};
    use promenade_core::random::Random;
    use promenade_core::{CameraPath, Keyframe, Pose};

    const RATE: f64 = 16_000.0;

    /// Bursts of noise in a room whose sound decays by 60 dB in `t60_s`, as far below the direct sound as `room`.
    fn capture(t60_s: f64, room: f32) -> Capture {
        let mut random = Random::new(3);
        let len = 6 * 16_000;
        let dry: Vec<f32> = (0..len).map(|i| if i % 7919 < 1500 { 0.3 * random.normal() } else { 0.0 }).collect();
        let tail = 24_000;
        let mut response = || -> Vec<f32> {
            let decay = |i: usize| 10.0_f64.powf(-3.0 * i as f64 / (t60_s * RATE)) as f32;
            (0..tail).map(|i| if i == 0 { 1.0 } else { room * decay(i) * random.normal() }).collect()
        };
        let responses = [response(), response()];
        let wet = convolve(&dry, responses.each_ref().map(Vec::as_slice));
        let binaural = wet.map(|ear| ear[..len].iter().map(|x| x + 1e-5 * random.normal()).collect());
        let clip = |i: usize| Clip {
            name: format!("{i}"),
            track: 0,
            start: i * 16_000,
            len: 16_000,
            pose: Pose::IDENTITY,
            split: Split::Train,
        };
        let path = CameraPath::new(vec![Keyframe { t_s: 0.0, pose: Pose::IDENTITY }]).unwrap();
        Capture {
            sample_rate_hz: RATE,
            clips: (0..6).map(clip).collect(),
            tracks: vec![Track { name: String::new(), voices: vec![Voice { emitter: None, dry }], binaural, path }],
            ..Capture::default()
        }
    }

    #[test]
    fn rooms_have_their_reverberation_times() {
        let grid = StftGrid::four_hops(RATE, 93.0);
        let bands = Bands::for_rate(RATE);
        for t60 in [0.25, 0.6, 1.2] {
            let found = reverberation_times(&capture(t60, 0.02), &grid, &bands);
            let ratios: Vec<f64> = found.iter().map(|t| f64::from(t.unwrap()) / t60).collect();
            let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
            assert!((mean - 1.0).abs() < 0.08, "{mean} times {t60} s");
            assert!(ratios.iter().all(|r| (r - 1.0).abs() < 0.3), "{ratios:?} times {t60} s");
        }
    }

    #[test]
    fn silence_has_none() {
        let mut capture = capture(0.5, 0.02);
        capture.tracks[0].voices[0].dry.fill(0.0);
        let grid = StftGrid::four_hops(RATE, 93.0);
        assert!(reverberation_times(&capture, &grid, &Bands::for_rate(RATE)).iter().all(Option::is_none));
    }
}
