//! Where the listener is at each sample: where messages say, or on a path.

use crate::glide::Glide;
use promenade_core::{CameraPath, Playback, Pose};

/// A path that is walked.
struct Walk {
    /// Seconds along it at the sample where it began.
    from_s: f64,
    began: u64,
    playback: Playback,
}

/// The listener of one stream.
pub(crate) struct Listener {
    pub(crate) glide: Glide,
    rate_hz: f64,
    path: Option<CameraPath>,
    walk: Option<Walk>,
    /// The path moves the listener, but messages turn the head.
    own_head: bool,
}

impl Listener {
    pub(crate) fn new(pose: Pose, rate_hz: f64) -> Self {
        Self { glide: Glide::new(pose, rate_hz), rate_hz, path: None, walk: None, own_head: false }
    }

    /// Takes a path, which is not walked yet.
    pub(crate) fn set_path(&mut self, path: Option<CameraPath>) {
        (self.path, self.walk) = (path, None);
    }

    /// Walks the path from some seconds along it, from a sample on.
    pub(crate) fn walk(&mut self, from_s: f64, playback: Playback, own_head: bool, began: u64) {
        self.own_head = own_head;
        self.walk = self.path.is_some().then_some(Walk { from_s, began, playback });
    }

    /// Leaves the path for good, at the pose of a sample.
    pub(crate) fn stop(&mut self, sample: u64) {
        let here = self.pose_at(sample as f64);
        self.walk = None;
        self.glide.jump(here);
    }

    /// Seconds along the path, if it is walked.
    pub(crate) fn along_s(&self, sample: u64) -> Option<f64> {
        self.walk.as_ref().map(|walk| walk.from_s + sample.saturating_sub(walk.began) as f64 / self.rate_hz)
    }

    /// The stream begins again, a walk where it began.
    pub(crate) fn reset(&mut self) {
        self.glide.reset();
        if let Some(walk) = &mut self.walk {
            walk.began = 0;
        }
    }

    pub(crate) fn pose_at(&self, sample: f64) -> Pose {
        let (Some(path), Some(walk)) = (&self.path, &self.walk) else { return self.glide.pose_at(sample) };
        let pose = path.pose_after(walk.from_s + (sample - walk.began as f64) / self.rate_hz, walk.playback);
        if self.own_head { Pose { orientation: self.glide.pose_at(sample).orientation, ..pose } } else { pose }
    }
}
