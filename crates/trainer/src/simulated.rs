//! What a simulated room gives for an emitter and a listener, as the network's input and as what it corrects (pi-AVAS, table 4:
//! simulated sound as the input of other methods).

use crate::gains::Gains;
use crate::responses::{ClipResponse, ClipResponses, Cutter, FEWEST_HOPS, certainty, decays};
use promenade_baker::BakeError;
use promenade_baker::capture::{Capture, Clip, Split};
use promenade_core::{Bands, Pose, StftGrid, TailModel, TransferFunction, TransferShape};
use promenade_metrics::arrival;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// First and last hop of the stretches of a response whose energies the network is told.
const STRETCHES: [(usize, usize); 5] = [(0, 1), (2, 4), (5, 10), (11, 20), (21, 40)];
/// Numbers per query frequency: of each ear the direct sound and each stretch.
pub(crate) const FEATURES: usize = 2 * (1 + STRETCHES.len());
/// Levels below this are silence, dB, and what levels are divided by on their way into the network.
const SILENCE_DB: f32 = -80.0;
const SCALE_DB: f32 = 20.0;
/// A level is believed up to this, dB.
const MOST_DB: f32 = 60.0;

/// Both ears' responses of a simulated room to one emitter of the capture, by its number, at each of these poses, at the
/// capture's sample rate.
pub type Simulate<'s> = dyn Fn(usize, &[Pose]) -> Result<Vec<[Vec<f32>; 2]>, BakeError> + 's;

/// A simulated response as a transfer function, and in the network's terms.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Simulated {
    transfer: TransferFunction,
    /// Levels, `[query][ear][direct sound, stretches]`, in [`SCALE_DB`].
    features: Vec<f32>,
}

/// Those of clips, by the clip's name and the emitter's number.
pub(crate) struct SimulatedClips {
    pub(crate) clips: HashMap<(String, usize), Arc<Simulated>>,
    /// What gives responses the capture's level and decay.
    pub(crate) level: Level,
}

/// What gives simulated responses the level and the decay of recordings, dB by band.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Level {
    /// Of the direct sound.
    direct_db: Vec<f32>,
    /// Of what follows: at the first hop, and more from hop to hop.
    room_db: Vec<[f32; 2]>,
}

impl Level {
    fn direct(&self, band: usize) -> f32 {
        10.0_f32.powf(self.direct_db.get(band).map_or(0.0, |db| db.clamp(-MOST_DB, MOST_DB)) / 20.0)
    }

    /// Of the direct sound, by bin.
    fn by_bin(&self, grid: &StftGrid, bands: &Bands) -> Vec<f32> {
        let of = |k: usize| bands.weights(grid.bin_hz(k) as f32).into_iter().map(|(b, w)| w * self.direct(b)).sum();
        (0..grid.bins()).map(of).collect()
    }

    fn hop(&self, hop: usize, band: usize) -> f32 {
        let db = self.room_db.get(band).map_or(0.0, |[first, more]| first + more * hop as f32);
        10.0_f32.powf(db.clamp(-MOST_DB, MOST_DB) / 20.0)
    }
}

/// Powers of a simulated response: of each ear's direct sound by bin, and of what follows, `[hop][band]`.
struct Powers {
    direct: [Vec<f32>; 2],
    hops: [Vec<Vec<f32>>; 2],
    centre: usize,
    delay_s: f32,
}

/// Makes them of responses.
pub(crate) struct Simulation {
    cutter: Cutter,
    shape: TransferShape,
    grid: StftGrid,
    bands: Bands,
    /// Energy left after a hop, per band.
    decay: Vec<f32>,
    /// Bin and band of each query.
    queries: Vec<(usize, usize)>,
}

impl Simulation {
    pub(crate) fn new(grid: &StftGrid, bands: &Bands, tail: &TailModel, queries: &Bands, taps: usize) -> Self {
        let place = |hz: &f32| {
            let bin = (f64::from(*hz) / grid.sample_rate_hz * grid.n_fft as f64).round() as usize;
            let nearest = bands.weights(*hz).into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
            (bin.min(grid.bins() - 1), nearest.map_or(0, |(band, _)| band))
        };
        Self {
            cutter: Cutter::new(grid, bands),
            shape: TransferShape { bins: grid.bins(), bands: bands.count(), taps },
            grid: *grid,
            bands: bands.clone(),
            decay: decays(grid, tail),
            queries: queries.centres_hz().iter().map(place).collect(),
        }
    }

