//! The plan of a room as it was found over the one that was stated, as SVG.

use super::panels;
use crate::error::FitError;
use crate::fits::FullFit;
use crate::measurements::Measurements;
use crate::room::FlatRoom;
use std::fmt::Write;

/// Pixels of the longer side, and about the plan.
const SIZE: f64 = 480.0;
const MARGIN: f64 = 30.0;

/// Walls from above, stated dashed and found solid; sources as squares and microphones as circles, stated hollow and found
/// filled, with lines between.
///
/// # Errors
/// A box without a volume.
pub fn plan_svg(stated: &FlatRoom, fit: &FullFit, set: &Measurements) -> Result<String, FitError> {
    let meshes = [stated.mesh()?, fit.room.mesh()?];
    let corners = || meshes.iter().flat_map(|m| m.vertices.iter());
    let low: [f64; 2] = std::array::from_fn(|a| corners().map(|v| v[a]).fold(f64::INFINITY, f64::min));
    let high: [f64; 2] = std::array::from_fn(|a| corners().map(|v| v[a]).fold(f64::NEG_INFINITY, f64::max));
    let scale = SIZE / (high[0] - low[0]).max(high[1] - low[1]).max(1e-3);
    // y of the room goes up.
    let at = |v: [f64; 3]| (MARGIN + scale * (v[0] - low[0]), MARGIN + scale * (high[1] - v[1]));
    let (width, height) = (2.0 * MARGIN + scale * (high[0] - low[0]), 2.0 * MARGIN + scale * (high[1] - low[1]));
    let mut svg = panels::begin((width, height + 14.0));
    for (mesh, style) in meshes.iter().zip(["stroke=\"#b55\" stroke-dasharray=\"5 4\"", "stroke=\"#333\""]) {
        for t in &mesh.triangles {
            // Of walls alone: what is level covers the plan.
            let [a, b, c] = t.corners.map(|i| mesh.vertices[i as usize]);
            let (u, v): ([f64; 2], [f64; 2]) = (std::array::from_fn(|i| b[i] - a[i]), std::array::from_fn(|i| c[i] - a[i]));
            if (u[0] * v[1] - u[1] * v[0]).abs() > 1e-3 {
                continue;
            }
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let ((x1, y1), (x2, y2)) = (at(from), at(to));
                if (x1 - x2).hypot(y1 - y2) > 0.5 {
                    let _ = writeln!(svg, "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" {style}/>");
                }
            }
        }
    }
    for (m, found) in set.all.iter().zip(&fit.places) {
        for (said, is, source) in [(m.source.at_m, found.source_m, true), (m.microphone.at_m, found.microphone_m, false)] {
            let ((x1, y1), (x2, y2)) = (at(said), at(is));
            let _ = writeln!(svg, "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"#4a7fb5\"/>");
            for (x, y, fill) in [(x1, y1, "white"), (x2, y2, "#4a7fb5")] {
                let mark = if source {
                    format!("<rect x=\"{:.1}\" y=\"{:.1}\" width=\"6\" height=\"6\"", x - 3.0, y - 3.0)
                } else {
                    format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\"")
                };
                let _ = writeln!(svg, "{mark} fill=\"{fill}\" stroke=\"#4a7fb5\"/>");
            }
        }
    }
    let words = "stated: dashed, hollow; found: solid, filled; squares are sources, circles microphones";
    let _ = writeln!(svg, "<text x=\"{MARGIN}\" y=\"{:.0}\">{words}</text>\n</svg>", height + 2.0);
    Ok(svg)
}
