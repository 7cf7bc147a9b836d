//! The learned weights of an anchor cloud, checked to fit together.

mod check;

use crate::network::{Listener, Placement};
use crate::{Bands, Pose};
use glam::Vec3;
use std::collections::BTreeMap;
use thiserror::Error;

/// Value of the zeroth spherical harmonic: features of anchors and colours of splats are `(colour - 0.5) / HARMONIC`.
pub const HARMONIC: f32 = 0.282_094_8;
/// The most anchors of a cloud.
pub(crate) const MAX_ANCHORS: usize = 65_536;

/// Which network: the paper's three, and the one that is trained for streams.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CloudKind {
    /// Transformer; time filters from a hyper-network.
    Full,
    /// Transformer; time filters from spherical harmonics.
    Sh,
    /// One linear attention product; time filters from spherical harmonics.
    SimpleSh,
    /// Transformer; taps of the stream per band from the embedding, see [`crate::decode::Readout`].
    Taps,
}

impl CloudKind {
    /// The paper's.
    pub const PUBLISHED: [Self; 3] = [Self::Full, Self::Sh, Self::SimpleSh];

    /// The published code's name, where it has one.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Sh => "sh",
            Self::SimpleSh => "simple-sh",
            Self::Taps => "taps",
        }
    }

    /// The kind of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::PUBLISHED.into_iter().chain([Self::Taps]).find(|k| k.name() == name)
    }
}

/// How the listener's rotation turns the vector from the listener to an anchor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseConvention {
    /// `R_c2w (p - c)`: what the published code computes.
    Published,
    /// `R_c2w^T (p - c)`: the vector in the listener's own frame.
    Physical,
}

impl PoseConvention {
    /// The name used in files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Published => "published",
            Self::Physical => "physical",
        }
    }

    /// The convention of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Published, Self::Physical].into_iter().find(|c| c.name() == name)
    }
}

/// A named array of weights.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    /// Sizes, slowest first.
    pub shape: Vec<usize>,
    /// Values, last index fastest.
    pub values: Vec<f32>,
}

/// All parts of a [`CloudModel`].
#[derive(Clone, Debug, PartialEq)]
pub struct CloudParts {
    /// Which network.
    pub kind: CloudKind,
    /// Attention heads of the transformer.
    pub heads: usize,
    /// Distance that relative vectors are divided by, cloud units.
    pub max_norm: f32,
    /// How the rotation is applied.
    pub convention: PoseConvention,
    /// Where the cloud lies in the scene.
    pub placement: Placement,
    /// Frequencies that the masks are stated at, one per query, Hz.
    pub frequencies: Bands,
    /// Anchor positions, cloud units.
    pub anchors: Vec<Vec3>,
    /// Visual features, `[anchor][feature]`: zeroth-order harmonics of the colours of the nearest points, red, green and blue,
    /// nearest point first.
    pub features: Vec<f32>,
    /// Weights by the published code's names, with `tap_prj` and `tap_shapes` for [`CloudKind::Taps`]. A constant hyper-network
    /// is stored as `post_process.kernel`, `[3 T][T]`.
    pub weights: BTreeMap<String, Tensor>,
}

/// Sizes that follow from the weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CloudSizes {
    /// Anchors N.
    pub anchors: usize,
    /// Features of an anchor.
    pub features: usize,
    /// Width C of embeddings.
    pub width: usize,
    /// Queries F: frequencies at which masks are stated.
    pub bands: usize,
    /// Frames T of the clips that the time filters were trained on; 0 without time filters.
    pub frames: usize,
    /// Spherical harmonics of the directions to anchors that time filters are made of, 1, 4, 9 or 16; 0 where there are none.
    pub harmonics: usize,
    /// Octaves of the positional encoding of relative vectors.
    pub octaves: usize,
    /// Transformer layers; 0 for [`CloudKind::SimpleSh`].
    pub layers: usize,
    /// Width of the transformer's feed-forward layers.
    pub feed_forward: usize,
    /// Hidden width of the hyper-network that makes time-filter kernels; 0 where the kernel is constant or there is none.
    pub hyper: usize,
    /// Hidden width of the network that makes time-filter biases; 0 where there is none.
    pub hyper_bias: usize,
    /// Whether there are convolution layers.
    pub conv: bool,
    /// Shapes that the taps of [`CloudKind::Taps`] are made of; 0 where there are none.
    pub tap_shapes: usize,
    /// Hops of a shape, the last one being the late part's level.
    pub tap_hops: usize,
    /// Bands of a shape.
    pub tap_bands: usize,
}

/// Why weights make no model.
#[derive(Debug, Error, PartialEq)]
pub enum CloudError {
    /// Weights that the network needs are missing.
    #[error("the model '{kind}' needs {}, found none such", missing.join(", "))]
    Missing {
        /// The kind of network.
        kind: &'static str,
        /// Names of the weights.
        missing: Vec<String>,
    },
    /// Weights that the network does not have.
    #[error("the model '{kind}' has no place for {}", unknown.join(", "))]
    Unknown {
        /// The kind of network.
        kind: &'static str,
        /// Names of the weights.
        unknown: Vec<String>,
    },
    /// Weights of another shape.
    #[error("weights '{name}': expected the shape {expected:?}, found {found:?}")]
    Shape {
        /// Their name.
        name: String,
        /// The shape that the other weights ask for.
        expected: Vec<usize>,
        /// Their shape.
        found: Vec<usize>,
    },
    /// A number is out of range or not finite.
    #[error("{what} of the anchor cloud: expected {expected}, found {found}")]
    Value {
        /// What the value is.
        what: String,
        /// Its range.
        expected: String,
        /// The value.
        found: String,
    },
}

/// AV-Cloud's weights for one scene with its anchors: immutable, finite, of shapes that fit.
///
/// Read from a scene file, imported from a checkpoint or made by the trainer; then shared by reference count between threads.
#[derive(Clone, Debug, PartialEq)]
pub struct CloudModel {
    parts: CloudParts,
    sizes: CloudSizes,
}

impl CloudModel {
    /// Checks names, shapes and values.
    ///
    /// # Errors
    /// Names all weights that are missing or unknown, or else the first shape or value that does not fit.
    pub fn new(parts: CloudParts) -> Result<Self, CloudError> {
        let sizes = check::check(&parts)?;
        Ok(Self { parts, sizes })
    }

    /// Sizes that follow from the weights.
    #[must_use]
    pub fn sizes(&self) -> CloudSizes {
        self.sizes
    }

    /// All parts.
    #[must_use]
    pub fn parts(&self) -> &CloudParts {
        &self.parts
    }

    /// Weights by the published name, last index fastest; empty where the model has none of that name.
    #[must_use]
    pub fn weights(&self, name: &str) -> &[f32] {
        self.parts.weights.get(name).map_or(&[], |t| &t.values)
    }

    /// A listener of the scene's world in the cloud's.
    #[must_use]
    pub fn listener(&self, pose: &Pose) -> Listener {
        self.parts.placement.listener(pose)
    }

    /// Bytes that the weights take in memory.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let weights: usize = self.parts.weights.values().map(|t| t.values.len()).sum();
        4 * (weights + self.parts.features.len() + 3 * self.parts.anchors.len())
    }
}
