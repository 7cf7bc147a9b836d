//! A head from a set of head-related responses.

use crate::distance::farthest;
use crate::ears::{Sided, ears_contradict};
use crate::error::SofaError;
use crate::file::{Sofa, SofaOptions};
use crate::recorded::Recorded;
use promenade_core::glam::Vec3;
use promenade_core::head::{HEAD_BANDS, HeadDirection, MAX_HEAD_DIRECTIONS, head_band_hz, lag_s, low_pass_power, spread};
use promenade_core::{Head, HeadError};
use promenade_fourier::Fourier;
use promenade_fourier::num_complex::Complex64;
use std::collections::HashSet;
use std::path::Path;

/// Rates that head-related responses may have, Hz.
const RATES_HZ: std::ops::RangeInclusive<f64> = 16_000.0..=192_000.0;
/// A response counts from so long before its earlier onset on, for so long, and fades out over so long, seconds.
const LEAD_S: f64 = 0.001;
const LENGTH_S: f64 = 0.0075;
const FADE_S: f64 = 0.001;
/// Time that is 0 in lags, from the beginning of the piece on: about where sound is at the head's centre, seconds.
const CENTRE_S: f64 = 0.0014;
/// An onset is the first sample of this share of the peak.
const ONSET_SHARE: f32 = 0.3;
/// Shortest transform, seconds: its bins are at most 94 Hz apart.
const FRAME_S: f64 = 0.0106;
/// Up to this share of half the sample rate levels are taken from the responses; above it the last one holds.
const TRUSTED_SHARE: f64 = 0.92;
/// Below this frequency free fields are seldom free and loudspeakers weak: the level there holds, Hz.
const LOWEST_HZ: f64 = 100.0;
/// Delays are found below this frequency, Hz.
const LOW_HZ: f64 = 6_000.0;
/// The sine of the lateral angle from which on a source is to one side.
const LATERAL: f32 = 0.5;

/// Reads the head that a SOFA file of head-related responses has: any grid of directions, 16 to 192 kHz, delays beside the
/// responses or within them. Larger sets than a head keeps are thinned out evenly.
///
/// # Errors
/// A file that cannot be read, is no SOFA, has other data than impulse responses of two ears, is damaged or incomplete; a
/// silent ear; too few directions, or none on one side; ears that contradict the directions. The message names the file, what
/// was expected and what found.
pub fn read_head(path: &Path) -> Result<Head, SofaError> {
    let sofa = Sofa::open(path)?;
    let towards = sofa.directions()?;
    let distances: Vec<f32> = towards.iter().map(|d| d.length()).collect();
    let (near, note) = farthest(&distances).unzip();
    let kept: HashSet<usize> = {
        let all: Vec<usize> = (0..towards.len()).filter(|i| near.as_ref().is_none_or(|near: &Vec<bool>| near[*i])).collect();
        let directions: Vec<Vec3> = all.iter().map(|i| towards[*i].normalize_or_zero()).collect();
        // A set of one side is mirrored: it has room for half as many.
        let one_sided = directions.iter().all(|d| d.y > -LATERAL) || directions.iter().all(|d| d.y < LATERAL);
        let most = if one_sided { MAX_HEAD_DIRECTIONS / 2 } else { MAX_HEAD_DIRECTIONS };
        if all.len() > most {
            spread(&directions, most).into_iter().map(|i| all[i]).collect()
        } else {
            all.into_iter().collect()
        }
    };
    let sample_rate_hz = sofa.sample_rate_hz()?;
    if !RATES_HZ.contains(&sample_rate_hz) {
        let expected = format!("{} to {} Hz", RATES_HZ.start(), RATES_HZ.end());
        return Err(SofaError::entry(path, "Data.SamplingRate", expected, format!("{sample_rate_hz} Hz")));
    }
    let analysis = Analysis::new(sample_rate_hz);
    let (mut spectra, mut failure, mut number) = (Vec::new(), None, 0);
    let (about, exchanged) = sofa.of_ears(SofaOptions::default(), |recorded| {
        let here = number;
        number += 1;
        if failure.is_some() || !kept.contains(&here) {
            return;
        }
        match analysis.spectra(&recorded) {
            Ok(one) => spectra.push(one),
            Err((entry, expected, found)) => failure = Some(SofaError::entry(path, &entry, expected, found)),
        }
    })?;
    if let Some(failure) = failure {
        return Err(failure);
    }
    let mut measured = analysis.delays(spectra);
    if contradicts(&measured) {
        if !exchanged {
            let expected = "ears that agree with the directions";
            return Err(SofaError::content(
                path,
                expected,
                "sources on one side that are earlier and louder at the ear of the other",
            ));
        }
        // The order of the receivers was labelled wrongly.
        for m in &mut measured {
            m.delays_s.reverse();
            m.levels_db.reverse();
        }
    }
    let head = |source: HeadError| SofaError::at(path, "no head")(source);
    let name = note.map_or_else(|| about.title.clone(), |note| format!("{} ({note})", about.title));
    Head::new(&name, &about.credit, measured).map_err(head)
}

