//! Named points over two logarithmic axes.

use super::{BAR, FONT, OTHER_BAR, TITLE_FONT};
use anyhow::Result;
use plotters::coord::Shift;
use plotters::coord::combinators::BindKeyPoints;
use plotters::prelude::*;

/// Size of the image, pixels.
pub(super) const SIZE: (u32, u32) = (900, 560);
/// A logarithm has no 0: such values are drawn so far below the least of the others, and their names say that they are 0.
const BELOW_LEAST: f64 = 0.4;
/// Marks of an axis in a decade; of a shorter axis more.
const MARKS: [&[f64]; 3] = [&[1.0], &[1.0, 2.0, 5.0], &[1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 6.0, 7.0, 8.0]];
/// Fewer marks say too little of a scale.
const FEWEST_MARKS: usize = 4;

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
    let ys = || points.iter().map(|p| p.y).filter(|y| *y > 0.0);
    let (least, most) = (ys().fold(f64::INFINITY, f64::min), ys().fold(0.0, f64::max));
    let (least, most) = if least <= most { (least, most) } else { (0.1, 1.0) };
    let floor = BELOW_LEAST * least;
    let place = |p: &Point<'_>| (p.x, if p.y > 0.0 { p.y } else { floor });
    let (x, y) = (0.85 * low.min(high)..1.3 * high.max(low), 0.7 * floor..1.5 * most);
    let marks = [marks(x.start, x.end), marks(y.start, y.end)];
    let [x_marks, y_marks] = marks.clone();
    let mut chart = ChartBuilder::on(area)
        .caption(title, TITLE_FONT)
        .margin(15)
        .x_label_area_size(45)
        .y_label_area_size(60)
        .build_cartesian_2d(x.log_scale().with_key_points(x_marks), y.log_scale().with_key_points(y_marks))?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .x_desc(axes[0])
        .y_desc(axes[1])
        .x_labels(marks[0].len())
        .y_labels(marks[1].len())
        .x_label_formatter(&|x| number(*x))
        .y_label_formatter(&|y| number(*y))
        .label_style(FONT)
        .draw()?;
    let best: Vec<(f64, f64)> = points.iter().filter(|p| p.stands_out).map(place).collect();
    chart.draw_series(LineSeries::new(best.iter().copied(), BAR.stroke_width(1)))?;
    let ground = chart.plotting_area();
    let pixel = |at: &(f64, f64)| ground.map_coordinate(at);
    let joined: Vec<(i32, i32)> = best.iter().map(pixel).collect();
    let (across, down) = ground.get_pixel_range();
    let mut names = Names {
        inside: [across.start, down.start, across.end, down.end],
        dots: points.iter().map(|p| pixel(&place(p))).collect(),
        lines: joined.windows(2).map(|pair| [pair[0], pair[1]]).collect(),
        placed: Vec::new(),
    };
    let texts: Vec<String> =
        points.iter().map(|p| if p.y > 0.0 { p.name.to_owned() } else { format!("{} (0)", p.name) }).collect();
    // Those that stand out have the first choice.
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by_key(|i| !points[*i].stands_out);
    for i in order {
        let (p, text) = (&points[i], &texts[i]);
        let (width, height) = area.estimate_text_size(text, &FONT.into_font().into())?;
        let (width, height) = (i32::try_from(width)?, i32::try_from(height)?);
        let (offset, far) = names.place(i, (width, height));
        let (colour, ink) = if p.stands_out { (BAR, BLACK) } else { (OTHER_BAR, RGBColor(0x70, 0x70, 0x70)) };
        let name = Text::new(text.clone(), offset, FONT.into_font().color(&ink));
        let dot = EmptyElement::at(place(p)) + Circle::new((0, 0), 4, colour.filled());
        if far {
            let to = (if offset.0 > 0 { offset.0 - 3 } else { offset.0 + width + 3 }, offset.1 + height / 2);
            chart.draw_series([EmptyElement::at(place(p)) + PathElement::new([(0, 0), to], OTHER_BAR)])?;
        }
        chart.draw_series([dot + name])?;
    }
    Ok(())
}

