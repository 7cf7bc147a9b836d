//! What is trained, and how.

use promenade_baker::BakeError;
use serde::{Deserialize, Serialize};

/// Sizes and parts of the network.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NetworkSettings {
    /// Width C of embeddings, a multiple of 8 times `heads`.
    pub width: usize,
    /// Attention heads.
    pub heads: usize,
    /// Decoder layers, at least 1.
    pub layers: usize,
    /// Width of the feed-forward layers, a multiple of 8.
    pub feed_forward: usize,
    /// Query frequencies F.
    pub bands: usize,
    /// Octaves of the relative vectors' encoding, from a period of 2 pi times the scene's radius down to the shortest.
    pub octaves: usize,
    /// The highest factor of that encoding; published: 1024, which makes masks change within millimetres.
    pub highest: f32,
    /// Explicit taps of the stream; 0 for no room.
    pub taps: usize,
    /// Shapes that the taps are made of.
    pub tap_shapes: usize,
    /// Whether the emitter, where it is known, gives distance and interaural delay.
    pub emitter: bool,
    /// Whether the network is told what a simulated room gives for emitter and listener, and corrects that.
    pub simulated: bool,
}

impl Default for NetworkSettings {
    fn default() -> Self {
        Self {
            width: 64,
            heads: 4,
            layers: 2,
            feed_forward: 256,
            bands: 64,
            octaves: 4,
            highest: 4.0,
            taps: 32,
            tap_shapes: 2,
            emitter: true,
            simulated: false,
        }
    }
}

/// Weights of the terms of the loss.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LossSettings {
    /// Transform lengths; hops are a quarter.
    pub n_fft: Vec<usize>,
    /// Mean absolute difference of `ln(1 + magnitude)`.
    pub log: f32,
    /// Mean absolute difference of magnitudes.
    pub linear: f32,
    /// Absolute difference of the left to right energy ratios, dB.
    pub ratio: f32,
    /// Difference of the direct sound's energy, and of the room's that is still to come, from those of the clip's response, dB.
    pub level: f32,
    /// Difference of the interaural delay from that of the clip's direct sound, microseconds.
    pub delay: f32,
}

impl Default for LossSettings {
    fn default() -> Self {
        Self { n_fft: vec![256, 512, 1024], log: 1.0, linear: 1.0, ratio: 0.02, level: 0.05, delay: 0.002 }
    }
}

/// A whole training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TrainSettings {
    /// What is trained.
    pub network: NetworkSettings,
    /// Terms of the loss.
    pub loss: LossSettings,
    /// Steps in all.
    pub steps: usize,
    /// Clips of a step.
    pub batch: usize,
    /// Highest learning rate; it rises over the first steps and falls to a fiftieth along a cosine.
    pub rate: f32,
    /// Weight decay of AdamW.
    pub decay: f32,
    /// Largest norm of a step's gradient.
    pub clip_norm: f32,
    /// Seconds along the path by which clips, pose and sound, are shifted at random (pi-AVAS, section 3.3); 0 for none.
    pub shift_s: f32,
    /// Seed of weights, order and carriers.
    pub seed: u64,
    /// Steps between evaluations of the test clips.
    pub look_every: usize,
}

impl Default for TrainSettings {
    fn default() -> Self {
        Self {
            network: NetworkSettings::default(),
            loss: LossSettings::default(),
            steps: 1500,
            batch: 6,
            rate: 2e-3,
            decay: 1e-4,
            clip_norm: 1.0,
            shift_s: 0.0,
            seed: 1,
            look_every: 250,
        }
    }
}

/// Share of the steps over which the learning rate rises.
const WARM_UP: f32 = 0.05;
/// The learning rate at the end, as a share of the highest.
const LAST_RATE: f32 = 0.02;

impl TrainSettings {
    /// The learning rate of a step, counted from 0.
    pub(crate) fn rate_at(&self, step: usize) -> f32 {
        let along = (step as f32 + 1.0) / self.steps.max(1) as f32;
        let fall = 0.5 + 0.5 * (std::f32::consts::PI * along.min(1.0)).cos();
        self.rate * (along / WARM_UP).min(1.0) * (LAST_RATE + (1.0 - LAST_RATE) * fall)
    }

    /// What can be trained at all.
    ///
    /// # Errors
    /// Names the first value that is out of its range.
    pub fn check(&self) -> Result<(), BakeError> {
        let NetworkSettings { width, heads, layers, feed_forward, bands, octaves, taps, tap_shapes, highest, .. } =
            self.network;
        let within = |what: &'static str, found: usize, low: usize, high: usize| {
            let fits = (low..=high).contains(&found);
            let error = || BakeError::argument(what, format!("{low} to {high}"), found);
            if fits { Ok(()) } else { Err(error()) }
        };
        within("attention heads", heads, 1, 64)?;
        within("width", width, 8 * heads, 1024)?;
        if !width.is_multiple_of(8 * heads) || !feed_forward.is_multiple_of(8) {
            let expected = format!("a width divisible by {} and a feed-forward width by 8", 8 * heads);
            return Err(BakeError::argument("widths", expected, format!("{width} and {feed_forward}")));
        }
        within("feed-forward width", feed_forward, 8, 8192)?;
        within("decoder layers", layers, 1, 16)?;
        within("query frequencies", bands, 2, 4096)?;
        within("octaves of the encoding", octaves, 1, 32)?;
        within("taps", taps, 0, 1024)?;
        within("shapes of the taps", tap_shapes, 1, 16)?;
        within("clips of a step", self.batch, 1, 1024)?;
        within("steps", self.steps, 1, 10_000_000)?;
        within("steps between looks", self.look_every, 1, 10_000_000)?;
        within("resolutions of the loss", self.loss.n_fft.len(), 1, 16)?;
        for n in &self.loss.n_fft {
            within("transform length of the loss", *n, 16, 65_536)?;
            within("transform length of the loss, modulo 4", n % 4, 0, 0)?;
        }
        let positive = [
            ("highest factor of the encoding", highest, 1.0),
            ("learning rate", self.rate, 1e-9),
            ("largest gradient norm", self.clip_norm, 1e-9),
        ];
        for (what, found, low) in positive {
            if !(found.is_finite() && found >= low) {
                return Err(BakeError::argument(what, format!("at least {low}"), found));
            }
        }
        Ok(())
    }
}
