//! What a renderer of pictures may spend on each pixel: Harvey, Debattista, Bashford-Rogers and Chalmers, "Multi-modal
//! perception for selective rendering", Computer Graphics Forum 2017.

use super::plane::Plane;
use crate::{MetricError, SampleBudget};

/// Share of pixels that may be louder than 1: particles make single pixels much louder.
const LOUDEST: f64 = 0.001;
/// How far the cost may be off the stated one, as a share of it.
const LEEWAY: f64 = 0.005;

/// How loud pixels are beside each other, 0 to 1: the pressure of what falls on them over that of the loudest.
///
/// `level_db`: of what falls on what each pixel shows; NaN where nothing does.
#[must_use]
pub fn loudness_of_pixels(level_db: &Plane) -> Plane {
    let mut levels: Vec<f32> = level_db.of.iter().copied().filter(|level| level.is_finite()).collect();
    levels.sort_by(f32::total_cmp);
    let at = (levels.len() as f64 * (1.0 - LOUDEST)) as usize;
    let Some(most) = levels.get(at.min(levels.len().saturating_sub(1))) else { return level_db.map(|_| 0.0) };
    level_db.map(|level| if level.is_finite() { 10.0_f32.powf((level - most) / 20.0).min(1.0) } else { 0.0 })
}

/// The sum w_A S_A + w_V S_V, where w_V is 1 - w_A.
///
/// `sound_weight`: w_A, 0 to 1.
///
/// # Panics
/// Maps of different sizes.
#[must_use]
pub fn fused(sound: &Plane, picture: &Plane, sound_weight: f64) -> Plane {
    assert!([sound.width, sound.height] == [picture.width, picture.height], "one size");
    let weight = sound_weight as f32;
    sound.with(picture, |a, v| weight * a + (1.0 - weight) * v)
}

impl SampleBudget {
    /// Whole numbers smin and smax for which all pixels together cost as much as with `mean` samples each (equation 3 of the
    /// paper, solved). smin is `least`, or the nearest to it with which the
    /// cost is off by at most half a percent.
    ///
    /// `map`: of all pixels, 0 to 1.
    ///
    /// # Errors
    /// A least that is above the mean, or a mean of 0.
    pub fn of_pixels(map: &Plane, mean: u32, least: u32) -> Result<Self, MetricError> {
        if least > mean || mean == 0 {
            return Err(MetricError::Budget { mean, least });
        }
        let weight = map.of.iter().map(|v| f64::from(*v)).sum::<f64>() / map.of.len() as f64;
        let wanted = f64::from(mean);
        let even = (0.0, Self { least: mean, most: mean });
        if weight <= 0.0 {
            return Ok(even.1);
        }
        // The mean itself would be the even map.
        let mut near: Vec<u32> = (0..mean).chain([least]).collect();
        near.sort_by_key(|other| other.abs_diff(least));
        let mut best = (f64::INFINITY, even.1);
        for least in near {
            let most = (f64::from(least) + (wanted - f64::from(least)) / weight).round().min(f64::from(u32::MAX)) as u32;
            let cost = f64::from(least) + f64::from(most - least) * weight;
            let off = (cost - wanted).abs();
            if off < best.0 {
                best = (off, Self { least, most });
            }
            if off <= LEEWAY * wanted {
                break;
            }
        }
        Ok(best.1)
    }

    /// Whole samples of each pixel: smin + (smax - smin) S, the rounding of each made good by the next on its way, which turns
    /// at the ends of rows.
    #[must_use]
    pub fn spent_on_pixels(self, map: &Plane) -> Vec<u32> {
        let column = |y: usize, step: usize| if y.is_multiple_of(2) { step } else { map.width - 1 - step };
        let way = || (0..map.height).flat_map(|y| (0..map.width).map(move |step| y * map.width + column(y, step)));
        let mut samples = vec![0; map.of.len()];
        for (at, spent) in way().zip(self.spent_on(way().map(|at| f64::from(map.of[at])))) {
            samples[at] = spent;
        }
        samples
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> Plane {
        let of = (0..64 * 48).map(|i| ((i % 64) as f32 / 63.0).powi(6) * 0.8).collect();
        Plane::new([64, 48], of).unwrap()
    }

    #[test]
    fn any_map_costs_what_it_should() {
        let map = map();
        for (mean, least) in [(4, 1), (100, 50), (1690, 500), (7, 6)] {
            let budget = SampleBudget::of_pixels(&map, mean, least).unwrap();
            let samples = budget.spent_on_pixels(&map);
            let cost = samples.iter().map(|n| f64::from(*n)).sum::<f64>() / samples.len() as f64;
            assert!((cost / f64::from(mean) - 1.0).abs() < 0.01, "{cost} of {mean}: {budget:?}");
            let off = |at: usize, of: u32| samples[at].abs_diff(of);
            assert!(off(0, budget.least()) <= 1 && samples[63] > samples[0], "{budget:?}");
        }
        let dark = Plane::new([2, 1], vec![0.0; 2]).unwrap();
        assert_eq!(SampleBudget::of_pixels(&dark, 9, 1).unwrap().spent_on_pixels(&dark), [9, 9]);
        assert!(SampleBudget::of_pixels(&map, 1, 2).is_err() && SampleBudget::of_pixels(&map, 0, 0).is_err());
    }

    #[test]
    fn pressure_is_beside_the_loudest() {
        let levels = Plane::new([4, 1], vec![-20.0, 0.0, f32::NAN, -6.0206]).unwrap();
        let loud = loudness_of_pixels(&levels).of;
        for (found, expected) in loud.iter().zip([0.1, 1.0, 0.0, 0.5]) {
            assert!((found - expected).abs() < 1e-4, "{loud:?}");
        }
        assert_eq!(loudness_of_pixels(&Plane::new([1, 1], vec![f32::NAN]).unwrap()).of, [0.0]);
    }

    #[test]
    fn weights_share_out() {
        let plane = |v| Plane::new([1, 1], vec![v]).unwrap();
        for (weight, expected) in [(0.0, 0.2), (1.0, 0.8), (0.25, 0.35)] {
            assert!((fused(&plane(0.8), &plane(0.2), weight).of[0] - expected).abs() < 1e-6);
        }
    }
}
