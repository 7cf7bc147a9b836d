//! Decays by octave, as they were measured and as a fit predicts them at the same places, as SVG.

use super::panels::{self, Panel};
use crate::bands::{FITTED_HZ, octave_decays, octaves_at};
use crate::late::BIN_S;
use crate::measurements::Measurements;
use crate::prediction::Prediction;
use promenade_metrics::backward_integral;
use rayon::prelude::*;
use std::fmt::{self, Write};

/// Lowest level that is drawn, dB.
const FLOOR_DB: f64 = -60.0;
const MEASURED: &str = "#333";
const PREDICTED: &str = "#4a7fb5";

/// What is left of the energy from each bin on, dB over all of it.
fn decay_db(bins: &[f64]) -> Vec<f64> {
    let left = backward_integral(bins.iter().copied());
    let sum = left.first().copied().unwrap_or(0.0);
    left.iter().map(|e| 10.0 * (e / sum.max(1e-300)).max(1e-12).log10()).collect()
}

/// Least, mean and greatest level by bin over places, as far as any of them goes.
fn over_places(all: &[Vec<f64>]) -> Vec<[f64; 3]> {
    let length = all.iter().map(Vec::len).max().unwrap_or(0);
    (0..length)
        .map(|bin| {
            let values = || all.iter().filter_map(|one| one.get(bin).copied());
            let (sum, count) = values().fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
            [values().fold(f64::INFINITY, f64::min), sum / count, values().fold(f64::NEG_INFINITY, f64::max)]
        })
        .collect()
}

/// A panel for each octave: what is left of the energy over the time since the direct sound, the mean over places of what was
/// measured with what lies between the least and the most of them, and of what is predicted at the same places, by one draw of
/// noise each.
#[must_use]
pub fn decays_svg(prediction: &Prediction<'_>, set: &Measurements) -> String {
    let rate_hz = f64::from(set.sample_rate_hz);
    let octaves = octaves_at(rate_hz);
    let of = |samples: &[f32]| -> Vec<Vec<f64>> {
        octave_decays(samples, rate_hz, BIN_S).iter().map(|(bins, _)| decay_db(bins)).collect()
    };
    let both: Vec<[Vec<Vec<f64>>; 2]> = set.all.par_iter().map(|m| [of(&m.samples), of(&prediction.response(m, 0))]).collect();
    let by_octave = |side: usize, octave: usize| {
        over_places(&both.iter().filter_map(|one| one[side].get(octave).cloned()).collect::<Vec<_>>())
    };
    let (width, height) = panels::size(octaves);
    let mut svg = panels::begin((width, height + 16.0));
    for (o, hz) in FITTED_HZ.iter().enumerate().take(octaves) {
        // A text takes whatever is written.
        let _ = draw(&mut svg, &Panel::new(o), &format!("{hz} Hz"), [by_octave(0, o), by_octave(1, o)]);
    }
    let words = "dB of energy that is left: dark measured (mean, grey all places), blue predicted at the same places";
    svg + &format!("<text x=\"34\" y=\"{:.0}\">{words}</text>\n</svg>\n", height + 10.0)
}

/// Least, mean and greatest level by bin, measured and predicted.
fn draw(svg: &mut String, panel: &Panel, title: &str, [measured, found]: [Vec<[f64; 3]>; 2]) -> fmt::Result {
    let above = |bins: &[[f64; 3]]| bins.iter().position(|b| b[1] < FLOOR_DB).unwrap_or(bins.len());
    let last = above(&measured).max(above(&found)).max(2);
    let y = |db: f64| panel.top + panel.high * (db.clamp(FLOOR_DB, 0.0) / FLOOR_DB);
    let points = |bins: &[[f64; 3]], which: usize| -> Vec<String> {
        let x = |bin: usize| panel.left + panel.wide * bin as f64 / last as f64;
        bins.iter().enumerate().take(last + 1).map(|(bin, b)| format!("{:.1},{:.1}", x(bin), y(b[which]))).collect()
    };
    let mut edge = points(&measured, 2);
    edge.extend(points(&measured, 0).into_iter().rev());
    writeln!(svg, "<polygon points=\"{}\" fill=\"#ddd\"/>", edge.join(" "))?;
    for (bins, colour) in [(&measured, MEASURED), (&found, PREDICTED)] {
        let line = points(bins, 1).join(" ");
        writeln!(svg, "<polyline points=\"{line}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.5\"/>")?;
    }
    panel.frame(svg, title, [0.0, -20.0, -40.0, -60.0].into_iter().map(|db| (y(db), db.to_string())))?;
    let (x, y) = (panel.left + panel.wide, panel.top + panel.high + 12.0);
    writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"end\">{:.2} s</text>", last as f64 * BIN_S)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decay_is_what_is_left_and_places_have_their_least_mean_and_most() {
        let halves: Vec<f64> = (0..20).map(|i| 0.5_f64.powi(i)).collect();
        let db = decay_db(&halves);
        assert!(db[0].abs() < 1e-9 && (db[3] + 9.03).abs() < 0.01, "{db:?}");
        let both = over_places(&[vec![0.0, -4.0], vec![0.0, -2.0, -7.0]]);
        assert_eq!(both, [[0.0; 3], [-4.0, -3.0, -2.0], [-7.0; 3]]);
    }
}
