//! Compensation of headphones: what their response needs at either ear, at any sample rate, without delay.

mod autoeq;
mod biquad;
mod encoding;
mod parallel;
mod saved;
mod stage;

pub use stage::HeadphoneStage;

use crate::number::{bounded, single, whole};
use biquad::Biquad;
use parallel::Parallel;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Points of a curve of levels: twelve an octave from 20 Hz to 20.5 kHz.
pub const HEADPHONE_POINTS: usize = 121;
/// Levels beyond this are no compensation, dB: of one filter, a preamplification or a point of a curve.
const MOST_DB: f64 = 60.0;
/// The most that all filters of an ear may raise any frequency together, dB.
const MOST_RAISED_DB: f64 = 40.0;
/// Sample rate at which that is looked at, Hz, and frequencies an octave beside the filters' own.
const LOOKED_AT_HZ: f64 = 192_000.0;
const LOOKED_AT_PER_OCTAVE: f64 = 24.0;

/// Frequency of a point of a curve, Hz.
#[must_use]
pub fn headphone_point_hz(point: usize) -> f64 {
    20.0 * (point as f64 / 12.0).exp2()
}

/// Why a text or a measurement makes no compensation.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{place}: expected {expected}, found {found}")]
pub struct HeadphonesError {
    /// Line of the text, or part of the measurement.
    pub place: String,
    /// What would have been right.
    pub expected: String,
    /// What is there.
    pub found: String,
}

/// A filter of an equaliser.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EqFilter {
    pub(crate) kind: EqKind,
    pub(crate) hz: f64,
    pub(crate) gain_db: f64,
    pub(crate) q: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum EqKind {
    Peak,
    LowShelf,
    HighShelf,
    LowPass,
    HighPass,
    BandPass,
    Notch,
    AllPass,
}

/// What one ear needs: filters one after another, and a gain.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Chain {
    pub(crate) preamp_db: f64,
    pub(crate) filters: Vec<EqFilter>,
}

impl Chain {
    /// The frequency that it raises most, Hz, and by how much, dB.
    fn loudest(&self) -> (f64, f64) {
        let biquads: Vec<Biquad> =
            self.filters.iter().filter(|f| f.hz < 0.49 * LOOKED_AT_HZ).map(|f| Biquad::of(f, LOOKED_AT_HZ)).collect();
        let steps = whole(LOOKED_AT_PER_OCTAVE * (0.49 * LOOKED_AT_HZ).log2());
        let even = (0..steps).map(|i| (i as f64 / LOOKED_AT_PER_OCTAVE).exp2());
        let own = self.filters.iter().map(|filter| filter.hz.min(0.49 * LOOKED_AT_HZ));
        let level = |hz: f64| self.preamp_db + biquads.iter().map(|b| b.level_db(hz / LOOKED_AT_HZ)).sum::<f64>();
        even.chain(own)
            .map(|hz| (hz, level(hz)))
            .fold((1.0, f64::NEG_INFINITY), |most, one| if one.1 > most.1 { one } else { most })
    }
}

#[derive(Clone, Debug, PartialEq)]
enum Correction {
    /// Of left and right ear.
    Equaliser([Chain; 2]),
    /// Levels of each ear by point, dB.
    Levels(Box<[[f32; HEADPHONE_POINTS]; 2]>),
}

/// What a pair of headphones needs to sound neutral. It is for any sample rate.
///
/// Read from a text or a measurement off the audio thread, where a [`HeadphoneFilter`] is made of it for each sample rate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "saved::Saved", into = "saved::Saved")]
pub struct Headphones(Correction);

impl Headphones {
    /// Of a text by AutoEq or for Equalizer APO: filters ("ParametricEQ.txt") or levels ("GraphicEQ.txt"), for both ears or,
    /// below a line "Channel:", for one.
    ///
    /// # Errors
    /// A line that is neither, numbers out of reach, no filter at all, or filters that raise a frequency by more than 40 dB
    /// together.
    pub fn from_text(text: &str) -> Result<Self, HeadphonesError> {
        Self::of(autoeq::read(text)?)
    }

