//! What a fit says of itself, as Markdown and as JSON.

use crate::estimate::Estimate;
use crate::evaluation::Row;
use crate::figures::Errors;
use crate::measurements::Measurements;
use crate::octaves::FITTED_HZ;
use crate::quick::QuickFit;
use crate::walls::WALLS;
use std::fmt::Write;

/// Estimates by wall and octave, what is left, and what is not determined.
#[must_use]
pub fn markdown(fit: &QuickFit, set: &Measurements, [picture, decays]: [&str; 2]) -> String {
    let [x, y, z] = fit.walls.size_m();
    let mut text = format!(
        "# {}\n\nA box of {x:.3} x {y:.3} x {z:.3} m fitted to {} responses at {} Hz (quick fit). \
         Lengths are as they were stated: \
         geometry, positions and clocks were not fitted.\n\n![Absorption by wall]({picture})\n\n\
         ![Decays by octave]({decays})\n\n",
        set.title,
        set.all.len(),
        set.sample_rate_hz
    );
    for note in &set.notes {
        let _ = writeln!(text, "- {note}");
    }
    let missing = fit.missing_hz();
    if !missing.is_empty() {
        let _ = writeln!(text, "- **not fitted, since no response decays by 25 dB there: {missing:?} Hz**");
    }
    if !fit.facing {
        let _ = writeln!(text, "- sources face nowhere that is known: they are taken to send the same in all directions");
    }
    let hz: Vec<f64> = FITTED_HZ.iter().copied().take(fit.octaves.len()).collect();
    let head: Vec<String> = hz.iter().map(|hz| format!("{hz}")).collect();
    let _ = writeln!(text, "\nAbsorption, with one standard error; ? where these data do not determine it.\n");
    let _ = writeln!(text, "| Hz | {} |\n|---|{}", head.join(" | "), "---:|".repeat(hz.len()));
    let cell = |e: &Estimate| format!("{:.2} ± {:.2}{}", e.value, e.error, if e.determined { "" } else { " ?" });
    for (w, name) in WALLS.iter().enumerate() {
        let cells: Vec<String> = fit.octaves.iter().map(|o| cell(&o.absorption[w])).collect();
        let _ = writeln!(text, "| {name} | {} |", cells.join(" | "));
    }
    let line = |name: &str, of: &dyn Fn(usize) -> String| {
        format!("| {name} | {} |\n", (0..hz.len()).map(of).collect::<Vec<String>>().join(" | "))
    };
    text += &line("scattering", &|o| cell(&fit.octaves[o].scattering));
    text += &line("source sharpness", &|o| cell(&fit.octaves[o].sharpness));
    text += &line("T20, s", &|o| format!("{:.3}", fit.t20_s(o)));
    text += &line("late residual, dB", &|o| format!("{:.1}", fit.octaves[o].residual_db));
    text += &line("early residual, dB", &|o| format!("{:.1}", fit.octaves[o].residual_early_db));
    text += &line("decay residual", &|o| format!("{:.3}", fit.octaves[o].residual_decay));
    text += &line("left, JND", &|o| format!("{:.1}", fit.octaves[o].left_jnd));
    text
}

/// The same numbers.
#[must_use]
pub fn json(fit: &QuickFit, set: &Measurements) -> serde_json::Value {
    let estimate = |e: &Estimate| serde_json::json!({ "value": e.value, "error": e.error, "determined": e.determined });
    let octave = |(o, hz): (usize, f64)| {
        let own = &fit.octaves[o];
        let walls: serde_json::Map<String, serde_json::Value> =
            WALLS.iter().zip(&own.absorption).map(|(name, e)| ((*name).to_owned(), estimate(e))).collect();
        serde_json::json!({
            "hz": hz, "fitted": own.fitted, "absorption": walls, "scattering": estimate(&own.scattering),
            "sharpness": estimate(&own.sharpness), "level_db": own.level_db, "residual_late_db": own.residual_db,
            "residual_early_db": own.residual_early_db, "residual_decay": own.residual_decay, "left_jnd": own.left_jnd,
        })
    };
    serde_json::json!({
        "title": set.title, "responses": set.all.len(), "sample_rate_hz": set.sample_rate_hz, "notes": set.notes,
        "low_m": fit.walls.low_m, "high_m": fit.walls.high_m,
        "octaves": FITTED_HZ.iter().copied().take(fit.octaves.len()).enumerate().map(octave).collect::<Vec<_>>(),
    })
}

/// Names and errors of rows, for a table.
#[must_use]
pub fn table(rows: &[Row]) -> Vec<Vec<String>> {
    let head = std::iter::once("held out".to_owned()).chain(Errors::NAMES.iter().map(|n| (*n).to_owned())).collect();
    let digits = [2, 2, 1, 1, 1, 2, 2, 2];
    let line = |row: &Row| {
        let values = row.errors.row().into_iter().zip(digits).map(|(v, d)| format!("{v:.d$}"));
        std::iter::once(row.name.clone()).chain(values).collect()
    };
    std::iter::once(head).chain(rows.iter().map(line)).collect()
}
