//! A scene heard with another head than the one that it was measured with.

use super::{AMBISONIC_CHANNELS, AmbisonicHead, ImageSources, MeasuredHead, MeasuredRoom, Scene, SceneParts};
use crate::decode::field::{Facing, Field, FieldGrid, Rows};
use crate::head::{HEAD_BANDS, Head, Incidence, ambisonic_filters, at_hz, harmonics, lag_s, low_pass_power};
use crate::number::single;
use crate::{Bands, StftGrid, TransferShape};
use glam::Vec3;
use promenade_fourier::num_complex::{Complex32, Complex64};
use promenade_fourier::{floored_log, minimum_phase, signal, spectrum};
use std::f64::consts::TAU;
use thiserror::Error;

/// Below the first of these the levels of heads are alike, and what a response has there is the room's: it stays. Above the
/// second the level is the new head's, Hz.
const LEVELS_FROM_HZ: (f64, f64) = (300.0, 600.0);
/// Before the first of these times the emitter's sound has not begun, from the second on it is whole, seconds from the arrival
/// at the head's centre: the near ear is earlier.
const BEGINS_S: [f64; 2] = [-0.0006, -0.0001];
/// Rounds in which its phases are found.
const ROUNDS: usize = 100;
/// Nepers of a decibel.
const NEPERS_PER_DB: f64 = std::f64::consts::LN_10 / 20.0;

/// Why a scene cannot be heard with another head.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum NoHeadError {
    /// It has no field.
    #[error(
        "the scene \"for High\" alone has no table of responses that another head could take the place of its own in; its own \
         head plays"
    )]
    NoField,
    /// Its field does not say from where the direct sound comes.
    #[error(
        "the scene does not say from which direction its direct sound comes, so that no other head can take the place of its \
         own; its own head plays"
    )]
    NoDirections,
}

impl MeasuredHead {
    /// What a scene whose field has these nodes keeps of the head that it was measured with; `direction` is where a node's
    /// response was measured that lies in a direction.
    #[must_use]
    pub fn of(head: &Head, nodes: &FieldGrid, direction: impl Fn(Vec3) -> Vec3) -> Self {
        let around = around(nodes).into_iter().map(|(towards, weight)| (direction(towards), weight));
        Self { name: head.name().to_owned(), around_db: head.around_db(around), diffuse_db: head.diffuse_db() }
    }
}

impl Scene {
    /// Exchanges the head that the scene is heard with.
    ///
    /// From 600 Hz on, the filter of the direct sound becomes the emitter's level, the same for all directions, times the
    /// head's response to the direction; the delay between the ears becomes the head's. The emitter's level is the mean of what
    /// was measured over the level that the measured head has over the same directions. Where that head is not known, the new
    /// one stands in for it: the colour of the direct sound over all directions then stays as it was measured. Time filters
    /// take the ratio of the two heads in a diffuse field at each ear (both are equalised for both ears together). Image
    /// sources are heard by the head from their directions. What an anchor cloud plays keeps the scene's own head.
    ///
    /// # Errors
    /// A scene without a field whose directions are the emitter's.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn with_head(&self, head: &Head) -> Result<Self, NoHeadError> {
        let field = self.field().ok_or(NoHeadError::NoField)?;
        let (Facing::Emitter { .. }, Rows::Whole(rows)) = (&field.grid().facing, field.rows()) else {
            return Err(NoHeadError::NoDirections);
        };
        let parts = &self.parts;
        let around = around(field.grid());
        let measured = parts.measured_head.as_ref();
        let change = Change {
            grid: &parts.grid,
            shape: field.shape(),
            head,
            source_db: measured.map_or_else(|| head.around_db(around.iter().copied()), |m| m.around_db),
            room: room_gains(head, measured, &parts.bands),
        };
        let mut rows = rows.clone();
        let row_len = change.shape.row_len();
        // The emitter's level may differ from one listener position to another.
        for (rows, directions) in rows.chunks_exact_mut(row_len * around.len()).zip(std::iter::repeat(&around)) {
            change.apply(rows, directions);
        }
        let changed = Field::new(field.grid().clone(), change.shape, Rows::Whole(rows));
        // Of the same shape as before, so that it fits.
        let field = changed.unwrap_or_else(|| field.clone());
        let images = parts.images.as_ref().map(|images| ImageSources { head: images.head.of_other(head), ..images.clone() });
        let room = parts.room.as_ref().map(|room| change.room_of(room));
        let measured = parts.measured.as_ref().map(|measured| {
            let gains = measured.gains.iter().zip(&change.room).map(|(old, new)| old * new).collect();
            MeasuredRoom { gains, ..measured.clone() }
        });
        Ok(Self { parts: SceneParts { field: Some(field), room, images, measured, ..parts.clone() } })
    }
}

