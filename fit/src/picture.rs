//! Absorption by octave and wall with its uncertainty, as SVG.

use crate::octaves::FITTED_HZ;
use crate::quick::QuickFit;
use crate::walls::WALLS;
use std::fmt::Write;

const SIZE: (f64, f64) = (220.0, 150.0);
const MARGIN: (f64, f64) = (34.0, 28.0);
const COLUMNS: usize = 3;

/// A panel for each wall: absorption from 0 to 1 over octaves, bars of one standard error, hollow where the data do not
/// determine it.
#[must_use]
pub fn absorption_svg(fit: &QuickFit) -> String {
    let rows = WALLS.len().div_ceil(COLUMNS);
    let (width, height) = (SIZE.0 * COLUMNS as f64, SIZE.1 * rows as f64);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"10\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for (w, name) in WALLS.iter().enumerate() {
        let (left, top) = ((w % COLUMNS) as f64 * SIZE.0 + MARGIN.0, (w / COLUMNS) as f64 * SIZE.1 + MARGIN.1);
        let (wide, high) = (SIZE.0 - MARGIN.0 - 8.0, SIZE.1 - 2.0 * MARGIN.1);
        let count = fit.octaves.len().saturating_sub(1).max(1);
        let x = |i: usize| left + (i as f64 + 0.5) * wide / count as f64;
        let y = |alpha: f64| top + high * (1.0 - alpha.clamp(0.0, 1.0));
        let _ = writeln!(svg, "<text x=\"{left:.1}\" y=\"{:.1}\" font-weight=\"bold\">{name}</text>", top - 8.0);
        let _ = writeln!(
            svg,
            "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{wide:.1}\" height=\"{high:.1}\" fill=\"none\" stroke=\"#888\"/>"
        );
        for alpha in [0.0, 0.5, 1.0] {
            let _ =
                writeln!(svg, "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{alpha}</text>", left - 4.0, y(alpha) + 3.0);
        }
        for (i, octave) in fit.octaves.iter().skip(1).enumerate() {
            let a = octave.absorption[w];
            let _ = writeln!(
                svg,
                "<line x1=\"{0:.1}\" x2=\"{0:.1}\" y1=\"{1:.1}\" y2=\"{2:.1}\" stroke=\"#4a7fb5\"/>",
                x(i),
                y(a.value - a.error),
                y(a.value + a.error)
            );
            let fill = if a.determined { "#4a7fb5" } else { "white" };
            let _ = writeln!(
                svg,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3\" fill=\"{fill}\" stroke=\"#4a7fb5\"/>",
                x(i),
                y(a.value)
            );
            let hz = FITTED_HZ[i + 1];
            let label = if hz >= 1000.0 { format!("{}k", hz / 1000.0) } else { format!("{hz}") };
            let _ =
                writeln!(svg, "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>", x(i), top + high + 12.0);
        }
    }
    svg.push_str("</svg>\n");
    svg
}
