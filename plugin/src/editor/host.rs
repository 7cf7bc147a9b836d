//! The host's parameters by [`Knob`]: what the framework addresses by type.

use super::gesture::Automation;
use crate::params::PromenadeParams;
use crate::remote::Knob;
use nice_plug::prelude::{Param, ParamSetter};

/// Does something with the parameter of a knob, whatever its type.
macro_rules! with_param {
    ($params:expr, $knob:expr, $param:ident => $body:expr) => {
        match $knob {
            Knob::X => {
                let $param = &$params.x;
                $body
            }
            Knob::Y => {
                let $param = &$params.y;
                $body
            }
            Knob::Z => {
                let $param = &$params.z;
                $body
            }
            Knob::Yaw => {
                let $param = &$params.yaw;
                $body
            }
            Knob::Pitch => {
                let $param = &$params.pitch;
                $body
            }
            Knob::Roll => {
                let $param = &$params.roll;
                $body
            }
            Knob::Path => {
                let $param = &$params.path;
                $body
            }
            Knob::Follow => {
                let $param = &$params.follow;
                $body
            }
            Knob::Offset => {
                let $param = &$params.offset;
                $body
            }
            Knob::Tracking => {
                let $param = &$params.tracking;
                $body
            }
            Knob::Ex => {
                let $param = &$params.ex;
                $body
            }
            Knob::Ey => {
                let $param = &$params.ey;
                $body
            }
            Knob::Ez => {
                let $param = &$params.ez;
                $body
            }
            Knob::Group => {
                let $param = &$params.group;
                $body
            }
            Knob::Lead => {
                let $param = &$params.lead;
                $body
            }
            Knob::Tier => {
                let $param = &$params.tier;
                $body
            }
            Knob::Rate => {
                let $param = &$params.rate;
                $body
            }
            Knob::Mix => {
                let $param = &$params.mix;
                $body
            }
            Knob::Gain => {
                let $param = &$params.gain;
                $body
            }
            Knob::Bypass => {
                let $param = &$params.bypass;
                $body
            }
            Knob::Scene => {
                let $param = &$params.scene;
                $body
            }
            Knob::Slot => {
                let $param = &$params.slot;
                $body
            }
            Knob::Walk => {
                let $param = &$params.walk;
                $body
            }
        }
    };
}

/// The host, as the editor writes to it.
pub struct Host<'a> {
    /// The instance's parameters.
    pub params: &'a PromenadeParams,
    /// The framework's way to the host.
    pub setter: ParamSetter<'a>,
}

/// A plain value as a share of the parameter's range.
#[must_use]
pub fn normalized(knob: Knob, plain: f32) -> f32 {
    let (least, greatest) = PromenadeParams::limits(knob);
    if greatest > least { ((plain - least) / (greatest - least)).clamp(0.0, 1.0) } else { 0.0 }
}

/// The plain value that the host has when it is told `plain`.
#[must_use]
pub fn landed(params: &PromenadeParams, knob: Knob, plain: f32) -> f32 {
    let share = normalized(knob, plain);
    let (least, greatest) = PromenadeParams::limits(knob);
    match knob {
        Knob::X => params.x.preview_plain(share),
        Knob::Y => params.y.preview_plain(share),
        Knob::Z => params.z.preview_plain(share),
        Knob::Yaw => params.yaw.preview_plain(share),
        Knob::Pitch => params.pitch.preview_plain(share),
        Knob::Roll => params.roll.preview_plain(share),
        Knob::Path => params.path.preview_plain(share),
        Knob::Ex => params.ex.preview_plain(share),
        Knob::Ey => params.ey.preview_plain(share),
        Knob::Ez => params.ez.preview_plain(share),
        Knob::Rate => params.rate.preview_plain(share),
        Knob::Mix => params.mix.preview_plain(share),
        Knob::Gain => params.gain.preview_plain(share),
        // Choices and switches are whole.
        _ => (least + share * (greatest - least)).round(),
    }
}

/// The plain value of a parameter as it comes.
#[must_use]
pub fn default_value(params: &PromenadeParams, knob: Knob) -> f32 {
    let (least, greatest) = PromenadeParams::limits(knob);
    with_param!(params, knob, param => least + param.default_normalized_value() * (greatest - least))
}

/// The parameter's name as hosts show it.
#[must_use]
pub fn name(params: &PromenadeParams, knob: Knob) -> &str {
    with_param!(params, knob, param => param.name())
}

/// The name of a choice's variant, or a value with its unit, as hosts show it.
#[must_use]
pub fn text(params: &PromenadeParams, knob: Knob, plain: f32) -> String {
    with_param!(params, knob, param => param.normalized_value_to_string(normalized(knob, plain), true))
}

impl Automation for Host<'_> {
    fn begin(&self, knob: Knob) {
        with_param!(self.params, knob, param => self.setter.begin_set_parameter(param));
    }

    fn set(&self, knob: Knob, plain: f32) {
        let share = normalized(knob, plain);
        with_param!(self.params, knob, param => self.setter.set_parameter_normalized(param, share));
    }

    fn end(&self, knob: Knob) {
        with_param!(self.params, knob, param => self.setter.end_set_parameter(param));
    }
}

impl Host<'_> {
    /// Tells the host that the project has changed beside the parameters: by itself it would not be saved.
    pub fn touch(&self) {
        let revision = &self.params.revision;
        let next = (revision.value() + 1) % (crate::params::REVISIONS + 1);
        self.setter.begin_set_parameter(revision);
        self.setter.set_parameter(revision, next);
        self.setter.end_set_parameter(revision);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_shares_of_the_range_as_the_framework_counts_them() {
        let params = PromenadeParams::default();
        for knob in Knob::ALL {
            let (least, greatest) = PromenadeParams::limits(knob);
            for plain in [least, greatest, (least + (greatest - least) * 0.25).round()] {
                let share = normalized(knob, plain);
                // Choices and switches count in steps, the rest in their own unit.
                let back = with_param!(params, knob, param => param.preview_normalized(param.preview_plain(share)));
                assert!((back - share).abs() < 1e-6, "{}: {plain} is {share}, the framework says {back}", knob.id());
            }
            assert!(!name(&params, knob).is_empty());
        }
        assert_eq!(text(&params, Knob::Tier, 2.0), "High");
        assert_eq!(text(&params, Knob::Yaw, -90.0), "-90.00 deg");
        assert_eq!(default_value(&params, Knob::Rate).round(), 40.0);
        assert_eq!(default_value(&params, Knob::Tier), 1.0);
    }
}
