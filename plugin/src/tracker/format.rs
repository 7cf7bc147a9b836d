//! Formats of head trackers: the addresses of each, their arguments, and which way these count.
//!
//! The sources of each convention are in `docs/osc.md`, whose tables a test compares with this file.

use crate::parameter::table::table;
use crate::tracker::reading::{Argument, Unit};
use crate::tracker::{axes::AxisMap, custom::CustomTracker};
use serde::{Deserialize, Serialize};

// The title as users read it, the port, and the addresses of each.
table! {
    /// The format of a head tracker, named after the plugin or device whose default settings it matches.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum TrackerFormat: (&'static str, u16, &'static [Form]) {
        /// This plugin's own addresses only.
        #[default]
        Promenade = ("Promenade", 9100, &[]),
        /// SPARTA's AmbiBIN, Rotator and 6DoFconv.
        Sparta = ("SPARTA", 9000, &SPARTA),
        /// The SceneRotator of the IEM Plug-in Suite.
        Iem = ("IEM SceneRotator", 9000, &IEM),
        /// `ambix_rotator`.
        AmbixRotator = ("ambix_rotator", 7120, &AMBIX_ROTATOR),
        /// `ambix_move`.
        AmbixMove = ("ambix_move", 7130, &AMBIX_MOVE),
        /// Orientations in Unity's axes.
        Unity = ("Unity", 9000, &UNITY),
        /// Ambi Head HD.
        AmbiHead = ("Ambi Head HD", 4040, &AMBI_HEAD),
        /// The SALTE renderer.
        Salte = ("SALTE", 9000, &SALTE),
        /// The 3D Tune-In Toolkit's test application.
        #[serde(rename = "3dti")]
        TuneIn = ("3D Tune-In", 12_300, &TUNE_IN),
        /// Mach1 Monitor.
        Mach1 = ("Mach1 Monitor", 9898, &MACH1),
        /// Supperware's Bridgehead.
        Supperware = ("Supperware Bridgehead", 8000, &SUPPERWARE),
        /// Sensors2OSC on an Android telephone.
        #[serde(rename = "sensors2osc")]
        Sensors2Osc = ("Sensors2OSC", 9000, &SENSORS2OSC),
        /// opentrack's output "UDP over network", which speaks no Open Sound Control.
        #[serde(rename = "opentrack")]
        OpenTrack = ("opentrack", 4242, &OPENTRACK),
        /// FreePIE's telephones, which speak no Open Sound Control either.
        #[serde(rename = "freepie")]
        FreePie = ("FreePIE", 5555, &FREEPIE),
        /// The head of the Virtual Motion Capture protocol.
        Vmc = ("VMC", 39_539, &VMC),
        /// An address of the user's.
        Custom = ("Custom", 9100, &[]),
    }
}

/// An address and what comes with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Form {
    /// The address.
    pub address: &'static str,
    /// Its arguments.
    pub arguments: &'static [Argument],
}

/// All axes as they are.
const SAME: AxisMap = AxisMap::IDENTITY;
/// The scene's rotation, which is the head's the other way.
const SCENE: AxisMap = AxisMap::INVERTED;

const fn flip(invert: [bool; 3]) -> AxisMap {
    AxisMap { order: [0, 1, 2], invert }
}

const fn form(address: &'static str, arguments: &'static [Argument]) -> Form {
    Form { address, arguments }
}

const YAW: u8 = 0;
const PITCH: u8 = 1;
const ROLL: u8 = 2;

use Argument::{Angle, Angles, Position, Quaternion, QuaternionLast, RotationVector, Skip, Word};
use Unit::{Degrees, Radians, Turns};

/// SPARTA counts the parts of the vector from yaw to roll, and turns the scene.
const SPARTA_QUATERNION: Argument = Quaternion(AxisMap { order: [2, 1, 0], invert: [true; 3] });
const SPARTA_ANGLES: Argument = Angles(Degrees, flip([false, true, false]));

static SPARTA: [Form; 9] = [
    form("/ypr", &[SPARTA_ANGLES]),
    form("/yaw", &[Angle(Degrees, YAW, false)]),
    form("/pitch", &[Angle(Degrees, PITCH, true)]),
    form("/roll", &[Angle(Degrees, ROLL, false)]),
    form("/quaternion", &[SPARTA_QUATERNION]),
    form("/quat", &[SPARTA_QUATERNION]),
    form("/xyz", &[Position(SAME)]),
    form("/xyzquat", &[Position(SAME), SPARTA_QUATERNION]),
    form("/xyzypr", &[Position(SAME), SPARTA_ANGLES]),
];

