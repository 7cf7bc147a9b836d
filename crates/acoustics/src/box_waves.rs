//! The bass of a box from its modes.
//!
//! Along two axes the field is a sum over modes between walls of some admittance, along the longest its closed form (P. M.
//! Morse and K. U. Ingard, *Theoretical Acoustics*, section 9.5). Near the source such a sum converges slowly, so that the same
//! sum for hard walls and sound that dies away within the room is taken off, and added as what it is: a few images.

use crate::admittance::quick_admittance;
use crate::error::AcousticsError;
use crate::low_field::{FADE, LowField, LowResponse, RATE, response, share, transform_len};
use crate::shoebox::Shoebox;
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

/// Places on a grid, and how they are heard.
#[derive(Clone, Debug, PartialEq)]
pub struct LowPlaces {
    /// Coordinates along x, y and z, metres.
    pub axes: [Vec<f64>; 3],
    /// Up to this frequency responses are whole, Hz.
    pub top_hz: f64,
    /// Length of the responses, seconds.
    pub length_s: f64,
    /// Metres per second.
    pub speed_m_s: f64,
}

/// A sum and its derivative along an axis.
type Sloped = [Complex64; 2];

/// Modes along one axis at one frequency: each a wave number, and the values that it has at the places with the slope, over its
/// norm and times its value at the source.
struct Modes {
    numbers: Vec<Complex64>,
    at: Vec<Vec<Sloped>>,
}

/// The walls of an axis at a wave number: `j k` times their admittances.
#[derive(Clone, Copy)]
struct Ends {
    length: f64,
    low: Complex64,
    high: Complex64,
}

impl Ends {
    /// A root nearby of what a mode's wave number fulfils (Newton).
    fn root(&self, mut number: Complex64) -> Complex64 {
        let (sum, product) = (self.low + self.high, self.low * self.high);
        for _ in 0..12 {
            let (sin, cos) = sin_cos(number * self.length);
            let value = (number * number - product) * sin - number * sum * cos;
            let slope = 2.0 * number * sin + (number * number - product) * cos * self.length - sum * cos
                + number * sum * sin * self.length;
            // 0 is a root of any walls, and of no mode.
            let step = value / (slope - value / number);
            if !step.is_finite() {
                break;
            }
            number -= step;
            if step.norm_sqr() < 1e-22 * (1.0 + number.norm_sqr()) {
                break;
            }
        }
        number
    }

    /// A mode and its slope.
    fn mode(&self, number: Complex64, at: f64) -> Sloped {
        let (sin, cos) = sin_cos(number * at);
        let share = self.low / number;
        [cos + share * sin, (share * cos - sin) * number]
    }

    /// Integral of a mode's square.
    fn norm(&self, number: Complex64) -> Complex64 {
        let share = self.low / number;
        let (sin, cos) = sin_cos(number * self.length);
        let twice = 2.0 * sin * cos;
        let square = share * share;
        (1.0 + square) * (0.5 * self.length) + (1.0 - square) * twice / (4.0 * number) + share * sin * sin / number
    }

    /// What a plane source at `from` makes along the axis where waves have this number: `g'' + number^2 g = -delta`. Returns
    /// what the waves from either end are times, below the source and above.
    fn strengths(&self, number: Complex64, from: f64) -> [Complex64; 2] {
        let end = self.flipped().mode(number, self.length);
        // The Wronskian at the lower wall, where the mode is 1 and its slope that of the wall.
        let wronskian = -end[1] - self.low * end[0];
        [-self.upper(number, from)[0] / wronskian, -self.mode(number, from)[0] / wronskian]
    }

    fn flipped(&self) -> Self {
        Self { length: self.length, low: self.high, high: self.low }
    }

    /// The wave that fulfils the upper wall, and its slope.
    fn upper(&self, number: Complex64, at: f64) -> Sloped {
        let [value, slope] = self.flipped().mode(number, self.length - at);
        [value, -slope]
    }
}

/// A pair of modes, and the wave along the closed axis.
struct Wave {
    /// Numbers of the mode along the second and the first axis.
    m: usize,
    l: usize,
    number: Complex64,
    /// What the wave from either end is times.
    strengths: [Complex64; 2],
    /// `[share of the sine]` in the wave from either wall, over its cosine's.
    shares: [Complex64; 2],
    /// `e^(i number step)` and its inverse, where places lie evenly.
    step: Option<[Complex64; 2]>,
    /// `e^(i number distance)` from the wall, and its inverse.
    turn: [Complex64; 2],
}

impl Wave {
    /// The wave from the wall where it is as far from it as `turn` says, and its slope, away from the wall.
    fn at(&self, wall: usize) -> Sloped {
        let [turn, back] = self.turn;
        let (cos, sin) = (0.5 * (turn + back), (turn - back) * Complex64::new(0.0, -0.5));
        [cos + self.shares[wall] * sin, (self.shares[wall] * cos - sin) * self.number]
    }
}

