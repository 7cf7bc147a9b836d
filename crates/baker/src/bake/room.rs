//! What a measured room does after the direct sound: band energies hop by hop, reverberation time, coherence.

use crate::bake::arrivals;
use crate::bake::direct::Direct;
use crate::bake::late_unit::Late;
use crate::error::BakeError;
use crate::signal::spectrum::{Analyser, at};
use crate::sources::responses::Response;
use promenade_core::{Bands, LOWEST_BINS, StftGrid, TailModel, TransferShape};
use promenade_metrics::slope;
use promenade_metrics::statistics::median_high;
use promenade_room::{HopEnergies, LONGEST_EARLY_S, SHORTEST_EARLY_S, late_gain, t20_end};

/// Reverberation times below this are taken for a failed fit, seconds.
const SHORTEST_T60_S: f64 = 0.03;
/// So are times above this in a room where most bands decay faster, seconds, ...
const PLAUSIBLE_T60_S: f64 = 20.0;
/// ... or else above this many times the median of the bands.
const PLAUSIBLE_RATIO: f64 = 4.0;
/// The longest reverberation time that is baked, seconds: no room is known to reverberate longer.
const LONGEST_T60_S: f64 = 150.0;
/// A late part that is louder than this against the direct sound at the end of the responses, as a ratio of energies (-40 dB)
/// ...
const AUDIBLE_END: f64 = 1e-4;
/// ... must have fallen by this much until then, dB.
const LEAST_FALL_DB: f64 = 10.0;
/// Headroom over the noise floor that a hop needs to count, as a ratio of energies (6 dB).
const OVER_NOISE: f64 = 4.0;
/// Reverberation times are fitted from here on, seconds.
const FITTED_FROM_S: f64 = 0.16;
/// The longest time for which the bass rings on as it was measured, seconds.
const LONGEST_LOW_S: f64 = 4.0;
/// The fewest hops that a slope is fitted to.
const FEWEST_HOPS: usize = 6;

/// Reverberation time per band, seconds, from energies averaged over many responses: a straight line through the level in dB
/// from hop `from` on, down to where T20 ends or the measurement's noise begins (ISO 3382-1, regression): many rooms have a
/// second slope, which is heard less. The first `as_measured` bands ring on as they were measured: theirs is down to the noise.
/// `direct` is the energy density of the direct sound.
fn t60_s(mean: &HopEnergies, as_measured: usize, from: usize, hop_s: f64, direct: f64) -> Result<Vec<f32>, BakeError> {
    let bands = mean.first().map_or(0, Vec::len);
    let mut fitted: Vec<Option<f64>> = (0..bands).map(|b| fit_t60(mean, b, from, hop_s, b < as_measured)).collect();
    let Some(all) = median_high(fitted.iter().flatten().copied()) else {
        check_fall(mean, from, hop_s, direct)?;
        return Ok(vec![0.3; bands]);
    };
    if all > LONGEST_T60_S {
        let expected = format!("at most {LONGEST_T60_S} s");
        return Err(BakeError::argument("reverberation time of the responses", expected, format!("{all:.1} s")));
    }
    // A band without a decay of its own takes the median of the others.
    let longest = PLAUSIBLE_T60_S.max(PLAUSIBLE_RATIO * all);
    fitted.iter_mut().for_each(|t| *t = t.filter(|t| *t <= longest));
    let typical = median_high(fitted.iter().flatten().copied()).unwrap_or(all);
    Ok(fitted.iter().map(|t| t.unwrap_or(typical) as f32).collect())
}

/// Refuses responses that end while the room still sounds nearly as loud as after the direct sound: nobody can tell from them
/// how long it goes on.
fn check_fall(mean: &HopEnergies, from: usize, hop_s: f64, direct: f64) -> Result<(), BakeError> {
    let density = |e: &Vec<f64>| e.iter().sum::<f64>() / e.len().max(1) as f64;
    let tail = (mean.len() / 10).max(1);
    let end = mean.iter().rev().take(tail).map(density).sum::<f64>() / tail as f64;
    let loudest = mean.iter().skip(1).map(density).fold(0.0, f64::max);
    let fall_db = 10.0 * (loudest / end.max(1e-30)).log10();
    if mean.len() <= from + 3 || end < AUDIBLE_END * direct || fall_db >= LEAST_FALL_DB {
        return Ok(());
    }
    let expected =
        format!("a fall of {LEAST_FALL_DB} dB or more, from which a reverberation time can be estimated (longer responses)");
    let found = format!("{fall_db:.1} dB in {:.2} s", mean.len() as f64 * hop_s);
    Err(BakeError::argument("decay of the responses", expected, found))
}

