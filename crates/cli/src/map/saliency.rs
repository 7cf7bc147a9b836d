//! How a mix stands out over time, and what a renderer of pictures may spend on each of its frames.

use super::ending;
use crate::args::SaliencyArgs;
use crate::{plot, report};
use anyhow::{Context, Result, bail};
use promenade_baker::atomic;
use promenade_baker::file::is_standard;
use promenade_metrics::{SALIENCY_STEP_S, SampleBudget, picture_weights};
use promenade_study::sound_saliency;
use serde_json::json;

pub(super) fn run(args: &SaliencyArgs) -> Result<()> {
    if let Some(other) = args.output.iter().find(|path| !["json", "svg"].contains(&ending(path).as_str()) && !is_standard(path))
    {
        bail!("{}: expected a file ending in .json or .svg", other.display());
    }
    let (trace, seconds) = sound_saliency(&args.mix)?;
    let weights = picture_weights(&trace, args.fps, (seconds * args.fps).ceil() as usize);
    let budget =
        SampleBudget::of_pictures(&weights, args.samples, args.least.unwrap_or(args.samples / 2)).context("--least")?;
    let samples = budget.spent_on(weights.iter().copied());
    for path in &args.output {
        let bytes = if ending(path) == "svg" {
            curves(&trace, &weights, &samples, args.fps)?
        } else {
            let frames: Vec<_> = weights.iter().zip(&samples).map(|(w, n)| json!({ "saliency": w, "samples": n })).collect();
            let file = json!({
                "sound": report::file_name(&args.mix),
                "frames_per_second": args.fps,
                "samples_per_pixel": { "mean": args.samples, "least": budget.least(), "most": budget.most() },
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
        budget.least(),
        budget.most()
    ))
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
