//! The parameters of a block: the one place where they become metres, radians and linear gains.

use crate::listener::pose_sources::Sources;
use crate::parameter::choices::{Follow, GroupChoice, Tracking};
use crate::parameter::source_knob::{Part, SourceKnob};
use crate::parameter::{Parameter, USUAL_LAW_DB, cast::index};
use crate::project::params::PromenadeParams;
use crate::project::scene_frame::{SceneFrame, from_polar};
use nice_plug::prelude::Enum;
use promenade_core::glam::Vec3;
use promenade_core::{BlockParams, EmitterParams, LiveParams, Pose, Trim};

/// The parameters of one block in core's units, of an instance with so many further sources.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snapshot<const FURTHER: usize = 0> {
    /// Where the listener's pose comes from.
    pub sources: Sources,
    /// The key of the listener group.
    pub group: Option<u64>,
    /// Whether this instance leads its group.
    pub leads: bool,
    /// Mix, gain, bypass, what is changed about the sound, and where it is played from.
    pub block: BlockParams,
    /// Gain of the first source's input: 0 where it is muted, else 1.
    pub first_gain: f32,
    /// Further sources.
    pub further: [FurtherPlace; FURTHER],
}

/// Where a further source is, and how loud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FurtherPlace {
    /// How far it is from the scene's emitter, metres.
    pub offset: Vec3,
    /// Gain of its input, linear.
    pub gain: f32,
}

impl FurtherPlace {
    /// That of a further source, 0 for the first, from the parameters' plain values.
    fn of(further: usize, value: impl Fn(Parameter) -> f32, frame: Option<&SceneFrame>) -> Self {
        let level = Parameter::Source(SourceKnob { further, part: Part::Level });
        let gain = match value(level) {
            // The power of many would take longer than everything else here.
            0.0 => 1.0,
            level_db if level_db <= level.limits().0 => 0.0,
            level_db => 10_f32.powf(level_db / 20.0),
        };
        Self { offset: offset_of(1 + further, value, frame), gain }
    }
}

impl<const FURTHER: usize> Snapshot<FURTHER> {
    /// The parameters as they are now, in metres, radians and linear gains. The instance has so many further sources at least.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn of(params: &PromenadeParams, frame: Option<&SceneFrame>) -> Self {
        let value = |parameter| params.heard(parameter);
        let group = GroupChoice::from_index(params.index(Parameter::Group)).number();
        let group = group.map(|number| params.project.group(number));
        Self {
            sources: sources_of(value),
            group,
            leads: group.is_some() && value(Parameter::Lead) > 0.5,
            block: BlockParams {
                mix: value(Parameter::Mix),
                gain: 10_f32.powf(value(Parameter::Gain) / 20.0),
                bypass: value(Parameter::Bypass) > 0.5,
                live: LiveParams { rate_hz: value(Parameter::Rate), wait: false },
                wet_solo: value(Parameter::WetSolo) > 0.5,
                trim: trim_of(value),
                emitters: EmitterParams { offset: offset_of(0, value, frame), spread: value(Parameter::Spread).to_radians() },
            },
            first_gain: if params.sources.is_heard(0) { 1.0 } else { 0.0 },
            further: std::array::from_fn(|number| {
                let place = FurtherPlace::of(number, value, frame);
                if params.sources.is_heard(1 + number) { place } else { FurtherPlace { gain: 0.0, ..place } }
            }),
        }
    }
}

/// Where the listener's pose comes from, from the parameters' plain values.
pub fn sources_of(value: impl Fn(Parameter) -> f32) -> Sources {
    Sources {
        knobs: pose_of(&value),
        follow: Follow::from_index(index(value(Parameter::Follow))),
        path_share: f64::from(value(Parameter::Path)),
        offset: value(Parameter::Offset) > 0.5,
        tracking: Tracking::from_index(index(value(Parameter::Tracking))),
    }
}

/// How far a source, 0 for the first, is from the scene's emitter, metres, in the frame of the scene that is played.
pub fn offset_of(source: usize, value: impl Fn(Parameter) -> f32, frame: Option<&SceneFrame>) -> Vec3 {
    match frame.filter(|_| value(Parameter::Place) > 0.5) {
        Some(frame) => frame.to_world(from_polar(Parameter::polar_of(source).map(value))) - frame.emitter,
        None => Vec3::from_array(Parameter::place_of(source).map(value)),
    }
}