impl AmbisonicHead {
    /// A head as image sources are heard with: `length` samples at a rate, of which `lead` come before the sound is at the
    /// head's centre.
    ///
    /// # Real-time
    /// Not real-time safe: allocates, and takes a good part of a second.
    #[must_use]
    pub fn of(head: &Head, sample_rate_hz: f64, lead: usize, length: usize) -> Self {
        let n_fft = n_fft(length);
        let filters = head.ambisonic(AMBISONIC_CHANNELS.isqrt() - 1, Incidence::Horizontal, n_fft, sample_rate_hz);
        Self::of_spectra(filters, sample_rate_hz, lead, length)
    }

    /// Filters of the channels of some order, `[channel][ear][bin]`, about the moment at which the sound is at the head's
    /// centre; channels beyond them are silent.
    fn of_spectra(filters: Vec<[Vec<Complex32>; 2]>, sample_rate_hz: f64, lead: usize, length: usize) -> Self {
        let n_fft = n_fft(length);
        let [rise, fall] = [lead / 4, length / 8];
        let ramp = |i: usize, of: usize| single((0.5 * std::f64::consts::PI * (i as f64 + 0.5) / of as f64).sin().powi(2));
        let impulse = |mut spectrum: Vec<Complex32>| -> Vec<f32> {
            for (k, x) in spectrum.iter_mut().enumerate() {
                let turn = Complex64::from_polar(1.0, -TAU * (k * lead) as f64 / n_fft as f64);
                *x *= Complex32::new(single(turn.re), single(turn.im));
            }
            let mut time = signal(spectrum, n_fft);
            time.truncate(length);
            time.iter_mut().take(rise).enumerate().for_each(|(i, v)| *v *= ramp(i, rise));
            time.iter_mut().rev().take(fall).enumerate().for_each(|(i, v)| *v *= ramp(i, fall));
            time
        };
        let mut filters: Vec<f32> = filters.into_iter().flatten().flat_map(impulse).collect();
        filters.resize(2 * AMBISONIC_CHANNELS * length, 0.0);
        Self { sample_rate_hz, lead, filters }
    }

    /// This head in a lower order, fitted as [`ambisonic_filters`] says to what it hears in its own.
    ///
    /// # Real-time
    /// Not real-time safe: allocates, and takes a good part of a second.
    pub(crate) fn in_order(&self, order: usize) -> Self {
        let n_fft = n_fft(self.len());
        let bin_hz = self.sample_rate_hz / n_fft as f64;
        let bins: Vec<_> = (0..=n_fft / 2)
            .map(|k| {
                let centred = Complex64::cis(TAU * (k * self.lead) as f64 / n_fft as f64);
                self.at(k as f64 * bin_hz).map(|ears| ears.map(|x| x * centred))
            })
            .collect();
        let filters = ambisonic_filters(order, Incidence::Horizontal, bin_hz, |direction| {
            let shares = harmonics(AMBISONIC_CHANNELS.isqrt() - 1, direction);
            [0, 1].map(|ear| {
                let sum = |bin: &[[Complex64; 2]; AMBISONIC_CHANNELS]| -> Complex64 {
                    bin.iter().zip(&shares).map(|(ears, share)| ears[ear] * f64::from(*share)).sum()
                };
                bins.iter().map(sum).map(|x| Complex32::new(single(x.re), single(x.im))).collect()
            })
        });
        Self::of_spectra(filters, self.sample_rate_hz, self.lead, self.len())
    }

    /// Another head, of this one's rate, lead and length.
    fn of_other(&self, head: &Head) -> Self {
        Self::of(head, self.sample_rate_hz, self.lead, self.len())
    }
}

/// Length of transforms for filters of a length.
fn n_fft(length: usize) -> usize {
    (2 * length).next_power_of_two().max(256)
}

