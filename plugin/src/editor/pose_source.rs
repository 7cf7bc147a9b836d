//! Names the source of the listener's pose.

use super::ctx::Ctx;
use crate::listener::pose_sources::Base;
use crate::parameter::Parameter;
use crate::parameter::choices::{Follow, GroupChoice};
use crate::telemetry::Frame;
use nice_plug::prelude::Enum;

/// What moves the listener.
pub fn description(ctx: &Ctx<'_>) -> String {
    let follow = Follow::from_index(ctx.index(Parameter::Follow));
    described(ctx.frame, follow, GroupChoice::from_index(ctx.index(Parameter::Group)))
}

fn described(frame: &Frame, follow: Follow, group: GroupChoice) -> String {
    let path = match follow {
        Follow::Transport => "Camera path, transport",
        Follow::Position | Follow::Off => "Camera path, at its position",
    };
    let base = match frame.base {
        Base::Knobs if follow != Follow::Off => "Position and angles: no camera path".to_owned(),
        Base::Knobs => "Position and angles".to_owned(),
        Base::Path => path.to_owned(),
        Base::PathAndKnobs => format!("{path}, position and angles added"),
        Base::Tracker => "Head tracker alone".to_owned(),
        Base::Group => format!("Group {}, led by another instance", letter(group)),
        Base::SavedLeader => "Its leader as it was saved".to_owned(),
    };
    let tracked = if frame.tracked && frame.base != Base::Tracker { " + tracker" } else { "" };
    let leads = if frame.leads { format!(", leads group {}", letter(group)) } else { String::new() };
    // As where it is frozen or bounced alone.
    let alone = group != GroupChoice::Off && !frame.leads && frame.base != Base::Group;
    let alone = if alone { format!("Group {} has no leader here. ", letter(group)) } else { String::new() };
    format!("{alone}{base}{tracked}{leads}")
}

/// Why the position and angle knobs are not in force; `None` where they are.
pub fn reason(ctx: &Ctx<'_>) -> Option<&'static str> {
    match ctx.frame.base {
        Base::Knobs | Base::PathAndKnobs => None,
        Base::Path => Some("The camera path moves the listener; its own position waits"),
        Base::Tracker => Some("The head tracker moves the listener; its own position waits"),
        Base::Group | Base::SavedLeader => Some("The group's leader moves the listener; its own position waits"),
    }
}

fn letter(group: GroupChoice) -> &'static str {
    GroupChoice::variants().get(group.to_index()).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_follower_without_a_leader_says_so() {
        let words = |base, leads, group| described(&Frame { base, leads, ..Frame::default() }, Follow::Off, group);
        assert_eq!(words(Base::Knobs, false, GroupChoice::A), "Group A has no leader here. Position and angles");
        let saved = words(Base::SavedLeader, false, GroupChoice::A);
        assert_eq!(saved, "Group A has no leader here. Its leader as it was saved");
        assert_eq!(words(Base::Group, false, GroupChoice::A), "Group A, led by another instance");
        assert_eq!(words(Base::Knobs, true, GroupChoice::A), "Position and angles, leads group A");
        assert_eq!(words(Base::Knobs, false, GroupChoice::Off), "Position and angles");
    }
}
