//! A scene played for clips, one at a time.

use crate::{BakeError, Capture, Clip, resample};
use promenade_core::network::{Alignment, Masks, Network};
use promenade_core::published::ClipRenderer;
use promenade_core::{LiveParams, Pose, Quality, Renderer, Scene, StftGrid, Tier};
use std::sync::Arc;

/// Dry sound that is played before a clip, seconds, at least; as long as the scene's room sounds where that is more.
pub const PRE_ROLL_S: f64 = 1.0;
/// Dry sound before a clip is never more than this, seconds.
const LONGEST_PRE_ROLL_S: f64 = 10.0;

/// Where the listener is while a clip is rendered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Poses {
    /// Where the clip's middle was, for the whole clip and before it: as the published models take it.
    #[default]
    Fixed,
    /// On the track's path.
    Path,
}

/// How a scene is played.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Playing {
    /// As a stream.
    Stream(Tier),
    /// The published model clip by clip, as it is trained.
    Clip,
}

impl Playing {
    /// The name used on the command line and in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Stream(tier) => tier.name(),
            Self::Clip => "clip",
        }
    }
}

/// Renders clips through a scene.
pub enum Player {
    /// As the plugin would.
    Stream(Box<StreamPlayer>),
    /// As AV-Cloud's own model does.
    Clip(Box<ClipPlayer>),
}

impl Player {
    /// Prepares a scene for clips of a sample rate; unless it is said how, for standard or the cheapest tier that the scene has.
    ///
    /// The tier Reference knows only the scene's own rate: sound of another rate is converted there and back.
    ///
    /// # Errors
    /// A tier that the scene has not, a rate that cannot be rendered, or a scene without a published model for clips.
    pub fn new(scene: &Arc<Scene>, sample_rate_hz: f64, playing: Option<Playing>, poses: Poses) -> Result<Self, BakeError> {
        match playing.unwrap_or_else(|| Playing::Stream(scene.played_tier(Tier::Standard))) {
            Playing::Stream(tier) => Ok(Self::Stream(Box::new(StreamPlayer::new(scene, sample_rate_hz, tier, poses)?))),
            Playing::Clip => Ok(Self::Clip(Box::new(ClipPlayer::new(scene, sample_rate_hz)?))),
        }
    }

    /// How the scene is played.
    #[must_use]
    pub fn playing(&self) -> Playing {
        match self {
            Self::Stream(player) => Playing::Stream(player.tier),
            Self::Clip(_) => Playing::Clip,
        }
    }

    /// Both ears of a clip, aligned with it. A stream's are as long as the clip: its latency is taken out, and what was played before is
    /// heard. Those of the published model end with the clip's last whole hop.
    ///
    /// # Errors
    /// Rates between which nothing can be converted; a clip that is not as long as those the model was trained on.
    ///
    /// # Panics
    /// When the clip is not one of the capture.
    pub fn render(&mut self, capture: &Capture, clip: &Clip) -> Result<[Vec<f32>; 2], BakeError> {
        match self {
            Self::Stream(player) => player.render(capture, clip),
            Self::Clip(player) => player.render(capture, clip),
        }
    }
}

/// The published model clip by clip.
pub struct ClipPlayer {
    alignment: Alignment,
    renderer: ClipRenderer,
    decoder: Network,
    masks: Masks,
}

impl ClipPlayer {
    fn new(scene: &Arc<Scene>, sample_rate_hz: f64) -> Result<Self, BakeError> {
        let wrong = |what, expected: &str, found: String| BakeError::Argument { what, expected: expected.to_owned(), found };
        let StftGrid { sample_rate_hz: own, .. } = *scene.grid();
        if own != sample_rate_hz {
            return Err(wrong(
                "sample rate of the capture",
                "the scene's own to play clip by clip",
                format!("{sample_rate_hz} beside {own} Hz"),
            ));
        }
        let expected = "one with a published model to play clip by clip";
        let model = &scene.cloud().ok_or_else(|| wrong("scene", expected, "a field only".to_owned()))?.model;
        let renderer = ClipRenderer::new(model, *scene.grid()).map_err(|e| wrong("scene", expected, e.to_string()))?;
        let (decoder, masks) = (Network::new(model), Masks::new(&model.sizes()));
        Ok(Self { renderer, decoder, masks, alignment: model.parts().alignment })
    }

