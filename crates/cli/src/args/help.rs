//! The help of the whole and of each command: what belongs together, and what a command looks like in use.

use super::{Cli, examples::EXAMPLES};
use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::{Arg, ArgAction, Command, CommandFactory, FromArgMatches, ValueHint};
use promenade_player::command::{HELP, terminal};
use std::path::PathBuf;

/// Commands by what they are for.
const GROUPS: [(&str, &[&str]); 6] = [
    ("Hear", &["render", "host", "path"]),
    ("Make a room", &["bake", "responses", "simulate", "join", "surface", "import"]),
    ("Measure", &["inspect", "measure", "map"]),
    ("Learn", &["fit", "capture", "anchors", "learn", "train", "refine", "eval"]),
    ("Publish", &["web", "study"]),
    ("This program", &["completions"]),
];

impl Cli {
    /// What the command line says; without sense in it, or where help is asked for, the process ends here.
    pub(crate) fn of_command_line() -> Self {
        let parsed = command().try_get_matches().and_then(|matches| Self::from_arg_matches(&matches));
        parsed.unwrap_or_else(|error| {
            if error.use_stderr()
                && let Some(value) = spaced(std::env::args())
            {
                terminal::note(format_args!("numbers of one value have commas between them and no spaces: {value}"));
            }
            error.exit()
        })
    }
}

/// Three numbers after an option, which are meant as one value.
fn spaced(words: impl Iterator<Item = String>) -> Option<String> {
    let words: Vec<String> = words.collect();
    let is_number = |word: &String| word.trim_end_matches(',').parse::<f64>().is_ok();
    let found = words.array_windows::<4>().find(|[option, rest @ ..]| option.starts_with("--") && rest.iter().all(is_number));
    found.map(|[_, rest @ ..]| rest.each_ref().map(|word| word.trim_end_matches(',')).join(","))
}

/// The whole grammar with its help.
pub(crate) fn command() -> Command {
    let command = with_examples(Cli::command(), "");
    let line = |name: &&str| {
        let about = command.find_subcommand(name).and_then(Command::get_about).map(ToString::to_string);
        format!("  {name:<12} {}\n", about.unwrap_or_default())
    };
    let group = |(title, names): (&str, &[&str])| format!("{title}:\n{}\n", names.iter().map(line).collect::<String>());
    let groups: String = GROUPS.into_iter().map(group).collect();
    let template =
        format!("{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{groups}Options:\n{{options}}{{after-help}}");
    command.help_template(template)
}

/// A command with examples below its help, and so all below it; what has only others below it shows the first of each.
fn with_examples(command: Command, name: &str) -> Command {
    let below: Vec<String> = command.get_subcommands().map(|c| c.get_name().to_owned()).collect();
    let of = |name: &str| EXAMPLES.iter().find(|(of, _)| *of == name).map(|(_, examples)| examples);
    let name_of = |below: &String| format!("{name} {below}").trim().to_owned();
    let lines: Vec<&str> = match of(name) {
        Some(examples) => examples.to_vec(),
        None if name.is_empty() => Vec::new(),
        None => below.iter().filter_map(|below| of(&name_of(below))).map(|examples| examples[0]).collect(),
    };
    let command = below.iter().fold(command, |command, below| {
        let name = name_of(below);
        command.mut_subcommand(below, move |command| with_examples(command, &name))
    });
    let is_folder = |arg: &Arg| {
        let names = arg.get_value_names().unwrap_or_default();
        arg.get_id() == "output" && names.iter().any(|name| name.contains("FOLDER") || name.contains("SITE"))
    };
    let command = if command.get_arguments().any(is_folder) {
        command.mut_arg("output", |arg| arg.value_parser(PathBufValueParser::new().try_map(folder)))
    } else {
        command
    };
    if lines.is_empty() {
        command
    } else {
        command.after_help(format!("Examples:\n  promenade {}", lines.join("\n  promenade ")))
    }
}

/// A folder to write, which is not standard output.
fn folder(path: PathBuf) -> Result<PathBuf, &'static str> {
    if path.as_os_str() == "-" { Err("expected a folder, found standard output; ./- is one of that name") } else { Ok(path) }
}

