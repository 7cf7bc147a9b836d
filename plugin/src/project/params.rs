//! Everything that a host sets or saves, and nothing else.

use crate::budget::limit::SavedLimit;
use crate::library::drawn_room::DrawnRoom;
use crate::library::scene_key::SceneKey;
use crate::library::slot_names;
use crate::parameter::cast::index;
use crate::parameter::choices::{Follow, GroupChoice, LatencyChoice, SceneChoice, TierChoice, Tracking};
use crate::parameter::remote::Remote;
use crate::parameter::source_knob::{KNOBS, Part, SourceKnob};
use crate::parameter::{Parameter, SLOTS};
use crate::project::matching::Matching;
use crate::project::osc_config::OscConfig;
use crate::project::persisted::Persisted;
use crate::project::saved_head::SavedHead;
use crate::project::saved_headphones::SavedHeadphones;
use crate::project::settings::EditorSettings;
use crate::project::source_walks::SavedSourceWalks;
use crate::project::state::StateVersion;
use crate::project::walk::SavedWalk;
use nice_plug::plugin::ParamValue;
use nice_plug::prelude::*;
use promenade_core::LiveParams;

/// The revision after which counting begins anew.
pub const REVISIONS: i32 = 9_999;

/// Everything a host can set or save. The ids never change; [`Parameter`] describes them, `docs/parameters.md` lists them.
#[derive(Params)]
#[expect(missing_docs, reason = "`Parameter` describes the parameters")]
pub struct PromenadeParams {
    #[id = "x"]
    pub x: FloatParam,
    #[id = "y"]
    pub y: FloatParam,
    #[id = "z"]
    pub z: FloatParam,
    #[id = "yaw"]
    pub yaw: FloatParam,
    #[id = "pitch"]
    pub pitch: FloatParam,
    #[id = "roll"]
    pub roll: FloatParam,
    #[id = "path"]
    pub path: FloatParam,
    #[id = "follow"]
    pub follow: EnumParam<Follow>,
    #[id = "offset"]
    pub offset: BoolParam,
    #[id = "tracking"]
    pub tracking: EnumParam<Tracking>,
    #[id = "ex"]
    pub ex: FloatParam,
    #[id = "ey"]
    pub ey: FloatParam,
    #[id = "ez"]
    pub ez: FloatParam,
    #[id = "spread"]
    pub spread: FloatParam,
    #[id = "group"]
    pub group: EnumParam<GroupChoice>,
    #[id = "lead"]
    pub lead: BoolParam,
    #[id = "tier"]
    pub tier: EnumParam<TierChoice>,
    #[id = "rate"]
    pub rate: FloatParam,
    #[id = "mix"]
    pub mix: FloatParam,
    #[id = "gain"]
    pub gain: FloatParam,
    #[id = "direct"]
    pub direct: FloatParam,
    #[id = "early"]
    pub early: FloatParam,
    #[id = "late"]
    pub late: FloatParam,
    #[id = "decay"]
    pub decay: FloatParam,
    #[id = "law"]
    pub law: FloatParam,
    #[id = "width"]
    pub width: FloatParam,
    #[id = "lowcut"]
    pub low_cut: FloatParam,
    #[id = "wetsolo"]
    pub wet_solo: BoolParam,
    #[id = "bypass"]
    pub bypass: BoolParam,
    #[id = "scene"]
    pub scene: EnumParam<SceneChoice>,
    #[id = "slot"]
    pub slot: IntParam,
    #[id = "walk"]
    pub walk: IntParam,
    #[id = "osc"]
    pub osc_on: BoolParam,
    #[id = "latency"]
    pub latency: EnumParam<LatencyChoice>,
    /// Counts what the editor changes beside the parameters, so that the host knows that the project has changed.
    #[id = "revision"]
    pub revision: IntParam,
    /// Of the further sources that the instance has, in the order of [`KNOBS`].
    sources: Vec<FloatParam>,
    /// The version of the saved state.
    #[persist = "version"]
    pub state_version: StateVersion,
    /// The library scene that the project plays.
    #[persist = "scene"]
    pub scene_key: Persisted<SceneKey>,
    /// The camera path of the project.
    #[persist = "walk"]
    pub saved_walk: Persisted<SavedWalk>,
    /// The paths of the sources.
    #[persist = "walks"]
    pub source_walks: Persisted<SavedSourceWalks>,
    /// The user's own head, where it takes the place of the scene's.
    #[persist = "head"]
    pub head: Persisted<SavedHead>,
    /// What the listener's headphones need.
    #[persist = "headphones"]
    pub headphones: Persisted<SavedHeadphones>,
    /// The room that the user has drawn, the project's own scene where there is one.
    #[persist = "room"]
    pub room: Persisted<Option<DrawnRoom>>,
    /// At which level scenes are played.
    #[persist = "matching"]
    pub matching: Persisted<Matching>,
    /// How Open Sound Control is set up.
    #[persist = "osc"]
    pub osc: Persisted<OscConfig>,
    /// Values that have come over Open Sound Control and stand in place of the host's; a restored state puts them into its
    /// parameters.
    #[persist = "remote"]
    pub remote: Remote,
    /// The budget of processor time, which all instances share.
    #[persist = "budget"]
    pub budget: SavedLimit,
    /// How the editor was left.
    #[persist = "editor"]
    pub editor: Persisted<EditorSettings>,
}

