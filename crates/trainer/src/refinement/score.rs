//! How far refined responses are from measured ones.

use super::levels::in_db;
use super::{Pair, Refiner};
use promenade_baker::BakeError;
use promenade_metrics::{DecayRange, c50_db, decay_time_s, onset};

/// Mean distances over pairs, channels and, of levels, cells that tell something.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    /// Early decay time, milliseconds.
    pub edt_ms: f64,
    /// Clarity of the first 50 ms, dB.
    pub c50_db: f64,
    /// Levels by hop and band, dB.
    pub level_db: f64,
    /// Level between the first two channels, dB; 0 of one channel.
    pub ild_db: f64,
}

/// Scores a refinement, or without one the simulation itself brought to the level of what is measured, on pairs.
///
/// # Errors
/// Those of [`Refiner::refined`].
pub fn score(refiner: &Refiner, is_refined: bool, pairs: &[Pair]) -> Result<Score, BakeError> {
    let mut sums = [(0.0, 0.0); 4];
    let mut add = |what: usize, value: f64| {
        if value.is_finite() {
            sums[what].0 += value;
            sums[what].1 += 1.0;
        }
    };
    let rate = refiner.grid.rate_hz();
    for pair in pairs {
        let own = refiner.own(&pair.simulated);
        let levels = if is_refined { refiner.levels(&pair.simulated, &own)? } else { own.clone() };
        let response =
            if is_refined { refiner.with_levels(&pair.simulated, [&own, &levels]) } else { refiner.unrefined(&pair.simulated) };
        for (found, wanted) in response.iter().zip(&pair.measured) {
            let edt = |x: &Vec<f32>| decay_time_s(&x[onset(x).unwrap_or(0)..], rate, DecayRange::EDT).unwrap_or(f64::NAN);
            let c50 = |x: &Vec<f32>| c50_db(&x[onset(x).unwrap_or(0)..], rate).unwrap_or(f64::NAN);
            add(0, 1e3 * (edt(found) - edt(wanted)).abs());
            add(1, (c50(found) - c50(wanted)).abs());
        }
        if let ([a, b, ..], [c, d, ..]) = (&response[..], &pair.measured[..]) {
            let energy = |x: &[f32]| x.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
            let ild = |l: &[f32], r: &[f32]| 10.0 * (energy(l) / energy(r)).log10();
            add(3, (ild(a, b) - ild(c, d)).abs());
        }
        let (wanted, told) = refiner.levels_of(&pair.measured);
        let found = in_db(&levels);
        (0..wanted.len()).filter(|i| told[*i]).for_each(|i| add(2, f64::from((found[i] - wanted[i]).abs())));
    }
    let [edt_ms, c50_db, level_db, ild_db] = sums.map(|(sum, count)| if count > 0.0 { sum / count } else { 0.0 });
    Ok(Score { edt_ms, c50_db, level_db, ild_db })
}
