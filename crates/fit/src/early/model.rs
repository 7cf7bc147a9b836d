//! The beginnings of responses, as images make them, and what each number that is sought does to them.
//!
//! Amplitude of a path in a band:
//! `exp(level + directivity(departure)) prod sqrt((1 - absorption) (1 - scattering)) exp(-air L / 2) / L`.
//! Impulses pass the chain of loudspeaker and microphone.

use super::band_signal::{BandSignal, Impulses};
use super::chain::Chain;
use super::iterate::{Diffuse, Geometry, Iterate, Stage};
use super::loss::{Compared, Loss, Noise, PIECE, Power};
use super::source_nodes::{Nodes, Shares};
use super::unknowns::Unknowns;
use crate::bands::{BANDS, Bands, PerBand, logistic};
use crate::measurements::{Clock, Measurements, distance};
use crate::room::Path;
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::{signal, spectrum};
use rayon::prelude::*;

/// Samples before the direct sound.
pub(crate) const LEAD: usize = 16;
/// Seconds beyond the window in which paths are still heard in it.
const MARGIN_S: f64 = 0.006;
/// The chain's time before and after an arrival, seconds.
pub(super) const CHAIN_S: (f64, f64) = (0.001, 0.005);

/// One response while it is fitted.
pub(super) struct Observed {
    start_s: f64,
    /// As long as the transforms, faded at the end.
    pub(super) samples: Vec<f64>,
}

/// All that stays the same.
pub(crate) struct EarlyModel<'a> {
    pub(crate) u: Unknowns,
    pub(crate) set: &'a Measurements,
    pub(crate) bands: Bands,
    pub(crate) order: u32,
    /// Samples that are compared.
    pub(crate) length: usize,
    pub(crate) nodes: Nodes,
    pub(crate) facing: bool,
    pub(crate) air_per_m: PerBand,
    pub(crate) speed_m_s: f64,
    pub(crate) rate_hz: f64,
    pub(crate) delay_s: f64,
    pub(super) signal: BandSignal,
    pub(super) observed: Vec<Observed>,
}

/// Logarithm of what a logistic leaves of 1.
fn ln_left(x: f64) -> f64 {
    -(x.max(0.0) + (-x.abs()).exp().ln_1p())
}

impl<'a> EarlyModel<'a> {
    pub(crate) fn new(u: Unknowns, set: &'a Measurements, chain: &Chain, order: u32, window_s: f64) -> Self {
        let rate_hz = f64::from(set.sample_rate_hz);
        let length = (window_s * rate_hz) as usize + LEAD;
        let padded = (length + ((MARGIN_S + CHAIN_S.0 + CHAIN_S.1) * rate_hz) as usize + 64).next_power_of_two();
        let bands = Bands::new(rate_hz);
        let fade = (padded - length) / 2;
        let observed = set
            .all
            .iter()
            .zip(&chain.arrivals_s)
            .map(|(m, arrival)| {
                let start = (arrival * rate_hz).floor() - LEAD as f64;
                let at = |i: usize| (start as isize).checked_add_unsigned(i).and_then(|i| usize::try_from(i).ok());
                let weight = |i: usize| ((padded - i) as f64 / fade as f64).min(1.0);
                let sample = |i: usize| at(i).and_then(|i| m.samples.get(i)).map_or(0.0, |v| weight(i) * f64::from(*v));
                Observed { start_s: start / rate_hz, samples: (0..padded).map(sample).collect() }
            })
            .collect();
        Self {
            u,
            set,
            order,
            length,
            nodes: Nodes::new(u.nodes),
            facing: set.all.iter().all(|m| m.source.facing.is_some()),
            air_per_m: bands.centres_hz.map(|hz| set.air.energy_decay_per_m(hz)),
            speed_m_s: set.air.speed_m_s(),
            rate_hz,
            delay_s: if chain.known { chain.delay_s } else { 0.0 },
            signal: BandSignal::new(padded, rate_hz, &bands),
            bands,
            observed,
        }
    }

