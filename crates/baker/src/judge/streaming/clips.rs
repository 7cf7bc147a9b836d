//! The model's own clips, laid over a sound.

use crate::error::BakeError;
use cpu_time::ThreadTime;
use promenade_core::published::PublishedError;
use promenade_core::{AnchorCloud, Pose, StftGrid};
use promenade_player::{ClipPlayer, Ears};
use std::ops::Range;

/// Hops at either end of a clip that are not compared, at least.
const EDGE_HOPS: usize = 8;
/// Hops that the convolution layers reach to either side.
const CONV_HOPS: usize = 5;

/// Clips of one length, of which the inner parts are compared.
pub(super) struct Clips {
    player: ClipPlayer,
    grid: StftGrid,
    /// Samples of a clip's input.
    length: usize,
    /// Part of a clip's output that is compared.
    inner: Range<usize>,
    /// First samples of the clips.
    starts: Vec<usize>,
}

impl Clips {
    pub(super) fn new(cloud: &AnchorCloud, grid: StftGrid) -> Result<Self, String> {
        let player = ClipPlayer::new(&cloud.model, grid).map_err(|e| e.to_string())?;
        let lengths = player.clip_samples();
        // A second, as in training, or the nearest length that is taken.
        let length = (grid.sample_rate_hz.round() as usize).clamp(*lengths.start(), *lengths.end());
        // Reflected at its ends, a clip's first and last frames hold what no stream has; convolution carries it further.
        let edge = (EDGE_HOPS * grid.hop).max(grid.n_fft + CONV_HOPS * grid.hop);
        let (samples, least) = (player.out_samples(), 2 * edge + grid.n_fft);
        if samples < least {
            return Err(format!("clips have {samples} samples, expected {least} or more to leave out their edges"));
        }
        Ok(Self { player, grid, length, inner: edge..samples - edge, starts: Vec::new() })
    }

    /// Lays clips over a sound so that their frames are frames of a stream.
    pub(super) fn lay(&mut self, samples: usize) -> Result<(), BakeError> {
        let hop = self.grid.hop;
        let first = (hop - self.grid.n_fft / 2 % hop) % hop;
        let step = self.inner.len() / hop * hop;
        if samples < first + self.length {
            let expected = format!("at least {:.2} s, a clip of the model", self.seconds(first + self.length));
            return Err(BakeError::argument("input", expected, format!("{:.2} s", self.seconds(samples))));
        }
        self.starts = (first..=samples - self.length).step_by(step.max(1)).collect();
        Ok(())
    }

    pub(super) fn count(&self) -> usize {
        self.starts.len()
    }

    pub(super) fn length_s(&self) -> f64 {
        self.seconds(self.length)
    }

    pub(super) fn inner_s(&self) -> f64 {
        self.seconds(self.inner.len())
    }

    fn seconds(&self, samples: usize) -> f64 {
        samples as f64 / self.grid.sample_rate_hz
    }

    /// The inner parts of all clips at a pose, and the processor seconds per second of sound, without decoding.
    pub(super) fn render(&mut self, dry: &[f32], pose: &Pose) -> Result<(Vec<Ears>, f64), PublishedError> {
        self.player.listen(pose);
        let (mut inner, mut took_s) = (Vec::new(), 0.0);
        for start in &self.starts {
            let began = ThreadTime::now();
            let ears = self.player.render(&dry[*start..][..self.length])?;
            took_s += began.elapsed().as_secs_f64();
            inner.push(ears.map(|ear| ear[self.inner.clone()].to_vec()));
        }
        let sound = self.seconds(self.player.out_samples() * self.starts.len());
        Ok((inner, took_s / sound))
    }

    /// The inner parts of all clips in a rendering that is aligned with the input.
    pub(super) fn cut(&self, ears: &Ears) -> Vec<Ears> {
        let inner = |start: &usize| start + self.inner.start..start + self.inner.end;
        self.starts.iter().map(|start| [0, 1].map(|e| ears[e][inner(start)].to_vec())).collect()
    }
}
