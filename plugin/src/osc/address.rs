//! This plugin's own addresses: `/promenade/...` for all instances, `/promenade/<name>/...` for those of a name.

use crate::tracker::axes::AxisMap;
use crate::tracker::reading::{Argument, Unit};

const ROOT: &str = "/promenade/";
const SAME: AxisMap = AxisMap::IDENTITY;

/// What the first part of an address may be. A name like one of these cannot be addressed.
pub const KEYWORDS: [&str; 12] =
    ["pose", "position", "ypr", "quaternion", "xyzypr", "recenter", "path", "head", "headphones", "room", "budget", "param"];

/// What an address asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verb<'a> {
    /// A pose, or part of one.
    Track(&'static [Argument]),
    /// The tracker's origin.
    Recenter,
    /// The path parameter, 0 to 1.
    Path,
    /// The head, by a SOFA file.
    Head,
    /// What headphones need, by a file.
    Headphones,
    /// A part of the drawn room.
    Room(RoomPart),
    /// The budget of processor time.
    Budget,
    /// The parameter of this id.
    Param(&'a str),
}

/// What of a drawn room is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RoomPart {
    /// Three lengths.
    Size,
    /// Where the emitter is.
    Emitter,
    /// Six materials.
    Materials,
}

/// Whom an address means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Addressee<'a> {
    /// Every instance.
    All,
    /// Those of this name.
    Named(&'a str),
    /// Those that have a name.
    AnyName,
}

impl Addressee<'_> {
    /// Whether an instance of this name is meant; it has none if it is empty.
    pub(super) fn means(self, name: &str) -> bool {
        match self {
            Self::All => true,
            Self::Named(wanted) => wanted == name,
            Self::AnyName => !name.is_empty(),
        }
    }
}

/// Whom an address of this plugin's means, and what it asks for. Keywords go before names.
pub(super) fn parse(address: &str) -> Option<(Addressee<'_>, Verb<'_>)> {
    let after = address.strip_prefix(ROOT)?;
    if let Some(verb) = verb(after) {
        return Some((Addressee::All, verb));
    }
    let (name, after) = after.split_once('/')?;
    let addressee = match name {
        "*" => Addressee::AnyName,
        _ if name.is_empty() || KEYWORDS.contains(&name) => return None,
        _ => Addressee::Named(name),
    };
    Some((addressee, verb(after)?))
}

fn verb(text: &str) -> Option<Verb<'_>> {
    let track = |arguments| Some(Verb::Track(arguments));
    match text {
        "pose" => track(&[Argument::Position(SAME), Argument::Quaternion(SAME)]),
        "position" => track(&[Argument::Position(SAME)]),
        "ypr" => track(&[Argument::Angles(Unit::Degrees, SAME)]),
        "quaternion" => track(&[Argument::Quaternion(SAME)]),
        "xyzypr" => track(&[Argument::Position(SAME), Argument::Angles(Unit::Degrees, SAME)]),
        "recenter" => Some(Verb::Recenter),
        "path" => Some(Verb::Path),
        "head" => Some(Verb::Head),
        "headphones" => Some(Verb::Headphones),
        "budget" => Some(Verb::Budget),
        "room/size" => Some(Verb::Room(RoomPart::Size)),
        "room/emitter" => Some(Verb::Room(RoomPart::Emitter)),
        "room/materials" => Some(Verb::Room(RoomPart::Materials)),
        _ => text.strip_prefix("param/").filter(|id| !id.is_empty() && !id.contains('/')).map(Verb::Param),
    }
}

/// The address of a pose for the instances of a name, or for all without one.
pub(super) fn of_pose(name: &str) -> String {
    if name.is_empty() || KEYWORDS.contains(&name) { format!("{ROOT}pose") } else { format!("{ROOT}{name}/pose") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keywords_go_before_names() {
        let of = |address| parse(address).map(|(addressee, _)| addressee);
        assert_eq!(of("/promenade/ypr"), Some(Addressee::All));
        assert_eq!(of("/promenade/Lead/ypr"), Some(Addressee::Named("Lead")));
        assert_eq!(of("/promenade/*/ypr"), Some(Addressee::AnyName));
        assert_eq!(parse("/promenade/param/gain"), Some((Addressee::All, Verb::Param("gain"))));
        assert_eq!(parse("/promenade/Lead/param/gain"), Some((Addressee::Named("Lead"), Verb::Param("gain"))));
        // An instance called "param" would be asked for its yaw, pitch and roll: the keyword has it.
        assert_eq!(parse("/promenade/param/ypr"), Some((Addressee::All, Verb::Param("ypr"))));
        for keyword in KEYWORDS {
            assert_eq!(
                parse(&format!("/promenade/{keyword}/quaternion")).map(|(to, _)| to == Addressee::All),
                (keyword == "param").then_some(true),
                "{keyword}"
            );
        }
        for nothing in [
            "/promenade",
            "/promenade/",
            "/promenade//ypr",
            "/promenade/Lead",
            "/promenade/Lead/",
            "/promenade/a/b/ypr",
            "/promenade/param/",
            "/promenade/param",
            "/promenade/param/a/b",
            "/other/ypr",
            "/promenade/Lead/fly",
        ] {
            assert_eq!(parse(nothing), None, "{nothing}");
        }
    }

    #[test]
    fn a_name_means_the_instances_that_have_it() {
        assert!(Addressee::All.means("") && Addressee::All.means("Lead"));
        assert!(Addressee::Named("Lead").means("Lead") && !Addressee::Named("Lead").means("lead"));
        assert!(Addressee::AnyName.means("Lead") && !Addressee::AnyName.means(""));
    }

    #[test]
    fn every_keyword_is_one_of_an_address() {
        for keyword in KEYWORDS {
            let more = match keyword {
                "param" => "/gain",
                "room" => "/size",
                _ => "",
            };
            let address = format!("/promenade/{keyword}{more}");
            assert!(parse(&address).is_some(), "{address}");
        }
        assert_eq!(of_pose(""), "/promenade/pose");
        assert_eq!(of_pose("path"), "/promenade/pose");
        assert!(matches!(parse(&of_pose("Lead")), Some((Addressee::Named("Lead"), Verb::Track(_)))));
    }
}
