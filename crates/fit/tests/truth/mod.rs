//! Responses of a box by means of their own: sound of each frequency by itself from plain mirroring, wall after wall, with
//! reflections of linear phase, and noise with the energy of rays that were scattered.

use promenade_acoustics::Air;
use promenade_fit::{Clock, Measurement, Measurements, Place, Random};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::{signal, spectrum};
use std::f64::consts::TAU;

pub(crate) const RATE: f64 = 16_000.0;
const C: f64 = 343.0;
/// Nodes of frequency, evenly on a logarithmic scale from 60 Hz to 8 kHz.
const NODES: usize = 33;
const RAYS: usize = 3000;
const RADIUS_M: f64 = 0.4;
const BIN_S: f64 = 0.004;

/// A box of which everything is known.
pub(crate) struct Truth {
    pub(crate) size: [f64; 3],
    pub(crate) source: [f64; 3],
    pub(crate) facing: Option<[f64; 3]>,
    /// Reflections of images; what mirrors send on beyond is the rays'.
    pub(crate) order: u32,
    pub(crate) length_s: f64,
    pub(crate) scattered: bool,
    /// Noise below the loudest sample, dB.
    pub(crate) noise_db: f64,
    /// Walls that are covered by [`PANEL`].
    pub(crate) panels: [bool; 6],
}

/// Absorption of panels in seven octaves from 125 Hz.
pub(crate) const PANEL: [f32; 7] = [0.2, 0.4, 0.65, 0.8, 0.75, 0.7, 0.65];

fn hz(node: usize) -> f64 {
    60.0 * (8000.0_f64 / 60.0).powf(node as f64 / (NODES - 1) as f64)
}

fn place(at: f64) -> (usize, f64) {
    let at = ((at.max(60.0) / 60.0).ln() / (8000.0_f64 / 60.0).ln() * (NODES - 1) as f64).clamp(0.0, (NODES - 1) as f64 - 1e-9);
    (at as usize, at.fract())
}

/// Absorption of a wall: smooth over frequency, and of no band's form.
pub(crate) fn absorption(wall: usize, hz: f64) -> f64 {
    let at = (hz / 100.0).ln();
    0.25 + 0.15 * (0.9 * at + wall as f64).sin() + 0.03 * wall as f64
}

/// Attenuation of air, dB per metre: near enough to ISO 9613-1 at 20 degrees and 50 per cent.
fn air_db(hz: f64) -> f64 {
    Air::default().db_per_m(hz)
}

impl Truth {
    pub(crate) fn new(size: [f64; 3], source: [f64; 3]) -> Self {
        Self { size, source, facing: None, order: 22, length_s: 0.8, scattered: true, noise_db: -200.0, panels: [false; 6] }
    }

    /// Absorption of a wall, or of panels before it.
    fn absorption(&self, wall: usize, hz: f64) -> f64 {
        if !self.panels[wall] {
            return absorption(wall, hz);
        }
        let at = (hz / 125.0).log2().clamp(0.0, 6.0);
        let below = (at as usize).min(5);
        let share = at - below as f64;
        f64::from(PANEL[below]) * (1.0 - share) + f64::from(PANEL[below + 1]) * share
    }

