//! The anchor cloud and its network: a listener goes in, masks come out.
//!
//! Chen and Shlizerman, "AV-Cloud: Spatial Audio Rendering Through Audio-Visual Cloud Splatting", NeurIPS 2024, in the form
//! that its published code trains.

pub(crate) mod emitter;
pub(crate) mod kernels;
pub(crate) mod linear;
pub(crate) mod masks;
pub(crate) mod model;
pub(crate) mod placement;
pub(crate) mod relative;
pub(crate) mod shapes;
pub(crate) mod transformer;

use linear::Linear;
use pulp::Arch;
use transformer::Transformer;

pub use emitter::{CloudEmitter, DELAY_SHAPES, HEAD_RADIUS_M, SPEED_OF_SOUND_M_S};
pub use masks::Masks;
pub use model::{CloudError, CloudKind, CloudModel, CloudParts, CloudSizes, HARMONIC, PoseConvention, Tensor};
pub use placement::{Listener, Placement};
pub use shapes::{CONV_LAYERS, MAX_HARMONICS};

/// The network of one model with all the memory it needs.
///
/// Made for one model by a live decoder or the player of clips; one thread at a time runs it, in the background or offline.
pub struct Network(Kind);

enum Kind {
    Transformer(Box<Transformer>),
    Linear(Box<Linear>),
}

impl Network {
    /// Folds the weights; not real-time safe. Uses the widest vector instructions of this machine.
    #[must_use]
    pub fn new(model: &CloudModel) -> Self {
        Self::with_arch(model, Arch::new())
    }

    /// A decoder that computes with the given instruction set.
    #[must_use]
    pub fn with_arch(model: &CloudModel, arch: Arch) -> Self {
        Self(match model.parts().kind {
            CloudKind::Full | CloudKind::Sh | CloudKind::Taps => Kind::Transformer(Box::new(Transformer::new(model, arch))),
            CloudKind::SimpleSh => Kind::Linear(Box::new(Linear::new(model, arch))),
        })
    }

    /// Masks of a listener, into [`Masks::new`] of the model's sizes.
    ///
    /// Decodes a listener to masks. One listener gives the same bits on one instruction set.
    ///
    /// # Real-time
    /// No allocation, lock or I/O; milliseconds, so on a worker thread.
    pub fn decode(&mut self, listener: &Listener, out: &mut Masks) {
        match &mut self.0 {
            Kind::Transformer(t) => t.decode(listener, out, None),
            Kind::Linear(l) => l.decode(listener, out),
        }
    }

    /// Decodes a listener to masks and to the attention that each anchor gets, `[anchor]`, which sums to 1.
    ///
    /// A transformer's is the mean of the last layer's weights over heads and bands, the linear decoder's the mean magnitude of
    /// its attention product over bands, which has either sign, divided by the sum over anchors.
    ///
    /// # Real-time
    /// No allocation, lock or I/O; milliseconds, so on a worker thread.
    pub fn decode_with_attention(&mut self, listener: &Listener, out: &mut Masks, attention: &mut [f32]) {
        match &mut self.0 {
            Kind::Transformer(t) => t.decode(listener, out, Some(attention)),
            Kind::Linear(l) => {
                l.decode(listener, out);
                l.attention(listener, attention);
            }
        }
    }
}
