//! Responses halfway between neighbours on a ring, made of both.
//!
//! Two neighbours' reflections arrive at different moments and partly cancel where they are mixed. A response between them has
//! the mean energy of both in every band and millisecond, which gains per hop while playing cannot give it.

use crate::bake::kriging::Site;
use crate::bake::layout::{LEVEL_Z, SAME_PLACE_M};
use promenade_fourier::{signal, spectrum};
use std::ops::Range;

/// Neighbours that are closer than this agree as they are, radians; ...
const CLOSEST: f32 = 6.0 * std::f32::consts::PI / 180.0;
/// ... and those farther apart say nothing of what is between.
const FARTHEST: f32 = 95.0 * std::f32::consts::PI / 180.0;
/// Borders of bands, Hz: from the first on half an octave apart.
const FIRST_HZ: f64 = 283.0;
/// From the first of these bands on, 1.1 kHz, those up to the next have fine windows of time together. The lowest band has one
/// gain for all of its time, since neighbours agree in the bass.
const TOGETHER: [usize; 2] = [5, 8];
/// Gains are at most this, and at least its inverse.
const LARGEST_GAIN: f64 = 2.5;

/// Two responses by number, and where the one between them is heard.
pub(crate) struct Between {
    pub(crate) of: [usize; 2],
    pub(crate) site: Site,
}

/// The places between neighbours of rings, around each listener position, at one elevation. `origins` are the responses of
/// sites.
pub(crate) fn between(sites: &[Site], origins: &[usize]) -> Vec<Between> {
    let azimuth = |site: &Site| site.direction.y.atan2(site.direction.x);
    let neighbour = |i: usize| {
        let here = &sites[i];
        let is_on_ring = |other: &Site| {
            other.position.distance(here.position) < SAME_PLACE_M && (other.direction.z - here.direction.z).abs() < LEVEL_Z
        };
        let others = (0..sites.len()).filter(|j| *j != i && is_on_ring(&sites[*j]));
        let gaps = others.map(|j| (j, (azimuth(&sites[j]) - azimuth(here)).rem_euclid(std::f32::consts::TAU)));
        gaps.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, gap)| (CLOSEST..FARTHEST).contains(gap))
    };
    let pairs = (0..sites.len()).filter_map(|i| neighbour(i).map(|(j, _)| (i, j)));
    let pairs = pairs.filter(|(i, j)| origins[*i] != origins[*j]);
    let halfway = |(i, j): (usize, usize)| {
        let direction = (sites[i].direction + sites[j].direction).normalize();
        let of = [origins[i].min(origins[j]), origins[i].max(origins[j])];
        Between { of, site: Site { direction, position: sites[i].position } }
    };
    pairs.map(halfway).collect()
}

/// A signal by band, the lowest first.
pub(crate) struct Banded(Vec<Vec<f64>>);

impl Banded {
    pub(crate) fn of(samples: &[f32], rate_hz: f64) -> Self {
        let n = (2 * samples.len()).next_power_of_two();
        let all = spectrum(samples.iter().map(|x| f64::from(*x)), n);
        let borders = (0..).map(|i| FIRST_HZ * 2.0_f64.powf(0.5 * f64::from(i))).take_while(|hz| *hz < 0.4 * rate_hz);
        let above = |border: Option<f64>, k: usize| {
            border.map_or(0.0, |border| {
                let along = ((k as f64 * rate_hz / n as f64 / border).max(1e-9).log2() + 0.5).clamp(0.0, 1.0);
                0.5 - 0.5 * (std::f64::consts::PI * along).cos()
            })
        };
        let mut left = vec![1.0; all.len()];
        let bands = borders.map(Some).chain([None]).map(|border| {
            let band = all.iter().zip(&mut left).enumerate().map(|(k, (x, left))| {
                let goes_on = *left * above(border, k);
                let here = std::mem::replace(left, goes_on) - goes_on;
                x * here
            });
            let mut band = signal(band.collect(), n);
            band.truncate(samples.len());
            band
        });
        Self(bands.collect())
    }

    /// The mean of two signals.
    pub(crate) fn half_of(pair: [&Self; 2]) -> Self {
        let halves = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect();
        Self(pair[0].0.iter().zip(&pair[1].0).map(halves).collect())
    }

    /// The bands up to one, together.
    fn sum(&self, bands: Range<usize>) -> Vec<f64> {
        let bands = &self.0[bands];
        (0..bands[0].len()).map(|i| bands.iter().map(|band| band[i]).sum()).collect()
    }
}

/// Gains by band and sample, with which a mix has the mean energy of two signals.
pub(crate) struct Gains(Vec<Vec<f64>>);