    /// The chain's spectrum for [`Geometry`].
    pub(crate) fn chain_spectrum(&self, chain: &Chain) -> Vec<Complex64> {
        let padded = self.signal.length();
        let turn = |(k, bin): (usize, &Complex64)| {
            bin * Complex64::from_polar(1.0, std::f64::consts::TAU * k as f64 * chain.lead as f64 / padded as f64)
        };
        spectrum(chain.response.iter().copied(), padded).iter().enumerate().map(turn).collect()
    }

    /// Samples of the transforms.
    pub(crate) fn padded(&self) -> usize {
        self.signal.length()
    }

    /// A comparison in a range of frequencies.
    pub(crate) fn stage(&self, what: Compared, range_hz: (f64, f64)) -> Stage {
        let loss = Loss::new(self.rate_hz, range_hz);
        let padded = self.signal.length();
        let pass: Vec<f64> = (0..=padded / 2)
            .map(|k| (3.0 - 2.0 * k as f64 * self.rate_hz / padded as f64 / range_hz.1).clamp(0.0, 1.0))
            .collect();
        let targets = self
            .observed
            .par_iter()
            .map(|h| {
                let mut bins = spectrum(h.samples.iter().copied(), padded);
                bins.iter_mut().zip(&pass).for_each(|(b, p)| *b *= p);
                loss.target(&signal(bins, padded)[..self.length])
            })
            .collect();
        Stage { what, loss, targets, pass }
    }

    /// Of each piece of a response's window the bin of energies since the source sounded, and the share of the next; none
    /// before the direct sound.
    fn pieces(&self, x: &[f64], i: usize, bin_s: f64) -> Vec<Option<(usize, f64)>> {
        let began = self.delay_s + 1e-3 * x[self.u.place(i) + 6] - self.observed[i].start_s;
        let direct_s = self.places(x, i).map_or(0.0, |(s, m)| distance(s, m)) / self.speed_m_s;
        (0..self.length.div_ceil(PIECE))
            .map(|p| {
                let since = (p as f64 + 0.5) * PIECE as f64 / self.rate_hz - began;
                let at = (since / bin_s - 0.5).max(0.0);
                (since > direct_s).then_some((at as usize, at.fract()))
            })
            .collect()
    }

    /// Power by sample of diffuse energies, with the source's level.
    fn power(&self, x: &[f64], pieces: &[Option<(usize, f64)>], diffuse: &Diffuse) -> Power {
        let per_sample = 1.0 / (diffuse.bin_s * self.rate_hz);
        let level: PerBand = std::array::from_fn(|b| (2.0 * x[self.u.level(b)]).exp() * per_sample);
        let energy = |i: usize, b: usize| diffuse.energies.get(i).map_or(0.0, |d| d[b]);
        let of = |piece: &Option<(usize, f64)>| match piece {
            Some((below, fraction)) => {
                std::array::from_fn(|b| level[b] * (energy(*below, b) * (1.0 - fraction) + energy(below + 1, b) * fraction))
            }
            None => [0.0; BANDS],
        };
        pieces.iter().map(of).collect()
    }

    /// Adds derivatives by surfaces, scattering and level from those by the power.
    fn by_diffuse(&self, x: &[f64], pieces: &[Option<(usize, f64)>], diffuse: &Diffuse, by_power: &Power, by: &mut [f64]) {
        let per_sample = 1.0 / (diffuse.bin_s * self.rate_hz);
        for (piece, own) in pieces.iter().zip(by_power) {
            let Some((below, fraction)) = piece else { continue };
            for (bin, share) in [(*below, 1.0 - fraction), (below + 1, *fraction)] {
                let (Some(energies), Some(slopes)) = (diffuse.energies.get(bin), diffuse.slopes.get(bin)) else { continue };
                for b in 0..BANDS {
                    let along = own[b] * share * energies[b] * (2.0 * x[self.u.level(b)]).exp() * per_sample;
                    by[self.u.level(b)] += 2.0 * along;
                    for (row, slope) in slopes.iter().enumerate() {
                        by[row * BANDS + b] += along * slope[b];
                    }
                }
            }
        }
    }

