//! What each person did: how much, how long, and how far it agrees.

use crate::answers::{Answer, Trial, grouped};
use std::collections::HashMap;

/// One person of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct Person {
    /// The name.
    pub name: String,
    /// Trials that were answered.
    pub trials: usize,
    /// Minutes that they took.
    pub minutes: f64,
    /// Whether the headphone check was passed; none where there was none.
    pub headphones: Option<bool>,
    /// Share of all two votes on one pair that are alike; none without repeats.
    pub with_self: Option<f64>,
    /// Share of votes that are those of most others; none where no other person judged a pair.
    pub with_others: Option<f64>,
    /// Correlation of ratings with the mean ratings of the others (Pearson); none of fewer than 3.
    pub correlation: Option<f64>,
}

/// What was compared: version, part, item and the two conditions; of ratings the condition twice.
type What<'a> = (&'a str, u32, &'a str, [&'a str; 2]);

/// A vote, 1 for the first of the two, or a rating.
fn value(answer: &Answer) -> Option<(What<'_>, f64)> {
    let (between, value) = match &answer.what {
        Trial::Paired { better, worse } if better < worse => ([better, worse], 1.0),
        Trial::Paired { better, worse } => ([worse, better], 0.0),
        Trial::Rating { of, rating, .. } => ([of, of], *rating),
        _ => return None,
    };
    Some(((&answer.version, answer.part, &answer.item, between.map(String::as_str)), value))
}

/// All persons, in the order in which they come.
pub fn persons(answers: &[Answer]) -> Vec<Person> {
    let mut sums: HashMap<What<'_>, (f64, f64)> = HashMap::new();
    for (what, value) in answers.iter().filter_map(value) {
        let sum = sums.entry(what).or_default();
        *sum = (sum.0 + value, sum.1 + 1.0);
    }
    grouped(answers.iter(), |answer| answer.who()).into_iter().map(|((_, name), own)| person(name, &own, &sums)).collect()
}

fn person(name: &str, own: &[&Answer], sums: &HashMap<What<'_>, (f64, f64)>) -> Person {
    let trials = grouped(own.iter(), |answer| (&*answer.version, answer.trial));
    let (mut alike, mut twice) = (0.0, 0.0);
    let (mut with, mut votes) = (0.0, 0.0);
    let mut ratings = Vec::new();
    for (what, values) in grouped(own.iter().filter_map(|answer| value(answer)), |(what, _)| *what) {
        let (n, sum) = (values.len() as f64, values.iter().map(|(_, value)| value).sum::<f64>());
        let (all, count) = sums[&what];
        let others = (count > n).then(|| (all - sum) / (count - n));
        if what.3[0] == what.3[1] {
            ratings.extend(others.map(|others| (sum / n, others)));
            continue;
        }
        alike += sum * (sum - 1.0) + (n - sum) * (n - sum - 1.0);
        twice += n * (n - 1.0);
        if let Some(others) = others {
            with += if others > 0.5 {
                sum
            } else if others < 0.5 {
                n - sum
            } else {
                n / 2.0
            };
            votes += n;
        }
    }
    let share = |part: f64, whole: f64| (whole > 0.0).then(|| part / whole);
    Person {
        name: name.to_owned(),
        trials: trials.len(),
        minutes: trials.iter().map(|(_, answers)| answers[0].seconds).sum::<f64>() / 60.0,
        headphones: own.iter().find_map(|answer| answer.headphones),
        with_self: share(alike, twice),
        with_others: share(with, votes),
        correlation: correlation(&ratings),
    }
}

fn correlation(pairs: &[(f64, f64)]) -> Option<f64> {
    let n = pairs.len() as f64;
    let (x, y) = pairs.iter().fold((0.0, 0.0), |(x, y), (a, b)| (x + a / n, y + b / n));
    let sum = |of: &dyn Fn(f64, f64) -> f64| pairs.iter().map(|(a, b)| of(a - x, b - y)).sum::<f64>();
    let spread = (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt();
    (pairs.len() > 2 && spread > 0.0).then(|| sum(&|a, b| a * b) / spread)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answers::Role;

    #[test]
    fn persons_agree_with_themselves_and_with_others() {
        let vote = |person: &str, trial, better: &str, worse: &str| {
            let what = Trial::Paired { better: better.into(), worse: worse.into() };
            Answer { trial, ..Answer::of(person, "hall", what) }
        };
        let rating = |person: &str, of: &str, rating| {
            let what = Trial::Rating { of: of.into(), rating, role: Role::Condition };
            Answer { trial: 9, ..Answer::of(person, "hall", what) }
        };
        let mut answers = vec![
            vote("p", 1, "x", "y"),
            vote("p", 2, "x", "y"),
            vote("q", 1, "x", "y"),
            vote("q", 2, "y", "x"),
            vote("r", 1, "x", "y"),
        ];
        for (of, value) in [("x", 10.0), ("y", 20.0), ("z", 40.0)] {
            answers.extend([rating("p", of, value), rating("q", of, 90.0 - value)]);
        }
        let found = persons(&answers);
        let of = |i: usize| (found[i].with_self, found[i].with_others, found[i].trials);
        assert_eq!([of(0), of(1), of(2)], [(Some(1.0), Some(1.0), 3), (Some(0.0), Some(0.5), 3), (None, Some(1.0), 1),]);
        assert!((found[0].correlation.unwrap() + 1.0).abs() < 1e-12 && found[2].correlation.is_none(), "{found:?}");
    }
}
