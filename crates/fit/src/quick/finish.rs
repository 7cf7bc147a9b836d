//! The quick fit as a whole: surfaces, and what they do not explain.

use super::{QuickFit, of_surfaces};
use crate::error::FitError;
use crate::foretell::Foretold;
use crate::measurements::Measurements;
use crate::walls::Walls;

/// Fits a box to measurements. The same input makes the same fit.
///
/// # Errors
/// A box that is none, or a source or a microphone outside of it.
pub fn quick_fit(walls: &Walls, set: &Measurements, seed: u64) -> Result<QuickFit, FitError> {
    let mut fit = of_surfaces(walls, set, seed)?;
    if let Some(bare) = Foretold::new(&fit, set) {
        fit.residual = bare.unexplained(set);
    }
    Ok(fit)
}
