//! `deny.toml`: which licences dependencies may have. A test holds of which crates there may be several versions.

use anyhow::{Context, Result};
use serde::Deserialize;
use spdx::Licensee;

const FILE: &str = include_str!("../../deny.toml");

/// The licences.
#[derive(Debug, Deserialize)]
pub(crate) struct Deny {
    licenses: Licenses,
}

#[derive(Debug, Deserialize)]
struct Licenses {
    allow: Vec<String>,
    exceptions: Vec<Exception>,
}

#[derive(Debug, Deserialize)]
struct Exception {
    #[serde(rename = "crate")]
    name: String,
    allow: Vec<String>,
}

impl Deny {
    /// Reads the file as it was when this program was built.
    pub(crate) fn read() -> Result<Self> {
        toml::from_str(FILE).context("deny.toml cannot be read")
    }

    /// Licences that a crate may have, those that are preferred first.
    pub(crate) fn allowed(&self, name: &str) -> Result<Vec<Licensee>> {
        let exceptions = self.licenses.exceptions.iter().filter(|exception| exception.name == name);
        let ids = self.licenses.allow.iter().chain(exceptions.flat_map(|exception| &exception.allow));
        ids.map(|id| Licensee::parse(id).with_context(|| format!("{id} is no licence"))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{bundle::BUILDS, licenses::linked_by, root};
    use std::collections::{BTreeMap, BTreeSet};

    #[derive(Deserialize)]
    struct Versions {
        bans: Bans,
    }

    #[derive(Deserialize)]
    struct Bans {
        skip: Vec<Skip>,
    }

    #[derive(Deserialize)]
    struct Skip {
        /// Name and version.
        #[serde(rename = "crate")]
        of: String,
        reason: String,
    }

    /// What is wrong with the versions of crates: several without a reason, and reasons for what is not.
    fn wrong(versions: &BTreeMap<String, BTreeSet<String>>, skips: &[Skip]) -> Vec<String> {
        let skipped = |name: &str, version: &str| skips.iter().any(|skip| skip.of == format!("{name}@{version}"));
        let several = versions.iter().filter_map(|(name, versions)| {
            let left: Vec<_> = versions.iter().filter(|version| !skipped(name, version)).collect();
            (left.len() > 1).then(|| format!("{name} comes as {left:?}"))
        });
        let vain = skips.iter().filter(|skip| {
            let of = skip.of.split_once('@').and_then(|(name, version)| Some((versions.get(name)?, version)));
            skip.reason.is_empty() || !of.is_some_and(|(all, version)| all.len() > 1 && all.contains(version))
        });
        several.chain(vain.map(|skip| format!("{} is skipped in vain", skip.of))).collect()
    }

    #[test]
    fn what_ships_comes_in_one_version_or_there_is_a_reason() {
        let mut versions: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for target in [None, Some("x86_64-pc-windows-gnu"), Some("aarch64-apple-darwin")] {
            for build in &BUILDS {
                for (name, version) in linked_by(&root(), build, target).unwrap() {
                    versions.entry(name).or_default().insert(version);
                }
            }
        }
        assert!(versions.len() > 200, "{}", versions.len());
        let Versions { bans: Bans { mut skip } } = toml::from_str(FILE).unwrap();
        assert_eq!(wrong(&versions, &skip), [""; 0]);
        // Each would be found missing.
        while let Some(Skip { of, .. }) = skip.pop() {
            let name = of.split('@').next().unwrap();
            assert!(wrong(&versions, &skip).iter().any(|said| said.starts_with(&format!("{name} comes as"))), "{of}");
        }
        let vain = Skip { of: "png@1.0.0".to_owned(), reason: "none".to_owned() };
        assert!(wrong(&versions, &[vain]).contains(&"png@1.0.0 is skipped in vain".to_owned()));
    }

    #[test]
    fn an_exception_is_for_one_crate() {
        let deny = Deny::read().unwrap();
        let mpl = Licensee::parse("MPL-2.0").unwrap();
        assert!(deny.allowed("colored").unwrap().contains(&mpl));
        assert!(!deny.allowed("option-ext").unwrap().contains(&mpl));
    }
}
