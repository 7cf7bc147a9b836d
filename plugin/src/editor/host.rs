//! The host's parameters by [`Parameter`]; the framework addresses them by type.

use super::gesture::Automation;
use crate::parameter::Parameter;
use crate::project::params::PromenadeParams;
use nice_plug::prelude::ParamSetter;
use std::sync::Weak;

/// The host, as the editor writes to it.
pub struct Host<'a> {
    /// The instance's parameters.
    pub params: &'a PromenadeParams,
    /// The framework's access to the host.
    pub setter: ParamSetter<'a>,
    /// Whether the host still holds the plugin: the framework cannot reach one that has let go of it with its editor open.
    pub plugin: &'a Weak<()>,
}

/// The plain value that the host has when it is set to `plain`.
pub fn landed(params: &PromenadeParams, parameter: Parameter, plain: f32) -> f32 {
    params.of(parameter).plain_at(parameter.normalized(plain))
}

/// The default of a parameter, as a plain value.
pub fn default_value(params: &PromenadeParams, parameter: Parameter) -> f32 {
    let (least, greatest) = parameter.limits();
    least + params.of(parameter).default_share() * (greatest - least)
}

/// The name of a choice's variant, or a value with its unit, as hosts show it.
pub fn text(params: &PromenadeParams, parameter: Parameter, plain: f32) -> String {
    params.of(parameter).text(parameter.normalized(plain))
}

impl Host<'_> {
    fn is_there(&self) -> bool {
        self.plugin.strong_count() > 0
    }
}

impl Automation for Host<'_> {
    fn begin(&self, parameter: Parameter) {
        if self.is_there() {
            self.params.of(parameter).begin(&self.setter);
        }
    }

    fn set(&self, parameter: Parameter, plain: f32) {
        if self.is_there() {
            self.params.of(parameter).set(&self.setter, parameter.normalized(plain));
        }
    }

    fn end(&self, parameter: Parameter) {
        if self.is_there() {
            self.params.of(parameter).end(&self.setter);
        }
    }
}

impl Host<'_> {
    /// Reports to the host that the project has changed beside the parameters; otherwise it would not be saved.
    pub fn touch(&self) {
        if !self.is_there() {
            return;
        }
        let revision = &self.params.revision;
        let next = (revision.value() + 1) % (crate::project::params::REVISIONS + 1);
        self.setter.begin_set_parameter(revision);
        self.setter.set_parameter(revision, next);
        self.setter.end_set_parameter(revision);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::source_knob::MOST_FURTHER;

    #[test]
    fn values_are_shares_of_the_range_as_the_framework_counts_them() {
        let params = PromenadeParams::default().with_further(MOST_FURTHER);
        for parameter in Parameter::EVERY {
            let (least, greatest) = parameter.limits();
            for plain in [least, greatest, (least + (greatest - least) * 0.25).round()] {
                let share = parameter.normalized(plain);
                // Choices and switches count in steps, the rest in their own unit.
                let back = landed(&params, parameter, plain);
                let same = (parameter.normalized(back) - share).abs() < 1e-6;
                assert!(same, "{}: {plain} is {share}, the framework has {back}", parameter.id());
            }
        }
        assert_eq!(text(&params, Parameter::Latency, 2.0), "None");
        assert_eq!(text(&params, Parameter::Yaw, -90.0), "-90.00 deg");
        assert_eq!(default_value(&params, Parameter::Rate).round(), 40.0);
        assert_eq!(default_value(&params, Parameter::Scene), 2.0);
    }
}
