//! A head: what both ears make of a direction, small enough to be kept in a project.

mod ambisonic;
mod bands;
mod ears;
mod file;
mod harmonics;
mod near;

pub use ambisonic::{Incidence, RESOLVED_HZ, ambisonic_filters};
pub use bands::{HEAD_BANDS, head_band_hz};
pub use ears::{Ears, lag_s, low_pass_power};
pub use file::MAX_HEAD_BYTES;
pub use harmonics::{channels, degree, harmonics, order_of, turning};
pub use near::{NEIGHBOURS, lattice, near, spread};

use crate::number::{single, whole};
use bands::place;
use glam::Vec3;
use near::shares;
use thiserror::Error;

/// Directions that a head keeps; larger sets are thinned out evenly.
pub const MAX_HEAD_DIRECTIONS: usize = 1280;
/// The fewest directions that make a head.
const FEWEST_DIRECTIONS: usize = 12;
/// All around the head at its own height, a measured direction is at most this far, radians.
const LARGEST_GAP: f32 = std::f32::consts::FRAC_PI_4;
/// Directions that are lower and higher than this, as the vertical part of a unit vector, are not at the height of the ears.
const LEVEL_Z: f32 = 0.1;
/// The longest delay of an ear after the head's centre, seconds.
const LONGEST_DELAY_S: f32 = 0.002;
/// Levels are kept in steps of this size from the lowest on, dB.
const LEVEL_STEP_DB: f32 = 0.25;
const LOWEST_DB: f32 = -48.0;
/// Delays are kept in steps of this size, seconds.
const DELAY_STEP_S: f32 = 1e-7;
/// Parts of a direction are kept in steps of this size.
const DIRECTION_STEP: f32 = 1.0 / 32_000.0;

/// Why measurements, or the bytes of a file, make no head.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum HeadError {
    /// Something in it is not what a head needs.
    #[error("{what}: expected {expected}, found {found}")]
    Value {
        /// What is wrong.
        what: &'static str,
        /// What would have been right.
        expected: String,
        /// What is there.
        found: String,
    },
}

impl HeadError {
    fn value(what: &'static str, expected: impl Into<String>, found: impl ToString) -> Self {
        Self::Value { what, expected: expected.into(), found: found.to_string() }
    }
}

/// What was measured of a head in one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct HeadDirection {
    /// Towards the source in the head's frame; of any length but 0.
    pub direction: Vec3,
    /// Delay of the left and the right ear below 1.5 kHz, seconds, against any moment that is the same for all directions;
    /// between the ears the lag of the cross-correlation's maximum, equalised for a diffuse field.
    pub delays_s: [f32; 2],
    /// Level of the left and the right ear by band, dB, against any level that is the same for all directions.
    pub levels_db: [[f32; HEAD_BANDS]; 2],
}

/// The responses of a head in a free field, as levels by band and delays: with the minimum phase of the levels they are as good
/// as the responses themselves (Kulkarni, Isabelle and Colburn 1999). The delays are those below 1.5 kHz, where people localise
/// by time.
///
/// Made of a SOFA file or of the built-in head off the audio thread; scenes, simulations and renderers share it, immutable.
///
/// Levels are equalised for a diffuse field: over all directions and both ears their energy is 1 in every band. What
/// loudspeaker, microphones and ear canals had in common with all directions is gone with that (Larcher, Jot and Vandernoot
/// 1998).
#[derive(Clone, Debug, PartialEq)]
pub struct Head {
    name: String,
    credit: String,
    notes: Vec<String>,
    /// Whether all directions lie at the height of the ears.
    level: bool,
    directions: Vec<[i16; 3]>,
    units: Vec<Vec3>,
    delays: Vec<[i16; 2]>,
    /// `[direction][ear][band]`
    levels: Vec<u8>,
}