    /// Where source and microphone of a measurement are.
    pub(crate) fn places(&self, x: &[f64], i: usize) -> Option<([f64; 3], [f64; 3])> {
        let m = self.set.all.get(i)?;
        let own = &x[self.u.place(i)..];
        let at = |from: usize, place: [f64; 3]| std::array::from_fn(|a| place[a] + own[from + a]);
        Some((at(0, m.source.at_m), at(3, m.microphone.at_m)))
    }

    /// The paths of one measurement with their shares of nodes, and what arrives of them before the chain.
    pub(super) fn impulses(&self, x: &[f64], geometry: &Geometry, i: usize) -> (Vec<(Path, Shares)>, Impulses) {
        let (m, observed) = (&self.set.all[i], &self.observed[i]);
        let Some((source, microphone)) = self.places(x, i) else { return Default::default() };
        let reach = m.distance_m() + (self.length as f64 / self.rate_hz + MARGIN_S) * self.speed_m_s;
        let room = geometry.room.shifted(&x[self.u.wall(0)..self.u.wall(self.u.walls)]);
        let facing = m.source.facing.filter(|_| self.facing);
        let paths: Vec<(Path, Shares)> = room
            .paths(&geometry.sequences[i], source, microphone, self.order, reach)
            .into_iter()
            .map(|path| {
                let shares = if self.u.nodes > 0 { self.nodes.shares(path.departure, facing) } else { Vec::new() };
                (path, shares)
            })
            .collect();
        let left = |s: usize| -> PerBand {
            std::array::from_fn(|b| 0.5 * (ln_left(x[self.u.absorption(s, b)]) + ln_left(x[self.u.scattering(b)])))
        };
        let walls: Vec<PerBand> = (0..self.u.surfaces).map(left).collect();
        let gains = |(path, shares): &(Path, Shares)| -> PerBand {
            let mut ln: PerBand =
                std::array::from_fn(|b| x[self.u.level(b)] - 0.5 * self.air_per_m[b] * path.length_m - path.length_m.ln());
            for (node, share) in shares {
                let directivity = &x[self.u.node(usize::from(*node), 0)..][..BANDS];
                ln.iter_mut().zip(directivity).for_each(|(l, s)| *l += share * s);
            }
            for (surface, n) in &path.hits {
                ln.iter_mut().zip(&walls[usize::from(*surface)]).for_each(|(l, w)| *l += n * w);
            }
            ln.map(f64::exp)
        };
        let offset = self.delay_s + 1e-3 * x[self.u.place(i) + 6] - observed.start_s;
        let of = Impulses {
            times_s: paths.iter().map(|(w, _)| offset + w.length_m / self.speed_m_s).collect(),
            gains: paths.iter().map(gains).collect(),
        };
        (paths, of)
    }

    /// Noise beside a response's images.
    pub(super) fn noise(&self, at: &Iterate<'_>, i: usize) -> Noise {
        let pieces = self.pieces(at.x, i, at.diffuse.bin_s);
        let power = self.power(at.x, &pieces, at.diffuse);
        at.stage.loss.noise(&power, &self.bands, &at.geometry.power, &at.stage.targets[i])
    }