    /// Of the voices of clips, whose levels and decays are then brought to what the training clips tell.
    pub(crate) fn of_clips<'c>(
        &self,
        capture: &Capture,
        clips: impl Iterator<Item = &'c Clip>,
        responses: &ClipResponses,
        simulate: &Simulate<'_>,
    ) -> Result<SimulatedClips, BakeError> {
        let mut wanted: BTreeMap<usize, BTreeMap<&str, (Pose, bool)>> = BTreeMap::new();
        for clip in clips {
            for voice in &capture.tracks[clip.track].voices {
                let Some(emitter) = voice.emitter else {
                    let found = format!("one that is not known in track {}", capture.tracks[clip.track].name);
                    let expected = "all to be known, to be simulated".to_owned();
                    return Err(BakeError::argument("emitters of a capture", expected, found));
                };
                wanted.entry(emitter).or_default().insert(&clip.name, (clip.pose, clip.split == Split::Train));
            }
        }
        let mut all = Vec::new();
        for (emitter, clips) in wanted {
            let poses: Vec<Pose> = clips.values().map(|(pose, _)| *pose).collect();
            for ((name, (_, learns)), ears) in clips.into_iter().zip(simulate(emitter, &poses)?) {
                let told = responses.get(name).filter(|_| learns);
                all.push(((name.to_owned(), emitter), self.powers(&ears), told));
            }
        }
        let level = self.level(all.iter().filter_map(|(_, powers, told)| Some((powers, &***told.as_ref()?))));
        let clips = all.into_iter().map(|(name, powers, _)| (name, Arc::new(self.levelled(powers, &level)))).collect();
        Ok(SimulatedClips { clips, level })
    }

    /// Level and decay of what clips tell over what is simulated for them: by band the weighted mean of the direct sounds' and
    /// a line over the hops. Bands that no clip tells of have the mean of the others.
    fn level<'p>(&self, pairs: impl Iterator<Item = (&'p Powers, &'p ClipResponse)>) -> Level {
        let count = self.bands.count();
        let mut direct = vec![[0.0_f32; 2]; count];
        // Energies as told and as simulated, and their weights, `[band][hop]`.
        let mut hops: Vec<Vec<[f32; 3]>> = vec![Vec::new(); count];
        for (powers, told) in pairs {
            for (ear, all) in powers.hops.iter().enumerate() {
                let own = self.cutter.by_band(&powers.direct[ear]);
                for band in (0..count).filter(|band| told.sounds[*band]) {
                    let place = ear * count + band;
                    let noise = told.noise[place];
                    let sure = certainty(told.direct[place], noise);
                    if own[band] > 0.0 && sure > 0.0 {
                        direct[band][0] += sure * 10.0 * (told.direct[place] / own[band]).log10();
                        direct[band][1] += sure;
                    }
                    let row = &mut hops[band];
                    row.resize(row.len().max(told.hops[place].len()), [0.0; 3]);
                    for ((sum, hop), own) in row.iter_mut().zip(&told.hops[place]).zip(all) {
                        let sure = certainty(*hop, noise);
                        *sum = [sum[0] + sure * hop, sum[1] + sure * own[band], sum[2] + sure];
                    }
                }
            }
        }
        let mean = |of: &[f32]| of.iter().sum::<f32>() / of.len().max(1) as f32;
        let known: Vec<f32> = direct.iter().filter(|d| d[1] > 0.0).map(|d| d[0] / d[1]).collect();
        let lines: Vec<Option<[f32; 2]>> = hops.iter().map(|row| fitted_line(row)).collect();
        let told: Vec<[f32; 2]> = lines.iter().flatten().copied().collect();
        let other = [0, 1].map(|i| mean(&told.iter().map(|line| line[i]).collect::<Vec<f32>>()));
        Level {
            direct_db: direct.iter().map(|d| if d[1] > 0.0 { d[0] / d[1] } else { mean(&known) }).collect(),
            room_db: lines.into_iter().map(|line| line.unwrap_or(other)).collect(),
        }
    }

    /// Of both ears' response. Where no direct sound stands out, the loudest sample is it.
    fn powers(&self, ears: &[Vec<f32>; 2]) -> Powers {
        let rate_hz = self.grid.sample_rate_hz;
        let found = arrival(ears.each_ref().map(Vec::as_slice), rate_hz);
        let loudest = || {
            let both = ears[0].iter().zip(&ears[1]).map(|(l, r)| l * l + r * r);
            both.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| i)
        };
        let centre = found.map_or_else(loudest, |a| (a.time_s * rate_hz).round() as usize);
        let direct = ears.each_ref().map(|ear| self.cutter.direct(ear, centre));
        let hops = ears.each_ref().map(|ear| self.cutter.hops(ear, centre));
        Powers { direct, hops, centre, delay_s: found.map_or(0.0, |a| a.delay_s as f32) }
    }

    /// Of both ears' response with a level, and the sample of its direct sound.
    pub(crate) fn of(&self, ears: &[Vec<f32>; 2], level: &Level) -> (Simulated, usize) {
        let powers = self.powers(ears);
        let centre = powers.centre;
        (self.levelled(powers, level), centre)
    }

    fn levelled(&self, powers: Powers, level: &Level) -> Simulated {
        let Powers { mut direct, mut hops, delay_s, .. } = powers;
        for power in &mut direct {
            let gains = level.by_bin(&self.grid, &self.bands);
            power.iter_mut().zip(gains).for_each(|(power, gain)| *power *= gain * gain);
        }
        for (l, hop) in hops.iter_mut().flat_map(|ear| ear.iter_mut().enumerate()) {
            hop.iter_mut().enumerate().for_each(|(band, power)| *power *= level.hop(l, band).powi(2));
        }
        let mut transfer = self.shape.silent();
        for (k, (left, right)) in direct[0].iter().zip(&direct[1]).enumerate() {
            (transfer.mixture[k], transfer.difference[k]) = masks([left.sqrt(), right.sqrt()]);
        }
        transfer.delay_s = delay_s;
        let TransferShape { bands, taps, .. } = self.shape;
        for (ear, hops) in hops.iter().enumerate() {
            for band in 0..bands {
                let place = ear * bands + band;
                for (l, hop) in hops.iter().take(taps).enumerate() {
                    transfer.taps[l * 2 * bands + place] = hop[band].sqrt();
                }
                // What comes later, as the exponential that has its energy.
                let rest: f32 = hops.iter().skip(taps).map(|hop| hop[band]).sum();
                transfer.late[place] = (rest * (1.0 - self.decay[band])).sqrt();
            }
        }
        Simulated { features: self.features(&direct, &hops), transfer }
    }

    fn features(&self, direct: &[Vec<f32>; 2], hops: &[Vec<Vec<f32>>; 2]) -> Vec<f32> {
        let level = |power: f32| (10.0 * power.max(f32::MIN_POSITIVE).log10()).max(SILENCE_DB) / SCALE_DB;
        let mut out = Vec::with_capacity(FEATURES * self.queries.len());
        for (bin, band) in &self.queries {
            for (direct, hops) in direct.iter().zip(hops) {
                out.push(level(direct[*bin]));
                for (from, to) in STRETCHES {
                    let stretch = hops.iter().skip(from).take(to + 1 - from).map(|hop| hop[*band]);
                    out.push(level(stretch.sum()));
                }
            }
        }
        out
    }
}

