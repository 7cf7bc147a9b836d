//! The bass of a box from its modes.
//!
//! Along two axes the field is a sum over modes between walls of some admittance, along the longest its closed form (P. M.
//! Morse and K. U. Ingard, *Theoretical Acoustics*, section 9.5). Near the source such a sum converges slowly, so that the same
//! sum for hard walls and sound that dies away within the room is taken off, and added as what it is: a few images.

use crate::error::AcousticsError;
use crate::images::shoebox::Shoebox;
use crate::low_frequency::low_field::{FADE, LowField, LowResponse, RATE, response, share, transform_len};
use crate::low_frequency::modes::{Ends, LowPlaces, Sums};
use crate::materials::admittance::quick_admittance;
use promenade_fourier::num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// Modes are summed up to this many times the wave number of the highest frequency.
const MODES: f64 = 2.5;
/// Pairs above this many times that wave number change slowly over frequency, and are known at a few.
const SLOW: f64 = 1.25;
const FEW: usize = 14;
/// Within the cube root of the volume the sound that is taken off dies away by so many nepers.
const DIES: f64 = 6.0;
/// Images farther than so many nepers are none.
const FARTHEST: f64 = 16.0;

impl Shoebox {
    /// What places in the box hear of a source at low frequencies, in the order `[z][y][x]`: pressure and its gradient, with
    /// all that walls reflect. Walls react locally, with the real admittance at each frequency that absorbs their share of
    /// sound from everywhere.
    ///
    /// # Errors
    /// A size, a material, a source or a place that is not in the box; a frequency, a length or a speed that is not finite and
    /// above 0.
    pub fn low_field(&self, source: [f64; 3], places: &LowPlaces) -> Result<LowField, AcousticsError> {
        self.check()?;
        self.check_source(source)?;
        for (what, value) in [("frequency", places.top_hz), ("length", places.length_s), ("speed of sound", places.speed_m_s)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(AcousticsError::argument(what, "finite and above 0", value));
            }
        }
        for (axis, size) in self.size.iter().enumerate() {
            if let Some(found) = places.axes[axis].iter().find(|at| !(0.0..=*size).contains(*at)) {
                return Err(AcousticsError::argument("place", format!("within {size} m"), found));
            }
        }
        let rate_hz = RATE * places.top_hz;
        let length = (places.length_s * rate_hz).ceil() as usize;
        let spectra = self.spectra(source, places, length, rate_hz);
        let n = transform_len(length);
        let place = |index: usize| {
            let [pressure, x, y, z] = [0, 1, 2, 3].map(|part| {
                response(length, rate_hz, places.top_hz, |hz| spectra[(hz * n as f64 / rate_hz).round() as usize][index][part])
            });
            LowResponse { pressure, gradient: [x, y, z] }
        };
        let count = places.axes.iter().map(Vec::len).product();
        Ok(LowField { rate_hz, top_hz: places.top_hz, places: (0..count).map(place).collect() })
    }

    /// How many numbers are multiplied for [`Self::low_field`], about.
    #[must_use]
    pub fn low_field_cost(&self, places: &LowPlaces) -> f64 {
        let [nx, ny, nz] = places.axes.each_ref().map(|axis| axis.len() as f64);
        let closed = (0..3).max_by(|a, b| self.size[*a].total_cmp(&self.size[*b])).unwrap_or(2);
        let across = self.volume_m3() / self.size[closed];
        let number = TAU * FADE * places.top_hz / places.speed_m_s;
        let count = places.axes[closed].len() as f64;
        let pairs = |most: f64| most * most * across / (4.0 * PI) + 4.0;
        // A wave takes as long as some twenty products.
        let places_in_all = nx * ny * nz;
        let of_pairs = |pairs: f64| {
            pairs * (20.0 * (count + 2.0) + 6.0 * (places_in_all * count).sqrt()) + 16.0 * pairs.sqrt() * places_in_all
        };
        let samples = places.length_s * RATE * places.top_hz;
        let slow = FEW as f64 * of_pairs(pairs(MODES * number + 2.0 * PI / self.volume_m3().cbrt()));
        0.6 * samples * of_pairs(pairs(SLOW * number)) + slow + 40.0 * samples * places_in_all
    }

    /// `[bin][place][part]`
    fn spectra(&self, source: [f64; 3], places: &LowPlaces, length: usize, rate_hz: f64) -> Vec<Vec<[Complex64; 4]>> {
        let closed = (0..3).max_by(|a, b| self.size[*a].total_cmp(&self.size[*b])).unwrap_or(2);
        let axes = [(closed + 1) % 3, (closed + 2) % 3, closed];
        let count: usize = places.axes.iter().map(Vec::len).product();
        let highest = TAU * FADE * places.top_hz / places.speed_m_s;
        let most = MODES * highest + 2.0 * PI / self.volume_m3().cbrt();
        let hard = [0, 1].map(|which| -> Vec<f64> {
            let size = self.size[axes[which]];
            (0..=(most * size / PI) as usize).map(|m| m as f64 * PI / size).collect()
        });
        let number = |l: usize, m: usize| hard[0][l].hypot(hard[1][m]);
        let kept = |l: usize, m: usize| number(l, m) <= most;
        let slow = |l: usize, m: usize| kept(l, m) && number(l, m) > SLOW * highest;
        let fast = |l: usize, m: usize| number(l, m) <= SLOW * highest;
        let sums = Sums { axes, places, source };
        let slow_at: Vec<f64> = (0..FEW)
            .map(|n| {
                let turn = PI * (n as f64 + 0.5) / FEW as f64;
                0.5 * FADE * places.top_hz * (1.0 - turn.cos())
            })
            .collect();
        // Wave numbers are followed from those of hard walls.
        let start = || hard.each_ref().map(|all| all.iter().map(|k| Complex64::new(k.max(1e-9), 0.0)).collect::<Vec<_>>());
        let mut followed = Followed { walls: self, sums: &sums, numbers: start(), from_rest: true };
        let slow_sum = |hz: &f64| {
            let mut out = vec![[Complex64::default(); 4]; count];
            followed.add(*hz, slow, &mut out);
            out
        };
        let slow_sums: Vec<_> = slow_at.iter().map(slow_sum).collect();
        let near = self.near(&sums, [&hard[0], &hard[1]], kept, count);
        let mut followed = Followed { walls: self, sums: &sums, numbers: start(), from_rest: true };
        for (which, numbers) in followed.numbers.iter_mut().enumerate() {
            numbers.truncate((SLOW * highest * self.size[axes[which]] / PI) as usize + 1);
        }
        let n = transform_len(length);
        (0..=n / 2)
            .map(|k| {
                let hz = k as f64 * rate_hz / n as f64;
                if share(hz, places.top_hz) == 0.0 {
                    return vec![[Complex64::default(); 4]; if hz > places.top_hz { 0 } else { count }];
                }
                let mut out = near.clone();
                followed.add(hz, fast, &mut out);
                for (sum, weight) in slow_sums.iter().zip(lagrange(&slow_at, hz)) {
                    for (out, slow) in out.iter_mut().zip(sum) {
                        out.iter_mut().zip(slow).for_each(|(o, s)| *o += s * weight);
                    }
                }
                out
            })
            .collect()
    }

    /// What the sum over some modes lacks near the source: images of sound that dies away, without what those modes have of it.
    fn near(
        &self,
        sums: &Sums<'_>,
        hard: [&[f64]; 2],
        kept: impl Fn(usize, usize) -> bool,
        count: usize,
    ) -> Vec<[Complex64; 4]> {
        let dies = DIES / self.volume_m3().cbrt();
        let none = Complex64::default();
        let ends = |axis: usize| Ends { length: self.size[axis], low: none, high: none };
        let [a, b, c] = sums.axes;
        let modes = |axis: usize, numbers: &[f64]| {
            sums.modes(axis, ends(axis), numbers.iter().map(|k| Complex64::new(k.max(1e-7), 0.0)).collect())
        };
        let pair = [modes(a, hard[0]), modes(b, hard[1])];
        let mut out = vec![[none; 4]; count];
        sums.add([&pair[0], &pair[1]], ends(c), Complex64::new(-dies * dies, 0.0), kept, &mut out);
        let reach = FARTHEST / dies;
        let along = |axis: usize| -> Vec<f64> {
            let (length, from) = (self.size[axis], sums.source[axis]);
            let rooms = (reach / length).ceil() as i32 + 1;
            (-rooms..=rooms).map(|n| f64::from(n) * length + if n % 2 == 0 { from } else { length - from }).collect()
        };
        let images = [along(0), along(1), along(2)];
        let [xs, ys, zs] = &sums.places.axes;
        let at = |index: usize| [xs[index % xs.len()], ys[index / xs.len() % ys.len()], zs[index / (xs.len() * ys.len())]];
        for (index, out) in out.iter_mut().enumerate() {
            out.iter_mut().for_each(|part| *part = -*part);
            let at = at(index);
            for x in images[0].iter().map(|x| at[0] - x).filter(|x| x.abs() < reach) {
                for y in images[1].iter().map(|y| at[1] - y).filter(|y| y.abs() < reach) {
                    for z in images[2].iter().map(|z| at[2] - z) {
                        let r = (x * x + y * y + z * z).sqrt().max(1e-3);
                        if r < reach {
                            let value = (-dies * r).exp() / r;
                            let slope = -value * (dies + 1.0 / r) / r;
                            for (part, add) in out.iter_mut().zip([value, slope * x, slope * y, slope * z]) {
                                part.re += add;
                            }
                        }
                    }
                }
            }
        }
        out
    }
}

