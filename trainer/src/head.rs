//! What follows the network: renders clips, compares them with what was recorded, and gives the derivatives back.

pub(crate) mod published;
pub(crate) mod streaming;

use crate::responses::ClipResponse;
use crate::weights::Arrays;
use promenade_core::Pose;
use published::PublishedHead;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;
use streaming::StreamingHead;

/// A clip in training.
#[derive(Clone, Debug, PartialEq)]
pub struct Example<'a> {
    /// Dry sound, `pre_roll` samples before the clip and the clip.
    pub dry: Vec<f32>,
    /// Samples before the clip.
    pub pre_roll: usize,
    /// What the ears heard.
    pub binaural: [&'a [f32]; 2],
    /// The listener.
    pub pose: Pose,
    /// What the clip tells of the room by itself; nothing where its direct sound does not stand out, and for AV-Cloud's heads.
    pub(crate) response: Option<Arc<ClipResponse>>,
}

/// What the network predicts for the listener of one clip, or derivatives by it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Prediction {
    /// Mixture mask, one value per query.
    pub(crate) mixture: Vec<f32>,
    /// Difference mask, one value per query.
    pub(crate) difference: Vec<f32>,
    /// The room: coefficients of the tap shapes, `[query][ear][shape]`, or the time filter's output, `[frame][bin]`; empty
    /// without one.
    pub(crate) room: Vec<f32>,
}

/// Loss and derivatives of a batch.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LossGradient {
    /// Mean loss of the clips.
    pub(crate) loss: f64,
    /// By each clip's prediction.
    pub(crate) predictions: Vec<Prediction>,
    /// By the head's own weights, by name.
    pub(crate) weights: BTreeMap<String, Vec<f32>>,
}

/// The render head that is trained.
pub(crate) enum RenderHead {
    /// The engine's, hop by hop.
    Streaming(Box<StreamingHead>),
    /// AV-Cloud's, clip by clip.
    Published(PublishedHead),
}

impl RenderHead {
    /// Both ears' sound of clips, in order.
    pub(crate) fn render(
        &mut self,
        examples: &[Example<'_>],
        predictions: &[Prediction],
        weights: &Arrays,
    ) -> Vec<[Vec<f32>; 2]> {
        match self {
            Self::Streaming(head) => head.render(examples, predictions, weights),
            Self::Published(head) => head.render(examples, predictions, weights),
        }
    }

    /// Renders clips, and gives the derivatives of their mean loss.
    pub(crate) fn loss(&mut self, examples: &[Example<'_>], predictions: &[Prediction], weights: &Arrays) -> LossGradient {
        match self {
            Self::Streaming(head) => head.loss(examples, predictions, weights),
            Self::Published(head) => head.loss(examples, predictions, weights),
        }
    }
}

/// Does something for every clip, on as many threads as there are workers; the results are in the clips' order.
pub(crate) fn for_each_clip<W: Send, T: Send>(
    workers: &mut [W],
    examples: &[Example<'_>],
    predictions: &[Prediction],
    work: impl Fn(&mut W, &Example<'_>, &Prediction) -> T + Sync,
) -> Vec<T> {
    let count = workers.len();
    let lanes: Vec<Vec<T>> = workers
        .par_iter_mut()
        .enumerate()
        .map(|(lane, worker)| {
            let mine = examples.iter().zip(predictions).skip(lane).step_by(count);
            mine.map(|(e, a)| work(worker, e, a)).collect()
        })
        .collect();
    let mut lanes: Vec<_> = lanes.into_iter().map(Vec::into_iter).collect();
    (0..examples.len()).filter_map(|i| lanes[i % count].next()).collect()
}
