//! A share of a simulation's work, for one of several machines.

use promenade_core::Pose;
use promenade_core::glam::Vec3;

/// One of so many shares of a simulation's places. Poses at one place are of one share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Which one, from 1.
    pub number: u32,
    /// How many there are, at least as many as `number`.
    pub of: u32,
}

impl Part {
    /// All of it.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// The places of this part, each once. Neighbours go to different parts, so that all have about the same work.
    pub(super) fn places(self, poses: &[Pose]) -> Vec<Vec3> {
        let every = self.of.max(1) as usize;
        distinct(poses).into_iter().skip(self.number.saturating_sub(1) as usize).step_by(every).collect()
    }

    /// The numbers from 0 of the poses of this part.
    #[must_use]
    pub fn poses(self, poses: &[Pose]) -> Vec<usize> {
        let places = self.places(poses);
        let mine = |pose: &Pose| places.binary_search_by(|place| order(place, &pose.position)).is_ok();
        (0..poses.len()).filter(|i| mine(&poses[*i])).collect()
    }
}

/// The places of heads in order, each once.
pub(super) fn distinct(poses: &[Pose]) -> Vec<Vec3> {
    let mut places: Vec<Vec3> = poses.iter().map(|p| p.position).collect();
    places.sort_by(order);
    places.dedup_by(|a, b| order(a, b).is_eq());
    places
}

/// One order of all places: by x, then y, then z; two zeros of different sign are one.
fn order(a: &Vec3, b: &Vec3) -> std::cmp::Ordering {
    let axes = |v: &Vec3| (*v + Vec3::ZERO).to_array();
    let of_axes = axes(a).into_iter().zip(axes(b)).map(|(a, b)| a.total_cmp(&b));
    of_axes.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_share_all_poses_and_keep_places_together() {
        let at = |x: f32| Pose { position: Vec3::new(x, 0.0, 1.0), ..Pose::IDENTITY };
        let poses = [3.0, -0.0, 1.0, 2.0, 0.0, 3.0, 5.0].map(at);
        let parts = [1, 2, 3].map(|number| Part { number, of: 3 }.poses(&poses));
        assert_eq!(parts, [vec![0, 1, 4, 5], vec![2, 6], vec![3]]);
        assert_eq!(Part::WHOLE.poses(&poses), [0, 1, 2, 3, 4, 5, 6]);
        assert!(Part { number: 6, of: 6 }.poses(&poses).is_empty());
    }
}
