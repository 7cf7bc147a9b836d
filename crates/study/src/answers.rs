//! Answers, one a line.

use std::collections::HashMap;
use std::hash::Hash;

/// Columns of a file of answers.
pub const HEADER: [&str; 14] =
    ["study", "person", "time", "trial", "method", "item", "a", "b", "x", "answer", "rating", "role", "seconds", "headphones"];

/// How sounds are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Method {
    /// Which of two is nearer to the reference.
    Paired,
    /// Which of two the third is.
    Abx,
    /// How good each is, 0 to 100.
    Rating,
}

impl Method {
    /// By its name in files.
    pub fn by_name(name: &str) -> Option<Self> {
        [Self::Paired, Self::Abx, Self::Rating].into_iter().find(|method| method.name() == name)
    }

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paired => "paired",
            Self::Abx => "abx",
            Self::Rating => "rating",
        }
    }
}

/// What was played and what was said of it, conditions by name.
#[derive(Clone, Debug, PartialEq)]
pub enum Trial {
    /// Two conditions, and which was preferred.
    Paired {
        /// The one that was chosen.
        better: String,
        /// The other.
        worse: String,
    },
    /// Whether X was told.
    Abx {
        /// The two conditions, by name rising.
        between: [String; 2],
        /// X was named as what it was.
        right: bool,
    },
    /// A rating.
    Rating {
        /// The condition.
        of: String,
        /// 0 to 100.
        rating: f64,
        /// It was the hidden reference.
        reference: bool,
    },
}

/// A line.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The study's name.
    pub study: String,
    /// A name by chance for who answered.
    pub person: String,
    /// Number of the trial in the order in which the person had them.
    pub trial: u32,
    /// What was listened to.
    pub item: String,
    /// What was said.
    pub what: Trial,
}

impl Answer {
    /// Of a line's cells, in the order of [`HEADER`].
    ///
    /// # Errors
    /// What was expected and what was found.
    pub fn parse(cells: &[&str]) -> Result<Self, (String, String)> {
        let &[study, person, _, trial, method, item, a, b, x, answer, rating, role, ..] = cells else {
            return Err((format!("{} cells", HEADER.len()), cells.len().to_string()));
        };
        if cells.len() != HEADER.len() {
            return Err((format!("{} cells", HEADER.len()), cells.len().to_string()));
        }
        let wrong = |expected: &str, found: &str| Err((expected.to_owned(), format!("{found:?}")));
        let Ok(trial) = trial.parse() else { return wrong("a trial's number", trial) };
        if person.is_empty() || item.is_empty() || a.is_empty() {
            return wrong("a person, an item and a condition", &format!("{person},{item},{a}"));
        }
        let two = [a, b];
        let what = match Method::by_name(method) {
            Some(Method::Paired) if a != b && two.contains(&answer) => {
                let other = if answer == a { b } else { a };
                Trial::Paired { better: answer.to_owned(), worse: other.to_owned() }
            }
            Some(Method::Abx) if a != b && two.contains(&answer) && two.contains(&x) => {
                let mut between = two.map(str::to_owned);
                between.sort();
                Trial::Abx { between, right: answer == x }
            }
            Some(Method::Rating) => match rating.parse() {
                Ok(rating) if (0.0..=100.0).contains(&rating) => {
                    Trial::Rating { of: a.to_owned(), rating, reference: role == "reference" }
                }
                _ => return wrong("a rating from 0 to 100", rating),
            },
            Some(_) => return wrong("two conditions, and an answer that is one of them", &format!("{a},{b},{x},{answer}")),
            None => return wrong("paired, abx or rating", method),
        };
        Ok(Self { study: study.to_owned(), person: person.to_owned(), trial, item: item.to_owned(), what })
    }

    /// What tells it from other answers of the study.
    fn key(&self) -> (String, String, u32, String) {
        let of = if let Trial::Rating { of, .. } = &self.what { of.clone() } else { String::new() };
        (self.study.clone(), self.person.clone(), self.trial, of)
    }
}

/// All answers, each once.
#[derive(Clone, Debug, Default)]
pub struct Answers {
    list: Vec<Answer>,
    by_key: HashMap<(String, String, u32, String), usize>,
    /// Answers that came again as they were: a page sends again what it is not sure of.
    pub repeated: usize,
    /// Answers that came again otherwise; the first is kept.
    pub contradicted: usize,
}

