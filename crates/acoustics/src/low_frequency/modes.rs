//! Sums over modes of a box along two axes, in closed form along the third.

use promenade_fourier::num_complex::Complex64;
use std::f64::consts::PI;

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
pub(super) struct Modes {
    pub(super) numbers: Vec<Complex64>,
    at: Vec<Vec<Sloped>>,
}

/// The walls of an axis at a wave number: `j k` times their admittances.
#[derive(Clone, Copy)]
pub(super) struct Ends {
    pub(super) length: f64,
    pub(super) low: Complex64,
    pub(super) high: Complex64,
}

impl Ends {
    /// A root nearby of what a mode's wave number fulfils (Newton).
    pub(super) fn root(&self, mut number: Complex64) -> Complex64 {
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
    /// Follows the wave to its next place, away from the lower wall or, `above` the source, towards the upper one.
    fn advance(&mut self, from_wall: f64, above: bool, first: bool) {
        let [turn, back] = self.turn;
        self.turn = match self.step {
            Some([step, unstep]) if !first && above => [turn * unstep, back * step],
            Some([step, unstep]) if !first => [turn * step, back * unstep],
            _ => {
                let turn = (Complex64::i() * self.number * from_wall).exp();
                [turn, turn.inv()]
            }
        };
    }

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
pub(super) struct Sums<'a> {
    /// The two axes of modes and the closed one.
    pub(super) axes: [usize; 3],
    pub(super) places: &'a LowPlaces,
    pub(super) source: [f64; 3],
}

impl Sums<'_> {
    pub(super) fn modes(&self, axis: usize, ends: Ends, numbers: Vec<Complex64>) -> Modes {
        let at = |number: &Complex64| {
            let share = ends.mode(*number, self.source[axis])[0] / ends.norm(*number);
            self.places.axes[axis].iter().map(|at| ends.mode(*number, *at).map(|value| value * share)).collect()
        };
        Modes { at: numbers.iter().map(at).collect(), numbers }
    }

    /// The waves along the closed axis of all pairs that count.
    fn waves(&self, pair: [&Modes; 2], ends: Ends, square: Complex64, counts: impl Fn(usize, usize) -> bool) -> Vec<Wave> {
        let closed = self.axes[2];
        let (from, step_m) = (self.source[closed], even_step(&self.places.axes[closed]));
        let mut waves = Vec::new();
        for (m, second) in pair[1].numbers.iter().enumerate() {
            for (l, first) in pair[0].numbers.iter().enumerate().filter(|(l, _)| counts(*l, m)) {
                let number = (square - first * first - second * second).sqrt();
                let strengths = ends.strengths(number, from).map(|strength| strength * (4.0 * PI));
                let shares = [ends.low / number, ends.high / number];
                let step = step_m.map(|step_m| (Complex64::i() * number * step_m).exp()).map(|step| [step, step.inv()]);
                waves.push(Wave { m, l, number, strengths, step, shares, turn: Default::default() });
            }
        }
        waves
    }

    /// Adds the sum at all places. `square` is the wave number's, `counts` says which pairs count.
    pub(super) fn add(
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
        let strides = [1, coordinates[0].len(), coordinates[0].len() * coordinates[1].len()];
        let from = self.source[c];
        let mut waves = self.waves(pair, ends, square, counts);
        let mut partial = vec![[Complex64::default(); 3]; pair[1].numbers.len() * na];
        for (k, at) in coordinates[c].iter().enumerate() {
            // Value, and slopes along the first and the closed axis, by mode of the second axis and place along the first.
            partial.fill([Complex64::default(); 3]);
            // Below the source waves are followed from the lower wall, above it towards the upper.
            let above = *at >= from;
            let first = k == 0 || (above && coordinates[c][k - 1] < from);
            for wave in &mut waves {
                let from_wall = if above { ends.length - at } else { *at };
                wave.advance(from_wall, above, first);
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
