//! Cutting tracks into clips, and clips into those to learn from and those to judge by.

use super::Split;
use promenade_core::random::Random;

/// Which clips are for testing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SplitRule {
    /// Of so many clips in a row the last.
    Every(usize),
    /// A share of all clips, in [0, 1], chosen by a seed; rounded to whole clips.
    Share {
        /// Of all clips.
        test: f64,
        /// Another seed, another choice.
        seed: u64,
    },
}

impl Default for SplitRule {
    /// Every fifth clip: 80 % to learn from, 20 % to judge by, spread over the walk.
    fn default() -> Self {
        Self::Every(5)
    }
}

impl SplitRule {
    /// The splits of so many clips in a row.
    #[must_use]
    pub fn splits(&self, count: usize) -> Vec<Split> {
        match *self {
            Self::Every(n) => (1..=count).map(|i| if n > 0 && i % n == 0 { Split::Test } else { Split::Train }).collect(),
            Self::Share { test, seed } => {
                let tests = (test.clamp(0.0, 1.0) * count as f64).round() as usize;
                let mut order: Vec<usize> = (0..count).collect();
                let mut random = Random::new(seed);
                for i in (1..count).rev() {
                    let j = (f64::from(random.uniform()) * (i + 1) as f64) as usize;
                    order.swap(i, j.min(i));
                }
                let mut splits = vec![Split::Train; count];
                order.iter().take(tests).for_each(|&i| splits[i] = Split::Test);
                splits
            }
        }
    }
}

/// A rule by which tracks are cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// Length of each clip, seconds; what is left at a track's end is not used.
    pub clip_s: f64,
    /// Which clips are for testing.
    pub split: SplitRule,
}

impl Default for Cut {
    fn default() -> Self {
        Self { clip_s: 1.0, split: SplitRule::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tests(rule: SplitRule, count: usize) -> Vec<usize> {
        rule.splits(count).iter().enumerate().filter(|(_, s)| **s == Split::Test).map(|(i, _)| i).collect()
    }

    #[test]
    fn every_fifth_or_a_share() {
        assert_eq!(tests(SplitRule::default(), 12), [4, 9]);
        let share = |seed| tests(SplitRule::Share { test: 0.2, seed }, 100);
        assert_eq!((share(1).len(), share(1) == share(1), share(1) == share(2)), (20, true, false));
        assert_eq!(tests(SplitRule::Share { test: 1.0, seed: 1 }, 3), [0, 1, 2]);
        assert_eq!(tests(SplitRule::Every(0), 3).len(), 0);
    }
}
