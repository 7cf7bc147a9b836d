//! The parameters as the framework holds them, which addresses them by type.

use crate::parameter::Parameter;
use crate::parameter::choices::{
    AccuracyChoice, Choice, Follow as FollowChoice, GroupChoice, LatencyChoice, PlaceChoice, SceneChoice,
    Tracking as TrackingChoice,
};
use crate::parameter::row::{SLOTS, Unit, Values};
use crate::parameter::text;
use crate::project::slots::ProjectSlots;
use nice_plug::prelude::*;
use std::sync::Arc;

/// A parameter of the framework.
pub(crate) enum Hosted {
    Number(FloatParam),
    Switch(BoolParam),
    Slot(IntParam),
    Follow(EnumParam<FollowChoice>),
    Place(EnumParam<PlaceChoice>),
    Tracking(EnumParam<TrackingChoice>),
    Group(EnumParam<GroupChoice>),
    Latency(EnumParam<LatencyChoice>),
    Accuracy(EnumParam<AccuracyChoice>),
    Scene(EnumParam<SceneChoice>),
}

/// Does something with the framework's parameter, whatever its type.
macro_rules! with_param {
    ($hosted:expr, $param:ident => $body:expr) => {
        match $hosted {
            Self::Number($param) => $body,
            Self::Switch($param) => $body,
            Self::Slot($param) => $body,
            Self::Follow($param) => $body,
            Self::Place($param) => $body,
            Self::Tracking($param) => $body,
            Self::Group($param) => $body,
            Self::Latency($param) => $body,
            Self::Accuracy($param) => $body,
            Self::Scene($param) => $body,
        }
    };
}

impl Hosted {
    /// That of a row of the table, with a plain value to begin with, in a project with these slots.
    pub(super) fn new(parameter: Parameter, default: f32, slots: &ProjectSlots) -> Self {
        fn choice<T: Enum + PartialEq + 'static>(name: &str, default: f32) -> EnumParam<T> {
            EnumParam::new(name, T::from_index(crate::parameter::cast::index(default)))
        }
        let row = parameter.row();
        match row.values {
            Values::Number(unit, ..) => {
                let written = match unit {
                    Unit::Share => formatters::v2s_f32_percentage(unit.digits()),
                    _ => formatters::v2s_f32_rounded(unit.digits()),
                };
                let param = FloatParam::new(row.name, default, parameter.range()).with_unit(unit.suffix());
                let read = Arc::new(move |typed: &str| text::number(row.values, typed));
                Self::Number(param.with_value_to_string(written).with_string_to_value(read))
            }
            Values::Switch => {
                // The framework's own takes any other text for "off".
                let param = BoolParam::new(row.name, default > 0.5).with_string_to_value(Arc::new(switched));
                Self::Switch(if parameter == Parameter::Bypass { param.make_bypass() } else { param })
            }
            Values::Slot(kind) => {
                let [to_text, from_text] = [slots.clone(), slots.clone()];
                Self::Slot(
                    IntParam::new(row.name, 0, IntRange::Linear { min: 0, max: SLOTS.into() })
                        .with_value_to_string(Arc::new(move |slot| to_text.text(kind, slot)))
                        .with_string_to_value(Arc::new(move |text| from_text.slot_named(kind, text))),
                )
            }
            Values::Choice(Choice::Follow) => Self::Follow(choice(row.name, default)),
            Values::Choice(Choice::Place) => Self::Place(choice(row.name, default)),
            Values::Choice(Choice::Tracking) => Self::Tracking(choice(row.name, default)),
            Values::Choice(Choice::Group) => Self::Group(choice(row.name, default)),
            Values::Choice(Choice::Latency) => Self::Latency(choice(row.name, default)),
            Values::Choice(Choice::Accuracy) => Self::Accuracy(choice(row.name, default)),
            Values::Choice(Choice::Scene) => Self::Scene(choice(row.name, default)),
        }
    }

    /// The host's plain value.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(super) fn plain(&self) -> f32 {
        with_param!(self, param => param.to_plain(param.modulated_plain_value()))
    }

    /// The plain value that the host has when it is set to a share of the range.
    pub(crate) fn plain_at(&self, share: f32) -> f32 {
        with_param!(self, param => param.to_plain(param.preview_plain(share)))
    }

    /// The share of the range that the host has when it is set to another: where that lies between two steps, the nearer.
    pub(super) fn landed(&self, share: f32) -> f32 {
        with_param!(self, param => param.preview_normalized(param.preview_plain(share)))
    }

    /// Shares of the range without and with what modulates it.
    #[cfg(test)]
    pub(super) fn shares(&self) -> [f32; 2] {
        with_param!(self, param => [param.unmodulated_normalized_value(), param.modulated_normalized_value()])
    }

    /// The default as a share of the range.
    pub(crate) fn default_share(&self) -> f32 {
        with_param!(self, param => param.default_normalized_value())
    }

    /// A share of the range as hosts show it, with its unit.
    pub(crate) fn text(&self, share: f32) -> String {
        with_param!(self, param => param.normalized_value_to_string(share, true))
    }

    /// What the framework knows it by.
    pub(crate) fn as_ptr(&self) -> ParamPtr {
        with_param!(self, param => param.as_ptr())
    }

    /// Puts it onto a page of knobs.
    pub(crate) fn put_onto(&self, page: &mut impl RemoteControlsPage) {
        with_param!(self, param => page.add_param(param));
    }

    /// Begins a gesture.
    pub(crate) fn begin(&self, setter: &ParamSetter<'_>) {
        with_param!(self, param => setter.begin_set_parameter(param));
    }

    /// Sets a share of the range within a gesture.
    pub(crate) fn set(&self, setter: &ParamSetter<'_>, share: f32) {
        with_param!(self, param => setter.set_parameter_normalized(param, share));
    }

    /// Ends a gesture.
    pub(crate) fn end(&self, setter: &ParamSetter<'_>) {
        with_param!(self, param => setter.end_set_parameter(param));
    }
}

/// A switch as hosts write it.
fn switched(text: &str) -> Option<bool> {
    let is = |words: [&str; 3]| words.iter().any(|word| text.eq_ignore_ascii_case(word));
    if is(["on", "true", "1"]) { Some(true) } else { is(["off", "false", "0"]).then_some(false) }
}

/// Values of the framework's types as plain numbers.
trait Plain: Param {
    fn to_plain(&self, value: Self::Plain) -> f32;
}

impl Plain for FloatParam {
    fn to_plain(&self, value: f32) -> f32 {
        within(value, self.range())
    }
}

impl Plain for IntParam {
    fn to_plain(&self, value: i32) -> f32 {
        value as f32
    }
}

impl Plain for BoolParam {
    fn to_plain(&self, value: bool) -> f32 {
        f32::from(u8::from(value))
    }
}

impl<T: Enum + PartialEq + 'static> Plain for EnumParam<T> {
    fn to_plain(&self, value: T) -> f32 {
        value.to_index() as f32
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
