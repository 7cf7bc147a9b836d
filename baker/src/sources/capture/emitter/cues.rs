//! What one clip tells about where its sound came from: the direct sound, found by the dry sound beside it.

use promenade_fourier::num_complex::Complex64;

/// Dry sound before a clip that still sounds in it, seconds.
pub(super) const PRE_ROLL_S: f64 = 0.25;
/// The direct sound comes within this of the dry sound, before it where the two are badly aligned, seconds.
const EARLIEST_S: f64 = -0.03;
const LATEST_S: f64 = 0.15;
/// Band of the transfer that is estimated, hertz.
const LOWEST_HZ: f64 = 150.0;
const HIGHEST_HZ: f64 = 7000.0;
/// Band of the interaural delay, hertz.
const DELAY_TOP_HZ: f64 = 1500.0;
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
/// No head is wider than this, seconds.
const LARGEST_LAG_S: f64 = 1e-3;

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
/// Each ear is divided by the dry sound, regularised where the dry sound is weak. The first strong arrival is cut out of both
/// responses, and the two are cross-correlated (Knapp and Carter 1976).
pub(super) fn direct(dry: &[f32], pre_roll: usize, ears: [&[f32]; 2], rate: f64) -> Option<Direct> {
    let length = (2 * dry.len()).next_power_of_two();
    let x = spectrum(dry, 0, length);
    let hz = |k: usize| k as f64 * rate / length as f64;
    let inside = |k: usize| (LOWEST_HZ..=HIGHEST_HZ.min(0.45 * rate)).contains(&hz(k));
    let powers: Vec<f64> = x.iter().enumerate().filter(|(k, _)| inside(*k)).map(|(_, x)| x.norm_sqr()).collect();
    let floor = REGULARISATION * powers.iter().sum::<f64>() / powers.len().max(1) as f64;
    if floor <= 0.0 {
        return None;
    }
    let responses = ears.map(|ear| {
        let mut transfer = spectrum(ear, pre_roll, length);
        for (k, (y, x)) in transfer.iter_mut().zip(&x).enumerate() {
            *y = if inside(k) { *y * x.conj() / (x.norm_sqr() + floor) } else { Complex64::default() };
        }
        Periodic(back(transfer, length))
    });
    let power = |i: i64| responses.iter().map(|h| h.at(i).powi(2)).sum::<f64>();
    let [first, last, before, after] = [EARLIEST_S, LATEST_S, BEFORE_S, AFTER_S].map(|s| samples(s, rate));
    let half = samples(SMOOTH_S, rate).max(1);
    let smooth: Vec<f64> = (first..last).map(|i| (i - half..=i + half).map(power).sum()).collect();
    let strongest = smooth.iter().copied().fold(0.0, f64::max);
    let mean = smooth.iter().sum::<f64>() / smooth.len().max(1) as f64;
    let onset = smooth.iter().position(|p| *p >= FIRST * strongest)?;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of samples")]
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
        delay_s: lag_s(&pieces, rate)?,
        level_db: 10.0 * (energy / kept).log10(),
        arrival_s: middle / rate,
        clarity_db: 10.0 * (smooth[peak] / mean).log10(),
    })
}

/// The lag within 1 ms of the largest cross-correlation below 1.5 kHz, between samples by a parabola; seconds, positive = left later.
fn lag_s([left, right]: &[Vec<f64>; 2], rate: f64) -> Option<f64> {
    let length = (8 * left.len()).next_power_of_two();
    let [l, r] = [left, right].map(|x| transform(x.iter().copied(), length));
    let top = DELAY_TOP_HZ * length as f64 / rate;
    let cross = l.iter().zip(&r).enumerate().map(|(k, (l, r))| {
        let inside = k > 0 && k as f64 <= top && k < length / 2;
        if inside { l * r.conj() } else { Complex64::default() }
    });
    let correlation = Periodic(back(cross.collect(), length));
    let reach = samples(LARGEST_LAG_S, rate);
    let best = (-reach..=reach).max_by(|a, b| correlation.at(*a).total_cmp(&correlation.at(*b)))?;
    let [before, peak, after] = [-1, 0, 1].map(|i| correlation.at(best + i));
    if peak <= 0.0 {
        return None;
    }
    let bend = before - 2.0 * peak + after;
    let part = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
    Some((best as f64 + part) / rate)
}

#[expect(clippy::cast_possible_truncation, reason = "less than a second")]
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

/// Spectrum of a signal that begins `offset` samples late.
fn spectrum(x: &[f32], offset: usize, length: usize) -> Vec<Complex64> {
    transform(std::iter::repeat_n(0.0, offset).chain(x.iter().map(|v| f64::from(*v))), length)
}

fn transform(x: impl Iterator<Item = f64>, length: usize) -> Vec<Complex64> {
    let plan = promenade_fourier::forward::<f64>(length.max(2));
    let mut time = plan.make_input_vec();
    time.iter_mut().zip(x).for_each(|(to, from)| *to = from);
    let mut out = plan.make_output_vec();
    // The lengths come from the plan itself, the only thing that the transform checks.
    let done = plan.process(&mut time, &mut out);
    debug_assert!(done.is_ok());
    out
}

fn back(mut spectrum: Vec<Complex64>, length: usize) -> Vec<f64> {
    let plan = promenade_fourier::inverse::<f64>(length.max(2));
    let mut time = plan.make_output_vec();
    // The callers leave both end bins at 0, which are to be real.
    let done = plan.process(&mut spectrum, &mut time);
    debug_assert!(done.is_ok());
    time.iter_mut().for_each(|v| *v /= length as f64);
    time
}
