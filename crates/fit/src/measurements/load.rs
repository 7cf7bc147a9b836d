//! Reads a set of whichever layout it is.

use super::set::{LoadOptions, Measurements};
use super::{folder, r3vival, sofa};
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
        } else {
            let expected = "a .sofa file, or a folder with measurements.json or laid out as R3VIVAL is";
            return Err(FitError::content(path, expected, "neither"));
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
