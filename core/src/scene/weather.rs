//! The air in a place.

use crate::network::SPEED_OF_SOUND_M_S;
use crate::number::single;

/// The state of the air that a place was computed for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weather {
    /// Degrees Celsius, -50 to 60.
    pub temperature_c: f64,
    /// Relative humidity, per cent.
    pub humidity_percent: f64,
    /// Kilopascals.
    pub pressure_kpa: f64,
}

impl Default for Weather {
    fn default() -> Self {
        Self { temperature_c: 20.0, humidity_percent: 50.0, pressure_kpa: 101.325 }
    }
}

impl Weather {
    /// Metres per second: as the square root of the absolute temperature (ISO 9613-1:1993, annex A), from
    /// [`SPEED_OF_SOUND_M_S`] at 20 degrees Celsius.
    #[must_use]
    pub fn speed_m_s(&self) -> f32 {
        SPEED_OF_SOUND_M_S * single(((self.temperature_c + 273.15) / 293.15).sqrt())
    }
}
