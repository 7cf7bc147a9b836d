use super::*;
use promenade_core::glam::Vec3;
use promenade_core::{CameraPath, Keyframe};
use std::f32::consts::{FRAC_PI_2, PI};

pub(crate) fn at(x: f32, yaw: f32) -> Pose {
    Pose::from_ypr(Vec3::new(x, 0.0, 0.0), yaw, 0.0, 0.0)
}

fn walk() -> Walk {
    let keyframes = [(0.0, at(0.0, FRAC_PI_2)), (2.0, at(2.0, FRAC_PI_2))];
    let path = CameraPath::new(keyframes.map(|(t_s, pose)| Keyframe { t_s, pose }).to_vec()).unwrap();
    Walk { path, playback: Playback::default() }
}

fn sources(follow: Follow, offset: bool, tracking: Tracking) -> Sources {
    Sources { knobs: at(1.0, 0.1), follow, path_share: 0.25, offset, tracking }
}

pub(crate) fn check(found: Pose, x: f32, yaw: f32) {
    assert!((found.position - Vec3::new(x, 0.0, 0.0)).length() < 1e-5, "{found:?}");
    let off = (found.ypr().0 - yaw).rem_euclid(2.0 * PI);
    assert!(off < 1e-5 || 2.0 * PI - off < 1e-5, "{found:?}");
}

#[test]
fn a_path_goes_before_the_knobs_or_has_them_added() {
    let walk = walk();
    let pose = |follow, offset| sources(follow, offset, Tracking::Off).pose(Some(&walk), None, 1.5);
    check(pose(Follow::Off, true), 1.0, 0.1);
    check(pose(Follow::Transport, false), 1.5, FRAC_PI_2);
    check(pose(Follow::Position, false), 0.5, FRAC_PI_2);
    check(pose(Follow::Transport, true), 2.5, FRAC_PI_2 + 0.1);
    check(sources(Follow::Transport, true, Tracking::Off).pose(None, None, 1.5), 1.0, 0.1);
}

#[test]
fn a_tracker_turns_the_head_on_top_or_stands_alone() {
    let (walk, tracked) = (walk(), at(3.0, 0.5));
    let pose = |tracking| sources(Follow::Transport, false, tracking).pose(Some(&walk), Some(&tracked), 1.0);
    check(pose(Tracking::Off), 1.0, FRAC_PI_2);
    check(pose(Tracking::Head), 1.0, FRAC_PI_2 + 0.5);
    check(pose(Tracking::Absolute), 3.0, 0.5);
    // The path faces left, so that a step forward of the tracker goes along y.
    let stepped = pose(Tracking::Pose);
    assert!((stepped.position - Vec3::new(1.0, 3.0, 0.0)).length() < 1e-5, "{stepped:?}");
}
