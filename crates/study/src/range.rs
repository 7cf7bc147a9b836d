//! How far two scores must lie apart to differ: the range of all scores where each vote is a coin's.

use statrs::distribution::{Binomial, Continuous, ContinuousCDF, Discrete, Normal};
use std::collections::HashMap;

/// Most steps of the exact distributions of a report: beyond it the normal one is near enough.
const MOST_STEPS: usize = 400_000_000;

/// The least difference of two scores that is significant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastDifference {
    /// R0 = W sqrt(s t) / 2 + 1 / 4 with the studentized range W of t normal values (David, The Method of Paired Comparisons,
    /// 1988): no range of whole numbers up to it is significant.
    pub bound: f64,
    /// The least significant difference.
    pub least: u32,
    /// Chance of a range as large as it, exact; none where it is taken from the bound.
    pub chance: Option<f64>,
}

/// Chance at which a difference is called significant.
pub const LEVEL: f64 = 0.05;

/// The least significant differences of a report's tables.
pub(crate) struct LeastDifferences {
    /// Studentized ranges by the number of conditions.
    known: HashMap<usize, f64>,
    steps_left: usize,
}

impl LeastDifferences {
    pub(crate) fn new() -> Self {
        Self { known: HashMap::new(), steps_left: MOST_STEPS }
    }

    /// For conditions that were judged pair by pair, each pair this often (a fraction where pairs were judged unequally often).
    pub(crate) fn of(&mut self, conditions: usize, judges: f64) -> LeastDifference {
        let range = *self.known.entry(conditions).or_insert_with(|| studentized(conditions, LEVEL));
        let bound = 0.5 * range * (judges * conditions as f64).sqrt() + 0.25;
        let whole = (judges.fract() == 0.0).then_some(judges as u32);
        if let Some(ranges) = whole.and_then(|judges| exact_ranges(conditions, judges, &mut self.steps_left)) {
            let mut beyond = 0.0;
            let mut least = ranges.len();
            while least > 0 && beyond + ranges[least - 1] <= LEVEL {
                least -= 1;
                beyond += ranges[least];
            }
            // Two conditions never differ by an odd number of an even one of votes.
            while ranges.get(least) == Some(&0.0) {
                least += 1;
            }
            return LeastDifference { bound, least: u32::try_from(least).unwrap_or(u32::MAX), chance: Some(beyond) };
        }
        LeastDifference { bound, least: bound.floor() as u32 + 1, chance: None }
    }
}

/// Chance of each range of scores, exact; none where that takes longer than what is left.
fn exact_ranges(conditions: usize, judges: u32, steps_left: &mut usize) -> Option<Vec<f64>> {
    let side = (conditions - 1).checked_mul(judges as usize)?.checked_add(1)?;
    // The last score follows from the others.
    let free = conditions - 1;
    let states = side.checked_pow(u32::try_from(free).ok()?)?;
    let pairs = conditions * free / 2;
    *steps_left = steps_left.checked_sub(states.checked_mul(pairs)?.checked_mul(judges as usize + 1)?)?;
    let stride: Vec<usize> = (0..free).map(|i| side.pow(u32::try_from(i).unwrap_or(0))).collect();
    let coin = Binomial::new(0.5, u64::from(judges)).ok()?;
    let chance: Vec<f64> = (0..=u64::from(judges)).map(|k| coin.pmf(k)).collect();
    let mut state = vec![0.0; states];
    state[0] = 1.0;
    for one in 0..conditions {
        for other in one + 1..conditions {
            let mut next = vec![0.0; states];
            for (at, p) in state.iter().enumerate().filter(|(_, p)| **p > 0.0) {
                for (k, q) in chance.iter().enumerate() {
                    let of = |i: usize, votes: usize| stride.get(i).map_or(0, |step| step * votes);
                    next[at + of(one, k) + of(other, judges as usize - k)] += p * q;
                }
            }
            state = next;
        }
    }
    let total = pairs * judges as usize;
    let mut ranges = vec![0.0; side];
    for (at, p) in state.iter().enumerate().filter(|(_, p)| **p > 0.0) {
        let scores = stride.iter().map(|step| at / step % side);
        let last = total - scores.clone().sum::<usize>();
        let (low, high) = scores.fold((last, last), |(low, high), score| (low.min(score), high.max(score)));
        ranges[high - low] += p;
    }
    Some(ranges)
}

/// The range of t independent standard normal values that is exceeded with a chance of `level`.
fn studentized(t: usize, level: f64) -> f64 {
    let (mut low, mut high) = (0.0, 20.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if 1.0 - range_below(t, middle) > level { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Chance of a range of at most w: t times the integral of phi(x) (Phi(x) - Phi(x - w))^(t - 1).
fn range_below(t: usize, w: f64) -> f64 {
    const STEPS: u32 = 2000;
    let normal = Normal::standard();
    let power = i32::try_from(t - 1).unwrap_or(i32::MAX);
    let value = |x: f64| normal.pdf(x) * (normal.cdf(x) - normal.cdf(x - w)).powi(power);
    let step = 16.0 / f64::from(STEPS);
    // Both ends are 0; the rule of midpoints converges as fast as any for such a curve.
    t as f64 * step * (0..STEPS).map(|i| value(-8.0 + (f64::from(i) + 0.5) * step)).sum::<f64>()
}

/// Indices of scores, best first, in groups within which no two differ significantly; a score may be in several.
pub fn groups(scores: &[u32], least: u32) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..scores.len()).collect();
    order.sort_by_key(|i| std::cmp::Reverse(scores[*i]));
    let mut found: Vec<(usize, usize)> = Vec::new();
    for start in 0..order.len() {
        let end =
            (start..order.len()).take_while(|end| scores[order[start]] - scores[order[*end]] < least).last().unwrap_or(start);
        if found.last().is_none_or(|last| end > last.1) {
            found.push((start, end));
        }
    }
    found.into_iter().map(|(start, end)| order[start..=end].to_vec()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn studentized_ranges_are_those_of_tables() {
        // Pearson and Hartley, Biometrika Tables for Statisticians, table 29: infinitely many degrees of freedom.
        for (t, level, expected) in [(2, 0.05, 2.77), (3, 0.05, 3.31), (4, 0.05, 3.63), (10, 0.05, 4.47), (4, 0.01, 4.40)] {
            assert!((studentized(t, level) - expected).abs() < 0.006, "{t}: {}", studentized(t, level));
        }
    }

    #[test]
    fn few_conditions_are_exact() {
        // Two conditions: the sign test. |2k - 10| >= 8 has a chance of 2 (1 + 10) / 1024.
        let mut of = LeastDifferences::new();
        let two = of.of(2, 10.0);
        assert_eq!(two.least, 8);
        assert!((two.chance.unwrap() - 22.0 / 1024.0).abs() < 1e-12);
        let many = of.of(12, 28.0);
        assert!(many.chance.is_none() && f64::from(many.least) > many.bound, "{many:?}");
        // Both ways agree, but for the steps of whole votes.
        let exact = of.of(3, 100.0);
        assert!(exact.chance.is_some() && (f64::from(exact.least) - exact.bound).abs() < 1.5, "{exact:?}");
    }

    #[test]
    fn neighbours_share_groups() {
        assert_eq!(groups(&[10, 40, 25, 28], 16), [vec![1, 3, 2], vec![2, 0]].map(|g| g.to_vec()));
        assert_eq!(groups(&[10, 40], 5), [vec![1], vec![0]]);
        assert_eq!(groups(&[10, 10], 1), [vec![0, 1]]);
    }
}
