//! Answers, one a line.

use std::collections::HashMap;
use std::hash::Hash;

/// Columns of a file of answers.
pub const HEADER: [&str; 16] = [
    "study",
    "version",
    "person",
    "time",
    "trial",
    "part",
    "method",
    "item",
    "a",
    "b",
    "x",
    "answer",
    "rating",
    "role",
    "seconds",
    "headphones",
];

/// How sounds are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Method {
    /// Which of two is nearer to the reference.
    Paired,
    /// Which of two the third is.
    Abx,
    /// How good each is, 0 to 100.
    Rating,
    /// A question beside the sounds.
    Question,
}

impl Method {
    /// By its name in files.
    pub fn by_name(name: &str) -> Option<Self> {
        [Self::Paired, Self::Abx, Self::Rating, Self::Question].into_iter().find(|method| method.name() == name)
    }

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paired => "paired",
            Self::Abx => "abx",
            Self::Rating => "rating",
            Self::Question => "question",
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
    /// Neither of two was preferred.
    Tie {
        /// The two conditions, by name rising.
        between: [String; 2],
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
        /// What it was.
        role: Role,
    },
    /// What was said to a question beside the sounds.
    Said(String),
}

/// What was rated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A condition of the study.
    Condition,
    /// The hidden reference.
    Reference,
    /// A hidden anchor.
    Anchor,
}

/// A line.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The study's name.
    pub study: String,
    /// The version of the study, which tells what was asked; empty in files that have none.
    pub version: String,
    /// A name by chance for who answered.
    pub person: String,
    /// Number of the trial in the order in which the person had them.
    pub trial: u32,
    /// The part of the study, from 1; 0 in files that have none.
    pub part: u32,
    /// What was listened to.
    pub item: String,
    /// What was said.
    pub what: Trial,
    /// Seconds that the trial took; 0 where that is not known.
    pub seconds: f64,
    /// Whether the person passed the headphone check, where there was one.
    pub headphones: Option<bool>,
}

impl Answer {
    /// Of a line's cells, in the order of [`HEADER`].
    ///
    /// # Errors
    /// What was expected and what was found.
    pub fn parse(cells: &[&str]) -> Result<Self, (String, String)> {
        let &[study, version, person, _, trial, part, method, item, a, b, x, answer, rating, role, seconds, headphones] = cells
        else {
            return Err((format!("{} cells", HEADER.len()), cells.len().to_string()));
        };
        let wrong = |expected: &str, found: &str| Err((expected.to_owned(), format!("{found:?}")));
        let Ok(trial) = trial.parse() else { return wrong("a trial's number", trial) };
        let Some(part) = (if part.is_empty() { Some(0) } else { part.parse().ok() }) else {
            return wrong("a part's number", part);
        };
        let kind = Method::by_name(method);
        if person.is_empty() || item.is_empty() || (a.is_empty() && kind != Some(Method::Question)) {
            return wrong("a person, an item and a condition", &format!("{person},{item},{a}"));
        }
        let two = [a, b];
        let mut between = two.map(str::to_owned);
        between.sort();
        let what = match kind {
            Some(Method::Question) => Trial::Said(answer.to_owned()),
            Some(Method::Paired) if a != b && !b.is_empty() && answer.is_empty() => Trial::Tie { between },
            Some(Method::Paired) if a != b && two.contains(&answer) => {
                let other = if answer == a { b } else { a };
                Trial::Paired { better: answer.to_owned(), worse: other.to_owned() }
            }
            Some(Method::Abx) if a != b && two.contains(&answer) && two.contains(&x) => {
                Trial::Abx { between, right: answer == x }
            }
            Some(Method::Rating) => match rating.parse() {
                Ok(rating) if (0.0..=100.0).contains(&rating) => {
                    let role = match role {
                        "reference" => Role::Reference,
                        "anchor" => Role::Anchor,
                        _ => Role::Condition,
                    };
                    Trial::Rating { of: a.to_owned(), rating, role }
                }
                _ => return wrong("a rating from 0 to 100", rating),
            },
            Some(_) => return wrong("two conditions, and an answer that is one of them", &format!("{a},{b},{x},{answer}")),
            None => return wrong("paired, abx, rating or question", method),
        };
        let [study, version, person, item] = [study, version, person, item].map(str::to_owned);
        let seconds = seconds.parse().ok().filter(|s: &f64| (0.0..1e6).contains(s)).unwrap_or(0.0);
        let headphones = ["failed", "passed"].iter().position(|said| *said == headphones).map(|at| at == 1);
        Ok(Self { study, version, person, trial, part, item, what, seconds, headphones })
    }

    /// What tells it from other answers of the study.
    fn key(&self) -> Key {
        let of = match &self.what {
            Trial::Rating { of, .. } => of,
            Trial::Said(_) => &self.item,
            _ => "",
        };
        (self.study.clone(), self.version.clone(), self.person.clone(), self.trial, of.to_owned())
    }

