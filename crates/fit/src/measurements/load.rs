//! Reads a set of whichever layout it is.

use super::set::{LoadOptions, Measurements};
use super::{folder, published, r3vival, sofa};
use crate::error::FitError;
use std::path::Path;

impl Measurements {
    /// Reads a set.
    ///
    /// # Errors
    /// A file or folder of no known layout, files that are missing or damaged, places that cannot be: [`Measurements::check`].
    pub fn load(path: &Path, options: &LoadOptions) -> Result<Self, FitError> {
        let has = |name: &str| path.join(name).exists();
        let mut set = if path.is_file() && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("sofa")) {
            sofa::load(path, options)?
        } else if has(folder::MANIFEST) {
            folder::load(path, options)?
        } else if has(r3vival::POSITIONS) {
            r3vival::load(path, options)?
        } else if has("pos_mic.npy") {
            published::mesh_rir(path, options)?
        } else if has("RIRs.npy") {
            published::hearing_anything_anywhere(path, options)?
        } else if published::is_raf(path) {
            published::raf(path, options)?
        } else {
            let layouts = "a .sofa file, or a folder with measurements.json or laid out as R3VIVAL, Real Acoustic Fields, \
                           Hearing Anything Anywhere or MeshRIR are";
            return Err(FitError::content(path, layouts, "neither"));
        };
        set.air = options.air;
        set.all.sort_by(|a, b| a.name.cmp(&b.name));
        if let Some(rate) = options.rate_hz {
            set.convert(rate)?;
        }
        set.check()?;
        Ok(set)
    }
}
