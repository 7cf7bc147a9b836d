//! What a quick fit says of itself.

use super::absorption::Curve;
use super::fitted_room::{FittedRoom, PictureNames};
use super::markdown::{NO_FACING, begin, cell, markdown_table, row};
use super::mesh::box_obj;
use crate::bands::{Estimate, FITTED_HZ};
use crate::error::FitError;
use crate::fits::{FullFit, OctaveFit, QuickFit};
use crate::late::Octave;
use crate::measurements::Measurements;
use crate::room::{Form, WALLS};
use promenade_acoustics::Octaves;
use std::collections::BTreeMap;

/// Octaves that could not be fitted, hertz.
fn missing_hz(fit: &QuickFit) -> Vec<f64> {
    fit.octaves.iter().zip(FITTED_HZ).filter(|(o, _)| !o.fitted).map(|(_, hz)| hz).collect()
}

impl FittedRoom for QuickFit {
    fn full(&self) -> Option<&FullFit> {
        None
    }

    fn form(&self) -> Form {
        Form::Box(self.walls)
    }

    fn surfaces(&self) -> Vec<String> {
        WALLS.map(str::to_owned).to_vec()
    }

    fn set_absorption(&mut self, surface: usize, absorption: &Octaves) {
        for (number, octave) in self.octaves.iter_mut().enumerate() {
            octave.absorption[surface] = Estimate::stated(absorption[number.saturating_sub(1)].into());
        }
    }

    fn curves(&self) -> Vec<Curve> {
        // From 125 Hz on, as materials have it.
        let points = |w: usize| self.octaves.iter().zip(FITTED_HZ).skip(1).map(|(o, hz)| (hz, o.absorption[w])).collect();
        WALLS.iter().enumerate().map(|(w, name)| Curve { name: (*name).to_owned(), points: points(w) }).collect()
    }

    fn doubts(&self) -> Vec<String> {
        let doubt = |hz| format!("the octave about {hz} Hz is not fitted: no response decays by 25 dB there");
        missing_hz(self).into_iter().map(doubt).collect()
    }

    fn obj(&self) -> Result<String, FitError> {
        Ok(box_obj(&self.walls))
    }

    fn materials(&self) -> BTreeMap<String, String> {
        let models = self.models();
        let last = models.len().saturating_sub(1);
        let shares = |of: &dyn Fn(&Octave) -> f64| {
            (0..8).map(|o| format!("{:.4}", of(&models[o.min(last)]))).collect::<Vec<String>>().join("/")
        };
        let surface = |(s, name): (usize, &&str)| {
            let (absorption, scattering) = (shares(&|o| o.surfaces[s].absorption), shares(&|o| o.surfaces[s].scattering));
            ((*name).to_owned(), format!("{absorption}:{scattering}"))
        };
        WALLS.iter().enumerate().map(surface).collect()
    }

    fn markdown(&self, set: &Measurements, pictures: &PictureNames<'_>) -> String {
        let [x, y, z] = self.walls.size_m();
        let how = " (quick fit). Lengths are as they were stated: geometry, positions and clocks were not fitted.";
        let shown = [("Absorption by wall", pictures.absorption), ("Decays by octave", pictures.decays)];
        let mut text = begin(set, &format!("A box of {x:.3} x {y:.3} x {z:.3} m"), how, &shown);
        let missing = missing_hz(self);
        if !missing.is_empty() {
            text += &format!("- **not fitted, since no response decays by 25 dB there: {missing:?} Hz**\n");
        }
        if !self.facing {
            text += NO_FACING;
        }
        text += "\nAbsorption, with one standard error; ? where these data do not determine it.\n\n";
        let line = |name: &str, of: &dyn Fn(&OctaveFit) -> String| row(name, self.octaves.iter().map(of));
        let octaves = 0..self.octaves.len();
        let mut rows = vec![row("Hz", FITTED_HZ[octaves.clone()].iter().map(f64::to_string))];
        rows.extend(WALLS.iter().enumerate().map(|(w, name)| line(name, &|o| cell(&o.absorption[w]))));
        rows.extend([
            line("scattering", &|o| cell(&o.scattering)),
            line("source sharpness", &|o| cell(&o.sharpness)),
            row("T20, s", octaves.map(|o| format!("{:.3}", self.t20_s(o)))),
            line("late residual, dB", &|o| format!("{:.1}", o.residual_db)),
            line("early residual, dB", &|o| format!("{:.1}", o.residual_early_db)),
            line("decay residual", &|o| format!("{:.3}", o.residual_decay)),
            line("left, JND", &|o| format!("{:.1}", o.left_jnd)),
        ]);
        text + &markdown_table(&rows)
    }

    fn json(&self, set: &Measurements) -> serde_json::Value {
        let octave = |(own, hz): (&OctaveFit, f64)| {
            let walls: serde_json::Map<String, serde_json::Value> =
                WALLS.iter().zip(&own.absorption).map(|(name, e)| ((*name).to_owned(), serde_json::json!(e))).collect();
            serde_json::json!({
                "hz": hz, "fitted": own.fitted, "absorption": walls, "scattering": own.scattering, "sharpness": own.sharpness,
                "level_db": own.level_db, "residual_late_db": own.residual_db, "residual_early_db": own.residual_early_db,
                "residual_decay": own.residual_decay, "left_jnd": own.left_jnd,
            })
        };
        serde_json::json!({
            "title": set.title, "responses": set.all.len(), "sample_rate_hz": set.sample_rate_hz, "notes": set.notes,
            "low_m": self.walls.low_m, "high_m": self.walls.high_m,
            "octaves": self.octaves.iter().zip(FITTED_HZ).map(octave).collect::<Vec<_>>(),
        })
    }
}
