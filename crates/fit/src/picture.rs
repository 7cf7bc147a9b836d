//! Absorption over frequency with its uncertainty, as SVG.

use crate::estimate::Estimate;
use crate::octaves::FITTED_HZ;
use std::fmt::Write;

const SIZE: (f64, f64) = (220.0, 150.0);
const MARGIN: (f64, f64) = (34.0, 28.0);
const COLUMNS: usize = 3;
/// Octaves on either side of the first and the last point.
const BESIDE: f64 = 0.5;

/// The absorption of one surface over frequency.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// The surface's name.
    pub name: String,
    /// Frequencies, hertz, that grow, and absorption there.
    pub points: Vec<(f64, Estimate)>,
}

/// A panel for each surface: absorption from 0 to 1 over frequency, bars of one standard error, hollow where the data do not
/// determine it.
#[must_use]
pub fn absorption_svg(curves: &[Curve]) -> String {
    let rows = curves.len().div_ceil(COLUMNS);
    let (width, height) = (SIZE.0 * COLUMNS as f64, SIZE.1 * rows as f64);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"10\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for (c, curve) in curves.iter().enumerate() {
        let (left, top) = ((c % COLUMNS) as f64 * SIZE.0 + MARGIN.0, (c / COLUMNS) as f64 * SIZE.1 + MARGIN.1);
        let (wide, high) = (SIZE.0 - MARGIN.0 - 8.0, SIZE.1 - 2.0 * MARGIN.1);
        let (Some(first), Some(last)) = (curve.points.first(), curve.points.last()) else { continue };
        let (first, last) = (first.0.log2() - BESIDE, last.0.log2() + BESIDE);
        let x = |hz: f64| left + wide * (hz.log2() - first) / (last - first);
        let y = |alpha: f64| top + high * (1.0 - alpha.clamp(0.0, 1.0));
        let _ = writeln!(svg, "<text x=\"{left:.1}\" y=\"{:.1}\" font-weight=\"bold\">{}</text>", top - 8.0, text(&curve.name));
        let _ = writeln!(
            svg,
            "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{wide:.1}\" height=\"{high:.1}\" fill=\"none\" stroke=\"#888\"/>"
        );
        for alpha in [0.0, 0.5, 1.0] {
            let _ =
                writeln!(svg, "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{alpha}</text>", left - 4.0, y(alpha) + 3.0);
        }
        for (hz, a) in &curve.points {
            let _ = writeln!(
                svg,
                "<line x1=\"{0:.1}\" x2=\"{0:.1}\" y1=\"{1:.1}\" y2=\"{2:.1}\" stroke=\"#4a7fb5\"/>",
                x(*hz),
                y(a.value - a.error),
                y(a.value + a.error)
            );
            let fill = if a.determined { "#4a7fb5" } else { "white" };
            let _ = writeln!(
                svg,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3\" fill=\"{fill}\" stroke=\"#4a7fb5\"/>",
                x(*hz),
                y(a.value)
            );
        }
        for hz in FITTED_HZ.into_iter().filter(|hz| (first..last).contains(&hz.log2())) {
            let label = if hz >= 1000.0 { format!("{}k", hz / 1000.0) } else { format!("{hz}") };
            let _ =
                writeln!(svg, "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>", x(hz), top + high + 12.0);
        }
    }
    svg.push_str("</svg>\n");
    svg
}

/// A text of XML.
fn text(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
