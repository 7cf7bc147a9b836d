//! From Ambisonic channels to both ears by filters: least squares where the order resolves the head, least squares of
//! magnitudes above (Schörkhuber, Zaunschirm and Höldrich, "Binaural rendering of Ambisonic signals via magnitude least
//! squares", DAGA 2018), and in a diffuse field the head's own levels and coherence (Zaunschirm, Schörkhuber and Höldrich, J.
//! Acoust. Soc. Am. 143 (2018)).

use super::Head;
use super::harmonics::{channels, harmonics};
use super::near::lattice;
use crate::number::single;
use glam::Vec3;
use promenade_fourier::num_complex::{Complex32, Complex64};

/// Directions that the filters are fitted to: many more than channels.
const DIRECTIONS: usize = 600;
/// Frequency up to which one order resolves a head, Hz: where the head's radius is a wavelength over 2 pi.
pub const RESOLVED_HZ: f64 = 620.0;

/// The sound that keeps the head's own levels and coherence: above what the order resolves, a head's pattern is smoothed, and
/// not all directions can.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Incidence {
    /// From everywhere alike.
    Diffuse,
    /// Mostly from about the height of the ears, as early reflections of rooms come: weighted by the 64th power of the
    /// elevation's cosine.
    Horizontal,
}

impl Incidence {
    fn weight(self, direction: Vec3) -> f64 {
        match self {
            Self::Diffuse => 1.0,
            Self::Horizontal => (1.0 - f64::from(direction.z).powi(2)).powi(32),
        }
    }
}

impl Head {
    /// Filters of each channel of an order for each ear, `[channel][ear]`, channels in the order of AmbiX (ACN, N3D), as
    /// [`Ears::spectra`] has its spectra: about the moment at which the sound is at the head's centre.
    ///
    /// [`Ears::spectra`]: super::Ears::spectra
    ///
    /// # Real-time
    /// Not real-time safe: allocates, and takes a good part of a second.
    #[must_use]
    pub fn ambisonic(&self, order: usize, incidence: Incidence, n_fft: usize, sample_rate_hz: f64) -> Vec<[Vec<Complex32>; 2]> {
        let bin_hz = sample_rate_hz / n_fft.max(1) as f64;
        ambisonic_filters(order, incidence, bin_hz, |direction| self.ears(direction).spectra(n_fft, sample_rate_hz))
    }
}

/// Filters of each channel of an order for each ear, `[channel][ear][bin]`, of a head that hears a direction of unit length
/// (forward, left, up) as spectra of both ears, with their delays. Bins lie `bin_hz` apart from 0 on.
#[must_use]
pub fn ambisonic_filters(
    order: usize,
    incidence: Incidence,
    bin_hz: f64,
    heard: impl Fn(Vec3) -> [Vec<Complex32>; 2],
) -> Vec<[Vec<Complex32>; 2]> {
    let directions: Vec<Vec3> = (0..DIRECTIONS).map(|i| lattice(i, DIRECTIONS)).collect();
    let heard: Vec<[Vec<Complex32>; 2]> = directions.iter().map(|d| heard(*d)).collect();
    let weights: Vec<f64> = directions.iter().map(|d| incidence.weight(*d)).collect();
    let basis: Vec<Vec<f32>> = directions.iter().map(|d| harmonics(order, *d)).collect();
    let bins = heard.iter().flatten().map(Vec::len).min().unwrap_or(0);
    let count = channels(order);
    let share = single(1.0 / DIRECTIONS as f64);
    let mut filters = vec![[0, 1].map(|_| vec![Complex32::default(); bins]); count];
    let mut before = [vec![Complex32::default(); count], vec![Complex32::default(); count]];
    for bin in 0..bins {
        let magnitudes_only = bin as f64 * bin_hz > order as f64 * RESOLVED_HZ;
        let mut fitted = [0, 1].map(|ear| {
            let mut sums = vec![Complex32::default(); count];
            for (heard, basis) in heard.iter().zip(&basis) {
                let mut target = heard[ear][bin];
                if magnitudes_only {
                    // The phase follows from that of the bin below.
                    let below: Complex32 = before[ear].iter().zip(basis).map(|(f, y)| f * y).sum();
                    target = Complex32::from_polar(target.norm(), below.arg());
                }
                sums.iter_mut().zip(basis).for_each(|(s, y)| *s += target * (y * share));
            }
            sums
        });
        before.clone_from(&fitted);
        let wanted = covariance(heard.iter().map(|h| [h[0][bin], h[1][bin]]), &weights);
        let found = basis.iter().map(|basis| fitted.each_ref().map(|ear| ear.iter().zip(basis).map(|(f, y)| f * y).sum()));
        let found = covariance(found, &weights);
        let [left, right] = &mut fitted;
        mix(left, right, found, wanted);
        for (channel, filter) in filters.iter_mut().enumerate() {
            (filter[0][bin], filter[1][bin]) = (left[channel], right[channel]);
        }
    }
    filters
}

