//! How far a transfer function is from the response that a clip tells of, and the derivative by it.

use crate::responses::{ClipResponse, band_weights, certainty, decays};
use crate::settings::LossSettings;
use promenade_core::{Bands, StftGrid, TailModel, TransferFunction};

/// Energies below this share of a response's are no more exact than it.
const FLOOR: f32 = 1e-6;
/// What remains of a band counts down to this share of its energy: T20's range and some more.
const DEEPEST: f32 = 1e-3;
/// Decibels of a natural logarithm of energies.
const DECIBELS: f32 = 10.0 / std::f32::consts::LN_10;

/// Compares the direct sound, what remains of the room from each hop on (the energy decay relief: Jot 1992), and the delay
/// between the ears.
pub(crate) struct ResponseLoss {
    settings: LossSettings,
    weights: Vec<Vec<(usize, f32)>>,
    /// Energy left after a hop, per band.
    decay: Vec<f32>,
}

impl ResponseLoss {
    pub(crate) fn new(settings: &LossSettings, grid: &StftGrid, bands: &Bands, tail: &TailModel) -> Self {
        Self { settings: settings.clone(), weights: band_weights(grid, bands), decay: decays(grid, tail) }
    }

    /// The loss times `share`; its derivative is added to `by`.
    ///
    /// Per ear and band, in dB: the direct sound's energy, and the mean over hops of the room's that is still to come, what is
    /// beyond the end of a response being its decay; means over ears and bands. And the delay, in microseconds.
    pub(crate) fn of(&self, wanted: &ClipResponse, found: &TransferFunction, share: f32, by: &mut TransferFunction) -> f64 {
        let bands = self.weights.len();
        let energy = wanted.direct.iter().sum::<f32>() / wanted.direct.len().max(1) as f32;
        // What is uncertain counts less.
        let sure = |place: usize| {
            let hops = &wanted.hops[place];
            let room = hops.iter().sum::<f32>() / hops.len().max(1) as f32;
            [wanted.direct[place], room].map(|energy| certainty(energy, wanted.noise[place]))
        };
        let heard = (0..2 * bands).filter(|place| wanted.sounds[place % bands]);
        let sum: f32 = heard.map(|place| sure(place)[0]).sum();
        let scale = share * self.settings.level * DECIBELS / sum.max(1.0);
        let mut loss = 0.0;
        for (ear, sign) in [-1.0_f32, 1.0].into_iter().enumerate() {
            for band in (0..bands).filter(|band| wanted.sounds[*band]) {
                let place = ear * bands + band;
                let gains = self.weights[band].iter().map(|(k, w)| (*k, *w, 1.0 + sign * found.difference[*k]));
                let direct: f32 = gains.clone().map(|(k, w, side)| w * (found.mixture[k] * side).powi(2)).sum();
                let (off, slope) = ratio(direct, wanted.direct[place], FLOOR * energy);
                let [of_direct, of_room] = sure(place).map(|sure| scale * sure);
                loss += f64::from(of_direct * off);
                for (k, w, side) in gains {
                    let m = found.mixture[k];
                    by.mixture[k] += 2.0 * of_direct * slope * w * m * side * side;
                    by.difference[k] += 2.0 * of_direct * slope * w * m * m * side * sign;
                }
                loss += f64::from(self.room(&wanted.hops[place], FLOOR * energy, (place, band), found, of_room, by));
            }
        }
        let off_us = 1e6 * (found.delay_s - wanted.delay_s);
        let weight = share * self.settings.delay;
        by.delay_s += 1e6 * weight * if off_us == 0.0 { 0.0 } else { off_us.signum() };
        loss + f64::from(weight * off_us.abs())
    }

    /// One ear and band of the room.
    fn room(
        &self,
        hops: &[f32],
        floor: f32,
        (place, band): (usize, usize),
        found: &TransferFunction,
        scale: f32,
        by: &mut TransferFunction,
    ) -> f32 {
        let row = 2 * self.weights.len();
        let taps = found.taps.len() / row;
        let decay = self.decay[band];
        // The last three hops on an exponential tell what comes after them.
        let last = hops.len().min(3);
        let ends = hops[hops.len() - last..].iter().sum::<f32>().max(0.0) / last.max(1) as f32;
        let mut wanted = vec![ends * decay * decay / (1.0 - decay); hops.len() + 1];
        for (l, hop) in hops.iter().enumerate().rev() {
            wanted[l] = wanted[l + 1] + hop;
        }
        let deepest = (DEEPEST * wanted[0]).max(floor);
        let count = wanted[..hops.len().min(taps)].iter().take_while(|e| **e > deepest).count();
        if count == 0 {
            return 0.0;
        }
        let late = found.late[place];
        let mut rest = vec![late * late / (1.0 - decay); taps + 1];
        for l in (0..taps).rev() {
            rest[l] = rest[l + 1] + found.taps[l * row + place].powi(2);
        }
        let scale = scale / count as f32;
        let (mut loss, mut slopes) = (0.0, 0.0);
        for l in 0..taps {
            if l < count {
                let (off, slope) = ratio(rest[l], wanted[l], floor);
                loss += scale * off;
                slopes += scale * slope;
            }
            by.taps[l * row + place] += 2.0 * found.taps[l * row + place] * slopes;
        }
        by.late[place] += 2.0 * late / (1.0 - decay) * slopes;
        loss
    }
}

