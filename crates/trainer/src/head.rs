//! What follows the network: renders clips, compares them with what was recorded, and gives the derivatives back.

pub(crate) mod streaming;

use crate::responses::ClipResponse;
use crate::simulated::Simulated;
use promenade_core::Pose;
use promenade_core::network::CloudEmitter;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A clip in training.
#[derive(Clone, Debug, PartialEq)]
pub struct Example<'a> {
    /// What is heard in it: one dry sound, or those of a mix.
    pub voices: Vec<ExampleVoice>,
    /// Samples before the clip.
    pub pre_roll: usize,
    /// What the ears heard.
    pub binaural: [&'a [f32]; 2],
    /// The listener.
    pub pose: Pose,
    /// What the clip tells of the room by itself; nothing where its direct sound does not stand out.
    pub(crate) response: Option<Arc<ClipResponse>>,
}

/// One dry sound of a clip.
#[derive(Clone, Debug, PartialEq)]
pub struct ExampleVoice {
    /// `pre_roll` samples before the clip and the clip.
    pub dry: Vec<f32>,
    /// Its emitter, where it is known and used.
    pub(crate) emitter: Option<CloudEmitter>,
    /// What a simulated room gives for its emitter and the listener, where training corrects a simulation.
    pub(crate) simulated: Option<Arc<Simulated>>,
}

/// What the network predicts for the listener and one voice of a clip, or derivatives by it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Prediction {
    /// Mixture mask, one value per query.
    pub(crate) mixture: Vec<f32>,
    /// Difference mask, one value per query.
    pub(crate) difference: Vec<f32>,
    /// The room: coefficients of the tap shapes, `[query][ear][shape]`; empty without one.
    pub(crate) room: Vec<f32>,
}

/// Loss and derivatives of a batch.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LossGradient {
    /// Mean loss of the clips.
    pub(crate) loss: f64,
    /// By each voice's prediction, clip by clip.
    pub(crate) predictions: Vec<Prediction>,
    /// By the head's own weights, by name.
    pub(crate) weights: BTreeMap<String, Vec<f32>>,
}

/// Does something for every clip and its voices' predictions, on as many threads as there are workers; the results are in the
/// clips' order.
pub(crate) fn for_each_clip<W: Send, T: Send>(
    workers: &mut [W],
    examples: &[Example<'_>],
    predictions: &[Prediction],
    work: impl Fn(&mut W, &Example<'_>, &[Prediction]) -> T + Sync,
) -> Vec<T> {
    let count = workers.len();
    let mut rest = predictions;
    let mut clips = Vec::with_capacity(examples.len());
    for example in examples {
        let (own, others) = rest.split_at(example.voices.len());
        rest = others;
        clips.push((example, own));
    }
    let lanes: Vec<Vec<T>> = workers
        .par_iter_mut()
        .enumerate()
        .map(|(lane, worker)| clips.iter().skip(lane).step_by(count).map(|(example, own)| work(worker, example, own)).collect())
        .collect();
    let mut lanes: Vec<_> = lanes.into_iter().map(Vec::into_iter).collect();
    (0..examples.len()).filter_map(|i| lanes[i % count].next()).collect()
}
