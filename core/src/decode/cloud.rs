//! From a pose in the scene's world to what the stream is filtered with.

use crate::decode::Readout;
use crate::decode::readout::LearnedTaps;
use crate::network::{CloudKind, Masks, Network};
use crate::published::{ConvMode, StreamTaps, TapProjector};
use crate::scene::AnchorCloud;
use crate::{DecodeWorker, Decoded, Pose, PublishedFrame, Scene};
use std::sync::Arc;

/// Decodes poses of one scene, for [`Decoded`].
///
/// Made where a scene with an anchor cloud is loaded; a background worker owns it, or the thread that renders offline.
///
/// Masks become the direct sound as they are, with negative ones silent. The time filter's taps act on magnitudes, those of the
/// stream on energies: each gain is chosen so that a steady sound that stops dies away as the magnitudes would (Schroeder 1965,
/// interrupted noise), `g_l^2 = T_l^2 - T_(l+1)^2` with `T_l` the sum of the taps from lag l on, times the band's mixture mask.
/// A model that was trained for streams says its taps itself.
pub struct CloudDecoder {
    scene: Arc<Scene>,
    decoder: Network,
    filter: Option<(TapProjector, StreamTaps)>,
    learned: Option<LearnedTaps>,
    masks: Masks,
    /// Where the cloud's frequencies lie among the scene's bins and bands.
    head: Readout,
}

impl CloudDecoder {
    /// `None` where the scene has no anchor cloud. Folds the weights; not real-time safe.
    #[must_use]
    pub fn new(scene: &Arc<Scene>) -> Option<Self> {
        let cloud = scene.cloud()?;
        let (taps, sizes) = (scene.shape().taps, cloud.model.sizes());
        let head = Readout::new(&cloud.model.parts().frequencies, scene.grid(), scene.bands(), taps, sizes.tap_shapes);
        let projector = TapProjector::new(&cloud.model, cloud.projection, taps + 1);
        Some(Self {
            decoder: Network::new(&cloud.model),
            filter: projector.map(|p| {
                let taps = p.taps();
                (p, taps)
            }),
            learned: (cloud.model.parts().kind == CloudKind::Taps).then(|| LearnedTaps::new(&cloud.model, &head)),
            masks: Masks::new(&sizes),
            head,
            scene: Arc::clone(scene),
        })
    }

    /// Room for an answer, which says that nothing is heard.
    #[must_use]
    pub fn blank(&self) -> Decoded {
        let bins = self.scene.shape().bins;
        let convolves = self.scene.cloud().is_some_and(|cloud| cloud.conv != ConvMode::Off);
        let published = convolves.then(|| PublishedFrame {
            mixture: vec![0.0; bins],
            difference: vec![0.0; bins],
            taps: self.filter.as_ref().map(|(projector, _)| projector.taps()),
        });
        Decoded { transfer: self.scene.shape().silent(), published }
    }

    /// Decodes a pose.
    ///
    /// # Real-time
    /// No allocation, lock or I/O; milliseconds, so on a worker thread.
    pub fn decode(&mut self, pose: &Pose, out: &mut Decoded) {
        self.decode_with(pose, None, out);
    }

    /// Decodes a pose, and the attention that each anchor gets: `[anchor]`, sums to 1.
    ///
    /// # Real-time
    /// No allocation, lock or I/O; milliseconds, so on a worker thread.
    pub fn decode_with_attention(&mut self, pose: &Pose, attention: &mut [f32], out: &mut Decoded) {
        self.decode_with(pose, Some(attention), out);
    }

    fn decode_with(&mut self, pose: &Pose, attention: Option<&mut [f32]>, out: &mut Decoded) {
        let Some(AnchorCloud { model, emitter, .. }) = self.scene.cloud() else { return };
        let listener = model.listener(pose);
        match attention {
            Some(attention) => self.decoder.decode_with_attention(&listener, &mut self.masks, attention),
            None => self.decoder.decode(&listener, &mut self.masks),
        }
        let gain = emitter.as_ref().map_or(1.0, |e| e.gain(pose));
        out.transfer.delay_s = emitter.as_ref().map_or(0.0, |e| e.delay_s(pose));
        let masks = &self.masks;
        if let Some(learned) = &mut self.learned {
            learned.transfer(&self.head, masks, gain, &mut out.transfer);
            return;
        }
        self.head.direct([&masks.mixture, &masks.difference], gain, &mut out.transfer);
        if let Some((projector, taps)) = &mut self.filter {
            projector.project(&listener, masks, taps);
            let bands = self.head.bands().len();
            for (band, share) in self.head.bands().iter().enumerate() {
                let mean = |of: &dyn Fn(usize) -> f32| share.iter().map(|(k, w)| w * of(*k)).sum::<f32>();
                let mixture = mean(&|k| masks.mixture[k].max(0.0).powi(2)).sqrt();
                let mut rest = 0.0_f32;
                for (tap, ears) in out.transfer.taps.chunks_exact_mut(2 * bands).enumerate().rev() {
                    let from_here = (rest + mean(&|k| taps.gain(tap + 1, k))).max(0.0);
                    let gain = mixture * (from_here * from_here - rest * rest).max(0.0).sqrt();
                    (ears[band], ears[bands + band]) = (gain, gain);
                    rest = from_here;
                }
            }
        }
        if let Some(frame) = &mut out.published {
            frame.mixture.copy_from_slice(&masks.mixture);
            frame.difference.copy_from_slice(&masks.difference);
            if let (Some(to), Some((_, taps))) = (&mut frame.taps, &self.filter) {
                to.blend(taps, taps, 0.0);
            }
        }
    }
}

/// Decodes on the thread that asks: offline, and where the time it takes does not matter.
///
/// Made by the player, the web engine and tests; it lives on the thread that renders.
pub struct InlineWorker {
    decoder: CloudDecoder,
    answer: Decoded,
    fresh: bool,
}

impl InlineWorker {
    /// `None` where the scene has no anchor cloud.
    #[must_use]
    pub fn new(scene: &Arc<Scene>) -> Option<Self> {
        let decoder = CloudDecoder::new(scene)?;
        Some(Self { answer: decoder.blank(), decoder, fresh: false })
    }

    /// So many, as a renderer's voices take them; none where the scene has no anchor cloud.
    #[must_use]
    pub fn several(scene: &Arc<Scene>, count: usize) -> Vec<Box<dyn DecodeWorker>> {
        (0..count).filter_map(|_| Some(Box::new(Self::new(scene)?) as Box<dyn DecodeWorker>)).collect()
    }
}

impl DecodeWorker for InlineWorker {
    fn blank(&self) -> Decoded {
        self.decoder.blank()
    }

    fn request(&mut self, pose: &Pose, _wait: bool) {
        self.decoder.decode(pose, &mut self.answer);
        self.fresh = true;
    }

    fn take(&mut self) -> Option<&Decoded> {
        std::mem::take(&mut self.fresh).then_some(&self.answer)
    }
}
