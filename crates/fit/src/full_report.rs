//! What a full fit says of itself, as Markdown and as JSON.

use crate::bands::PerBand;
use crate::estimate::Estimate;
use crate::flat_room::Form;
use crate::full_fit::FullFit;
use crate::full_fit::voxel_fit::VoxelFit;
use crate::measurements::{Measurements, distance};
use crate::octaves::{FITTED_HZ, octaves_at};
use std::fmt::Write;

fn cell(e: &Estimate) -> String {
    format!("{:.2} ± {:.2}{}", e.value, e.error, if e.determined { "" } else { " ?" })
}

fn db(energy: f64) -> f64 {
    10.0 * energy.max(1e-30).log10()
}

/// Metres with an error, if there is one.
fn signed(m: f64, error_m: f64) -> String {
    if error_m > 0.0 { format!("{m:+.3} ± {error_m:.3}") } else { format!("{m:+.3}") }
}

fn worst(errors: [f64; 3]) -> f64 {
    errors.into_iter().fold(0.0, f64::max)
}

/// A table in Markdown, its first row the head.
fn table(rows: &[Vec<String>]) -> String {
    let mut text = String::new();
    for (i, row) in rows.iter().enumerate() {
        let _ = writeln!(text, "| {} |", row.join(" | "));
        if i == 0 {
            let _ = writeln!(text, "|---|{}", "---:|".repeat(row.len() - 1));
        }
    }
    text
}

fn row(name: &str, values: impl Iterator<Item = String>) -> Vec<String> {
    std::iter::once(name.to_owned()).chain(values).collect()
}

/// Walls and places with how far they moved, estimates by surface and band, what is left, and what is not determined, beside
/// pictures of absorption, of the plan and of decays.
#[must_use]
pub fn full_markdown(fit: &FullFit, set: &Measurements, [picture, plan, decays]: [&str; 3]) -> String {
    let form = match &fit.room.form {
        Form::Box(walls) => {
            let [x, y, z] = walls.size_m();
            format!("A box of {x:.3} x {y:.3} x {z:.3} m")
        }
        Form::Mesh(_) => format!("A room of {} flat walls", fit.room.walls.len()),
    };
    let mut text = format!(
        "# {}\n\n{form} fitted to {} responses at {} Hz: walls, places, clocks, surfaces, scattering and source.\n\n\
         ![Absorption by surface]({picture})\n\n![The plan that was found over the stated one]({plan})\n\n\
         ![Decays by octave]({decays})\n\n",
        set.title,
        set.all.len(),
        set.sample_rate_hz
    );
    for note in &set.notes {
        let _ = writeln!(text, "- {note}");
    }
    if !fit.missing_hz.is_empty() {
        let _ =
            writeln!(text, "- **no reverberation is known, since no response decays by 25 dB there: {:?} Hz**", fit.missing_hz);
    }
    let open = fit.undetermined();
    if !open.is_empty() {
        let _ = writeln!(text, "- **not determined by these data: {}**", open.join(", "));
    }
    if !fit.facing && fit.sent.is_empty() {
        let _ = writeln!(text, "- sources face nowhere that is known: they are taken to send the same in all directions");
    }
    let _ = writeln!(text, "\n## Surfaces\n\nAbsorption, with one standard error; ? where these data do not determine it.\n");
    let hz = fit.bands.centres_hz;
    let mut rows = vec![row("Hz", hz.iter().map(|hz| format!("{hz:.0}")))];
    rows.extend(fit.surfaces.iter().map(|s| row(&s.name, s.absorption.iter().map(cell))));
    rows.push(row("scattering of all", fit.scattering.iter().map(cell)));
    text += &table(&rows);
    if let Some(own) = &fit.voxels {
        text += &pieces(own, &hz);
    }
    let _ = writeln!(text, "\n## What surfaces do not explain\n");
    let octaves = 0..octaves_at(f64::from(set.sample_rate_hz));
    let line = |name: &str, of: &dyn Fn(usize) -> String| row(name, octaves.clone().map(of));
    text += &table(&[
        line("octave, Hz", &|o| format!("{}", FITTED_HZ[o])),
        line("T20, s", &|o| format!("{:.3}", fit.t20_s(o))),
        line("direct sound, dB", &|o| format!("{:+.1}", fit.residual.direct.get(o).map_or(0.0, |e| db(*e)))),
        line("reflections, dB", &|o| format!("{:+.1}", fit.residual.images.get(o).map_or(0.0, |e| db(*e)))),
        line("diffuse sound at 50 ms, dB", &|o| format!("{:+.1}", db(fit.residual.at(o, 12)))),
        line("at 200 ms, dB", &|o| format!("{:+.1}", db(fit.residual.at(o, 50)))),
    ]);
    let compared = if fit.waves { "responses agree with the room wave by wave" } else { "magnitudes were compared, not waves" };
    let _ = writeln!(
        text,
        "\nMean difference of log magnitudes that is left in the early part: {:.3} nepers; {compared}.",
        fit.left
    );
    text += "\n## Walls\n\nHow far each moved outwards, with one standard error, and by how many standard deviations its \
             echoes stand out of the scan.\n\n";
    let mut rows = vec![row("wall", ["moved, m", "stands out", ""].map(str::to_owned).into_iter())];
    for (found, wall) in fit.walls.iter().zip(&fit.room.walls) {
        let said = match (found.scanned.found, found.is_determined(), found.error_m > 0.0) {
            (true, ..) => "found",
            (false, true, true) => "not found by the scan; moved by the early part",
            (false, _, true) => "not determined by these data",
            (false, _, false) => "held where it was stated",
        };
        let cells = [signed(found.moved_m, found.error_m), format!("{:.1}", found.scanned.stands_out), said.to_owned()];
        rows.push(row(&fit.room.surfaces[wall.surface], cells.into_iter()));
    }
    text += &table(&rows);
    text += "\n## Places\n\nHow far each moved, and one standard error of a coordinate.\n\n";
    let head = ["source moved, m", "microphone moved, m", "source sounded at, ms"];
    let mut rows = vec![row("response", head.map(str::to_owned).into_iter())];
    for (found, m) in fit.places.iter().zip(&set.all) {
        let cells = [
            signed(distance(found.source_m, m.source.at_m), worst(found.source_error_m)),
            signed(distance(found.microphone_m, m.microphone.at_m), worst(found.microphone_error_m)),
            format!("{:.3}", 1e3 * found.began_s),
        ];
        rows.push(row(&m.name, cells.into_iter()));
    }
    text + &table(&rows)
}

