//! Golden vectors of AV-Cloud: a slice in the repository, all of them where they are at hand.
//!
//! Weights follow from their names by a hash; inputs and thinned outputs are in `slice.safetensors`, cut by `make_slice.py`.
//! The whole set is in `../shared/golden` beside the checkout.

use crate::shared;
use promenade_core::Bands;
use promenade_core::glam::{Mat3, Vec3};
use promenade_core::network::{CloudKind, CloudModel, CloudParts, Listener, Placement, PoseConvention, Tensor};
use promenade_core::random::Random;
use safetensors::SafeTensors;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// One network with its inputs and what must come out.
#[derive(Debug)]
pub struct Golden {
    /// The network.
    pub model: CloudModel,
    /// Poses.
    pub listeners: Vec<Listener>,
    /// Both channels of the source.
    pub input: [Vec<f32>; 2],
    expected: BTreeMap<String, (usize, Vec<f32>)>,
}

impl Golden {
    /// Every n-th value of a flattened output, and n.
    ///
    /// # Panics
    /// There is no such output.
    #[must_use]
    pub fn expected(&self, name: &str) -> (usize, &[f32]) {
        let (every, values) = self.expected.get(name).unwrap_or_else(|| panic!("no golden '{name}'"));
        (*every, values)
    }

    /// Largest difference from a whole flattened output to the golden one, which starts at `from` of it.
    ///
    /// # Panics
    /// There is no such output, or nothing of it in this range.
    #[must_use]
    pub fn worst(&self, name: &str, from: usize, found: &[f32]) -> f32 {
        let (every, values) = self.expected(name);
        let inside = |i: &usize| (from..from + found.len()).contains(i);
        let pairs: Vec<_> = values.iter().enumerate().map(|(i, v)| (i * every, v)).filter(|(i, _)| inside(i)).collect();
        assert!(!pairs.is_empty(), "golden '{name}' has nothing from {from} on");
        pairs.iter().fold(0.0, |worst, (i, v)| worst.max((found[i - from] - *v).abs()))
    }
}

/// The case from the slice in the repository.
///
/// # Panics
/// It is damaged.
#[must_use]
pub fn slice(kind: CloudKind) -> Golden {
    let bytes = std::fs::read(here().join("slice.safetensors")).unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let about = about();
    let name = kind.name();
    let expected = about["every"].as_object().unwrap().iter().map(|(output, every)| {
        let every = usize::try_from(every.as_u64().unwrap()).unwrap();
        (output.clone(), (every, floats(&file, &format!("{name}/{output}"))))
    });
    golden(kind, &file, expected.collect())
}

/// The case from the whole set.
///
/// # Panics
/// It is not there.
#[must_use]
pub fn whole(kind: CloudKind) -> Golden {
    let path = shared(&format!("golden/{}.golden.safetensors", kind.name().replace('-', "_")));
    let bytes = std::fs::read(path).unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let expected = file.names().into_iter().map(|n| (n.to_owned(), (1, floats(&file, n)))).collect();
    golden(kind, &file, expected)
}

fn here() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("golden")
}

fn about() -> Value {
    serde_json::from_str(&std::fs::read_to_string(here().join("slice.json")).unwrap()).unwrap()
}

fn golden(kind: CloudKind, file: &SafeTensors<'_>, expected: BTreeMap<String, (usize, Vec<f32>)>) -> Golden {
    let listener = |p: &[f32]| Listener {
        centre: Vec3::from_slice(p),
        // Stored row by row.
        camera_to_world: Mat3::from_cols_slice(&p[3..12]).transpose(),
    };
    let input = floats(file, "input_wav");
    let (left, right) = input.split_at(input.len() / 2);
    let parts = CloudParts {
        kind,
        heads: 4,
        max_norm: 25.0,
        convention: PoseConvention::Published,
        placement: Placement::IDENTITY,
        frequencies: Bands::new((0..257).map(|k| k as f32 * 22_050.0 / 512.0).collect()).unwrap(),
        anchors: floats(file, "anchor_xyz").chunks_exact(3).map(Vec3::from_slice).collect(),
        features: floats(file, "rgb_features"),
        weights: weights(kind),
    };
    Golden {
        model: CloudModel::new(parts).unwrap(),
        listeners: floats(file, "poses").chunks_exact(12).map(listener).collect(),
        input: [left.to_vec(), right.to_vec()],
        expected,
    }
}

/// All weights of a network.
///
/// # Panics
/// The slice is damaged.
#[must_use]
pub fn weights(kind: CloudKind) -> BTreeMap<String, Tensor> {
    let bytes = std::fs::read(here().join("slice.safetensors")).unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let about = about();
    let keys = about["kinds"][kind.name()].as_array().unwrap();
    let tensor = |key: &str| match about["weights"].get(key) {
        None => {
            let values = floats(&file, key);
            Tensor { shape: vec![values.len()], values }
        }
        Some(entry) => {
            let shape: Vec<usize> = serde_json::from_value(entry["shape"].clone()).unwrap();
            let [scale, offset]: [f32; 2] = serde_json::from_value(entry["scale"].clone()).unwrap();
            let values = (0..shape.iter().product()).map(|j| offset + scale * signed_noise(key, j)).collect();
            Tensor { shape, values }
        }
    };
    keys.iter().map(|k| k.as_str().unwrap()).map(|k| (k.to_owned(), tensor(k))).collect()
}

/// A number in [-1, 1) from a name and an index: FNV-1a, then splitmix64.
fn signed_noise(key: &str, index: usize) -> f32 {
    let hash = key.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3));
    let mut random = Random::new(hash.wrapping_add((index as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)));
    2.0 * random.uniform() - 1.0
}

fn floats(file: &SafeTensors<'_>, name: &str) -> Vec<f32> {
    let view = file.tensor(name).unwrap_or_else(|e| panic!("golden '{name}': {e}"));
    view.data().as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
}