/// Directions of the nodes at one position, each with the share of the sphere that it stands for.
fn around(nodes: &FieldGrid) -> Vec<(Vec3, f32)> {
    let positions: usize = nodes.position.iter().map(crate::Axis::count).product();
    let count = nodes.nodes() / positions.max(1);
    let level = |d: &Vec3| (d.x * d.x + d.y * d.y).sqrt();
    let share = |i: usize| match &nodes.facing {
        Facing::Emitter { elevation, azimuth, .. } => {
            azimuth.share(i % azimuth.count()) * elevation.share(i / azimuth.count() % elevation.count())
        }
        Facing::Head { .. } => 1.0,
    };
    let directions = (0..count).map(|i| (nodes.node(i).1, share(i)));
    let mut around: Vec<(Vec3, f32)> = directions.map(|(d, share)| (d, share * level(&d))).collect();
    if around.iter().all(|(_, weight)| *weight < 1e-3) {
        around.iter_mut().for_each(|(_, weight)| *weight = 1.0);
    }
    around
}

/// Gains of the time filters, `[ear][band]`.
fn room_gains(head: &Head, measured: Option<&MeasuredHead>, bands: &Bands) -> Vec<f32> {
    let none = [[0.0; HEAD_BANDS]; 2];
    let (new, old) = (head.diffuse_db(), measured.map_or(none, |m| m.diffuse_db));
    let gain = |ear: usize, hz: f32| 10.0_f32.powf((at_hz(&new[ear], hz.into()) - at_hz(&old[ear], hz.into())) / 20.0);
    (0..2).flat_map(|ear| bands.centres_hz().iter().map(move |hz| gain(ear, *hz))).collect()
}

/// What an emitter sounds like at one position, by bin.
struct Emitter {
    /// Natural logarithm of its amplitude.
    logs: Vec<f64>,
    /// Phase beyond the minimum one, radians: the mean over all directions and both ears, in which what is the head's cancels.
    excess: Vec<f32>,
}

/// A head that takes the place of another in rows of a field.
struct Change<'a> {
    grid: &'a StftGrid,
    shape: TransferShape,
    head: &'a Head,
    /// What the measured head adds to the emitter's level.
    source_db: [f32; HEAD_BANDS],
    room: Vec<f32>,
}

