//! Names the source of the listener's pose.

use super::ctx::Ctx;
use crate::listener::pose_sources::Base;
use crate::parameter::Parameter;
use crate::parameter::choices::{Follow, GroupChoice};
use nice_plug::prelude::Enum;

/// What moves the listener.
#[must_use]
pub fn description(ctx: &Ctx<'_>) -> String {
    let follow = Follow::from_index(ctx.index(Parameter::Follow));
    let group = GroupChoice::from_index(ctx.index(Parameter::Group));
    let path = match follow {
        Follow::Transport => "Camera path, transport",
        Follow::Position | Follow::Off => "Camera path, at its position",
    };
    let base = match ctx.frame.base {
        Base::Knobs if follow != Follow::Off => "Position and angles: no camera path".to_owned(),
        Base::Knobs => "Position and angles".to_owned(),
        Base::Path => path.to_owned(),
        Base::PathAndKnobs => format!("{path}, position and angles added"),
        Base::Tracker => "Head tracker alone".to_owned(),
        Base::Group => format!("Group {}, led by another instance", letter(group)),
    };
    let tracked = if ctx.frame.tracked && ctx.frame.base != Base::Tracker { " + tracker" } else { "" };
    let leads = if ctx.frame.leads { format!(", leads group {}", letter(group)) } else { String::new() };
    format!("{base}{tracked}{leads}")
}

/// Why the position and angle knobs are not in force; `None` where they are.
#[must_use]
pub fn reason(ctx: &Ctx<'_>) -> Option<&'static str> {
    match ctx.frame.base {
        Base::Knobs | Base::PathAndKnobs => None,
        Base::Path => Some("The camera path moves the listener; its own position waits"),
        Base::Tracker => Some("The head tracker moves the listener; its own position waits"),
        Base::Group => Some("The group's leader moves the listener; its own position waits"),
    }
}

fn letter(group: GroupChoice) -> &'static str {
    GroupChoice::variants().get(group.to_index()).copied().unwrap_or_default()
}
