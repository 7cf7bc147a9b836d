//! Calibration: transfer functions corrected until the render head's own output measures as the room did.

use crate::bake::direct::set_ears;
use crate::bake::kriging::Site;
use crate::bake::room::{HopEnergies, Room};
use crate::error::BakeError;
use crate::player::{Ears, render_response};
use crate::signal::spectrum::{Analyser, at};
use promenade_core::{Pose, Scene, StftGrid, TransferFunction};
use promenade_metrics::itd_s;
use std::sync::Arc;

/// Rounds of rendering and correcting.
const ROUNDS: usize = 8;
/// The largest correction of a gain in one round.
const LARGEST_STEP: f64 = 1.6;

/// The largest error of the interaural time difference that is believed, and the largest correction of the delay, seconds.
const BELIEVED_DELAY_S: f64 = 250e-6;
const LARGEST_DELAY_STEP_S: f64 = 50e-6;

/// Distance over which measurements share one room: chord of the unit sphere of directions, or metres (about 20 degrees).
const SHARED_ROOM: f64 = 0.35;

/// A measured response at the scene's level and what is to be reached.
pub(crate) struct Target {
    ears: Ears,
    /// Energy per hop and band of each ear.
    hops: [HopEnergies; 2],
    /// Interaural time difference, seconds.
    itd_s: f64,
}

/// Averages how the room's energy is spread over hops and bands over neighbouring measurements; each ear keeps its amount.
///
/// The energy of one band in one hop is that of a few random numbers: a listener who turns must not hear them change from one
/// measurement to the next, nor would they be right in between. The amount is a sum of thousands.
pub(crate) fn share_rooms(targets: &mut [Target], sites: &[Site], bandwidths: &[f64]) {
    let amount = |hops: &HopEnergies| -> f64 {
        hops.iter().skip(1).map(|bands| bands.iter().zip(bandwidths).map(|(e, w)| e * w).sum::<f64>()).sum()
    };
    let measured: Vec<[(f64, HopEnergies); 2]> =
        targets.iter().map(|t| t.hops.each_ref().map(|h| (amount(h).max(1e-30), h.clone()))).collect();
    for (i, (target, site)) in targets.iter_mut().zip(sites).enumerate() {
        let weights: Vec<f64> = sites.iter().map(|s| (-0.5 * (s.distance(site) / SHARED_ROOM).powi(2)).exp()).collect();
        let sum: f64 = weights.iter().sum();
        for (ear, hops) in target.hops.iter_mut().enumerate() {
            let own = measured[i][ear].0;
            for (l, bands) in hops.iter_mut().enumerate().skip(1) {
                for (b, energy) in bands.iter_mut().enumerate() {
                    let shares = measured.iter().zip(&weights).map(|(m, w)| w * m[ear].1[l][b] / m[ear].0);
                    *energy = own * shares.sum::<f64>() / sum;
                }
            }
        }
    }
}

/// Factor that brings a gain closer to giving the wanted energy.
fn step(wanted: f64, got: f64) -> f32 {
    (wanted / got.max(1e-30)).sqrt().clamp(1.0 / LARGEST_STEP, LARGEST_STEP) as f32
}

/// Renders transfer functions as the plugin does and corrects them.
pub(crate) struct Calibrator<'a> {
    grid: StftGrid,
    room: &'a Room,
    analyser: Analyser,
}

impl<'a> Calibrator<'a> {
    pub(crate) fn new(grid: &StftGrid, room: &'a Room) -> Self {
        Self { grid: *grid, room, analyser: Analyser::new(*grid) }
    }

    /// What a transfer function is fitted to; all targets of a scene have responses of one length.
    pub(crate) fn target(&self, ears: Ears, arrival: i64, name: &str) -> Result<Target, BakeError> {
        let itd_s = itd_s(&ears[0], &ears[1], self.grid.sample_rate_hz)
            .map_err(|why| BakeError::unmeasurable(format!("response '{name}'"), why))?;
        let count = ears[0].len() / self.grid.hop + 1;
        let hops = ears.each_ref().map(|ear| self.analyser.hop_energies(ear, arrival, count, &self.room.bands));
        Ok(Target { ears, hops, itd_s })
    }

