//! What a renderer of pictures may spend on each of them, or on each of their pixels.
//!
//! After Harvey, Debattista, Bashford-Rogers and Chalmers, "Multi-modal perception for selective rendering", Computer Graphics
//! Forum 2017.

use crate::MetricError;

/// What pictures or pixels cost, samples per pixel.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub struct SampleBudget {
    pub(crate) least: u32,
    pub(crate) most: u32,
}

impl SampleBudget {
    /// The most that a picture may cost so that all together cost as much as with `mean` each, where those of no weight cost
    /// the `least`.
    ///
    /// `weights`: of all pictures, 0 to 1, such as [`picture_weights`](super::picture_weights) makes.
    ///
    /// # Errors
    /// A least that is above the mean.
    pub fn of_pictures(weights: &[f64], mean: u32, least: u32) -> Result<Self, MetricError> {
        if least > mean {
            return Err(MetricError::Budget { mean, least });
        }
        let weight = weights.iter().sum::<f64>() / weights.len() as f64;
        Ok(Self { least, most: (f64::from(least) + f64::from(mean - least) / weight).round() as u32 })
    }

    /// What no weight costs, samples per pixel.
    #[must_use]
    pub fn least(self) -> u32 {
        self.least
    }

    /// What a weight of 1 costs, samples per pixel.
    #[must_use]
    pub fn most(self) -> u32 {
        self.most
    }

    /// Whole samples for each weight, whose rounding is made good by the next.
    #[must_use]
    pub fn spent_on(self, weights: impl IntoIterator<Item = f64>) -> Vec<u32> {
        let mut owed = 0.0;
        let spend = |weight: f64| {
            owed += f64::from(self.least) + f64::from(self.most - self.least) * weight;
            let samples = f64::max(owed.round(), 0.0);
            owed -= samples;
            samples as u32
        };
        weights.into_iter().map(spend).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_pictures_together_cost_what_the_mean_costs() {
        let mut weights = vec![0.05; 250];
        weights[70..80].fill(1.0);
        let budget = SampleBudget::of_pictures(&weights, 100, 20).unwrap();
        let spent = budget.spent_on(weights.iter().copied());
        let total: u32 = spent.iter().sum();
        assert!(total.abs_diff(25_000) <= 150, "{total}: the most is a whole number");
        assert!(spent[75].abs_diff(budget.most()) <= 1 && spent[10] < 100 && budget.most() > 500, "{}", budget.most());
        assert_eq!(SampleBudget::of_pictures(&weights, 100, 101), Err(MetricError::Budget { mean: 100, least: 101 }));
    }
}