fn contradicts(measured: &[HeadDirection]) -> bool {
    let sided = measured.iter().filter_map(|m| {
        let lateral = m.direction.try_normalize()?.y;
        let mean = |ear: usize| f64::from(m.levels_db[ear][HEAD_BANDS / 2..].iter().sum::<f32>()) / (HEAD_BANDS / 2) as f64;
        let (itd_s, ild_db) = (f64::from(m.delays_s[0] - m.delays_s[1]), mean(0) - mean(1));
        (lateral.abs() > LATERAL).then_some(Sided { lateral, itd_s, ild_db })
    });
    ears_contradict(sided)
}

/// What a response of one direction says before all are known.
struct Spectra {
    direction: Vec3,
    levels_db: [[f32; HEAD_BANDS]; 2],
    /// Bins below [`LOW_HZ`], left and right.
    low: [Vec<Complex64>; 2],
}

/// What is wrong with an entry: its name, what was expected and what was found.
type Wrong = (String, &'static str, String);

/// Measures responses of one sample rate.
struct Analysis {
    sample_rate_hz: f64,
    n_fft: usize,
    fourier: Fourier<f64>,
    /// Bins of each band with their weights, which sum to 1.
    bands: Vec<Vec<(usize, f64)>>,
}

impl Analysis {
    fn new(sample_rate_hz: f64) -> Self {
        let n_fft = ((FRAME_S * sample_rate_hz).ceil() as usize).next_power_of_two();
        let bin_hz = sample_rate_hz / n_fft as f64;
        let top_hz = TRUSTED_SHARE * 0.5 * sample_rate_hz;
        let bands = (0..HEAD_BANDS).map(|band| {
            let centre = head_band_hz(band).clamp(LOWEST_HZ, top_hz);
            // Bands narrower than the bins take what lies between these.
            let reach = (head_band_hz(band + 1) - head_band_hz(band)).max(bin_hz).min(top_hz);
            let share = |k: usize| (1.0 - (k as f64 * bin_hz - centre).abs() / reach).max(0.0);
            let all: Vec<(usize, f64)> = (0..=n_fft / 2).map(|k| (k, share(k))).filter(|(_, w)| *w > 0.0).collect();
            let sum: f64 = all.iter().map(|(_, w)| w).sum();
            all.into_iter().map(|(k, w)| (k, w / sum)).collect()
        });
        Self { sample_rate_hz, n_fft, fourier: Fourier::new(n_fft), bands: bands.collect() }
    }

    fn spectra(&self, recorded: &Recorded) -> Result<Spectra, Wrong> {
        let name = &recorded.name;
        let towards = recorded.source.map(|source| recorded.listener.to_head(source)).unwrap_or_default();
        if !towards.is_finite() || towards.length() < 1e-3 {
            return Err((name.clone(), "a source apart from the head", format!("{towards}")));
        }
        let [left, right] = &recorded.channels[..] else {
            return Err((name.clone(), "two ears", recorded.channels.len().to_string()));
        };
        let mut onset = usize::MAX;
        for (ear, samples) in [("left", left), ("right", right)] {
            if let Some(at) = samples.iter().position(|v| !v.is_finite()) {
                return Err((format!("{name}, {ear} ear, sample {at}"), "a finite number", samples[at].to_string()));
            }
            let peak = samples.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
            let found = samples.iter().position(|v| peak > 0.0 && v.abs() >= ONSET_SHARE * peak);
            let silent = || (format!("{name}, {ear} ear"), "a response", "silence".to_owned());
            onset = onset.min(found.ok_or_else(silent)?);
        }
        let samples = |seconds: f64| (seconds * self.sample_rate_hz).round() as usize;
        // What lies before the file's first sample is silence.
        let start = onset as i64 - samples(LEAD_S) as i64;
        let (length, fade, centre) = (samples(LENGTH_S), samples(FADE_S), samples(CENTRE_S));
        let spectra = [left, right].map(|ear| {
            let mut piece = vec![0.0; self.n_fft];
            for i in 0..length {
                let sample = usize::try_from(start + i as i64).ok().and_then(|at| ear.get(at)).copied().unwrap_or(0.0);
                let left = (length - i) as f64 / fade as f64;
                let window = if left < 1.0 { (0.5 * std::f64::consts::PI * left).sin().powi(2) } else { 1.0 };
                // The centre is time 0; what comes before it lies at the end.
                piece[(self.n_fft + i - centre) % self.n_fft] = window * f64::from(sample);
            }
            self.fourier.spectrum(piece)
        });
        let levels_db = spectra.each_ref().map(|spectrum| {
            std::array::from_fn(|band| {
                let energy: f64 = self.bands[band].iter().map(|(k, w)| w * spectrum[*k].norm_sqr()).sum();
                (10.0 * energy.max(1e-30).log10()) as f32
            })
        });
        let low_bins = (LOW_HZ / self.hz(1)) as usize;
        let low = spectra.map(|spectrum| spectrum[..low_bins.min(spectrum.len())].to_vec());
        Ok(Spectra { direction: towards, levels_db, low })
    }

    fn hz(&self, bin: usize) -> f64 {
        bin as f64 * self.sample_rate_hz / self.n_fft as f64
    }

    /// Delays of all directions, equalised for a diffuse field: what is loud in all of them says no more than what is soft.
    fn delays(&self, all: Vec<Spectra>) -> Vec<HeadDirection> {
        let bins = all.first().map_or(0, |one| one.low[0].len());
        let energy =
            |k: usize| all.iter().flat_map(|one| &one.low).map(|ear| ear[k].norm_sqr()).sum::<f64>() / (2 * all.len()) as f64;
        let weights: Vec<f64> = (0..bins).map(|k| low_pass_power(self.hz(k)) / energy(k).max(1e-30)).collect();
        let lag = |cross: &mut dyn Iterator<Item = (usize, Complex64)>| lag_s(cross.map(|(k, x)| (self.hz(k), x)));
        let delayed = |Spectra { direction, levels_db, low }: Spectra| {
            let alone = |ear: usize| lag(&mut low[ear].iter().enumerate().map(|(k, x)| (k, weights[k].sqrt() * x)));
            let mean = 0.5 * (alone(0) + alone(1));
            let apart = lag(&mut low[0].iter().zip(&low[1]).enumerate().map(|(k, (l, r))| (k, weights[k] * l * r.conj())));
            HeadDirection { direction, delays_s: [mean + 0.5 * apart, mean - 0.5 * apart].map(|d| d as f32), levels_db }
        };
        all.into_iter().map(delayed).collect()
    }
}
