//! The course of a training as a picture.

use crate::checkpoint::CurvePoint;

const WIDTH: f64 = 720.0;
const PANEL: f64 = 150.0;
const LEFT: f64 = 70.0;
const GAP: f64 = 40.0;

/// Loss, MAG, LRE and ENV over steps, one under the other, as SVG.
#[must_use]
pub fn picture(curve: &[CurvePoint]) -> String {
    type Row = (&'static str, fn(&CurvePoint) -> f64);
    let rows: [Row; 4] = [
        ("loss, training", |p| p.loss),
        ("MAG, test", |p| p.test[0]),
        ("LRE, test, dB", |p| p.test[1]),
        ("ENV, test", |p| p.test[2]),
    ];
    let height = GAP + rows.len() as f64 * (PANEL + GAP);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} {height}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    let last = curve.last().map_or(1, |p| p.step).max(1) as f64;
    for (number, (name, value)) in rows.into_iter().enumerate() {
        let top = GAP + number as f64 * (PANEL + GAP);
        let most = curve.iter().map(value).fold(0.0_f64, f64::max).max(1e-12);
        let points: Vec<String> = curve
            .iter()
            .filter(|p| value(p).is_finite())
            .map(|p| {
                let x = LEFT + (WIDTH - LEFT - 20.0) * p.step as f64 / last;
                format!("{x:.1},{:.1}", top + PANEL * (1.0 - value(p) / most))
            })
            .collect();
        let bottom = top + PANEL;
        svg += &format!(
            "<text x=\"{LEFT}\" y=\"{:.1}\">{name}</text>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{most:.3}</text>\
             <text x=\"{:.1}\" y=\"{bottom:.1}\" text-anchor=\"end\">0</text>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">step {last}</text>\
             <path d=\"M{LEFT} {top:.1}V{bottom:.1}H{:.1}\" fill=\"none\" stroke=\"#999\"/>\
             <polyline points=\"{}\" fill=\"none\" stroke=\"#4a7fb5\" stroke-width=\"2\"/>\n",
            top - 6.0,
            LEFT - 8.0,
            top + 10.0,
            LEFT - 8.0,
            WIDTH - 20.0,
            bottom + 16.0,
            WIDTH - 20.0,
            points.join(" ")
        );
    }
    svg + "</svg>\n"
}