    /// The loss of one response, and its derivatives by all numbers.
    pub(crate) fn response(&self, at: &Iterate<'_>, i: usize) -> (f64, Vec<f64>) {
        let Iterate { x, geometry, stage, diffuse } = *at;
        let (paths, of) = self.impulses(x, geometry, i);
        let padded = self.signal.length();
        let found = self.through(&of, at);
        let noise = self.noise(at, i);
        let (value, by, by_noise) = stage.loss.of(stage.what, &found, &noise, &stage.targets[i]);
        let mut by_bins = spectrum(by.iter().copied(), padded);
        for (k, ((b, c), p)) in by_bins.iter_mut().zip(&geometry.chain).zip(&stage.pass).enumerate() {
            let twice = if k == 0 || 2 * k == padded { 1.0 } else { 2.0 };
            *b *= c.conj() * (p * twice / padded as f64);
        }
        let (by_gains, by_times) = self.signal.back(&of, &by_bins);
        let mut by = self.by_numbers(x, i, &paths, &of, &by_gains, &by_times);
        let pieces = self.pieces(x, i, diffuse.bin_s);
        let by_power = stage.loss.by_power(&by_noise, pieces.len(), &self.bands, &geometry.power);
        self.by_diffuse(x, &pieces, diffuse, &by_power, &mut by);
        (value, by)
    }

    /// The mean loss of some responses, and its derivatives by all numbers.
    pub(crate) fn mean_response(&self, at: &Iterate<'_>, responses: Vec<usize>) -> (f64, Vec<f64>) {
        let share = 1.0 / responses.len() as f64;
        let parts: Vec<(f64, Vec<f64>)> = responses.into_par_iter().map(|i| self.response(at, i)).collect();
        let (mut value, mut by) = (0.0, vec![0.0; self.u.count()]);
        for (own, grown) in &parts {
            value += share * own;
            by.iter_mut().zip(grown).for_each(|(b, g)| *b += share * g);
        }
        (value, by)
    }

    /// Derivatives by all numbers from those by amplitudes and times.
    fn by_numbers(
        &self,
        x: &[f64],
        i: usize,
        paths: &[(Path, Shares)],
        of: &Impulses,
        by_gains: &[[f64; BANDS]],
        by_times: &[f64],
    ) -> Vec<f64> {
        let u = &self.u;
        let mut by = vec![0.0; u.count()];
        // d ln sqrt(1 - a) / d logit(a) = -a / 2.
        let shares: Vec<PerBand> =
            (0..=u.surfaces).map(|s| std::array::from_fn(|b| -0.5 * logistic(x[u.absorption(s, b)]))).collect();
        let place = u.place(i);
        for (((path, nodes), gains), (by_gains, by_time)) in paths.iter().zip(&of.gains).zip(by_gains.iter().zip(by_times)) {
            let along: PerBand = std::array::from_fn(|b| by_gains[b] * gains[b]);
            let mut by_length = by_time / self.speed_m_s;
            for b in 0..BANDS {
                by_length -= along[b] * (1.0 / path.length_m + 0.5 * self.air_per_m[b]);
                by[u.level(b)] += along[b];
                by[u.scattering(b)] += along[b] * f64::from(path.order()) * shares[u.surfaces][b];
            }
            for (surface, n) in &path.hits {
                let s = usize::from(*surface);
                let slots = &mut by[u.absorption(s, 0)..][..BANDS];
                slots.iter_mut().zip(along).zip(&shares[s]).for_each(|((slot, a), share)| *slot += a * n * share);
            }
            for (node, share) in nodes {
                let slots = &mut by[u.node(usize::from(*node), 0)..][..BANDS];
                slots.iter_mut().zip(along).for_each(|(slot, a)| *slot += a * share);
            }
            for (wall, moves) in &path.by_wall {
                by[u.wall(usize::from(*wall))] += by_length * moves;
            }
            for a in 0..3 {
                by[place + a] += by_length * path.by_source[a];
                by[place + 3 + a] += by_length * path.by_microphone[a];
            }
            by[place + 6] += 1e-3 * by_time;
        }
        by
    }

