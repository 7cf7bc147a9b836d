//! What a full fit says of itself.

use super::beside::beside_a_regression;
use super::markdown::{begin, cell, markdown_table, row};
use super::mesh::{full_mesh, patch_group, room_obj};
use crate::bands::{BANDS, Estimate, FITTED_HZ, PerBand, db, octaves_at};
use crate::error::FitError;
use crate::fits::{Found, FullFit, SurfaceFit, VoxelFit, WallFound};
use crate::measurements::{Measurement, Measurements, distance};
use crate::room::{FlatWall, Form, Patch};
use promenade_acoustics::Octaves;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Metres with an error, if there is one.
fn signed(m: f64, error_m: f64) -> String {
    if error_m > 0.0 { format!("{m:+.3} ± {error_m:.3}") } else { format!("{m:+.3}") }
}

fn worst(errors: [f64; 3]) -> f64 {
    errors.into_iter().fold(0.0, f64::max)
}

impl FullFit {
    /// Gives a surface another absorption, by octave from 125 Hz.
    pub fn set_absorption(&mut self, surface: usize, absorption: &Octaves) {
        let stated = self.bands.of_material_octaves(&absorption.map(f64::from)).map(Estimate::stated);
        self.surfaces[surface].absorption = stated;
        if let Some(own) = &mut self.voxels {
            let of_surface = |(patch, _): &(&Patch, &mut [Estimate; BANDS])| patch.surface == surface;
            let patches = own.voxels.patches.iter().zip(&mut own.absorption).filter(of_surface);
            patches.for_each(|(_, absorption)| *absorption = stated);
        }
    }

    /// What these data do not tell, in words.
    #[must_use]
    pub fn doubts(&self) -> Vec<String> {
        let missing = self.missing_hz.iter().map(|hz| format!("no reverberation is known of the octave about {hz} Hz"));
        let open = self.undetermined();
        let open = (!open.is_empty()).then(|| format!("not determined by these data: {}", open.join(", ")));
        missing.chain(open).collect()
    }

    /// The room as a text in the format OBJ, metres, a group for each material.
    ///
    /// # Errors
    /// A box without a volume.
    pub fn obj(&self) -> Result<String, FitError> {
        if self.voxels.is_some() { Ok(full_mesh(self)?.to_obj()) } else { Ok(room_obj(&self.room)) }
    }

    /// Materials of the groups of [`Self::obj`] as `simulate` understands them.
    #[must_use]
    pub fn materials(&self) -> BTreeMap<String, String> {
        let bands = |shares: &PerBand| -> String {
            let band = |(hz, share): (&f64, &f64)| format!("{hz:.0}@{:.4}", share.clamp(0.0, 1.0));
            self.bands.centres_hz.iter().zip(shares).map(band).collect::<Vec<String>>().join("/")
        };
        let scattering = bands(&self.scattering.map(|e| e.value));
        let material = |absorption: &PerBand| format!("{}:{scattering}", bands(absorption));
        let Some(own) = &self.voxels else {
            let whole = |s: &SurfaceFit| (s.name.clone(), material(&s.absorption.map(|e| e.value)));
            return self.surfaces.iter().map(whole).collect();
        };
        let of = own.materials(self.room.surfaces.len()).1;
        let groups = self.room.surfaces.iter().zip(&of).flat_map(|(name, all)| {
            all.iter().enumerate().map(|(number, absorption)| (patch_group(name, number), material(absorption)))
        });
        groups.collect()
    }

    /// Estimates, what is left, and what is not determined, as Markdown, with the name of the picture of decays beside it.
    #[must_use]
    pub fn markdown(&self, set: &Measurements, decays: &str) -> String {
        let form = match &self.room.form {
            Form::Box(walls) => {
                let [x, y, z] = walls.size_m();
                format!("A box of {x:.3} x {y:.3} x {z:.3} m")
            }
            Form::Mesh(_) => format!("A room of {} flat walls", self.room.walls.len()),
        };
        let mut text = begin(set, &form, decays);
        if !self.missing_hz.is_empty() {
            let missing = &self.missing_hz;
            text += &format!("- **no reverberation is known, since no response decays by 25 dB there: {missing:?} Hz**\n");
        }
        let open = self.undetermined();
        if !open.is_empty() {
            text += &format!("- **not determined by these data: {}**\n", open.join(", "));
        }
        if !self.facing && self.node_levels.is_empty() {
            text += "- sources face nowhere that is known: they are taken to send the same in all directions\n";
        }
        text + &surfaces(self) + &residual(self, set) + &walls(self) + &places(self, set) + &beside_a_regression(self, set)
    }

