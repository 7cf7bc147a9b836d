//! Headphones as a project keeps them.

use super::autoeq::{HZ, MAX_FILTERS, QUALITIES, refused};
use super::{Correction, EqFilter, EqKind, HEADPHONE_POINTS, Headphones, HeadphonesError, MOST_DB};
use serde::{Deserialize, Serialize};

/// The form that is written.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Saved {
    /// Filters: type, Hz, dB and Q.
    Equaliser { preamp_db: f64, filters: Vec<(EqKind, f64, f64, f64)> },
    /// Levels of left and right ear, dB.
    Levels([Vec<f32>; 2]),
}

impl From<Headphones> for Saved {
    fn from(Headphones(correction): Headphones) -> Self {
        match correction {
            Correction::Equaliser { preamp_db, filters } => {
                Self::Equaliser { preamp_db, filters: filters.iter().map(|f| (f.kind, f.hz, f.gain_db, f.q)).collect() }
            }
            Correction::Levels(levels) => Self::Levels(levels.map(Vec::from)),
        }
    }
}

impl TryFrom<Saved> for Headphones {
    type Error = HeadphonesError;

    fn try_from(saved: Saved) -> Result<Self, HeadphonesError> {
        match saved {
            Saved::Equaliser { preamp_db, filters } => {
                let gain = -MOST_DB..=MOST_DB;
                let fits = |(_, hz, gain_db, q): &(EqKind, f64, f64, f64)| {
                    HZ.contains(hz) && gain.contains(gain_db) && QUALITIES.contains(q)
                };
                if filters.len() > MAX_FILTERS || !gain.contains(&preamp_db) || !filters.iter().all(fits) {
                    return Err(refused("filters", "at most 64 with numbers within their ranges", "others"));
                }
                let filters = filters.into_iter().map(|(kind, hz, gain_db, q)| EqFilter { kind, hz, gain_db, q }).collect();
                Ok(Self(Correction::Equaliser { preamp_db, filters }))
            }
            Saved::Levels(levels) => {
                let points = |ear: Vec<f32>| {
                    <[f32; HEADPHONE_POINTS]>::try_from(ear)
                        .map_err(|ear| refused("levels", format!("{HEADPHONE_POINTS} of each ear"), ear.len().to_string()))
                };
                let [left, right] = levels;
                Self::from_levels([points(left)?, points(right)?])
            }
        }
    }
}
