//! Headphones as a project keeps them.

use super::autoeq::{HZ, MAX_FILTERS, QUALITIES, refused};
use super::{Chain, Correction, EqFilter, EqKind, HEADPHONE_POINTS, Headphones, HeadphonesError, MOST_DB};
use serde::{Deserialize, Serialize};

/// The form that is written.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Saved {
    /// Filters: type, Hz, dB and Q.
    Equaliser { preamp_db: f64, filters: Vec<(EqKind, f64, f64, f64)> },
    /// A filter per ear, left then right, where the ears differ.
    Ears([Filters; 2]),
    /// Levels of left and right ear, dB.
    Levels([Vec<f32>; 2]),
}

/// Filters of one ear.
#[derive(Serialize, Deserialize)]
pub(super) struct Filters {
    preamp_db: f64,
    filters: Vec<(EqKind, f64, f64, f64)>,
}

impl From<Chain> for Filters {
    fn from(Chain { preamp_db, filters }: Chain) -> Self {
        Self { preamp_db, filters: filters.iter().map(|f| (f.kind, f.hz, f.gain_db, f.q)).collect() }
    }
}

impl TryFrom<Filters> for Chain {
    type Error = HeadphonesError;

    fn try_from(Filters { preamp_db, filters }: Filters) -> Result<Self, HeadphonesError> {
        let gain = -MOST_DB..=MOST_DB;
        let fits =
            |(_, hz, gain_db, q): &(EqKind, f64, f64, f64)| HZ.contains(hz) && gain.contains(gain_db) && QUALITIES.contains(q);
        if filters.len() > MAX_FILTERS || !gain.contains(&preamp_db) || !filters.iter().all(fits) {
            return Err(refused("filters", "at most 64 with numbers within their ranges", "others"));
        }
        let filters = filters.into_iter().map(|(kind, hz, gain_db, q)| EqFilter { kind, hz, gain_db, q }).collect();
        Ok(Self { preamp_db, filters })
    }
}

impl From<Headphones> for Saved {
    fn from(Headphones(correction): Headphones) -> Self {
        match correction {
            Correction::Equaliser([left, right]) if left == right => {
                let Filters { preamp_db, filters } = left.into();
                Self::Equaliser { preamp_db, filters }
            }
            Correction::Equaliser(ears) => Self::Ears(ears.map(Filters::from)),
            Correction::Levels(levels) => Self::Levels(levels.map(Vec::from)),
        }
    }
}

impl TryFrom<Saved> for Headphones {
    type Error = HeadphonesError;

    fn try_from(saved: Saved) -> Result<Self, HeadphonesError> {
        match saved {
            Saved::Equaliser { preamp_db, filters } => {
                let both = Chain::try_from(Filters { preamp_db, filters })?;
                Self::of(Correction::Equaliser([both.clone(), both]))
            }
            Saved::Ears([left, right]) => Self::of(Correction::Equaliser([left.try_into()?, right.try_into()?])),
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
