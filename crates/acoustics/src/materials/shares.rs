//! Shares that are stated by octaves or thirds.

use crate::materials::curve::Curve;
use crate::octave::{BANDS, LOW_HZ, OCTAVES_HZ, Octaves};

/// How far from its middle a band of an octave may lie, octaves: the outer thirds lie a third of an octave away.
const WITHIN: f64 = 0.45;
/// More bands than from 16 Hz to 16 kHz are closer than octaves.
const MOST_OCTAVES: usize = 11;

/// Shares by octave, that at 63 Hz where something is stated there, and all of them where they are closer than octaves.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shares {
    pub(crate) octaves: Octaves,
    pub(crate) low: Option<f32>,
    pub(crate) fine: Curve,
}

impl Shares {
    /// One share at all frequencies.
    pub(crate) fn even(share: f32) -> Self {
        Self { octaves: [share; BANDS], low: None, fine: Curve::default() }
    }

    /// Of bands `[hz, share]` in any order: an octave has the mean of the bands within it, one without any what lies between
    /// its neighbours over the logarithm of frequency, or beyond them the nearest. None without bands.
    pub(crate) fn of(bands: &[[f64; 2]]) -> Option<Self> {
        let closer = bands.len() > MOST_OCTAVES;
        let fine = if closer { bands.iter().map(|band| band.map(|v| v as f32)).collect() } else { Vec::new() };
        let mut bands: Vec<[f64; 2]> = bands.iter().map(|[hz, share]| [hz.log2(), *share]).collect();
        bands.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let (first, last) = (*bands.first()?, *bands.last()?);
        let mean = |hz: f64| {
            let within = bands.iter().filter(|band| (band[0] - hz.log2()).abs() < WITHIN);
            let (count, sum) = within.fold((0_u32, 0.0), |(count, sum), band| (count + 1, sum + band[1]));
            (count > 0).then(|| sum / f64::from(count))
        };
        let between = |hz: f64| {
            let place = hz.log2();
            let pair = bands.windows(2).find(|pair| pair[0][0] <= place && place <= pair[1][0]);
            pair.map_or(if place < first[0] { first[1] } else { last[1] }, |pair| {
                let [[from, a], [to, b]] = [pair[0], pair[1]];
                if to > from { a + (b - a) * (place - from) / (to - from) } else { a }
            })
        };
        Some(Self {
            octaves: OCTAVES_HZ.map(|hz| mean(f64::from(hz)).unwrap_or_else(|| between(f64::from(hz))) as f32),
            low: mean(LOW_HZ).map(|share| share as f32),
            fine: Curve::new(fine),
        })
    }

    /// Of a row of numbers alone, told by how many there are: one; octaves from 125 Hz (7) or 63 Hz (8) to 8 kHz; thirds from
    /// 100 Hz (21) or 50 Hz (24) to 10 kHz, or from 20 Hz to 20 kHz (31).
    pub(crate) fn of_row(row: &[f32]) -> Option<Self> {
        let thirds = |from: i32| -> Option<Self> {
            let band = |(n, share): (i32, &f32)| [1000.0 * (f64::from(from + n) / 3.0).exp2(), f64::from(*share)];
            Self::of(&(0..).zip(row).map(band).collect::<Vec<_>>())
        };
        match row.len() {
            1 => Some(Self::even(row[0])),
            BANDS => Some(Self { octaves: std::array::from_fn(|b| row[b]), low: None, fine: Curve::default() }),
            8 => Some(Self { octaves: std::array::from_fn(|b| row[b + 1]), low: Some(row[0]), fine: Curve::default() }),
            21 => thirds(-10),
            24 => thirds(-13),
            31 => thirds(-17),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn octaves_are_the_means_of_their_thirds() {
        // 20 Hz to 20 kHz, each its own number.
        let row: Vec<f32> = (0..31_u8).map(f32::from).collect();
        let all = Shares::of_row(&row).unwrap();
        assert_eq!((all.low, all.octaves), (Some(5.0), [8.0, 11.0, 14.0, 17.0, 20.0, 23.0, 26.0]));
        let of = |from: usize| Shares::of_row(&row[from..28]).map(|s| (s.octaves, s.low, s.fine.points().len()));
        assert_eq!((of(4), of(7)), (Some((all.octaves, all.low, 24)), Some((all.octaves, None, 21))));
        assert!((all.fine.at(1259.9).unwrap() - 18.0).abs() < 1e-3, "thirds stay beside their octaves");
        let eight = Shares::of_row(&[0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]).unwrap();
        assert_eq!((eight.low, eight.octaves[0], eight.octaves[6]), (Some(0.5), 1.0, 7.0));
        assert_eq!(Shares::of_row(&row[..9]), None);
        // Nominal frequencies; one octave is not there, and none above 1 kHz.
        let some = Shares::of(&[[1000.0, 0.4], [125.0, 0.1], [500.0, 0.3], [63.0, 0.0]]).unwrap();
        assert_eq!(some.low, Some(0.0));
        for (found, wanted) in some.octaves.iter().zip([0.1, 0.2, 0.3, 0.4, 0.4, 0.4, 0.4]) {
            assert!((found - wanted).abs() < 1e-6, "{some:?}");
        }
    }
}
