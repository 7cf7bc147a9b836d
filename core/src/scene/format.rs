//! The `.promenade` file: safetensors with a JSON manifest in its metadata.

mod read;
mod write;

use safetensors::tensor::TensorView;

pub(super) use read::{manifest, read};
pub(super) use write::write;

/// Key of the manifest in the container's metadata.
pub(super) const MANIFEST: &str = "promenade";
const CHECKSUM: &str = "crc32";
/// Names of the two tables of transfer functions.
const FIELD: &str = "field";
const ROOM: &str = "room";
/// Name of the settings of a scene with their costs and errors, which readers of older versions leave.
const FRONT: &str = "front.points";
/// Numbers of a site of a response: direction, position, number of the response.
const SITE: usize = 7;
/// Prefix of the anchor cloud's weights, before the published names.
const WEIGHTS: &str = "cloud.weights.";

/// Checksum over the manifest and, by name, every tensor's name, shape and bytes.
fn checksum<'a, 'b: 'a>(manifest: &str, tensors: impl Iterator<Item = (&'a str, &'a TensorView<'b>)>) -> u32 {
    let mut tensors: Vec<_> = tensors.collect();
    tensors.sort_by_key(|(name, _)| *name);
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(manifest.as_bytes());
    for (name, view) in tensors {
        hasher.update(name.as_bytes());
        for size in view.shape() {
            hasher.update(&(*size as u64).to_le_bytes());
        }
        hasher.update(view.data());
    }
    hasher.finalize()
}
