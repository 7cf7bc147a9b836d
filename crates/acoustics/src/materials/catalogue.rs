//! The table of materials.
//!
//! Absorption and scattering by octave are those of the table in the Python package pyroomacoustics 0.10.1
//! (`data/materials.json`, MIT licence beside it), which has them from M. Vorlaender, "Auralization", Springer 2008, appendix.
//! Where it ends below 8 kHz, its last value holds. Other tables are read from files.

use crate::error::AcousticsError;
use crate::materials::curve::Curve;
use crate::materials::material::{Material, SCATTERING};
use crate::materials::shares::Shares;
use crate::materials::wildcard::fits;
use crate::octave::Octaves;
use serde::Deserialize;
use std::collections::BTreeMap;

/// Names that an error suggests.
const SUGGESTIONS: usize = 3;

/// Materials by name.
#[derive(Clone, Debug)]
pub struct Materials {
    pub(super) absorption: BTreeMap<String, Entry>,
    pub(super) scattering: BTreeMap<String, Entry>,
}

/// A row of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// What it is.
    pub description: String,
    /// Shares, 0 to 1.
    pub shares: Octaves,
    /// That at 63 Hz, where it is known.
    pub share_63: Option<f32>,
    /// All of them, where they are known closer than by octaves.
    pub fine: Curve,
}

#[derive(Deserialize)]
struct File {
    absorption: BTreeMap<String, BTreeMap<String, Row>>,
    scattering: BTreeMap<String, BTreeMap<String, Row>>,
}

#[derive(Deserialize)]
struct Row {
    description: String,
    coeffs: Vec<f32>,
}

impl Default for Materials {
    fn default() -> Self {
        let file: File = serde_json::from_str(include_str!("../../data/materials.json")).unwrap_or_else(|e| {
            // A test reads it.
            unreachable!("the table of this crate: {e}")
        });
        Self { absorption: rows(file.absorption), scattering: rows(file.scattering) }
    }
}

fn rows(classes: BTreeMap<String, BTreeMap<String, Row>>) -> BTreeMap<String, Entry> {
    let entry = |(name, row): (String, Row)| {
        let last = row.coeffs.len() - 1;
        let shares = std::array::from_fn(|band| row.coeffs[band.min(last)]);
        (name, Entry { description: row.description, shares, share_63: None, fine: Curve::default() })
    };
    classes.into_values().flatten().map(entry).collect()
}

impl Materials {
    /// Names and descriptions of what absorbs, in the order of the alphabet.
    pub fn absorbing(&self) -> impl Iterator<Item = (&str, &Entry)> {
        self.absorption.iter().map(|(name, entry)| (name.as_str(), entry))
    }

    /// Names and descriptions of what is known to scatter, in the order of the alphabet.
    pub fn scattering(&self) -> impl Iterator<Item = (&str, &Entry)> {
        self.scattering.iter().map(|(name, entry)| (name.as_str(), entry))
    }

    /// A material after its description: `ABSORPTION` or `ABSORPTION:SCATTERING`, each a name of the table or numbers with
    /// slashes between: one for all octaves, seven for those from 125 Hz, eight for those from 63 Hz, or thirds, 21 from 100 Hz
    /// or 24 from 50 Hz to 10 kHz or 31 from 20 Hz to 20 kHz, or any bands as `HZ@SHARE`. In a name `*` stands for any letters;
    /// the first that fits, in the order of the alphabet, is taken. Scattering is that of the table where it has one of the
    /// same name, else [`SCATTERING`].
    ///
    /// # Errors
    /// A name that is not there, with those it may have meant; numbers outside 0 to 1, or of another count.
    pub fn material(&self, description: &str) -> Result<Material, AcousticsError> {
        let (absorption, scattering) = match description.split_once(':') {
            Some((absorption, scattering)) => (absorption, Some(scattering)),
            None => (description, None),
        };
        let scattering = match scattering {
            Some(scattering) => shares("scattering", scattering, &self.scattering)?,
            None => self.scattering.get(&key(absorption)).map_or_else(|| Shares::even(SCATTERING), Shares::from),
        };
        let Shares { octaves, low, fine } = shares("material", absorption, &self.absorption)?;
        let by_octave = Material::new(description, octaves, scattering.octaves);
        let material = Material { absorption_63: low, fine: [fine, scattering.fine], ..by_octave };
        material.check()?;
        Ok(material)
    }

