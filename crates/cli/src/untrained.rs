//! `promenade train` in a build without the training framework.

use crate::report;
use anyhow::{Result, bail};
use std::ffi::OsString;

/// What makes a build that trains.
const WITH_TRAINING: &str = "cargo build --release -p promenade --features train";

/// Says what makes a build that can, as help where that is asked for.
pub(crate) fn without_training(words: &[OsString]) -> Result<()> {
    let text = format!("this build cannot train; one that can is made by: {WITH_TRAINING}");
    if words.iter().any(|word| word == "--help" || word == "-h") {
        return report::print(&format!("{text}\n"));
    }
    bail!("{text}");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::Rest;
    use clap::{Args, Command, FromArgMatches};

    #[test]
    fn whatever_is_asked_is_understood_and_help_is_no_failure() {
        let command = Rest::augment_args(Command::new("train")).disable_help_flag(true);
        for line in ["", "walk/ --anchors a.safetensors -o b.promenade --steps 3", "--gpu", "--help", "-h", "a -- b"] {
            let words: Vec<_> = line.split_whitespace().collect();
            let matches = command.clone().try_get_matches_from([&["train"], &words[..]].concat()).expect(line);
            let asked = Rest::from_arg_matches(&matches).unwrap().words;
            assert_eq!(asked.is_empty(), line.is_empty(), "{line}: {asked:?}");
            assert_eq!(without_training(&asked).is_ok(), line.contains("-h"), "{line}");
        }
    }

    #[test]
    fn the_line_names_this_package_and_a_feature_that_it_has() {
        let manifest = include_str!("../Cargo.toml");
        let mut words = WITH_TRAINING.split(' ').skip_while(|word| *word != "-p").skip(1);
        assert_eq!(words.next(), Some(env!("CARGO_PKG_NAME")));
        let feature = words.nth(1).unwrap();
        assert!(manifest.lines().any(|line| line.starts_with(&format!("{feature} = ["))), "{feature}");
    }
}
