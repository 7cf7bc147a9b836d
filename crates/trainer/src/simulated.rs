//! What a simulated room gives for an emitter and a listener, as the network's input and as what it corrects (pi-AVAS, table 4:
//! simulated sound as the input of other methods).

use crate::gains::Gains;
use crate::responses::{ClipResponse, ClipResponses, Cutter, decays};
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
#[derive(Default)]
pub(crate) struct SimulatedClips {
    pub(crate) clips: HashMap<(String, usize), Arc<Simulated>>,
    /// What responses are multiplied by to have the capture's level.
    pub(crate) gain: f32,
}

/// Makes them of responses.
pub(crate) struct Simulation {
    cutter: Cutter,
    shape: TransferShape,
    rate_hz: f64,
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
            rate_hz: grid.sample_rate_hz,
            decay: decays(grid, tail),
            queries: queries.centres_hz().iter().map(place).collect(),
        }
    }

    /// Of the voices of clips, whose levels are then brought to those of the recordings by one gain: the median over what the
    /// training clips tell.
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
        let mut out = SimulatedClips { gain: 1.0, clips: HashMap::new() };
        let mut ratios = Vec::new();
        for (emitter, clips) in wanted {
            let poses: Vec<Pose> = clips.values().map(|(pose, _)| *pose).collect();
            for ((name, (_, learns)), ears) in clips.into_iter().zip(simulate(emitter, &poses)?) {
                let (simulated, _) = self.of(&ears, 1.0);
                ratios.extend(responses.get(name).filter(|_| learns).and_then(|r| simulated.power_ratio(r)));
                out.clips.insert((name.to_owned(), emitter), Arc::new(simulated));
            }
        }
        ratios.sort_by(f32::total_cmp);
        if let Some(median) = ratios.get(ratios.len() / 2) {
            out.gain = median.sqrt();
            out.clips.values_mut().for_each(|clip| Arc::make_mut(clip).amplify(out.gain));
        }
        Ok(out)
    }

    /// Of both ears' response times a gain, and the sample of its direct sound. Where none stands out, the loudest.
    pub(crate) fn of(&self, ears: &[Vec<f32>; 2], gain: f32) -> (Simulated, usize) {
        let found = arrival(ears.each_ref().map(Vec::as_slice), self.rate_hz);
        let loudest = || {
            let both = ears[0].iter().zip(&ears[1]).map(|(l, r)| l * l + r * r);
            both.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| i)
        };
        let centre = found.map_or_else(loudest, |a| (a.time_s * self.rate_hz).round() as usize);
        let direct = ears.each_ref().map(|ear| self.cutter.direct(ear, centre));
        let hops = ears.each_ref().map(|ear| self.cutter.hops(ear, centre));
        let mut transfer = self.shape.silent();
        for (k, (left, right)) in direct[0].iter().zip(&direct[1]).enumerate() {
            (transfer.mixture[k], transfer.difference[k]) = masks([left.sqrt(), right.sqrt()]);
        }
        transfer.delay_s = found.map_or(0.0, |a| a.delay_s as f32);
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
        let mut simulated = Simulated { features: self.features(&direct, &hops), transfer };
        simulated.amplify(gain);
        (simulated, centre)
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
    /// All gains times one.
    fn amplify(&mut self, gain: f32) {
        let TransferFunction { mixture, taps, late, .. } = &mut self.transfer;
        mixture.iter_mut().chain(taps).chain(late).for_each(|g| *g *= gain);
        let levels = 20.0 * gain.log10() / SCALE_DB;
        self.features.iter_mut().for_each(|level| *level += levels);
    }

    /// Power of a clip's response over this one's, direct sound and the room's hops that the clip tells of.
    fn power_ratio(&self, told: &ClipResponse) -> Option<f32> {
        let bands = told.sounds.len();
        let row = 2 * bands;
        let (mut measured, mut simulated) = (0.0, 0.0);
        for place in (0..row).filter(|place| told.sounds[place % bands]) {
            for (l, hop) in told.hops[place].iter().enumerate().take(self.transfer.taps.len() / row) {
                measured += hop.max(0.0);
                simulated += self.transfer.taps[l * row + place].powi(2);
            }
        }
        (simulated > 0.0 && measured > 0.0).then(|| measured / simulated)
    }

    /// The response that this was made of, direct sound at a sample, with the gains by which a corrected transfer function
    /// differs from it.
    pub(crate) fn reshaped(
        &self,
        ears: &[Vec<f32>; 2],
        centre: usize,
        gain: f32,
        corrected: &TransferFunction,
        (grid, bands): (&StftGrid, &Bands),
    ) -> [Vec<f32>; 2] {
        let ratio = |new: f32, old: f32| gain * if old > 0.0 { new / old } else { 1.0 };
        let count = bands.count();
        let taps = self.transfer.taps.len() / (2 * count);
        std::array::from_fn(|ear| {
            let side = |t: &TransferFunction, k: usize| self::ears(t.mixture[k], t.difference[k])[ear];
            let direct = (0..grid.bins()).map(|k| ratio(side(corrected, k), side(&self.transfer, k))).collect();
            let tap = |l: usize, band: usize| {
                let place = ear * count + band;
                let of = |t: &TransferFunction| if l < taps { t.taps[l * 2 * count + place] } else { t.late[place] };
                ratio(of(corrected), of(&self.transfer))
            };
            let hops = (0..=taps).map(|l| (0..count).map(|band| tap(l, band)).collect()).collect();
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

/// Both ears' gains of a mixture and a difference mask.
fn ears(mixture: f32, difference: f32) -> [f32; 2] {
    [mixture * (1.0 - difference), mixture * (1.0 + difference)]
}

/// Mixture and difference mask of both ears' gains.
fn masks([left, right]: [f32; 2]) -> (f32, f32) {
    let sum = left + right;
    (0.5 * sum, if sum > 0.0 { (right - left) / sum } else { 0.0 })
}