    /// Corrects a first estimate towards the measured response.
    ///
    /// Tap and late gains follow the ratio of measured to rendered band energy; the direct sound of each ear makes up what its whole
    /// energy lacks, which sets level and level difference; the delay follows the interaural time difference.
    pub(crate) fn fit(&self, mut transfer: TransferFunction, target: &Target) -> Result<TransferFunction, BakeError> {
        let (hops, shape) = (target.hops[0].len(), self.room.shape);
        transfer.delay_s = target.itd_s as f32;
        for _ in 0..ROUNDS {
            let (ears, origin) = self.render(&transfer, target.ears[0].len())?;
            let got: [HopEnergies; 2] = [0, 1].map(|e| self.analyser.hop_energies(&ears[e], origin, hops, &self.room.bands));
            for ear in 0..2 {
                for band in 0..shape.bands {
                    let (wanted, got) = (&target.hops[ear], &got[ear]);
                    for tap in 0..shape.taps.min(hops - 1) {
                        let g = &mut transfer.taps[(tap * 2 + ear) * shape.bands + band];
                        *g *= step(wanted[tap + 1][band], got[tap + 1][band]);
                    }
                    let late = shape.taps + 1..self.room.above_noise[band];
                    if !late.is_empty() && late.end <= hops {
                        let sum = |e: &HopEnergies| e[late.clone()].iter().map(|hop| hop[band]).sum::<f64>();
                        transfer.late[ear * shape.bands + band] *= step(sum(wanted), sum(got));
                    }
                }
            }
            let Ok(rendered_itd_s) = itd_s(&ears[0], &ears[1], self.grid.sample_rate_hz) else { continue };
            // A larger error means that the correlation of the rendered ears peaked elsewhere, which says nothing about the delay.
            let late_by = target.itd_s - rendered_itd_s;
            if late_by.abs() < BELIEVED_DELAY_S {
                transfer.delay_s += late_by.clamp(-LARGEST_DELAY_STEP_S, LARGEST_DELAY_STEP_S) as f32;
            }
            let energy = |x: &[f32], from: i64, to: i64| (from..to).map(|i| at(x, i).powi(2)).sum::<f64>();
            // All of each ear's energy is matched through its direct sound: level and interaural level difference at once.
            let gains = [0, 1].map(|e| {
                let span = self.grid.hop as i64 * 2;
                let direct_got = energy(&ears[e], origin - span, origin + span);
                let all_got = energy(&ears[e], 0, ears[e].len() as i64);
                let all_wanted = energy(&target.ears[e], 0, target.ears[e].len() as i64);
                (1.0 + (all_wanted - all_got) / direct_got.max(1e-30)).max(0.25).sqrt().clamp(1.0 / LARGEST_STEP, LARGEST_STEP)
            });
            for k in 0..shape.bins {
                let (m, d) = (f64::from(transfer.mixture[k]), f64::from(transfer.difference[k]));
                set_ears(&mut transfer, k, [gains[0] * (1.0 - d) * m, gains[1] * (1.0 + d) * m]);
            }
        }
        Ok(transfer)
    }

    /// The render head's response, and the sample at which the head's centre hears it.
    fn render(&self, transfer: &TransferFunction, len: usize) -> Result<(Ears, i64), BakeError> {
        let Room { bands, tail, top_hz, .. } = self.room;
        let scene = Scene::of_transfer(transfer, self.grid, bands.clone(), tail.clone(), *top_hz)?;
        let lead = self.grid.n_fft;
        Ok((render_response(&Arc::new(scene), Pose::IDENTITY, lead, lead + len)?, lead as i64))
    }
}
