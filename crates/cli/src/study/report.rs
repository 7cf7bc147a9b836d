//! `promenade study report`: tables, plots and figures of answers.

use crate::args::StudyReportArgs;
use crate::plot::{self, Interval};
use crate::report;
use anyhow::{Result, bail};
use promenade_baker::atomic;
use promenade_study::{
    Abx, Answer, Difference, LEVEL, Paired, PairedItem, Person, Ratings, Role, Trial, abx, abx_by_person, groups, paired,
    persons, ratings, read,
};
use serde_json::{Value, json};
use std::path::Path;

/// Everything that answers say.
struct Results {
    parts: Vec<Part>,
    persons: Vec<Person>,
    /// Persons who failed the headphone check, and whether they are kept.
    failed: Vec<String>,
    kept: bool,
    /// Questions beside the sounds, with how often each answer was given.
    said: Vec<(String, Vec<(String, usize)>)>,
    /// Answers by which neither of two was preferred.
    ties: usize,
}

/// What answers of one part of a study say, or preference tables.
struct Part {
    name: String,
    paired: Option<Paired>,
    abx: Vec<Abx>,
    by_person: Vec<Abx>,
    ratings: Vec<Ratings>,
    left_out: Vec<String>,
}

pub(super) fn run(args: &StudyReportArgs) -> Result<()> {
    let mut material = read(&args.answers)?;
    let persons = persons(material.answers.list());
    let failed = if args.keep_failed {
        persons.iter().filter(|person| person.headphones == Some(false)).map(|person| person.name.clone()).collect()
    } else {
        material.answers.leave_out_failed()
    };
    let answers = &material.answers;
    let mut parts = Vec::new();
    let tables = Part::new(String::new(), &material.tables, &[], args)?;
    parts.extend((!material.tables.is_empty()).then_some(tables));
    let of_parts = answers.parts();
    let changed = of_parts.iter().any(|(version, ..)| *version != of_parts[0].0);
    for (version, part, list) in &of_parts {
        let name = match (changed, of_parts.len() > 1) {
            (true, _) => format!("part {part} of version {version}"),
            (false, true) => format!("part {part}"),
            _ => String::new(),
        };
        parts.push(Part::new(name, &[], list, args)?);
    }
    let ties = answers.list().iter().filter(|answer| matches!(answer.what, Trial::Tie { .. })).count();
    let found = Results { parts, persons, failed, kept: args.keep_failed, said: answers.said(), ties };
    if found.parts.is_empty() && found.said.is_empty() && found.failed.is_empty() {
        bail!("{}: expected answers, found none", args.answers[0].display());
    }
    for (count, what) in [
        (answers.repeated, "came more than once and counts once"),
        (answers.contradicted, "came again with another answer; the first counts"),
    ] {
        if count > 0 {
            report::note(format_args!("{count} of the answers {what}"));
        }
    }
    report::figures(&args.files, &found.json(), |markdown| found.text(markdown), |folder| found.plots(folder))
}

impl Part {
    fn new(
        name: String,
        tables: &[(String, promenade_study::Preferences)],
        answers: &[Answer],
        args: &StudyReportArgs,
    ) -> Result<Self> {
        let (ratings, left_out) = ratings(answers, args.keep_all);
        let paired = paired(tables, answers)?;
        Ok(Self { name, paired, abx: abx(answers), by_person: abx_by_person(answers), ratings, left_out })
    }

    fn text(&self, table: &mut impl FnMut(&str, &[Vec<String>], &str)) {
        let titled = |title: &str| if self.name.is_empty() { title.to_owned() } else { format!("{title}, {}", self.name) };
        if let Some(paired) = &self.paired {
            for item in paired.items.iter().chain(&paired.all) {
                table(&titled(&format!("Votes: {}", item.name)), &votes(item), &remarks(item));
            }
            table(&titled("Agreement and consistency"), &agreement(paired), "");
        }
        for (title, first, found) in [("ABX", "item", &self.abx), ("ABX by person", "person", &self.by_person)] {
            if !found.is_empty() {
                table(&titled(title), &abx_table(first, found), "");
            }
        }
        for ratings in &self.ratings {
            let mut rows = vec![row(["condition", "median", "95 %", "quartiles", "mean", "ratings"])];
            rows.extend(ratings.conditions.iter().map(|c| {
                let name = if c.role == Role::Reference { format!("{} (reference)", c.name) } else { c.name.clone() };
                let interval = c.interval.map_or("-".to_owned(), |[low, high]| format!("{low:.1} to {high:.1}"));
                let [low, median, high] = c.quartiles;
                let quartiles = format!("{low:.1} to {high:.1}");
                vec![name, format!("{median:.1}"), interval, quartiles, format!("{:.1}", c.mean), c.ratings.len().to_string()]
            }));
            table(&titled(&format!("Ratings: {}", ratings.item)), &rows, "");
            if let Some(of) = &ratings.differences {
                let mut rows = vec![row(["between", "mean difference", "chance", "chance, Holm"])];
                rows.extend(of.pairs.iter().map(|Difference { between, mean, chance: alone, holm }| {
                    vec![between.join(" and "), format!("{mean:.1}"), chance(*alone), chance(*holm)]
                }));
                let all = format!(
                    "Friedman: chi2 = {:.2}, df = {}, chance {}; Wilcoxon's signed ranks of {} persons\n",
                    of.chi2,
                    of.freedom,
                    chance(of.chance),
                    of.persons
                );
                table(&titled(&format!("Differences of ratings: {}", ratings.item)), &rows, &all);
            }
        }
    }

