//! The draw of noise that decays most as its room does.

use crate::bake::late_unit::Late;
use crate::error::BakeError;
use promenade_core::octave::{OCTAVES, nearest_octave};
use promenade_core::{Bands, TailModel, TransferFunction};
use promenade_room::time_filters;
use rayon::prelude::*;

/// Draws that are tried.
const TRIED: u64 = 24;
/// The fall that decays are compared over, dB.
const COMPARED_DB: f64 = 30.0;
/// Energy that is none.
const NOTHING: f64 = 1e-30;

/// The seed whose noise plays the decay of the given energies, of a hop and a band, most truly, of some seeds from `first` on.
///
/// All places of a scene have the same noise, of which a hop in the bass has few degrees of freedom: what a draw is off by, it
/// is off by everywhere.
pub(crate) fn truest_seed(first: u64, late: &Late<'_>, energies: &[Vec<f64>]) -> Result<u64, BakeError> {
    let wanted = decays_db(energies, late.bands);
    let seeds = (0..TRIED).into_par_iter().map(|n| first.wrapping_add(n << 32));
    let tried = seeds.map(|seed| Ok((error(seed, late, energies, &wanted)?, seed)));
    let tried: Vec<(f64, u64)> = tried.collect::<Result<_, BakeError>>()?;
    Ok(tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map_or(first, |(_, seed)| seed))
}

/// By how much what a seed's noise plays of energies is off the wanted decays, dB squared.
fn error(seed: u64, late: &Late<'_>, energies: &[Vec<f64>], wanted: &[Vec<f64>]) -> Result<f64, BakeError> {
    let tail = TailModel { seed, ..late.tail.clone() };
    let late = Late { tail: &tail, ..*late };
    let hops = energies.len();
    let row = time_filters(energies, &late.unit(hops)?[0], late.shape, 1.0);
    let (taps, last) = row.split_at(late.shape.tap_len() * late.shape.taps);
    let transfer = TransferFunction { taps: taps.to_vec(), late: last.to_vec(), ..late.shape.silent() };
    let ears = late.plays(&transfer, hops)?.map(|ear| decays_db(&ear, late.bands));
    Ok(ears.iter().map(|found| difference(found, wanted)).sum())
}

/// Energy that is still to come (Schroeder 1965) from the first hop after the direct sound on, dB, of each octave and of all
/// together.
fn decays_db(energies: &[Vec<f64>], bands: &Bands) -> Vec<Vec<f64>> {
    let centres = bands.centres_hz();
    let width = |band: usize| {
        let (below, above) = (centres[band.saturating_sub(1)], centres[(band + 1).min(centres.len() - 1)]);
        f64::from(above - below) / 2.0
    };
    let within = |octave: Option<usize>, band: usize| octave.is_none_or(|octave| octave == nearest_octave(centres[band]));
    let octaves = (0..OCTAVES).map(Some).chain([None]);
    let decay = |octave: Option<usize>| {
        let mut left = 0.0;
        let mut levels: Vec<f64> = energies
            .iter()
            .skip(1)
            .rev()
            .map(|hop| {
                left +=
                    (0..centres.len()).filter(|band| within(octave, *band)).map(|band| width(band) * hop[band]).sum::<f64>();
                10.0 * left.max(NOTHING).log10()
            })
            .collect();
        levels.reverse();
        levels
    };
    octaves.map(decay).collect()
}

/// Mean square of the difference between decays over the fall that counts, dB squared, sum over all of them.
fn difference(found: &[Vec<f64>], wanted: &[Vec<f64>]) -> f64 {
    let of_one = |(found, wanted): (&Vec<f64>, &Vec<f64>)| {
        let start = wanted.first().copied().unwrap_or_default();
        let compared = wanted.iter().take_while(|level| **level > start - COMPARED_DB).count().max(1);
        found.iter().zip(wanted).take(compared).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / compared as f64
    };
    found.iter().zip(wanted).map(of_one).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::{StftGrid, TransferShape};

    #[test]
    fn the_chosen_noise_decays_more_truly_than_most() {
        let grid = StftGrid { sample_rate_hz: 16_000.0, n_fft: 320, hop: 80 };
        let bands = Bands::for_rate(16_000.0);
        let shape = TransferShape { bins: grid.bins(), bands: bands.count(), taps: 20 };
        let t60_s = 0.5;
        let tail =
            TailModel { seed: 0, t60_s: vec![t60_s; bands.count()], coherence: vec![0.0; bands.count()], by_phase: false };
        let late = Late { grid: &grid, bands: &bands, tail: &tail, shape, top_hz: 8_000.0 };
        let energy = |hop: usize| 1e6_f64.powf(-(hop as f64) * grid.hop_s() / f64::from(t60_s));
        let energies: Vec<Vec<f64>> = (0..70).map(|hop| vec![energy(hop); bands.count()]).collect();
        let wanted = decays_db(&energies, &bands);
        // Seeds that the choice was not made with.
        let others: Vec<f64> = (1..=8).map(|seed| error(seed, &late, &energies, &wanted).unwrap()).collect();
        let chosen = truest_seed(0, &late, &energies).unwrap();
        let found = error(chosen, &late, &energies, &wanted).unwrap();
        let better = others.iter().filter(|other| found < **other).count();
        assert!(better >= 7, "{found} dB squared, others {others:?}");
        assert!(found < 0.65 * others.iter().sum::<f64>() / 8.0, "{found} dB squared, others {others:?}");
    }
}
