//! What follows the network: renders clips, judges them, and gives the derivatives back.

use crate::published::PublishedHead;
use crate::streaming::StreamingHead;
use crate::weights::Arrays;
use promenade_core::Pose;
use rayon::prelude::*;
use std::collections::BTreeMap;

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
}

/// What the network says of one clip's listener, or derivatives by it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Answer {
    /// Mixture mask, one value per query.
    pub(crate) mixture: Vec<f32>,
    /// Difference mask, one value per query.
    pub(crate) difference: Vec<f32>,
    /// The room: coefficients of the tap shapes, `[query][ear][shape]`, or the time filter's output, `[frame][bin]`; empty without one.
    pub(crate) room: Vec<f32>,
}

/// Loss and derivatives of a batch.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Judged {
    /// Mean loss of the clips.
    pub(crate) loss: f64,
    /// By each clip's answer.
    pub(crate) answers: Vec<Answer>,
    /// By the head's own weights, by name.
    pub(crate) weights: BTreeMap<String, Vec<f32>>,
}

/// The render head that is trained.
pub(crate) enum Head {
    /// The engine's, hop by hop.
    Streaming(Box<StreamingHead>),
    /// AV-Cloud's, clip by clip.
    Published(PublishedHead),
}

impl Head {
    /// Both ears' sound of clips, in order.
    pub(crate) fn render(&mut self, examples: &[Example<'_>], answers: &[Answer], weights: &Arrays) -> Vec<[Vec<f32>; 2]> {
        match self {
            Self::Streaming(head) => head.render(examples, answers, weights),
            Self::Published(head) => head.render(examples, answers, weights),
        }
    }

    /// Renders clips, and gives the derivatives of their mean loss.
    pub(crate) fn judge(&mut self, examples: &[Example<'_>], answers: &[Answer], weights: &Arrays) -> Judged {
        match self {
            Self::Streaming(head) => head.judge(examples, answers, weights),
            Self::Published(head) => head.judge(examples, answers, weights),
        }
    }
}

/// Does something for every clip, on as many threads as there are benches; the results are in the clips' order.
pub(crate) fn spread<B: Send, T: Send>(
    benches: &mut [B],
    examples: &[Example<'_>],
    answers: &[Answer],
    work: impl Fn(&mut B, &Example<'_>, &Answer) -> T + Sync,
) -> Vec<T> {
    let count = benches.len();
    let lanes: Vec<Vec<T>> = benches
        .par_iter_mut()
        .enumerate()
        .map(|(lane, bench)| {
            let mine = examples.iter().zip(answers).skip(lane).step_by(count);
            mine.map(|(e, a)| work(bench, e, a)).collect()
        })
        .collect();
    let mut lanes: Vec<_> = lanes.into_iter().map(Vec::into_iter).collect();
    (0..examples.len()).filter_map(|i| lanes[i % count].next()).collect()
}