impl Change<'_> {
    /// Changes the rows of all directions at one position.
    fn apply(&self, rows: &mut [f32], around: &[(Vec3, f32)]) {
        let emitter = self.emitter(rows, around);
        for (row, (direction, _)) in rows.chunks_exact_mut(self.shape.row_len()).zip(around) {
            self.direct(row, *direction, &emitter);
            self.time_filters(&mut row[self.shape.direct_len()..]);
        }
    }

    /// What all directions and both ears have in common: the emitter.
    fn emitter(&self, rows: &[f32], around: &[(Vec3, f32)]) -> Emitter {
        let (bins, n_fft) = (self.shape.bins, self.grid.n_fft);
        let mut energy = vec![0.0_f64; bins];
        let mut turned = vec![Complex64::default(); bins];
        let whole: f64 = around.iter().map(|(_, weight)| f64::from(*weight)).sum();
        for (row, (_, weight)) in rows.chunks_exact(self.shape.row_len()).zip(around) {
            let weight = 0.5 * f64::from(*weight) / whole;
            for (ear, phases) in row[2 * bins..4 * bins].chunks_exact(bins).enumerate() {
                let gains: Vec<f64> = (0..bins).map(|k| ears_of(row, bins, k)[ear]).collect();
                let minimum = minimum_phase(floored_log(&gains), n_fft);
                for (k, ((gain, minimum), phase)) in gains.iter().zip(minimum).zip(phases).enumerate() {
                    let power = weight * gain * gain;
                    energy[k] += power;
                    turned[k] += Complex64::from_polar(power, f64::from(phase - minimum));
                }
            }
        }
        let log = |(k, e): (usize, &f64)| {
            0.5 * e.max(1e-30).ln() - NEPERS_PER_DB * f64::from(at_hz(&self.source_db, self.grid.bin_hz(k)))
        };
        Emitter { logs: energy.iter().enumerate().map(log).collect(), excess: self.begun(&energy, &turned) }
    }

    /// Phases beyond the minimum one, near those of some phasors, of a sound of such energies that begins when the direct sound
    /// does: what is left of many heads' phases would ring before it.
    fn begun(&self, energy: &[f64], phasors: &[Complex64]) -> Vec<f32> {
        let n_fft = self.grid.n_fft;
        let gains: Vec<f64> = energy.iter().map(|e| e.sqrt()).collect();
        let minimum: Vec<f64> = minimum_phase(floored_log(&gains), n_fft).map(f64::from).collect();
        let whole = |phasor: &Complex64, k: usize| Complex64::from_polar(gains[k], phasor.arg());
        let mut sound: Vec<Complex64> =
            phasors.iter().enumerate().map(|(k, x)| whole(&(x * Complex64::from_polar(1.0, minimum[k])), k)).collect();
        let [from, to] = BEGINS_S.map(|s| s * self.grid.sample_rate_hz);
        // What comes before the arrival lies at the frame's end.
        let begun = |i: usize| {
            let at = if i > n_fft / 2 { i as f64 - n_fft as f64 } else { i as f64 };
            0.5 - 0.5 * (0.5 * TAU * ((at - from) / (to - from)).clamp(0.0, 1.0)).cos()
        };
        // To and fro between sounds of these energies and sounds that begin there (Fienup 1982, error reduction).
        for _ in 0..ROUNDS {
            let mut time = signal(sound, n_fft);
            time.iter_mut().enumerate().for_each(|(i, v)| *v *= begun(i));
            sound = spectrum(time, n_fft).iter().enumerate().map(|(k, x)| whole(x, k)).collect();
        }
        sound.iter().zip(&minimum).map(|(x, minimum)| single(x.arg() - minimum)).collect()
    }

    /// Changes the gains of taps and late part.
    fn time_filters(&self, gains: &mut [f32]) {
        for gains in gains.chunks_exact_mut(self.shape.tap_len()) {
            gains.iter_mut().zip(&self.room).for_each(|(tap, gain)| *tap *= gain);
        }
    }

    /// A table of time filters, changed.
    fn room_of(&self, room: &Field) -> Field {
        let shape = room.shape();
        let Some(rows) = room.rows().whole(&shape) else { return room.clone() };
        let mut rows = rows.into_owned();
        for row in rows.chunks_exact_mut(shape.row_len()) {
            self.time_filters(&mut row[shape.direct_len()..]);
        }
        // Of the same shape as before.
        Field::new(room.grid().clone(), shape, Rows::Whole(rows)).unwrap_or_else(|| room.clone())
    }

    /// Changes the direct sound of one direction.
    fn direct(&self, row: &mut [f32], direction: Vec3, emitter: &Emitter) {
        let (bins, n_fft) = (self.shape.bins, self.grid.n_fft);
        let ears = self.head.ears(direction);
        let hz = |k: usize| self.grid.bin_hz(k);
        let old: [Vec<f64>; 2] = [0, 1].map(|ear| (0..bins).map(|k| ears_of(row, bins, k)[ear]).collect());
        let new: [Vec<f64>; 2] = [0, 1].map(|ear| {
            let log = |k: usize| {
                let kept = old[ear][k].max(1e-12).ln();
                let along = (hz(k) / LEVELS_FROM_HZ.0).max(1e-9).ln() / (LEVELS_FROM_HZ.1 / LEVELS_FROM_HZ.0).ln();
                let share = along.clamp(0.0, 1.0);
                kept + share * (emitter.logs[k] + NEPERS_PER_DB * f64::from(at_hz(&ears.levels_db[ear], hz(k))) - kept)
            };
            // Silence stays.
            (0..bins).map(|k| if old[ear][k] > 0.0 { log(k).exp() } else { 0.0 }).collect()
        });
        let after = new.each_ref().map(|gains| minimum_phase(floored_log(gains), n_fft).collect::<Vec<f32>>());
        let cross = (0..bins).map(|k| {
            let phase = f64::from(after[0][k] - after[1][k]);
            // As the head's own delay was found: without the emitter's colour.
            let level_db: f32 = ears.levels_db.iter().map(|ear| at_hz(ear, hz(k))).sum();
            (hz(k), Complex64::from_polar(low_pass_power(hz(k)) * (NEPERS_PER_DB * f64::from(level_db)).exp(), phase))
        });
        // What minimum phase makes of the ears below 1.5 kHz is part of the delay that the head has there.
        row[4 * bins] = single(f64::from(ears.itd_s()) - lag_s(cross));
        for k in 0..bins {
            let (left, right) = (new[0][k], new[1][k]);
            let sum = left + right;
            row[k] = single(0.5 * sum);
            row[bins + k] = if sum > 0.0 { single((right - left) / sum) } else { 0.0 };
            for ear in 0..2 {
                row[(2 + ear) * bins + k] = after[ear][k] + emitter.excess[k];
            }
        }
    }
}

/// Amplitudes of both ears in a bin of a row.
fn ears_of(row: &[f32], bins: usize, bin: usize) -> [f64; 2] {
    let (mixture, difference) = (f64::from(row[bin]), f64::from(row[bins + bin]));
    [(1.0 - difference) * mixture, (1.0 + difference) * mixture]
}
