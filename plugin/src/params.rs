//! The plugin's parameters: ids, ranges and units, and the one place where knobs become metres, radians and linear gains.

use crate::kept::{Kept, Report};
use crate::listener::{Sources, Tracking};
use crate::osc::OscConfig;
use crate::reference::SceneReference;
use crate::remote::{Knob, Remote};
use crate::settings::EditorSettings;
use crate::state::StateVersion;
use crate::walk::KeptWalk;
use nice_plug::prelude::*;
use promenade_core::glam::Vec3;
use promenade_core::{BlockParams, LiveParams, Pose, Tier};

/// Number of library files that a slot parameter can choose from.
pub const SLOTS: i32 = 64;
/// The revision after which counting begins anew.
pub const REVISIONS: i32 = 9_999;

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

/// [`Tracking`] as a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum TrackingChoice {
    /// [`Tracking::Off`].
    #[id = "off"]
    #[name = "Off"]
    Off,
    /// [`Tracking::Head`].
    #[id = "head"]
    #[name = "Head"]
    Head,
    /// [`Tracking::Pose`].
    #[id = "pose"]
    #[name = "Head and position"]
    Pose,
    /// [`Tracking::Absolute`].
    #[id = "absolute"]
    #[name = "Absolute"]
    Absolute,
}

/// Which listener group an instance belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum GroupChoice {
    /// None: a listener of its own.
    #[id = "off"]
    #[name = "Off"]
    Off,
    /// Group A.
    #[id = "a"]
    #[name = "A"]
    A,
    /// Group B.
    #[id = "b"]
    #[name = "B"]
    B,
    /// Group C.
    #[id = "c"]
    #[name = "C"]
    C,
    /// Group D.
    #[id = "d"]
    #[name = "D"]
    D,
}

impl GroupChoice {
    /// Number of the group in the process, or none.
    #[must_use]
    pub fn number(self) -> Option<usize> {
        (self as usize).checked_sub(1)
    }
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
    /// Whether position and angles are added to the path's pose, or wait while a path is followed.
    #[id = "offset"]
    pub offset: BoolParam,
    /// How a head tracker is used.
    #[id = "tracking"]
    pub tracking: EnumParam<TrackingChoice>,
    /// How far the emitter is moved from its place in the scene, metres in the scene's world.
    #[id = "ex"]
    pub ex: FloatParam,
    /// How far the emitter is moved from its place in the scene, metres in the scene's world.
    #[id = "ey"]
    pub ey: FloatParam,
    /// How far the emitter is moved from its place in the scene, metres in the scene's world.
    #[id = "ez"]
    pub ez: FloatParam,
    /// The listener group.
    #[id = "group"]
    pub group: EnumParam<GroupChoice>,
    /// Whether this instance's listener is that of its group.
    #[id = "lead"]
    pub lead: BoolParam,
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
    /// Counts what the editor changes beside the parameters, so that the host knows that the project has changed.
    #[id = "revision"]
    pub revision: IntParam,
    /// The version of the saved state.
    #[persist = "version"]
    pub state_version: StateVersion,
    /// The library scene that the project plays.
    #[persist = "scene"]
    pub scene_reference: Kept<SceneReference>,
    /// The camera path of the project.
    #[persist = "walk"]
    pub kept_walk: Kept<KeptWalk>,
    /// How Open Sound Control is set up.
    #[persist = "osc"]
    pub osc: Kept<OscConfig>,
    /// How the editor was left.
    #[persist = "editor"]
    pub editor: Kept<EditorSettings>,
    /// What is wrong with the scene.
    #[persist = "scene-report"]
    pub scene_report: Report,
    /// What is wrong with the camera path.
    #[persist = "walk-report"]
    pub walk_report: Report,
    /// Values that have come over Open Sound Control and stand in place of the host's.
    pub remote: Remote,
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
        let slot = |name| IntParam::new(name, 0, IntRange::Linear { min: 0, max: SLOTS });
        Self {
            x: metres("Listener X"),
            y: metres("Listener Y"),
            z: metres("Listener Z"),
            yaw: degrees("Yaw", turn_range_deg()),
            pitch: degrees("Pitch", pitch_range_deg()),
            roll: degrees("Roll", turn_range_deg()),
            path: percent("Path Position", 0.0),
            follow: EnumParam::new("Follow Path", Follow::Off),
            offset: BoolParam::new("Path Offset", false),
            tracking: EnumParam::new("Head Tracking", TrackingChoice::Head),
            ex: metres("Emitter Offset X"),
            ey: metres("Emitter Offset Y"),
            ez: metres("Emitter Offset Z"),
            group: EnumParam::new("Listener Group", GroupChoice::Off),
            lead: BoolParam::new("Lead Group", false),
            tier: EnumParam::new("Tier", TierChoice::Standard),
            rate: FloatParam::new("Decode Rate", LiveParams::default().rate_hz, rate_range_hz())
                .with_unit(" Hz")
                .with_value_to_string(rounded(1)),
            mix: percent("Dry/Wet", 1.0),
            gain: FloatParam::new("Output Gain", 0.0, gain_range_db()).with_unit(" dB").with_value_to_string(rounded(2)),
            bypass: BoolParam::new("Bypass", false).make_bypass(),
            scene: EnumParam::new("Scene", SceneChoice::RoomA),
            slot: slot("Library Scene"),
            walk: slot("Library Path"),
            revision: IntParam::new("Revision", 0, IntRange::Linear { min: 0, max: REVISIONS }).hide().non_automatable(),
            state_version: StateVersion,
            scene_reference: Kept::default(),
            kept_walk: Kept::default(),
            osc: Kept::default(),
            editor: Kept::default(),
            scene_report: Report::default(),
            walk_report: Report::default(),
            remote: Remote::default(),
        }
    }
}