    fn json(&self) -> Value {
        let of_pairs = self.paired.as_ref().map(|paired| {
            json!({
                "items": paired.items.iter().map(item_json).collect::<Vec<_>>(),
                "all": paired.all.as_ref().map(item_json),
                "means": paired.means.map(|(u, chi2, zeta)| json!({ "u": u, "chi2": chi2, "zeta": zeta })),
            })
        });
        let [abx, by_person] = [(&self.abx, "item"), (&self.by_person, "person")].map(|(found, first)| {
            let of = |a: &Abx| {
                json!({
                    first: a.item, "between": a.between, "right": a.right, "trials": a.trials, "chance": a.chance,
                    "interval": a.interval,
                })
            };
            found.iter().map(of).collect::<Vec<_>>()
        });
        let ratings: Vec<Value> = self.ratings.iter().map(ratings_json).collect();
        json!({
            "part": self.name, "paired": of_pairs, "abx": abx, "abx_by_person": by_person, "ratings": ratings,
            "left_out_of_ratings": self.left_out,
        })
    }
}

fn abx_table(first: &str, found: &[Abx]) -> Vec<Vec<String>> {
    let mut rows = vec![row([first, "between", "right", "of", "share, 95 %", "chance"])];
    rows.extend(found.iter().map(|abx| {
        let [low, high] = abx.interval;
        let share = f64::from(abx.right) / f64::from(abx.trials);
        let share = format!("{share:.2} ({low:.2} to {high:.2})");
        let [right, of] = [abx.right, abx.trials].map(|n| n.to_string());
        vec![abx.item.clone(), abx.between.join(" and "), right, of, share, chance(abx.chance)]
    }));
    rows
}

fn persons_table(persons: &[Person]) -> Vec<Vec<String>> {
    let head = ["person", "trials", "minutes", "headphones", "votes as before", "votes as others", "ratings as others"];
    let mut rows = vec![row(head)];
    let share = |share: Option<f64>| share.map_or("-".to_owned(), |share| format!("{share:.2}"));
    rows.extend(persons.iter().map(|p| {
        let headphones = p.headphones.map_or("-", |passed| if passed { "passed" } else { "failed" });
        let minutes = format!("{:.1}", p.minutes);
        let [own, others, ratings] = [p.with_self, p.with_others, p.correlation].map(share);
        vec![p.name.clone(), p.trials.to_string(), minutes, headphones.to_owned(), own, others, ratings]
    }));
    rows
}

fn chance(p: f64) -> String {
    if p < 0.0001 { "< .0001".to_owned() } else { format!("{p:.4}") }
}

fn row<const N: usize>(cells: [&str; N]) -> Vec<String> {
    cells.map(str::to_owned).to_vec()
}

impl Results {
    fn text(&self, markdown: bool) -> String {
        let mut text = String::new();
        let mut table = |title: &str, rows: &[Vec<String>], after: &str| {
            let head = if markdown { format!("## {title}\n\n") } else { format!("{title}\n") };
            text += &format!("{head}{}{}{after}\n", report::table(rows, markdown), if markdown { "\n" } else { "" });
        };
        self.parts.iter().for_each(|part| part.text(&mut table));
        for (question, given) in &self.said {
            let mut rows = vec![row(["answer", "persons"])];
            rows.extend(given.iter().map(|(answer, count)| vec![answer.clone(), count.to_string()]));
            table(&format!("Question: {question}"), &rows, "");
        }
        if !self.persons.is_empty() {
            table("Persons", &persons_table(&self.persons), "");
        }
        if !self.failed.is_empty() {
            let what = if self.kept { "Kept, though they" } else { "Left out, since they" };
            text += &format!("{what} failed the headphone check: {}\n", self.failed.join(", "));
        }
        for part in self.parts.iter().filter(|part| !part.left_out.is_empty()) {
            text += &format!(
                "Left out of the ratings{}, since they rated more than 15 % of the hidden references below 90, or of the mid \
                 anchors above: {}\n",
                if part.name.is_empty() { String::new() } else { format!(", {}", part.name) },
                part.left_out.join(", ")
            );
        }
        if self.ties > 0 {
            text += &format!("{} answers preferred neither of two and are no votes\n", self.ties);
        }
        if !self.persons.is_empty() {
            text += &format!("{} persons\n", self.persons.len());
        }
        text
    }

