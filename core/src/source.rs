//! A sound on its way into a renderer, and the poses that it is heard at.

use crate::render::low::low_cut::LowCut;
use crate::stft::{Analysis, Spectrum};
use crate::{NEAREST_M, Pose, Ramp, Scene, StftGrid, Trim};
use std::collections::VecDeque;
use std::ops::Range;

/// Inputs below this magnitude (-240 dBFS) are silence.
const QUIET: f32 = 1e-12;
/// Inputs above this magnitude (+120 dBFS), and those that are no number, are dropped.
const ABSURD: f32 = 1e6;

/// The newest samples of a mono sound, and where the listener is as seen from its source.
pub(crate) struct Source {
    analysis: Analysis,
    low_cut: LowCut,
    /// Poses of the last hops, the oldest of which is rendered.
    poses: VecDeque<Pose>,
    /// The last valid pose that was jumped to.
    last: Pose,
    /// The pose of the frame before.
    before: Pose,
    /// The newest pose of the hop has been taken.
    has_noted: bool,
}

impl Source {
    /// For a grid whose frames are rendered with the pose of `late` hops ago.
    pub(crate) fn new(grid: StftGrid, late: usize) -> Self {
        Self {
            analysis: Analysis::new(grid),
            low_cut: LowCut::new(grid.sample_rate_hz),
            poses: VecDeque::from(vec![Pose::IDENTITY; late + 1]),
            last: Pose::IDENTITY,
            before: Pose::IDENTITY,
            has_noted: false,
        }
    }

    /// Sets the corner of the low cut that is glided to, Hz, or jumped to; 0 for none.
    pub(crate) fn aim(&mut self, low_cut_hz: f32, jump: bool) {
        self.low_cut.aim(low_cut_hz, jump);
    }

    /// Is at a pose at once, or where it was if that is none. Returns the pose.
    pub(crate) fn jump(&mut self, pose: Pose) -> Pose {
        self.last = valid_or(pose, self.last);
        self.poses.iter_mut().for_each(|p| *p = self.last);
        self.before = self.last;
        self.last
    }

    /// Takes some samples of the hop at a level; what is missing of them is silent.
    pub(crate) fn take(&mut self, span: Range<usize>, samples: &[f32], level: &mut Ramp) {
        let place = &mut self.analysis.newest()[span];
        // Comparisons with a NaN are false, so it falls to 0 too.
        let sound = |x: f32| if (QUIET..ABSURD).contains(&x.abs()) { x } else { 0.0 };
        let count = samples.len().min(place.len());
        place[..count].iter_mut().zip(samples).for_each(|(p, x)| *p = sound(*x));
        place[count..].fill(0.0);
        level.apply(place);
        if self.low_cut.is_on() {
            self.low_cut.process(place);
            place.iter_mut().for_each(|p| *p = sound(*p));
        }
    }

    /// Takes the newest pose.
    pub(crate) fn note_pose(&mut self, newest: Pose) {
        self.has_noted = true;
        self.poses.rotate_left(1);
        let last = self.poses.len() - 1;
        self.poses[last] = valid_or(newest, self.poses[last.saturating_sub(1)]);
    }

    /// The pose that is rendered.
    pub(crate) fn pose(&self) -> Pose {
        self.poses[0]
    }

    /// The pose that is rendered with the frame that the hop ends with, once it is known.
    pub(crate) fn next_pose(&self) -> Option<Pose> {
        self.poses.get(usize::from(!self.has_noted)).copied()
    }

    /// The pose of the frame before, and of the one before the hop ends.
    pub(crate) fn before(&self) -> Pose {
        self.before
    }

    /// Moves on to the pose that is rendered with the next frame. Returns that of the frame before.
    pub(crate) fn step(&mut self) -> Pose {
        self.has_noted = false;
        std::mem::replace(&mut self.before, self.poses[0])
    }

    /// The hop that is taken in.
    pub(crate) fn newest(&mut self) -> &mut [f32] {
        self.analysis.newest()
    }

    /// Transforms the newest frame and moves on by a hop.
    pub(crate) fn analyse(&mut self, spectrum: &mut Spectrum) {
        self.analysis.analyse(spectrum);
    }

    /// Forgets what sounded.
    pub(crate) fn silence(&mut self) {
        self.analysis.reset();
        self.low_cut.reset();
    }

    /// Forgets the past.
    pub(crate) fn reset(&mut self) {
        self.silence();
        self.has_noted = false;
        (self.last, self.before) = (Pose::IDENTITY, Pose::IDENTITY);
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        self.analysis.memory_bytes()
    }
}

/// What the user changes, as it is heard at a pose: another distance law changes the direct sound's level.
pub(crate) fn heard_at(trim: &Trim, scene: &Scene, pose: &Pose) -> Trim {
    let power = 1.0 - trim.distance_law;
    let Some(emitter) = scene.emitter().filter(|_| power != 0.0) else { return *trim };
    let distance = |pose: &Pose| pose.position.distance(emitter).max(NEAREST_M);
    let gain = (distance(pose) / distance(&scene.start_pose())).powf(power);
    Trim { direct: trim.direct * gain, ..*trim }
}

fn valid_or(pose: Pose, fallback: Pose) -> Pose {
    if pose.is_valid() { pose } else { fallback }
}
