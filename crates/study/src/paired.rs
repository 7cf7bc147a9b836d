//! Figures of paired comparisons.

use crate::agreement::{Agreement, consistency};
use crate::answers::{Answer, Trial, distinct, grouped};
use crate::bradley_terry::Strengths;
use crate::preferences::Preferences;
use crate::range::{LeastDifference, LeastDifferences};
use promenade_fault::Fault;

/// Cells of all persons' tables together: 256 MiB.
const MOST_CELLS: usize = 1 << 26;

/// What judges said of one item's conditions, or of those of all items.
#[derive(Clone, Debug)]
pub struct PairedItem {
    /// The item.
    pub name: String,
    /// The votes.
    pub votes: Preferences,
    /// Judges' agreement; none with fewer than two.
    pub agreement: Option<Agreement>,
    /// Mean consistency of the persons, and how many judged each pair once; none in tables, which do not tell persons apart.
    pub consistency: Option<(f64, usize)>,
    /// The least significant difference of two scores.
    pub least: LeastDifference,
    /// Strengths; none where there are no finite ones.
    pub strengths: Option<Strengths>,
}

/// All items, and them together.
#[derive(Clone, Debug)]
pub struct Paired {
    /// Each item.
    pub items: Vec<PairedItem>,
    /// The votes of all items; none where there is one item, or where items have other conditions.
    pub all: Option<PairedItem>,
    /// Means over the items of u, chi2 and zeta, as Harvey et al. print them beside the sums of votes.
    pub means: Option<(f64, f64, Option<f64>)>,
}

impl PairedItem {
    fn new(name: String, votes: Preferences, persons: &[Preferences], least: &mut LeastDifferences) -> Self {
        let zetas: Vec<f64> = persons.iter().filter_map(consistency).collect();
        Self {
            agreement: Agreement::new(&votes),
            consistency: (!zetas.is_empty()).then(|| (zetas.iter().sum::<f64>() / zetas.len() as f64, zetas.len())),
            least: least.of(votes.names().len(), votes.judges()),
            strengths: Strengths::new(&votes, persons),
            name,
            votes,
        }
    }
}

/// Figures of tables and of the paired comparisons among answers; none where there are no such.
///
/// # Errors
/// More conditions or votes than a table holds.
pub fn paired(tables: &[(String, Preferences)], answers: &[Answer]) -> Result<Option<Paired>, Fault> {
    let mut items: Vec<(String, Preferences, Vec<Preferences>)> =
        tables.iter().map(|(name, votes)| (name.clone(), votes.clone(), Vec::new())).collect();
    let of_pairs: Vec<(&Answer, &str, &str)> = answers
        .iter()
        .filter_map(|answer| match &answer.what {
            Trial::Paired { better, worse } => Some((answer, &**better, &**worse)),
            _ => None,
        })
        .collect();
    let mut cells = 0_usize;
    for (item, here) in grouped(of_pairs.iter().copied(), |(answer, ..)| &*answer.item) {
        let mut names = distinct(here.iter().flat_map(|(_, better, worse)| [*better, *worse]));
        names.sort();
        let mut votes = Preferences::new(names)?;
        // Both names are in the table that was made of them.
        for (i, j) in
            here.iter().filter_map(|(_, better, worse)| votes.index(better).zip(votes.index(worse))).collect::<Vec<_>>()
        {
            votes.add(i, j, 1)?;
        }
        let persons = of_persons(&votes, &here, &mut cells)?;
        items.push((item.to_owned(), votes, persons));
    }
    let tables: Vec<&Preferences> = items.iter().map(|(_, votes, _)| votes).collect();
    let pooled = if tables.len() > 1 { Preferences::pooled(&tables) } else { None };
    let by_person = pooled.as_ref().map(|sum| of_persons(sum, &of_pairs, &mut cells)).transpose()?;
    let mut least = LeastDifferences::new();
    let all = pooled.map(|sum| {
        // Persons tell nothing of votes that tables hold.
        let whole = items.iter().all(|(_, _, persons)| !persons.is_empty());
        PairedItem::new("all".to_owned(), sum, by_person.filter(|_| whole).as_deref().unwrap_or_default(), &mut least)
    });
    let items: Vec<PairedItem> =
        items.into_iter().map(|(name, votes, persons)| PairedItem::new(name, votes, &persons, &mut least)).collect();
    let means = means(&items).filter(|_| all.is_some());
    Ok((!items.is_empty()).then_some(Paired { items, all, means }))
}

/// The votes of each person. `cells` counts those of all persons' tables.
fn of_persons(of: &Preferences, answers: &[(&Answer, &str, &str)], cells: &mut usize) -> Result<Vec<Preferences>, Fault> {
    let persons = grouped(answers.iter(), |(answer, ..)| (&*answer.study, &*answer.person));
    *cells += persons.len() * of.names().len().pow(2);
    if *cells > MOST_CELLS {
        let found = format!("{} persons who compare {} conditions", persons.len(), of.names().len());
        return Err(Fault::unexpected("tables of persons with at most 67108864 cells in all", found));
    }
    let votes = |(_, answers): (_, Vec<&(&Answer, &str, &str)>)| {
        let mut votes = Preferences::new(of.names().to_vec())?;
        for (i, j) in answers.iter().filter_map(|(_, better, worse)| of.index(better).zip(of.index(worse))) {
            votes.add(i, j, 1)?;
        }
        Ok(votes)
    };
    persons.into_iter().map(votes).collect()
}

fn means(items: &[PairedItem]) -> Option<(f64, f64, Option<f64>)> {
    let agreements: Vec<Agreement> = items.iter().map(|item| item.agreement).collect::<Option<_>>()?;
    let count = items.len() as f64;
    let zetas: Option<Vec<f64>> = items.iter().map(|item| item.consistency.map(|zeta| zeta.0)).collect();
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / count;
    Some((
        mean(&mut agreements.iter().map(|a| a.u)),
        mean(&mut agreements.iter().map(|a| a.chi2)),
        zetas.map(|zetas| mean(&mut zetas.into_iter())),
    ))
}
