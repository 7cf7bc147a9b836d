//! The quick fit: absorption of each wall by octave from T20, EDT, C80 and level, in just noticeable differences.
//!
//! One trace of rays serves all of it ([`Histories`]). By octave the unknowns are absorption of six walls, scattering, and how
//! much the source sends beside its axis; Gauss-Newton with derivatives by steps, damped (Levenberg 1944). Walls are held
//! together by a prior: a factor of 2 of one against their mean costs one difference.

mod fit;
mod image_gains;
mod octave_fitter;

pub use fit::{OctaveFit, QuickFit};

use crate::bands::{octave_decays, octaves_at};
use crate::error::FitError;
use crate::late::{BIN_S, Histories, ORDER};
use crate::measurements::Measurements;
use crate::prediction::{Prediction, Residual};
use crate::room::Walls;
use octave_fitter::{Images, Observed, OctaveFitter, late};
use rayon::prelude::*;

/// Fits a box to measurements. The same input makes the same fit.
///
/// # Errors
/// A box that is none, or a source or a microphone outside of it.
pub fn quick_fit(walls: &Walls, set: &Measurements, seed: u64) -> Result<QuickFit, FitError> {
    walls.check()?;
    set.check_within([walls.low_m, walls.high_m])?;
    let rate = f64::from(set.sample_rate_hz);
    let Some(first) = set.all.first() else {
        return Err(FitError::argument("measurements", "at least one", "none"));
    };
    let length_s = set.all.iter().map(|m| m.samples.len()).max().unwrap_or(0) as f64 / rate;
    let histories = Histories::of_box(walls, set.air, first.source.at_m, BIN_S, length_s.clamp(0.2, 4.0), seed);
    let facing = set.all.iter().all(|m| m.source.facing.is_some());
    let reach = length_s * set.air.speed_m_s();
    let images: Vec<Images> = set
        .all
        .par_iter()
        .map(|m| Images {
            paths: walls.paths(m.source.at_m, m.microphone.at_m, ORDER, reach),
            facing: m.source.facing.filter(|_| facing),
        })
        .collect();
    // By place, then by octave.
    let observed: Vec<Vec<Observed>> = set
        .all
        .par_iter()
        .map(|m| {
            let of = |(bins, measured): (Vec<f64>, _)| Observed { measured, late: late(&bins) };
            octave_decays(&m.samples, rate, BIN_S).into_iter().map(of).collect()
        })
        .collect();
    let octaves = (0..octaves_at(rate))
        .into_par_iter()
        .map(|octave| {
            let observed: Vec<&Observed> = observed.iter().map(|h| &h[octave]).collect();
            OctaveFitter { histories: &histories, images: &images, observed, number: octave, facing }.fit()
        })
        .collect();
    let mut fit = QuickFit { walls: *walls, octaves, facing, histories, residual: Residual::default() };
    if let Some(bare) = Prediction::new(&fit, set).map(|bare| bare.residual_of(set)) {
        fit.residual = bare;
    }
    Ok(fit)
}