    /// Scattering of all walls.
    pub(crate) fn scattering(&self, hz: f64) -> f64 {
        if self.scattered { 0.1 + 0.4 * ((hz / 100.0).ln() / 70f64.ln()).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// What the source sends beside its axis.
    fn sent(&self, hz: f64, cosine: f64) -> f64 {
        (0.4 * (hz / 500.0).min(8.0).sqrt() * (cosine - 1.0)).exp()
    }

    fn specular(&self, wall: usize, hz: f64) -> f64 {
        (1.0 - self.absorption(wall, hz)) * (1.0 - self.scattering(hz))
    }

    /// Chain: a converter's edge, and a resonance.
    fn chain(hz: f64) -> Complex64 {
        let edge = ((7900.0 - hz) / 500.0).clamp(0.0, 1.0) * (hz / 60.0).powi(2) / (1.0 + (hz / 60.0).powi(2));
        let s = Complex64::new(0.0, hz / 1400.0);
        let peak = (s * s + s * 0.9 + 1.0) / (s * s + s * 0.6 + 1.0);
        peak * Complex64::from_polar(edge, -TAU * hz * 0.002)
    }

    /// Places of all images along an axis, with reflections at the lower and at the higher wall.
    fn axis(&self, a: usize) -> Vec<(f64, i32, i32)> {
        let mut all = vec![(self.source[a], 0, 0)];
        for first_low in [true, false] {
            let (mut x, mut low, mut high, mut at_low) = (self.source[a], 0, 0, first_low);
            for _ in 0..self.order {
                x = if at_low { -x } else { 2.0 * self.size[a] - x };
                if at_low {
                    low += 1;
                } else {
                    high += 1;
                }
                all.push((x, low, high));
                at_low = !at_low;
            }
        }
        all
    }

    /// What one microphone hears.
    pub(crate) fn response(&self, microphone: [f64; 3], diffuse: &[Vec<f64>], seed: u64) -> Vec<f32> {
        let length = ((self.length_s * RATE) as usize).next_power_of_two();
        let bins = length / 2 + 1;
        let reach = 0.75 * length as f64 / RATE * C;
        let walls: Vec<[f64; NODES]> = (0..6).map(|w| std::array::from_fn(|n| 0.5 * self.specular(w, hz(n)).ln())).collect();
        let at: Vec<(usize, f64)> = (0..bins).map(|k| place(k as f64 * RATE / length as f64)).collect();
        let mut sum = vec![Complex64::default(); bins];
        let axes = [0, 1, 2].map(|a| self.axis(a));
        for x in &axes[0] {
            for y in &axes[1] {
                for z in &axes[2] {
                    let hits = [x.1, x.2, y.1, y.2, z.1, z.2];
                    let way = [x.0 - microphone[0], y.0 - microphone[1], z.0 - microphone[2]];
                    let far = way.iter().map(|w| w * w).sum::<f64>().sqrt();
                    if far > reach || hits.iter().sum::<i32>() > self.order as i32 {
                        continue;
                    }
                    // An odd number of reflections along an axis turns the departure round.
                    let cosine = self.facing.map_or(1.0, |f| {
                        let turned = |a: usize| if (hits[2 * a] + hits[2 * a + 1]) % 2 == 0 { -1.0 } else { 1.0 };
                        (0..3).map(|a| f[a] * turned(a) * way[a] / far).sum()
                    });
                    let nodes: Vec<f64> = (0..NODES)
                        .map(|n| {
                            let walls: f64 = (0..6).map(|w| f64::from(hits[w]) * walls[w][n]).sum();
                            let sent = if self.facing.is_some() { self.sent(hz(n), cosine) } else { 1.0 };
                            sent * (walls - air_db(hz(n)) * far * std::f64::consts::LN_10 / 20.0).exp() / far
                        })
                        .collect();
                    let turn = Complex64::from_polar(1.0, -TAU * RATE / length as f64 * far / C);
                    let mut phase = Complex64::from(1.0);
                    for (slot, (below, fraction)) in sum.iter_mut().zip(&at) {
                        *slot += phase * (nodes[*below] * (1.0 - fraction) + nodes[below + 1] * fraction);
                        phase *= turn;
                    }
                }
            }
        }
        // Scattered sound, band by band, passes the same chain.
        let mut random = Random::new(seed, 17);
        let mut noise = vec![0.0; length];
        for (band, energies) in diffuse.iter().enumerate() {
            let mut own = spectrum((0..length).map(|_| random.normal()), length);
            for (k, bin) in own.iter_mut().enumerate() {
                // Powers add up to 1 between two bands.
                let (below, fraction) = octave(k as f64 * RATE / length as f64);
                let share = if below == band {
                    1.0 - fraction
                } else if below + 1 == band {
                    fraction
                } else {
                    0.0
                };
                *bin *= share.sqrt();
            }
            let samples = BIN_S * RATE;
            for (i, v) in signal(own, length).iter().enumerate() {
                let energy = energies.get((i as f64 / samples) as usize).copied().unwrap_or(0.0);
                noise[i] += v * (energy / samples).sqrt();
            }
        }
        let noise = spectrum(noise, length);
        for (k, (slot, n)) in sum.iter_mut().zip(&noise).enumerate() {
            *slot = (*slot + n) * Self::chain(k as f64 * RATE / length as f64);
        }
        let mut heard = signal(sum, length);
        let most = heard.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        heard.iter_mut().for_each(|v| *v += most * 10f64.powf(self.noise_db / 20.0) * random.normal());
        heard.truncate((0.9 * length as f64) as usize);
        heard.into_iter().map(|v| v as f32).collect()
    }

    /// Energies of scattered sound at microphones, `[microphone][octave][bin]`, by rays whose energies spheres collect.
    pub(crate) fn diffuse(&self, microphones: &[[f64; 3]]) -> Vec<Vec<Vec<f64>>> {
        let bins = (self.length_s / BIN_S) as usize;
        let mut all = vec![vec![vec![0.0; bins]; OCTAVES]; microphones.len()];
        if !self.scattered {
            return all;
        }
        let volume = 4.0 / 3.0 * std::f64::consts::PI * RADIUS_M.powi(3);
        for o in 0..OCTAVES {
            let f = octave_hz(o);
            let (s, air) = (self.scattering(f), air_db(f) * std::f64::consts::LN_10 / 10.0);
            for ray in 0..RAYS {
                let mut random = Random::new(o as u64, ray as u64);
                let mut d = sphere(&mut random);
                let mut at = self.source;
                let sent = self.facing.map_or(1.0, |t| self.sent(f, (0..3).map(|a| t[a] * d[a]).sum()).powi(2));
                let (mut energy, mut way, mut hits, mut mirrored) =
                    (4.0 * std::f64::consts::PI * sent / RAYS as f64, 0.0, 0, true);
                while way < self.length_s * C && energy > 1e-9 {
                    let (mut near, mut wall) = (f64::INFINITY, 0);
                    for a in 0..3 {
                        let to = if d[a] > 0.0 { (self.size[a] - at[a]) / d[a] } else { -at[a] / d[a] };
                        if to < near {
                            (near, wall) = (to, 2 * a + usize::from(d[a] > 0.0));
                        }
                    }
                    if !mirrored || hits > self.order {
                        for (m, own) in microphones.iter().zip(&mut all) {
                            let to: [f64; 3] = std::array::from_fn(|a| m[a] - at[a]);
                            let along: f64 = (0..3).map(|a| to[a] * d[a]).sum();
                            let beside = to.iter().map(|v| v * v).sum::<f64>() - along * along;
                            if beside < RADIUS_M * RADIUS_M {
                                let half = (RADIUS_M * RADIUS_M - beside).sqrt();
                                let (from, until) = ((along - half).max(0.0), (along + half).min(near));
                                let bin = ((way + 0.5 * (from + until)) / C / BIN_S) as usize;
                                if until > from && bin < bins {
                                    own[o][bin] += energy * (until - from) / volume * (-air * (way + along)).exp();
                                }
                            }
                        }
                    }
                    way += near;
                    hits += 1;
                    (0..3).for_each(|a| at[a] = (at[a] + near * d[a]).clamp(0.0, self.size[a]));
                    let axis = wall / 2;
                    at[axis] = if wall % 2 == 0 { 0.0 } else { self.size[axis] };
                    energy *= 1.0 - self.absorption(wall, f);
                    if random.uniform() < s {
                        mirrored = false;
                        let mut n = sphere(&mut random);
                        n[axis] += if wall % 2 == 0 { 1.0 } else { -1.0 };
                        let l = n.iter().map(|v| v * v).sum::<f64>().sqrt().max(1e-9);
                        d = n.map(|v| v / l);
                    } else {
                        d[axis] = -d[axis];
                    }
                }
            }
        }
        all
    }

    /// Measurements at microphones that are stated with an error, with an offset of up to so many seconds each.
    pub(crate) fn measured(&self, microphones: &[[f64; 3]], sd_m: f64, offset_s: f64) -> Measurements {
        let mut random = Random::new(11, 1);
        let diffuse = self.diffuse(microphones);
        let all = microphones
            .iter()
            .zip(&diffuse)
            .enumerate()
            .map(|(i, (at, diffuse))| {
                let mut samples = self.response(*at, diffuse, i as u64);
                let late = (offset_s * RATE * random.uniform()) as usize;
                samples.splice(0..0, std::iter::repeat_n(0.0, late));
                let stated = at.map(|c| c + sd_m * random.normal());
                Measurement {
                    name: format!("{i:02}"),
                    source: Place { at_m: self.source, sd_m: 0.0, facing: self.facing },
                    microphone: Place { at_m: stated, sd_m, facing: None },
                    clock: if offset_s > 0.0 { Clock::Free } else { Clock::Known },
                    samples,
                }
            })
            .collect();
        Measurements { title: "box".to_owned(), sample_rate_hz: RATE as u32, all, notes: Vec::new(), air: Air::default() }
    }

    /// Places all over the box.
    pub(crate) fn microphones(&self, count: usize) -> Vec<[f64; 3]> {
        let mut random = Random::new(11, 0);
        (0..count).map(|_| std::array::from_fn(|a| 0.5 + (self.size[a] - 1.0) * random.uniform())).collect()
    }
}

const OCTAVES: usize = 8;

fn octave_hz(o: usize) -> f64 {
    62.5 * 2f64.powi(o as i32)
}

fn octave(hz: f64) -> (usize, f64) {
    let at = (hz.max(1.0) / 62.5).log2().clamp(0.0, (OCTAVES - 1) as f64 - 1e-9);
    (at as usize, at.fract())
}

fn sphere(random: &mut Random) -> [f64; 3] {
    let z = 1.0 - 2.0 * random.uniform();
    let (sine, cosine) = (TAU * random.uniform()).sin_cos();
    let r = (1.0 - z * z).sqrt();
    [r * cosine, r * sine, z]
}
