//! The listener's pose while the host does not ask for sound.

use super::gesture::Gestures;
use crate::listener::snapshot::{Snapshot, pose_of};
use crate::project::{params::PromenadeParams, walk::Walk};
use crate::telemetry::Frame;

/// Replaces the audio thread's last pose by that of knobs and camera path. Trackers and groups are known to the audio thread
/// only.
pub(super) fn estimate(frame: &mut Frame, params: &PromenadeParams, gestures: &Gestures, walk: Option<&Walk>) {
    let mut sources = <Snapshot>::of(params, None).sources;
    sources.knobs = pose_of(|parameter| gestures.value(parameter).unwrap_or_else(|| params.heard(parameter)));
    frame.pose = sources.pose(walk, None, frame.transport_s);
    (frame.base, frame.tracked, frame.leads) = (sources.base(walk.is_some(), false), false, false);
    frame.load = 0.0;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::listener::pose_sources::Base;
    use crate::parameter::Parameter;
    use promenade_core::glam::Vec3;

    #[test]
    fn the_knobs_are_shown_as_they_are_set() {
        let (params, mut frame) = (PromenadeParams::default(), Frame { base: Base::Group, ..Frame::default() });
        params.remote.set(Parameter::Y, 2.0, 0.0);
        estimate(&mut frame, &params, &Gestures::default(), None);
        assert_eq!((frame.pose.position, frame.base), (Vec3::Y * 2.0, Base::Knobs));
    }
}
