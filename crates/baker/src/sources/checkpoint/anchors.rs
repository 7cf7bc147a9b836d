//! Anchors: where they are and what is seen there.

use super::weights::Stored;
use crate::BakeError;
use promenade_core::glam::Vec3;
use promenade_core::network::{HARMONIC, Tensor};
use std::collections::BTreeMap;
use std::path::Path;

/// Names of the positions in files.
const POSITIONS: [&str; 3] = ["anchors.position", "anchor_xyz", "xyz"];
/// Names of the features in files.
const FEATURES: [&str; 3] = ["anchors.features", "rgb_features", "features"];
/// What an anchor file must be.
const EXPECTED: &str = "anchors as .safetensors with 'anchor_xyz' and 'rgb_features'";
/// The zeroth-order harmonic of a colour c in 0 to 1 is (c - 0.5) / 0.2821, so no larger than this.
const LARGEST_HARMONIC: f32 = 0.5 / HARMONIC;

/// Anchors with their features, one row of features for each.
#[derive(Debug)]
pub(crate) struct Anchors {
    pub(crate) positions: Vec<Vec3>,
    /// `[anchor][feature]`.
    pub(crate) features: Vec<f32>,
}

impl Anchors {
    /// Reads a .safetensors file, with its metadata.
    pub(super) fn read(path: &Path) -> Result<(Self, BTreeMap<String, String>), BakeError> {
        let wanted = |name: &str| POSITIONS.contains(&name) || FEATURES.contains(&name);
        let Stored { weights: mut arrays, names, metadata, .. } = Stored::of(path, EXPECTED, wanted)?;
        let anchors = Self::take(path, &mut arrays)?.ok_or_else(|| {
            let found = if names.is_empty() { "no arrays".to_owned() } else { few(&names) };
            BakeError::content(path, EXPECTED, found)
        })?;
        Ok((anchors, metadata))
    }

    /// Takes the anchors from among other arrays; `None` where there are none.
    pub(super) fn take(path: &Path, arrays: &mut BTreeMap<String, Tensor>) -> Result<Option<Self>, BakeError> {
        let mut first = |names: [&'static str; 3]| names.into_iter().find_map(|n| arrays.remove(n).map(|t| (n, t)));
        let ((position, positions), (feature, features)) = match (first(POSITIONS), first(FEATURES)) {
            (None, None) => return Ok(None),
            (Some(p), Some(f)) => (p, f),
            (Some((name, _)), None) | (None, Some((name, _))) => {
                return Err(BakeError::content(path, EXPECTED, format!("'{name}' only")));
            }
        };
        let [count, 3] = positions.shape[..] else {
            let found = format!("the shape {:?}", positions.shape);
            return Err(BakeError::entry(path, format!("array '{position}'"), "the shape (anchors, 3)", found));
        };
        if !matches!(features.shape[..], [rows, _] if rows == count) {
            let expected =
                format!("the shape ({count}, features), of the trainer's (anchors, 16, features) the plane [:, 0, :]");
            let found = format!("the shape {:?}", features.shape);
            return Err(BakeError::entry(path, format!("array '{feature}'"), expected, found));
        }
        for (name, array) in [(position, &positions), (feature, &features)] {
            if let Some(at) = array.values.iter().position(|v| !v.is_finite()) {
                let found = format!("{} at {at}", array.values[at]);
                return Err(BakeError::entry(path, format!("array '{name}'"), "finite numbers", found));
            }
        }
        let positions = positions.values.as_chunks().0.iter().copied().map(Vec3::from_array).collect();
        Ok(Some(Self { positions, features: features.values }))
    }

    /// A word of warning where the features cannot be harmonics of colours.
    pub(super) fn doubt(&self) -> Option<String> {
        let outside = self.features.iter().filter(|v| v.abs() > 1.001 * LARGEST_HARMONIC).count();
        if outside > 0 {
            return Some(format!(
                "{outside} of {} features lie beyond +-{LARGEST_HARMONIC:.4}, where no harmonic of a colour can be",
                self.features.len()
            ));
        }
        // Of harmonics, about half are below 0.
        let colours = self.features.iter().all(|v| (0.0..=1.0).contains(v));
        colours.then(|| {
            "all features lie in 0 to 1: if they are colours, not harmonics, (colour - 0.5) / 0.2821 is meant".to_owned()
        })
    }
}

/// Names for an error message, the first of many.
fn few(names: &[String]) -> String {
    const SHOWN: usize = 8;
    let mut text: String = names.iter().take(SHOWN).map(|n| format!("'{n}'")).collect::<Vec<_>>().join(", ");
    if names.len() > SHOWN {
        text += &format!(" and {} more", names.len() - SHOWN);
    }
    text
}