impl Head {
    /// A head of a name, of whom to credit for it, and of what was measured.
    ///
    /// A set of one side alone is mirrored. Of a set at the height of the ears, directions above and below are heard like the
    /// one with the same angle to the ears' axis.
    ///
    /// # Errors
    /// Fewer than 12 directions, a gap of more than 45 degrees around the head at its height, numbers that are not finite, ears
    /// that are further apart than a head's.
    pub fn new(name: &str, credit: &str, mut measured: Vec<HeadDirection>) -> Result<Self, HeadError> {
        let mut notes = Vec::new();
        let finite = |m: &HeadDirection| m.delays_s.iter().chain(m.levels_db.iter().flatten()).all(|v| v.is_finite());
        for m in &mut measured {
            let found = m.direction;
            let unit = found.try_normalize().ok_or_else(|| HeadError::value("direction", "one that is not zero", found))?;
            m.direction = unit;
        }
        if !measured.iter().all(finite) {
            return Err(HeadError::value("levels and delays", "finite numbers", "others"));
        }
        if mirror(&mut measured) {
            notes.push("one side of the head was measured: the other is its mirror image".to_owned());
        }
        if measured.len() < FEWEST_DIRECTIONS {
            return Err(HeadError::value("directions", format!("at least {FEWEST_DIRECTIONS}"), measured.len()));
        }
        let mut units: Vec<Vec3> = measured.iter().map(|m| m.direction).collect();
        check_gap(&units)?;
        if units.len() > MAX_HEAD_DIRECTIONS {
            let kept = spread(&units, MAX_HEAD_DIRECTIONS);
            notes.push(format!("{} of {} directions are kept", kept.len(), units.len()));
            measured = kept.into_iter().map(|i| measured[i].clone()).collect();
            units = measured.iter().map(|m| m.direction).collect();
        }
        let level = is_level(&units);
        if level {
            notes.push(
                "it was measured at the height of the ears only: sources above and below sound as if they were there"
                    .to_owned(),
            );
        }
        let shares = shares(&units);
        let centre_s: f32 = measured.iter().zip(&shares).map(|(m, w)| w * 0.5 * (m.delays_s[0] + m.delays_s[1])).sum();
        let mut delays = Vec::with_capacity(measured.len());
        for m in &measured {
            let found = m.delays_s.map(|d| d - centre_s);
            if (found[0] - found[1]).abs() > LONGEST_DELAY_S {
                let expected = format!("less than {LONGEST_DELAY_S} s between the ears");
                return Err(HeadError::value("delays", expected, format!("{} s", (found[0] - found[1]).abs())));
            }
            // What is earlier or later at both ears alike is no matter of the head beyond this.
            delays.push(found.map(|d| steps16(d.clamp(-LONGEST_DELAY_S, LONGEST_DELAY_S) / DELAY_STEP_S)));
        }
        let diffuse_db: [f32; HEAD_BANDS] = std::array::from_fn(|band| {
            let energies = measured.iter().zip(&shares);
            let energy = |db: f32| 10.0_f64.powf(f64::from(db) / 10.0);
            let sum: f64 = energies
                .map(|(m, w)| f64::from(*w) * 0.5 * (energy(m.levels_db[0][band]) + energy(m.levels_db[1][band])))
                .sum();
            single(10.0 * sum.max(1e-30).log10())
        });
        let bands = measured.iter().flat_map(|m| &m.levels_db).flat_map(|ear| ear.iter().zip(&diffuse_db));
        Ok(Self {
            name: name.to_owned(),
            credit: credit.to_owned(),
            notes,
            level,
            directions: units.iter().map(|d| (*d / DIRECTION_STEP).to_array().map(steps16)).collect(),
            delays,
            levels: bands.map(|(level, diffuse)| steps8((level - diffuse - LOWEST_DB) / LEVEL_STEP_DB)).collect(),
            units: Vec::new(),
        }
        .with_units())
    }

    /// Directions as they are kept.
    fn with_units(mut self) -> Self {
        let unit = |d: &[i16; 3]| Vec3::from_array(d.map(f32::from)).normalize_or(Vec3::X);
        self.units = self.directions.iter().map(unit).collect();
        self
    }

    /// Name of the head or of its set.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Renames the head.
    #[must_use]
    pub fn named(self, name: &str) -> Self {
        Self { name: name.to_owned(), ..self }
    }

    /// Whom to credit for the measurements.
    #[must_use]
    pub fn credit(&self) -> &str {
        &self.credit
    }

    /// What was assumed, in words.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Unit vectors of the directions: forward, left, up.
    #[must_use]
    pub fn directions(&self) -> &[Vec3] {
        &self.units
    }

