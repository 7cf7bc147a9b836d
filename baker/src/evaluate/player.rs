//! A scene played for clips, one at a time.

use crate::{BakeError, Capture, Clip, resample};
use promenade_core::{LiveParams, Pose, Quality, Renderer, Scene, Tier};
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

/// Renders clips through a scene.
pub struct Player {
    renderer: Renderer,
    tier: Tier,
    poses: Poses,
    /// The capture's rate, and the renderer's, samples per second.
    rate: f64,
    played_rate: f64,
    pre_roll: usize,
}

impl Player {
    /// Prepares a scene for clips of a sample rate; without a tier, for standard or the cheapest that the scene has.
    ///
    /// The tier Reference knows only the scene's own rate: sound of another rate is converted there and back.
    ///
    /// # Errors
    /// A tier that the scene has not, or a rate that cannot be rendered.
    pub fn new(scene: &Arc<Scene>, sample_rate_hz: f64, tier: Option<Tier>, poses: Poses) -> Result<Self, BakeError> {
        let tier = tier.unwrap_or_else(|| scene.played_tier(Tier::Standard));
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

    /// The tier that is played.
    #[must_use]
    pub fn tier(&self) -> Tier {
        self.tier
    }

    /// Both ears of a clip, each as long as it and aligned with it: the latency is taken out, and what was played before is heard.
    ///
    /// # Errors
    /// Rates between which nothing can be converted.
    ///
    /// # Panics
    /// When the clip is not one of the capture.
    pub fn render(&mut self, capture: &Capture, clip: &Clip) -> Result<[Vec<f32>; 2], BakeError> {
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