    /// The material of each group: that of the first rule, a pattern with `*` for any letters and a description, that fits its
    /// name; where none does, the one of the group's own name. Small and capital letters are alike.
    ///
    /// # Errors
    /// A description that is none, a group without a rule whose name is no material, a rule that fits no group.
    pub fn assign(&self, groups: &[String], rules: &[(String, String)]) -> Result<Vec<Material>, AcousticsError> {
        for (pattern, description) in rules {
            self.material(description)?;
            if !groups.iter().any(|group| fits(&key(pattern), &key(group), None)) {
                let expected = format!("one that fits a group of the mesh: {}", groups.join(", "));
                return Err(AcousticsError::argument("pattern of a material", expected, format!("{pattern:?}")));
            }
        }
        let of = |group: &String| match rules.iter().find(|(pattern, _)| fits(&key(pattern), &key(group), None)) {
            Some((_, description)) => self.material(description),
            None => self.material(group),
        };
        groups.iter().map(of).collect()
    }
}

pub(super) fn key(name: &str) -> String {
    name.trim().to_lowercase().replace([' ', '-'], "_")
}

fn shares(what: &str, text: &str, table: &BTreeMap<String, Entry>) -> Result<Shares, AcousticsError> {
    if let Some(entry) = table.get(&key(text)) {
        return Ok(entry.into());
    }
    if text.contains('*')
        && let Some((_, entry)) = table.iter().find(|(name, _)| fits(&key(text), name, None))
    {
        return Ok(entry.into());
    }
    if text.contains('@') {
        let band = |pair: &str| -> Option<[f64; 2]> {
            let (hz, share) = pair.split_once('@')?;
            let [hz, share]: [f64; 2] = [hz.trim().parse().ok()?, share.trim().parse().ok()?];
            (10.0..=40_000.0).contains(&hz).then_some([hz, share])
        };
        let bands: Option<Vec<[f64; 2]>> = text.split('/').map(band).collect();
        return bands.as_deref().and_then(Shares::of).ok_or_else(|| {
            AcousticsError::argument(what, "HZ@SHARE from 10 Hz to 40 kHz, with slashes between", format!("{text:?}"))
        });
    }
    let numbers: Result<Vec<f32>, _> = text.split('/').map(|n| n.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(numbers) => Shares::of_row(numbers).ok_or_else(|| {
            let expected = "1 number, 7 or 8 octaves, or 21, 24 or 31 thirds, with slashes between";
            AcousticsError::argument(what, expected, format!("{} in {text:?}", numbers.len()))
        }),
        Err(_) => {
            let mut names: Vec<(f64, &String)> = table.keys().map(|name| (likeness(&key(text), name), name)).collect();
            names.sort_by(|a, b| b.0.total_cmp(&a.0));
            let near: Vec<&str> = names.iter().take(SUGGESTIONS).map(|(_, name)| name.as_str()).collect();
            let expected = format!("a name of the table, perhaps {}, or numbers", near.join(", "));
            Err(AcousticsError::argument(what, expected, format!("{text:?}")))
        }
    }
}

impl From<&Entry> for Shares {
    fn from(entry: &Entry) -> Self {
        Self { octaves: entry.shares, low: entry.share_63, fine: entry.fine.clone() }
    }
}