/// Hops at the start that stand above the measurement's noise in a band.
fn hops_above_noise(mean: &HopEnergies, band: usize) -> usize {
    let tail = mean.len() / 10;
    let floor = mean.iter().rev().take(tail.max(1)).map(|e| e[band]).sum::<f64>() / tail.max(1) as f64;
    mean.iter().position(|e| e[band] < OVER_NOISE * floor || e[band] <= 1e-20).unwrap_or(mean.len())
}

fn fit_t60(mean: &HopEnergies, band: usize, from: usize, hop_s: f64, to_noise: bool) -> Option<f64> {
    let until = hops_above_noise(mean, band);
    let energies: Vec<f64> = mean[..until].iter().map(|hop| hop[band].max(1e-30)).collect();
    let start = if until >= from + FEWEST_HOPS { from } else { 2.min(until) };
    let fitted = |levels: &[f64]| {
        let points: Vec<(f64, f64)> = levels.iter().enumerate().map(|(l, e)| (l as f64 * hop_s, 10.0 * e.log10())).collect();
        let t60_s = slope(points.get(start..)?).map(|db_per_s| -60.0 / db_per_s)?;
        (t60_s >= SHORTEST_T60_S && t60_s.is_finite() && points.len() >= start + FEWEST_HOPS).then_some(t60_s)
    };
    let whole_s = fitted(&energies)?;
    if to_noise {
        return Some(whole_s);
    }
    // What is still to come, the noise's place too: as T20 sees it.
    let hop = 10.0_f64.powf(-6.0 * hop_s / whole_s);
    let beyond =
        energies[start.max(until.saturating_sub(FEWEST_HOPS))..].iter().sum::<f64>() / FEWEST_HOPS as f64 * hop / (1.0 - hop);
    let mut left: Vec<f64> = energies
        .iter()
        .rev()
        .scan(beyond, |sum, e| {
            *sum += e;
            Some(*sum)
        })
        .collect();
    left.reverse();
    left.truncate(t20_end(&energies, from));
    fitted(&left).or(Some(whole_s))
}

/// Real interaural coherence per band of both ears' sound from sample `start` on.
fn coherence(ears: [&[f32]; 2], start: i64, hops: usize, grid: &StftGrid, bands: &Bands, analyser: &Analyser) -> [Vec<f64>; 3] {
    let mut sums = [vec![0.0; bands.count()], vec![0.0; bands.count()], vec![0.0; bands.count()]];
    for l in 0..hops as i64 {
        let at_hop = start + l * grid.hop as i64;
        let [left, right] = ears.map(|ear| {
            let piece: Vec<f64> = (0..grid.n_fft as i64)
                .map(|i| {
                    let window = (std::f64::consts::PI * i as f64 / grid.n_fft as f64).sin();
                    window * at(ear, at_hop + i)
                })
                .collect();
            analyser.spectrum(&piece)
        });
        for (k, (a, b)) in left.iter().zip(&right).enumerate() {
            for (band, w) in bands.weights(grid.bin_hz(k) as f32) {
                let w = f64::from(w);
                sums[0][band] += w * (a * b.conj()).re;
                sums[1][band] += w * a.norm_sqr();
                sums[2][band] += w * b.norm_sqr();
            }
        }
    }
    sums
}

/// Share of the Nyquist frequency that measurements are trusted up to; above it anti-alias filters close.
const TRUSTED_SHARE: f64 = 0.85;

/// What one response says by itself.
pub(crate) struct ResponseParts {
    pub(crate) direct: Direct,
    /// Gain of the late part at the first hop after the taps, linear amplitude, `[ear][band]`.
    pub(crate) late: Vec<f64>,
}

/// What all responses share.
pub(crate) struct Room {
    pub(crate) bands: Bands,
    pub(crate) tail: TailModel,
    pub(crate) shape: TransferShape,
    pub(crate) top_hz: f32,
    /// Hops in which the bass is heard, those of direct sound and taps among them.
    pub(crate) low_hops: usize,
    /// Energy density per hop and band that the late part has at each ear at unit gain.
    pub(crate) late_unit: [HopEnergies; 2],
    /// What was corrected, in words.
    pub(crate) notes: Vec<String>,
}

/// Hops that responses reach into; the direct sound's and one after it at least.
fn hops(measured: &[&Response], grid: &StftGrid) -> usize {
    let longest = measured.iter().map(|r| r.left.len()).max().unwrap_or(0);
    (longest / grid.hop + 1).max(2)
}

