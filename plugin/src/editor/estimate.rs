//! Where the listener would be heard while the host does not ask for sound.

use super::gesture::Gestures;
use super::view::pose_of;
use crate::params::PromenadeParams;
use crate::telemetry::Frame;
use crate::walk::Walk;

/// Puts the pose of knobs and camera path in place of what the audio thread last told. Trackers and groups are known to that one only.
pub(super) fn stand_in(frame: &mut Frame, params: &PromenadeParams, gestures: &Gestures, walk: Option<&Walk>) {
    let mut sources = params.snapshot().sources;
    sources.knobs = pose_of(|knob| gestures.value(knob).unwrap_or_else(|| params.heard(knob)));
    frame.pose = sources.pose(walk, None, frame.transport_s);
    (frame.base, frame.tracked, frame.leads) = (sources.base(walk.is_some(), false), false, false);
    frame.load = 0.0;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::listener::Base;
    use crate::remote::Knob;
    use promenade_core::glam::Vec3;

    #[test]
    fn the_knobs_are_shown_as_they_are_set() {
        let (params, mut frame) = (PromenadeParams::default(), Frame { base: Base::Group, ..Frame::default() });
        params.remote.set(Knob::Y, 2.0, 0.0);
        stand_in(&mut frame, &params, &Gestures::default(), None);
        assert_eq!((frame.pose.position, frame.base), (Vec3::Y * 2.0, Base::Knobs));
    }
}