/// How much a name looks like another: whole, and in its words. A word that both have tells most, a longer one more than a
/// short one; of others counts how near the nearest is to each word of the name that was found.
fn likeness(found: &str, name: &str) -> f64 {
    let words = |text: &str| -> Vec<String> {
        let words = text.split(|c: char| !c.is_alphabetic()).filter(|word| word.chars().count() > 2);
        words.map(|word| word.strip_suffix('s').unwrap_or(word).to_owned()).collect()
    };
    let (mine, theirs) = (words(found), words(name));
    let same = mine.iter().filter(|word| theirs.contains(word)).map(|word| word.chars().count() as f64).sum::<f64>();
    let begins = |a: &str, b: &str| a.starts_with(b) || b.starts_with(a);
    let kin = mine
        .iter()
        .filter(|word| theirs.iter().any(|other| other.len() > 3 && word.len() > 3 && other != *word && begins(other, word)));
    // Of materials with the same words, the one with few others.
    let others = theirs.iter().filter(|word| !mine.contains(word)).count() as f64;
    let like = theirs.iter().map(|word| 0.95 * strsim::jaro_winkler(found, word));
    let likeness = like.fold(strsim::jaro_winkler(found, name), f64::max);
    likeness - 0.1 * others + 0.3 * same + 0.3 * kin.map(|word| word.chars().count() as f64).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_takes_the_first_name_that_fits() {
        let table = Materials::default();
        let found = table.material("rockwool*").unwrap();
        assert_eq!(found.absorption, table.material("rockwool_50mm_40kgm3").unwrap().absorption);
        assert!(table.material("no_such*").is_err());
    }

    #[test]
    fn the_table_holds_shares() {
        let table = Materials::default();
        assert!(table.absorbing().count() > 80 && table.scattering().count() == 7);
        for (name, entry) in table.absorbing().chain(table.scattering()) {
            assert!(entry.shares.iter().all(|s| (0.0..=1.0).contains(s)), "{name}");
        }
        let curtain = table.material("curtains_densely_woven").unwrap();
        assert_eq!(curtain.absorption, [0.06, 0.1, 0.38, 0.63, 0.7, 0.73, 0.73]);
        assert_eq!(curtain.scattering, [SCATTERING; 7]);
    }

    #[test]
    fn materials_are_described_by_names_and_numbers() {
        let table = Materials::default();
        assert_eq!(table.material("Hard Surface").unwrap().absorption[0], 0.02);
        assert_eq!(table.material("0.3:0.5").unwrap().scattering, [0.5; 7]);
        let material = table.material("0/.1/.2/.3/.4/.5/.6:classroom_tables").unwrap();
        assert_eq!((material.absorption[6], material.scattering[2], material.absorption_63), (0.6, 0.4, None));
        let material = table.material(".9/0/.1/.2/.3/.4/.5/.6").unwrap();
        assert_eq!((material.absorption[6], material.absorption_63), (0.6, Some(0.9)));
        let bands: Vec<String> = (0..16).map(|b| format!("{}@0.{b:02}", 80 + 100 * b)).collect();
        let material = table.material(&format!("{}:63@.1/8000@.3", bands.join("/"))).unwrap();
        assert!((material.taken(480.0) - (1.0 - 0.96 * (1.0 - material.scattering[2]) as f64)).abs() < 0.02, "{material:?}");
        assert_eq!(material.fine.each_ref().map(|curve| curve.points().len()), [16, 0]);
        for (wrong, says) in [
            ("80@0.1/x@0.3", "HZ@SHARE from 10 Hz"),
            ("80@0.1/100@1.3", "0 to 1, found"),
            ("carpett", "perhaps carpet_"),
            ("brick", "brickwork"),
            ("mat_scene09_concrete", "unpainted_concrete, concrete_floor, or numbers"),
            ("Curtain-Heavy.003", "perhaps curtain"),
            ("oak_wood_01", "wood"),
            ("0.1/0.2", "21, 24 or 31 thirds, with slashes between, found 2"),
            ("1.2/0/0/0/0/0/0/0", "absorption at 63 Hz of 1.2/0/0/0/0/0/0/0: expected 0 to 1, found 1.2"),
            ("1.2", "expected 0 to 1, found 1.2"),
            ("0.1:smooth", "scattering: expected a name of the table"),
        ] {
            let error = table.material(wrong).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
    }

    #[test]
    fn groups_get_materials_by_pattern_or_by_their_names() {
        let table = Materials::default();
        let groups = ["Floor.001", "ceiling", "north_wall", "marble_floor"].map(str::to_owned);
        let rule = |pattern: &str, description: &str| (pattern.to_owned(), description.to_owned());
        let rules = [rule("floor*", "0.1"), rule("*wall", "0.2"), rule("ceiling", "0.3")];
        let found = table.assign(&groups, &rules).unwrap();
        assert_eq!(found.iter().map(|m| m.absorption[0]).collect::<Vec<_>>(), [0.1, 0.3, 0.2, 0.01]);
        let error = table.assign(&groups, &rules[..2]).unwrap_err().to_string();
        assert!(error.contains("found \"ceiling\"") && error.contains("ceiling_"), "{error}");
        let error = table.assign(&groups, &[rule("door*", "0.1")]).unwrap_err().to_string();
        assert!(error.contains("Floor.001, ceiling") && error.contains("\"door*\""), "{error}");
    }
}