/// Distance of the logarithms of two energies, and its derivative by the first.
fn ratio(found: f32, wanted: f32, floor: f32) -> (f32, f32) {
    let off = (found + floor).ln() - (wanted.max(0.0) + floor).ln();
    (off.abs(), if off == 0.0 { 0.0 } else { off.signum() / (found + floor) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::TransferShape;
    use promenade_testing::noise;

    #[test]
    fn the_gradient_is_the_derivative_and_the_response_itself_has_no_loss() {
        let grid = StftGrid { sample_rate_hz: 8000.0, n_fft: 64, hop: 16 };
        let bands = Bands::for_rate(8000.0);
        let (count, taps) = (bands.count(), 5);
        let tail = TailModel { seed: 1, t60_s: vec![0.05; count], coherence: vec![0.0; count], by_phase: false };
        let settings = LossSettings { level: 0.7, delay: 0.003, ..LossSettings::default() };
        let loss = ResponseLoss::new(&settings, &grid, &bands, &tail);
        let values = |seed: u64, count: usize| noise(seed, count).iter().map(|x| 0.5 + 0.4 * x).collect::<Vec<f32>>();
        let mut at = TransferShape { bins: grid.bins(), bands: count, taps }.silent();
        (at.mixture, at.difference) = (values(1, grid.bins()), values(2, grid.bins()));
        (at.taps, at.late, at.delay_s) = (values(3, 2 * count * taps), values(4, 2 * count), 2e-4);
        // The response that has just these energies.
        let decay = loss.decay[0];
        let hop = |place: usize, l: usize| match l.checked_sub(taps) {
            None => at.taps[l * 2 * count + place].powi(2),
            Some(after) => at.late[place].powi(2) * decay.powi(after as i32),
        };
        let direct = |place: usize| {
            let sign = if place < count { -1.0 } else { 1.0 };
            let of = |(k, w): &(usize, f32)| w * (at.mixture[*k] * (1.0 + sign * at.difference[*k])).powi(2);
            loss.weights[place % count].iter().map(of).sum::<f32>()
        };
        let same = ClipResponse {
            late: 0,
            delay_s: at.delay_s,
            sounds: vec![true; count],
            direct: (0..2 * count).map(direct).collect(),
            hops: (0..2 * count).map(|place| (0..taps + 40).map(|l| hop(place, l)).collect()).collect(),
            noise: vec![0.0; 2 * count],
        };
        assert!(loss.of(&same, &at, 1.0, &mut at.clone()) < 1e-3);
        let other = ClipResponse {
            late: 0,
            delay_s: -1e-4,
            sounds: (0..count).map(|band| band != 3).collect(),
            direct: values(5, 2 * count),
            hops: (0..2 * count).map(|place| values(6 + place as u64, 4 + place % 5)).collect(),
            noise: (0..2 * count).map(|place| 0.05 * (place % 4) as f32).collect(),
        };
        let mut by = TransferShape { bins: grid.bins(), bands: count, taps }.silent();
        loss.of(&other, &at, 0.5, &mut by);
        let check = |what: &str, got: f32, step: f32, change: &dyn Fn(&mut TransferFunction, f32)| {
            let ends = [step, -step].map(|h| {
                let mut moved = at.clone();
                change(&mut moved, h);
                loss.of(&other, &moved, 0.5, &mut at.clone())
            });
            let slope = (ends[0] - ends[1]) / f64::from(2.0 * step);
            assert!((slope - f64::from(got)).abs() < 0.02 * slope.abs().max(0.02), "{what}: {got} against {slope}");
        };
        for k in (0..grid.bins()).step_by(3) {
            check("mixture", by.mixture[k], 2e-3, &|t, h| t.mixture[k] += h);
            check("difference", by.difference[k], 2e-3, &|t, h| t.difference[k] += h);
        }
        for i in (0..by.taps.len()).step_by(5) {
            check("tap", by.taps[i], 2e-3, &|t, h| t.taps[i] += h);
        }
        for i in 0..by.late.len() {
            check("late", by.late[i], 2e-3, &|t, h| t.late[i] += h);
        }
        check("delay", by.delay_s, 1e-5, &|t, h| t.delay_s += h);
    }
}
