//! Box plots as plain SVG.

use promenade_baker::evaluate::{Evaluation, Figure};

const WIDTH: f64 = 720.0;
/// Left of the boxes, for the names.
const NAMES: f64 = 190.0;
const ROW: f64 = 26.0;
const TOP: f64 = 44.0;

/// A box per method: quartiles, median, and whiskers from the smallest to the largest, over the clips of all evaluations.
pub(super) fn boxes(evaluations: &[Evaluation], figure: Figure) -> String {
    let mut names: Vec<&str> = Vec::new();
    for m in evaluations.iter().flat_map(|e| &e.methods) {
        if !names.contains(&m.name.as_str()) {
            names.push(&m.name);
        }
    }
    let values = |name: &str| {
        let methods = evaluations.iter().flat_map(|e| &e.methods).filter(|m| m.name == name);
        let mut all: Vec<f64> = methods.flat_map(|m| &m.clips).filter_map(|(_, f)| f.get(figure)).collect();
        all.sort_by(f64::total_cmp);
        all
    };
    let rows: Vec<(&str, Vec<f64>)> = names.iter().map(|n| (*n, values(n))).collect();
    let most = rows.iter().filter_map(|(_, v)| v.last()).fold(0.0_f64, |m, v| m.max(*v));
    let step = step(most);
    let end = (most / step).ceil().max(1.0) * step;
    let height = TOP + ROW * rows.len() as f64 + 30.0;
    let x = |v: f64| NAMES + (WIDTH - NAMES - 24.0) * v / end;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} {height}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <text x=\"12\" y=\"24\" font-size=\"15\">{}</text>\n",
        escaped(figure.heading())
    );
    let bottom = TOP + ROW * rows.len() as f64;
    let mut tick = 0.0;
    while tick <= end * (1.0 + 1e-9) {
        let at = x(tick);
        svg += &format!(
            "<path d=\"M{at:.1} {TOP}V{bottom}\" stroke=\"#ddd\"/><text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\n",
            bottom + 18.0,
            short(tick)
        );
        tick += step;
    }
    for (number, (name, values)) in rows.iter().enumerate() {
        let middle = TOP + ROW * (number as f64 + 0.5);
        svg +=
            &format!("<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>\n", NAMES - 10.0, middle + 4.0, escaped(name));
        let at = |share: f64| quantile(values, share).map(x);
        let (Some(low), Some(q1), Some(median), Some(q3), Some(high)) = (at(0.0), at(0.25), at(0.5), at(0.75), at(1.0)) else {
            continue;
        };
        let (up, down) = (middle - 8.0, middle + 8.0);
        let fill = if number == 0 { "#4a7fb5" } else { "#c8c8c8" };
        svg += &format!(
            "<path d=\"M{low:.1} {middle:.1}H{high:.1}\" stroke=\"black\"/>\
             <rect x=\"{q1:.1}\" y=\"{up:.1}\" width=\"{:.1}\" height=\"16\" fill=\"{fill}\" stroke=\"black\"/>\
             <path d=\"M{median:.1} {up:.1}V{down:.1}\" stroke=\"black\" stroke-width=\"2\"/>\n",
            q3 - q1
        );
    }
    svg + "</svg>\n"
}

/// A value below which this share of rising values lies, interpolated.
fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let place = share * (sorted.len().checked_sub(1)?) as f64;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
    let below = place.floor() as usize;
    let (a, b) = (sorted.get(below)?, sorted.get(below + 1).or(sorted.last())?);
    Some(a + (b - a) * place.fract())
}

/// A round distance between ticks, so that there are three to eight.
fn step(most: f64) -> f64 {
    if most <= 0.0 || !most.is_finite() {
        return 1.0;
    }
    let power = 10.0_f64.powf((most / 3.0).log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|f| f * power).find(|s| most / s > 2.999).unwrap_or(power)
}

fn short(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_and_ticks() {
        let v = [1.0, 2.0, 3.0, 5.0];
        assert_eq!([0.0, 0.5, 1.0].map(|s| quantile(&v, s)), [Some(1.0), Some(2.5), Some(5.0)]);
        assert_eq!(quantile(&[], 0.5), None);
        for most in [0.0123, 0.3, 1.0, 7.7, 950.0] {
            let ticks = most / step(most);
            assert!((2.999..8.0).contains(&ticks), "{most}: {ticks}");
        }
        assert_eq!((short(0.25), short(10.0), short(0.0)), ("0.25".to_owned(), "10".to_owned(), "0".to_owned()));
    }
}