/// Pieces of surfaces: how many sound has met, how many were guessed, and how far guesses are off.
fn pieces(own: &VoxelFit, hz: &PerBand) -> String {
    let count = own.voxels.patches.len();
    let touched = (0..count).filter(|p| own.is_touched(*p)).count();
    let guessed = own.guessed.iter().filter(|g| **g).count();
    let mut text = format!(
        "\n## Pieces\n\nSurfaces are in {count} pieces of voxels of {} m, of which those above are the means. Sound that was \
         heard tells of {touched} of them.",
        own.voxels.edge_m
    );
    match &own.off {
        Some(off) => {
            let _ = writeln!(
                text,
                " Pictures show {}; {guessed} that sound does not tell of were guessed from those that look alike. Where sound \
                 tells, such guesses are off by:\n",
                own.shown
            );
            let rows =
                [row("Hz", hz.iter().map(|hz| format!("{hz:.0}"))), row("absorption", off.iter().map(|o| format!("{o:.2}")))];
            text += &table(&rows);
        }
        None if own.shown > 0 => text += " Pictures show too few of these to learn from.\n",
        None => text += " The others are as their surface is in the mean.\n",
    }
    text
}

/// The same numbers.
#[must_use]
pub fn full_json(fit: &FullFit, set: &Measurements) -> serde_json::Value {
    let estimates = |all: &[Estimate]| -> Vec<serde_json::Value> {
        all.iter().map(|e| serde_json::json!({ "value": e.value, "error": e.error, "determined": e.determined })).collect()
    };
    let named = |s: &crate::full_fit::SurfaceFit| serde_json::json!({ "name": s.name, "absorption": estimates(&s.absorption) });
    let wall = |(found, wall): (&crate::full_fit::WallFound, &crate::flat_room::FlatWall)| {
        serde_json::json!({
            "surface": fit.room.surfaces[wall.surface], "normal": wall.normal, "at_m": wall.at_m, "moved_m": found.moved_m,
            "error_m": found.error_m, "stands_out": found.scanned.stands_out, "found": found.scanned.found,
            "determined": found.is_determined(),
        })
    };
    let place = |(f, m): (&crate::full_fit::Found, &crate::measurements::Measurement)| {
        serde_json::json!({
            "name": m.name, "source_m": f.source_m, "microphone_m": f.microphone_m, "began_s": f.began_s,
            "source_error_m": f.source_error_m, "microphone_error_m": f.microphone_error_m,
            "stated_source_m": m.source.at_m, "stated_microphone_m": m.microphone.at_m,
        })
    };
    let sent: Vec<PerBand> = fit.sent.iter().map(|n| n.map(|v| 20.0 * v * std::f64::consts::LOG10_E)).collect();
    let octaves = octaves_at(f64::from(set.sample_rate_hz));
    let pieces = fit.voxels.as_ref().map(|own| {
        let piece = |(p, patch): (usize, &crate::flat_room::voxels::Patch)| {
            serde_json::json!({
                "surface": fit.room.surfaces[patch.surface], "centre_m": patch.centre_m, "area_m2": patch.area_m2,
                "guessed": own.guessed[p], "absorption": estimates(&own.absorption[p]),
            })
        };
        serde_json::json!({
            "edge_m": own.voxels.edge_m, "shown": own.shown, "guesses_off": own.off,
            "all": own.voxels.patches.iter().enumerate().map(piece).collect::<Vec<_>>(),
        })
    });
    serde_json::json!({
        "title": set.title, "responses": set.all.len(), "sample_rate_hz": set.sample_rate_hz, "notes": set.notes,
        "not_fitted_hz": fit.missing_hz, "bands_hz": fit.bands.centres_hz,
        "surfaces": fit.surfaces.iter().map(named).collect::<Vec<_>>(), "scattering": estimates(&fit.scattering),
        "source": { "nodes_db": sent, "turns": fit.facing },
        "walls": fit.walls.iter().zip(&fit.room.walls).map(wall).collect::<Vec<_>>(),
        "places": fit.places.iter().zip(&set.all).map(place).collect::<Vec<_>>(),
        "octaves_hz": &FITTED_HZ[..octaves], "t20_s": (0..octaves).map(|o| fit.t20_s(o)).collect::<Vec<f64>>(),
        "residual": { "direct": fit.residual.direct, "images": fit.residual.images, "diffuse": fit.residual.diffuse },
        "left": fit.left, "waves": fit.waves, "pieces": pieces,
    })
}
