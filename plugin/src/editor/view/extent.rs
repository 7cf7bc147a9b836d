//! How far the place reaches.

use super::{super::ctx::Ctx, sources};
use crate::listener::snapshot::pose_of;
use promenade_core::glam::Vec3;

/// The least that is shown along x and y, metres.
const LEAST_M: f32 = 3.0;

/// Corners of the box around everything that is to be seen.
pub(super) fn of(ctx: &Ctx<'_>) -> (Vec3, Vec3) {
    let mut points = vec![ctx.frame.pose.position, pose_of(|parameter| ctx.value(parameter)).position];
    if let Some(room) = ctx.drawn_room() {
        // Its scene may still be of other lengths.
        points.extend(room.corners());
    } else if let Some(scene) = ctx.scene {
        let (low, high) = scene.bounds();
        points.extend([low, high]);
        if let Some(home) = scene.emitter() {
            points.extend([home, ctx.source_at(home, 0)]);
            points.extend(sources::places(ctx, home));
        }
        points.extend(scene.anchors().iter().map(|anchor| anchor.position));
    }
    let paths = [ctx.walk.map(|walk| &**walk), ctx.source_walk(ctx.selection.source)];
    for walk in paths.into_iter().flatten() {
        points.extend(walk.path.keyframes().iter().map(|keyframe| keyframe.pose.position));
    }
    around(&points)
}

/// The box around points, not smaller than a room.
fn around(points: &[Vec3]) -> (Vec3, Vec3) {
    let finite = || points.iter().copied().filter(|point| point.is_finite());
    let Some(first) = finite().next() else { return (Vec3::splat(-LEAST_M / 2.0), Vec3::splat(LEAST_M / 2.0)) };
    let (low, high) = finite().fold((first, first), |(low, high), point| (low.min(point), high.max(point)));
    let short = (Vec3::new(LEAST_M, LEAST_M, 0.0) - (high - low)).max(Vec3::ZERO) / 2.0;
    (low - short, high + short)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_is_in_it_and_a_single_point_has_a_room_around_it() {
        let (low, high) = around(&[Vec3::new(-4.0, 1.0, 0.5), Vec3::new(2.0, 1.5, 2.0), Vec3::NAN]);
        assert_eq!((low.x, high.x, low.z, high.z), (-4.0, 2.0, 0.5, 2.0));
        assert!((low.y - (1.25 - 1.5)).abs() < 1e-6 && (high.y - low.y - 3.0).abs() < 1e-6);
        assert_eq!(around(&[Vec3::ZERO]), (Vec3::new(-1.5, -1.5, 0.0), Vec3::new(1.5, 1.5, 0.0)));
        assert_eq!(around(&[]).1.x, 1.5);
    }
}
