//! Auditory saliency: how much each moment of a sound stands out from what is around it in time and frequency.
//!
//! After Kayser, Petkov, Lippert and Logothetis, "Mechanisms for allocating auditory attention: an auditory saliency map",
//! Current Biology 15 (2005). Where the paper's text leaves a number open, the constants here say what was taken.

mod budget;
mod weights;

pub use budget::SampleBudget;
pub use weights::picture_weights;

use crate::{MetricError, Spectrogram, Window};

/// Rate of the sound, Hz.
pub const SALIENCY_RATE_HZ: u32 = 16_000;
/// From one value to the next, seconds.
pub const SALIENCY_STEP_S: f64 = 0.002;

/// Frames of 1 ms, windows of 37 ms.
const SPECTROGRAM: Spectrogram = Spectrogram { n_fft: 1024, hop: 16, window_length: 592, window: Window::Hann };
/// Magnitudes this far below that of a sine as high as the sound's peak are as silence.
const FLOOR: f64 = 1e-4;
/// Each half as fine as the one before.
const SCALES: usize = 4;
/// Which scale stands out from which coarser one.
const PAIRS: [(usize, usize); 5] = [(0, 1), (1, 2), (2, 3), (0, 2), (1, 3)];
/// Intensity, contrast in frequency and contrast in time.
const FEATURES: usize = 3;
/// Frames from a sound to the excitation by it. The maps are moved back by it at every scale, so that scales can be compared.
const LATENCY: usize = 24;
/// Frames that are made at a time, and around them those that they depend on: whole blocks of all scales and of the maps.
const SECTION: usize = 24 * 300;
const MARGIN: usize = 4 * 300;
/// A block of the maps is held against the largest value from before to after its beginning, values of 2 ms.
const BLOCK: usize = 75;
const BEFORE: usize = 75;
const AFTER: usize = 75;

/// How much each moment stands out: the largest value of the saliency map over all frequencies, from the beginning on every
/// [`SALIENCY_STEP_S`]. It has no unit; a sound that is louder by a factor has the same values.
///
/// Shape: one value for each 32 samples, rounded up. Sound at [`SALIENCY_RATE_HZ`].
///
/// # Errors
/// A silent sound.
pub fn saliency(sound: &[f32]) -> Result<Vec<f64>, MetricError> {
    let peak = sound.iter().fold(0.0_f32, |peak, sample| peak.max(sample.abs()));
    if peak <= 0.0 {
        return Err(MetricError::Silent);
    }
    let floor = floor(peak);
    let frames = sound.len().div_ceil(SPECTROGRAM.hop);
    let mut trace = Vec::with_capacity(frames.div_ceil(2));
    for from in (0..frames).step_by(SECTION) {
        let first = from.saturating_sub(MARGIN);
        let last = frames.min(from + SECTION + MARGIN);
        let map = map(Image::of(&sound[first * SPECTROGRAM.hop..sound.len().min(last * SPECTROGRAM.hop)], floor));
        trace.extend(map.rows().skip((from - first) / 2).take(SECTION / 2).map(largest));
    }
    trace.truncate(frames.div_ceil(2));
    Ok(trace)
}

/// The magnitude that is as silence in a sound of a peak: that of a sine is half of the window's sum, and that half of its
/// length.
fn floor(peak: f32) -> f64 {
    FLOOR * f64::from(peak) * 0.25 * SPECTROGRAM.window_length as f64
}

/// Numbers by time and frequency, row after row.
struct Image {
    columns: usize,
    values: Vec<f32>,
}

impl Image {
    /// The logarithms of a sound's magnitudes over a floor, a row for each frame.
    fn of(sound: &[f32], floor: f64) -> Self {
        let columns = SPECTROGRAM.n_fft / 2;
        let magnitudes = SPECTROGRAM.magnitudes(sound);
        // The last bin is left out: what remains can be halved.
        let rows = magnitudes.chunks_exact(columns + 1).take(sound.len().div_ceil(SPECTROGRAM.hop));
        let values = rows.flat_map(|row| &row[..columns]).map(|magnitude| (magnitude.max(floor) / floor).ln() as f32);
        Self { columns, values: values.collect() }
    }