impl Simulated {
    /// The response that this was made of, direct sound at a sample, with its level and the gains by which a corrected transfer
    /// function differs from it.
    pub(crate) fn reshaped(
        &self,
        ears: &[Vec<f32>; 2],
        centre: usize,
        level: &Level,
        corrected: &TransferFunction,
        (grid, bands): (&StftGrid, &Bands),
    ) -> [Vec<f32>; 2] {
        let ratio = |new: f32, old: f32| if old > 0.0 { new / old } else { 1.0 };
        let count = bands.count();
        let taps = self.transfer.taps.len() / (2 * count);
        std::array::from_fn(|ear| {
            let side = |t: &TransferFunction, k: usize| self::ears(t.mixture[k], t.difference[k])[ear];
            let gains = level.by_bin(grid, bands).into_iter().enumerate();
            let direct = gains.map(|(k, gain)| gain * ratio(side(corrected, k), side(&self.transfer, k))).collect();
            let tap = |l: usize, band: usize| {
                let place = ear * count + band;
                let of = |t: &TransferFunction| if l < taps { t.taps[l * 2 * count + place] } else { t.late[place] };
                level.hop(l, band) * ratio(of(corrected), of(&self.transfer))
            };
            let hops =
                (0..=taps.max(ears[ear].len() / grid.hop)).map(|l| (0..count).map(|band| tap(l, band)).collect()).collect();
            Gains { direct, hops }.applied(&ears[ear], centre, grid, bands)
        })
    }

