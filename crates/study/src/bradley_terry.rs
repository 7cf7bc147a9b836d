//! Strengths of conditions by the model that i is preferred to j with the chance 1 / (1 + exp(l_j - l_i)) (Bradley and Terry,
//! Biometrika 39, 1952).

use crate::preferences::Preferences;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// Newton steps.
const STEPS: usize = 100;

/// A condition's strength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strength {
    /// Logarithm of the strength, the mean of all conditions 0.
    pub log: f64,
    /// Its standard error.
    pub error: f64,
    /// Its 95 % confidence interval.
    pub interval: [f64; 2],
}

/// Strengths of all conditions of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Strengths {
    /// In the table's order.
    pub of: Vec<Strength>,
    /// The intervals allow for several votes of one person being alike.
    pub by_person: bool,
}

impl Strengths {
    /// Of a table. With the tables of its persons, whose sum it is, the errors are those of votes that hang together by person
    /// (a sandwich estimate, Liang and Zeger 1986) and the intervals those of Student's t, with a degree of freedom less than
    /// persons; without them, or where all persons say the same of a condition, those of independent votes. None where the
    /// likelihood has no maximum: where some conditions were never preferred to the others (Ford 1957).
    pub fn new(votes: &Preferences, persons: &[Preferences]) -> Option<Self> {
        if !connected(votes) {
            return None;
        }
        let t = votes.names().len();
        let mut log = DVector::zeros(t);
        let mut inverse = DMatrix::zeros(t, t);
        for _ in 0..STEPS {
            inverse = (information(votes, &log) + level(t)).try_inverse()?;
            let step = &inverse * gradient(votes, &log);
            // Strengths far apart need short steps.
            let longest = step.amax();
            log += &step * (1.0_f64.min(2.0 / longest.max(1e-300)));
            if longest < 1e-12 {
                break;
            }
        }
        // Strengths have no level: what was added to the information is taken off the covariance.
        let independent = inverse - level(t);
        let by_person = persons.len() > 1;
        let between = by_person.then(|| {
            let meat = persons.iter().fold(DMatrix::zeros(t, t), |sum, person| {
                let slope = gradient(person, &log);
                sum + &slope * slope.transpose()
            });
            let few = persons.len() as f64 / (persons.len() - 1) as f64;
            &independent * meat * &independent * few
        });
        let normal = Normal::standard().inverse_cdf(0.975);
        let student = StudentsT::new(0.0, 1.0, persons.len().saturating_sub(1).max(1) as f64).ok()?.inverse_cdf(0.975);
        let of = (0..t).map(|i| {
            let of_votes = independent[(i, i)].max(0.0);
            let of_persons = between.as_ref().map(|between| between[(i, i)]).filter(|v| *v > 1e-9 * of_votes);
            let (error, reach) = of_persons.map_or((of_votes.sqrt(), normal), |v| (v.sqrt(), student));
            Strength { log: log[i], error, interval: [log[i] - reach * error, log[i] + reach * error] }
        });
        Some(Self { of: of.collect(), by_person })
    }
}

/// 1 / t everywhere: the one direction that votes say nothing of.
fn level(t: usize) -> DMatrix<f64> {
    DMatrix::from_element(t, t, 1.0 / t as f64)
}

fn chance(log: &DVector<f64>, better: usize, worse: usize) -> f64 {
    1.0 / (1.0 + (log[worse] - log[better]).exp())
}

fn gradient(votes: &Preferences, log: &DVector<f64>) -> DVector<f64> {
    let mut slope = DVector::zeros(log.len());
    for (i, j) in votes.pairs() {
        let more = f64::from(votes.votes(i, j)) - f64::from(votes.judgements(i, j)) * chance(log, i, j);
        slope[i] += more;
        slope[j] -= more;
    }
    slope
}

fn information(votes: &Preferences, log: &DVector<f64>) -> DMatrix<f64> {
    let mut sum = DMatrix::zeros(log.len(), log.len());
    for (i, j) in votes.pairs() {
        let weight = f64::from(votes.judgements(i, j)) * chance(log, i, j) * chance(log, j, i);
        for (row, column, sign) in [(i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)] {
            sum[(row, column)] += sign * weight;
        }
    }
    sum
}