impl Default for PromenadeParams {
    fn default() -> Self {
        Self::beginning_on(None)
    }
}

impl PromenadeParams {
    /// Defaults; with a camera path, defaults that follow it along the transport.
    #[must_use]
    pub fn beginning_on(walk: Option<&SavedWalk>) -> Self {
        use Parameter::{
            Decay, Direct, Early, Ex, Ey, Ez, Gain, Late, Law, LowCut, Mix, Path, Pitch, Rate, Roll, Spread, Width, X, Y, Yaw,
            Z,
        };
        let metres = |name, parameter| float(name, 0.0, parameter, " m", 3);
        let degrees = |name, parameter| float(name, 0.0, parameter, " deg", 2);
        let decibels = |name, default, parameter| float(name, default, parameter, " dB", 2);
        let percent = |name, default, parameter| {
            float(name, default, parameter, " %", 2)
                .with_value_to_string(formatters::v2s_f32_percentage(2))
                .with_string_to_value(formatters::s2v_f32_percentage())
        };
        // The framework's own takes any other text for "off".
        let switch = |name| BoolParam::new(name, false).with_string_to_value(std::sync::Arc::new(switched));
        let slot = |name, kind| {
            IntParam::new(name, 0, IntRange::Linear { min: 0, max: SLOTS.into() })
                .with_value_to_string(std::sync::Arc::new(move |slot| slot_names::text(kind, slot)))
                .with_string_to_value(std::sync::Arc::new(move |text| slot_names::slot(kind, text)))
        };
        Self {
            x: metres("Listener X", X),
            y: metres("Listener Y", Y),
            z: metres("Listener Z", Z),
            yaw: degrees("Yaw", Yaw),
            pitch: degrees("Pitch", Pitch),
            roll: degrees("Roll", Roll),
            path: percent("Path Position", 0.0, Path),
            follow: EnumParam::new("Follow Path", if walk.is_some() { Follow::Transport } else { Follow::Off }),
            offset: switch("Path Offset"),
            tracking: EnumParam::new("Head Tracking", Tracking::Head),
            ex: metres("Emitter Offset X", Ex),
            ey: metres("Emitter Offset Y", Ey),
            ez: metres("Emitter Offset Z", Ez),
            spread: degrees("Stereo Spread", Spread),
            group: EnumParam::new("Listener Group", GroupChoice::Off),
            lead: switch("Lead Group"),
            tier: EnumParam::new("Tier", TierChoice::Standard),
            rate: float("Decode Rate", LiveParams::default().rate_hz, Rate, " Hz", 1),
            mix: percent("Dry/Wet", 1.0, Mix),
            gain: decibels("Output Gain", 0.0, Gain),
            direct: decibels("Direct Level", 0.0, Direct),
            early: decibels("Early Level", 0.0, Early),
            late: decibels("Late Level", 0.0, Late),
            decay: percent("Decay", 1.0, Decay),
            law: decibels("Distance Law", USUAL_LAW_DB, Law),
            width: percent("Room Width", 1.0, Width),
            low_cut: float("Low Cut", 0.0, LowCut, " Hz", 1),
            wet_solo: switch("Wet Solo"),
            bypass: switch("Bypass").make_bypass(),
            scene: EnumParam::new("Scene", SceneChoice::Library),
            slot: slot("Library Scene", slot_names::Kind::Scene),
            walk: slot("Library Path", slot_names::Kind::Walk),
            osc_on: switch("Open Sound Control"),
            latency: EnumParam::new("Latency", LatencyChoice::Frame),
            revision: IntParam::new("Revision", 0, IntRange::Linear { min: 0, max: REVISIONS }).hide().non_automatable(),
            sources: Vec::new(),
            state_version: StateVersion,
            scene_key: Persisted::new(SceneKey::loft()),
            saved_walk: Persisted::new(walk.cloned().unwrap_or_default()),
            source_walks: Persisted::default(),
            head: Persisted::default(),
            headphones: Persisted::default(),
            room: Persisted::default(),
            matching: Persisted::default(),
            osc: Persisted::default(),
            remote: Remote::default(),
            budget: SavedLimit,
            editor: Persisted::default(),
        }
    }
}

