//! How far refined responses are from measured ones.

use super::levels::in_db;
use super::{Pair, Refiner, Solver};
use promenade_baker::BakeError;
use promenade_core::random::Random;
use promenade_metrics::{DecayRange, c50_db, decay_time_s, onset};

/// Draws of a distribution of levels.
const DRAWS: usize = 8;

/// Mean distances over pairs, channels and, of levels, cells that tell something.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    /// Early decay time, milliseconds.
    pub edt_ms: f64,
    /// Clarity of the first 50 ms, dB.
    pub c50_db: f64,
    /// Levels by hop and band, dB.
    pub level_db: f64,
    /// Levels by hop and band as distributions, the continuous ranked probability score, dB.
    pub crps_db: f64,
    /// Level between the first two channels, dB; 0 of one channel.
    pub ild_db: f64,
}

/// The continuous ranked probability score of draws against what was measured: the mean distance of the draws from it less half
/// of their mean distance from each other, in its form for few draws that has no bias (Gneiting and Raftery 2007; Zamo and
/// Naveau 2018).
#[must_use]
pub fn crps_db(draws: &[f32], measured: f32) -> f64 {
    let count = draws.len() as f64;
    let off = draws.iter().map(|x| f64::from((x - measured).abs())).sum::<f64>() / count;
    let between: f64 =
        draws.iter().enumerate().flat_map(|(i, a)| draws[..i].iter().map(move |b| f64::from((a - b).abs()))).sum();
    off - if draws.len() > 1 { between / (count * (count - 1.0)) } else { 0.0 }
}

/// Scores a refinement, or without one the simulation itself brought to the level of `level_db`, on pairs.
///
/// Deterministic refinements are given the distribution that carriers have: a hop of noise in a band has a level that varies by
/// chance, by as many degrees of freedom as the cell has.
///
/// # Errors
/// Those of [`Refiner::refined`].
pub fn score(refiner: &Refiner, is_refined: bool, pairs: &[Pair], solver: Solver) -> Result<Score, BakeError> {
    let mut sums = [(0.0, 0.0); 5];
    let mut add = |what: usize, value: f64| {
        if value.is_finite() {
            sums[what].0 += value;
            sums[what].1 += 1.0;
        }
    };
    let rate = refiner.grid.rate_hz();
    let is_drawn = is_refined && refiner.settings.method.is_drawn();
    for (number, pair) in pairs.iter().enumerate() {
        let seed = number as u64;
        let own = refiner.own(&pair.simulated);
        let count = if is_drawn { DRAWS } else { 1 };
        let drawn = if is_refined { refiner.drawn(&pair.simulated, &own, (solver, count), seed)? } else { own.clone() };
        let first = &drawn[..own.len()];
        let response =
            if is_refined { refiner.with_levels(&pair.simulated, [&own, first]) } else { refiner.unrefined(&pair.simulated) };
        for (found, wanted) in response.iter().zip(&pair.measured) {
            let edt = |x: &Vec<f32>| decay_time_s(&x[onset(x).unwrap_or(0)..], rate, DecayRange::EDT).unwrap_or(f64::NAN);
            let c50 = |x: &Vec<f32>| c50_db(&x[onset(x).unwrap_or(0)..], rate).unwrap_or(f64::NAN);
            add(0, 1e3 * (edt(found) - edt(wanted)).abs());
            add(1, (c50(found) - c50(wanted)).abs());
        }
        if let ([a, b, ..], [c, d, ..]) = (&response[..], &pair.measured[..]) {
            let energy = |x: &[f32]| x.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
            let ild = |l: &[f32], r: &[f32]| 10.0 * (energy(l) / energy(r)).log10();
            add(4, (ild(a, b) - ild(c, d)).abs());
        }
        let (wanted, told) = refiner.levels_of(&pair.measured);
        let found = in_db(first);
        let draws: Vec<Vec<f32>> = if is_drawn {
            drawn.chunks(own.len()).map(in_db).collect()
        } else {
            let mut random = Random::new(seed ^ 0xCA22_1E25);
            (0..DRAWS).map(|_| refiner.grid.carried(&found, &mut random)).collect()
        };
        for i in (0..wanted.len()).filter(|i| told[*i]) {
            let of: Vec<f32> = draws.iter().map(|levels| levels[i]).collect();
            add(2, f64::from((found[i] - wanted[i]).abs()));
            add(3, crps_db(&of, wanted[i]));
        }
    }
    let [edt_ms, c50_db, level_db, crps_db, ild_db] = sums.map(|(sum, count)| if count > 0.0 { sum / count } else { 0.0 });
    Ok(Score { edt_ms, c50_db, level_db, crps_db, ild_db })
}