/// The pose that position and angle parameters set, from their plain values.
pub fn pose_of(value: impl Fn(Parameter) -> f32) -> Pose {
    let position = Vec3::new(value(Parameter::X), value(Parameter::Y), value(Parameter::Z));
    let radians = |parameter| value(parameter).to_radians();
    Pose::from_ypr(position, radians(Parameter::Yaw), radians(Parameter::Pitch), radians(Parameter::Roll))
}

/// The position and angle parameters with the plain values that set a pose, within their limits.
pub fn values_of(pose: &Pose) -> [(Parameter, f32); 6] {
    let (yaw, pitch, roll) = pose.ypr();
    let [yaw, pitch, roll] = [yaw, pitch, roll].map(f32::to_degrees);
    let Vec3 { x, y, z } = pose.position;
    let values = [
        (Parameter::X, x),
        (Parameter::Y, y),
        (Parameter::Z, z),
        (Parameter::Yaw, yaw),
        (Parameter::Pitch, pitch),
        (Parameter::Roll, roll),
    ];
    values.map(|(parameter, value)| (parameter, parameter.clamp(value)))
}

/// What the parameters change about the scene's sound, from their plain values.
///
/// Values as near to neutral as hosts' fractions of a range come are neutral: then nothing of the sound changes.
pub fn trim_of(value: impl Fn(Parameter) -> f32) -> Trim {
    let near = |value: f32, neutral: f32| if (value - neutral).abs() < 1e-4 { neutral } else { value };
    let gain = |parameter: Parameter| {
        let db = near(value(parameter), 0.0);
        if db <= parameter.limits().0 { 0.0 } else { 10_f32.powf(db / 20.0) }
    };
    Trim {
        direct: gain(Parameter::Direct),
        early: gain(Parameter::Early),
        late: gain(Parameter::Late),
        decay: near(value(Parameter::Decay), 1.0),
        distance_law: near(value(Parameter::Law), USUAL_LAW_DB) / USUAL_LAW_DB,
        width: near(value(Parameter::Width), 1.0),
        low_cut_hz: value(Parameter::LowCut),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_stand_at_the_origin_at_unit_gain() {
        let snapshot = <Snapshot>::of(&PromenadeParams::default(), None);
        assert_eq!(snapshot.sources.knobs, Pose::IDENTITY);
        assert_eq!(snapshot.block, BlockParams::default());
    }

    #[test]
    fn further_sources_are_where_and_as_loud_as_their_knobs_say() {
        let params = PromenadeParams::default().with_further(2);
        let set = |further, part, value| {
            let parameter = Parameter::Source(SourceKnob { further, part });
            params.remote.set(parameter, value, params.hosted(parameter));
        };
        set(1, Part::X, 3.0);
        set(1, Part::Level, -20.0);
        set(0, Part::Level, -60.0);
        let [first, second] = Snapshot::of(&params, None).further;
        assert_eq!((first.offset, first.gain), (Vec3::new(-0.03, 0.29, 0.0), 0.0));
        assert!(second.offset == Vec3::new(3.0, -0.29, 0.0) && (second.gain - 0.1).abs() < 1e-6, "{second:?}");
    }

    #[test]
    fn levels_are_gains_and_what_is_nearly_neutral_is_neutral() {
        let usual = |parameter: Parameter| PromenadeParams::default().hosted(parameter);
        assert_eq!(trim_of(|parameter| usual(parameter) + 1e-5), Trim { low_cut_hz: 1e-5, ..Trim::NEUTRAL });
        let changed = trim_of(|parameter| match parameter {
            Parameter::Early => -60.0,
            Parameter::Late => 6.0,
            Parameter::Law => 3.0,
            other => usual(other),
        });
        assert_eq!((changed.early, changed.distance_law), (0.0, 0.5));
        assert!((changed.late - 1.9953).abs() < 1e-3 && changed.direct == 1.0);
    }
}