impl Gains {
    /// Those of the mean of two responses at one of the ears, `[ear][response]`. `windows` are the lengths over which energies
    /// are met in each band, and in some bands together, the latter from sample `from` on. Below these bands both ears have one
    /// gain: what is changed at one ear alone is heard there as a delay.
    pub(crate) fn of(ears: [[&Banded; 2]; 2], ear: usize, windows: [usize; 2], from: usize) -> Self {
        let energy = |of: &[f64], window: usize| means(means(of.iter().map(|x| x * x).collect(), window), window);
        let ratio = |(wanted, found): (f64, f64)| {
            let gain = (wanted / found.max(1e-30)).sqrt().clamp(1.0 / LARGEST_GAIN, LARGEST_GAIN);
            if wanted > 1e-24 { gain } else { 1.0 }
        };
        let mean = |pair: [&Banded; 2], bands: Range<usize>, window: usize| -> Vec<f64> {
            let [a, b] = pair.map(|of| energy(&of.sum(bands.clone()), window));
            a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect()
        };
        let mixes = ears.map(Banded::half_of);
        let mix = &mixes[ear];
        let of_band = |band: usize| {
            let window = if band == 0 { mix.0[0].len() } else { windows[0] };
            let of = |ear: usize| (mean(ears[ear], band..band + 1, window), energy(&mixes[ear].0[band], window));
            let (mut wanted, mut found) = of(ear);
            if band < TOGETHER[0] {
                let other = of(1 - ear);
                wanted.iter_mut().zip(other.0).for_each(|(own, other)| *own += other);
                found.iter_mut().zip(other.1).for_each(|(own, other)| *own += other);
            }
            wanted.into_iter().zip(found).map(ratio).collect()
        };
        let mut gains: Vec<Vec<f64>> = (0..mix.0.len()).map(of_band).collect();
        let count = gains.len();
        let [mut first, next] = TOGETHER.map(|band| band.min(count));
        for end in [next, count] {
            if end == first {
                continue;
            }
            let coloured = mix.0.iter().zip(&gains).map(|(mix, gains)| mix.iter().zip(gains).map(|(x, g)| x * g).collect());
            let coloured = Banded(coloured.collect()).sum(first..end);
            let wanted = mean(ears[ear], first..end, windows[1]).into_iter();
            let together: Vec<f64> = wanted.zip(energy(&coloured, windows[1])).map(ratio).collect();
            for gains in &mut gains[first..end] {
                gains.iter_mut().zip(&together).skip(from).for_each(|(gain, together)| *gain *= together);
            }
            first = end;
        }
        Self(gains)
    }

    /// A mix at these gains.
    pub(crate) fn of_mix(&self, mix: &Banded) -> Vec<f32> {
        let at = |i: usize| mix.0.iter().zip(&self.0).map(|(mix, gains)| gains[i] * mix[i]).sum::<f64>() as f32;
        (0..mix.0[0].len()).map(at).collect()
    }
}

/// Moving averages over `window` samples.
fn means(of: Vec<f64>, window: usize) -> Vec<f64> {
    let sums: Vec<f64> = std::iter::once(0.0)
        .chain(of.iter().scan(0.0, |sum, x| {
            *sum += x;
            Some(*sum)
        }))
        .collect();
    let mean = |i: usize| {
        let (from, to) = (i.saturating_sub(window / 2), (i + window - window / 2).min(of.len()));
        (sums[to] - sums[from]).max(0.0) / window as f64
    };
    (0..of.len()).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use promenade_core::glam;
    use promenade_core::random::Random;

    fn site(azimuth_deg: f32) -> Site {
        let a = azimuth_deg.to_radians();
        Site { direction: Vec3::new(a.cos(), a.sin(), 0.0), position: Vec3::ZERO }
    }

    #[test]
    fn neighbours_of_a_ring_have_one_response_between_them_at_both_its_places() {
        // From -90 to 90 degrees, and the mirror image of what is not at the side.
        let measured: Vec<f32> = (-9..=9).map(|i| 10.0 * i as f32).collect();
        let mirrored = measured.iter().enumerate().filter(|(_, a)| a.abs() < 89.0);
        let (origins, behind): (Vec<usize>, Vec<f32>) = mirrored.map(|(i, a)| (i, 180.0 - a)).unzip();
        let sites: Vec<Site> = measured.iter().chain(&behind).map(|a| site(*a)).collect();
        let origins: Vec<usize> = (0..measured.len()).chain(origins).collect();
        let found = between(&sites, &origins);
        assert_eq!(found.len(), 36);
        for between in &found {
            let [a, b] = between.of;
            assert_eq!(b - a, 1);
            let middle = 10.0 * (a as f32 - 9.0) + 5.0;
            let seen = between.site.direction.y.asin().to_degrees();
            assert!((seen - middle).abs() < 0.1, "{a} {b}: {seen}");
        }
        assert!(between(&[0.0, 2.5, 5.0].map(site), &[0, 1, 2]).is_empty(), "close enough as they are");
    }

    #[test]
    fn reflections_that_arrive_at_different_moments_keep_their_energy() {
        let (rate, len) = (16_000.0, 2_400);
        let mut random = Random::new(7);
        let mut one = |at: usize| -> Vec<f32> {
            let mut x: Vec<f32> = (0..len).map(|i| 0.05 * random.normal() * (-(i as f32) / 600.0).exp()).collect();
            // Half a period apart at 2 kHz.
            for (i, x) in x[at..at + 24].iter_mut().enumerate() {
                *x += (0.25 * std::f32::consts::PI * i as f32).sin();
            }
            x
        };
        let pair = [one(160), one(164)];
        let split = pair.each_ref().map(|x| Banded::of(x, rate));
        let both = split.each_ref();
        let whole = |i: usize| split[0].0.iter().map(|band| band[i]).sum::<f64>();
        assert!((0..len).all(|i| (whole(i) - f64::from(pair[0][i])).abs() < 1e-5), "bands sum to the whole");
        let energy = |x: &[f32], range: Range<usize>| x[range].iter().map(|v| f64::from(v * v)).sum::<f64>();
        let of_mean = |x: &[f32], range: Range<usize>| {
            10.0 * (2.0 * energy(x, range.clone()) / (energy(&pair[0], range.clone()) + energy(&pair[1], range))).log10()
        };
        let plain: Vec<f32> = pair[0].iter().zip(&pair[1]).map(|(a, b)| 0.5 * (a + b)).collect();
        assert!(of_mean(&plain, 150..200) < -6.0);
        let found = Gains::of([both; 2], 0, [80, 16], 32).of_mix(&Banded::half_of(both));
        for range in [150..200, 400..800, 800..2_400] {
            let db = of_mean(&found, range.clone());
            assert!(db.abs() < 0.7, "{range:?}: {db:.2} dB");
        }
    }
}