    /// The numbers of [`Self::markdown`], and all others, as JSON.
    #[must_use]
    pub fn json(&self, set: &Measurements) -> Value {
        let wall = |(found, wall): (&WallFound, &FlatWall)| {
            json!({
                "surface": self.room.surfaces[wall.surface], "normal": wall.normal, "at_m": wall.at_m,
                "moved_m": found.moved_m, "error_m": found.error_m, "stands_out": found.scanned.stands_out,
                "found": found.scanned.found, "determined": found.is_determined(),
            })
        };
        let place = |(f, m): (&Found, &Measurement)| {
            json!({
                "name": m.name, "source_m": f.source_m, "microphone_m": f.microphone_m, "began_s": f.began_s,
                "source_error_m": f.source_error_m, "microphone_error_m": f.microphone_error_m,
                "stated_source_m": m.source.at_m, "stated_microphone_m": m.microphone.at_m,
            })
        };
        let levels_db = |n: &PerBand| n.map(|v| 20.0 * v * std::f64::consts::LOG10_E);
        let octaves = octaves_at(f64::from(set.sample_rate_hz));
        let patch = |own: &VoxelFit, p: usize, patch: &Patch| {
            json!({
                "surface": self.room.surfaces[patch.surface], "centre_m": patch.centre_m, "area_m2": patch.area_m2,
                "guessed": own.guessed[p], "absorption": own.absorption[p],
            })
        };
        let patches = self.voxels.as_ref().map(|own| {
            let all = own.voxels.patches.iter().enumerate().map(|(p, one)| patch(own, p, one));
            json!({
                "edge_m": own.voxels.edge_m, "shown": own.shown, "guesses_off": own.off, "all": all.collect::<Vec<_>>(),
            })
        });
        json!({
            "title": set.title, "responses": set.all.len(), "sample_rate_hz": set.sample_rate_hz, "notes": set.notes,
            "not_fitted_hz": self.missing_hz, "bands_hz": self.bands.centres_hz,
            "surfaces": self.surfaces, "scattering": self.scattering,
            "source": { "nodes_db": self.node_levels.iter().map(levels_db).collect::<Vec<_>>(), "turns": self.facing },
            "walls": self.walls.iter().zip(&self.room.walls).map(wall).collect::<Vec<_>>(),
            "places": self.places.iter().zip(&set.all).map(place).collect::<Vec<_>>(),
            "octaves_hz": &FITTED_HZ[..octaves], "t20_s": (0..octaves).map(|o| self.t20_s(o)).collect::<Vec<f64>>(),
            "residual": self.residual, "left": self.left, "waves": self.waves, "pieces": patches,
        })
    }
}

fn surfaces(fit: &FullFit) -> String {
    let hz = row("Hz", fit.bands.centres_hz.iter().map(|hz| format!("{hz:.0}")));
    let mut rows = vec![hz.clone()];
    rows.extend(fit.surfaces.iter().map(|s| row(&s.name, s.absorption.iter().map(cell))));
    rows.push(row("scattering of all", fit.scattering.iter().map(cell)));
    let head = "\n## Surfaces\n\nAbsorption, with one standard error; ? where these data do not determine it.\n\n";
    head.to_owned() + &markdown_table(&rows) + &fit.voxels.as_ref().map_or_else(String::new, |own| patches(own, hz))
}

/// Patches of surfaces: how many sound has met, how many were guessed, and how far guesses are off.
fn patches(own: &VoxelFit, hz: Vec<String>) -> String {
    let count = own.voxels.patches.len();
    let touched = (0..count).filter(|p| own.is_touched(*p)).count();
    let guessed = own.guessed.iter().filter(|g| **g).count();
    let text = format!(
        "\n## Patches\n\nSurfaces are in {count} patches of voxels of {} m, of which those above are the means. Sound that was \
         measured tells of {touched} of them.",
        own.voxels.edge_m
    );
    let Some(off) = &own.off else {
        let rest = if own.shown > 0 {
            "Pictures show too few of these to learn from"
        } else {
            "The others are as their surface is in the mean"
        };
        return format!("{text} {rest}.\n");
    };
    format!(
        "{text} Pictures show {}; {guessed} that sound does not tell of were guessed from those that look alike. Where sound \
         tells, such guesses are off by:\n\n{}",
        own.shown,
        markdown_table(&[hz, row("absorption", off.iter().map(|o| format!("{o:.2}")))])
    )
}

fn residual(fit: &FullFit, set: &Measurements) -> String {
    let octaves = 0..octaves_at(f64::from(set.sample_rate_hz));
    let line = |name: &str, of: &dyn Fn(usize) -> String| row(name, octaves.clone().map(of));
    let signed_db = |energy: f64| format!("{:+.1}", db(energy));
    let over = |energies: &[f64], o: usize| signed_db(energies.get(o).copied().unwrap_or(1.0));
    let table = markdown_table(&[
        line("octave, Hz", &|o| format!("{}", FITTED_HZ[o])),
        line("T20, s", &|o| format!("{:.3}", fit.t20_s(o))),
        line("direct sound, dB", &|o| over(&fit.residual.direct, o)),
        line("reflections, dB", &|o| over(&fit.residual.images, o)),
        line("diffuse sound at 50 ms, dB", &|o| signed_db(fit.residual.at(o, 12))),
        line("at 200 ms, dB", &|o| signed_db(fit.residual.at(o, 50))),
    ]);
    let compared = if fit.waves { "responses agree with the room wave by wave" } else { "magnitudes were compared, not waves" };
    format!(
        "\n## What surfaces do not explain\n\n{table}\nMean difference of log magnitudes that is left in the early part: {:.3} \
         nepers; {compared}.\n",
        fit.left
    )
}

fn walls(fit: &FullFit) -> String {
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
    "\n## Walls\n\nHow far each moved outwards, with one standard error, and by how many standard deviations its echoes \
     stand out of the scan.\n\n"
        .to_owned()
        + &markdown_table(&rows)
}

fn places(fit: &FullFit, set: &Measurements) -> String {
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
    "\n## Places\n\nHow far each moved, and one standard error of a coordinate.\n\n".to_owned() + &markdown_table(&rows)
}
