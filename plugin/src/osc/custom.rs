//! A head tracker that no format names: an address of the user's, and what is sent there.

use super::axes::AxisMap;
use super::reading::{Argument, Unit};
use serde::{Deserialize, Serialize};

/// What the arguments of a custom address are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CustomArguments {
    /// Yaw, pitch and roll in degrees, positive to the left, nose up and right ear down.
    #[default]
    YprDegrees,
    /// The same in radians.
    YprRadians,
    /// w, x, y, z; x forward, y left, z up.
    QuaternionWxyz,
    /// x, y, z, w; x forward, y left, z up.
    QuaternionXyzw,
    /// x, y, z in metres; x forward, y left, z up.
    Position,
    /// x, y, z in metres, then w, x, y, z.
    Pose,
    /// x, y, z in metres, then yaw, pitch and roll in degrees.
    PositionYpr,
}

impl CustomArguments {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::YprDegrees,
        Self::YprRadians,
        Self::QuaternionWxyz,
        Self::QuaternionXyzw,
        Self::Position,
        Self::Pose,
        Self::PositionYpr,
    ];

    /// As users read it.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::YprDegrees => "Yaw, pitch, roll in degrees",
            Self::YprRadians => "Yaw, pitch, roll in radians",
            Self::QuaternionWxyz => "Quaternion w, x, y, z",
            Self::QuaternionXyzw => "Quaternion x, y, z, w",
            Self::Position => "Position x, y, z in metres",
            Self::Pose => "Position, quaternion w, x, y, z",
            Self::PositionYpr => "Position, yaw, pitch, roll in degrees",
        }
    }

    /// One after the other, as formats list them.
    pub(super) fn arguments(self) -> &'static [Argument] {
        use Argument::{Angles, Position, Quaternion, QuaternionLast};
        const SAME: AxisMap = AxisMap::IDENTITY;
        const ANGLES: Argument = Angles(Unit::Degrees, SAME);
        match self {
            Self::YprDegrees => &[ANGLES],
            Self::YprRadians => &[Angles(Unit::Radians, SAME)],
            Self::QuaternionWxyz => &[Quaternion(SAME)],
            Self::QuaternionXyzw => &[QuaternionLast(SAME)],
            Self::Position => &[Position(SAME)],
            Self::Pose => &[Position(SAME), Quaternion(SAME)],
            Self::PositionYpr => &[Position(SAME), ANGLES],
        }
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
    pub(super) fn arguments(&self, address: &str) -> Option<&'static [Argument]> {
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