/// Sine and cosine of a complex number.
fn sin_cos(z: Complex64) -> (Complex64, Complex64) {
    let (sin, cos) = z.re.sin_cos();
    let grown = z.im.exp();
    let shrunk = grown.recip();
    // Of small numbers the difference has no digits left.
    let (cosh, sinh) = (0.5 * (grown + shrunk), if z.im.abs() < 0.1 { z.im.sinh() } else { 0.5 * (grown - shrunk) });
    (Complex64::new(sin * cosh, cos * sinh), Complex64::new(cos * cosh, -sin * sinh))
}

/// Distance of places that lie evenly, but for rounding, metres.
fn even_step(places: &[f64]) -> Option<f64> {
    let (first, last) = (places.first()?, places.last()?);
    let step = (last - first) / (places.len() - 1).max(1) as f64;
    places.iter().zip(0..).all(|(at, n)| (at - first - f64::from(n) * step).abs() < 1e-5).then_some(step)
}

/// The sum over pairs of modes that some fulfil, at all places: `[place][pressure, x, y, z]`.
struct Sums<'a> {
    /// The two axes of modes and the closed one.
    axes: [usize; 3],
    places: &'a LowPlaces,
    source: [f64; 3],
}

impl Sums<'_> {
    fn modes(&self, axis: usize, ends: Ends, numbers: Vec<Complex64>) -> Modes {
        let at = |number: &Complex64| {
            let share = ends.mode(*number, self.source[axis])[0] / ends.norm(*number);
            self.places.axes[axis].iter().map(|at| ends.mode(*number, *at).map(|value| value * share)).collect()
        };
        Modes { at: numbers.iter().map(at).collect(), numbers }
    }

    /// `square` is the wave number's, `counts` says which pairs count.
    fn add(
        &self,
        pair: [&Modes; 2],
        ends: Ends,
        square: Complex64,
        counts: impl Fn(usize, usize) -> bool,
        out: &mut [[Complex64; 4]],
    ) {
        let [a, b, c] = self.axes;
        let coordinates = &self.places.axes;
        let (na, nb) = (coordinates[a].len(), coordinates[b].len());
        let strides = {
            let mut strides = [0; 3];
            let mut stride = 1;
            for axis in 0..3 {
                strides[axis] = stride;
                stride *= coordinates[axis].len();
            }
            strides
        };
        let from = self.source[c];
        let step_m = even_step(&coordinates[c]);
        let mut waves = Vec::new();
        for (m, second) in pair[1].numbers.iter().enumerate() {
            for (l, first) in pair[0].numbers.iter().enumerate().filter(|(l, _)| counts(*l, m)) {
                let number = (square - first * first - second * second).sqrt();
                let strengths = ends.strengths(number, from).map(|strength| strength * (4.0 * PI));
                let shares = [ends.low / number, ends.high / number];
                let step = step_m.map(|step_m| (Complex64::i() * number * step_m).exp());
                waves.push(Wave {
                    m,
                    l,
                    number,
                    strengths,
                    step: step.map(|step| [step, step.inv()]),
                    shares,
                    turn: Default::default(),
                });
            }
        }
        let mut partial = vec![[Complex64::default(); 3]; pair[1].numbers.len() * na];
        for (k, at) in coordinates[c].iter().enumerate() {
            // Value, and slopes along the first and the closed axis, by mode of the second axis and place along the first.
            partial.fill([Complex64::default(); 3]);
            // Below the source waves are followed from the lower wall, above it towards the upper.
            let above = *at >= from;
            let first = k == 0 || (above && coordinates[c][k - 1] < from);
            for wave in &mut waves {
                let from_wall = if above { ends.length - at } else { *at };
                let [turn, back] = wave.turn;
                wave.turn = match wave.step {
                    Some([step, unstep]) if !first && above => [turn * unstep, back * step],
                    Some([step, unstep]) if !first => [turn * step, back * unstep],
                    _ => {
                        let turn = (Complex64::i() * wave.number * from_wall).exp();
                        [turn, turn.inv()]
                    }
                };
                let [value, slope] = wave.at(usize::from(above));
                let strength = wave.strengths[usize::from(above)];
                let (value, slope) = (value * strength, if above { -slope } else { slope } * strength);
                for (sum, mode) in partial[wave.m * na..][..na].iter_mut().zip(&pair[0].at[wave.l]) {
                    sum[0] += mode[0] * value;
                    sum[1] += mode[1] * value;
                    sum[2] += mode[0] * slope;
                }
            }
            for i in 0..na {
                for j in 0..nb {
                    let place = &mut out[i * strides[a] + j * strides[b] + k * strides[c]];
                    for (m, modes) in pair[1].at.iter().enumerate() {
                        let [value, along_a, along_c] = partial[m * na + i];
                        let [mode, slope] = modes[j];
                        place[0] += value * mode;
                        place[1 + a] += along_a * mode;
                        place[1 + b] += value * slope;
                        place[1 + c] += along_c * mode;
                    }
                }
            }
        }
    }
}

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
        let sums = Sums { axes, places, source };
        let count: usize = places.axes.iter().map(Vec::len).product();
        let n = transform_len(length);
        let highest = TAU * FADE * places.top_hz / places.speed_m_s;
        let most = MODES * highest + 2.0 * PI / self.volume_m3().cbrt();
        let hard = |axis: usize| -> Vec<f64> {
            (0..=(most * self.size[axis] / PI) as usize).map(|m| m as f64 * PI / self.size[axis]).collect()
        };
        let hard = [hard(axes[0]), hard(axes[1])];
        let number = |l: usize, m: usize| hard[0][l].hypot(hard[1][m]);
        let kept = |l: usize, m: usize| number(l, m) <= most;
        let slow = |l: usize, m: usize| kept(l, m) && number(l, m) > SLOW * highest;
        let fast = |l: usize, m: usize| number(l, m) <= SLOW * highest;
        let walls = |hz: f64| -> [Ends; 3] {
            let wave = Complex64::new(0.0, TAU * hz / places.speed_m_s);
            std::array::from_fn(|axis| {
                let of = |wall: usize| wave * quick_admittance(self.materials[wall].absorbed(hz.max(1.0)));
                Ends { length: self.size[axis], low: of(2 * axis), high: of(2 * axis + 1) }
            })
        };
        // Wave numbers are followed from those of hard walls.
        let start = |which: usize| -> Vec<Complex64> { hard[which].iter().map(|k| Complex64::new(k.max(1e-9), 0.0)).collect() };
        let follow = |numbers: &mut [Vec<Complex64>; 2], ends: &[Ends; 3], from_rest: bool| {
            for (which, numbers) in numbers.iter_mut().enumerate() {
                let ends = ends[axes[which]];
                for (m, number) in numbers.iter_mut().enumerate() {
                    let guess = if m == 0 && from_rest { ((ends.low + ends.high) / ends.length).sqrt() } else { *number };
                    *number = ends.root(if guess.norm() < 1e-9 { Complex64::new(1e-6, 1e-6) } else { guess });
                }
            }
        };
        let slow_at: Vec<f64> = (0..FEW)
            .map(|n| {
                let turn = PI * (n as f64 + 0.5) / FEW as f64;
                0.5 * FADE * places.top_hz * (1.0 - turn.cos())
            })
            .collect();
        let all = || [start(0), start(1)];
        let mut numbers = all();
        let mut slow_sums = Vec::with_capacity(FEW);
        for (n, hz) in slow_at.iter().enumerate() {
            let ends = walls(*hz);
            follow(&mut numbers, &ends, n == 0);
            let pair = [0, 1].map(|which| sums.modes(axes[which], ends[axes[which]], numbers[which].clone()));
            let mut out = vec![[Complex64::default(); 4]; count];
            let square = Complex64::new((TAU * hz / places.speed_m_s).powi(2), 0.0);
            sums.add([&pair[0], &pair[1]], ends[closed], square, slow, &mut out);
            slow_sums.push(out);
        }
        let near = self.near(&sums, [&hard[0], &hard[1]], kept, count);
        let mut numbers = all();
        for (which, numbers) in numbers.iter_mut().enumerate() {
            numbers.truncate((SLOW * highest * self.size[axes[which]] / PI) as usize + 1);
        }
        let mut first = true;
        (0..=n / 2)
            .map(|k| {
                let hz = k as f64 * rate_hz / n as f64;
                if share(hz, places.top_hz) == 0.0 {
                    return vec![[Complex64::default(); 4]; if hz > places.top_hz { 0 } else { count }];
                }
                let ends = walls(hz);
                follow(&mut numbers, &ends, std::mem::take(&mut first));
                let pair = [0, 1].map(|which| sums.modes(axes[which], ends[axes[which]], numbers[which].clone()));
                let mut out = near.clone();
                let square = Complex64::new((TAU * hz / places.speed_m_s).powi(2), 0.0);
                sums.add([&pair[0], &pair[1]], ends[closed], square, fast, &mut out);
                let weights = lagrange(&slow_at, hz);
                for (sum, weight) in slow_sums.iter().zip(weights) {
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

/// Weights of values at some places in the polynomial through them all.
fn lagrange(places: &[f64], at: f64) -> Vec<f64> {
    let weight = |own: &f64| {
        let others = places.iter().filter(|other| *other != own);
        others.map(|other| (at - other) / (own - other)).product()
    };
    places.iter().map(weight).collect()
}
