//! Figures of a response, and how far two are apart.
//!
//! Loudness, C50, EDT and T60 are those of a publication. Octave figures and the early echogram are what tells one room's
//! places, and rooms, apart.

use super::published::published;
use crate::bands::FITTED_HZ;
use promenade_metrics::{DecayRange, c50_db, decay_time_s, octave_of, onset};

/// Octaves that are measured, of [`FITTED_HZ`], as far as the rate holds them: 125 Hz to 4 kHz.
const MEASURED: std::ops::Range<usize> = 1..7;
/// The early echogram, seconds after the direct sound: from, to, and length of a piece.
const EARLY_S: (f64, f64, f64) = (0.003, 0.050, 0.004);
/// Energies of the early echogram this far below the octave's direct sound and reflections count as nothing, dB.
const EARLY_FLOOR_DB: f64 = -60.0;

/// What is measured of one response. A figure that a response does not have, such as a reverberation time of one that does not
/// decay, is NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct Figures {
    /// Energy, dB.
    pub loudness_db: f64,
    /// Clarity of the first 50 ms, dB.
    pub c50_db: f64,
    /// Early decay time, seconds.
    pub edt_s: f64,
    /// Reverberation time, seconds.
    pub t60_s: f64,
    /// Reverberation times by octave between -5 and -25 dB, seconds.
    pub octave_t20_s: Vec<f64>,
    /// Clarities by octave, dB.
    pub octave_c50_db: Vec<f64>,
    /// Energies by octave, dB.
    pub octave_level_db: Vec<f64>,
    /// Energies by octave in pieces of 4 ms from 3 to 50 ms after the direct sound, dB, `[octave][piece]`.
    pub early_db: Vec<f64>,
}

/// Mean differences over places: of figures without those that either side does not have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// dB.
    pub loudness_db: f64,
    /// dB.
    pub c50_db: f64,
    /// Milliseconds.
    pub edt_ms: f64,
    /// Per cent of what was measured.
    pub t60_percent: f64,
    /// Per cent of what was measured.
    pub octave_t20_percent: f64,
    /// dB.
    pub octave_c50_db: f64,
    /// dB.
    pub octave_level_db: f64,
    /// dB.
    pub early_db: f64,
}

impl Figures {
    /// Measures a response.
    #[must_use]
    pub fn of(response: &[f32], sample_rate_hz: f64) -> Self {
        let published = published(response, sample_rate_hz);
        let start = onset(response).unwrap_or(0);
        let octaves: Vec<Vec<f32>> = FITTED_HZ[MEASURED]
            .iter()
            .filter(|hz| *hz * std::f64::consts::SQRT_2 < 0.5 * sample_rate_hz)
            .map(|hz| octave_of(response, sample_rate_hz, *hz))
            .collect();
        let power = |x: &[f32]| x.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
        let db = |energy: f64| 10.0 * energy.max(1e-30).log10();
        let samples = |s: f64| (s * sample_rate_hz) as usize;
        let mut early_db = Vec::new();
        for octave in &octaves {
            let from_start = octave.get(start..).unwrap_or_default();
            let floor = db(power(from_start)) + EARLY_FLOOR_DB;
            let (from, to, piece) = EARLY_S;
            let pieces = ((to - from) / piece) as usize;
            early_db.extend((0..pieces).map(|i| {
                let at = samples(from + i as f64 * piece);
                db(power(from_start.get(at..at + samples(piece)).unwrap_or_default())).max(floor)
            }));
        }
        let figure = |of: &dyn Fn(&[f32]) -> Option<f64>| octaves.iter().map(|x| of(x).unwrap_or(f64::NAN)).collect();
        // An octave's own first loud sample is the arrival, as filters without delay leave it.
        Self {
            loudness_db: published[0],
            c50_db: published[1],
            edt_s: published[2],
            t60_s: published[3],
            octave_t20_s: figure(&|x| decay_time_s(x, sample_rate_hz, DecayRange::T20).ok()),
            octave_c50_db: figure(&|x| c50_db(x.get(start..)?, sample_rate_hz).ok()),
            octave_level_db: figure(&|x| Some(db(power(x)))),
            early_db,
        }
    }

