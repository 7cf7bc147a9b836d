//! The bass of a room, as waves have it.

use crate::Axis;
use glam::Vec3;

/// Signals of each place: pressure, and its slopes along x, y and z.
pub const BASS_SIGNALS: usize = 4;
/// How far from its layer the slope of a table with a single one is followed, metres.
const BEYOND_M: f32 = 0.6;

/// What a listener hears below a crossover: the pressure at places and its slopes, from which both ears of a head that turns
/// and what lies between places follow.
///
/// Made by a simulation or the baker, or read from a scene file; a part of its scene, immutable, which the audio thread reads.
///
/// The dry sound is split in two by a crossover of eighth order after Linkwitz and Riley, whose halves add up to an all-pass.
/// What a scene has otherwise hears the upper half alone, its noise as loud as [`noise_share`] says, and the lower is heard of
/// this, with its direct sound of `direct` over the distance; responses have the rest. Samples are of what the emitter's
/// impulse makes, at that time and on, at a low rate.
#[derive(Clone, Debug, PartialEq)]
pub struct BassField {
    /// Where the halves meet, Hz.
    pub crossover_hz: f64,
    /// Samples a second of the responses, which end below 48 % of it.
    pub rate_hz: f64,
    /// Places, metres, along x, y and z.
    pub places: [Axis; 3],
    /// Amplitude of the direct sound at 1 m.
    pub direct: f32,
    /// `[z][y][x][signal][sample]`: pressure, then slopes per metre, without the direct sound as it is in free space.
    pub samples: Vec<f32>,
    /// Whose ears hear it.
    pub ears: BassEars,
}

/// What hears the bass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BassEars {
    /// A head.
    #[default]
    Head,
    /// A pair of Ambisonic channels, as in [`crate::Scene::ambisonic_pair`].
    Pair(usize),
}

/// Power of the frequency over the crossover's by which waves fall.
const STEEP: i32 = 8;

/// Amplitude that waves have at a frequency beside images, which have the rest, 0 to 1; both in Hz. Waves and images are one
/// sound: their shares add up to 1. It falls so fast that an octave below the crossover all but waves is 21 dB weaker.
#[must_use]
pub fn wave_share(hz: f64, crossover_hz: f64) -> f64 {
    1.0 / (1.0 + (hz / crossover_hz).powi(STEEP))
}

/// Amplitude that noise has at a frequency beside waves of [`wave_share`], 0 to 1; both in Hz. Noise has no phase in common
/// with waves: the squares of their shares add up to 1.
#[must_use]
pub fn noise_share(hz: f64, crossover_hz: f64) -> f64 {
    (1.0 - wave_share(hz, crossover_hz).powi(2)).max(0.0).sqrt()
}

/// Shares of one place in the pressure at a position and in its slopes along x, y and z, each of the place's pressure and of
/// its slopes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Shares {
    pub(crate) place: usize,
    pub(crate) of: [[f32; BASS_SIGNALS]; BASS_SIGNALS],
    /// Its share in what is interpolated straight.
    pub(crate) straight: f32,
}

/// One of the two nodes about a position along an axis: its straight weight, its weights in Hermite's polynomial for value and
/// slope, and the derivatives of all three.
#[derive(Clone, Copy, Default)]
struct Corner {
    node: usize,
    line: [f32; 2],
    value: [f32; 2],
    slope: [f32; 2],
}

impl Corner {
    /// Both nodes of the cell above node `low`, `step` metres long, at the share `t` of it.
    fn pair(low: usize, t: f32, step: f32) -> [Self; 2] {
        let (square, cube) = (t * t, t * t * t);
        let rise = [3.0 * square - 2.0 * cube, (6.0 * t - 6.0 * square) / step];
        let below = Self {
            node: low,
            line: [1.0 - t, -1.0 / step],
            value: [1.0 - rise[0], -rise[1]],
            slope: [(cube - 2.0 * square + t) * step, 3.0 * square - 4.0 * t + 1.0],
        };
        let above =
            Self { node: low + 1, line: [t, 1.0 / step], value: rise, slope: [(cube - square) * step, 3.0 * square - 2.0 * t] };
        [below, above]
    }
}

impl BassField {
    /// Number of places.
    #[must_use]
    pub fn place_count(&self) -> usize {
        self.places.iter().map(Axis::count).product()
    }

    /// Positions of a table's places along x, y and z, metres, in the order `[z][y][x]`.
    pub fn places_of(axes: &[Axis; 3]) -> impl Iterator<Item = Vec3> {
        let [x, y, z] = axes.each_ref().map(Axis::nodes);
        z.iter().flat_map(move |z| y.iter().flat_map(move |y| x.iter().map(move |x| Vec3::new(*x, *y, *z))))
    }