    /// Levels for the network, `[query][feature]`.
    pub(crate) fn features(&self) -> &[f32] {
        &self.features
    }

    /// The simulation with the gains that a network learnt for it, ear by ear.
    pub(crate) fn corrected(&self, learnt: &TransferFunction) -> TransferFunction {
        let mut out = self.transfer.clone();
        for k in 0..out.mixture.len() {
            let own = ears(self.transfer.mixture[k], self.transfer.difference[k]);
            let gains = ears(learnt.mixture[k], learnt.difference[k]);
            (out.mixture[k], out.difference[k]) = masks([own[0] * gains[0], own[1] * gains[1]]);
        }
        out.taps.iter_mut().zip(&learnt.taps).for_each(|(tap, gain)| *tap *= gain);
        out.late.iter_mut().zip(&learnt.late).for_each(|(late, gain)| *late *= gain);
        out
    }

    /// Turns derivatives by the corrected simulation into those by what was learnt.
    pub(crate) fn adjoint(&self, learnt: &TransferFunction, by: &mut TransferFunction) {
        for k in 0..by.mixture.len() {
            let own = ears(self.transfer.mixture[k], self.transfer.difference[k]);
            let gains = ears(learnt.mixture[k], learnt.difference[k]);
            let [left, right] = [own[0] * gains[0], own[1] * gains[1]];
            let sum = left + right;
            let (m, d) = (by.mixture[k], if sum > 0.0 { 2.0 * by.difference[k] / (sum * sum) } else { 0.0 });
            let by_gains = [own[0] * (0.5 * m - d * right), own[1] * (0.5 * m + d * left)];
            let (mixture, difference) = (learnt.mixture[k], learnt.difference[k]);
            by.mixture[k] = by_gains[0] * (1.0 - difference) + by_gains[1] * (1.0 + difference);
            by.difference[k] = mixture * (by_gains[1] - by_gains[0]);
        }
        by.taps.iter_mut().zip(&self.transfer.taps).for_each(|(by, own)| *by *= own);
        by.late.iter_mut().zip(&self.transfer.late).for_each(|(by, own)| *by *= own);
        by.delay_s = 0.0;
    }
}

/// Level in dB at the first hop, and more from hop to hop, of energies over others, `[hop][one, other, weight]`; `None` of too
/// few hops.
fn fitted_line(hops: &[[f32; 3]]) -> Option<[f32; 2]> {
    let heard = hops.iter().enumerate().filter(|(_, [told, own, _])| *told > 0.0 && *own > 0.0);
    let points: Vec<[f32; 3]> = heard.map(|(l, [told, own, sure])| [l as f32, 10.0 * (told / own).log10(), *sure]).collect();
    let sum: f32 = points.iter().map(|p| p[2]).sum();
    let mean = |i: usize| points.iter().map(|p| p[2] * p[i]).sum::<f32>() / sum;
    let (at, db) = (mean(0), mean(1));
    let slope = points.iter().map(|p| p[2] * (p[0] - at) * (p[1] - db)).sum::<f32>()
        / points.iter().map(|p| p[2] * (p[0] - at).powi(2)).sum::<f32>();
    (points.len() >= FEWEST_HOPS).then_some([db - slope * at, slope])
}

