//! Surfaces in patches, and the pictures that tell of those that no sound has met.

use super::pictures;
use crate::args::{FitArgs, Per};
use crate::report;
use anyhow::{Context, Result, bail};
use promenade_fit::{BANDS, FitError, FlatRoom, FullFit, Measurements, Pictures, View, Voxels};

/// Edge of voxels unless told, metres.
const EDGE_M: f64 = 0.25;
/// A share of cameras within the room below which it is doubted that these are its pictures.
const INSIDE: f64 = 0.5;

/// What patches are made, and what pictures show of them.
pub(super) struct Patches {
    edge_m: f64,
    pictures: Option<Pictures>,
}

impl Patches {
    /// None where whole surfaces are asked for.
    pub(super) fn of(args: &FitArgs) -> Result<Option<Self>> {
        if args.per != Per::Voxels {
            let of_voxels = [("--voxel", args.voxel.is_some()), ("--pictures", args.appearance.pictures.is_some())];
            if let Some((name, _)) = of_voxels.into_iter().find(|(_, given)| *given) {
                bail!("{name}: expected --per voxels with it");
            }
            return Ok(None);
        }
        let pictures = args.appearance.pictures.as_ref().map(|folder| pictures::load(folder, &args.appearance)).transpose()?;
        Ok(Some(Self { edge_m: args.voxel.unwrap_or(EDGE_M), pictures }))
    }

    /// Refuses what would fail after minutes, and doubts pictures that were taken elsewhere.
    pub(super) fn check(&self, room: &FlatRoom) -> Result<()> {
        room.patches(self.edge_m).context("--voxel")?;
        let Some(pictures) = &self.pictures else { return Ok(()) };
        let [low, high] = room.mesh()?.bounds();
        let inside = |view: &&View| {
            let at = pictures.placement.to_scene(view.camera.centre().as_vec3()).as_dvec3().to_array();
            (0..3).all(|a| (low[a]..=high[a]).contains(&at[a]))
        };
        let (inside, all) = (pictures.views.iter().filter(inside).count(), pictures.views.len());
        if (inside as f64) < INSIDE * all as f64 {
            report::note(format_args!(
                "{inside} of {all} photographs were taken within the room: the reconstruction may lie elsewhere; --landmark \
                 says where places of it are"
            ));
        }
        Ok(())
    }

    /// A fit of whole surfaces, in patches.
    pub(super) fn fit(
        &self,
        whole: &FullFit,
        set: &Measurements,
        seed: u64,
        each: &mut dyn FnMut(f64),
    ) -> Result<FullFit, FitError> {
        let mut features = |room: &FlatRoom, voxels: &Voxels| match &self.pictures {
            Some(pictures) => pictures.features(room, voxels),
            None => Ok(vec![None; voxels.patches.len()]),
        };
        whole.in_voxels(set, self.edge_m, seed, &mut features, each)
    }
}

/// What is said of patches once they are fitted.
pub(super) fn say(fit: &FullFit) {
    let Some(own) = &fit.voxels else { return };
    let count = own.absorption.len();
    let touched = (0..count).filter(|p| own.is_touched(*p)).count();
    report::line(format_args!("sound tells of {touched} of {count} patches"));
    if own.shown > 0 {
        let guessed = own.guessed.iter().filter(|g| **g).count();
        match &own.off {
            Some(off) => {
                let mean = off.iter().sum::<f64>() / BANDS as f64;
                report::line(format_args!(
                    "pictures show {}: {guessed} were guessed by their appearance, off by {mean:.2} where sound tells",
                    own.shown
                ));
            }
            None => report::note("pictures show too few patches that sound tells of to learn from"),
        }
    }
}