/// The grammar for completions and pages, with the options of `render`, which reads its own command line.
pub(crate) fn described() -> Command {
    let options = HELP.lines().filter_map(|line| line.trim_start().strip_prefix('-').map(|_| line.trim_start()));
    let args: Vec<Arg> = options.filter_map(described_option).flatten().collect();
    command().mut_subcommand("render", |render| render.args(args))
}

/// The options of a line of help: names with commas between them, a value perhaps, two spaces or more, and what they do.
fn described_option(line: &'static str) -> Option<Vec<Arg>> {
    let (words, help) = line.split_once("  ")?;
    let value = words.split_whitespace().find(|word| !word.starts_with('-'));
    let names = words.split([',', ' ']).filter_map(|word| word.strip_prefix("--"));
    let arg = |name: &'static str| {
        let arg = Arg::new(name).long(name).help(help.trim());
        let arg = if words.starts_with("-o,") { arg.short('o') } else { arg };
        match value {
            None => arg.action(ArgAction::SetTrue),
            Some(value) => {
                arg.value_name(value).value_hint(if value.contains("FILE") { ValueHint::FilePath } else { ValueHint::Other })
            }
        }
    };
    Some(names.map(arg).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// The names of all commands that have none below them that must follow.
    fn leaves(command: &Command, name: &str) -> Vec<String> {
        let below = command.get_subcommands().flat_map(|c| leaves(c, format!("{name} {}", c.get_name()).trim()));
        let mut all: Vec<String> = below.collect();
        if !name.is_empty() && !command.is_subcommand_required_set() {
            all.push(name.to_owned());
        }
        all
    }

    #[test]
    fn numbers_apart_are_told() {
        let spaced = |line: &str| super::spaced(line.split(' ').map(str::to_owned));
        assert_eq!(spaced("simulate a.obj --emitter 3, -2 1.5 -o b"), Some("3,-2,1.5".to_owned()));
        assert_eq!(spaced("fit a --splits 3 1 --rate 2"), None);
        let folder = command().try_get_matches_from(["promenade", "web", "a", "-o", "-"]).unwrap_err().to_string();
        assert!(folder.contains("expected a folder, found standard output"), "{folder}");
    }

    #[test]
    fn every_command_is_in_one_group() {
        let listed: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| names.iter().copied()).collect();
        let all: BTreeSet<String> = Cli::command().get_subcommands().map(|c| c.get_name().to_owned()).collect();
        assert_eq!(listed.len(), all.len());
        assert!(listed.iter().all(|name| all.contains(*name)), "{all:?}");
        let help = command().render_help().to_string();
        assert!(help.find("\nHear:\n").unwrap() < help.find("\nPublish:\n").unwrap(), "{help}");
        assert!(help.contains("  render       Render a sound file"), "{help}");
    }

    #[test]
    fn every_command_has_two_examples_that_are_understood() {
        let mut leaves = leaves(&Cli::command(), "");
        leaves.sort();
        let mut named: Vec<&str> = EXAMPLES.iter().map(|(name, _)| *name).collect();
        named.sort_unstable();
        assert_eq!(named, leaves);
        for (name, examples) in EXAMPLES {
            for example in examples {
                assert!(example == name || example.starts_with(&format!("{} ", name.split(' ').next().unwrap())), "{example}");
                let first = example.split(" | ").next().unwrap().split(" > ").next().unwrap();
                let words = first.split(' ').map(|word| word.trim_matches('\''));
                let parsed = command().try_get_matches_from(std::iter::once("promenade").chain(words));
                let matches = parsed.unwrap_or_else(|error| panic!("{example}: {error}"));
                // A parser of another type than its field's panics here.
                Cli::from_arg_matches(&matches).unwrap_or_else(|error| panic!("{example}: {error}"));
            }
        }
    }

    #[test]
    fn the_options_of_a_player_are_described() {
        let command = described();
        let render = command.find_subcommand("render").unwrap();
        let option = |name: &str| render.get_arguments().find(|arg| arg.get_long() == Some(name)).unwrap();
        assert!(!option("loop").get_action().takes_values());
        assert!(option("speed").get_action().takes_values() && option("late").get_action().takes_values());
        assert_eq!(option("output").get_short(), Some('o'));
        assert!(render.get_arguments().filter(|arg| arg.get_long().is_some()).count() >= 28);
    }
}
