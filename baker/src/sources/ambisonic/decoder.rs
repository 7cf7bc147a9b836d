//! From Ambisonic channels to both ears by filters: least squares where the order resolves the head, least squares of magnitudes above
//! (Schörkhuber, Zaunschirm and Höldrich, "Binaural rendering of Ambisonic signals via magnitude least squares", DAGA 2018), and in a
//! diffuse field the head's own levels and coherence (Zaunschirm, Schörkhuber and Höldrich, J. Acoust. Soc. Am. 143 (2018)).

use super::ears::Frame;
use super::harmonics::{channels, harmonics};
use crate::sources::simulation::Hrtf;
use nalgebra::{Complex, Matrix2};
use promenade_core::glam::Vec3;
use promenade_core::head::lattice;
use promenade_fourier::num_complex::Complex32;

/// Directions that the filters are fitted to: many more than channels.
const DIRECTIONS: usize = 600;
/// Frequency up to which one order resolves a head, hertz: where the head's radius is a wavelength over 2 pi.
pub(super) const RESOLVED_HZ: f64 = 620.0;

/// Filters of each channel for each ear, `[channel][ear]`, as impulse responses of a [`Frame`]; `heard` gives both ears' spectra of a
/// direction.
pub(super) fn filters(
    order: usize,
    hrtf: &Hrtf,
    frame: Frame,
    heard: impl Fn(Vec3) -> [Vec<Complex32>; 2],
) -> Vec<[Vec<f32>; 2]> {
    let directions: Vec<Vec3> = (0..DIRECTIONS).map(|i| lattice(i, DIRECTIONS)).collect();
    let heard: Vec<[Vec<Complex32>; 2]> = directions.iter().map(|d| heard(*d)).collect();
    let basis: Vec<Vec<f32>> = directions.iter().map(|d| harmonics(order, *d)).collect();
    let (count, bins) = (channels(order), hrtf.bins.count());
    let mut filters = vec![[0, 1].map(|_| vec![Complex32::default(); bins]); count];
    let mut before = [vec![Complex32::default(); count], vec![Complex32::default(); count]];
    for bin in 0..bins {
        let magnitudes_only = hrtf.bins.hz(bin) > order as f64 * RESOLVED_HZ;
        let mut fitted = [0, 1].map(|ear| {
            let mut sums = vec![Complex32::default(); count];
            for (heard, basis) in heard.iter().zip(&basis) {
                let mut target = heard[ear][bin];
                if magnitudes_only {
                    // The phase follows from that of the bin below.
                    let below: Complex32 = before[ear].iter().zip(basis).map(|(f, y)| f * y).sum();
                    target = Complex32::from_polar(target.norm(), below.arg());
                }
                sums.iter_mut().zip(basis).for_each(|(s, y)| *s += target * (y / DIRECTIONS as f32));
            }
            sums
        });
        before.clone_from(&fitted);
        let wanted = covariance(heard.iter().map(|h| [h[0][bin], h[1][bin]]), DIRECTIONS);
        let [left, right] = &mut fitted;
        mix(left, right, wanted);
        for (channel, filter) in filters.iter_mut().enumerate() {
            (filter[0][bin], filter[1][bin]) = (left[channel], right[channel]);
        }
    }
    filters.into_iter().map(|ears| ears.map(|spectrum| frame.impulse(spectrum))).collect()
}

type Pair = Matrix2<Complex<f64>>;

fn covariance(pairs: impl Iterator<Item = [Complex32; 2]>, over: usize) -> Pair {
    let wide = |c: Complex32| Complex::new(f64::from(c.re), f64::from(c.im)).unscale((over as f64).sqrt());
    pairs.fold(Pair::zeros(), |sum, [l, r]| {
        let (l, r) = (wide(l), wide(r));
        sum + Pair::new(l * l.conj(), l * r.conj(), r * l.conj(), r * r.conj())
    })
}

/// Mixes both ears' filters so that a diffuse field has the wanted covariance, and changes them as little as that takes: with the
/// factors `C C^H` of both covariances, `C_wanted V U^H C_found^-1`, where `U S V^H` is `C_found^H C_wanted`.
fn mix(left: &mut [Complex32], right: &mut [Complex32], wanted: Pair) {
    let found = covariance(left.iter().zip(right.iter()).map(|(l, r)| [*l, *r]), 1);
    // Ears that hear nearly the same at low frequencies make the factors singular otherwise.
    let floor = |m: Pair| m + Pair::identity() * Complex::from(1e-4 * m.trace().re + 1e-20);
    let (Some(c_found), Some(c_wanted)) = (floor(found).cholesky(), floor(wanted).cholesky()) else { return };
    let (c_found, c_wanted) = (c_found.l(), c_wanted.l());
    let svd = (c_found.adjoint() * c_wanted).svd(true, true);
    let (Some(u), Some(v_t), Some(inverse)) = (svd.u, svd.v_t, c_found.try_inverse()) else { return };
    let mixing = c_wanted * v_t.adjoint() * u.adjoint() * inverse;
    let narrow = |c: Complex<f64>| Complex32::new(c.re as f32, c.im as f32);
    let [ll, rl, lr, rr] = [mixing.m11, mixing.m21, mixing.m12, mixing.m22].map(narrow);
    for (l, r) in left.iter_mut().zip(right) {
        (*l, *r) = (ll * *l + lr * *r, rl * *l + rr * *r);
    }
}
