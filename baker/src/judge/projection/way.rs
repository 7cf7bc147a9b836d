//! Ways to render a stream.

use super::distance::Ears;
use cpu_time::ThreadTime;
use promenade_core::network::{Listener, Masks};
use promenade_core::published::{
    ConvMode, FrameMasks, Projection, PublishedError, PublishedOptions, PublishedStream, StreamTaps, TapProjector,
};
use promenade_core::{AnchorCloud, Pose, RenderError, Renderer, Scene, Tier};
use std::sync::Arc;

/// Look-aheads of single rows that are tried, besides none and half a clip, seconds.
const LOOKAHEADS_S: [f64; 2] = [0.046, 0.132];

/// Where the listener is, and what the model says there.
pub(super) struct Spot {
    pub(super) pose: Pose,
    pub(super) listener: Listener,
    pub(super) masks: Masks,
}

/// One row of the comparison.
pub(super) struct Way {
    pub(super) name: String,
    played: Played,
}

enum Played {
    Source,
    Tier(Tier, Box<Renderer>),
    Stream(Box<Stream>),
}

struct Stream {
    head: PublishedStream,
    hop: usize,
    taps: Option<(TapProjector, StreamTaps)>,
}

impl Way {
    /// Both ears hear the source.
    pub(super) fn source() -> Self {
        Self { name: "source".to_owned(), played: Played::Source }
    }

    /// A tier of the streaming head.
    pub(super) fn tier(scene: &Arc<Scene>, tier: Tier) -> Result<Self, RenderError> {
        let renderer = Renderer::for_tier(scene, scene.grid().sample_rate_hz, tier)?;
        Ok(Self { name: tier.name().to_owned(), played: Played::Tier(tier, Box::new(renderer)) })
    }

    /// The published head without a time filter.
    pub(super) fn without_taps(scene: &Scene, cloud: &AnchorCloud, conv: ConvMode) -> Result<Self, PublishedError> {
        let name = if conv == ConvMode::Off { "masks only".to_owned() } else { format!("no taps, conv {}", conv.name()) };
        let options = PublishedOptions { conv, ..PublishedOptions::default() };
        let head = PublishedStream::new(&cloud.model, *scene.grid(), options)?;
        Ok(Self { name, played: Played::Stream(Box::new(Stream { head, hop: scene.grid().hop, taps: None })) })
    }

    /// The published head as a stream.
    pub(super) fn stream(
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
        let name = stream_name(projection, conv);
        Ok(Self { name, played: Played::Stream(Box::new(Stream { head, hop: scene.grid().hop, taps })) })
    }

    /// Samples by which the output lags the input.
    pub(super) fn latency_samples(&self) -> usize {
        match &self.played {
            Played::Source => 0,
            Played::Tier(_, renderer) => renderer.latency_samples(),
            Played::Stream(stream) => stream.head.latency_samples(),
        }
    }

    /// Both ears, as long as the input and aligned with it, and the processor seconds that they took; none where nothing is done.
    /// Decoding is not among them.
    pub(super) fn render(&mut self, mono: &[f32], spot: &Spot) -> (Ears, Option<f64>) {
        match &mut self.played {
            Played::Source => ([mono.to_vec(), mono.to_vec()], None),
            Played::Tier(tier, renderer) => {
                let latency = renderer.latency_samples();
                let mut input = mono.to_vec();
                input.resize(mono.len() + latency, 0.0);
                let mut ears = [vec![0.0; input.len()], vec![0.0; input.len()]];
                let [left, right] = &mut ears;
                renderer.reset();
                // The first sample finds the pose, which is decoded then.
                renderer.process(&input[..1], [&mut left[..1], &mut right[..1]], *tier, &mut |_| spot.pose);
                let began = ThreadTime::now();
                renderer.process(&input[1..], [&mut left[1..], &mut right[1..]], *tier, &mut |_| spot.pose);
                let took = began.elapsed().as_secs_f64();
                (ears.map(|e| e[latency..].to_vec()), Some(took))
            }
            Played::Stream(stream) => {
                let (ears, took) = stream.render(mono, spot);
                (ears, Some(took))
            }
        }
    }
}

impl Stream {
    fn render(&mut self, mono: &[f32], spot: &Spot) -> (Ears, f64) {
        // What a hop gives out lags one hop less than where it has to be collected first.
        let lag = self.head.latency_samples() - self.hop;
        let mut input = mono.to_vec();
        input.resize((mono.len() + lag).next_multiple_of(self.hop), 0.0);
        let mut ears = [vec![0.0; input.len()], vec![0.0; input.len()]];
        if let Some((projector, taps)) = &mut self.taps {
            projector.project(&spot.listener, &spot.masks, taps);
        }
        let taps = self.taps.as_ref().map(|(_, taps)| taps);
        let frame = FrameMasks { mixture: &spot.masks.mixture, difference: &spot.masks.difference, taps };
        self.head.reset();
        let [left, right] = &mut ears;
        let began = ThreadTime::now();
        let outputs = left.chunks_exact_mut(self.hop).zip(right.chunks_exact_mut(self.hop));
        for (input, (left, right)) in input.chunks_exact(self.hop).zip(outputs) {
            self.head.hop(input, frame, [left, right]);
        }
        let took = began.elapsed().as_secs_f64();
        (ears.map(|e| e[lag..][..mono.len()].to_vec()), took)
    }
}

/// What a stream is called.
pub(super) fn stream_name(projection: Projection, conv: ConvMode) -> String {
    let taps = match projection {
        Projection::Diagonal => "diagonal".to_owned(),
        Projection::Row(row) => format!("row {row}"),
    };
    format!("{taps}, conv {}", conv.name())
}

/// Rows of a clip's time filter that are tried, by rising look-ahead.
pub(super) fn rows(frames: usize, hop_s: f64, own: Projection) -> Vec<Projection> {
    let last = frames.saturating_sub(1);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of hops")]
    let of_lookahead = |s: f64| last.saturating_sub((s / hop_s).round() as usize);
    let mut rows: Vec<usize> = LOOKAHEADS_S.into_iter().map(of_lookahead).chain([last, frames / 2]).collect();
    if let Projection::Row(row) = own {
        rows.push(row);
    }
    rows.sort_unstable_by(|a, b| b.cmp(a));
    rows.dedup();
    rows.into_iter().map(Projection::Row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_look_ahead_by_the_times_asked_for() {
        let hop_s = 127.0 / 22_050.0;
        assert_eq!(rows(174, hop_s, Projection::Diagonal), [173, 165, 150, 87].map(Projection::Row));
        assert_eq!(rows(174, hop_s, Projection::Row(100)), [173, 165, 150, 100, 87].map(Projection::Row));
        // Short clips have fewer.
        assert_eq!(rows(3, hop_s, Projection::Row(2)), [2, 1, 0].map(Projection::Row));
    }
}