/// Round numbers within a range, enough of them for its length.
fn marks(low: f64, high: f64) -> Vec<f64> {
    let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let of = |steps: &[f64]| -> Vec<f64> {
        let all = decades.clone().flat_map(|decade| steps.iter().map(move |step| step * 10.0_f64.powi(decade)));
        all.filter(|mark| (low..=high).contains(mark)).collect()
    };
    let [first, second, third] = MARKS.map(of);
    [first, second].into_iter().find(|marks| marks.len() >= FEWEST_MARKS).unwrap_or(third)
}

/// A mark without the zeros at its end.
fn number(mark: f64) -> String {
    let text = format!("{mark:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Left, top, right and bottom, pixels.
type Frame = [i32; 4];

/// Where names stand.
struct Names {
    inside: Frame,
    dots: Vec<(i32, i32)>,
    lines: Vec<[(i32, i32); 2]>,
    placed: Vec<Frame>,
}

impl Names {
    /// Finds room for the name of a dot, as near as there is; returns how far it is from it, and whether that is so far that a
    /// line should lead to it.
    fn place(&mut self, of: usize, (width, height): (i32, i32)) -> ((i32, i32), bool) {
        let at = self.dots[of];
        let mut best = (i64::MAX, (0, 0), [0; 4]);
        for distance in 0..14 {
            let rise = 8 * distance;
            for x in [8, -width - 8] {
                for y in [-height / 2 - rise, -height / 2 + rise] {
                    let frame = [at.0 + x, at.1 + y, at.0 + x + width, at.1 + y + height];
                    let cost = self.cost(of, &frame) + i64::from(4 * distance) + i64::from(x < 0);
                    if cost < best.0 {
                        best = (cost, (x, y), frame);
                    }
                }
            }
        }
        self.placed.push(best.2);
        let (x, y) = best.1;
        ((x, y), (y + height / 2).abs() > 20)
    }

    /// What is wrong with a place: names beyond the picture and over each other are worse than those over dots and lines.
    fn cost(&self, of: usize, frame: &Frame) -> i64 {
        let [left, top, right, bottom] = *frame;
        let beyond = left < self.inside[0] || top < self.inside[1] || right > self.inside[2] || bottom > self.inside[3];
        let meets = |other: &Frame| left < other[2] + 3 && other[0] < right + 3 && top < other[3] + 3 && other[1] < bottom + 3;
        let names = self.placed.iter().filter(|other| meets(other)).count() as i64;
        let dot = |(x, y): (i32, i32)| meets(&[x - 5, y - 5, x + 5, y + 5]);
        let dots = self.dots.iter().enumerate().filter(|(i, at)| *i != of && dot(**at)).count() as i64;
        let lines = self.lines.iter().filter(|line| crosses(line, frame)).count() as i64;
        1000 * i64::from(beyond) + 500 * names + 200 * dots + 30 * lines
    }
}

/// Whether a line goes through a frame, by points along it.
fn crosses([from, to]: &[(i32, i32); 2], [left, top, right, bottom]: &Frame) -> bool {
    let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()).max(1);
    (0..=steps).any(|i| {
        let at = |a: i32, b: i32| a + (b - a) * i / steps;
        let (x, y) = (at(from.0, to.0), at(from.1, to.1));
        (*left..=*right).contains(&x) && (*top..=*bottom).contains(&y)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_has_marks_however_short_it_is() {
        assert_eq!(marks(0.008, 20.0), [0.01, 0.1, 1.0, 10.0]);
        assert!(marks(0.9, 6.2).len() >= FEWEST_MARKS && marks(3.0, 4.5).len() >= 3);
    }

    #[test]
    fn names_of_neighbours_do_not_meet() {
        let dots: Vec<(i32, i32)> = (0..6).map(|i| (400 + 2 * i, 300 + i)).collect();
        let mut names = Names { inside: [0, 0, 900, 560], dots, lines: Vec::new(), placed: Vec::new() };
        for i in 0..6 {
            names.place(i, (150, 13));
        }
        for (i, one) in names.placed.iter().enumerate() {
            for other in &names.placed[i + 1..] {
                let apart = one[2] <= other[0] || other[2] <= one[0] || one[3] <= other[1] || other[3] <= one[1];
                assert!(apart, "{one:?} and {other:?}");
            }
            assert!(one[0] >= 0 && one[2] <= 900);
        }
    }
}
