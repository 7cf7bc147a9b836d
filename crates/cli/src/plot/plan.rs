//! Plans of a room with measures as colours.

use super::{FONT, TITLE_FONT};
use anyhow::Result;
use plotters::coord::Shift;
use plotters::prelude::*;

/// Pixels of a metre at most, and of the longer side of a plan.
const MOST_SCALE: f64 = 120.0;
const PLAN: f64 = 420.0;
/// Pixels about a plan: left, right with the legend, above, below.
pub(super) const AROUND: [u32; 4] = [50, 90, 34, 40];
/// Steps of a legend.
const STEPS: i32 = 100;
const NOTHING: RGBColor = RGBColor(0xe4, 0xe4, 0xe4);

/// One measure over a plan.
pub(crate) struct Panel {
    pub(crate) title: String,
    /// Beside each place its value; grey where there is none.
    pub(crate) values: Vec<([f64; 2], Option<f64>)>,
}

/// What all panels have in common.
pub(crate) struct Plan {
    /// Side of the square about each place, metres.
    pub(crate) spacing_m: f64,
    /// Walls, metres.
    pub(crate) outline: Vec<[[f64; 2]; 2]>,
    /// Least and greatest coordinates that are shown, metres.
    pub(crate) bounds: [[f64; 2]; 2],
    pub(crate) source: [f64; 2],
}

impl Plan {
    /// Width and height of two panels beside each other and as many rows as are needed, pixels.
    pub(crate) fn size(&self, panels: usize) -> Result<(u32, u32)> {
        let [low, high] = self.bounds;
        let lengths = [0, 1].map(|axis| high[axis] - low[axis]);
        let scale = (PLAN / lengths[0].max(lengths[1])).min(MOST_SCALE);
        let [width, height] = lengths.map(|length| (scale * length).ceil() as u32);
        let [left, right, above, below] = AROUND;
        Ok((2 * (left + width + right), u32::try_from(panels.div_ceil(2))? * (above + height + below)))
    }

    pub(crate) fn draw<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>, panels: &[Panel]) -> Result<()>
    where
        DB::ErrorType: 'static,
    {
        for (area, panel) in area.split_evenly((panels.len().div_ceil(2), 2)).iter().zip(panels) {
            // A value that is no number has no colour.
            let values = || panel.values.iter().filter_map(|v| v.1).filter(|v| v.is_finite());
            let (low, high) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
            // Values that hardly differ are no pattern.
            let (low, high) = if low < high { (low, high) } else { (low - 0.5, high + 0.5) };
            self.plan(area, panel, |value| ViridisRGB.get_color_normalized(value, low, high))?;
            if values().next().is_some() {
                legend(area, low, high)?;
            }
        }
        Ok(())
    }

    fn plan<DB: DrawingBackend>(
        &self,
        area: &DrawingArea<DB, Shift>,
        panel: &Panel,
        colour: impl Fn(f64) -> RGBColor,
    ) -> Result<()>
    where
        DB::ErrorType: 'static,
    {
        let [low, high] = self.bounds;
        let mut chart = ChartBuilder::on(area)
            .caption(&panel.title, TITLE_FONT)
            .margin_right(AROUND[1])
            .margin_bottom(10)
            .x_label_area_size(30)
            .y_label_area_size(AROUND[0])
            .build_cartesian_2d(low[0]..high[0], low[1]..high[1])?;
        chart
            .configure_mesh()
            .disable_mesh()
            .x_labels(6)
            .y_labels(6)
            .x_label_formatter(&|m| format!("{m:.0} m"))
            .y_label_formatter(&|m| format!("{m:.0} m"))
            .label_style(FONT)
            .draw()?;
        let half = 0.5 * self.spacing_m;
        chart.draw_series(panel.values.iter().map(|([x, y], value)| {
            let corners = [(x - half, y - half), (x + half, y + half)];
            Rectangle::new(corners, value.filter(|v| v.is_finite()).map_or(NOTHING, &colour).filled())
        }))?;
        let walls = self.outline.iter().map(|wall| PathElement::new(wall.map(|[x, y]| (x, y)), BLACK.stroke_width(2)));
        chart.draw_series(walls)?;
        let [x, y] = self.source;
        chart.draw_series([Circle::new((x, y), 6, WHITE.filled())])?;
        chart.draw_series([Circle::new((x, y), 4, RED.filled())])?;
        Ok(())
    }
}

/// A picture of numbers as colours, row by row from above, with a legend beside it; grey where there is none.
pub(crate) fn picture<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    width: usize,
    numbers: &[f32],
    range: Option<[f64; 2]>,
) -> Result<()>
where
    DB::ErrorType: 'static,
{
    let known = || numbers.iter().copied().filter(|n| n.is_finite()).map(f64::from);
    let [low, high] =
        range.unwrap_or_else(|| known().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]));
    let (low, high) = if low < high { (low, high) } else { (low - 0.5, high + 0.5) };
    for (i, number) in numbers.iter().enumerate() {
        let colour = if number.is_finite() { ViridisRGB.get_color_normalized(f64::from(*number), low, high) } else { NOTHING };
        area.draw_pixel((i32::try_from(i % width)?, i32::try_from(i / width)?), &colour)?;
    }
    if known().next().is_some() {
        legend(area, low, high)?;
    }
    Ok(())
}

/// A bar of all colours with the values at its ends and in its middle.
fn legend<DB: DrawingBackend>(area: &DrawingArea<DB, Shift>, low: f64, high: f64) -> Result<()>
where
    DB::ErrorType: 'static,
{
    let (width, height) = area.dim_in_pixel();
    let (width, height) = (i32::try_from(width)?, i32::try_from(height)?);
    let (left, top, bottom) = (width - 78, 40, height - 50);
    let at = |step: i32| bottom - (bottom - top) * step / STEPS;
    for step in 0..STEPS {
        let colour = ViridisRGB.get_color_normalized(f64::from(step), 0.0, f64::from(STEPS));
        area.draw(&Rectangle::new([(left, at(step + 1)), (left + 14, at(step))], colour.filled()))?;
    }
    for (share, step) in [(0.0, 0), (0.5, STEPS / 2), (1.0, STEPS)] {
        let text = format!("{:.2}", low + share * (high - low));
        area.draw(&Text::new(text, (left + 18, at(step) - 7), FONT))?;
    }
    Ok(())
}