    fn rows(&self) -> impl Iterator<Item = &[f32]> {
        self.values.chunks_exact(self.columns)
    }

    /// Every second value of every second row.
    fn halved(&self) -> Self {
        let values = self.rows().step_by(2).flat_map(|row| row.iter().step_by(2).copied());
        Self { columns: self.columns / 2, values: values.collect() }
    }

    /// Each row smeared by taps around its middle one, mirrored at its ends.
    fn along_rows(&self, taps: &[f32]) -> Self {
        let half = taps.len() / 2;
        let mut values = vec![0.0; self.values.len()];
        let mut mirrored = vec![0.0; self.columns + 2 * half];
        for (out, row) in values.chunks_exact_mut(self.columns).zip(self.rows()) {
            mirrored[half..half + self.columns].copy_from_slice(row);
            for i in 0..half {
                mirrored[half - 1 - i] = row[i.min(self.columns - 1)];
                mirrored[half + self.columns + i] = row[self.columns.saturating_sub(1 + i)];
            }
            for (i, tap) in taps.iter().enumerate() {
                add_scaled(out, &mirrored[i..i + self.columns], *tap);
            }
        }
        Self { columns: self.columns, values }
    }

    /// Each column filtered by taps, the last of which is the newest, as the excitation comes to lie on its sound; then without
    /// signs.
    fn along_columns(&self, taps: &[f32]) -> Self {
        let count = self.values.len() / self.columns;
        let row_at = |row: usize| &self.values[row * self.columns..(row + 1) * self.columns];
        let mut values = vec![0.0; self.values.len()];
        for (row, out) in values.chunks_exact_mut(self.columns).enumerate() {
            for (i, tap) in taps.iter().enumerate() {
                // Beyond both ends it is as at them.
                let from = (row + LATENCY + i + 1).saturating_sub(taps.len()).min(count - 1);
                add_scaled(out, row_at(from), *tap);
            }
            out.iter_mut().for_each(|value| *value = value.abs());
        }
        Self { columns: self.columns, values }
    }
}

fn add_scaled(sum: &mut [f32], values: &[f32], scale: f32) {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += scale * value;
    }
}

fn largest(values: &[f32]) -> f64 {
    f64::from(values.iter().copied().fold(0.0, f32::max))
}

/// The saliency of a spectrogram, half as fine as it.
fn map(spectrogram: Image) -> Image {
    let filters = Filters::new();
    let mut features: [Vec<Image>; FEATURES] = Default::default();
    let mut input = spectrogram;
    for scale in 0..SCALES {
        for (scales, image) in features.iter_mut().zip(filters.features(&input)) {
            // The finest is kept half as fine, as the map is.
            scales.push(if scale == 0 { image.halved() } else { image });
        }
        input = input.halved();
    }
    let finest = &features[0][0];
    let mut sum = Image { columns: finest.columns, values: vec![0.0; finest.values.len()] };
    for scales in &features {
        for (centre, surround) in PAIRS {
            let mut above = difference([&scales[centre], &scales[surround]], [centre, surround].map(steps), &sum);
            promote_few(&mut above);
            add_scaled(&mut sum.values, &above.values, 1.0);
        }
    }
    sum
}

/// Rows and columns of the maps to one of a scale.
fn steps(scale: usize) -> usize {
    1 << scale.saturating_sub(1)
}

/// By how much the first image is above the second, 0 where it is below, as fine as a third; `steps` are values of the third to
/// one of each.
fn difference(images: [&Image; 2], steps: [usize; 2], like: &Image) -> Image {
    let at = |which: usize, row: usize, column: usize| {
        let (image, step) = (images[which], steps[which]);
        image.values[row / step * image.columns + column / step]
    };
    let places = (0..like.values.len()).map(|place| (place / like.columns, place % like.columns));
    let values = places.map(|(row, column)| (at(0, row, column) - at(1, row, column)).max(0.0));
    Image { columns: like.columns, values: values.collect() }
}

