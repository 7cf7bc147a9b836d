//! Distances of walls, one wall at a time, from the echoes that each alone makes.
//!
//! Responses are freed of the chain, their envelopes divided by the local median, and the logarithms added up where a wall's
//! own image would arrive at each place, for one distance after the other. A peak that stands out of the scan is the wall; all
//! walls at once find each other's echoes instead.

use crate::early::{Chain, EarlyModel};
use crate::measurements::{Measurement, distance};
use crate::room::{FlatRoom, FlatWall, Form, dot};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::{signal, spectrum};
use promenade_metrics::statistics::median_high;
use rayon::prelude::*;

/// Frequencies that are listened to: rising and falling between each two, hertz.
const RANGE_HZ: [f64; 4] = [200.0, 500.0, 5000.0, 7000.0];
/// Seconds after the direct sound that are searched, and in which echoes are not told from it.
const SEARCHED_S: (f64, f64) = (0.06, 0.0005);
/// Half of the time that a median is taken over, seconds.
const MEDIAN_S: f64 = 0.003;
/// How far walls are from where they are said to be at most: a share of the room's length that way, and metres at least.
pub(crate) const REACH: (f64, f64) = (0.15, 0.3);
/// Passes, each with the walls that the one before has found.
const PASSES: usize = 3;
/// Weight of what two walls have mirrored over that of one's, and the greatest cosine between their normals.
pub(crate) const WITH_OTHERS: f64 = 0.6;
const ACROSS: f64 = 0.1;
/// Metres from one distance to the next.
pub(crate) const STEP_M: f64 = 0.005;
/// A wall's peak is this many standard deviations of the scan above its mean, and so much above any other that is not beside
/// it.
const STANDS_OUT: (f64, f64) = (2.5, 0.5);
/// Peaks nearer than this are one, metres.
pub(crate) const BESIDE_M: f64 = 0.1;
/// Logarithms of envelopes over their medians are held between these.
const HELD: (f64, f64) = (-1.0, 2.5);
/// Places that have to hear a wall's own echo.
const LEAST_PLACES: usize = 3;

/// What the scan says of a wall. The default is one that stays.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scanned {
    /// Metres that it moves along its normal.
    pub moved_m: f64,
    /// How far the peak stands out of the scan, standard deviations.
    pub stands_out: f64,
    /// Whether that is enough; without it the wall stays.
    pub found: bool,
}

/// Scans all walls of a room with sources and microphones where they are said to be. Walls that stand out help to find the
/// others: what both have mirrored comes too.
pub(crate) fn scan(model: &EarlyModel<'_>, room: &FlatRoom, chain: &Chain) -> Vec<Scanned> {
    let all_echoes: Vec<Vec<f64>> = (0..model.set.all.len()).into_par_iter().map(|i| echoes(model, chain, i)).collect();
    let mut all = vec![Scanned::default(); room.walls.len()];
    for _ in 0..PASSES {
        let by: Vec<f64> = all.iter().map(|s| s.moved_m).collect();
        let scan = Scan { model, room: room.shifted(&by), echoes: &all_echoes, all: &all };
        let next: Vec<Scanned> = (0..room.walls.len())
            .into_par_iter()
            .map(|w| {
                let reach = (REACH.0 * extent(room, w)).max(REACH.1);
                let steps = (reach / STEP_M) as i32;
                let at = |i: i32| f64::from(i) * STEP_M;
                judge(
                    &(-steps..=steps)
                        .filter_map(|i| Some((at(i), scan.score(w, room.walls[w].at_m + at(i))?)))
                        .collect::<Vec<_>>(),
                )
            })
            .collect();
        all = next;
    }
    all
}

/// A scan with what is known so far.
struct Scan<'a> {
    model: &'a EarlyModel<'a>,
    room: FlatRoom,
    echoes: &'a [Vec<f64>],
    all: &'a [Scanned],
}

