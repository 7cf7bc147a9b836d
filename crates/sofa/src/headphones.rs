//! What a pair of headphones needs, from a measurement of it or from a text.

use crate::error::SofaError;
use crate::file::Sofa;
use promenade_audio::file;
use promenade_core::headphones::{HEADPHONE_POINTS, Headphones, HeadphonesError, headphone_point_hz};
use promenade_fourier::Fourier;
use std::path::Path;

/// Rates that responses of headphones may have, Hz.
const RATES_HZ: std::ops::RangeInclusive<f64> = 16_000.0..=192_000.0;
/// Bytes of a text, at most.
const MAX_TEXT: u64 = 1 << 20;
/// Samples of a response that count, at most.
const MAX_FRAMES: usize = 1 << 18;
/// Frequencies over which responses have a level of 0 dB in the mean of both ears, Hz.
const LEVEL_HZ: std::ops::RangeInclusive<f64> = 200.0..=5_000.0;
/// Energy added to a response's, of its mean: no level is raised by more than 20 dB, so that notches, which move when
/// headphones are put on anew, do not become peaks (regularisation: Kirkeby and Nelson 1999; Schärer and Lindau 2009).
const ADDED: f64 = 0.0025;
/// Outside these frequencies nothing is mended: levels there are those of the last that is, Hz.
const MENDED_HZ: (f64, f64) = (30.0, 18_000.0);
/// Up to this share of half the sample rate a response is trusted.
const TRUSTED_SHARE: f64 = 0.92;

/// Reads what headphones need: a SOFA file of headphone responses (convention SimpleHeadphoneIR), inverted for each ear with
/// regularisation, or a text by AutoEq or for Equalizer APO ([`Headphones::from_bytes`]). The mean energy of repeated
/// measurements counts, a sixth of an octave wide.
///
/// # Errors
/// A file that cannot be read, is neither, is damaged, or has a silent ear. The message names the file, what was expected and
/// what found.
pub fn read_headphones(path: &Path) -> Result<Headphones, SofaError> {
    let refused = |e: HeadphonesError| SofaError::entry(path, &e.place, e.expected, e.found);
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("txt")) {
        let bytes = file::read(path, MAX_TEXT).map_err(SofaError::read(path))?;
        return Headphones::from_bytes(&bytes).map_err(refused);
    }
    let sofa = Sofa::open(path)?;
    let rate_hz = sofa.sample_rate_hz()?;
    if !RATES_HZ.contains(&rate_hz) {
        let expected = format!("{} to {} Hz", RATES_HZ.start(), RATES_HZ.end());
        return Err(SofaError::entry(path, "Data.SamplingRate", expected, format!("{rate_hz} Hz")));
    }
    let (mut energies, mut failure, mut transform) = ([Vec::new(), Vec::new()], None, None);
    sofa.of_headphones(|recorded| {
        for (ear, (energy, samples)) in energies.iter_mut().zip(&recorded.channels).enumerate() {
            let name = format!("{}, {} ear", recorded.name, ["left", "right"][ear]);
            if failure.is_some() {
                return;
            }
            if samples.len() > MAX_FRAMES || !samples.iter().all(|v| v.is_finite()) {
                failure = Some((name, "finite samples, at most 262144", "others"));
            } else if samples.iter().all(|v| *v == 0.0) {
                failure = Some((name, "a response", "silence"));
            } else {
                // Bins of at most 3 Hz.
                let length = samples.len().max((rate_hz / 3.0) as usize).next_power_of_two();
                let fourier = transform.get_or_insert_with(|| Fourier::<f64>::new(length));
                let spectrum = fourier.spectrum(samples.iter().copied().map(f64::from));
                energy.resize(spectrum.len(), 0.0);
                energy.iter_mut().zip(&spectrum).for_each(|(sum, x)| *sum += x.norm_sqr());
            }
        }
    })?;
    if let Some((entry, expected, found)) = failure {
        return Err(SofaError::entry(path, &entry, expected, found));
    }
    let bin_hz = 0.5 * rate_hz / (energies[0].len().max(2) - 1) as f64;
    let levels = energies.each_ref().map(|energy| smoothed(energy, bin_hz, TRUSTED_SHARE * 0.5 * rate_hz));
    let mean = mean_level(&levels);
    let needed = levels.map(|energy| {
        energy.map(|energy| {
            let energy = energy / mean;
            (10.0 * (energy / (energy + ADDED).powi(2)).log10()) as f32
        })
    });
    Headphones::from_levels(needed).map_err(refused)
}

/// Energy by point, of a sixth of an octave around it, within what is mended and trusted.
fn smoothed(energy: &[f64], bin_hz: f64, top_hz: f64) -> [f64; HEADPHONE_POINTS] {
    std::array::from_fn(|point| {
        let hz = headphone_point_hz(point).clamp(MENDED_HZ.0, MENDED_HZ.1.min(top_hz));
        let half = 2.0_f64.powf(1.0 / 12.0);
        let at = |hz: f64| ((hz / bin_hz).round() as usize).min(energy.len() - 1);
        let bins = &energy[at(hz / half)..=at(hz * half)];
        bins.iter().sum::<f64>() / bins.len() as f64
    })
}

fn mean_level(levels: &[[f64; HEADPHONE_POINTS]; 2]) -> f64 {
    let within = |point: &usize| LEVEL_HZ.contains(&headphone_point_hz(*point));
    let points: Vec<usize> = (0..HEADPHONE_POINTS).filter(within).collect();
    let logs = levels.iter().flat_map(|ear| points.iter().map(|point| ear[*point].max(1e-30).ln()));
    (logs.sum::<f64>() / (2 * points.len()) as f64).exp()
}
