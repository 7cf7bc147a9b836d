//! A head tracker that no format names: an address of the user's, and what is sent there.

use crate::parameter::table::table;
use crate::tracker::axes::AxisMap;
use crate::tracker::reading::{Argument, Unit};
use serde::{Deserialize, Serialize};

use Argument::{Angles, Position, Quaternion, QuaternionLast};

const SAME: AxisMap = AxisMap::IDENTITY;
const ANGLES: Argument = Angles(Unit::Degrees, SAME);

// The title as users read it, and the arguments one after the other, as formats list them.
table! {
    /// What the arguments of a custom address are.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum CustomArguments: (&'static str, &'static [Argument]) {
        /// Yaw, pitch and roll in degrees, positive to the left, nose up and right ear down.
        #[default]
        YprDegrees = ("Yaw, pitch, roll in degrees", &[ANGLES]),
        /// Yaw, pitch and roll in radians, positive to the left, nose up and right ear down.
        YprRadians = ("Yaw, pitch, roll in radians", &[Angles(Unit::Radians, SAME)]),
        /// w, x, y, z; x forward, y left, z up.
        QuaternionWxyz = ("Quaternion w, x, y, z", &[Quaternion(SAME)]),
        /// x, y, z, w; x forward, y left, z up.
        QuaternionXyzw = ("Quaternion x, y, z, w", &[QuaternionLast(SAME)]),
        /// x, y, z in metres; x forward, y left, z up.
        Position = ("Position x, y, z in metres", &[Position(SAME)]),
        /// x, y, z in metres, then w, x, y, z.
        Pose = ("Position, quaternion w, x, y, z", &[Position(SAME), Quaternion(SAME)]),
        /// x, y, z in metres, then yaw, pitch and roll in degrees.
        PositionYpr = ("Position, yaw, pitch, roll in degrees", &[Position(SAME), ANGLES]),
    }
}

impl CustomArguments {
    /// As users read it.
    pub fn title(self) -> &'static str {
        self.row().0
    }

    pub(crate) fn arguments(self) -> &'static [Argument] {
        self.row().1
    }
}

/// A tracker that no format names, as the user describes it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct CustomTracker {
    /// Its address; a part that is `*` stands for any part.
    pub address: String,
    /// What it sends there.
    pub arguments: CustomArguments,
}

impl Default for CustomTracker {
    fn default() -> Self {
        Self { address: "/head/ypr".to_owned(), arguments: CustomArguments::default() }
    }
}

impl CustomTracker {
    /// The arguments of an address, if it is this tracker's.
    pub(crate) fn arguments(&self, address: &str) -> Option<&'static [Argument]> {
        matches(&self.address, address).then(|| self.arguments.arguments())
    }
}

/// Whether an address is one of a pattern, in which a part that is `*` stands for any part.
fn matches(pattern: &str, address: &str) -> bool {
    let (mut wanted, mut found) = (pattern.trim_end_matches('/').split('/'), address.split('/'));
    loop {
        match (wanted.next(), found.next()) {
            (None, None) => return true,
            (Some(part), Some(of)) if part == of || part == "*" => (),
            _ => return false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_stands_for_one_part() {
        assert!(matches("/*/quaternion", "/8f3a/quaternion"));
        assert!(matches("/head/ypr/", "/head/ypr"));
        for (pattern, address) in [
            ("/*/quaternion", "/a/b/quaternion"),
            ("/*/quaternion", "/quaternion"),
            ("/head", "/head/ypr"),
            ("/head/ypr", "/head"),
            ("", "/head"),
        ] {
            assert!(!matches(pattern, address), "{pattern} {address}");
        }
    }
}
