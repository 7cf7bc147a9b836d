//! Absorption over frequency with its uncertainty, as SVG.

use super::panels::{self, Panel};
use crate::bands::{Estimate, FITTED_HZ};
use std::fmt::{self, Write};

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
    let mut svg = panels::begin(panels::size(curves.len()));
    for (number, curve) in curves.iter().enumerate() {
        // A text takes whatever is written.
        let _ = draw(&mut svg, &Panel::new(number), curve);
    }
    svg + "</svg>\n"
}

fn draw(svg: &mut String, panel: &Panel, curve: &Curve) -> fmt::Result {
    let (Some(first), Some(last)) = (curve.points.first(), curve.points.last()) else { return Ok(()) };
    let (first, last) = (first.0.log2() - BESIDE, last.0.log2() + BESIDE);
    let x = |hz: f64| panel.left + panel.wide * (hz.log2() - first) / (last - first);
    let y = |alpha: f64| panel.top + panel.high * (1.0 - alpha.clamp(0.0, 1.0));
    panel.frame(svg, &curve.name, [0.0, 0.5, 1.0].into_iter().map(|alpha| (y(alpha), alpha.to_string())))?;
    for (hz, a) in &curve.points {
        let (x, low, high) = (x(*hz), y(a.value - a.error), y(a.value + a.error));
        writeln!(svg, "<line x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{low:.1}\" y2=\"{high:.1}\" stroke=\"#4a7fb5\"/>")?;
        let fill = if a.determined { "#4a7fb5" } else { "white" };
        writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{:.1}\" r=\"3\" fill=\"{fill}\" stroke=\"#4a7fb5\"/>", y(a.value))?;
    }
    for hz in FITTED_HZ.into_iter().filter(|hz| (first..last).contains(&hz.log2())) {
        let label = if hz >= 1000.0 { format!("{}k", hz / 1000.0) } else { format!("{hz}") };
        let y = panel.top + panel.high + 12.0;
        writeln!(svg, "<text x=\"{:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{label}</text>", x(hz))?;
    }
    Ok(())
}