/// A matrix of two ears, `[row][column]`.
type Pair = [[Complex64; 2]; 2];

/// Sum over directions.
fn covariance(pairs: impl Iterator<Item = [Complex32; 2]>, weights: &[f64]) -> Pair {
    let wide = |c: Complex32| Complex64::new(f64::from(c.re), f64::from(c.im));
    pairs.zip(weights).fold(Pair::default(), |mut sum, (ears, weight)| {
        let ears = ears.map(wide);
        for (row, a) in sum.iter_mut().zip(ears) {
            row.iter_mut().zip(ears).for_each(|(sum, b)| *sum += a * b.conj() * *weight);
        }
        sum
    })
}

/// Mixes both ears' filters so that a field has the wanted covariance instead of the found one, and changes them as little as
/// that takes: by the positive matrix `F^-1/2 (F^1/2 W F^1/2)^1/2 F^-1/2` of the found and the wanted covariance (Vilkamo,
/// Bäckström and Kuntz 2013).
fn mix(left: &mut [Complex32], right: &mut [Complex32], found: Pair, wanted: Pair) {
    // Ears that hear nearly the same at low frequencies make them singular otherwise.
    let (found, wanted) = (floored(found), floored(wanted));
    let half = root(found);
    let Some(back) = inverse(half) else { return };
    let mixing = product(product(back, root(product(product(half, wanted), half))), back);
    let narrow = |c: Complex64| Complex32::new(single(c.re), single(c.im));
    let [[ll, lr], [rl, rr]] = mixing.map(|row| row.map(narrow));
    for (l, r) in left.iter_mut().zip(right) {
        (*l, *r) = (ll * *l + lr * *r, rl * *l + rr * *r);
    }
}

fn floored(mut m: Pair) -> Pair {
    let floor = 1e-4 * (m[0][0].re + m[1][1].re) + 1e-20;
    m[0][0] += floor;
    m[1][1] += floor;
    m
}

fn product(a: Pair, b: Pair) -> Pair {
    a.map(|row| [0, 1].map(|column| row[0] * b[0][column] + row[1] * b[1][column]))
}

fn determinant(m: Pair) -> Complex64 {
    m[0][0] * m[1][1] - m[0][1] * m[1][0]
}

/// The positive root of a positive Hermitian matrix: `(M + s) / t` with `s` the root of the determinant and `t` that of
/// `tr M + 2 s` (Levinger 1980).
fn root(mut m: Pair) -> Pair {
    let s = determinant(m).re.max(0.0).sqrt();
    let t = (m[0][0].re + m[1][1].re + 2.0 * s).max(1e-300).sqrt();
    m[0][0] += s;
    m[1][1] += s;
    m.map(|row| row.map(|v| v / t))
}

fn inverse(m: Pair) -> Option<Pair> {
    let [[a, b], [c, d]] = m;
    let determinant = determinant(m);
    (determinant.norm() > 1e-300).then(|| [[d, -b], [-c, a]].map(|row| row.map(|v| v / determinant)))
}
