//! Anchor files: safetensors with the arrays that `promenade import` reads, and the placement beside them.

use super::AnchorSet;
use crate::sources::checkpoint;
use crate::{BakeError, atomic};
use promenade_core::glam::{Quat, Vec3};
use promenade_core::network::Placement;
use safetensors::tensor::{Dtype, TensorView};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// Key of the metadata, a single one so that equal sets are equal files.
const KEY: &str = "promenade_anchors";
/// Version of the file's form.
const VERSION: u32 = 1;

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Header {
    version: u32,
    /// Cloud units per metre.
    scale: f32,
    /// From the scene's axes to the cloud's: x, y, z, w.
    rotation: [f32; 4],
    /// The scene's origin, cloud units.
    translation: [f32; 3],
}

impl AnchorSet {
    /// Writes a file that [`AnchorSet::load`] and `promenade import --anchors` read: `anchors.position` `(N, 3)` and
    /// `anchors.features` `(N, 3 K)`, with the placement in the metadata.
    ///
    /// # Errors
    /// Anchors that make no set, or a file that cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), BakeError> {
        self.check().map_err(|(what, expected, found)| BakeError::argument(what, expected, found))?;
        let count = self.positions.len();
        let bytes = |values: &mut dyn Iterator<Item = f32>| values.flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
        let positions = bytes(&mut self.positions.iter().flat_map(|p| p.to_array()));
        let features = bytes(&mut self.features.iter().copied());
        let Placement { units_per_metre: scale, rotation, origin } = self.placement;
        let header = Header { version: VERSION, scale, rotation: rotation.to_array(), translation: origin.to_array() };
        let what = "anchors to write";
        let header = serde_json::to_string(&header).map_err(|e| BakeError::unreadable(path, what, e))?;
        let view = |shape: [usize; 2], data| {
            TensorView::new(Dtype::F32, shape.to_vec(), data).map_err(|e| BakeError::unreadable(path, what, e))
        };
        let arrays = [
            ("anchors.position", view([count, 3], &positions)?),
            ("anchors.features", view([count, 3 * self.neighbours], &features)?),
        ];
        let metadata = HashMap::from([(KEY.to_owned(), header)]);
        let file = safetensors::serialize(arrays, Some(metadata)).map_err(|e| BakeError::unreadable(path, what, e))?;
        atomic::write(path, &file)
    }

    /// The placement that an anchor file states, if it does.
    ///
    /// # Errors
    /// A file that is damaged, too large, of another kind or of a later version. The message names the file.
    pub fn stored_placement(path: &Path) -> Result<Option<Placement>, BakeError> {
        let (_, metadata) = checkpoint::read_anchors(path)?;
        placement(path, &metadata)
    }

    /// Reads anchors: what [`AnchorSet::save`] wrote, or a `.safetensors` file with `anchor_xyz` and `rgb_features`, which
    /// has no placement and gets [`Placement::IDENTITY`].
    ///
    /// # Errors
    /// A file that is damaged, too large, of another kind or of a later version. The message names the file.
    pub fn load(path: &Path) -> Result<Self, BakeError> {
        let (anchors, metadata) = checkpoint::read_anchors(path)?;
        let placement = placement(path, &metadata)?.unwrap_or(Placement::IDENTITY);
        let per_anchor = anchors.features.len().checked_div(anchors.positions.len()).unwrap_or(0);
        if per_anchor % 3 != 0 {
            return Err(BakeError::entry(path, "features", "three for each neighbour", per_anchor));
        }
        let set = Self { placement, positions: anchors.positions, features: anchors.features, neighbours: per_anchor / 3 };
        set.check().map_err(|(what, expected, found)| BakeError::entry(path, what, expected, found))?;
        Ok(set)
    }
}

/// The placement in a file's metadata, if there is one.
fn placement(path: &Path, metadata: &BTreeMap<String, String>) -> Result<Option<Placement>, BakeError> {
    let Some(header) = metadata.get(KEY) else { return Ok(None) };
    // A later version may have other fields, so its number comes first.
    let value: serde_json::Value = serde_json::from_str(header).map_err(BakeError::json(path))?;
    if let Some(version) = value.get("version").and_then(serde_json::Value::as_u64).filter(|v| *v != u64::from(VERSION)) {
        return Err(BakeError::entry(path, "version", VERSION.to_string(), version));
    }
    let header: Header = serde_json::from_value(value).map_err(BakeError::json(path))?;
    Ok(Some(Placement {
        units_per_metre: header.scale,
        rotation: Quat::from_array(header.rotation),
        origin: Vec3::from_array(header.translation),
    }))
}