    /// Of a text file's bytes: [`Headphones::from_text`], in UTF-8 or UTF-16.
    ///
    /// # Errors
    /// As there, or bytes that are neither.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, HeadphonesError> {
        Self::from_text(&encoding::text(bytes)?)
    }

    /// What may be worn.
    fn of(correction: Correction) -> Result<Self, HeadphonesError> {
        let loudest = match &correction {
            Correction::Equaliser(ears) => {
                ears.iter().map(Chain::loudest).fold((1.0, f64::NEG_INFINITY), |a, b| if b.1 > a.1 { b } else { a })
            }
            Correction::Levels(levels) => {
                let points = levels.iter().flat_map(|ear| ear.iter().enumerate());
                let each = points.map(|(i, db)| (headphone_point_hz(i), f64::from(*db)));
                each.fold((1.0, f64::NEG_INFINITY), |a, b| if b.1 > a.1 { b } else { a })
            }
        };
        if loudest.1 > MOST_RAISED_DB {
            return Err(HeadphonesError {
                place: "gain of all filters".to_owned(),
                expected: format!("at most {MOST_RAISED_DB} dB at any frequency"),
                found: format!("{:.0} dB at {:.0} Hz", loudest.1, loudest.0),
            });
        }
        Ok(Self(correction))
    }

    /// Of the levels that left and right ear need, dB, by [`headphone_point_hz`]. Below and above, the first and the last hold.
    ///
    /// # Errors
    /// Levels that are not finite, beyond 60 dB, or above 40 dB.
    pub fn from_levels(levels_db: [[f32; HEADPHONE_POINTS]; 2]) -> Result<Self, HeadphonesError> {
        match levels_db.iter().flatten().find(|db| !(-MOST_DB..=MOST_DB).contains(&f64::from(**db))) {
            Some(db) => Err(HeadphonesError {
                place: "levels".to_owned(),
                expected: "at most 60 dB".to_owned(),
                found: format!("{db} dB"),
            }),
            None => Self::of(Correction::Levels(Box::new(levels_db))),
        }
    }

    /// The filter at a sample rate, Hz.
    ///
    /// Filters of an equaliser become biquads by the bilinear transform; one whose frequency half of the rate cannot hold is
    /// left out, but for the gain of a low shelf. Levels become sections in parallel with fixed poles (Bank 2008), fitted to
    /// their minimum phase.
    ///
    /// # Real-time
    /// Not real-time safe: allocates, and solves for the sections.
    #[must_use]
    pub fn filter(&self, sample_rate_hz: f64) -> HeadphoneFilter {
        let ears = match &self.0 {
            Correction::Equaliser(ears) => ears.each_ref().map(|Chain { preamp_db, filters }| {
                let fits = |filter: &&EqFilter| filter.hz < 0.49 * sample_rate_hz;
                let beyond = filters.iter().filter(|filter| !fits(filter) && filter.kind == EqKind::LowShelf);
                let gain_db = preamp_db + beyond.map(|filter| filter.gain_db).sum::<f64>();
                let biquads: Vec<Biquad> = filters.iter().filter(fits).map(|f| Biquad::of(f, sample_rate_hz)).collect();
                Ear::Series { gain: 10.0_f64.powf(gain_db / 20.0), biquads }
            }),
            Correction::Levels(levels) => levels.each_ref().map(|levels| Ear::Parallel(Parallel::fit(levels, sample_rate_hz))),
        };
        HeadphoneFilter { ears }
    }
}

#[derive(Clone)]
enum Ear {
    Series { gain: f64, biquads: Vec<Biquad> },
    Parallel(Parallel),
}

/// Headphones' compensation at one sample rate, with its past.
///
/// Made by a loader; the [`HeadphoneStage`] on the audio thread owns it, and gives it back to be dropped elsewhere.
#[derive(Clone)]
pub struct HeadphoneFilter {
    ears: [Ear; 2],
}

impl HeadphoneFilter {
    /// Filters both ears in place.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn process(&mut self, ears: [&mut [f32]; 2]) {
        for (filter, samples) in self.ears.iter_mut().zip(ears) {
            match filter {
                Ear::Series { gain, biquads } => {
                    for sample in samples {
                        let mut x = *gain * f64::from(*sample);
                        for biquad in &mut *biquads {
                            x = biquad.next(x);
                        }
                        *sample = sounding(x);
                    }
                }
                Ear::Parallel(parallel) => {
                    samples.iter_mut().for_each(|sample| *sample = sounding(parallel.next((*sample).into())))
                }
            }
        }
    }

    /// Forgets the past.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn reset(&mut self) {
        for ear in &mut self.ears {
            match ear {
                Ear::Series { biquads, .. } => biquads.iter_mut().for_each(Biquad::reset),
                Ear::Parallel(parallel) => parallel.reset(),
            }
        }
    }
}

/// A sample, 0 below -240 dB, and within the bound of all output: nothing comes after.
fn sounding(x: f64) -> f32 {
    if x.abs() < 1e-12 { 0.0 } else { bounded(single(x)) }
}

/// Level of a curve at a frequency, dB: straight lines over octaves, the ends hold.
fn level_at(levels_db: &[f32; HEADPHONE_POINTS], hz: f64) -> f64 {
    let place = (12.0 * (hz.max(1.0) / 20.0).log2()).clamp(0.0, (HEADPHONE_POINTS - 1) as f64);
    let point = whole(place).min(HEADPHONE_POINTS - 2);
    let (a, b) = (f64::from(levels_db[point]), f64::from(levels_db[point + 1]));
    a + (b - a) * (place - point as f64)
}
