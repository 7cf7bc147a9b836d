//! How often each of several conditions was preferred to each other.

use promenade_fault::Fault;

/// Most conditions of one table.
const MOST_CONDITIONS: usize = 64;
/// Most votes between two conditions.
const MOST_VOTES: u32 = 1_000_000;

/// Votes by pairs of named conditions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Preferences {
    names: Vec<String>,
    /// Row by row: how often the row's condition was preferred to the column's.
    votes: Vec<u32>,
}

impl Preferences {
    /// No votes yet.
    ///
    /// # Errors
    /// Fewer than 2 or more than 64 names, or one twice.
    pub fn new(names: Vec<String>) -> Result<Self, Fault> {
        if !(2..=MOST_CONDITIONS).contains(&names.len()) {
            return Err(Fault::unexpected("2 to 64 conditions", names.len()));
        }
        if let Some(twice) = names.iter().enumerate().find(|(i, name)| names[..*i].contains(name)) {
            return Err(Fault::unexpected("conditions of different names", format!("{} twice", twice.1)));
        }
        let votes = vec![0; names.len() * names.len()];
        Ok(Self { names, votes })
    }

    /// Counts votes for one condition over another, by index.
    ///
    /// # Errors
    /// More than a million votes in one cell, or a condition against itself.
    ///
    /// # Panics
    /// An index beyond the conditions.
    pub fn add(&mut self, better: usize, worse: usize, votes: u32) -> Result<(), Fault> {
        assert!(better < self.names.len() && worse < self.names.len(), "a condition's index");
        let cell = &mut self.votes[better * self.names.len() + worse];
        let sum = cell.saturating_add(votes);
        if sum > MOST_VOTES || (better == worse && votes > 0) {
            let found = format!("{sum} for {} over {}", self.names[better], self.names[worse]);
            return Err(Fault::unexpected("at most 1000000 votes for a condition over another", found));
        }
        *cell = sum;
        Ok(())
    }

    /// All votes of several tables of the same conditions; none where names differ or there is no table.
    pub fn pooled(tables: &[&Self]) -> Option<Self> {
        let mut sum = Self::new(tables.first()?.names.clone()).ok()?;
        for table in tables {
            for (better, name) in table.names.iter().enumerate() {
                let row = sum.index(name)?;
                for (worse, other) in table.names.iter().enumerate() {
                    let column = sum.index(other)?;
                    sum.add(row, column, table.votes(better, worse)).ok()?;
                }
            }
        }
        tables.iter().all(|table| table.names.len() == sum.names.len()).then_some(sum)
    }

    /// The conditions.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// A condition's index.
    pub fn index(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    /// How often one condition was preferred to another, by index.
    pub fn votes(&self, better: usize, worse: usize) -> u32 {
        self.votes[better * self.names.len() + worse]
    }

    /// Votes for each condition.
    pub fn scores(&self) -> Vec<u32> {
        self.votes.chunks(self.names.len()).map(|row| row.iter().sum()).collect()
    }

    /// Judgements of a pair.
    pub fn judgements(&self, one: usize, other: usize) -> u32 {
        self.votes(one, other) + self.votes(other, one)
    }

    /// All pairs by index, each once.
    pub fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let count = self.names.len();
        (0..count).flat_map(move |one| (one + 1..count).map(move |other| (one, other)))
    }

    /// Judgements of a pair on average: the number of judges where each has judged each pair once.
    pub fn judges(&self) -> f64 {
        f64::from(self.votes.iter().sum::<u32>()) / self.pairs().count() as f64
    }

    /// Pairs that were judged another number of times than the average.
    pub fn uneven(&self) -> Vec<(usize, usize)> {
        let judges = self.judges();
        self.pairs().filter(|(one, other)| (f64::from(self.judgements(*one, *other)) - judges).abs() > 1e-9).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(list: &[&str]) -> Vec<String> {
        list.iter().map(|name| (*name).to_owned()).collect()
    }

    #[test]
    fn votes_are_counted_and_pooled_by_name() {
        let mut a = Preferences::new(names(&["x", "y", "z"])).unwrap();
        let mut b = Preferences::new(names(&["z", "y", "x"])).unwrap();
        a.add(0, 1, 3).unwrap();
        a.add(1, 0, 2).unwrap();
        b.add(2, 0, 4).unwrap();
        let sum = Preferences::pooled(&[&a, &b]).unwrap();
        assert_eq!((sum.votes(0, 1), sum.votes(0, 2), sum.judgements(0, 1)), (3, 4, 5));
        assert_eq!(sum.scores(), [7, 2, 0]);
        assert_eq!(sum.judges(), 3.0);
        assert_eq!(sum.uneven(), [(0, 1), (0, 2), (1, 2)]);
        let other = Preferences::new(names(&["x", "y"])).unwrap();
        assert!(Preferences::pooled(&[&a, &other]).is_none() && Preferences::pooled(&[&other, &a]).is_none());
    }

    #[test]
    fn what_is_no_table_is_refused() {
        assert!(Preferences::new(names(&["x"])).is_err() && Preferences::new(names(&["x", "x"])).is_err());
        let mut table = Preferences::new(names(&["x", "y"])).unwrap();
        assert!(table.add(0, 0, 1).is_err() && table.add(0, 1, 1_000_001).is_err());
        assert!(table.add(0, 1, 1_000_000).is_ok() && table.add(0, 1, 1).is_err());
    }
}
