//! Figures of ratings, after Recommendation ITU-R BS.1534-3.

use crate::answers::{Answer, Role, Trial, grouped};
use crate::definition::MID_ANCHOR;
use crate::significance::{Differences, differences};
use promenade_metrics::statistics::quantile;
use statrs::distribution::{Binomial, ContinuousCDF, DiscreteCDF, StudentsT};

/// A hidden reference that is rated less is not heard as one, and a mid anchor that is rated more not as one.
const REFERENCE_OR_ANCHOR: f64 = 90.0;
/// Share of either above which a person's ratings are left out.
const MOST_MISSED: f64 = 0.15;

/// Ratings of a condition.
#[derive(Clone, Debug, PartialEq)]
pub struct RatedCondition {
    /// The condition.
    pub name: String,
    /// What it was.
    pub role: Role,
    /// All ratings, rising.
    pub ratings: Vec<f64>,
    /// Quartiles: 25, 50 and 75 %.
    pub quartiles: [f64; 3],
    /// 95 % confidence interval of the median over persons; none with fewer than 3 persons.
    pub interval: Option<[f64; 2]>,
    /// Mean.
    pub mean: f64,
}

/// Ratings of one item, or of all.
#[derive(Clone, Debug)]
pub struct Ratings {
    /// The item, or "all".
    pub item: String,
    /// By falling median.
    pub conditions: Vec<RatedCondition>,
    /// Whether conditions differ; none with fewer than 2 conditions, or 2 persons who rated all of them.
    pub differences: Option<Differences>,
}

struct Rated<'a> {
    person: (&'a str, &'a str),
    item: &'a str,
    of: &'a str,
    rating: f64,
    role: Role,
}

/// Figures for each item and, of several, for all, and the persons that are left out, because they rated more than 15 % of
/// their hidden references below 90, or more than 15 % of their mid anchors above (unless all are kept).
pub fn ratings(answers: &[Answer], keep_all: bool) -> (Vec<Ratings>, Vec<String>) {
    let all: Vec<Rated<'_>> = answers
        .iter()
        .filter_map(|answer| match &answer.what {
            Trial::Rating { of, rating, role } => {
                Some(Rated { person: answer.who(), item: &answer.item, of, rating: *rating, role: *role })
            }
            _ => None,
        })
        .collect();
    let missed = |rated: &[&Rated<'_>]| {
        let too_many = |of: &dyn Fn(&Rated<'_>) -> bool, wrong: &dyn Fn(f64) -> bool| {
            let of: Vec<f64> = rated.iter().filter(|r| of(r)).map(|r| r.rating).collect();
            of.iter().filter(|rating| wrong(**rating)).count() as f64 > MOST_MISSED * of.len() as f64
        };
        too_many(&|r| r.role == Role::Reference, &|rating| rating < REFERENCE_OR_ANCHOR)
            || too_many(&|r| r.role == Role::Anchor && r.of == MID_ANCHOR, &|rating| rating > REFERENCE_OR_ANCHOR)
    };
    let persons = grouped(all.iter().filter(|_| !keep_all), |r| r.person);
    let mut out: Vec<(&str, &str)> = persons.into_iter().filter(|(_, rated)| missed(rated)).map(|(person, _)| person).collect();
    out.sort_unstable();
    let kept: Vec<&Rated<'_>> = all.iter().filter(|r| out.binary_search(&r.person).is_err()).collect();
    let items = grouped(kept.iter().copied(), |r| r.item);
    let mut found: Vec<Ratings> = items.iter().map(|(item, rated)| of_item(item, rated)).collect();
    if items.len() > 1 {
        found.push(of_item("all", &kept));
    }
    (found, out.into_iter().map(|(_, person)| person.to_owned()).collect())
}

