//! Surfaces in patches.

use crate::args::{FitArgs, Per};
use crate::report;
use anyhow::{Context, Result, bail};
use promenade_fit::{FitError, FlatRoom, FullFit, Measurements};

/// Edge of voxels unless told, metres.
const EDGE_M: f64 = 0.25;

/// What patches are made.
pub(super) struct Patches {
    edge_m: f64,
}

impl Patches {
    /// None where whole surfaces are asked for.
    pub(super) fn of(args: &FitArgs) -> Result<Option<Self>> {
        match (args.per, args.voxel) {
            (Per::Voxels, edge_m) => Ok(Some(Self { edge_m: edge_m.unwrap_or(EDGE_M) })),
            (_, None) => Ok(None),
            _ => bail!("--voxel: expected --per voxels with it"),
        }
    }

    /// Refuses what would fail after minutes.
    pub(super) fn check(&self, room: &FlatRoom) -> Result<()> {
        room.patches(self.edge_m).context("--voxel")?;
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
        whole.in_voxels(set, self.edge_m, seed, each)
    }
}

/// What is said of patches once they are fitted.
pub(super) fn say(fit: &FullFit) {
    let Some(own) = &fit.voxels else { return };
    let count = own.absorption.len();
    let touched = (0..count).filter(|p| own.is_touched(*p)).count();
    report::line(format_args!("sound tells of {touched} of {count} patches"));
}