/// The parameters of one block in core's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snapshot {
    /// Where the listener's pose comes from.
    pub sources: Sources,
    /// The listener group, and whether this instance leads it.
    pub group: Option<usize>,
    /// Whether this instance leads its group.
    pub leads: bool,
    /// How far the emitter is moved from its place in the scene, metres.
    pub emitter_offset: Vec3,
    /// Tier, mix, gain and bypass.
    pub block: BlockParams,
}

/// The choices of files; a change sends the loader to work.
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
        let value = |knob| self.heard(knob);
        let radians = |knob| value(knob).to_radians();
        let position = Vec3::new(value(Knob::X), value(Knob::Y), value(Knob::Z));
        let group = GroupChoice::from_index(self.index(Knob::Group)).number();
        Snapshot {
            sources: Sources {
                knobs: Pose::from_ypr(position, radians(Knob::Yaw), radians(Knob::Pitch), radians(Knob::Roll)),
                follow: Follow::from_index(self.index(Knob::Follow)),
                path_share: f64::from(value(Knob::Path)),
                offset: value(Knob::Offset) > 0.5,
                tracking: TrackingChoice::from_index(self.index(Knob::Tracking)).into(),
            },
            group,
            leads: group.is_some() && value(Knob::Lead) > 0.5,
            emitter_offset: Vec3::new(value(Knob::Ex), value(Knob::Ey), value(Knob::Ez)),
            block: BlockParams {
                tier: TierChoice::from_index(self.index(Knob::Tier)).into(),
                mix: value(Knob::Mix),
                gain: 10_f32.powf(value(Knob::Gain) / 20.0),
                bypass: value(Knob::Bypass) > 0.5,
                live: LiveParams { rate_hz: value(Knob::Rate), wait: false },
            },
        }
    }

    /// The choices of files as they are now.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    #[must_use]
    pub fn choices(&self) -> Choices {
        let slot = |knob| u32::try_from(self.index(knob)).unwrap_or(0);
        Choices {
            scene: SceneChoice::from_index(self.index(Knob::Scene)),
            scene_slot: slot(Knob::Slot),
            walk_slot: slot(Knob::Walk),
        }
    }

    /// A parameter as the host has it: its plain value, for a choice its index, for a switch 0 or 1.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    #[must_use]
    pub fn hosted(&self, knob: Knob) -> f32 {
        let value = |param: &FloatParam| within(param.value(), param.range());
        let switch = |param: &BoolParam| f32::from(u8::from(param.value()));
        match knob {
            Knob::X => value(&self.x),
            Knob::Y => value(&self.y),
            Knob::Z => value(&self.z),
            Knob::Yaw => value(&self.yaw),
            Knob::Pitch => value(&self.pitch),
            Knob::Roll => value(&self.roll),
            Knob::Path => value(&self.path),
            Knob::Follow => choice(&self.follow),
            Knob::Offset => switch(&self.offset),
            Knob::Tracking => choice(&self.tracking),
            Knob::Ex => value(&self.ex),
            Knob::Ey => value(&self.ey),
            Knob::Ez => value(&self.ez),
            Knob::Group => choice(&self.group),
            Knob::Lead => switch(&self.lead),
            Knob::Tier => choice(&self.tier),
            Knob::Rate => value(&self.rate),
            Knob::Mix => value(&self.mix),
            Knob::Gain => value(&self.gain),
            Knob::Bypass => switch(&self.bypass),
            Knob::Scene => choice(&self.scene),
            Knob::Slot => whole(self.slot.value()),
            Knob::Walk => whole(self.walk.value()),
        }
    }

    /// The least and the greatest plain value of a parameter, as [`PromenadeParams::hosted`] counts.
    #[must_use]
    pub fn limits(knob: Knob) -> (f32, f32) {
        let ends = |range| match range {
            FloatRange::Linear { min, max } => (min, max),
            _ => (0.0, 1.0),
        };
        match knob {
            Knob::X | Knob::Y | Knob::Z | Knob::Ex | Knob::Ey | Knob::Ez => ends(position_range_m()),
            Knob::Yaw | Knob::Roll => ends(turn_range_deg()),
            Knob::Pitch => ends(pitch_range_deg()),
            Knob::Path | Knob::Mix => ends(share_range()),
            Knob::Rate => ends(rate_range_hz()),
            Knob::Gain => ends(gain_range_db()),
            Knob::Offset | Knob::Lead | Knob::Bypass => (0.0, 1.0),
            Knob::Follow => last_of::<Follow>(),
            Knob::Tracking => last_of::<TrackingChoice>(),
            Knob::Group => last_of::<GroupChoice>(),
            Knob::Tier => last_of::<TierChoice>(),
            Knob::Scene => last_of::<SceneChoice>(),
            Knob::Slot | Knob::Walk => (0.0, whole(SLOTS)),
        }
    }

    /// A parameter as it is heard: what came last, from the host or over Open Sound Control.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    #[must_use]
    pub fn heard(&self, knob: Knob) -> f32 {
        self.remote.latest(knob, self.hosted(knob))
    }

    /// The index of a choice, or a slot's number.
    fn index(&self, knob: Knob) -> usize {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small whole number")]
        let index = self.heard(knob).max(0.0) as usize;
        index
    }
}

