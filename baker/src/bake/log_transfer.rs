//! Transfer functions as they are interpolated between measurements.

use crate::bake::direct::set_ears;
use crate::bake::kriging::Site;
use crate::signal::minimum_phase::minimum_phase;
use promenade_core::{StftGrid, TransferFunction, TransferShape};

/// Gains below this count as silence (-140 dB).
pub(crate) const NO_GAIN: f64 = 1e-7;

/// A transfer function in the domain that it is interpolated in: log gains, at a distance of 1 m, and delay.
///
/// Gains of measurements a few degrees apart differ by factors, and delays by sums; complex spectra that differ in delay would cancel.
#[derive(Clone, Debug)]
pub(crate) struct LogTransfer {
    direct: [Vec<f64>; 2],
    delay_s: f64,
    room: Vec<f64>,
    explicit: usize,
}

impl LogTransfer {
    pub(crate) fn of(t: &TransferFunction, distance_m: f64) -> Self {
        let log = |g: f64| g.max(NO_GAIN).ln();
        let ear = |sign: f32| {
            let gains = t.mixture.iter().zip(&t.difference).map(|(m, d)| f64::from((1.0 + sign * d) * m));
            gains.map(|g| log(g * distance_m)).collect()
        };
        let room = t.taps.iter().chain(&t.late).map(|g| log(f64::from(*g))).collect();
        Self { direct: [ear(-1.0), ear(1.0)], delay_s: f64::from(t.delay_s), room, explicit: t.taps.len() }
    }

    pub(crate) fn blend(measured: &[Self], sites: &[Site], weights: &[(usize, f64)], trend: f64, node: &Site) -> Self {
        let sum = |pick: &dyn Fn(&Self) -> &Vec<f64>| {
            let mut out = vec![0.0; pick(&measured[0]).len()];
            for &(i, w) in weights {
                out.iter_mut().zip(pick(&measured[i])).for_each(|(o, v)| *o += w * v);
            }
            out
        };
        let off_trend: f64 = weights.iter().map(|&(i, w)| w * (measured[i].delay_s - trend * lateral(&sites[i]))).sum();
        Self {
            direct: [sum(&|r| &r.direct[0]), sum(&|r| &r.direct[1])],
            delay_s: off_trend + trend * lateral(node),
            room: sum(&|r| &r.room),
            explicit: measured[0].explicit,
        }
    }

    pub(crate) fn to_transfer(&self, shape: &TransferShape, grid: &StftGrid) -> TransferFunction {
        let gain = |log: f64| if log <= NO_GAIN.ln() + 0.1 { 0.0 } else { log.exp() };
        let mut out = shape.silent();
        for k in 0..shape.bins {
            set_ears(&mut out, k, [gain(self.direct[0][k]), gain(self.direct[1][k])]);
        }
        out.phase = self.direct.iter().flat_map(|log_gain| minimum_phase(log_gain.iter().copied(), grid.n_fft)).collect();
        out.delay_s = self.delay_s as f32;
        out.taps = self.room[..self.explicit].iter().map(|g| gain(*g) as f32).collect();
        out.late = self.room[self.explicit..].iter().map(|g| gain(*g) as f32).collect();
        out
    }
}

/// How the interaural delay of a rigid sphere varies with the angle towards the left ear (Woodworth 1938): asin(y) + y for the
/// component y of the direction towards the left, so that the delay is negative on the left.
fn lateral(site: &Site) -> f64 {
    let y = f64::from(site.direction.y).clamp(-1.0, 1.0);
    y.asin() + y
}

/// Delay per unit of [`lateral`], seconds, by least squares: the measured head's radius over the speed of sound, negated.
pub(crate) fn delay_trend(sites: &[Site], measured: &[LogTransfer]) -> f64 {
    let pairs = || sites.iter().map(lateral).zip(measured.iter().map(|r| r.delay_s));
    let square: f64 = pairs().map(|(x, _)| x * x).sum();
    if square > 0.1 { pairs().map(|(x, d)| x * d).sum::<f64>() / square } else { -0.09 / 343.0 }
}