impl Room {
    /// Sizes of the transfer functions of a room with `early_s` seconds of explicit taps.
    pub(crate) fn shape(measured: &[&Response], grid: &StftGrid, early_s: f64) -> TransferShape {
        let taps = ((early_s / grid.hop_s()).round() as usize).min(hops(measured, grid) - 2).max(1);
        TransferShape { bins: grid.bins(), bands: Bands::for_rate(grid.sample_rate_hz).count(), taps }
    }

    /// Measures the room that responses share: explicit taps for half the reverberation time, as much of it as T20 is measured
    /// on, up to 0.22 s, and an exponential late part.
    pub(crate) fn of(measured: &[&Response], grid: &StftGrid, seed: u64) -> Result<(Self, Vec<ResponseParts>), BakeError> {
        let analyser = Analyser::new(*grid);
        let bands = Bands::for_rate(grid.sample_rate_hz);
        let silent = |r: &Response| crate::error::unmeasurable(&format!("response '{}'", r.name), "an ear is silent");
        let mut directs = Vec::new();
        for r in measured {
            directs.push(Direct::of([&r.left, &r.right], None, grid, &analyser).ok_or_else(|| silent(r))?);
        }
        let mut notes = Vec::new();
        for (i, arrival) in arrivals::wrong(measured, &directs, grid.sample_rate_hz) {
            let r = measured[i];
            let off_ms = 1e3 * (directs[i].arrival - arrival) as f64 / grid.sample_rate_hz;
            notes.push(format!(
                "the arrival of response '{}' was found {off_ms:.2} ms off: it is where all others have theirs",
                r.name
            ));
            directs[i] = Direct::of([&r.left, &r.right], Some(arrival), grid, &analyser).ok_or_else(|| silent(r))?;
        }
        let hops = hops(measured, grid);
        let energies: Vec<[HopEnergies; 2]> =
            directs.iter().map(|d| [0, 1].map(|ear| analyser.hop_energies(&d.rest[ear], d.arrival, hops, &bands))).collect();
        let ears = (2 * energies.len()) as f64;
        let mean: HopEnergies = (0..hops)
            .map(|l| {
                let all = energies.iter().flatten();
                (0..bands.count()).map(|b| all.clone().map(|e| e[l][b]).sum::<f64>() / ears).collect()
            })
            .collect();
        let fitted_from = Self::shape(measured, grid, FITTED_FROM_S).taps;
        let direct = directs.iter().flat_map(|d| &d.gain).flatten().map(|g| g * g).sum::<f64>() / (ears * grid.bins() as f64);
        let low_hz = grid.bin_hz(LOWEST_BINS.min(grid.bins()) - 1);
        let low_bands = bands.centres_hz().iter().filter(|hz| f64::from(**hz) <= low_hz).count();
        let t60 = t60_s(&mean, low_bands, fitted_from, grid.hop_s(), direct)?;
        let typical = median_high(t60.iter().map(|t| f64::from(*t))).unwrap_or_default();
        let shape = Self::shape(measured, grid, (0.5 * typical).clamp(SHORTEST_EARLY_S, LONGEST_EARLY_S));
        let taps = shape.taps;
        let above_noise: Vec<usize> = (0..bands.count()).map(|b| hops_above_noise(&mean, b)).collect();
        let mut sums = [vec![0.0; bands.count()], vec![0.0; bands.count()], vec![0.0; bands.count()]];
        for d in &directs {
            let start = d.arrival + 4 * grid.hop as i64;
            let part = coherence([&d.rest[0], &d.rest[1]], start, taps, grid, &bands, &analyser);
            for (s, p) in sums.iter_mut().flatten().zip(part.iter().flatten()) {
                *s += p;
            }
        }
        let coherence = (0..bands.count())
            .map(|b| (sums[0][b] / (sums[1][b] * sums[2][b]).sqrt().max(1e-30)).clamp(-1.0, 1.0) as f32)
            .collect();
        let ringing = |b: usize| above_noise[b].min((f64::from(t60[b]) / grid.hop_s()).ceil() as usize);
        let low_hops = (0..low_bands).map(ringing).max().unwrap_or(0);
        let low_hops = low_hops.clamp(taps + 1, (taps + 1).max((LONGEST_LOW_S / grid.hop_s()) as usize));
        let tail = TailModel { seed, t60_s: t60, coherence, by_phase: false };
        let top_hz = (TRUSTED_SHARE * grid.sample_rate_hz / 2.0) as f32;
        let mut room = Self { bands, tail, shape, top_hz, low_hops, late_unit: Default::default(), notes };
        let late = Late { grid, bands: &room.bands, tail: &room.tail, shape, top_hz };
        room.late_unit = late.unit(hops)?;
        let late = energies.iter().map(|e| late_gains(e, &above_noise, &room, grid));
        let heard = late.zip(directs).map(|(late, direct)| ResponseParts { direct, late }).collect();
        Ok((room, heard))
    }
}

