//! Decays by octave, as they were measured and as a fit foretells them at the same places, as SVG.

use crate::energy_model::BIN_S;
use crate::foretell::Foretold;
use crate::measurements::Measurements;
use crate::octaves::{FITTED_HZ, heard, octaves_at};
use rayon::prelude::*;
use std::fmt::Write;

const SIZE: (f64, f64) = (220.0, 150.0);
const MARGIN: (f64, f64) = (34.0, 28.0);
const COLUMNS: usize = 3;
/// Lowest level that is drawn, dB.
const FLOOR_DB: f64 = -60.0;
const MEASURED: &str = "#333";
const FORETOLD: &str = "#4a7fb5";

/// What is left of the energy from each bin on, dB over all of it.
fn decay_db(bins: &[f64]) -> Vec<f64> {
    let mut left = bins.to_vec();
    let mut sum = 0.0;
    for e in left.iter_mut().rev() {
        sum += *e;
        *e = sum;
    }
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
/// measured with what lies between the least and the most of them, and of what is foretold at the same places, by one draw of
/// noise each.
#[must_use]
pub fn decays_svg(foretold: &Foretold, set: &Measurements) -> String {
    let rate_hz = f64::from(set.sample_rate_hz);
    let octaves = octaves_at(rate_hz);
    let of =
        |samples: &[f32]| -> Vec<Vec<f64>> { heard(samples, rate_hz, BIN_S).iter().map(|(bins, _)| decay_db(bins)).collect() };
    let both: Vec<[Vec<Vec<f64>>; 2]> = set.all.par_iter().map(|m| [of(&m.samples), of(&foretold.response(m, 0))]).collect();
    let by_octave = |side: usize, octave: usize| {
        over_places(&both.iter().filter_map(|one| one[side].get(octave).cloned()).collect::<Vec<_>>())
    };
    let (width, height) = (SIZE.0 * COLUMNS as f64, SIZE.1 * octaves.div_ceil(COLUMNS) as f64 + 16.0);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" font-family=\"sans-serif\" \
         font-size=\"10\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for (o, hz) in FITTED_HZ.iter().enumerate().take(octaves) {
        let [measured, found] = [by_octave(0, o), by_octave(1, o)];
        let above = |bins: &[[f64; 3]]| bins.iter().position(|b| b[1] < FLOOR_DB).unwrap_or(bins.len());
        let last = above(&measured).max(above(&found)).max(2);
        let (left, top) = ((o % COLUMNS) as f64 * SIZE.0 + MARGIN.0, (o / COLUMNS) as f64 * SIZE.1 + MARGIN.1);
        let (wide, high) = (SIZE.0 - MARGIN.0 - 8.0, SIZE.1 - 2.0 * MARGIN.1);
        let at = |bin: usize, db: f64| {
            format!("{:.1},{:.1}", left + wide * bin as f64 / last as f64, top + high * (db.clamp(FLOOR_DB, 0.0) / FLOOR_DB))
        };
        let points = |bins: &[[f64; 3]], which: usize| -> Vec<String> {
            bins.iter().enumerate().take(last + 1).map(|(bin, b)| at(bin, b[which])).collect()
        };
        let mut edge = points(&measured, 2);
        edge.extend(points(&measured, 0).into_iter().rev());
        let _ = writeln!(svg, "<text x=\"{left:.1}\" y=\"{:.1}\" font-weight=\"bold\">{hz} Hz</text>", top - 8.0);
        let _ = writeln!(svg, "<polygon points=\"{}\" fill=\"#ddd\"/>", edge.join(" "));
        for (bins, colour) in [(&measured, MEASURED), (&found, FORETOLD)] {
            let line = points(bins, 1).join(" ");
            let _ = writeln!(svg, "<polyline points=\"{line}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.5\"/>");
        }
        let _ = writeln!(
            svg,
            "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{wide:.1}\" height=\"{high:.1}\" fill=\"none\" stroke=\"#888\"/>"
        );
        for db in [0.0, -20.0, -40.0, -60.0] {
            let y = top + high * db / FLOOR_DB + 3.0;
            let _ = writeln!(svg, "<text x=\"{:.1}\" y=\"{y:.1}\" text-anchor=\"end\">{db}</text>", left - 4.0);
        }
        let (x, y) = (left + wide, top + high + 12.0);
        let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"end\">{:.2} s</text>", last as f64 * BIN_S);
    }
    let words = "dB of energy that is left: dark measured (mean, grey all places), blue foretold at the same places";
    let _ = writeln!(svg, "<text x=\"{}\" y=\"{:.0}\">{words}</text>\n</svg>", MARGIN.0, height - 6.0);
    svg
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
