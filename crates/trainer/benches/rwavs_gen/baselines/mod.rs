//! Networks of others that predict how loud the dry sound is at each ear, by frequency: NAF, INRAS and AV-NeRF's audio network.
//!
//! All three are trained alike, by the loss of AV-NeRF (Liang et al. 2023, section 4.4), on what they are trained on there:
//! magnitudes of recordings, of which the dry sound is known. NAF and INRAS were published for responses; here they predict a
//! gain for each frequency instead of a response's samples, because recordings are what there is.

mod av_nerf;
mod inras;
pub(crate) mod layers;
mod naf;
pub(crate) mod spectrogram;
mod training;

pub(crate) use av_nerf::AvNerf;
pub(crate) use inras::Inras;
pub(crate) use naf::Naf;
pub(crate) use training::{Course, Learner};

use burn::tensor::Tensor;
use layers::Graph;
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use promenade_trainer::Arrays;

/// Who hears what.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Heard {
    pub(crate) listener: Pose,
    /// World metres.
    pub(crate) emitter: Vec3,
}

/// Where sound is heard: corners of the box around it, metres.
pub(crate) type Bounds = [Vec3; 2];

/// A network of somebody else.
pub(crate) trait Baseline {
    /// Name in tables.
    fn name(&self) -> &'static str;
    /// Starting weights.
    fn start(&self, seed: u64) -> Arrays;
    /// Gains of the dry sound's magnitudes at the left and the right ear, `[listener][bin]` each.
    fn gains(&self, graph: &Graph, heard: &[Heard]) -> [Tensor<2>; 2];
}

/// Horizontal place in the bounds, each side from -1 to 1.
fn placed(at: Vec3, [low, high]: Bounds) -> [f32; 2] {
    let middle = 0.5 * (low + high);
    let half = (0.5 * (high - low)).max(Vec3::splat(1e-3));
    let within = (at - middle) / half;
    [within.x, within.y]
}

/// Where somebody looks, radians anticlockwise from x.
fn yaw(listener: &Pose) -> f32 {
    let ahead = listener.orientation * Vec3::X;
    ahead.y.atan2(ahead.x)
}
