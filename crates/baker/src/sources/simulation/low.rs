//! The bass of a room by waves, for responses and scenes.

use crate::BakeError;
use promenade_acoustics::{
    Air, LateField, LowField, Mesh, RayOptions, Room, SPEED_OF_SOUND_M_S, Source, WaveOptions, fibonacci, late_field,
    low_t20_s, speed_m_s, waves,
};
use promenade_core::glam::Vec3;
use promenade_core::{noise_share, wave_share};
use promenade_fourier::num_complex::{Complex32, Complex64};
use promenade_fourier::{signal, spectrum};
use promenade_room::{CROSSOVERS_HZ, bass_axis, crossover_hz, whole_hz};
use std::f64::consts::TAU;

/// Values that the bass of a scene has at most, and samples of its responses in a second for each Hz that they are whole up to.
const MOST_VALUES: f64 = 8e5;
const SAMPLES: f64 = 2.5;
/// Rays and places that tell how a room decays.
pub(super) const PILOT_RAYS: usize = 8192;
const PILOT_PLACES: usize = 8;
/// The most that waves may take: values in cells and time steps, some 10 s of two cores.
const MOST_WORK: f64 = 6e9;
/// Length of the bass, seconds.
const LENGTHS_S: (f64, f64) = (0.2, 4.0);
/// Share of a reverberation time that shows how waves decay.
const DECAYS: f64 = 0.8;
/// Share of the directions from the source in which there is a surface, in a room of a bass of its own.
const ENCLOSED: f64 = 0.8;
/// How much more a source may send in one direction than in another, amplitude, to be the same in all in long waves.
const EVEN: f32 = 2.0;
/// Directions that it is looked at in.
const LOOKED: usize = 64;
/// An ear lies so far from the head's centre in long waves, metres (Kuhn 1977: half as far again as it is).
const EAR_M: f64 = 0.131;

/// How far up waves go in a room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bass {
    pub(crate) crossover_hz: f64,
    /// Reverberation time of the octave of 125 Hz, within the lengths that are computed, seconds.
    pub(crate) t60_s: f64,
    /// Amplitude of the source, root mean square over all directions.
    pub(crate) level: f32,
}

impl Bass {
    /// Of a room; none where waves are not asked for (0 Hz), or by itself in one that is open, so large that its modes overlap
    /// from 60 Hz on, or whose source sends more to one side.
    pub(crate) fn of(mesh: &Mesh, room: &Room, source: &Source, wanted_hz: Option<f64>) -> Result<Option<Self>, BakeError> {
        if wanted_hz == Some(0.0) {
            return Ok(None);
        }
        let sent: Vec<f32> = (0..LOOKED).map(|i| source.directivity.towards(fibonacci(i, LOOKED))[0]).collect();
        let (least, most) = sent.iter().fold((f32::INFINITY, 0.0_f32), |(a, b), s| (a.min(*s), b.max(*s)));
        let level = (sent.iter().map(|s| s * s).sum::<f32>() / LOOKED as f32).sqrt();
        let closed = mesh.report().volume_m3;
        let [t60_s, ..] = room.eyring_t60_s(closed, None);
        let volume = closed.unwrap_or_else(|| room.bounding_volume());
        let t60_s = t60_s.clamp(LENGTHS_S.0, LENGTHS_S.1);
        let by_itself = || -> Result<Option<f64>, BakeError> {
            let enclosed = room.surroundings(source.position)?.enclosed;
            Ok(crossover_hz(volume, t60_s).filter(|_| enclosed >= ENCLOSED && most <= EVEN * least))
        };
        let [low, high] = mesh.bounds();
        let too_much = |hz: f64| {
            let along = |axis: usize| bass_axis(low[axis] as f32, high[axis] as f32, hz, false).count();
            let values = 4.0 * (along(0) * along(1)) as f64 * SAMPLES * whole_hz(hz) * t60_s;
            values > MOST_VALUES || options(hz, t60_s, SPEED_OF_SOUND_M_S).cost(room) > MOST_WORK
        };
        let mut crossover = match wanted_hz {
            Some(hz) => Some(hz),
            None => by_itself()?,
        };
        while let Some(hz) = crossover.filter(|hz| wanted_hz.is_none() && too_much(*hz)) {
            crossover = Some(0.95 * hz).filter(|hz| *hz >= CROSSOVERS_HZ.0);
        }
        Ok(crossover.map(|crossover_hz| Self { crossover_hz, t60_s, level }))
    }

