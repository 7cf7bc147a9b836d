//! Do judges agree with each other, and each with itself? Kendall and Babington Smith, "On the method of paired comparisons",
//! Biometrika 31, 1940.

use crate::preferences::Preferences;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// How far judges agree over a table of votes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// Kendall's coefficient of agreement: 1 where all made the same choices, -1 / (s - 1) or little less where they could not
    /// agree less.
    pub u: f64,
    /// Its test for many judges, t (t - 1) / 2 * (1 + u (s - 1)) (Siegel and Castellan 1988).
    pub chi2: f64,
    /// Degrees of freedom, t (t - 1) / 2.
    pub freedom: u32,
    /// Chance of such a chi2 where each vote is a coin's.
    pub chance: f64,
    /// Test whether all conditions have the same score, 4 / (s t) * (sum of a^2 - t (s (t - 1))^2 / 4) (David, The Method of
    /// Paired Comparisons, 1988).
    pub scores_chi2: f64,
    /// Its degrees of freedom, t - 1.
    pub scores_freedom: u32,
    /// Chance of it where each vote is a coin's.
    pub scores_chance: f64,
}

impl Agreement {
    /// Of a table; none with fewer than two judgements of a pair on average. Where pairs were judged unequally often, their
    /// mean is the number of judges.
    pub fn new(preferences: &Preferences) -> Option<Self> {
        let (s, t) = (preferences.judges(), preferences.names().len());
        if s < 2.0 {
            return None;
        }
        let pairs = preferences.pairs().count();
        let choose2 = |n: f64| n * (n - 1.0) / 2.0;
        let both = |(one, other)| {
            [(one, other), (other, one)].map(|(i, j)| choose2(f64::from(preferences.votes(i, j)))).iter().sum::<f64>()
        };
        let agreements: f64 = preferences.pairs().map(both).sum();
        let u = 2.0 * agreements / (choose2(s) * pairs as f64) - 1.0;
        let chi2 = pairs as f64 * (1.0 + u * (s - 1.0));
        let squares: f64 = preferences.scores().iter().map(|a| f64::from(*a).powi(2)).sum();
        let even = t as f64 * (s * (t - 1) as f64).powi(2) / 4.0;
        let scores_chi2 = 4.0 / (s * t as f64) * (squares - even);
        let [freedom, scores_freedom] = [pairs, t - 1].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
        Some(Self {
            u,
            chi2,
            freedom,
            chance: beyond(chi2, freedom),
            scores_chi2,
            scores_freedom,
            scores_chance: beyond(scores_chi2, scores_freedom),
        })
    }
}

fn beyond(chi2: f64, freedom: u32) -> f64 {
    ChiSquared::new(f64::from(freedom)).map_or(f64::NAN, |of| of.sf(chi2.max(0.0)))
}

/// Coefficient of consistency zeta of one judge: 1 without a circle of three (x over y over z over x), 0 with as many as can
/// be. None unless each pair was judged once.
pub fn consistency(of_one: &Preferences) -> Option<f64> {
    let t = of_one.names().len() as f64;
    if t < 3.0 || of_one.pairs().any(|(one, other)| of_one.judgements(one, other) != 1) {
        return None;
    }
    let squares: f64 = of_one.scores().iter().map(|a| f64::from(*a).powi(2)).sum();
    let circles = t * (t - 1.0) * (2.0 * t - 1.0) / 12.0 - squares / 2.0;
    let most = if t % 2.0 == 0.0 { (t.powi(3) - 4.0 * t) / 24.0 } else { (t.powi(3) - t) / 24.0 };
    Some(1.0 - circles / most)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(t: usize, votes: impl Fn(usize, usize) -> u32) -> Preferences {
        let mut table = Preferences::new((0..t).map(|i| i.to_string()).collect()).unwrap();
        for i in 0..t {
            for j in 0..t {
                table.add(i, j, if i == j { 0 } else { votes(i, j) }).unwrap();
            }
        }
        table
    }

    #[test]
    fn judges_of_one_mind_agree_and_halves_do_not() {
        let same = Agreement::new(&table(4, |i, j| if i < j { 10 } else { 0 })).unwrap();
        assert!((same.u - 1.0).abs() < 1e-12 && same.chance < 1e-9 && same.scores_chance < 1e-9, "{same:?}");
        assert_eq!((same.freedom, same.scores_freedom), (6, 3));
        let split = Agreement::new(&table(4, |_, _| 5)).unwrap();
        assert!(
            (split.u + 1.0 / 9.0).abs() < 1e-12 && split.scores_chi2.abs() < 1e-12 && split.scores_chance > 0.99,
            "{split:?}"
        );
        assert!(Agreement::new(&table(3, |i, j| u32::from(i < j))).is_none(), "one judge agrees with nobody");
    }

    #[test]
    fn circles_are_inconsistent() {
        assert_eq!(consistency(&table(4, |i, j| u32::from(i < j))), Some(1.0));
        assert_eq!(consistency(&table(3, |i, j| u32::from((j + 3 - i) % 3 == 1))), Some(0.0));
        // One circle of at most two: 0 over 1 over 2 over 0, and all over 3.
        let one = |i: usize, j: usize| u32::from(if i == 3 || j == 3 { j == 3 } else { (j + 3 - i) % 3 == 1 });
        assert_eq!(consistency(&table(4, one)), Some(0.5));
        assert_eq!(consistency(&table(4, |_, _| 1)), None);
    }
}
