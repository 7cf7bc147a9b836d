//! How an instance's Open Sound Control is set up.

use serde::{Deserialize, Serialize};

/// Where packets may come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Interface {
    /// This machine only.
    #[default]
    Loopback,
    /// Every network that this machine is on.
    Any,
}

/// What a head tracker speaks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrackerFormat {
    /// This plugin's own addresses only.
    #[default]
    Promenade,
}

/// Which of a tracker's axes is which of the head's, and which way it counts.
///
/// For angles the axes are yaw, pitch and roll, for quaternions and positions x, y and z.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct AxisMap {
    /// For each of the head's axes the number of the tracker's, 0 to 2.
    pub order: [u8; 3],
    /// For each of the head's axes whether it counts the other way.
    pub invert: [bool; 3],
}

impl Default for AxisMap {
    fn default() -> Self {
        Self { order: [0, 1, 2], invert: [false; 3] }
    }
}

/// Where the listener's pose is sent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct OscOut {
    /// Whether it is sent.
    pub on: bool,
    /// Host name or address.
    pub host: String,
    /// Port.
    pub port: u16,
    /// Poses a second, 1 to 200.
    pub rate_hz: f32,
}

impl Default for OscOut {
    fn default() -> Self {
        Self { on: false, host: "127.0.0.1".to_owned(), port: 9101, rate_hz: 50.0 }
    }
}

/// What a project keeps of an instance's Open Sound Control.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct OscConfig {
    /// Whether packets are taken.
    pub on: bool,
    /// Port to listen at.
    pub port: u16,
    /// Where packets may come from.
    pub interface: Interface,
    /// The instance's name in addresses; empty answers only to addresses without a name.
    pub name: String,
    /// What the tracker speaks.
    pub format: TrackerFormat,
    /// Its axes.
    pub axes: AxisMap,
    /// Where the pose is sent.
    pub out: OscOut,
}

impl Default for OscConfig {
    fn default() -> Self {
        Self {
            on: false,
            port: 9100,
            interface: Interface::default(),
            name: String::new(),
            format: TrackerFormat::default(),
            axes: AxisMap::default(),
            out: OscOut::default(),
        }
    }
}
