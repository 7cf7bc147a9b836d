//! How an instance's Open Sound Control is set up.

use crate::project::adm_config::AdmConfig;
use crate::tracker::{Recenter, axes::AxisMap, custom::CustomTracker, format::TrackerFormat};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::time::Duration;

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
    /// Whether listener and object are sent as ADM-OSC instead of the pose.
    pub adm: bool,
}

impl Default for OscOut {
    fn default() -> Self {
        Self { on: false, host: "127.0.0.1".to_owned(), port: 9101, rate_hz: 50.0, adm: false }
    }
}

impl OscOut {
    /// Time from one pose to the next.
    pub fn interval(&self) -> Duration {
        let rate_hz = if self.rate_hz.is_finite() { self.rate_hz.clamp(1.0, 200.0) } else { 50.0 };
        Duration::from_secs_f32(rate_hz.recip())
    }
}

/// An instance's settings of Open Sound Control, as the project saves them.
///
/// A saved value that is not understood, such as one of a later version, sets only its own field to the default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Value")]
pub struct OscConfig {
    /// Port to listen at.
    pub port: u16,
    /// Where packets may come from. [`Interface::Any`] is in force only with a permit.
    pub interface: Interface,
    /// The permit that a user has given, see [`Osc::permit`](crate::osc::Osc); empty without.
    pub permit: String,
    /// The instance's name in addresses; empty answers only to addresses without a name. See [`OscConfig::address_name`].
    pub name: String,
    /// The tracker's format.
    pub format: TrackerFormat,
    /// Which of the tracker's yaw, pitch and roll is which of the head's, after the format's own convention.
    pub axes: AxisMap,
    /// Which of the tracker's x, y and z is which of the world's, after the format's own convention.
    pub position_axes: AxisMap,
    /// What is recentred unless a message asks for something else.
    pub recenter: Recenter,
    /// What [`TrackerFormat::Custom`] means.
    pub custom: CustomTracker,
    /// Where the pose is sent.
    pub out: OscOut,
    /// The part in ADM-OSC.
    pub adm: AdmConfig,
    /// Messages on what was not understood when it was restored.
    #[serde(skip)]
    pub notes: Vec<String>,
}

impl Default for OscConfig {
    fn default() -> Self {
        Self {
            port: TrackerFormat::Promenade.port(),
            interface: Interface::default(),
            permit: String::new(),
            name: String::new(),
            format: TrackerFormat::default(),
            axes: AxisMap::IDENTITY,
            position_axes: AxisMap::IDENTITY,
            recenter: Recenter::default(),
            custom: CustomTracker::default(),
            out: OscOut::default(),
            adm: AdmConfig::default(),
            notes: Vec::new(),
        }
    }
}

impl OscConfig {
    /// The name as it stands in addresses: what an address may not have becomes a hyphen.
    pub fn address_name(&self) -> String {
        let keep = |c: char| if c.is_ascii_graphic() && !"#*,/?[]{}".contains(c) { c } else { '-' };
        self.name.trim().chars().map(keep).collect()
    }
}

impl From<Value> for OscConfig {
    fn from(saved: Value) -> Self {
        let mut config = Self::default();
        let Value::Object(mut fields) = saved else {
            config.notes.push("the saved settings are not an object".to_owned());
            return config;
        };
        macro_rules! take {
            ($($field:ident)*) => {
                $(if let Some(saved) = fields.remove(stringify!($field)) {
                    let text: String = saved.to_string().chars().take(60).collect();
                    match serde_json::from_value(saved) {
                        Ok(value) => config.$field = value,
                        Err(_) => config.notes.push(format!("{} {text} is not known", stringify!($field))),
                    }
                })*
            };
        }
        take!(port interface permit name format axes position_axes recenter custom out adm);
        config
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nice_plug::params::persist::{PersistentField, deserialize_field, serialize_field};

    #[test]
    fn what_is_saved_is_restored() {
        let config = OscConfig {
            port: 9000,
            interface: Interface::Any,
            name: "Lead vocal".to_owned(),
            format: TrackerFormat::Sensors2Osc,
            axes: AxisMap { order: [0, 2, 1], invert: [true, false, false] },
            recenter: Recenter::Full,
            out: OscOut { on: true, adm: true, ..OscOut::default() },
            adm: AdmConfig { object: 7, metres: 3.5 },
            ..OscConfig::default()
        };
        let saved = serialize_field(&config).unwrap();
        assert_eq!(deserialize_field::<OscConfig>(&saved).unwrap(), config);
    }

    #[test]
    fn a_format_of_tomorrow_leaves_the_rest_as_it_was_saved() {
        let saved =
            r#"{"port":9000,"format":"of-tomorrow","out":{"on":true,"port":"x"},"interface":7,"axes":{"order":[0,9,1]}}"#;
        let config: OscConfig = deserialize_field(saved).unwrap();
        assert_eq!((config.port, config.format), (9000, TrackerFormat::Promenade));
        assert_eq!((config.interface, &config.out, config.axes), (Interface::Loopback, &OscOut::default(), AxisMap::IDENTITY));
        let notes = config.notes.join("; ");
        for part in ["format \"of-tomorrow\"", "interface 7", "axes", "out"] {
            assert!(notes.contains(part), "{notes}");
        }
        for odd in ["null", "[]", "3", "\"\"", "{}"] {
            let config: OscConfig = deserialize_field(odd).unwrap();
            assert_eq!(OscConfig { notes: Vec::new(), ..config }, OscConfig::default());
        }
        let persisted = crate::project::persisted::Persisted::<OscConfig>::default();
        persisted.set(deserialize_field(saved).unwrap());
        assert_eq!(persisted.get().0.port, 9000);
    }

    #[test]
    fn a_name_becomes_part_of_an_address() {
        let named = |name: &str| OscConfig { name: name.to_owned(), ..OscConfig::default() }.address_name();
        assert_eq!(named(" Lead vox #1/2 "), "Lead-vox--1-2");
        assert_eq!(named("Flöte"), "Fl-te");
        assert_eq!(named(""), "");
    }
}