    /// Bytes in memory.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        self.levels.len() + self.units.len() * (size_of::<Vec3>() + size_of::<[i16; 5]>()) + size_of::<Self>()
    }

    /// What both ears make of a direction of unit length, interpolated between those that were measured around it.
    #[must_use]
    pub fn ears(&self, direction: Vec3) -> Ears {
        let towards = if self.level { at_ears_height(direction) } else { direction };
        let mut ears = Ears { delays_s: [0.0; 2], levels_db: [[0.0; HEAD_BANDS]; 2] };
        for (index, weight) in near(&self.units, towards) {
            for (sum, delay) in ears.delays_s.iter_mut().zip(self.delays[index]) {
                *sum += weight * f32::from(delay) * DELAY_STEP_S;
            }
            let levels = &self.levels[2 * HEAD_BANDS * index..][..2 * HEAD_BANDS];
            for (sum, level) in ears.levels_db.iter_mut().flatten().zip(levels) {
                *sum += weight * (LOWEST_DB + LEVEL_STEP_DB * f32::from(*level));
            }
        }
        ears
    }

    /// Level by band of both ears together over some directions, each with its weight, dB; 0 for all directions alike.
    #[must_use]
    pub fn around_db(&self, directions: impl IntoIterator<Item = (Vec3, f32)>) -> [f32; HEAD_BANDS] {
        let [left, right] = self.means_db(directions);
        std::array::from_fn(|band| {
            let energy = |db: f32| 10.0_f32.powf(db / 10.0);
            10.0 * (0.5 * (energy(left[band]) + energy(right[band]))).log10()
        })
    }

    /// Level of each ear by band in a diffuse field against that of both, dB.
    #[must_use]
    pub fn diffuse_db(&self) -> [[f32; HEAD_BANDS]; 2] {
        self.means_db(self.units.iter().copied().zip(shares(&self.units)))
    }

    fn means_db(&self, directions: impl IntoIterator<Item = (Vec3, f32)>) -> [[f32; HEAD_BANDS]; 2] {
        let (mut sums, mut weights) = ([[0.0_f32; HEAD_BANDS]; 2], 0.0);
        for (direction, weight) in directions {
            let ears = self.ears(direction);
            for (sum, level) in sums.iter_mut().flatten().zip(ears.levels_db.iter().flatten()) {
                *sum += weight * 10.0_f32.powf(level / 10.0);
            }
            weights += weight;
        }
        sums.map(|ear| ear.map(|sum| 10.0 * (sum / weights).max(1e-20).log10()))
    }
}

/// A value by band at a frequency, linear on the scale of the bands and held beyond their ends.
#[must_use]
pub fn at_hz(bands: &[f32; HEAD_BANDS], hz: f64) -> f32 {
    let (band, fraction) = place(hz);
    bands[band] + fraction * (bands[band + 1] - bands[band])
}

/// Completes a set of one side by its mirror image; returns whether there was just one.
fn mirror(measured: &mut Vec<HeadDirection>) -> bool {
    let beside = |side: f32| measured.iter().filter(|m| side * m.direction.y > LEVEL_Z).count();
    let (left, right) = (beside(1.0), beside(-1.0));
    if (left == 0) == (right == 0) {
        return false;
    }
    let image = |m: &HeadDirection| HeadDirection {
        direction: m.direction * Vec3::new(1.0, -1.0, 1.0),
        delays_s: [m.delays_s[1], m.delays_s[0]],
        levels_db: [m.levels_db[1], m.levels_db[0]],
    };
    let images: Vec<_> = measured.iter().filter(|m| m.direction.y.abs() > LEVEL_Z).map(image).collect();
    measured.extend(images);
    true
}

fn is_level(units: &[Vec3]) -> bool {
    units.iter().all(|d| d.z.abs() < LEVEL_Z)
}

fn check_gap(units: &[Vec3]) -> Result<(), HeadError> {
    const AZIMUTHS: u16 = 72;
    for i in 0..AZIMUTHS {
        let degrees = f32::from(i) * 360.0 / f32::from(AZIMUTHS);
        let (sin, cos) = degrees.to_radians().sin_cos();
        let here = Vec3::new(cos, sin, 0.0);
        let nearest = units.iter().map(|d| d.dot(here)).fold(-1.0_f32, f32::max).clamp(-1.0, 1.0).acos();
        if nearest > LARGEST_GAP {
            let expected = format!("one within {} degrees of every place around the head", LARGEST_GAP.to_degrees().round());
            let found = format!("none within {:.0} degrees of azimuth {degrees} (positive to the left)", nearest.to_degrees());
            return Err(HeadError::value("directions", expected, found));
        }
    }
    Ok(())
}

/// The direction at the height of the ears with the same angle to their axis.
fn at_ears_height(direction: Vec3) -> Vec3 {
    let y = direction.y.clamp(-1.0, 1.0);
    let ahead = (1.0 - y * y).sqrt();
    Vec3::new(if direction.x < 0.0 { -ahead } else { ahead }, y, 0.0)
}

fn steps16(value: f32) -> i16 {
    let range = f64::from(i16::MIN)..=f64::from(i16::MAX);
    #[expect(clippy::cast_possible_truncation, reason = "clamped to the range")]
    let steps = f64::from(value).round().clamp(*range.start(), *range.end()) as i16;
    steps
}

fn steps8(value: f32) -> u8 {
    u8::try_from(whole(f64::from(value.clamp(0.0, 255.0)).round())).unwrap_or(u8::MAX)
}
