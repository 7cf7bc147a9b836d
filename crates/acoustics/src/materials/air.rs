//! What air absorbs.

use crate::SPEED_OF_SOUND_M_S;
use crate::octave::{OCTAVES_HZ, Octaves};

/// The state of the air in a room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// Degrees Celsius.
    pub temperature_c: f64,
    /// Relative humidity, per cent.
    pub humidity_percent: f64,
    /// Pressure, kilopascals.
    pub pressure_kpa: f64,
}

impl Default for Air {
    fn default() -> Self {
        Self { temperature_c: 20.0, humidity_percent: 50.0, pressure_kpa: 101.325 }
    }
}

/// Metres per second, of some air or of air at 20 degrees.
#[must_use]
pub fn speed_m_s(air: Option<Air>) -> f64 {
    air.map_or(SPEED_OF_SOUND_M_S, |air| air.speed_m_s())
}

impl Air {
    /// Metres per second: as the square root of the absolute temperature (ISO 9613-1:1993, annex A), from
    /// [`SPEED_OF_SOUND_M_S`] at 20 degrees Celsius.
    #[must_use]
    pub fn speed_m_s(&self) -> f64 {
        SPEED_OF_SOUND_M_S * ((self.temperature_c + 273.15) / 293.15).sqrt()
    }

    /// Attenuation of a pure tone, decibels per metre (ISO 9613-1:1993, equations 3 to 5 and B.2, B.3).
    #[must_use]
    pub fn db_per_m(&self, hz: f64) -> f64 {
        let kelvin = self.temperature_c + 273.15;
        let warmth = kelvin / 293.15;
        let pressure = self.pressure_kpa / 101.325;
        let saturation = 10f64.powf(4.6151 - 6.8346 * (273.16 / kelvin).powf(1.261));
        let water = self.humidity_percent * saturation / pressure;
        let oxygen_hz = pressure * (24.0 + 4.04e4 * water * (0.02 + water) / (0.391 + water));
        let nitrogen_hz = pressure / warmth.sqrt() * (9.0 + 280.0 * water * (-4.170 * (warmth.powf(-1.0 / 3.0) - 1.0)).exp());
        let relaxation = |strength: f64, kelvin_of_it: f64, relaxes_hz: f64| {
            strength * (-kelvin_of_it / kelvin).exp() / (relaxes_hz + hz * hz / relaxes_hz)
        };
        let relaxations = relaxation(0.012_75, 2239.1, oxygen_hz) + relaxation(0.1068, 3352.0, nitrogen_hz);
        8.686 * hz * hz * (1.84e-11 / pressure * warmth.sqrt() + warmth.powf(-2.5) * relaxations)
    }

    /// Decay of the energy with distance at a frequency, per metre: after `r` metres `exp(-decay * r)` is left.
    #[must_use]
    pub fn energy_decay_per_m(&self, hz: f64) -> f64 {
        self.db_per_m(hz) / (10.0 * std::f64::consts::LOG10_E)
    }

    /// Decay of the energy per metre by octave, at its centre.
    #[must_use]
    pub fn decay_per_m(&self) -> Octaves {
        OCTAVES_HZ.map(|hz| self.energy_decay_per_m(f64::from(hz)) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tones_fade_as_the_standard_says() {
        // ISO 9613-1, table 1: 20 degrees and 10 degrees, 50 and 70 %, dB/km at exact centres, which differ from these by up to
        // 1.6 %.
        let db_per_km = |air: Air, hz: f64| 1000.0 * air.db_per_m(hz);
        let table =
            [(125.0, 0.445), (250.0, 1.32), (500.0, 2.73), (1000.0, 4.66), (2000.0, 9.86), (4000.0, 29.4), (8000.0, 104.0)];
        for (hz, expected) in table {
            let found = db_per_km(Air::default(), hz);
            assert!((found / expected - 1.0).abs() < 0.04, "{found} dB/km for {expected} at {hz} Hz");
        }
        let cold = Air { temperature_c: 10.0, humidity_percent: 70.0, ..Air::default() };
        assert!((db_per_km(cold, 1000.0) / 3.66 - 1.0).abs() < 0.04);
        let decay = Air::default().decay_per_m()[6];
        assert!(((-100.0 * decay).exp() - 10f32.powf(-1.04)).abs() < 0.01);
    }
}