    /// What places hear, but for the direct sound as it is in free space; it decays as the rays of a pilot do.
    pub(crate) fn field(
        &self,
        room: &Room,
        source: &Source,
        places: &[[f64; 3]],
        pilot: &Pilot,
        (length_s, air): (f64, Option<Air>),
        done: impl Fn(f64),
    ) -> Result<LowField, BakeError> {
        let all = [places, &pilot.places].concat();
        // A decay of 25 dB is seen even where responses are shorter.
        let seen_s = length_s.max(DECAYS * self.t60_s);
        let mut field = waves(room, source.position, &all, &options(self.crossover_hz, seen_s, speed_m_s(air)), done)?;
        field.add_direct(-1.0, source.position, &all, speed_m_s(air));
        if let Some(t20_s) = low_t20_s(&pilot.late.echograms) {
            field.decay_as(places.len()..all.len(), t20_s);
        }
        field.places.truncate(places.len());
        let length = (length_s * field.rate_hz).ceil() as usize;
        for signal in field.places.iter_mut().flat_map(|place| [&mut place.pressure].into_iter().chain(&mut place.gradient)) {
            signal.truncate(length);
            signal.iter_mut().for_each(|v| *v *= self.level);
        }
        Ok(field)
    }
}

/// What some rays without images show of a room, at some of its places.
pub(crate) struct Pilot {
    places: Vec<[f64; 3]>,
    pub(crate) late: LateField,
}

impl Pilot {
    /// Of at most so many rays, for some seconds.
    pub(crate) fn new(
        room: &Room,
        source: &Source,
        places: &[[f64; 3]],
        (rays, length_s): (usize, f64),
        (air, seed): (Option<Air>, u64),
    ) -> Result<Self, BakeError> {
        let places: Vec<[f64; 3]> = places.iter().step_by(places.len().div_ceil(PILOT_PLACES).max(1)).copied().collect();
        let rays = rays.min(PILOT_RAYS);
        let options = RayOptions { rays, length_s, bin_s: 0.01, images: None, radius_m: None, air, seed };
        Ok(Self { late: late_field(room, source, &places, &options, |_| ())?, places })
    }
}

fn options(crossover_hz: f64, length_s: f64, speed_m_s: f64) -> WaveOptions {
    WaveOptions { top_hz: whole_hz(crossover_hz), length_s, speed_m_s, cells_a_wave: 0.0 }
}

/// Puts waves below a crossover in the place of what responses have there: shares as scenes have them ([`wave_share`],
/// [`noise_share`]), without a turn of phase.
pub(crate) struct Joiner {
    crossover_hz: f64,
    n_fft: usize,
    rate_hz: f64,
}

impl Joiner {
    /// For responses of some length at a rate.
    pub(crate) fn new(crossover_hz: f64, length: usize, rate_hz: f64) -> Self {
        // As much silence as the crossover rings.
        let n_fft = (length + (rate_hz / 10.0) as usize).next_power_of_two();
        Self { crossover_hz, n_fft, rate_hz }
    }

    fn bin_hz(&self, bin: usize) -> f64 {
        bin as f64 * self.rate_hz / self.n_fft as f64
    }