/// Wave numbers of modes that are followed from one frequency to the next.
struct Followed<'a> {
    walls: &'a Shoebox,
    sums: &'a Sums<'a>,
    numbers: [Vec<Complex64>; 2],
    /// Whether none of them has been followed yet.
    from_rest: bool,
}

impl Followed<'_> {
    /// Follows all to a frequency, and adds the sum over the pairs that count.
    fn add(&mut self, hz: f64, counts: impl Fn(usize, usize) -> bool, out: &mut [[Complex64; 4]]) {
        let Sums { axes, places, .. } = self.sums;
        let wave = Complex64::new(0.0, TAU * hz / places.speed_m_s);
        let ends: [Ends; 3] = std::array::from_fn(|axis| {
            let of = |wall: usize| wave * quick_admittance(self.walls.materials[wall].absorbed(hz.max(1.0)));
            Ends { length: self.walls.size[axis], low: of(2 * axis), high: of(2 * axis + 1) }
        });
        let from_rest = std::mem::take(&mut self.from_rest);
        for (numbers, axis) in self.numbers.iter_mut().zip(axes) {
            let ends = ends[*axis];
            for (m, number) in numbers.iter_mut().enumerate() {
                let guess = if m == 0 && from_rest { ((ends.low + ends.high) / ends.length).sqrt() } else { *number };
                *number = ends.root(if guess.norm() < 1e-9 { Complex64::new(1e-6, 1e-6) } else { guess });
            }
        }
        let pair = [0, 1].map(|which| self.sums.modes(axes[which], ends[axes[which]], self.numbers[which].clone()));
        let square = Complex64::new((TAU * hz / places.speed_m_s).powi(2), 0.0);
        self.sums.add([&pair[0], &pair[1]], ends[axes[2]], square, counts, out);
    }
}

/// Weights of values at some places in the polynomial through them all.
fn lagrange(places: &[f64], at: f64) -> Vec<f64> {
    let weight = |own: &f64| {
        let others = places.iter().filter(|other| *other != own);
        others.map(|other| (at - other) / (own - other)).product()
    };
    places.iter().map(weight).collect()
}
