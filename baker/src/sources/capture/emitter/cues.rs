//! The direct sound of one clip, found with the help of the dry sound: the cues to where the sound came from.

use promenade_fourier::num_complex::Complex64;
use promenade_fourier::{signal, spectrum};
use promenade_metrics::running_itd_s;

/// Dry sound before a clip that still sounds in it, seconds.
pub(super) const PRE_ROLL_S: f64 = 0.25;
/// The direct sound comes within this of the dry sound, before it where the two are badly aligned, seconds.
const EARLIEST_S: f64 = -0.03;
const LATEST_S: f64 = 0.15;
/// Band of the transfer that is estimated, hertz.
const LOWEST_HZ: f64 = 150.0;
const HIGHEST_HZ: f64 = 7000.0;
/// Dry sound weaker than this share of its mean power does not count.
const REGULARISATION: f64 = 0.03;
/// The first arrival is the first at least so strong, a share of the strongest one's power.
const FIRST: f64 = 0.3;
/// What is cut out around an arrival, seconds before and after it.
const BEFORE_S: f64 = 0.0015;
const AFTER_S: f64 = 0.0020;
/// Share of the time before an arrival over which the cut has soft edges.
const EDGE: f64 = 0.3;
/// Energies are summed over this on both sides; an arrival rises to its peak within the second, seconds.
const SMOOTH_S: f64 = 0.0003;
const RISE_S: f64 = 0.0008;

/// The direct sound of a clip.
#[derive(Clone, Copy, Debug)]
pub(super) struct Direct {
    /// Seconds, positive = left ear later.
    pub(super) delay_s: f64,
    /// Energy of both ears' responses, dB.
    pub(super) level_db: f64,
    /// Seconds after the dry sound, mean of both ears.
    pub(super) arrival_s: f64,
    /// How far it stands out of the mean of what comes before and after, dB.
    pub(super) clarity_db: f64,
}

/// The direct sound of what the ears heard of a dry sound that begins `pre_roll` samples earlier; `None` where nothing stands out.
///
/// Each ear is divided by the dry sound, with regularisation where the dry sound is weak. The first strong arrival is cut out of both
/// responses, and its delay between them is measured ([`running_itd_s`]).
pub(super) fn direct(dry: &[f32], pre_roll: usize, ears: [&[f32]; 2], rate: f64) -> Option<Direct> {
    let length = (2 * dry.len()).next_power_of_two();
    let x = spectrum(dry.iter().map(|&v| f64::from(v)), length);
    let hz = |k: usize| k as f64 * rate / length as f64;
    let inside = |k: usize| (LOWEST_HZ..=HIGHEST_HZ.min(0.45 * rate)).contains(&hz(k));
    let powers: Vec<f64> = x.iter().enumerate().filter(|(k, _)| inside(*k)).map(|(_, x)| x.norm_sqr()).collect();
    let floor = REGULARISATION * powers.iter().sum::<f64>() / powers.len().max(1) as f64;
    if floor <= 0.0 {
        return None;
    }
    let responses = ears.map(|ear| {
        let late = std::iter::repeat_n(0.0, pre_roll).chain(ear.iter().map(|&v| f64::from(v)));
        let mut transfer = spectrum(late, length);
        for (k, (y, x)) in transfer.iter_mut().zip(&x).enumerate() {
            *y = if inside(k) { *y * x.conj() / (x.norm_sqr() + floor) } else { Complex64::default() };
        }
        Periodic(signal(transfer, length))
    });
    let power = |i: i64| responses.iter().map(|h| h.at(i).powi(2)).sum::<f64>();
    let [first, last, before, after] = [EARLIEST_S, LATEST_S, BEFORE_S, AFTER_S].map(|s| samples(s, rate));
    let half = samples(SMOOTH_S, rate).max(1);
    let smooth: Vec<f64> = (first..last).map(|i| (i - half..=i + half).map(power).sum()).collect();
    let strongest = smooth.iter().copied().fold(0.0, f64::max);
    let mean = smooth.iter().sum::<f64>() / smooth.len().max(1) as f64;
    let onset = smooth.iter().position(|p| *p >= FIRST * strongest)?;
    let until = (onset + (RISE_S * rate) as usize + 1).min(smooth.len());
    let peak = (onset..until).max_by(|a, b| smooth[*a].total_cmp(&smooth[*b]))?;
    let centre = first + i64::try_from(peak).ok()?;
    let pieces = responses.each_ref().map(|h| -> Vec<f64> {
        let window = |i: i64| {
            let inside = (i + before).min(after - i) as f64 / (EDGE * before as f64);
            (0.5 * std::f64::consts::PI * inside.min(1.0)).sin().powi(2)
        };
        (-before..=after).map(|i| window(i) * h.at(centre + i)).collect()
    });
    let energy: f64 = pieces.iter().flatten().map(|v| v * v).sum();
    // What the regularisation leaves of a response of energy 1.
    let kept = powers.iter().map(|x| (x / (x + floor)).powi(2)).sum::<f64>() * 2.0 / length as f64;
    // The centre of the energy around the peak is finer than a sample.
    let around = || (centre - 2 * half..=centre + 2 * half).map(|i| (i as f64, power(i)));
    let middle = around().map(|(i, p)| i * p).sum::<f64>() / around().map(|(_, p)| p).sum::<f64>();
    Some(Direct {
        delay_s: running_itd_s(pieces.each_ref().map(Vec::as_slice), rate)?,
        level_db: 10.0 * (energy / kept).log10(),
        arrival_s: middle / rate,
        clarity_db: 10.0 * (smooth[peak] / mean).log10(),
    })
}

fn samples(seconds: f64, rate: f64) -> i64 {
    (seconds * rate).round() as i64
}

/// What comes out of an inverse transform: times before 0 are at the end.
struct Periodic(Vec<f64>);

impl Periodic {
    fn at(&self, i: i64) -> f64 {
        let length = i64::try_from(self.0.len()).unwrap_or(i64::MAX).max(1);
        usize::try_from(i.rem_euclid(length)).ok().and_then(|i| self.0.get(i)).copied().unwrap_or(0.0)
    }
}