impl Scan<'_> {
    /// Mean of what is heard where a wall would mirror sources to, by itself and with others that are known.
    fn score(&self, wall: usize, at_m: f64) -> Option<f64> {
        let walls = &self.room.walls;
        let normal = walls[wall].normal;
        let across = |other: &FlatWall| dot(other.normal, normal).abs() < ACROSS;
        let others: Vec<&FlatWall> = walls.iter().zip(self.all).filter(|(w, s)| s.found && across(w)).map(|(w, _)| w).collect();
        let moved = FlatWall { at_m, ..walls[wall] };
        let (mut sum, mut count, mut places) = (0.0, 0.0, 0);
        for (m, own) in self.model.set.all.iter().zip(self.echoes) {
            let (s, r) = (m.source.at_m, m.microphone.at_m);
            // A wall has source and microphone on the side where they are said to be.
            let stated = |at: [f64; 3]| height(&walls[wall], at);
            if stated(s) * stated(r) <= 0.0 || height(&moved, s) * stated(s) <= 0.0 || height(&moved, r) * stated(r) <= 0.0 {
                continue;
            }
            let image = mirrored(&moved, s);
            let alone = std::iter::once(image);
            let with = others.iter().filter(|w| height(w, s) * height(w, r) > 0.0).map(|w| mirrored(w, image));
            let mut reaches = false;
            for (i, image) in alone.chain(with).enumerate() {
                if let Some(echo) = echo_of(image, m, own, self.model.rate_hz, self.model.speed_m_s) {
                    let weight = if i == 0 { 1.0 } else { WITH_OTHERS };
                    sum += weight * echo;
                    count += weight;
                    reaches |= i == 0;
                }
            }
            places += usize::from(reaches);
        }
        (places >= LEAST_PLACES).then(|| sum / count)
    }
}

fn height(wall: &FlatWall, at: [f64; 3]) -> f64 {
    dot(at, wall.normal) - wall.at_m
}

pub(crate) fn mirrored(wall: &FlatWall, at: [f64; 3]) -> [f64; 3] {
    let by = -2.0 * height(wall, at);
    std::array::from_fn(|a| at[a] + by * wall.normal[a])
}

/// How loud the echo from an image is in what [`echoes`] makes of a response; none outside of the time that is searched.
pub(crate) fn echo_of(image: [f64; 3], m: &Measurement, echoes: &[f64], rate_hz: f64, speed_m_s: f64) -> Option<f64> {
    let later = (distance(image, m.microphone.at_m) - m.distance_m()) / speed_m_s;
    (SEARCHED_S.1..SEARCHED_S.0).contains(&later).then(|| {
        let at = later * rate_hz;
        let (below, fraction) = (at as usize, at.fract());
        let value = |i: usize| echoes.get(i).copied().unwrap_or(HELD.0);
        value(below) * (1.0 - fraction) + value(below + 1) * fraction
    })
}

/// The highest peak of a scan, and whether it stands out.
pub(crate) fn judge(scores: &[(f64, f64)]) -> Scanned {
    let Some((best, top)) = scores.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)) else {
        return Scanned::default();
    };
    let count = scores.len() as f64;
    let mean = scores.iter().map(|s| s.1).sum::<f64>() / count;
    let sd = (scores.iter().map(|s| (s.1 - mean).powi(2)).sum::<f64>() / count).sqrt().max(1e-9);
    let rest = scores.iter().filter(|s| (s.0 - best).abs() > BESIDE_M).map(|s| s.1).fold(f64::NEG_INFINITY, f64::max);
    let stands_out = (top - mean) / sd;
    let found = stands_out > STANDS_OUT.0 && (top - rest) / sd > STANDS_OUT.1;
    // The top of a parabola through the peak.
    let step = scores.get(1).map_or(0.0, |s| s.0 - scores[0].0);
    let at = scores.iter().position(|s| s.0 == best).unwrap_or(0);
    let moved_m = match (at.checked_sub(1).and_then(|i| scores.get(i)), scores.get(at + 1)) {
        (Some(a), Some(b)) if a.1 + b.1 < 2.0 * top => best + 0.5 * step * (a.1 - b.1) / (a.1 - 2.0 * top + b.1),
        _ => best,
    };
    Scanned { moved_m: if found { moved_m } else { 0.0 }, stands_out, found }
}