    /// All figures in one row.
    #[must_use]
    pub fn row(&self) -> Vec<f64> {
        let first = [self.loudness_db, self.c50_db, self.edt_s, self.t60_s];
        [&first[..], &self.octave_t20_s, &self.octave_c50_db, &self.octave_level_db, &self.early_db].concat()
    }

    /// The figures of a row that has as many octaves as these.
    #[must_use]
    pub fn with_row(&self, row: &[f64]) -> Self {
        let (first, rest) = row.split_at(4.min(row.len()));
        let octaves = self.octave_t20_s.len();
        let part = |i: usize| rest.iter().skip(i * octaves).take(octaves).copied().collect();
        let at = |i: usize| first.get(i).copied().unwrap_or(f64::NAN);
        Self {
            loudness_db: at(0),
            c50_db: at(1),
            edt_s: at(2),
            t60_s: at(3),
            octave_t20_s: part(0),
            octave_c50_db: part(1),
            octave_level_db: part(2),
            early_db: rest.iter().skip(3 * octaves).copied().collect(),
        }
    }

    /// The mean of several, figure by figure; those that one does not have are left out. `None` of none.
    #[must_use]
    pub fn mean(all: &[Self]) -> Option<Self> {
        let first = all.first()?;
        let rows: Vec<Vec<f64>> = all.iter().map(Self::row).collect();
        let row: Vec<f64> = (0..rows[0].len()).map(|i| mean(rows.iter().map(|r| r[i]))).collect();
        Some(first.with_row(&row))
    }
}

impl Errors {
    /// Mean differences of pairs, the prediction first.
    #[must_use]
    pub fn of(pairs: &[(&Figures, &Figures)]) -> Self {
        let each = |of: &dyn Fn(&Figures) -> Vec<f64>, relative: bool| {
            mean(pairs.iter().flat_map(|(found, meant)| {
                let both = of(found).into_iter().zip(of(meant));
                both.map(move |(f, m)| (f - m).abs() / if relative { m } else { 1.0 }).collect::<Vec<f64>>()
            }))
        };
        Self::of_row([
            each(&|f| vec![f.loudness_db], false),
            each(&|f| vec![f.c50_db], false),
            1e3 * each(&|f| vec![f.edt_s], false),
            1e2 * each(&|f| vec![f.t60_s], true),
            1e2 * each(&|f| f.octave_t20_s.clone(), true),
            each(&|f| f.octave_c50_db.clone(), false),
            each(&|f| f.octave_level_db.clone(), false),
            each(&|f| f.early_db.clone(), false),
        ])
    }

    /// Of errors in the order of [`Errors::NAMES`].
    fn of_row(row: [f64; 8]) -> Self {
        let [loudness_db, c50_db, edt_ms, t60_percent, octave_t20_percent, octave_c50_db, octave_level_db, early_db] = row;
        Self { loudness_db, c50_db, edt_ms, t60_percent, octave_t20_percent, octave_c50_db, octave_level_db, early_db }
    }

    /// The errors in the order of [`Errors::NAMES`].
    #[must_use]
    pub fn row(&self) -> [f64; 8] {
        [
            self.loudness_db,
            self.c50_db,
            self.edt_ms,
            self.t60_percent,
            self.octave_t20_percent,
            self.octave_c50_db,
            self.octave_level_db,
            self.early_db,
        ]
    }

    /// What a row holds, with units.
    pub const NAMES: [&'static str; 8] =
        ["loudness dB", "C50 dB", "EDT ms", "T60 %", "octave T20 %", "octave C50 dB", "octave level dB", "early echogram dB"];

    /// The mean of several.
    #[must_use]
    pub fn mean(all: &[Self]) -> Self {
        Self::of_row(std::array::from_fn(|i| mean(all.iter().map(|errors| errors.row()[i]))))
    }
}

/// The mean of what is finite; NaN of nothing.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.filter(|v| v.is_finite()).fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
    sum / count
}