    /// Impulses through the chain, as long as the window.
    pub(super) fn through(&self, of: &Impulses, at: &Iterate<'_>) -> Vec<f64> {
        let mut bins = self.signal.spectrum(of);
        bins.iter_mut().zip(&at.geometry.chain).zip(&at.stage.pass).for_each(|((b, c), p)| *b *= c * p);
        let mut found = signal(bins, self.signal.length());
        found.truncate(self.length);
        found
    }

    /// Numbers to begin with: surfaces of the prior's mean, offsets from arrivals.
    pub(crate) fn start(&self, mean: &[f64], chain: &Chain) -> Vec<f64> {
        let mut x = mean.to_vec();
        for (i, m) in self.set.all.iter().enumerate() {
            if m.clock == Clock::Free || !chain.known {
                x[self.u.place(i) + 6] = 1e3 * (chain.arrivals_s[i] - m.distance_m() / self.speed_m_s);
            }
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::early::NODES;
    use crate::measurements::{Measurement, Place};
    use crate::numerics::Random;
    use crate::room::{FlatRoom, Sequences, Walls};
    use promenade_acoustics::Air;

    #[test]
    fn derivatives_are_those_of_small_steps() {
        let mut random = Random::new(2, 0);
        let samples: Vec<f32> =
            (0..1200).map(|i| if i < 140 { 0.0 } else { (random.normal() * (-f64::from(i) / 300.0).exp()) as f32 }).collect();
        let one = Measurement {
            name: String::new(),
            source: Place { at_m: [1.0, 1.5, 1.2], sd_m: 0.01, facing: Some([0.8, 0.6, 0.0]) },
            microphone: Place { at_m: [3.1, 2.2, 1.5], sd_m: 0.01, facing: None },
            clock: Clock::Free,
            samples,
        };
        let set = Measurements {
            title: String::new(),
            sample_rate_hz: 16_000,
            all: vec![one],
            notes: Vec::new(),
            air: Air::default(),
        };
        let chain = Chain::of(&set).unwrap();
        let u = Unknowns { surfaces: 6, nodes: NODES, walls: 6, places: 1 };
        let model = EarlyModel::new(u, &set, &chain, 3, 0.04);
        let room = FlatRoom::of_box(Walls::of_size([5.1, 4.2, 2.8]).unwrap()).unwrap();
        let geometry = Geometry::new(room, vec![Sequences::default()], &model.chain_spectrum(&chain));
        let flat = Diffuse { energies: vec![[1e-4; BANDS]; 40], slopes: vec![vec![[0.0; BANDS]; 7]; 40], bin_s: 0.004 };
        let stage = model.stage(Compared::Magnitudes, (100.0, 6000.0));
        let mut x = model.start(&vec![-1.0; u.count()], &chain);
        for w in 0..6 {
            x[u.wall(w)] = 0.01 * w as f64;
        }
        (0..6).for_each(|a| x[u.place(0) + a] = 0.004 * a as f64);
        let (_, by) = model.response(&Iterate { x: &x, geometry: &geometry, stage: &stage, diffuse: &flat }, 0);
        let numbers = [
            (u.absorption(2, 7), 1e-4),
            (u.scattering(9), 1e-4),
            (u.level(8), 1e-4),
            (u.node(5, 10), 1e-4),
            (u.wall(1), 1e-6),
            (u.wall(4), 1e-6),
            (u.place(0) + 1, 1e-6),
            (u.place(0) + 3, 1e-6),
            (u.place(0) + 6, 1e-5),
        ];
        for (number, step) in numbers {
            let at = |by: f64| {
                let mut moved = x.clone();
                moved[number] += by;
                model.response(&Iterate { x: &moved, geometry: &geometry, stage: &stage, diffuse: &flat }, 0).0
            };
            let slope = (at(step) - at(-step)) / (2.0 * step);
            assert!((slope - by[number]).abs() < 0.1 * by[number].abs() + 2e-5, "{number}: {slope} {}", by[number]);
        }
    }
}