/// The room's length along a wall's normal, metres.
fn extent(room: &FlatRoom, wall: usize) -> f64 {
    let normal = room.walls[wall].normal;
    match &room.form {
        Form::Box(walls) => walls.size_m()[wall / 2],
        Form::Mesh(mesh) => {
            let along = mesh.vertices.iter().map(|v| dot(*v, normal));
            let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
            (high - low).max(0.0)
        }
    }
}

/// Logarithm of a response's envelope over its local median, from the direct sound on.
pub(crate) fn echoes(model: &EarlyModel<'_>, chain: &Chain, number: usize) -> Vec<f64> {
    let rate = model.rate_hz;
    let m = &model.set.all[number];
    let count = (SEARCHED_S.0 * rate) as usize;
    let length = (2 * count + 4 * chain.response.len()).next_power_of_two();
    let arrival = chain.arrivals_s[number] * rate;
    let first = arrival.floor() - chain.lead as f64;
    let sample = |i: usize| {
        let at = (first as isize).checked_add_unsigned(i).and_then(|i| usize::try_from(i).ok());
        let fade = ((length / 2 + count - i) as f64 / 64.0).clamp(0.0, 1.0);
        at.and_then(|i| m.samples.get(i)).map_or(0.0, |v| fade * f64::from(*v))
    };
    let mut bins = spectrum((0..length / 2 + count).map(sample), length);
    let chain_bins = spectrum(chain.response.iter().copied(), length);
    let most = chain_bins.iter().map(Complex64::norm_sqr).fold(1e-30, f64::max);
    let fraction = arrival.fract();
    for (k, (bin, c)) in bins.iter_mut().zip(&chain_bins).enumerate() {
        let hz = k as f64 * rate / length as f64;
        let rise = ((hz - RANGE_HZ[0]) / (RANGE_HZ[1] - RANGE_HZ[0])).clamp(0.0, 1.0);
        let fall = ((RANGE_HZ[3] - hz) / (RANGE_HZ[3] - RANGE_HZ[2])).clamp(0.0, 1.0);
        let turn = std::f64::consts::TAU * k as f64 / length as f64 * fraction;
        *bin *= c.conj() / (c.norm_sqr() + 1e-3 * most) * Complex64::from_polar(rise * fall, turn);
    }
    let turned: Vec<Complex64> = bins.iter().map(|b| Complex64::new(b.im, -b.re)).collect();
    let (real, imaginary) = (signal(bins, length), signal(turned, length));
    let mut envelope: Vec<f64> = real.iter().zip(&imaginary).take(count).map(|(a, b)| a.hypot(*b)).collect();
    // Echoes come as early or late as places are wrong.
    let sd = 1.4 * m.source.sd_m.hypot(m.microphone.sd_m) / model.speed_m_s * rate;
    envelope = smooth(&envelope, sd);
    let half = (MEDIAN_S * rate) as usize;
    (0..count)
        .map(|i| {
            let near = median_high(envelope[i.saturating_sub(half)..(i + half).min(count)].iter().copied());
            (envelope[i].max(1e-30) / near.unwrap_or(0.0).max(1e-30)).ln().clamp(HELD.0, HELD.1)
        })
        .collect()
}

/// A Gaussian's mean about each sample.
fn smooth(x: &[f64], sd: f64) -> Vec<f64> {
    let half = (3.0 * sd).ceil() as usize;
    if half == 0 {
        return x.to_vec();
    }
    let weight = |d: usize| (-0.5 * (d as f64 / sd).powi(2)).exp();
    (0..x.len())
        .map(|i| {
            let near = i.saturating_sub(half)..(i + half + 1).min(x.len());
            let (sum, norm) = near.fold((0.0, 0.0), |(s, n), j| (s + weight(i.abs_diff(j)) * x[j], n + weight(i.abs_diff(j))));
            sum / norm
        })
        .collect()
}