/// Whether from each condition a chain of votes leads to each other.
fn connected(votes: &Preferences) -> bool {
    let t = votes.names().len();
    let reaches_all = |leads: &dyn Fn(usize, usize) -> bool| {
        let (mut seen, mut open) = (vec![false; t], vec![0]);
        seen[0] = true;
        while let Some(from) = open.pop() {
            for (to, seen) in seen.iter_mut().enumerate() {
                if !*seen && leads(from, to) {
                    *seen = true;
                    open.push(to);
                }
            }
        }
        seen.iter().all(|s| *s)
    };
    reaches_all(&|from, to| votes.votes(from, to) > 0) && reaches_all(&|from, to| votes.votes(to, from) > 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(votes: &[[u32; 3]; 3]) -> Preferences {
        let mut table = Preferences::new(["a", "b", "c"].map(str::to_owned).to_vec()).unwrap();
        for (i, row) in votes.iter().enumerate() {
            for (j, count) in row.iter().enumerate() {
                table.add(i, j, *count).unwrap();
            }
        }
        table
    }

    #[test]
    fn votes_of_the_model_give_back_its_strengths() {
        // Strengths 4, 2, 1: chances 2 / 3, 4 / 5, 2 / 3.
        let strengths = Strengths::new(&table(&[[0, 200, 240], [100, 0, 200], [60, 100, 0]]), &[]).unwrap();
        for (strength, expected) in strengths.of.iter().zip([2.0_f64.ln(), 0.0, -(2.0_f64.ln())]) {
            assert!((strength.log - expected).abs() < 1e-9, "{strengths:?}");
            assert!(strength.interval[0] < expected && expected < strength.interval[1]);
        }
        assert!(!strengths.by_person);
    }

    #[test]
    fn two_conditions_have_the_error_of_a_share() {
        let mut two = Preferences::new(vec!["a".into(), "b".into()]).unwrap();
        two.add(0, 1, 30).unwrap();
        two.add(1, 0, 10).unwrap();
        let of = Strengths::new(&two, &[]).unwrap().of;
        // The difference is ln 3 with the error sqrt(1 / 30 + 1 / 10), each condition's half of that.
        assert!((of[0].log - 3.0_f64.ln() / 2.0).abs() < 1e-9);
        assert!((of[0].error - (1.0 / 30.0 + 0.1_f64).sqrt() / 2.0).abs() < 1e-9, "{of:?}");
    }

    #[test]
    fn votes_that_repeat_a_persons_first_count_once() {
        let each = [[0, 4, 4], [0, 0, 4], [0, 0, 0]];
        let other = [[0, 0, 4], [4, 0, 0], [0, 4, 0]];
        let persons = [table(&each), table(&each), table(&other), table(&each)];
        let all = Preferences::pooled(&persons.iter().collect::<Vec<_>>()).unwrap();
        let [alone, together] = [Strengths::new(&all, &[]).unwrap(), Strengths::new(&all, &persons).unwrap()];
        assert!(together.by_person && together.of[0].error > 1.5 * alone.of[0].error, "{together:?} {alone:?}");
        assert_eq!(together.of[0].log, alone.of[0].log);
    }

    #[test]
    fn persons_of_one_mind_leave_an_interval() {
        let same = table(&[[0, 3, 4], [1, 0, 3], [1, 1, 0]]);
        let all = Preferences::pooled(&[&same; 5]).unwrap();
        let together = Strengths::new(&all, &vec![same; 5]).unwrap();
        assert_eq!(together.of, Strengths::new(&all, &[]).unwrap().of);
    }

    /// How often intervals hold the strengths of all persons whom those who voted stand for.
    #[test]
    fn intervals_hold_the_truth_nineteen_times_in_twenty() {
        let mut rng = fastrand::Rng::with_seed(5);
        let mut person =
            |spread: f64| [0.6, 0.1, -0.7].map(|mean| mean + spread * (0..12).map(|_| rng.f64() - 0.5).sum::<f64>());
        let chances = |of: [f64; 3]| [(0, 1), (0, 2), (1, 2)].map(|(i, j): (usize, usize)| 1.0 / (1.0 + (of[j] - of[i]).exp()));
        let of_shares = |shares: [u32; 3], whole: u32| {
            let [a, b, c] = shares;
            table(&[[0, a, b], [whole - a, 0, c], [whole - b, whole - c, 0]])
        };
        let many: Vec<[f64; 3]> = (0..40_000).map(|_| chances(person(0.5))).collect();
        let truth = [0, 1, 2].map(|p| (1e6 * many.iter().map(|c| c[p]).sum::<f64>() / many.len() as f64) as u32);
        let truth = Strengths::new(&of_shares(truth, 1_000_000), &[]).unwrap();
        let mut coin = fastrand::Rng::with_seed(6);
        for persons in [3, 5, 8, 20] {
            let (mut held, mut all) = (0, 0);
            for _ in 0..1500 {
                let tables: Vec<Preferences> = (0..persons)
                    .map(|_| of_shares(chances(person(0.5)).map(|c| (0..8).filter(|_| coin.f64() < c).count() as u32), 8))
                    .collect();
                let sum = Preferences::pooled(&tables.iter().collect::<Vec<_>>()).unwrap();
                let Some(found) = Strengths::new(&sum, &tables) else { continue };
                let holds = |(s, t): &(&Strength, &Strength)| (s.interval[0]..s.interval[1]).contains(&t.log);
                held += found.of.iter().zip(&truth.of).filter(holds).count();
                all += 3;
            }
            let share = held as f64 / all as f64;
            assert!((0.93..0.97).contains(&share), "{persons} persons: {share}");
        }
    }

    #[test]
    fn who_always_wins_has_no_strength() {
        assert!(Strengths::new(&table(&[[0, 5, 5], [0, 0, 3], [0, 2, 0]]), &[]).is_none());
        assert!(Strengths::new(&table(&[[0, 5, 5], [0, 0, 3], [1, 2, 0]]), &[]).is_some());
    }
}