    fn render(&mut self, capture: &Capture, clip: &Clip) -> Result<[Vec<f32>; 2], BakeError> {
        let listener = self.alignment.listener(&clip.pose);
        self.decoder.decode(&listener, &mut self.masks);
        let silence = || vec![0.0; self.renderer.out_samples()];
        let mut ears = [silence(), silence()];
        let [left, right] = &mut ears;
        let done = self.renderer.render(&capture.dry(clip, 0), &self.masks, &listener, [left, right]);
        done.map_err(|e| BakeError::Argument {
            what: "clip to play",
            expected: "one of the model's length".to_owned(),
            found: format!("'{}': {e}", clip.name),
        })?;
        Ok(ears)
    }
}

/// A scene as the plugin plays it, one clip at a time.
pub struct StreamPlayer {
    renderer: Renderer,
    tier: Tier,
    poses: Poses,
    /// The capture's rate, and the renderer's, samples per second.
    rate: f64,
    played_rate: f64,
    pre_roll: usize,
}

impl StreamPlayer {
    fn new(scene: &Arc<Scene>, sample_rate_hz: f64, tier: Tier, poses: Poses) -> Result<Self, BakeError> {
        if !scene.has_tier(tier) {
            let has: Vec<_> = Tier::ALL.into_iter().filter(|t| scene.has_tier(*t)).map(Tier::name).collect();
            return Err(BakeError::Argument { what: "tier", expected: has.join(" or "), found: tier.name().to_owned() });
        }
        let played_rate = if tier == Tier::Reference { scene.grid().sample_rate_hz } else { sample_rate_hz };
        let renderer = Renderer::for_tier(scene, played_rate, tier).map_err(|e| BakeError::Argument {
            what: "sample rate of the capture",
            expected: "one that can be rendered".to_owned(),
            found: e.to_string(),
        })?;
        let tail = renderer.tail_samples() as f64 / played_rate;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "seconds in samples")]
        let pre_roll = (tail.clamp(PRE_ROLL_S, LONGEST_PRE_ROLL_S) * sample_rate_hz).ceil() as usize;
        Ok(Self { renderer, tier, poses, rate: sample_rate_hz, played_rate, pre_roll })
    }

    fn render(&mut self, capture: &Capture, clip: &Clip) -> Result<[Vec<f32>; 2], BakeError> {
        let mut input = capture.dry(clip, self.pre_roll);
        let converted = self.played_rate != self.rate;
        if converted {
            input = convert(&[input], self.rate, self.played_rate)?.remove(0);
        }
        let (latency, sounding) = (self.renderer.latency_samples(), input.len());
        input.resize(sounding + latency, 0.0);
        let mut ears = [vec![0.0; input.len()], vec![0.0; input.len()]];
        let path = &capture.tracks[clip.track].path;
        let began_s = (clip.start as f64 - self.pre_roll as f64) / self.rate;
        let mut pose_at = |sample: usize| -> Pose {
            match self.poses {
                Poses::Fixed => clip.pose,
                Poses::Path => path.pose_at(began_s + sample as f64 / self.played_rate),
            }
        };
        self.renderer.reset();
        let [left, right] = &mut ears;
        let quality = Quality { tier: self.tier, live: LiveParams { wait: true, ..LiveParams::default() } };
        self.renderer.process(&input, [left, right], quality, &mut pose_at);
        let mut ears = ears.map(|ear| ear[latency..].to_vec());
        if converted {
            let mut back = convert(&ears, self.played_rate, self.rate)?.into_iter();
            ears = [back.next().unwrap_or_default(), back.next().unwrap_or_default()];
        }
        Ok(ears.map(|mut ear| {
            ear.resize(self.pre_roll + clip.len, 0.0);
            ear.split_off(self.pre_roll)
        }))
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "rates are checked when scenes and captures are read"
)]
fn convert(channels: &[Vec<f32>], from: f64, to: f64) -> Result<Vec<Vec<f32>>, BakeError> {
    Ok(resample::signal(channels, from.round() as u32, to.round() as u32)?)
}