static IEM: [Form; 5] = [
    form("/SceneRotator/quaternions", &[Quaternion(SCENE)]),
    form("/SceneRotator/ypr", &[Angles(Degrees, flip([true, false, true]))]),
    form("/SceneRotator/yaw", &[Angle(Degrees, YAW, true)]),
    form("/SceneRotator/pitch", &[Angle(Degrees, PITCH, false)]),
    form("/SceneRotator/roll", &[Angle(Degrees, ROLL, true)]),
];

/// Pitch, yaw and roll of ambiX.
const AMBIX: Argument = Angles(Degrees, AxisMap { order: [1, 0, 2], invert: [false, true, true] });
/// x forward, y right, z up.
const Y_RIGHT: Argument = Position(flip([false, true, false]));

static AMBIX_ROTATOR: [Form; 3] =
    [form("/rotation", &[AMBIX]), form("/head_pose", &[Skip(4), AMBIX]), form("/quaternion", &[Quaternion(SCENE)])];

static AMBIX_MOVE: [Form; 5] = [
    form("/rotation", &[AMBIX]),
    form("/quaternion", &[Quaternion(SAME)]),
    form("/xyz", &[Y_RIGHT]),
    form("/translation", &[Y_RIGHT]),
    form("/6dof", &[Y_RIGHT, Quaternion(SAME)]),
];

/// Unity's axes are x right, y up and z forward, left-handed.
const UNITY_TURN: AxisMap = AxisMap { order: [2, 0, 1], invert: [true, false, true] };
static UNITY: [Form; 1] = [form("/quaternions", &[Quaternion(UNITY_TURN)])];

static AMBI_HEAD: [Form; 3] = [
    form("/yaw", &[Angle(Turns, YAW, false)]),
    form("/pitch", &[Angle(Turns, PITCH, false)]),
    form("/roll", &[Angle(Turns, ROLL, true)]),
];

static SALTE: [Form; 1] =
    [form("/rendering/htrpy", &[Angles(Degrees, AxisMap { order: [2, 1, 0], invert: [true, false, false] })])];

static TUNE_IN: [Form; 1] =
    [form("/3DTI-OSC/receiver/pry", &[Angles(Radians, AxisMap { order: [2, 0, 1], invert: [true, false, false] })])];

static MACH1: [Form; 1] = [form("/orientation", &[Angles(Degrees, flip([true, false, false]))])];

static SUPPERWARE: [Form; 4] = [
    form("/ypr", &[Angles(Degrees, SAME)]),
    form("/yaw", &[Angle(Degrees, YAW, false)]),
    form("/pitch", &[Angle(Degrees, PITCH, false)]),
    form("/roll", &[Angle(Degrees, ROLL, false)]),
];

/// The telephone's axes are x right, y to its top edge, which looks ahead, and z out of its screen, which looks up.
const ANDROID: Argument = RotationVector(AxisMap { order: [1, 0, 2], invert: [false, true, false] });

static SENSORS2OSC: [Form; 2] = [form("/gamerotationvector", &[ANDROID]), form("/rotationvector", &[ANDROID])];

/// x right, y up, z forward; to the right, up, right ear down.
static OPENTRACK: [Form; 1] = [form(
    "/opentrack/pose",
    &[Position(AxisMap { order: [2, 0, 1], invert: [false, true, false] }), Angles(Degrees, flip([true, false, false]))],
)];

static FREEPIE: [Form; 1] = [form("/freepie/ypr", &[Angles(Radians, flip([true, false, false]))])];

/// The head's turn about the neck, in Unity's axes; its place is that in the body.
static VMC: [Form; 1] = [form("/VMC/Ext/Bone/Pos/Head", &[Word, Skip(3), QuaternionLast(UNITY_TURN)])];

impl TrackerFormat {
    /// As users read it.
    pub fn title(self) -> &'static str {
        self.row().0
    }

    /// The port that trackers of this format send to when nothing else is set.
    pub fn port(self) -> u16 {
        self.row().1
    }

    /// Its addresses; none for [`TrackerFormat::Promenade`] and [`TrackerFormat::Custom`].
    pub fn forms(self) -> &'static [Form] {
        self.row().2
    }

    /// The arguments of an address, if it is one of this format. The IEM suite ignores case.
    pub(crate) fn arguments(self, address: &str, custom: &CustomTracker) -> Option<&'static [Argument]> {
        let same = |form: &&Form| match self {
            Self::Iem => form.address.eq_ignore_ascii_case(address),
            _ => form.address == address,
        };
        match self {
            Self::Custom => custom.arguments(address),
            _ => self.forms().iter().find(same).map(|form| form.arguments),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_format_has_an_address_twice() {
        for format in TrackerFormat::ALL {
            let forms = format.forms();
            for (index, form) in forms.iter().enumerate() {
                assert!(
                    forms[..index].iter().all(|other| other.address != form.address),
                    "{} {}",
                    format.title(),
                    form.address
                );
                assert_eq!(format.arguments(form.address, &CustomTracker::default()), Some(form.arguments));
            }
        }
    }
}