    fn plots(&self, folder: &Path) -> Result<()> {
        let write = |name: &str, svg: String| Ok::<_, anyhow::Error>(atomic::write(&folder.join(name), svg.as_bytes())?);
        let paired = self.parts.iter().flat_map(|part| &part.paired);
        for (number, item) in paired.flat_map(|paired| paired.items.iter().chain(&paired.all)).enumerate() {
            // Two scores whose bars do not meet differ significantly.
            let half = f64::from(item.least.least) / 2.0;
            let of = |(name, votes): (&String, u32)| {
                let value = f64::from(votes);
                Interval { name: name.clone(), value, interval: [value - half, value + half] }
            };
            let rows: Vec<Interval> = item.votes.names().iter().zip(item.votes.scores()).map(of).collect();
            let title = format!("{}: bars that do not meet differ", item.name);
            write(&format!("votes-{}.svg", number + 1), plot::intervals(&title, "votes", &rows)?)?;
            if let Some(strengths) = &item.strengths {
                let rows: Vec<Interval> = (item.votes.names().iter().zip(&strengths.of))
                    .map(|(name, s)| Interval { name: name.clone(), value: s.log, interval: s.interval })
                    .collect();
                let axis = "logarithm of the strength, 95 %";
                write(&format!("strengths-{}.svg", number + 1), plot::intervals(&item.name, axis, &rows)?)?;
            }
        }
        for (number, ratings) in self.parts.iter().flat_map(|part| &part.ratings).enumerate() {
            let rows: Vec<(&str, Vec<f64>)> = ratings.conditions.iter().map(|c| (&*c.name, c.ratings.clone())).collect();
            write(&format!("ratings-{}.svg", number + 1), plot::boxes(&ratings.item, &rows)?)?;
        }
        Ok(())
    }

    fn json(&self) -> Value {
        let person = |p: &Person| {
            json!({
                "person": p.name, "trials": p.trials, "minutes": p.minutes, "headphones_passed": p.headphones,
                "votes_as_before": p.with_self, "votes_as_others": p.with_others, "ratings_as_others": p.correlation,
            })
        };
        json!({
            "level": LEVEL,
            "parts": self.parts.iter().map(Part::json).collect::<Vec<_>>(),
            "persons": self.persons.iter().map(person).collect::<Vec<_>>(),
            "failed_headphones": { "persons": self.failed, "kept": self.kept },
            "questions": self.said.iter().map(|(name, given)| json!({ "name": name, "answers": given })).collect::<Vec<_>>(),
            "no_preference": self.ties,
        })
    }
}

fn votes(item: &PairedItem) -> Vec<Vec<String>> {
    let names = item.votes.names();
    let mut head = vec!["preferred".to_owned()];
    head.extend(names.iter().map(|name| format!("over {name}")));
    head.extend(["votes", "strength", "95 %"].map(str::to_owned));
    let mut rows = vec![head];
    for (i, score) in item.votes.scores().iter().enumerate() {
        let mut cells = vec![names[i].clone()];
        let cell = |j: usize| if i == j { "*".to_owned() } else { item.votes.votes(i, j).to_string() };
        cells.extend((0..names.len()).map(cell));
        cells.push(score.to_string());
        match &item.strengths {
            Some(strengths) => {
                let s = &strengths.of[i];
                cells.extend([format!("{:.2}", s.log), format!("{:.2} to {:.2}", s.interval[0], s.interval[1])]);
            }
            None => cells.extend(["-".to_owned(), "-".to_owned()]),
        }
        rows.push(cells);
    }
    rows
}

