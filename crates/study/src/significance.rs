//! Do ratings of conditions differ? Friedman's test of all, and Wilcoxon's of each two, by persons.

use crate::answers::grouped;
use crate::definition::MOST_CONDITIONS;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};
use std::collections::HashMap;

/// Most persons for whom the chance of a signed-rank sum is counted exactly.
const MOST_EXACT: usize = 100;

/// Whether the conditions of an item differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Differences {
    /// Persons who rated every condition: of each counts the mean of what was rated more than once.
    pub persons: usize,
    /// Friedman's chi squared, with ties (Conover, Practical Nonparametric Statistics, 1999, section 5.8).
    pub chi2: f64,
    /// Its degrees of freedom, one less than conditions.
    pub freedom: u32,
    /// Chance of it where all conditions are alike.
    pub chance: f64,
    /// Each two conditions, without references and anchors; none of more than an item of a study has.
    pub pairs: Vec<Difference>,
}

/// Whether two conditions differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The conditions, by name rising.
    pub between: [String; 2],
    /// Mean of how much higher the first was rated.
    pub mean: f64,
    /// Two-sided chance by Wilcoxon's signed ranks (Biometrics Bulletin 1, 1945), exact for up to 100 persons, with ties.
    pub chance: f64,
    /// The chance corrected for the number of pairs (Holm, Scandinavian Journal of Statistics 6, 1979).
    pub holm: f64,
}

/// Who rated, what, and how.
type Rating<'a> = ((&'a str, &'a str), &'a str, f64);

/// Of ratings of conditions.
pub(crate) fn differences(rated: &[Rating<'_>]) -> Option<Differences> {
    let mut names: Vec<&str> = grouped(rated.iter(), |(_, of, _)| *of).into_iter().map(|(name, _)| name).collect();
    names.sort_unstable();
    let persons = grouped(rated.iter(), |(person, ..)| *person).into_iter();
    let row = |(_, own): (_, Vec<&Rating<'_>>)| {
        let own: HashMap<&str, Vec<f64>> = grouped(own.into_iter(), |(_, of, _)| *of)
            .into_iter()
            .map(|(of, all)| (of, all.iter().map(|r| r.2).collect()))
            .collect();
        let mean = |name: &&str| own.get(name).map(|all| all.iter().sum::<f64>() / all.len() as f64);
        names.iter().map(mean).collect()
    };
    let rows: Vec<Vec<f64>> = persons.filter_map(row).collect();
    if names.len() < 2 || rows.len() < 2 {
        return None;
    }
    let (chi2, freedom) = friedman(&rows);
    let mut pairs = Vec::new();
    let compared = if names.len() > MOST_CONDITIONS { &[][..] } else { &names };
    for (i, one) in compared.iter().enumerate() {
        for (j, other) in names.iter().enumerate().skip(i + 1) {
            let apart: Vec<f64> = rows.iter().map(|row| row[i] - row[j]).collect();
            let mean = apart.iter().sum::<f64>() / apart.len() as f64;
            let chance = signed_ranks(&apart);
            pairs.push(Difference { between: [*one, *other].map(str::to_owned), mean, chance, holm: chance });
        }
    }
    holm(&mut pairs);
    let chance = ChiSquared::new(f64::from(freedom)).map_or(f64::NAN, |of| of.sf(chi2));
    Some(Differences { persons: rows.len(), chi2, freedom, chance, pairs })
}

/// Ranks from 1, means where values are equal.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut rising = values.to_vec();
    rising.sort_by(f64::total_cmp);
    let rank = |v: &f64| {
        let [below, within] = [rising.partition_point(|o| o < v), rising.partition_point(|o| o <= v)];
        (below + within + 1) as f64 / 2.0
    };
    values.iter().map(rank).collect()
}

fn friedman(rows: &[Vec<f64>]) -> (f64, u32) {
    let (n, k) = (rows.len() as f64, rows[0].len() as f64);
    let ranked: Vec<Vec<f64>> = rows.iter().map(|row| ranks(row)).collect();
    let apart = (0..rows[0].len()).map(|j| (ranked.iter().map(|row| row[j]).sum::<f64>() - n * (k + 1.0) / 2.0).powi(2));
    let spread = ranked.iter().flatten().map(|r| r * r).sum::<f64>() - n * k * (k + 1.0).powi(2) / 4.0;
    let chi2 = if spread > 0.0 { (k - 1.0) * apart.sum::<f64>() / spread } else { 0.0 };
    (chi2, u32::try_from(rows[0].len() - 1).unwrap_or(u32::MAX))
}

