//! The plugin's parameters: ids, ranges and units, and the one place where knobs become metres, radians and linear gains.

use crate::kept::{Kept, Report};
use crate::reference::SceneReference;
use crate::state::StateVersion;
use crate::walk::KeptWalk;
use nice_plug::prelude::*;
use promenade_core::glam::Vec3;
use promenade_core::{BlockParams, LiveParams, Pose, Tier};

/// Number of library files that a slot parameter can choose from.
pub const SLOTS: i32 = 64;

/// What moves the listener.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum Follow {
    /// The position and angle parameters.
    #[id = "off"]
    #[name = "Off"]
    Off,
    /// The camera path, at the path position parameter.
    #[id = "position"]
    #[name = "Path position"]
    Position,
    /// The camera path, at the time of the host's transport.
    #[id = "transport"]
    #[name = "Transport"]
    Transport,
}

/// [`Tier`] as a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum TierChoice {
    /// [`Tier::Draft`].
    #[id = "draft"]
    #[name = "Draft"]
    Draft,
    /// [`Tier::Standard`].
    #[id = "standard"]
    #[name = "Standard"]
    Standard,
    /// [`Tier::High`].
    #[id = "high"]
    #[name = "High"]
    High,
    /// [`Tier::Reference`].
    #[id = "reference"]
    #[name = "Reference"]
    Reference,
}

/// Where the scene comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum SceneChoice {
    /// The factory scene of room A.
    #[id = "iosr-room-a"]
    #[name = "IoSR room A"]
    RoomA,
    /// The factory scene of room B.
    #[id = "iosr-room-b"]
    #[name = "IoSR room B"]
    RoomB,
    /// The user's library, or the scene saved with the project.
    #[id = "library"]
    #[name = "Library"]
    Library,
}

/// Everything a host can set or save. The ids never change; `docs/parameters.md` lists them.
#[derive(Params)]
pub struct PromenadeParams {
    /// Listener position, metres in the scene's world.
    #[id = "x"]
    pub x: FloatParam,
    /// Listener position, metres in the scene's world.
    #[id = "y"]
    pub y: FloatParam,
    /// Listener position, metres in the scene's world.
    #[id = "z"]
    pub z: FloatParam,
    /// Head turn, degrees, positive to the left.
    #[id = "yaw"]
    pub yaw: FloatParam,
    /// Head tilt, degrees, positive nose up.
    #[id = "pitch"]
    pub pitch: FloatParam,
    /// Head tilt, degrees, positive right ear down.
    #[id = "roll"]
    pub roll: FloatParam,
    /// Share of the camera path that has been walked.
    #[id = "path"]
    pub path: FloatParam,
    /// What moves the listener.
    #[id = "follow"]
    pub follow: EnumParam<Follow>,
    /// Speed against accuracy.
    #[id = "tier"]
    pub tier: EnumParam<TierChoice>,
    /// Decodes a second of the tiers High and Reference while the listener moves, hertz.
    #[id = "rate"]
    pub rate: FloatParam,
    /// Share of the rendered sound.
    #[id = "mix"]
    pub mix: FloatParam,
    /// Output gain, dB.
    #[id = "gain"]
    pub gain: FloatParam,
    /// Passes the dry sound, delayed by the latency.
    #[id = "bypass"]
    pub bypass: BoolParam,
    /// Where the scene comes from.
    #[id = "scene"]
    pub scene: EnumParam<SceneChoice>,
    /// Scene file of the library, 0 for the one saved with the project.
    #[id = "slot"]
    pub slot: IntParam,
    /// Camera path file of the library, 0 for the one saved with the project.
    #[id = "walk"]
    pub walk: IntParam,
    /// The version of the saved state.
    #[persist = "version"]
    pub state_version: StateVersion,
    /// The library scene that the project plays.
    #[persist = "scene"]
    pub scene_reference: Kept<SceneReference>,
    /// The camera path of the project.
    #[persist = "walk"]
    pub kept_walk: Kept<KeptWalk>,
    /// What is wrong with the scene.
    #[persist = "scene-report"]
    pub scene_report: Report,
    /// What is wrong with the camera path.
    #[persist = "walk-report"]
    pub walk_report: Report,
}

/// Listener position along one axis, metres.
#[must_use]
pub fn position_range_m() -> FloatRange {
    FloatRange::Linear { min: -50.0, max: 50.0 }
}

/// Yaw and roll, degrees.
#[must_use]
pub fn turn_range_deg() -> FloatRange {
    FloatRange::Linear { min: -180.0, max: 180.0 }
}

/// Pitch, degrees.
#[must_use]
pub fn pitch_range_deg() -> FloatRange {
    FloatRange::Linear { min: -90.0, max: 90.0 }
}

/// Decodes a second, hertz.
#[must_use]
pub fn rate_range_hz() -> FloatRange {
    FloatRange::Linear { min: 5.0, max: 100.0 }
}

/// Mix and path position, a share of 1.
#[must_use]
pub fn share_range() -> FloatRange {
    FloatRange::Linear { min: 0.0, max: 1.0 }
}

/// Output gain, dB; linear in dB so that a fader's steps are even.
#[must_use]
pub fn gain_range_db() -> FloatRange {
    FloatRange::Linear { min: -60.0, max: 12.0 }
}

