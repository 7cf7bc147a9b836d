//! What every set of measurements must fulfil, and what is odd about it.

use super::set::{Clock, Measurement, Measurements};
use crate::error::FitError;
use promenade_metrics::onset;
use promenade_metrics::statistics::median;

/// Farther than this from the origin, nobody measured a room, metres: places may be in millimetres.
const FARTHEST_M: f64 = 500.0;
/// A direct sound this much earlier than its way, seconds, contradicts its places.
const EARLY_S: f64 = 1e-3;
/// A direct sound this much later than its way may be the delay of a chain that is the same for all responses.
const SPREAD_S: f64 = 2e-3;
/// Pieces of a response, seconds, and from when on one as loud as the direct sound is none of its echoes.
const PIECE_S: f64 = 0.005;
const SECOND_S: f64 = 0.03;
/// Energy of such a piece over that of the direct sound, and over the median of those about it.
const SECOND: (f64, f64) = (0.25, 10.0);
/// Decay below its loudest piece that a response should show at its end, dB.
const DECAYED_DB: f64 = 30.0;

impl Measurements {
    /// Refuses what cannot be and notes what is odd.
    ///
    /// # Errors
    /// No response; one that is silent or has samples that are not finite; a place that is not finite, farther than 500 m from
    /// the origin or that source and microphone share.
    pub fn check(&mut self) -> Result<(), FitError> {
        if self.all.is_empty() {
            return Err(FitError::argument("measurements", "at least one response", "none"));
        }
        if self.sample_rate_hz < 4000 {
            return Err(FitError::argument("sample rate of the measurements", "at least 4000 Hz", self.sample_rate_hz));
        }
        for one in &self.all {
            for (what, place) in [("source", &one.source), ("microphone", &one.microphone)] {
                let far = place.at_m.iter().any(|c| !c.is_finite() || c.abs() > FARTHEST_M);
                if far {
                    let expected = format!("its {what} within {FARTHEST_M} m of the origin, in metres");
                    return Err(crate::error::measurement(&one.name, expected, format!("{:?}", place.at_m)));
                }
                if !(0.0..=10.0).contains(&place.sd_m) {
                    return Err(crate::error::measurement(&one.name, "an uncertainty of 0 to 10 m", place.sd_m));
                }
            }
            if one.distance_m() < 1e-3 {
                return Err(crate::error::measurement(&one.name, "a microphone away from the source", "both in one place"));
            }
            if let Some(bad) = one.samples.iter().find(|v| !v.is_finite()) {
                return Err(crate::error::measurement(&one.name, "finite samples", bad));
            }
            if onset(&one.samples).is_none() {
                return Err(crate::error::measurement(&one.name, "a sound", "silence"));
            }
        }
        self.note_ends();
        self.note_times();
        self.note_second_sounds();
        Ok(())
    }

    /// Refuses a source or a microphone outside of a box along the axes, given by its least and greatest coordinates, metres.
    pub(crate) fn check_within(&self, [low, high]: [[f64; 3]; 2]) -> Result<(), FitError> {
        for one in &self.all {
            for (what, at) in [("source", one.source.at_m), ("microphone", one.microphone.at_m)] {
                if (0..3).any(|a| at[a] < low[a] || at[a] > high[a]) {
                    let expected = format!("its {what} in the room from {low:?} to {high:?} m");
                    return Err(crate::error::measurement(&one.name, expected, format!("{at:?}")));
                }
            }
        }
        Ok(())
    }

    /// Responses in which something as loud as the direct sound comes later than a room's echo can.
    fn note_second_sounds(&mut self) {
        let rate = f64::from(self.sample_rate_hz);
        let piece = (PIECE_S * rate) as usize;
        let second = |one: &Measurement| -> Option<f64> {
            let start = onset(&one.samples)?.saturating_sub(piece / 5);
            let energies: Vec<f64> =
                one.samples[start..].chunks(piece).map(|c| c.iter().map(|v| f64::from(*v).powi(2)).sum()).collect();
            let about = |i: usize| {
                let near = i.saturating_sub(5)..(i + 6).min(energies.len());
                median(near.filter(|j| j.abs_diff(i) > 1).map(|j| energies[j])).unwrap_or(0.0)
            };
            let from = (SECOND_S / PIECE_S) as usize;
            let loud = |i: &usize| energies[*i] > SECOND.0 * energies[0] && energies[*i] > SECOND.1 * about(*i);
            (from..energies.len()).find(loud).map(|i| i as f64 * PIECE_S)
        };
        let found: Vec<(f64, &str)> = self.all.iter().filter_map(|m| Some((second(m)?, m.name.as_str()))).collect();
        if let Some((later_s, name)) = found.first() {
            self.notes.push(format!(
                "a second sound as loud as the direct one comes in {} of {} responses ({name}, {:.0} ms later, first): two \
                 sources, or two measurements, in one response, or a direct way that is blocked",
                found.len(),
                self.all.len(),
                1e3 * later_s
            ));
        }
    }

    /// Responses that end before they have decayed.
    fn note_ends(&mut self) {
        let piece = (self.sample_rate_hz / 50) as usize;
        let short: Vec<&str> = self
            .all
            .iter()
            .filter(|one| {
                let powers: Vec<f64> =
                    one.samples.chunks(piece).map(|c| c.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>()).collect();
                let loudest = powers.iter().copied().fold(0.0, f64::max);
                // The last whole piece that is not padding.
                let last = powers[..powers.len().saturating_sub(1)].iter().rev().find(|p| **p > 0.0);
                last.is_some_and(|p| 10.0 * (loudest / p).log10() < DECAYED_DB)
            })
            .map(|one| one.name.as_str())
            .collect();
        if let Some(first) = short.first() {
            self.notes.push(format!(
                "{} of {} responses end less than {DECAYED_DB} dB below their loudest 20 ms ({first} first): reverberation \
                 times and clarities of these are not to be trusted",
                short.len(),
                self.all.len()
            ));
        }
    }

    /// Times of arrival that contradict the places.
    fn note_times(&mut self) {
        let rate = f64::from(self.sample_rate_hz);
        let speed = self.air.speed_m_s();
        let late = |one: &Measurement| onset(&one.samples).map(|at| at as f64 / rate - one.distance_m() / speed);
        let known: Vec<(f64, &str)> = self
            .all
            .iter()
            .filter(|one| one.clock == Clock::Known)
            .filter_map(|one| Some((late(one)?, one.name.as_str())))
            .collect();
        let Some(median) = median(known.iter().map(|(t, _)| *t)) else { return };
        let early: Vec<&(f64, &str)> = known.iter().filter(|(t, _)| *t < -EARLY_S).collect();
        let odd: Vec<&(f64, &str)> = known.iter().filter(|(t, _)| (t - median).abs() > SPREAD_S).collect();
        let mut notes = Vec::new();
        if let Some((t, name)) = early.first() {
            notes.push(format!(
                "{} responses begin before sound can have come from their source ({name} by {:.1} ms first): places, their \
                 unit or the clock are wrong",
                early.len(),
                -1e3 * t
            ));
        }
        if let Some((t, name)) = odd.first().filter(|_| odd.len() < known.len()) {
            notes.push(format!(
                "the direct sound of {} of {} responses is more than {} ms off the others' delay ({name}, by {:+.1} ms, \
                 first): their places may be permuted, or their clocks free",
                odd.len(),
                known.len(),
                1e3 * SPREAD_S,
                1e3 * (t - median)
            ));
        }
        self.notes.extend(notes);
    }
}