/// Both ears' gains of a mixture and a difference mask.
fn ears(mixture: f32, difference: f32) -> [f32; 2] {
    [mixture * (1.0 - difference), mixture * (1.0 + difference)]
}

/// Mixture and difference mask of both ears' gains.
fn masks([left, right]: [f32; 2]) -> (f32, f32) {
    let sum = left + right;
    (0.5 * sum, if sum > 0.0 { (right - left) / sum } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::responses::grid;
    use promenade_testing::noise;

    /// A response of both ears: a click, then noise that decays in a time, so loud.
    fn ears(seed: u64, rate: f64, t60_s: f32, gain: f32) -> [Vec<f32>; 2] {
        [seed, seed + 1].map(|seed| {
            let decay = |i: usize| 10.0_f32.powf(-3.0 * i as f32 / (t60_s * rate as f32));
            let all = noise(seed, 16_000).into_iter().enumerate();
            let mut ear: Vec<f32> = all.map(|(i, x)| if i < 100 { 0.0 } else { 0.05 * gain * decay(i) * x }).collect();
            ear[60] = gain;
            ear
        })
    }

    #[test]
    fn what_is_simulated_gets_the_level_and_the_decay_of_recordings_that_are_sure() {
        let rate = 16_000.0;
        let (grid, bands) = (grid(rate), Bands::for_rate(rate));
        let (count, taps) = (bands.count(), 8);
        let tail = TailModel { seed: 1, t60_s: vec![0.3; count], coherence: vec![0.0; count], by_phase: false };
        let simulation = Simulation::new(&grid, &bands, &tail, &bands, taps);
        let told = |seed: u64, t60_s: f32, gain: f32, noise: f32| {
            let powers = simulation.powers(&ears(seed, rate, t60_s, gain));
            let direct = powers.direct.iter().flat_map(|ear| simulation.cutter.by_band(ear)).collect();
            let of = |place: usize| powers.hops[place / count].iter().take(70).map(|hop| hop[place % count]).collect();
            let (hops, noise) = ((0..2 * count).map(of).collect(), vec![noise; 2 * count]);
            ClipResponse { late: 0, delay_s: 0.0, sounds: vec![true; count], direct, hops, noise }
        };
        let own: Vec<Powers> = (0..6).map(|i| simulation.powers(&ears(10 * i, rate, 0.4, 1.0))).collect();
        // Every other clip is wrong, and says so.
        let clips: Vec<ClipResponse> =
            (0..6).map(|i| if i % 2 == 0 { told(500 + i, 1.2, 0.5, 1e-6) } else { told(600 + i, 0.2, 4.0, 1e3) }).collect();
        let level = simulation.level(own.iter().zip(&clips));
        let per_hop = |t60_s: f64| -60.0 * grid.hop_s() / t60_s;
        for band in 2..count {
            assert!((level.direct_db[band] + 6.0).abs() < 0.5, "{:?}", level.direct_db);
            let [first, more] = level.room_db[band].map(f64::from);
            let wanted = per_hop(1.2) - per_hop(0.4);
            assert!((more / wanted - 1.0).abs() < 0.1 && (first + 6.0).abs() < 2.5, "{first} {more} {wanted}");
        }
        let centre = simulation.powers(&ears(900, rate, 0.4, 1.0)).centre;
        let [(simulated, _), (plain, _)] =
            [&level, &Level::default()].map(|level| simulation.of(&ears(900, rate, 0.4, 1.0), level));
        assert!(simulated.transfer.late[8] > 1.3 * plain.transfer.late[8]);
        let corrected = simulated.transfer.clone();
        let [left, _] = simulated.reshaped(&ears(900, rate, 0.4, 1.0), centre, &level, &corrected, (&grid, &bands));
        // At 0.6 s, where 0.4 s leave -90 dB and 1.2 s -30 dB.
        let power = |x: &[f32]| x[9600..10_600].iter().map(|v| v * v).sum::<f32>();
        let more_db = 10.0 * (power(&left) / power(&ears(900, rate, 0.4, 1.0)[0])).log10();
        assert!((more_db - 57.0).abs() < 8.0, "{more_db}");
    }
}
