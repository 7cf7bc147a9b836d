//! Plots as SVG and PNG.

mod intervals;
mod plan;

pub(crate) use intervals::Interval;
pub(crate) use plan::{Panel, Plan};

use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::prelude::*;
use promenade_metrics::statistics::quantile;

const WIDTH: u32 = 720;
const BAR: RGBColor = RGBColor(0x4a, 0x7f, 0xb5);
const OTHER_BAR: RGBColor = RGBColor(0xc8, 0xc8, 0xc8);
const FONT: (&str, u32) = ("sans-serif", 13);
const TITLE_FONT: (&str, u32) = ("sans-serif", 15);
/// Height of a picture whose legend can be read.
const LEAST_LEGEND: u32 = 160;
/// Left of the boxes, for the names of rows.
const NAMES_WIDTH: u32 = 170;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// A box for each named row of rising values: quartiles and median, and whiskers from the smallest to the largest value. The
/// first row stands out.
pub(crate) fn boxes(title: &str, rows: &[(&str, Vec<f64>)]) -> Result<String> {
    let most = rows.iter().filter_map(|(_, v)| v.last()).fold(0.0_f64, |m, v| m.max(*v));
    let height = 75 + 28 * u32::try_from(rows.len())?;
    svg(height, |area| {
        let mut chart = ChartBuilder::on(area)
            .caption(title, TITLE_FONT)
            .margin_right(20)
            .x_label_area_size(30)
            .y_label_area_size(NAMES_WIDTH)
            .build_cartesian_2d(0.0..if most > 0.0 { 1.05 * most } else { 1.0 }, (0..rows.len()).into_segmented())?;
        // From the top down.
        let row = |from_below: usize| rows.len().checked_sub(from_below + 1).and_then(|i| rows.get(i));
        let name = |place: &SegmentValue<usize>| match place {
            SegmentValue::CenterOf(i) => row(*i).map_or("", |r| r.0).to_owned(),
            _ => String::new(),
        };
        chart
            .configure_mesh()
            .disable_y_mesh()
            .light_line_style(TRANSPARENT)
            .x_labels(8)
            .y_labels(rows.len())
            .y_label_formatter(&name)
            .label_style(FONT)
            .draw()?;
        for i in 0..rows.len() {
            let values = row(i).map_or(&[][..], |r| &r.1);
            let [Some(low), Some(q1), Some(median), Some(q3), Some(high)] =
                [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| quantile(values, share))
            else {
                continue;
            };
            let middle = SegmentValue::CenterOf(i);
            chart.draw_series([PathElement::new([(low, middle.clone()), (high, middle.clone())], BLACK)])?;
            let colour = if i + 1 == rows.len() { BAR } else { OTHER_BAR };
            let mut bar = Rectangle::new([(q1, SegmentValue::Exact(i)), (q3, SegmentValue::Exact(i + 1))], colour.filled());
            bar.set_margin(6, 6, 0, 0);
            chart.draw_series([bar])?;
            let line = PathElement::new([(0, -8), (0, 8)], BLACK.stroke_width(2));
            chart.draw_series([EmptyElement::at((median, middle)) + line])?;
        }
        Ok(())
    })
}

/// A value with its interval for each name, as SVG.
pub(crate) fn intervals(title: &str, axis: &str, rows: &[Interval]) -> Result<String> {
    svg(intervals::height(rows.len())?, |area| intervals::draw(area, title, axis, rows, NAMES_WIDTH))
}

/// Named curves over one horizontal axis, one below the other, each from 0 to its largest value.
pub(crate) fn curves(axis: &str, curves: &[(&str, Vec<(f64, f64)>)]) -> Result<String> {
    let end = curves.iter().flat_map(|(_, points)| points).fold(1.0_f64, |m, p| m.max(p.0));
    svg(190 * u32::try_from(curves.len())?, |area| {
        for (panel, (name, points)) in area.split_evenly((curves.len(), 1)).iter().zip(curves) {
            let finite = points.iter().copied().filter(|p| p.1.is_finite());
            let most = finite.clone().fold(1e-12_f64, |m, p| m.max(p.1));
            let mut chart = ChartBuilder::on(panel)
                .caption(name, TITLE_FONT)
                .margin_right(20)
                .x_label_area_size(38)
                .y_label_area_size(70)
                .build_cartesian_2d(0.0..end, 0.0..1.05 * most)?;
            chart
                .configure_mesh()
                .light_line_style(TRANSPARENT)
                .x_desc(axis)
                .x_label_formatter(&f64::to_string)
                .y_labels(5)
                .label_style(FONT)
                .draw()?;
            chart.draw_series(LineSeries::new(finite, BAR.stroke_width(2)))?;
        }
        Ok(())
    })
}

/// Measures over a plan of a room, as SVG.
pub(crate) fn plan_svg(plan: &Plan, panels: &[Panel]) -> Result<String> {
    svg_of(plan.size(panels.len())?, |area| plan.draw(area, panels))
}

/// Measures over a plan of a room, as PNG.
pub(crate) fn plan_png(plan: &Plan, panels: &[Panel]) -> Result<Vec<u8>> {
    png_of(plan.size(panels.len())?, |area| plan.draw(area, panels))
}

fn png_of(
    (width, height): (u32, u32),
    draw: impl FnOnce(&DrawingArea<BitMapBackend<'_>, Shift>) -> Result<()>,
) -> Result<Vec<u8>> {
    register_font()?;
    let mut pixels = vec![0; 3 * width as usize * height as usize];
    {
        let area = BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area();
        area.fill(&WHITE)?;
        draw(&area)?;
        area.present()?;
    }
    png([width, height], &pixels)
}

/// Red, green and blue of each pixel, row by row from above, as PNG.
pub(crate) fn png([width, height]: [u32; 2], pixels: &[u8]) -> Result<Vec<u8>> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(pixels)?;
    Ok(file)
}

/// A picture of numbers with a legend on its right, as PNG. Colours reach from the least number to the greatest unless told.
pub(crate) fn picture_png([width, height]: [usize; 2], numbers: &[f32], range: Option<[f64; 2]>) -> Result<Vec<u8>> {
    let size = (u32::try_from(width)? + plan::AROUND[1], u32::try_from(height)?.max(LEAST_LEGEND));
    png_of(size, |area| plan::picture(area, width, numbers, range))
}

/// An image of the usual width with a white ground.
fn svg(height: u32, draw: impl FnOnce(&Area<'_>) -> Result<()>) -> Result<String> {
    svg_of((WIDTH, height), draw)
}

fn svg_of(size: (u32, u32), draw: impl FnOnce(&Area<'_>) -> Result<()>) -> Result<String> {
    register_font()?;
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        area.fill(&WHITE)?;
        draw(&area)?;
        area.present()?;
    }
    Ok(text)
}

/// Text is as wide as in this font; the system's fonts are not asked.
fn register_font() -> Result<()> {
    plotters::style::register_font(FONT.0, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT)
        .map_err(|_| anyhow!("the font of plots cannot be read"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_empty_rows_are_drawn() {
        let text = boxes("a & b", &[("<x>", vec![0.0, 7.7]), ("none", Vec::new())]).unwrap();
        assert!(text.contains("a &amp; b") && text.contains("&lt;x&gt;") && text.contains("none"), "{text}");
        assert_eq!(text.matches("<rect").count(), 2, "the ground and one box");
    }
}
