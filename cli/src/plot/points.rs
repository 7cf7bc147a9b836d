//! Named points over two logarithmic axes.

use super::{BAR, FONT, OTHER_BAR, TITLE_FONT};
use anyhow::Result;
use plotters::coord::Shift;
use plotters::prelude::*;

/// Size of the image, pixels.
pub(super) const SIZE: (u32, u32) = (900, 560);
/// Lower values are drawn here: a logarithm has no 0.
const LEAST_Y: f64 = 0.01;

/// A point with its name.
pub(crate) struct Point<'a> {
    pub(crate) name: &'a str,
    /// Above 0.
    pub(crate) x: f64,
    /// At least 0.
    pub(crate) y: f64,
    /// Drawn in colour and joined to the others of its kind, which are in the order of `x`.
    pub(crate) stands_out: bool,
}

pub(super) fn draw<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    title: &str,
    axes: [&str; 2],
    points: &[Point<'_>],
) -> Result<()>
where
    B::ErrorType: 'static,
{
    let xs = || points.iter().map(|p| p.x);
    let (low, high) = (xs().fold(f64::INFINITY, f64::min), xs().fold(0.0, f64::max));
    let most = points.iter().map(|p| p.y).fold(10.0 * LEAST_Y, f64::max);
    let place = |p: &Point<'_>| (p.x, p.y.max(LEAST_Y));
    // Names stand to the right of their points.
    let range = (0.8 * low.min(high)..1.6 * high.max(low)).log_scale();
    let mut chart = ChartBuilder::on(area)
        .caption(title, TITLE_FONT)
        .margin(15)
        .x_label_area_size(45)
        .y_label_area_size(60)
        .build_cartesian_2d(range, (0.7 * LEAST_Y..1.5 * most).log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .x_desc(axes[0])
        .y_desc(axes[1])
        .x_label_formatter(&|x| format!("{x:.2}"))
        .label_style(FONT)
        .draw()?;
    let best: Vec<(f64, f64)> = points.iter().filter(|p| p.stands_out).map(place).collect();
    chart.draw_series(LineSeries::new(best, BAR.stroke_width(1)))?;
    for (i, p) in points.iter().enumerate() {
        let (colour, ink) = if p.stands_out { (BAR, BLACK) } else { (OTHER_BAR, RGBColor(0x90, 0x90, 0x90)) };
        // Neighbours' names are not written over each other.
        let name = Text::new(p.name.to_owned(), (7, if i % 2 == 0 { -13 } else { 2 }), FONT.into_font().color(&ink));
        chart.draw_series([EmptyElement::at(place(p)) + Circle::new((0, 0), 4, colour.filled()) + name])?;
    }
    Ok(())
}