/// A parameter with a continuous range.
fn float(name: &str, default: f32, parameter: Parameter, unit: &'static str, digits: usize) -> FloatParam {
    FloatParam::new(name, default, parameter.range()).with_unit(unit).with_value_to_string(formatters::v2s_f32_rounded(digits))
}

/// A switch as hosts write it.
fn switched(text: &str) -> Option<bool> {
    let is = |words: [&str; 3]| words.iter().any(|word| text.eq_ignore_ascii_case(word));
    if is(["on", "true", "1"]) { Some(true) } else { is(["off", "false", "0"]).then_some(false) }
}

impl PromenadeParams {
    /// The same of an instance with so many further sources, at most
    /// [`MOST_FURTHER`](crate::parameter::source_knob::MOST_FURTHER).
    #[must_use]
    pub fn with_further(self, count: usize) -> Self {
        let of_source = |knob: &SourceKnob| {
            let (unit, digits) = if knob.part == Part::Level { (" dB", 2) } else { (" m", 3) };
            float(knob.name(), knob.default_value(), Parameter::Source(*knob), unit, digits)
        };
        Self { sources: KNOBS.iter().take(count * Part::ALL.len()).map(of_source).collect(), ..self }
    }

    /// The same with another latency, which it begins with.
    #[must_use]
    pub fn beginning_at(self, latency: LatencyChoice) -> Self {
        Self { latency: EnumParam::new("Latency", latency), ..self }
    }

    /// How many further sources the instance has.
    #[must_use]
    pub fn further(&self) -> usize {
        self.sources.len() / Part::ALL.len()
    }

    /// All parameters that the instance has, but the revision.
    pub fn parameters(&self) -> impl Iterator<Item = Parameter> + use<> {
        Parameter::of_instance(self.further())
    }

    /// Whether the instance has a parameter.
    #[must_use]
    pub fn has(&self, parameter: Parameter) -> bool {
        parameter.number() < Parameter::ALL.len() + self.sources.len()
    }

    /// A parameter of a further source that the instance has.
    #[must_use]
    pub fn of_source(&self, knob: SourceKnob) -> &FloatParam {
        &self.sources[knob.number()]
    }

    /// Ids of the parameters of further sources with what the framework knows them by.
    #[must_use]
    pub fn source_map(&self) -> Vec<(String, ParamPtr)> {
        KNOBS.iter().zip(&self.sources).map(|(knob, param)| (knob.id().to_owned(), param.as_ptr())).collect()
    }

    /// Whether the parameters choose the project's own scene, not a built-in one or a file of the library.
    #[must_use]
    pub fn chooses_own_scene(&self) -> bool {
        SceneChoice::from_index(self.index(Parameter::Scene)) == SceneChoice::Library && self.index(Parameter::Slot) == 0
    }

    /// How often a host has restored the parts of a state that say what is played and where the listener is. They come one
    /// after the other: a scene that changes between two of them was not chosen for itself.
    #[must_use]
    pub fn restores(&self) -> u64 {
        let Self { scene_key, room, head, matching, remote, .. } = self;
        scene_key.restores() + room.restores() + head.restores() + matching.restores() + remote.restores()
    }

    /// A parameter's plain value as the host has it.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    #[must_use]
    pub fn hosted(&self, parameter: Parameter) -> f32 {
        with_param!(self, parameter, param => param.plain())
    }