impl Default for PromenadeParams {
    fn default() -> Self {
        let rounded = |digits| formatters::v2s_f32_rounded(digits);
        let metres = |name| FloatParam::new(name, 0.0, position_range_m()).with_unit(" m").with_value_to_string(rounded(3));
        let degrees = |name, range| FloatParam::new(name, 0.0, range).with_unit(" deg").with_value_to_string(rounded(2));
        let percent = |name, default| {
            FloatParam::new(name, default, share_range())
                .with_unit(" %")
                .with_value_to_string(formatters::v2s_f32_percentage(2))
                .with_string_to_value(formatters::s2v_f32_percentage())
        };
        let slot = |name| IntParam::new(name, 0, IntRange::Linear { min: 0, max: SLOTS }).non_automatable();
        Self {
            x: metres("Listener X"),
            y: metres("Listener Y"),
            z: metres("Listener Z"),
            yaw: degrees("Yaw", turn_range_deg()),
            pitch: degrees("Pitch", pitch_range_deg()),
            roll: degrees("Roll", turn_range_deg()),
            path: percent("Path Position", 0.0),
            follow: EnumParam::new("Follow Path", Follow::Off),
            tier: EnumParam::new("Tier", TierChoice::Standard),
            rate: FloatParam::new("Decode Rate", LiveParams::default().rate_hz, rate_range_hz())
                .with_unit(" Hz")
                .with_value_to_string(rounded(1)),
            mix: percent("Dry/Wet", 1.0),
            gain: FloatParam::new("Output Gain", 0.0, gain_range_db()).with_unit(" dB").with_value_to_string(rounded(2)),
            bypass: BoolParam::new("Bypass", false).make_bypass(),
            scene: EnumParam::new("Scene", SceneChoice::RoomA).non_automatable(),
            slot: slot("Library Scene"),
            walk: slot("Library Path"),
            state_version: StateVersion,
            scene_reference: Kept::default(),
            kept_walk: Kept::default(),
            scene_report: Report::default(),
            walk_report: Report::default(),
        }
    }
}

/// The parameters of one block in core's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snapshot {
    /// The pose that the position and angle parameters set.
    pub pose: Pose,
    /// What moves the listener.
    pub follow: Follow,
    /// Share of the camera path that has been walked, 0 to 1.
    pub path_share: f64,
    /// Tier, mix, gain and bypass.
    pub block: BlockParams,
}

/// The non-automatable choices of files; a change sends the loader to work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choices {
    /// Where the scene comes from.
    pub scene: SceneChoice,
    /// Scene file of the library, 0 for the project's own.
    pub scene_slot: u32,
    /// Camera path file of the library, 0 for the project's own.
    pub walk_slot: u32,
}

impl PromenadeParams {
    /// The parameters as they are now, in metres, radians and linear gains.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    #[must_use]
    pub fn snapshot(&self) -> Snapshot {
        let value = |param: &FloatParam| within(param.value(), param.range());
        let radians = |param: &FloatParam| value(param).to_radians();
        let position = Vec3::new(value(&self.x), value(&self.y), value(&self.z));
        Snapshot {
            pose: Pose::from_ypr(position, radians(&self.yaw), radians(&self.pitch), radians(&self.roll)),
            follow: self.follow.value(),
            path_share: f64::from(value(&self.path)),
            block: BlockParams {
                tier: self.tier.value().into(),
                mix: value(&self.mix),
                gain: 10_f32.powf(value(&self.gain) / 20.0),
                bypass: self.bypass.value(),
                live: LiveParams { rate_hz: value(&self.rate), wait: false },
            },
        }
    }

    /// The choices of files as they are now.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    #[must_use]
    pub fn choices(&self) -> Choices {
        let slot = |param: &IntParam| u32::try_from(param.value()).unwrap_or(0);
        Choices { scene: self.scene.value(), scene_slot: slot(&self.slot), walk_slot: slot(&self.walk) }
    }
}

/// A state can set a value beyond the range, and a host what is no number; the value nearest to zero stands for that.
fn within(value: f32, range: FloatRange) -> f32 {
    match range {
        FloatRange::Linear { min, max } => (if value.is_finite() { value } else { 0.0 }).clamp(min, max),
        _ => 0.0,
    }
}

impl From<TierChoice> for Tier {
    fn from(choice: TierChoice) -> Self {
        match choice {
            TierChoice::Draft => Self::Draft,
            TierChoice::Standard => Self::Standard,
            TierChoice::High => Self::High,
            TierChoice::Reference => Self::Reference,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_stand_at_the_origin_at_unit_gain() {
        let snapshot = PromenadeParams::default().snapshot();
        assert_eq!(snapshot.pose, Pose::IDENTITY);
        assert_eq!(snapshot.block, BlockParams::default());
    }

    #[test]
    fn a_value_is_kept_within_its_range() {
        assert_eq!(within(1e30, position_range_m()), 50.0);
        assert_eq!(within(-2.5, position_range_m()), -2.5);
        assert_eq!(within(f32::NAN, gain_range_db()), 0.0);
    }

    #[test]
    fn the_ids_of_the_tiers_are_their_names() {
        assert_eq!(TierChoice::ids().unwrap(), Tier::ALL.map(Tier::name));
        for (index, tier) in Tier::ALL.into_iter().enumerate() {
            assert_eq!(Tier::from(TierChoice::from_index(index)), tier);
        }
    }
}