/// Scales each block to its largest value, less where it has other maxima nearly as large: few peaks are promoted over many.
fn promote_few(map: &mut Image) {
    let rows = map.values.len() / map.columns;
    let held = Image { columns: map.columns, values: map.values.clone() };
    let peaks = maxima(&held);
    for from in (0..rows).step_by(BLOCK) {
        let window = from.saturating_sub(BEFORE)..rows.min(from + AFTER);
        let most = held.values[window.start * map.columns..window.end * map.columns].iter().copied().fold(0.0, f32::max);
        let others = peaks.iter().filter(|(row, value)| window.contains(row) && *value < most);
        let (count, total) = others.fold((0.0, 0.0), |(count, total), (_, value)| (count + 1.0, total + value));
        let mean = total / f32::max(count, 1.0);
        let gain = if most > 0.0 { (1.0 - mean / most).powi(2) / most } else { 0.0 };
        let end = rows.min(from + BLOCK);
        map.values[from * map.columns..end * map.columns].iter_mut().for_each(|value| *value *= gain);
    }
}

/// Rows and values of what is larger than all eight neighbours.
fn maxima(image: &Image) -> Vec<(usize, f32)> {
    let rows = image.values.len() / image.columns;
    let mut found = Vec::new();
    for row in 1..rows.saturating_sub(1) {
        for column in 1..image.columns - 1 {
            let value = image.values[row * image.columns + column];
            let around = |row: usize| &image.values[row * image.columns + column - 1..row * image.columns + column + 2];
            let (above, beside, below) = (around(row - 1), around(row), around(row + 1));
            let less = |other: &f32| *other < value;
            if value > 0.0 && less(&beside[0]) && less(&beside[2]) && above.iter().all(less) && below.iter().all(less) {
                found.push((row, value));
            }
        }
    }
    found
}

/// Profiles of the three filters: over 45 bins, and over 80 frames that have been.
struct Filters {
    narrow: Vec<f32>,
    sidebands: Vec<f32>,
    excitation: Vec<f32>,
    inhibited: Vec<f32>,
}

impl Filters {
    fn new() -> Self {
        // The filter's own axis of frequency, 1 in its middle.
        let over_bins = |shape: &dyn Fn(f64) -> f64| unit((0..45).map(|i| shape((f64::from(i) - 22.0) / 32.0)));
        let bell = |x: f64, width: f64| (-0.5 * (x / width).powi(2)).exp();
        // Milliseconds before the newest frame.
        let over_frames = |shape: &dyn Fn(f64) -> f64| unit((0..80).map(|i| shape(79.0 - f64::from(i))));
        let excitation = |ms: f64| bell(ms - LATENCY as f64, 5.0);
        Self {
            narrow: over_bins(&|f| bell(f, 0.14)),
            sidebands: over_bins(&|f| bell(f, 0.32) * (std::f64::consts::TAU * f).cos()),
            excitation: over_frames(&excitation),
            inhibited: over_frames(&|ms| excitation(ms) - 0.5 * bell(ms - 50.0, 6.5)),
        }
    }

    /// Intensity, contrast in frequency and contrast in time.
    fn features(&self, image: &Image) -> [Image; FEATURES] {
        let narrow = image.along_rows(&self.narrow);
        [
            narrow.along_columns(&self.excitation),
            image.along_rows(&self.sidebands).along_columns(&self.excitation),
            narrow.along_columns(&self.inhibited),
        ]
    }
}