    #[cfg(test)]
    pub(crate) fn of(person: &str, item: &str, what: Trial) -> Self {
        let [study, version, person, item] = ["s", "v", person, item].map(str::to_owned);
        Self { study, version, person, trial: 1, part: 1, item, what, seconds: 1.0, headphones: None }
    }

    /// Who answered.
    pub(crate) fn who(&self) -> (&str, &str) {
        (&self.study, &self.person)
    }
}

type Key = (String, String, String, u32, String);

/// All answers, each once.
#[derive(Clone, Debug, Default)]
pub struct Answers {
    list: Vec<Answer>,
    by_key: HashMap<Key, usize>,
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
        grouped(self.list.iter(), |answer| answer.who()).len()
    }

    /// Answers by version and part, parts rising; those to questions beside the sounds are in none.
    pub fn parts(&self) -> Vec<(&str, u32, Vec<Answer>)> {
        let sounds = self.list.iter().filter(|answer| !matches!(answer.what, Trial::Said(_)));
        let parts = grouped(sounds, |answer| (&*answer.version, answer.part)).into_iter();
        let mut parts: Vec<_> =
            parts.map(|((version, part), list)| (version, part, list.into_iter().cloned().collect())).collect();
        parts.sort_by_key(|(_, part, _)| *part);
        parts
    }

    /// Questions beside the sounds, with how often each answer was given.
    pub fn said(&self) -> Vec<(String, Vec<(String, usize)>)> {
        let said = self.list.iter().filter_map(|answer| match &answer.what {
            Trial::Said(text) => Some((&*answer.item, &**text)),
            _ => None,
        });
        let count = |(text, list): (&str, Vec<(&str, &str)>)| (text.to_owned(), list.len());
        let of = |list: Vec<(_, _)>| grouped(list.into_iter(), |(_, text)| *text).into_iter().map(count).collect();
        grouped(said, |(item, _)| *item).into_iter().map(|(item, list)| (item.to_owned(), of(list))).collect()
    }

    /// Takes out what persons answered who failed the headphone check; gives their names.
    pub fn leave_out_failed(&mut self) -> Vec<String> {
        let (failed, rest): (Vec<_>, Vec<_>) = grouped(self.list.iter(), |answer| answer.who())
            .into_iter()
            .partition(|(_, answers)| answers.iter().any(|answer| answer.headphones == Some(false)));
        let names = failed.iter().map(|((_, person), _)| (*person).to_owned()).collect();
        let list: Vec<Answer> = rest.into_iter().flat_map(|(_, answers)| answers).cloned().collect();
        self.by_key = list.iter().enumerate().map(|(at, answer)| (answer.key(), at)).collect();
        self.list = list;
        names
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

    const PAIRED: &str = "s,v,p,t,1,1,paired,room,Mix,Sal,,Sal,,,9.5,passed";

    fn parse(line: &str) -> Result<Answer, (String, String)> {
        Answer::parse(&line.split(',').collect::<Vec<_>>())
    }

    #[test]
    fn lines_are_answers() {
        let paired = parse(PAIRED).unwrap();
        assert_eq!(paired.what, Trial::Paired { better: "Sal".into(), worse: "Mix".into() });
        assert_eq!((paired.trial, &*paired.item), (1, "room"));
        let abx = parse("s,v,p,t,2,1,abx,room,Mix,Dry,Dry,Dry,,,9.5,passed").unwrap();
        assert_eq!(abx.what, Trial::Abx { between: ["Dry".into(), "Mix".into()], right: true });
        let rating = parse("s,v,p,t,3,1,rating,room,Mix,,,,71.5,,9.5,passed").unwrap();
        assert_eq!(rating.what, Trial::Rating { of: "Mix".into(), rating: 71.5, role: Role::Condition });
    }

    #[test]
    fn lines_that_say_nothing_are_refused() {
        for line in [
            "s,v,p,t,1,1,paired,room,Mix,Sal,,Uni,,,9.5,passed",
            "s,v,p,t,1,one,paired,room,Mix,Sal,,Sal,,,9.5,passed",
            "s,v,p,t,1,1,paired,room,Mix,Mix,,Mix,,,9.5,passed",
            "s,v,p,t,one,1,paired,room,Mix,Sal,,Sal,,,9.5,passed",
            "s,v,p,t,1,1,abx,room,Mix,Dry,Wet,Dry,,,9.5,passed",
            "s,v,p,t,1,1,rating,room,Mix,,,,101,,9.5,passed",
            "s,v,p,t,1,1,rating,room,Mix,,,,NaN,,9.5,passed",
            "s,v,p,t,1,1,guess,room,Mix,,,,1,,9.5,passed",
            "s,v,,t,1,1,rating,room,Mix,,,,1,,9.5,passed",
            "s,v,p,t,1,1,rating,room,Mix",
            "s,v,p,t,1,1,rating,room,Mix,,,,1,,9.5,passed,more",
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
