//! Streams of an anchor cloud that are compared with its clips.

use crate::error::BakeError;
use cpu_time::ThreadTime;
use promenade_core::network::{Listener, Masks};
use promenade_core::published::{
    ConvMode, FrameMasks, Projection, PublishedError, PublishedOptions, PublishedStream, StreamTaps, TapProjector,
};
use promenade_core::{AnchorCloud, Pose, Scene, Tier};
use promenade_player::{Ears, Player, Playing};
use std::sync::Arc;

/// Look-aheads of single output frames that are tried, besides none and half a clip, seconds.
const LOOKAHEADS_S: [f64; 2] = [0.046, 0.132];

/// A pose and the masks that the model predicts there.
pub(super) struct PoseMasks {
    pub(super) pose: Pose,
    pub(super) listener: Listener,
    pub(super) masks: Masks,
}

/// One row of the comparison.
pub(super) struct Contender {
    pub(super) name: String,
    kind: Kind,
}

enum Kind {
    Dry,
    Tier(Player),
    Published(Box<Published>),
}

/// The published head, hop by hop.
struct Published {
    head: PublishedStream,
    hop: usize,
    taps: Option<(TapProjector, StreamTaps)>,
}

impl Contender {
    /// Both ears hear the dry sound.
    pub(super) fn dry() -> Self {
        Self { name: "source".to_owned(), kind: Kind::Dry }
    }

    /// A tier of the plugin.
    pub(super) fn tier(scene: &Arc<Scene>, tier: Tier) -> Result<Self, BakeError> {
        let player = Player::new(scene, scene.grid().sample_rate_hz, Some(Playing::Stream(tier)))?;
        Ok(Self { name: tier.name().to_owned(), kind: Kind::Tier(player) })
    }

    /// The published head without a time filter.
    pub(super) fn without_taps(scene: &Scene, cloud: &AnchorCloud, conv: ConvMode) -> Result<Self, PublishedError> {
        let name = if conv == ConvMode::Off { "masks only".to_owned() } else { format!("no taps, conv {}", conv.name()) };
        let options = PublishedOptions { conv, ..PublishedOptions::default() };
        let head = PublishedStream::new(&cloud.model, *scene.grid(), options)?;
        Ok(Self { name, kind: Kind::Published(Box::new(Published { head, hop: scene.grid().hop, taps: None })) })
    }

    /// The published head with its time filter as taps.
    pub(super) fn with_taps(
        scene: &Scene,
        cloud: &AnchorCloud,
        projection: Projection,
        conv: ConvMode,
    ) -> Result<Self, PublishedError> {
        let options = PublishedOptions::streaming(conv, projection, cloud.model.sizes().frames, scene.shape().taps);
        let head = PublishedStream::new(&cloud.model, *scene.grid(), options)?;
        let taps = TapProjector::new(&cloud.model, projection, options.causal_hops).map(|p| {
            let taps = p.taps();
            (p, taps)
        });
        let name = name_of(projection, conv);
        Ok(Self { name, kind: Kind::Published(Box::new(Published { head, hop: scene.grid().hop, taps })) })
    }

    /// Samples by which a host hears the stream late.
    pub(super) fn latency_samples(&self) -> usize {
        match &self.kind {
            Kind::Dry => 0,
            Kind::Tier(player) => player.latency_samples(),
            Kind::Published(published) => published.head.latency_samples(),
        }
    }

    /// Both ears, as long as the dry sound and aligned with it, and the processor seconds that rendering took, without
    /// decoding; `None` where nothing is rendered.
    pub(super) fn render(&mut self, dry: &[f32], at: &PoseMasks) -> Result<(Ears, Option<f64>), BakeError> {
        Ok(match &mut self.kind {
            Kind::Dry => ([dry.to_vec(), dry.to_vec()], None),
            Kind::Tier(player) => (player.render(dry, &mut |_| at.pose)?, Some(player.processor_s())),
            Kind::Published(published) => {
                let (ears, took_s) = published.render(dry, at);
                (ears, Some(took_s))
            }
        })
    }
}

impl Published {
    fn render(&mut self, dry: &[f32], at: &PoseMasks) -> (Ears, f64) {
        // A host collects a hop before it is rendered; here hops are whole, and the output lags by one less.
        let lag = self.head.latency_samples() - self.hop;
        let mut input = dry.to_vec();
        input.resize((dry.len() + lag).next_multiple_of(self.hop), 0.0);
        let mut ears = [vec![0.0; input.len()], vec![0.0; input.len()]];
        if let Some((projector, taps)) = &mut self.taps {
            projector.project(&at.listener, &at.masks, taps);
        }
        let taps = self.taps.as_ref().map(|(_, taps)| taps);
        let frame = FrameMasks { mixture: &at.masks.mixture, difference: &at.masks.difference, taps };
        self.head.reset();
        let [left, right] = &mut ears;
        let began = ThreadTime::now();
        let outputs = left.chunks_exact_mut(self.hop).zip(right.chunks_exact_mut(self.hop));
        for (input, (left, right)) in input.chunks_exact(self.hop).zip(outputs) {
            self.head.hop(input, frame, [left, right]);
        }
        let took_s = began.elapsed().as_secs_f64();
        (ears.map(|e| e[lag..][..dry.len()].to_vec()), took_s)
    }
}

/// What a stream with taps is called.
pub(super) fn name_of(projection: Projection, conv: ConvMode) -> String {
    let taps = match projection {
        Projection::Diagonal => "diagonal".to_owned(),
        Projection::Row(row) => format!("row {row}"),
    };
    format!("{taps}, conv {}", conv.name())
}

/// Single output frames of a clip that its time filter is projected from, by rising look-ahead.
pub(super) fn single_frames(frames: usize, hop_s: f64, own: Projection) -> Vec<Projection> {
    let last = frames.saturating_sub(1);
    let of_lookahead = |s: f64| last.saturating_sub((s / hop_s).round() as usize);
    let mut chosen: Vec<usize> = LOOKAHEADS_S.into_iter().map(of_lookahead).chain([last, frames / 2]).collect();
    if let Projection::Row(row) = own {
        chosen.push(row);
    }
    chosen.sort_unstable_by(|a, b| b.cmp(a));
    chosen.dedup();
    chosen.into_iter().map(Projection::Row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_frames_look_ahead_by_the_times_asked_for() {
        let hop_s = 127.0 / 22_050.0;
        assert_eq!(single_frames(174, hop_s, Projection::Diagonal), [173, 165, 150, 87].map(Projection::Row));
        assert_eq!(single_frames(174, hop_s, Projection::Row(100)), [173, 165, 150, 100, 87].map(Projection::Row));
        // Short clips have fewer.
        assert_eq!(single_frames(3, hop_s, Projection::Row(2)), [2, 1, 0].map(Projection::Row));
    }
}
