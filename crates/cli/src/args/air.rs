//! The air in a room.

use super::values::within;
use clap::Args;
use promenade_acoustics::Air;
use std::fmt;

/// Its speed of sound, and what it takes of the sound (ISO 9613-1).
#[derive(Clone, Copy, Debug, PartialEq, Args)]
pub(crate) struct AirArgs {
    /// Temperature, degrees Celsius
    #[arg(long, value_name = "C", default_value_t = 20.0, allow_hyphen_values = true, value_parser = within(-50.0, 60.0))]
    temperature: f64,
    /// Relative humidity, per cent
    #[arg(long, value_name = "PERCENT", default_value_t = 50.0, value_parser = within(0.0, 100.0))]
    humidity: f64,
    /// Air pressure, kilopascals
    #[arg(long, value_name = "KPA", default_value_t = 101.325, value_parser = within(10.0, 200.0))]
    pressure: f64,
}

impl AirArgs {
    pub(crate) fn air(self) -> Air {
        let Self { temperature: temperature_c, humidity: humidity_percent, pressure: pressure_kpa } = self;
        Air { temperature_c, humidity_percent, pressure_kpa }
    }
}

/// The options, as far as they differ from what they are by default.
impl fmt::Display for AirArgs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.air() == Air::default() {
            return Ok(());
        }
        write!(f, " --temperature {} --humidity {} --pressure {}", self.temperature, self.humidity, self.pressure)
    }
}
