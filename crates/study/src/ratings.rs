//! Figures of ratings, after Recommendation ITU-R BS.1534-3.

use crate::answers::{Answer, Trial, grouped};
use fastrand::Rng;
use promenade_metrics::statistics::{median, quantile};

/// Draws of persons for an interval, where those of all conditions are no more than this many ratings together ...
const DRAWS: usize = 2000;
const MOST_DRAWN: usize = 50_000_000;
/// ... and as few as this at least.
const FEWEST_DRAWS: usize = 200;
/// A hidden reference that is rated less is not heard as one.
const LEAST_REFERENCE: f64 = 90.0;
/// Share of its references above which a person's ratings are left out.
const MOST_MISSED: f64 = 0.15;

/// Ratings of a condition.
#[derive(Clone, Debug, PartialEq)]
pub struct RatedCondition {
    /// The condition.
    pub name: String,
    /// It is the hidden reference.
    pub reference: bool,
    /// All ratings, rising.
    pub ratings: Vec<f64>,
    /// Quartiles: 25, 50 and 75 %.
    pub quartiles: [f64; 3],
    /// 95 % confidence interval of the median, from 2000 draws of as many persons (fewer, 200 at least, of more than 25,000
    /// ratings); none with fewer than 3 persons.
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
}

struct Rated<'a> {
    person: (&'a str, &'a str),
    item: &'a str,
    of: &'a str,
    rating: f64,
    reference: bool,
}

/// Figures for each item and, of several, for all, and the persons that are left out, because they rated more than 15 % of
/// their hidden references below 90 (unless all are kept).
pub fn ratings(answers: &[Answer], keep_all: bool) -> (Vec<Ratings>, Vec<String>) {
    let all: Vec<Rated<'_>> = answers
        .iter()
        .filter_map(|answer| match &answer.what {
            Trial::Rating { of, rating, reference } => Some(Rated {
                person: (&answer.study, &answer.person),
                item: &answer.item,
                of,
                rating: *rating,
                reference: *reference,
            }),
            _ => None,
        })
        .collect();
    let missed = |(_, references): &(_, Vec<&Rated<'_>>)| {
        let low = references.iter().filter(|r| r.rating < LEAST_REFERENCE).count();
        low as f64 > MOST_MISSED * references.len() as f64
    };
    let persons = grouped(all.iter().filter(|r| r.reference && !keep_all), |r| r.person);
    let mut out: Vec<(&str, &str)> = persons.into_iter().filter(missed).map(|(person, _)| person).collect();
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
        let mut ratings: Vec<f64> = of.iter().map(|r| r.rating).collect();
        ratings.sort_by(f64::total_cmp);
        RatedCondition {
            name: name.to_owned(),
            reference: of.iter().any(|r| r.reference),
            quartiles: [0.25, 0.5, 0.75].map(|share| quantile(&ratings, share).unwrap_or(f64::NAN)),
            interval: interval(&of, (MOST_DRAWN / rated.len()).clamp(FEWEST_DRAWS, DRAWS)),
            mean: ratings.iter().sum::<f64>() / ratings.len() as f64,
            ratings,
        }
    };
    let mut conditions: Vec<RatedCondition> = grouped(rated.iter().copied(), |r| r.of).into_iter().map(condition).collect();
    conditions.sort_by(|a, b| b.quartiles[1].total_cmp(&a.quartiles[1]).then_with(|| a.name.cmp(&b.name)));
    Ratings { item: item.to_owned(), conditions }
}

/// Persons are drawn, not ratings: those of one person hang together.
fn interval(rated: &[&Rated<'_>], draws: usize) -> Option<[f64; 2]> {
    let persons = grouped(rated.iter(), |r| r.person);
    if persons.len() < 3 {
        return None;
    }
    let mut rng = Rng::with_seed(1);
    let mut medians: Vec<f64> = (0..draws)
        .filter_map(|_| {
            let drawn = (0..persons.len()).flat_map(|_| &persons[rng.usize(0..persons.len())].1);
            median(drawn.map(|r| r.rating))
        })
        .collect();
    medians.sort_by(f64::total_cmp);
    Some([quantile(&medians, 0.025)?, quantile(&medians, 0.975)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(person: usize, item: &str, of: &str, rating: f64) -> Answer {
        let what = Trial::Rating { of: of.into(), rating, reference: of == "truth" };
        Answer { study: "s".into(), person: person.to_string(), trial: 1, item: item.into(), what }
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
        let names: Vec<_> = found[0].conditions.iter().map(|c| (&*c.name, c.reference)).collect();
        assert_eq!(names, [("truth", true), ("good", false), ("bad", false)]);
        let good = &found[2].conditions[1];
        assert_eq!((good.ratings.len(), good.quartiles, good.mean), (40, [64.75, 69.5, 74.25], 69.5));
        let [low, high] = good.interval.unwrap();
        // The same as over one item: persons are what is drawn. The error of such a median is some 2.5.
        assert!((63.0..67.0).contains(&low) && (72.0..76.0).contains(&high), "{low} {high}");
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
        // Who rated no reference missed none.
        assert!(ratings(&[answer(1, "x", "bad", 1.0)], false).1.is_empty());
    }
}
