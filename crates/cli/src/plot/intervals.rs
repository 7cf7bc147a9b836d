//! A value with an interval for each name.

use super::{BAR, FONT, TITLE_FONT};
use anyhow::Result;
use plotters::coord::Shift;
use plotters::prelude::*;

/// A row.
pub(crate) struct Interval {
    pub(crate) name: String,
    pub(crate) value: f64,
    pub(crate) interval: [f64; 2],
}

/// Height of rows, pixels.
pub(super) fn height(rows: usize) -> Result<u32> {
    Ok(95 + 30 * u32::try_from(rows)?)
}

pub(super) fn draw<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    title: &str,
    axis: &str,
    rows: &[Interval],
    names_width: u32,
) -> Result<()>
where
    B::ErrorType: 'static,
{
    let ends = || rows.iter().flat_map(|row| row.interval);
    let (low, high) = (ends().fold(f64::INFINITY, f64::min), ends().fold(f64::NEG_INFINITY, f64::max));
    let margin = 0.05 * (high - low).max(1e-9);
    let mut chart = ChartBuilder::on(area)
        .caption(title, TITLE_FONT)
        .margin_right(20)
        .x_label_area_size(42)
        .y_label_area_size(names_width)
        .build_cartesian_2d(low - margin..high + margin, (0..rows.len()).into_segmented())?;
    // From the top down.
    let row = |from_below: usize| rows.len().checked_sub(from_below + 1).and_then(|i| rows.get(i));
    let name = |place: &SegmentValue<usize>| match place {
        SegmentValue::CenterOf(i) => row(*i).map_or("", |r| &r.name).to_owned(),
        _ => String::new(),
    };
    chart
        .configure_mesh()
        .disable_y_mesh()
        .light_line_style(TRANSPARENT)
        .x_desc(axis)
        .x_labels(8)
        .y_labels(rows.len())
        .y_label_formatter(&name)
        .label_style(FONT)
        .draw()?;
    for i in 0..rows.len() {
        let Some(Interval { value, interval: [low, high], .. }) = row(i) else { continue };
        let middle = SegmentValue::CenterOf(i);
        chart.draw_series([PathElement::new([(*low, middle.clone()), (*high, middle.clone())], BAR.stroke_width(2))])?;
        for end in [low, high] {
            let line = PathElement::new([(0, -5), (0, 5)], BAR.stroke_width(2));
            chart.draw_series([EmptyElement::at((*end, middle.clone())) + line])?;
        }
        chart.draw_series([EmptyElement::at((*value, middle)) + Circle::new((0, 0), 4, BLACK.filled())])?;
    }
    Ok(())
}
