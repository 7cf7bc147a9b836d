//! The bass of a room: where it ends, how close places lie, and as a scene has it.

use promenade_acoustics::{LowField, SPEED_OF_SOUND_M_S};
use promenade_core::glam::DVec3;
use promenade_core::{Axis, BassEars, BassField};

/// The lowest and the highest crossover, Hz.
pub const CROSSOVERS_HZ: (f64, f64) = (60.0, 250.0);
/// A crossover lies at least here where there is time for it: the octave of 125 Hz is the waves' then.
const OCTAVE_HZ: f64 = 180.0;
/// Responses are whole up to this many times the crossover: there a 27th is left of them, a third of a decibel of what is
/// heard.
const WHOLE: f64 = 1.5;
/// Distance of places, in waves at the crossover.
const SPACING: f64 = 0.3;
/// Distance of layers along the height where there are several, in waves at the crossover.
const LAYERS: f64 = 0.5;

/// A room's bass at places of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct RoomBass {
    /// Hz.
    pub crossover_hz: f64,
    /// World, metres.
    pub axes: [Axis; 3],
    /// `[z][y][x]`, without the direct sound in free space.
    pub field: LowField,
}

/// Up to where waves are asked for, Hz: Schroeder's frequency of a room (1962), cubic metres and seconds, or a little above the
/// octave of 125 Hz; not at all where its modes overlap from 60 Hz on.
#[must_use]
pub fn crossover_hz(volume_m3: f64, t60_s: f64) -> Option<f64> {
    let schroeder = 2000.0 * (t60_s / volume_m3).sqrt();
    (schroeder >= CROSSOVERS_HZ.0).then(|| schroeder.clamp(OCTAVE_HZ, CROSSOVERS_HZ.1))
}

/// Up to where responses of this crossover are whole, Hz.
#[must_use]
pub fn whole_hz(crossover_hz: f64) -> f64 {
    WHOLE * crossover_hz
}

/// Places between two ends, metres, close enough for waves up to a crossover; along the height fewer.
#[must_use]
pub fn bass_axis(low: f32, high: f32, crossover_hz: f64, height: bool) -> Axis {
    let waves = if height { LAYERS } else { SPACING };
    let most = (waves * SPEED_OF_SOUND_M_S / crossover_hz) as f32;
    let cells = ((high - low) / most).ceil().max(0.0) as usize;
    if cells == 0 { Axis::single(0.5 * (low + high)) } else { Axis::uniform(low, (high - low) / cells as f32, cells + 1) }
}

/// Places of a table in the order `[z][y][x]`.
#[must_use]
pub fn bass_places(axes: &[Axis; 3]) -> Vec<DVec3> {
    BassField::places_of(axes).map(|at| at.as_dvec3()).collect()
}

impl RoomBass {
    /// As a scene of this gain has it.
    #[must_use]
    pub(crate) fn scene(&self, gain: f64) -> BassField {
        let gain = gain as f32;
        let signals = |place: &promenade_acoustics::LowResponse| {
            let [x, y, z] = &place.gradient;
            [&place.pressure, x, y, z].map(|signal| signal.iter().map(|v| gain * v).collect::<Vec<f32>>()).concat()
        };
        BassField {
            crossover_hz: self.crossover_hz,
            rate_hz: self.field.rate_hz,
            places: self.axes.clone(),
            direct: gain,
            samples: self.field.places.iter().flat_map(signals).collect(),
            ears: BassEars::Head,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossovers_and_places_follow_the_room() {
        assert!((crossover_hz(60.0, 0.6).unwrap() - 200.0).abs() < 1e-9);
        assert_eq!(
            [(20.0, 2.0), (250.0, 1.0), (20_000.0, 4.0)].map(|(v, t)| crossover_hz(v, t)),
            [Some(250.0), Some(180.0), None]
        );
        let axis = bass_axis(0.3, 4.1, 200.0, false);
        assert_eq!((axis.count(), axis.start()), (9, 0.3));
        assert!((axis.end() - 4.1).abs() < 1e-5);
        assert_eq!(bass_axis(1.5, 1.5, 200.0, true).nodes(), [1.5]);
        let axes = [bass_axis(0.0, 1.0, 200.0, false), Axis::single(2.0), Axis::single(3.0)];
        assert_eq!(bass_places(&axes)[1], DVec3::new(0.5, 2.0, 3.0));
    }
}