/// Gains of the late part of one response, `[ear][band]`.
fn late_gains(energies: &[HopEnergies; 2], above_noise: &[usize], room: &Room, grid: &StftGrid) -> Vec<f64> {
    let first_late = room.shape.taps + 1;
    let gain = |((hops, unit), band): ((&HopEnergies, &HopEnergies), usize)| {
        let decay = 10.0_f64.powf(-3.0 * grid.hop_s() / f64::from(room.tail.t60_s[band]));
        let until = above_noise[band];
        // Where the noise begins before the late part does, the late part continues the last taps. Where the response itself
        // ends there, as an anechoic one does, nothing is known to follow.
        if hops.len() <= first_late + 2 {
            0.0
        } else if until > first_late + 2 {
            late_gain(hops, unit, band, first_late..until)
        } else {
            let from = until.saturating_sub(8).max(1);
            let last: f64 =
                hops[from..until.max(from + 1)].iter().enumerate().map(|(l, e)| e[band] / decay.powi(2 * l as i32)).sum();
            (last / (until.max(from + 1) - from) as f64).sqrt() * decay.powi(first_late as i32 - from as i32)
        }
    };
    let ears = energies.iter().zip(&room.late_unit);
    ears.flat_map(|ear| (0..room.shape.bands).map(move |band| (ear, band))).map(gain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_slope_of_an_exponential_above_its_noise() {
        let energies: HopEnergies =
            (0..150).map(|l| vec![10.0_f64.powf(-6.0 * f64::from(l) * 0.005 / 0.5) + 1e-7, 1e-30]).collect();
        let t = t60_s(&energies, 0, 8, 0.005, 1.0).unwrap();
        assert!((t[0] - 0.5).abs() < 0.02, "{t:?}");
        assert_eq!(t[0], t[1], "a silent band takes the typical value");
        let unit: HopEnergies = (0..150).map(|l| vec![10.0_f64.powf(-6.0 * f64::from(l - 10) * 0.005 / 0.5)]).collect();
        let decay = 10.0_f64.powf(-3.0 * 0.005 / 0.5);
        assert!((late_gain(&energies, &unit, 0, 10..60) - decay.powi(10)).abs() < 1e-3);
    }

    /// Bands that decay by 60 dB in these times, seconds, over a length.
    fn decaying<const N: usize>(t60_s: [f64; N], length_s: f64) -> HopEnergies {
        let hops = (length_s / 0.005) as u32;
        (0..hops).map(|l| t60_s.map(|t| 0.01 * 10.0_f64.powf(-6.0 * f64::from(l) * 0.005 / t)).to_vec()).collect()
    }

    #[test]
    fn long_reverberation_is_baked_or_refused_but_not_replaced() {
        let t = t60_s(&decaying([25.0, 30.0], 8.0), 0, 32, 0.005, 1.0).unwrap();
        assert!((t[0] - 25.0).abs() < 0.1 && (t[1] - 30.0).abs() < 0.1, "{t:?}");
        let outlier = t60_s(&decaying([0.5, 0.6, 25.0], 8.0), 0, 32, 0.005, 1.0).unwrap();
        assert!((outlier[1] - 0.6).abs() < 0.01 && outlier[2] == outlier[1], "one band alone is a failed fit: {outlier:?}");
        let refused = t60_s(&decaying([200.0, 200.0], 40.0), 0, 32, 0.005, 1.0).unwrap_err().to_string();
        assert!(refused.contains("at most 150 s, found 200"), "{refused}");
        let cut = t60_s(&decaying([25.0, 25.0], 1.0), 0, 32, 0.005, 1.0).unwrap_err().to_string();
        assert!(cut.contains("a fall of 10 dB or more") && cut.contains("found 2.3 dB in 1.00 s"), "{cut}");
        let faint = t60_s(&decaying([25.0, 25.0], 1.0), 0, 32, 0.005, 1e4).unwrap();
        assert_eq!(faint, [0.3, 0.3], "noise far below the direct sound is no late part");
    }
}