    /// Joins both ears of a head whose left lies along `left`, a unit vector, at a place of a field: what images bring to them,
    /// and the noise that comes after these, which stays apart.
    pub(crate) fn join(&self, ears: &mut [Vec<f32>; 2], late: &mut [Vec<f32>; 2], field: &LowField, place: usize, left: Vec3) {
        let heard = &field.places[place];
        for noise in late {
            let mut bins = spectrum(noise.iter().copied(), self.n_fft);
            for (k, bin) in bins.iter_mut().enumerate() {
                *bin *= noise_share(self.bin_hz(k), self.crossover_hz) as f32;
            }
            noise.iter_mut().zip(signal(bins, self.n_fft)).for_each(|(noise, joined)| *noise = joined);
        }
        for (ear, side) in ears.iter_mut().zip([1.0, -1.0]) {
            let slope = |i: usize| -> f64 {
                left.to_array().iter().zip(&heard.gradient).map(|(along, g)| f64::from(along * g[i])).sum()
            };
            let low: Vec<f64> =
                heard.pressure.iter().enumerate().map(|(i, p)| f64::from(*p) + side * EAR_M * slope(i)).collect();
            let mut bins = spectrum(ear.iter().copied(), self.n_fft);
            for (k, bin) in bins.iter_mut().enumerate() {
                let hz = self.bin_hz(k);
                let share = wave_share(hz, self.crossover_hz);
                let wave = if hz < 0.5 * field.rate_hz && share > 1e-3 {
                    // As loud to both ears in a diffuse field as it is.
                    let number = TAU * hz / SPEED_OF_SOUND_M_S * EAR_M;
                    at(&low, TAU * hz / field.rate_hz) / (1.0 + number * number / 3.0).sqrt()
                } else {
                    Complex64::default()
                };
                let joined = Complex64::new(f64::from(bin.re), f64::from(bin.im)) * (1.0 - share) + wave * share;
                *bin = Complex32::new(joined.re as f32, joined.im as f32);
            }
            let joined = signal(bins, self.n_fft);
            ear.iter_mut().zip(joined).for_each(|(ear, joined)| *ear = joined);
        }
    }
}

/// A signal's spectrum at an angle per sample.
fn at(signal: &[f64], angle: f64) -> Complex64 {
    let step = Complex64::cis(-angle);
    // Horner's rule, from the last sample on.
    signal.iter().rev().fold(Complex64::default(), |sum, x| sum * step + x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_acoustics::LowResponse;
    use promenade_core::random::Random;

    #[test]
    fn noise_and_waves_are_as_loud_together_as_each_alone() {
        let (rate, low_rate, seconds, crossover_hz) = (8000.0, 1000.0, 8.0, 180.0);
        let mut random = Random::new(1);
        let mut noise = |rate: f64, level: f64| -> Vec<f32> {
            (0..(seconds * rate) as usize).map(|_| level as f32 * random.normal()).collect()
        };
        let mut late = [noise(rate, 1.0), noise(rate, 1.0)];
        let pressure = noise(low_rate, (rate / low_rate).sqrt());
        let gradient = [(); 3].map(|()| vec![0.0; pressure.len()]);
        let field = LowField { rate_hz: low_rate, top_hz: 400.0, places: vec![LowResponse { pressure, gradient }] };
        let length = late[0].len();
        let mut ears = [vec![0.0; length], vec![0.0; length]];
        Joiner::new(crossover_hz, length, rate).join(&mut ears, &mut late, &field, 0, Vec3::Y);
        let both: Vec<f32> = ears[0].iter().zip(&late[0]).map(|(a, b)| a + b).collect();
        let n_fft = length.next_power_of_two();
        let bins = spectrum(both.iter().copied(), n_fft);
        for hz in [100.0_f64, 126.0, 159.0, 178.0, 200.0, 252.0, 318.0, 400.0] {
            let bin = |hz: f64| (hz / rate * n_fft as f64) as usize;
            let range = bin(hz / 2.0_f64.powf(1.0 / 6.0))..bin(hz * 2.0_f64.powf(1.0 / 6.0));
            let count = range.len() as f64;
            let power = range.map(|k| f64::from(bins[k].norm_sqr())).sum::<f64>() / count / length as f64;
            // The waves of a head without gradient fall as its ears' distance asks.
            let number = TAU * hz / SPEED_OF_SOUND_M_S * EAR_M;
            let share = wave_share(hz, crossover_hz);
            let expected = 1.0 - share * share + share * share / (1.0 + number * number / 3.0);
            let db = 10.0 * (power / expected).log10();
            assert!(db.abs() < 0.7, "{db} dB at {hz} Hz");
        }
    }
}