    /// A parameter's plain value as it is heard: what came last, from the host or over Open Sound Control.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    #[must_use]
    pub fn heard(&self, parameter: Parameter) -> f32 {
        self.remote.latest(parameter, self.hosted(parameter))
    }

    /// Whether Open Sound Control is switched on.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    #[must_use]
    pub fn receives_osc(&self) -> bool {
        self.heard(Parameter::Osc) > 0.5
    }

    /// The index of a choice, or a slot's number.
    pub(crate) fn index(&self, parameter: Parameter) -> usize {
        index(self.heard(parameter))
    }
}

/// What sound in the open loses each time the distance doubles, dB.
pub(crate) const USUAL_LAW_DB: f32 = 6.0;

/// Does something with a parameter's field, whatever its type.
macro_rules! with_param {
    ($params:expr, $parameter:expr, $param:ident => $body:expr) => {
        $crate::project::params::with_param!($params, $parameter, $param => $body;
            X x, Y y, Z z, Yaw yaw, Pitch pitch, Roll roll, Path path, Follow follow, Offset offset, Tracking tracking,
            Ex ex, Ey ey, Ez ez, Spread spread,
            Group group, Lead lead, Tier tier, Rate rate, Mix mix, Gain gain, Direct direct, Early early,
            Late late, Decay decay, Law law, Width width, LowCut low_cut, WetSolo wet_solo, Bypass bypass,
            Scene scene, Slot slot, Walk walk, Osc osc_on, Latency latency)
    };
    ($params:expr, $parameter:expr, $param:ident => $body:expr; $($variant:ident $field:ident),*) => {
        match $parameter {
            $($crate::parameter::Parameter::$variant => {
                let $param = &$params.$field;
                $body
            })*
            $crate::parameter::Parameter::Source(knob) => {
                let $param = $params.of_source(knob);
                $body
            }
        }
    };
}
pub(crate) use with_param;

/// Plain values of every kind of parameter as `f32`.
pub(crate) trait PlainValue: Param {
    /// A value of the parameter's own type.
    fn to_plain(&self, value: Self::Plain) -> f32;

    /// The host's value.
    fn plain(&self) -> f32 {
        self.to_plain(self.modulated_plain_value())
    }

    /// The value that the host has when it is set to a share of the range.
    fn plain_at(&self, share: f32) -> f32 {
        self.to_plain(self.preview_plain(share))
    }

    /// How the framework saves it in a state when it is set to a share of the range.
    fn saved_at(&self, share: f32) -> ParamValue;
}

impl PlainValue for FloatParam {
    fn to_plain(&self, value: f32) -> f32 {
        within(value, self.range())
    }

    fn saved_at(&self, share: f32) -> ParamValue {
        ParamValue::F32(self.preview_plain(share))
    }
}

impl PlainValue for IntParam {
    fn to_plain(&self, value: i32) -> f32 {
        value as f32
    }

    fn saved_at(&self, share: f32) -> ParamValue {
        ParamValue::I32(self.preview_plain(share))
    }
}

impl PlainValue for BoolParam {
    fn to_plain(&self, value: bool) -> f32 {
        f32::from(u8::from(value))
    }

    fn saved_at(&self, share: f32) -> ParamValue {
        ParamValue::Bool(self.preview_plain(share))
    }
}

impl<T: Enum + PartialEq + 'static> PlainValue for EnumParam<T> {
    fn to_plain(&self, value: T) -> f32 {
        value.to_index() as f32
    }

    fn saved_at(&self, share: f32) -> ParamValue {
        let index = self.preview_plain(share).to_index();
        let id = T::ids().and_then(|ids| ids.get(index));
        id.map_or(ParamValue::I32(i32::try_from(index).unwrap_or(0)), |id| ParamValue::String((*id).to_owned()))
    }
}

/// A state can set a value beyond the range, and a host what is no number; the value nearest to zero stands for that.
fn within(value: f32, range: FloatRange) -> f32 {
    match range {
        FloatRange::Linear { min, max } => (if value.is_finite() { value } else { 0.0 }).clamp(min, max),
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_kept_within_its_range() {
        assert_eq!(within(1e30, Parameter::X.range()), 50.0);
        assert_eq!(within(-2.5, Parameter::X.range()), -2.5);
        assert_eq!(within(f32::NAN, Parameter::Gain.range()), 0.0);
    }
}