fn of_item(item: &str, rated: &[&Rated<'_>]) -> Ratings {
    let condition = |(name, of): (&str, Vec<&Rated<'_>>)| {
        let ratings = rising(of.iter().map(|r| r.rating));
        // Persons are what is drawn, not ratings: those of one person hang together.
        let persons = grouped(of.iter(), |r| r.person).into_iter();
        let medians = persons.filter_map(|(_, own)| quantile(&rising(own.iter().map(|r| r.rating)), 0.5));
        RatedCondition {
            name: name.to_owned(),
            role: of[0].role,
            quartiles: [0.25, 0.5, 0.75].map(|share| quantile(&ratings, share).unwrap_or(f64::NAN)),
            interval: interval(&rising(medians)),
            mean: ratings.iter().sum::<f64>() / ratings.len() as f64,
            ratings,
        }
    };
    let mut conditions: Vec<RatedCondition> = grouped(rated.iter().copied(), |r| r.of).into_iter().map(condition).collect();
    conditions.sort_by(|a, b| b.quartiles[1].total_cmp(&a.quartiles[1]).then_with(|| a.name.cmp(&b.name)));
    let of_conditions: Vec<_> =
        rated.iter().filter(|r| r.role == Role::Condition).map(|r| (r.person, r.of, r.rating)).collect();
    Ratings { item: item.to_owned(), conditions, differences: differences(&of_conditions) }
}

fn rising(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

/// 95 % confidence interval of the median of what rising values stand for: between order statistics, whose coverage is the
/// binomial's, interpolated (Hettmansperger and Sheather, Statistics & Probability Letters 4, 1986). Fewer than 6 have none of
/// 95 %; theirs is that of Student's t.
fn interval(rising: &[f64]) -> Option<[f64; 2]> {
    const COVERAGE: f64 = 0.95;
    let n = rising.len();
    if n < 3 {
        return None;
    }
    if n < 6 {
        let mean = rising.iter().sum::<f64>() / n as f64;
        let variance = rising.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1) as f64;
        let student = StudentsT::new(0.0, 1.0, (n - 1) as f64).ok()?.inverse_cdf(0.5 + 0.5 * COVERAGE);
        let reach = student * (variance / n as f64).sqrt();
        return Some([(mean - reach).max(0.0), (mean + reach).min(100.0)]);
    }
    let coin = Binomial::new(0.5, n as u64).ok()?;
    // Of the d-th value from either end.
    let coverage = |d: usize| 1.0 - 2.0 * coin.cdf(d as u64 - 1);
    let d = (1..n / 2).take_while(|d| coverage(*d) >= COVERAGE).last()?;
    let surplus = (coverage(d) - COVERAGE) / (coverage(d) - coverage(d + 1));
    let share = (n - d) as f64 * surplus / (d as f64 + (n - 2 * d) as f64 * surplus);
    let between = |outer: f64, inner: f64| outer + share * (inner - outer);
    Some([between(rising[d - 1], rising[d]), between(rising[n - d], rising[n - d - 1])])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(person: usize, item: &str, of: &str, rating: f64) -> Answer {
        let role = match of {
            "truth" => Role::Reference,
            MID_ANCHOR => Role::Anchor,
            _ => Role::Condition,
        };
        Answer::of(&person.to_string(), item, Trial::Rating { of: of.into(), rating, role })
    }

    #[test]
    fn medians_have_intervals_over_persons() {
        let mut answers = Vec::new();
        for person in 0..20 {
            for item in ["x", "y"] {
                answers.push(answer(person, item, "truth", 95.0));
                answers.push(answer(person, item, "good", 60.0 + person as f64));
                answers.push(answer(person, item, "bad", 10.0));
            }
        }
        let (found, out) = ratings(&answers, false);
        assert!(out.is_empty());
        assert_eq!(found.iter().map(|of| &*of.item).collect::<Vec<_>>(), ["x", "y", "all"]);
        let names: Vec<_> = found[0].conditions.iter().map(|c| (&*c.name, c.role)).collect();
        assert_eq!(names, [("truth", Role::Reference), ("good", Role::Condition), ("bad", Role::Condition)]);
        let good = &found[2].conditions[1];
        assert_eq!((good.ratings.len(), good.quartiles, good.mean), (40, [64.75, 69.5, 74.25], 69.5));
        let [low, high] = good.interval.unwrap();
        // The 6th and the 15th of 20 hold the median in 95.9 % (a table of the sign test), the 7th and the 14th in 88.5 %.
        assert!((65.0..65.5).contains(&low) && (73.5..74.0).contains(&high), "{low} {high}");
        assert_eq!(found[0].conditions[2].interval, Some([10.0, 10.0]));
    }

    #[test]
    fn who_does_not_hear_the_reference_is_left_out() {
        let mut answers: Vec<Answer> = (0..4).map(|person| answer(person, "x", "truth", 100.0)).collect();
        answers.push(answer(4, "x", "truth", 89.0));
        answers.push(answer(4, "x", "bad", 100.0));
        let (found, out) = ratings(&answers, false);
        assert_eq!((found[0].conditions.len(), out), (1, vec!["4".to_owned()]));
        let (found, out) = ratings(&answers, true);
        assert_eq!((found[0].conditions.len(), out.len()), (2, 0));
        // The mid anchor is not the best.
        let praised = [answer(5, "x", MID_ANCHOR, 95.0)];
        assert_eq!(ratings(&praised, false).1, ["5"]);
        // Who rated no reference missed none.
        assert!(ratings(&[answer(1, "x", "bad", 1.0)], false).1.is_empty());
    }

    #[test]
    fn intervals_hold_the_median_nineteen_times_in_twenty() {
        let mut rng = fastrand::Rng::with_seed(3);
        let mut person = || 50.0 + 10.0 * (0..12).map(|_| rng.f64() - 0.5).sum::<f64>();
        for persons in [3, 5, 8, 20] {
            let mut holds =
                || interval(&rising((0..persons).map(|_| person()))).is_some_and(|[low, high]| low <= 50.0 && 50.0 <= high);
            let share = (0..5000).filter(|_| holds()).count() as f64 / 5000.0;
            assert!((0.93..0.97).contains(&share), "{persons} persons: {share}");
        }
    }
}
