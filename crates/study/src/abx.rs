//! Figures of ABX trials.

use crate::answers::{Answer, Trial, grouped};
use statrs::distribution::{Beta, Binomial, ContinuousCDF, DiscreteCDF};
use std::collections::HashMap;

/// How often X was told.
#[derive(Clone, Debug, PartialEq)]
pub struct Abx {
    /// The item, or "all".
    pub item: String,
    /// The two conditions.
    pub between: [String; 2],
    /// Trials.
    pub trials: u32,
    /// Those in which X was told.
    pub right: u32,
    /// Chance of as many or more by guessing.
    pub chance: f64,
    /// 95 % confidence interval of the share that was told (Clopper and Pearson, Biometrika 26, 1934).
    pub interval: [f64; 2],
}

impl Abx {
    fn new(item: &str, between: &[String; 2], trials: u32, right: u32) -> Self {
        let guesses = Binomial::new(0.5, u64::from(trials)).ok();
        let chance = right.checked_sub(1).map_or(1.0, |less| guesses.map_or(f64::NAN, |of| of.sf(u64::from(less))));
        let (k, n) = (f64::from(right), f64::from(trials));
        let at = |a: f64, b: f64, share: f64| Beta::new(a, b).map_or(f64::NAN, |of| of.inverse_cdf(share));
        let low = if right == 0 { 0.0 } else { at(k, n - k + 1.0, 0.025) };
        let high = if right == trials { 1.0 } else { at(k + 1.0, n - k, 0.975) };
        Self { item: item.to_owned(), between: between.clone(), trials, right, chance, interval: [low, high] }
    }
}

/// Figures for each item and pair of conditions, and where several items have the same pair, of all of them.
pub fn abx(answers: &[Answer]) -> Vec<Abx> {
    counted(answers, |answer| &answer.item, Some("all"))
}

/// Figures for each person and pair of conditions; `item` is the person.
pub fn abx_by_person(answers: &[Answer]) -> Vec<Abx> {
    counted(answers, |answer| &answer.person, None)
}

fn counted(answers: &[Answer], by: impl Fn(&Answer) -> &str, all: Option<&str>) -> Vec<Abx> {
    let trials: Vec<(&str, &[String; 2], bool)> = answers
        .iter()
        .filter_map(|answer| match &answer.what {
            Trial::Abx { between, right } => Some((by(answer), between, *right)),
            _ => None,
        })
        .collect();
    let mut pairs = grouped(trials.into_iter(), |(_, between, _)| *between);
    pairs.sort_by_key(|(pair, _)| *pair);
    // Many persons have the same counts.
    let mut known: HashMap<(u32, u32), Abx> = HashMap::new();
    let mut of = |item: &str, pair: &[String; 2], trials: &[(&str, &[String; 2], bool)]| {
        let [all, right] = [false, true].map(|right| trials.iter().filter(|trial| trial.2 || !right).count());
        let [all, right] = [all, right].map(|count| u32::try_from(count).unwrap_or(u32::MAX));
        let figures = known.entry((all, right)).or_insert_with(|| Abx::new(item, pair, all, right)).clone();
        Abx { item: item.to_owned(), between: pair.clone(), ..figures }
    };
    let mut found = Vec::new();
    for (pair, trials) in pairs {
        let items = grouped(trials.iter().copied(), |(item, ..)| *item);
        found.extend(items.iter().map(|(item, trials)| of(item, pair, trials)));
        found.extend(all.filter(|_| items.len() > 1).map(|all| of(all, pair, &trials)));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chances_and_intervals_are_those_of_the_binomial() {
        let names = ["a".to_owned(), "b".to_owned()];
        // 9 of 10: 11 / 1024; Clopper and Pearson .555 to .9975.
        let of = Abx::new("room", &names, 10, 9);
        assert!((of.chance - 11.0 / 1024.0).abs() < 1e-12);
        assert!((of.interval[0] - 0.55498).abs() < 1e-4 && (of.interval[1] - 0.99747).abs() < 1e-4, "{of:?}");
        let none = Abx::new("room", &names, 10, 0);
        assert_eq!((none.chance, none.interval[0]), (1.0, 0.0));
        assert_eq!(Abx::new("room", &names, 10, 10).interval[1], 1.0);
    }

    #[test]
    fn items_are_counted_apart_and_together() {
        let answer = |item: &str, right| Answer::of("p", item, Trial::Abx { between: ["a".into(), "b".into()], right });
        let of = abx(&[answer("x", true), answer("x", false), answer("y", true)]);
        let counts: Vec<_> = of.iter().map(|abx| (&*abx.item, abx.trials, abx.right)).collect();
        assert_eq!(counts, [("x", 2, 1), ("y", 1, 1), ("all", 3, 2)]);
        assert!(abx(&[]).is_empty());
    }
}