impl Answers {
    /// Takes one more.
    pub fn add(&mut self, answer: Answer) {
        match self.by_key.get(&answer.key()) {
            Some(first) if self.list[*first] == answer => self.repeated += 1,
            Some(_) => self.contradicted += 1,
            None => {
                self.by_key.insert(answer.key(), self.list.len());
                self.list.push(answer);
            }
        }
    }

    /// In the order of files and lines.
    pub fn list(&self) -> &[Answer] {
        &self.list
    }

    /// How many persons answered.
    pub fn persons(&self) -> usize {
        let mut persons: Vec<(&str, &str)> = self.list.iter().map(|a| (&*a.study, &*a.person)).collect();
        persons.sort_unstable();
        persons.dedup();
        persons.len()
    }
}

/// Distinct values in the order in which they first come.
pub(crate) fn distinct<'a>(values: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut seen = std::collections::HashSet::new();
    values.filter(|value| seen.insert(*value)).map(str::to_owned).collect()
}

/// Lists of what has one key, in the order in which the keys first come.
pub(crate) fn grouped<K: Copy + Eq + Hash, T>(all: impl Iterator<Item = T>, key: impl Fn(&T) -> K) -> Vec<(K, Vec<T>)> {
    let (mut groups, mut places) = (Vec::new(), HashMap::new());
    for one in all {
        let key = key(&one);
        let place = *places.entry(key).or_insert_with(|| {
            groups.push((key, Vec::new()));
            groups.len() - 1
        });
        groups[place].1.push(one);
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAIRED: &str = "s,p,t,1,paired,room,Mix,Sal,,Sal,,,9.5,passed";

    fn parse(line: &str) -> Result<Answer, (String, String)> {
        Answer::parse(&line.split(',').collect::<Vec<_>>())
    }

    #[test]
    fn lines_are_answers() {
        let paired = parse(PAIRED).unwrap();
        assert_eq!(paired.what, Trial::Paired { better: "Sal".into(), worse: "Mix".into() });
        assert_eq!((paired.trial, &*paired.item), (1, "room"));
        let abx = parse("s,p,t,2,abx,room,Mix,Dry,Dry,Dry,,,9.5,passed").unwrap();
        assert_eq!(abx.what, Trial::Abx { between: ["Dry".into(), "Mix".into()], right: true });
        let rating = parse("s,p,t,3,rating,room,Mix,,,,71.5,,9.5,passed").unwrap();
        assert_eq!(rating.what, Trial::Rating { of: "Mix".into(), rating: 71.5, reference: false });
    }

    #[test]
    fn lines_that_say_nothing_are_refused() {
        for line in [
            "s,p,t,1,paired,room,Mix,Sal,,Uni,,,9.5,passed",
            "s,p,t,1,paired,room,Mix,Mix,,Mix,,,9.5,passed",
            "s,p,t,one,paired,room,Mix,Sal,,Sal,,,9.5,passed",
            "s,p,t,1,abx,room,Mix,Dry,Wet,Dry,,,9.5,passed",
            "s,p,t,1,rating,room,Mix,,,,101,,9.5,passed",
            "s,p,t,1,rating,room,Mix,,,,NaN,,9.5,passed",
            "s,p,t,1,guess,room,Mix,,,,1,,9.5,passed",
            "s,,t,1,rating,room,Mix,,,,1,,9.5,passed",
            "s,p,t,1,rating,room,Mix",
            "s,p,t,1,rating,room,Mix,,,,1,,9.5,passed,more",
        ] {
            assert!(parse(line).is_err(), "{line}");
        }
    }

    #[test]
    fn what_comes_twice_counts_once() {
        let mut answers = Answers::default();
        let first = parse(PAIRED).unwrap();
        let mut other = first.clone();
        other.what = Trial::Paired { better: "Mix".into(), worse: "Sal".into() };
        let mut later = first.clone();
        later.trial = 2;
        for answer in [&first, &first, &other, &later] {
            answers.add(answer.clone());
        }
        assert_eq!((answers.list().len(), answers.repeated, answers.contradicted, answers.persons()), (2, 1, 1, 1));
        assert_eq!(answers.list()[0], first);
    }
}