    /// Samples of each response.
    #[must_use]
    pub fn len(&self) -> usize {
        self.samples.len() / (BASS_SIGNALS * self.place_count())
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The places about a position with their shares: along each axis Hermite's cubic, straight along the others, together as
    /// a sum of projections (W. J. Gordon 1971), which is exact on the lines of the table.
    pub(crate) fn shares(&self, position: Vec3) -> impl Iterator<Item = Shares> {
        let mut corners = [[Corner::default(); 2]; 3];
        let mut counts = [1; 3];
        let mut beyond = [0.0; 3];
        for axis in 0..3 {
            let (near, count) = self.places[axis].linear(position[axis]);
            let nodes = self.places[axis].nodes();
            if nodes.len() < 2 {
                beyond[axis] = (position[axis] - nodes[0]).clamp(-BEYOND_M, BEYOND_M);
                corners[axis][0] = Corner { node: 0, line: [1.0, 0.0], ..Corner::default() };
                continue;
            }
            // At a node the cell above it is looked at, or the last one.
            let (low, t) = if count == 2 { (near[0].0, near[1].1) } else { (near[0].0, 0.0) };
            let (low, t) = if low + 1 < nodes.len() { (low, t) } else { (low - 1, 1.0) };
            counts[axis] = 2;
            corners[axis] = Corner::pair(low, t, nodes[low + 1] - nodes[low]);
        }
        let wide: [bool; 3] = std::array::from_fn(|axis| self.places[axis].count() > 1);
        let sums = wide.iter().filter(|wide| **wide).count() as f32 - 1.0;
        let [nx, ny] = [self.places[0].count(), self.places[1].count()];
        let all = (0..counts[2]).flat_map(move |k| (0..counts[1]).flat_map(move |j| (0..counts[0]).map(move |i| [i, j, k])));
        all.map(move |at| {
            let corner = |axis: usize| corners[axis][at[axis]];
            let [i, j, k] = [0, 1, 2].map(|axis| corner(axis).node);
            // What is derived along an axis, or along none.
            let line = |axis: usize, derived: usize| corner(axis).line[usize::from(axis == derived)];
            let others = |axis: usize, derived: usize| -> f32 {
                (0..3).filter(|other| *other != axis).map(|other| line(other, derived)).product()
            };
            let of = |derived: usize| -> [f32; BASS_SIGNALS] {
                if derived < 3 && !wide[derived] {
                    // Along a single layer the slope is all that is known.
                    let mut shares = [0.0; BASS_SIGNALS];
                    shares[1 + derived] = (0..3).map(|axis| line(axis, 3)).product();
                    return shares;
                }
                let all: f32 = (0..3).map(|axis| line(axis, derived)).product();
                let mut shares = [-sums * all, 0.0, 0.0, 0.0];
                for axis in 0..3 {
                    if wide[axis] {
                        let own = usize::from(axis == derived);
                        shares[0] += corner(axis).value[own] * others(axis, derived);
                        shares[1 + axis] += corner(axis).slope[own] * others(axis, derived);
                    } else {
                        shares[1 + axis] += beyond[axis] * all;
                    }
                }
                shares
            };
            Shares {
                place: (k * ny + j) * nx + i,
                of: [of(3), of(0), of(1), of(2)],
                straight: (0..3).map(|axis| line(axis, 3)).product(),
            }
        })
    }

    /// Bytes in memory.
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.samples)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(places: [Axis; 3], of: impl Fn(Vec3) -> [f32; 4]) -> BassField {
        let [x, y, z] = &places;
        let all = z.nodes().iter().flat_map(|z| y.nodes().iter().flat_map(move |y| x.nodes().iter().map(|x| [*x, *y, *z])));
        let samples = all.flat_map(|at| of(at.into())).collect();
        BassField { crossover_hz: 100.0, rate_hz: 500.0, places, direct: 1.0, samples, ears: BassEars::Head }
    }

    fn at(field: &BassField, position: Vec3) -> [f32; 4] {
        let mut out = [0.0; 4];
        for shares in field.shares(position) {
            let signals = &field.samples[4 * shares.place..][..4];
            for (out, shares) in out.iter_mut().zip(shares.of) {
                *out += signals.iter().zip(shares).map(|(a, b)| a * b).sum::<f32>();
            }
        }
        out
    }

    #[test]
    fn waves_between_places_are_those_of_the_field() {
        // A plane wave at the crossover of a table with so many places.
        let k = Vec3::new(0.8, 0.5, 0.3).normalize() * 3.3;
        let wave = move |at: Vec3| {
            let phase = k.dot(at) + 0.3;
            [phase.cos(), -k.x * phase.sin(), -k.y * phase.sin(), -k.z * phase.sin()]
        };
        let axis = |start: f32, count| Axis::uniform(start, 0.55, count);
        // A straight line is off by (kh)^2 / 8 at most and Hermite's cubic by (kh)^4 / 384; of the sum of projections two
        // straight ones remain multiplied.
        let [x, y, z] = (0.55 * k).to_array().map(|kh| kh * kh / 8.0);
        let most = x * y + x * z + y * z + (x * x + y * y + z * z) / 6.0;
        let solid = field([axis(0.2, 5), axis(-0.4, 4), axis(1.0, 3)], wave);
        let layer = field([axis(0.2, 5), axis(-0.4, 4), Axis::single(1.4)], wave);
        for i in 0..40 {
            let t = |n: usize| (i * n % 40) as f32 / 40.0;
            let position = Vec3::new(0.2 + 2.2 * t(7), -0.4 + 1.65 * t(11), 1.0 + 1.1 * t(13));
            let (found, wanted) = (at(&solid, position), wave(position));
            assert!((found[0] - wanted[0]).abs() < most, "{position}: {found:?} {wanted:?}");
            for axis in 1..4 {
                assert!((found[axis] - wanted[axis]).abs() < 0.08 * k.length(), "{position}: {found:?} {wanted:?}");
            }
            let near = Vec3::new(position.x, position.y, 1.4 + 0.1 * t(3));
            assert!((at(&layer, near)[0] - wave(near)[0]).abs() < 0.04);
        }
        // At a place what was known there, and beyond the table what its end has.
        assert!(
            at(&solid, Vec3::new(0.75, 0.15, 1.55))
                .iter()
                .zip(wave(Vec3::new(0.75, 0.15, 1.55)))
                .all(|(a, b)| (a - b).abs() < 1e-4)
        );
        let end = Vec3::new(2.4, 1.25, 2.1);
        assert!((at(&solid, end + Vec3::splat(3.0))[0] - wave(end)[0]).abs() < 1e-4);
    }
}
