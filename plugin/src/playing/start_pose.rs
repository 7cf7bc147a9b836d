//! Where the listener of a scene that was just chosen begins.

use crate::listener::snapshot::{pose_of, values_of};
use crate::parameter::{Parameter, choices::Follow};
use crate::project::params::PromenadeParams;
use nice_plug::prelude::Enum;
use promenade_core::Pose;

/// A listener is at a place within this distance of it, metres: hosts round.
const NEAR_M: f32 = 1e-3;
/// And faces as it does within this angle, radians; single precision tells no less apart.
const NEAR_RAD: f32 = 2e-3;

/// Puts a listener whom nobody has put anywhere where the scene lets it begin: one who is where the scene before it did, or,
/// as in a new instance, at the origin, facing along x. Who was moved, by hand, automation or remote control, stays.
///
/// A host has the pose as if it had come over Open Sound Control: its own values count again as soon as they change.
pub(crate) fn begin(params: &PromenadeParams, before: Option<&Pose>, start: &Pose) {
    let path = Follow::from_index(params.index(Parameter::Follow)) != Follow::Off;
    let here = pose_of(|parameter| params.heard(parameter));
    let unmoved = [Some(&Pose::IDENTITY), before].into_iter().flatten().any(|pose| is_at(&here, pose));
    if path || !unmoved {
        return;
    }
    for (parameter, value) in values_of(start) {
        params.remote.set(parameter, value, params.hosted(parameter));
    }
}

/// Whether a listener is at a pose, as far as its parameters can be.
fn is_at(here: &Pose, pose: &Pose) -> bool {
    let values = values_of(pose);
    let there = pose_of(|parameter| values.iter().find(|(of, _)| *of == parameter).map_or(0.0, |(_, value)| *value));
    here.position.distance(there.position) < NEAR_M && here.orientation.angle_between(there.orientation) < NEAR_RAD
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::glam::Vec3;

    fn at(x: f32, yaw: f32) -> Pose {
        Pose::from_ypr(Vec3::new(x, 1.0, 0.2), yaw, 0.1, 0.0)
    }

    fn heard(params: &PromenadeParams) -> Pose {
        pose_of(|parameter| params.heard(parameter))
    }

    #[test]
    fn who_was_not_moved_goes_from_scene_to_scene() {
        let params = PromenadeParams::default();
        begin(&params, None, &at(3.0, 1.0));
        assert!(is_at(&heard(&params), &at(3.0, 1.0)), "{:?}", heard(&params));
        begin(&params, Some(&at(3.0, 1.0)), &at(-2.0, 3.0));
        assert!(is_at(&heard(&params), &at(-2.0, 3.0)), "{:?}", heard(&params));
    }

    #[test]
    fn who_was_moved_stays() {
        let params = PromenadeParams::default();
        params.remote.set(Parameter::Yaw, 1.0, 0.0);
        begin(&params, Some(&at(3.0, 1.0)), &at(-2.0, 3.0));
        assert_eq!(heard(&params), Pose::from_ypr(Vec3::ZERO, 1.0_f32.to_radians(), 0.0, 0.0));
    }

    #[test]
    fn beyond_the_parameters_is_at_their_limits() {
        let params = PromenadeParams::default();
        begin(&params, None, &at(80.0, 0.0));
        assert_eq!(heard(&params).position.x, 50.0);
        begin(&params, Some(&at(80.0, 0.0)), &at(1.0, 0.0));
        assert!(is_at(&heard(&params), &at(1.0, 0.0)));
    }
}
