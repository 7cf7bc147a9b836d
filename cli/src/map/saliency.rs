//! How a mix stands out over time, and what a renderer of pictures may spend on each of its frames.
//!
//! Weights and costs after Harvey, Debattista, Bashford-Rogers and Chalmers, "Multi-modal perception for selective rendering", Computer Graphics Forum 2017.

use super::ending;
use crate::args::SaliencyArgs;
use crate::{plot, report};
use anyhow::{Context, Result, bail};
use promenade_baker::capture::mean;
use promenade_baker::{atomic, resample, sound};
use promenade_metrics::{SALIENCY_RATE_HZ, SALIENCY_STEP_S, saliency};
use serde_json::json;

pub(super) fn run(args: &SaliencyArgs) -> Result<()> {
    if let Some(other) = args.output.iter().find(|path| !["json", "svg"].contains(&ending(path).as_str())) {
        bail!("{}: expected a file ending in .json or .svg", other.display());
    }
    let mix = sound::read(&args.mix)?;
    let seconds = mix.frames() as f64 / f64::from(mix.sample_rate_hz);
    let mono = resample::signal(&[mean(&mix.channels)], mix.sample_rate_hz, SALIENCY_RATE_HZ)?;
    let trace = saliency(&mono[0]).with_context(|| args.mix.display().to_string())?;
    let weights = weights(&trace, args.look_ahead, args.fps, (seconds * args.fps).ceil() as usize);
    let budget = Budget::new(&weights, args.samples, args.least.unwrap_or(args.samples / 2))?;
    let samples = budget.spent_on(&weights);
    for path in &args.output {
        let bytes = if ending(path) == "svg" {
            curves(&trace, &weights, &samples, args.fps)?
        } else {
            let frames: Vec<_> = weights.iter().zip(&samples).map(|(w, n)| json!({ "saliency": w, "samples": n })).collect();
            let file = json!({
                "sound": report::file_name(&args.mix),
                "frames_per_second": args.fps,
                "look_ahead_s": args.look_ahead,
                "samples_per_pixel": { "mean": args.samples, "least": budget.least, "most": budget.most },
                "frames": frames,
            });
            format!("{file:#}\n")
        };
        atomic::write(path, bytes.as_bytes())?;
    }
    let average = samples.iter().map(|n| f64::from(*n)).sum::<f64>() / samples.len() as f64;
    report::print(&format!(
        "{} frames: {} to {} samples per pixel, {average:.2} on average\n",
        samples.len(),
        budget.least,
        budget.most
    ))
}

/// Weight of each frame, 0 to 1: the largest saliency of each stretch as long as the look-ahead stands at the stretch's beginning, so that the weight comes before the sound, and a curve
/// without overshoot leads from one to the next.
fn weights(trace: &[f64], look_ahead_s: f64, fps: f64, frames: usize) -> Vec<f64> {
    let most = trace.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let knots: Vec<f64> = (trace.chunks((look_ahead_s / SALIENCY_STEP_S).round() as usize))
        .map(|stretch| stretch.iter().copied().fold(0.0, f64::max) / most)
        .collect();
    (0..frames).map(|frame| monotone(&knots, frame as f64 / fps / look_ahead_s)).collect()
}

/// A cubic spline through values at 0, 1, 2..., which has no extremum between them (Fritsch and Butland 1984: harmonic means as slopes); as at its ends beyond them.
fn monotone(values: &[f64], at: f64) -> f64 {
    let value = |i: usize| values[i.min(values.len() - 1)];
    let slope = |i: usize| {
        let (before, after) = (value(i) - value(i.saturating_sub(1)), value(i + 1) - value(i));
        if before * after > 0.0 { 2.0 * before * after / (before + after) } else { 0.0 }
    };
    let (i, t) = (at.floor() as usize, at.fract());
    let (a, b) = (value(i), value(i + 1));
    let (square, cube) = (t * t, t * t * t);
    a + (b - a) * (3.0 * square - 2.0 * cube) + slope(i) * (cube - 2.0 * square + t) + slope(i + 1) * (cube - square)
}

/// What frames cost, samples per pixel.
struct Budget {
    least: u32,
    most: u32,
}

impl Budget {
    /// The most that a frame may cost so that all together cost as much as with `mean` each, where those of no weight cost the least.
    fn new(weights: &[f64], mean: u32, least: u32) -> Result<Self> {
        if least > mean {
            bail!("--least: expected at most --samples, {mean}, found {least}");
        }
        let weight = weights.iter().sum::<f64>() / weights.len() as f64;
        Ok(Self { least, most: (f64::from(least) + f64::from(mean - least) / weight).round() as u32 })
    }

    /// Whole samples of each frame, whose rounding is made good by the next.
    fn spent_on(&self, weights: &[f64]) -> Vec<u32> {
        let mut owed = 0.0;
        let spend = |weight: &f64| {
            owed += f64::from(self.least) + f64::from(self.most - self.least) * weight;
            let samples = owed.round();
            owed -= samples;
            samples as u32
        };
        weights.iter().map(spend).collect()
    }
}

fn curves(trace: &[f64], weights: &[f64], samples: &[u32], fps: f64) -> Result<String> {
    let every = |step_s: f64, values: &mut dyn Iterator<Item = f64>| -> Vec<(f64, f64)> {
        values.enumerate().map(|(i, value)| (i as f64 * step_s, value)).collect()
    };
    let by_frame = 1.0 / fps;
    plot::curves(
        "seconds",
        &[
            ("Auditory saliency", every(SALIENCY_STEP_S, &mut trace.iter().copied())),
            ("Weight", every(by_frame, &mut weights.iter().copied())),
            ("Samples per pixel", every(by_frame, &mut samples.iter().map(|n| f64::from(*n)))),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_weight_comes_before_its_sound_and_the_cost_is_the_same() {
        // Quiet but for 0.1 s at 3 s.
        let mut trace = vec![0.2; 5000];
        trace[1500..1550].fill(4.0);
        let (fps, look_ahead) = (25.0, 0.5);
        let weights = weights(&trace, look_ahead, fps, 250);
        assert_eq!(weights.len(), 250);
        assert!(weights.iter().all(|w| (0.05..=1.0).contains(w)));
        assert!((weights[75] - 1.0).abs() < 1e-9 && weights[70] > 0.4 && weights[62] <= 0.05 + 1e-9, "{weights:?}");
        let budget = Budget::new(&weights, 100, 20).unwrap();
        let spent = budget.spent_on(&weights);
        let total: u32 = spent.iter().sum();
        assert!(total.abs_diff(25_000) <= 150, "{total}: the most is a whole number");
        assert!(spent[75].abs_diff(budget.most) <= 1 && spent[10] < 100 && budget.most > 500, "{}", budget.most);
        assert!(Budget::new(&weights, 100, 101).is_err());
    }

    #[test]
    fn splines_do_not_overshoot() {
        let values = [0.0, 0.0, 1.0, 0.9, 0.9, 0.2];
        for step in 0..600 {
            let at = f64::from(step) / 100.0;
            let (a, b) = (values[(at as usize).min(5)], values[(at as usize + 1).min(5)]);
            let value = monotone(&values, at);
            assert!((f64::min(a, b) - 1e-12..=f64::max(a, b) + 1e-12).contains(&value), "{value} at {at}");
        }
    }
}