/// Two-sided chance of signed ranks as far from even where each sign is a coin's; differences of 0 are left out.
fn signed_ranks(apart: &[f64]) -> f64 {
    let apart: Vec<f64> = apart.iter().copied().filter(|d| *d != 0.0).collect();
    // Twice the ranks are whole.
    let doubled: Vec<usize> =
        ranks(&apart.iter().map(|d| d.abs()).collect::<Vec<_>>()).iter().map(|r| (2.0 * r).round() as usize).collect();
    let total: usize = doubled.iter().sum();
    let above: usize = doubled.iter().zip(&apart).filter(|(_, d)| **d > 0.0).map(|(r, _)| r).sum();
    let less = above.min(total - above);
    if apart.len() > MOST_EXACT {
        let spread = doubled.iter().map(|r| (*r as f64 / 2.0).powi(2)).sum::<f64>().sqrt();
        return (2.0 * Normal::standard().cdf((less as f64 - total as f64 / 2.0) / spread)).min(1.0);
    }
    let mut chances = vec![0.0; total + 1];
    chances[0] = 1.0;
    for rank in doubled {
        for sum in (0..=total).rev() {
            let with = if sum >= rank { chances[sum - rank] } else { 0.0 };
            chances[sum] = 0.5 * (chances[sum] + with);
        }
    }
    (2.0 * chances[..=less].iter().sum::<f64>()).min(1.0)
}

fn holm(pairs: &mut [Difference]) {
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    order.sort_by(|a, b| pairs[*a].chance.total_cmp(&pairs[*b].chance));
    let mut most = 0.0_f64;
    for (place, i) in order.iter().enumerate() {
        most = most.max((pairs.len() - place) as f64 * pairs[*i].chance).min(1.0);
        pairs[*i].holm = most;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signed_ranks_are_those_of_tables() {
        // Wilcoxon's table: of 10 differences a sum of 8 has a two-sided chance of 50 / 1024.
        let apart = [-1.0, -7.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 9.0, 10.0];
        assert!((signed_ranks(&apart) - 50.0 / 1024.0).abs() < 1e-12, "{}", signed_ranks(&apart));
        // All alike: 2 / 2^5, whatever the ties and zeros.
        assert!((signed_ranks(&[3.0, 3.0, 3.0, 1.0, 2.0, 0.0]) - 2.0 / 32.0).abs() < 1e-12);
        assert_eq!(signed_ranks(&[0.0, 0.0]), 1.0);
        // The normal curve takes over without a step.
        let many = |n: u16| (1..=n).map(|i| f64::from(i) * if i % 3 == 0 { -1.0 } else { 1.0 }).collect::<Vec<_>>();
        // By 2 Phi of z = -2.895 and -3.023.
        let (exact, near) = (signed_ranks(&many(100)), signed_ranks(&many(101)));
        assert!((exact - 0.00379).abs() < 3e-4 && (near - 0.002499).abs() < 1e-6, "{exact} {near}");
    }

    #[test]
    fn friedman_is_that_of_a_textbook() {
        // Sums of ranks 4, 8 and 12 over 4 persons of one mind: chi2 = 12 / (4 3 4) (16 + 64 + 144) - 3 4 4 = 8.
        let rows = vec![vec![1.0, 2.0, 3.0]; 4];
        assert_eq!(friedman(&rows), (8.0, 2));
        assert_eq!(friedman(&[vec![5.0, 5.0], vec![7.0, 7.0]]).0, 0.0);
    }

    #[test]
    fn holm_steps_down() {
        let mut pairs: Vec<Difference> = [0.04, 0.01, 0.03]
            .map(|chance| Difference { between: ["a", "b"].map(str::to_owned), mean: 0.0, chance, holm: 0.0 })
            .into();
        holm(&mut pairs);
        assert_eq!(pairs.iter().map(|p| (p.holm * 1000.0).round()).collect::<Vec<_>>(), [60.0, 30.0, 60.0]);
    }
}