/// A choice's index as a plain value.
fn choice<T: Enum + PartialEq + 'static>(param: &EnumParam<T>) -> f32 {
    whole(i32::try_from(param.value().to_index()).unwrap_or(0))
}

/// The index of a choice's last variant as the end of its range.
fn last_of<T: Enum + 'static>() -> (f32, f32) {
    (0.0, whole(i32::try_from(T::variants().len()).unwrap_or(1) - 1))
}

#[expect(clippy::cast_precision_loss, reason = "a count of choices or slots")]
fn whole(number: i32) -> f32 {
    number as f32
}

/// A state can set a value beyond the range, and a host what is no number; the value nearest to zero stands for that.
fn within(value: f32, range: FloatRange) -> f32 {
    match range {
        FloatRange::Linear { min, max } => (if value.is_finite() { value } else { 0.0 }).clamp(min, max),
        _ => 0.0,
    }
}

impl From<TrackingChoice> for Tracking {
    fn from(choice: TrackingChoice) -> Self {
        match choice {
            TrackingChoice::Off => Self::Off,
            TrackingChoice::Head => Self::Head,
            TrackingChoice::Pose => Self::Pose,
            TrackingChoice::Absolute => Self::Absolute,
        }
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
        assert_eq!(snapshot.sources.knobs, Pose::IDENTITY);
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