/// Taps whose sum is 1.
fn unit(taps: impl Iterator<Item = f64>) -> Vec<f32> {
    let taps: Vec<f64> = taps.collect();
    let sum = taps.iter().sum::<f64>().abs();
    taps.into_iter().map(|tap| (tap / sum) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_testing::Noise;
    use std::f64::consts::TAU;

    const RATE: f64 = SALIENCY_RATE_HZ as f64;

    /// Noise, and a tone of 1 kHz with an envelope that is given by the time in seconds.
    fn sound(seconds: f64, noise: f64, tone: impl Fn(f64) -> f64) -> Vec<f32> {
        let mut random = Noise::new(3);
        let sample = |i: usize| {
            let t = i as f64 / RATE;
            (noise * f64::from(random.next().unwrap_or_default()) + tone(t) * (TAU * 1000.0 * t).sin()) as f32
        };
        (0..(seconds * RATE) as usize).map(sample).collect()
    }

    /// The mean over a stretch of time.
    fn mean(trace: &[f64], from_s: f64, to_s: f64) -> f64 {
        let within = &trace[(from_s / SALIENCY_STEP_S) as usize..(to_s / SALIENCY_STEP_S) as usize];
        within.iter().sum::<f64>() / within.len() as f64
    }

    fn burst(t: f64, from_s: f64, to_s: f64) -> f64 {
        if (from_s..to_s).contains(&t) { 0.3 } else { 0.0 }
    }

    #[test]
    fn tones_stand_out_of_noise_long_ones_for_longer_and_the_second_of_two_less() {
        let trace = saliency(&sound(4.5, 0.05, |t| {
            burst(t, 1.0, 1.05) + burst(t, 2.0, 2.4) + burst(t, 3.4, 3.45) + burst(t, 3.5, 3.55)
        }))
        .unwrap();
        let noise = mean(&trace, 0.2, 0.8);
        let (short, long) = (mean(&trace, 1.0, 1.05), mean(&trace, 2.0, 2.4));
        assert!(short > 1.8 * noise && long > 1.4 * noise, "{noise}, {short}, {long}");
        assert!(mean(&trace, 2.0, 2.5) > 1.3 * mean(&trace, 1.0, 1.5), "a long tone");
        let (first, second) = (mean(&trace, 3.4, 3.45), mean(&trace, 3.5, 3.55));
        assert!(second < 0.9 * first && second > noise, "forward masking: {first}, {second}");
    }

    #[test]
    fn the_ends_of_a_gap_in_noise_stand_out() {
        let mut signal = sound(3.0, 0.1, |_| 0.0);
        signal[(1.5 * RATE) as usize..(1.6 * RATE) as usize].fill(0.0);
        let trace = saliency(&signal).unwrap();
        let [noise, begins, gap, ends] =
            [(0.5, 1.3), (1.48, 1.5), (1.52, 1.56), (1.6, 1.62)].map(|(from, to)| mean(&trace, from, to));
        assert!(begins > 1.3 * noise && ends > 1.3 * noise && gap < 0.5 * noise, "{noise}, {begins}, {gap}, {ends}");
    }

    #[test]
    fn neither_level_nor_length_changes_a_moment() {
        let seconds = 1.5 * SECTION as f64 / 1000.0;
        let long = sound(seconds, 0.05, |t| burst(t, 7.0, 7.3));
        let louder: Vec<f32> = long.iter().map(|sample| 4.0 * sample).collect();
        let (trace, louder) = (saliency(&long).unwrap(), saliency(&louder).unwrap());
        let error = |a: f64, b: f64| (a - b).abs() / a.max(1.0);
        assert_eq!(trace.len(), long.len().div_ceil(32));
        assert!(trace.iter().zip(&louder).all(|(a, b)| error(*a, *b) < 1e-3));
        let peak = long.iter().fold(0.0_f32, |peak, sample| peak.max(sample.abs()));
        let whole = map(Image::of(&long, floor(peak)));
        let apart = trace.iter().zip(whole.rows().map(largest)).map(|(a, b)| error(*a, b)).fold(0.0, f64::max);
        assert!(apart < 1e-3, "{apart} between a sound in sections and one at once");
    }

    #[test]
    fn silence_has_none() {
        assert_eq!(saliency(&[0.0; 1000]), Err(MetricError::Silent));
        assert!(saliency(&[0.5]).unwrap().iter().all(|value| value.is_finite()), "one sample");
    }
}