fn remarks(item: &PairedItem) -> String {
    let least = &item.least;
    let by = least.chance.map_or("by the normal range".to_owned(), |p| format!("chance {p:.3}, exact"));
    let (bound, whole) = (least.bound, least.bound.floor());
    let mut text = format!(
        "Least significant difference of votes at {LEVEL}: {} ({by}). R0 = {bound:.2}: differences up to R = {whole} can be \
         chance.\n",
        least.least
    );
    let names = item.votes.names();
    let scores = item.votes.scores();
    let together: Vec<String> = groups(&scores, least.least)
        .iter()
        .map(|group| group.iter().map(|i| &*names[*i]).collect::<Vec<_>>().join(" "))
        .collect();
    text += &format!("Groups that do not differ, best first: {}\n", together.join(" | "));
    match &item.strengths {
        None => text += "No finite strengths: some were never preferred to the others.\n",
        Some(s) if s.by_person => text += "Intervals of strengths allow for persons.\n",
        Some(_) => {}
    }
    let uneven = item.votes.uneven();
    if !uneven.is_empty() {
        let pairs = uneven.iter().map(|(i, j)| format!("{} and {} {}", names[*i], names[*j], item.votes.judgements(*i, *j)));
        let pairs = pairs.collect::<Vec<_>>().join(", ");
        text += &format!("Pairs were not judged equally often ({:.4} on average): {pairs}\n", item.votes.judges());
    }
    text
}

fn agreement(paired: &Paired) -> Vec<Vec<String>> {
    let mut rows = vec![row(["", "u", "chi2", "df", "chance", "zeta", "chi2 of votes", "df", "chance"])];
    let zeta = |zeta: Option<f64>| zeta.map_or("-".to_owned(), |z| format!("{z:.4}"));
    let figures = |item: &PairedItem| {
        let mut cells = vec![item.name.clone()];
        let zeta = zeta(item.consistency.map(|z| z.0));
        cells.extend(match &item.agreement {
            None => ["-", "-", "-", "-", &zeta, "-", "-", "-"].map(str::to_owned),
            Some(a) => [
                format!("{:.4}", a.u),
                format!("{:.2}", a.chi2),
                a.freedom.to_string(),
                chance(a.chance),
                zeta,
                format!("{:.2}", a.scores_chi2),
                a.scores_freedom.to_string(),
                chance(a.scores_chance),
            ],
        });
        cells
    };
    rows.extend(paired.items.iter().map(figures));
    if let Some((u, chi2, mean)) = paired.means {
        let cells = ["mean".to_owned(), format!("{u:.4}"), format!("{chi2:.2}"), "-".into(), "-".into(), zeta(mean)];
        rows.push(cells.into_iter().chain(["-"; 3].map(str::to_owned)).collect());
    }
    rows.extend(paired.all.iter().map(|all| {
        let mut cells = figures(all);
        cells[0] = "all votes".to_owned();
        cells
    }));
    rows
}

fn item_json(item: &PairedItem) -> Value {
    let names = item.votes.names();
    let votes: Vec<Vec<u32>> = (0..names.len()).map(|i| (0..names.len()).map(|j| item.votes.votes(i, j)).collect()).collect();
    json!({
        "item": item.name,
        "conditions": names,
        "votes": votes,
        "scores": item.votes.scores(),
        "judges": item.votes.judges(),
        "agreement": item.agreement.map(|a| json!({
            "u": a.u, "chi2": a.chi2, "df": a.freedom, "chance": a.chance,
            "scores_chi2": a.scores_chi2, "scores_df": a.scores_freedom, "scores_chance": a.scores_chance,
        })),
        "zeta": item.consistency.map(|(zeta, persons)| json!({ "mean": zeta, "persons": persons })),
        "least_significant_difference": { "r0": item.least.bound, "least": item.least.least, "chance": item.least.chance },
        "strengths": item.strengths.as_ref().map(|s| json!({
            "by_person": s.by_person,
            "log": s.of.iter().map(|s| s.log).collect::<Vec<_>>(),
            "error": s.of.iter().map(|s| s.error).collect::<Vec<_>>(),
            "interval": s.of.iter().map(|s| s.interval).collect::<Vec<_>>(),
        })),
    })
}

fn ratings_json(ratings: &Ratings) -> Value {
    let conditions: Vec<Value> = (ratings.conditions.iter())
        .map(|c| {
            json!({
                "condition": c.name, "reference": c.role == Role::Reference, "quartiles": c.quartiles, "interval": c.interval,
                "mean": c.mean, "ratings": c.ratings,
            })
        })
        .collect();
    let differences = ratings.differences.as_ref().map(|of| {
        let pair = |p: &Difference| json!({ "between": p.between, "mean": p.mean, "chance": p.chance, "holm": p.holm });
        json!({
            "persons": of.persons, "friedman": { "chi2": of.chi2, "df": of.freedom, "chance": of.chance },
            "pairs": of.pairs.iter().map(pair).collect::<Vec<_>>(),
        })
    });
    json!({ "item": ratings.item, "conditions": conditions, "differences": differences })
}
