//! The documents are such that a reader finishes them: sentences, cells and pages have an end, and commands are true.
//!
//! `bundler/src/manual.rs` holds their links, `crates/cli/src/args.rs` that their commands are understood.

use std::fs;
use std::path::Path;
use std::process::Command;

/// The most words of a sentence.
const SENTENCE: usize = 40;
/// The most words of a table's cell.
const CELL: usize = 30;
/// The most words of a page that is read from its beginning to its end.
const PAGE: usize = 2_500;
/// Pages in which one looks something up.
const REFERENCE: [&str; 5] = ["CHANGELOG.md", "docs/figures.md", "docs/osc.md", "docs/parameters.md", "docs/scene-format.md"];
/// Openings that put the verb before its subject.
const OPENINGS: [&str; 4] = ["Sought are", "Stated is", "Wanted was", "Wanted were"];
/// Programs whose command lines a reader types.
const PROGRAMS: [&str; 3] = ["cargo ", "promenade ", "python "];

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn git(args: &[&str]) -> String {
    let out = Command::new("git").args(args).current_dir(root()).output().expect("git runs");
    String::from_utf8(out.stdout).unwrap()
}

/// The documents that are not exempt, by name.
fn documents() -> Vec<(String, String)> {
    let names = git(&["ls-files", "--cached", "--others", "--exclude-standard", "*.md"]);
    let held = names.lines().filter(|name| root().join(name).exists());
    let all: Vec<_> = held.map(|name| (name.to_owned(), fs::read_to_string(root().join(name)).unwrap())).collect();
    assert!(all.len() > 20 && all.iter().any(|(name, _)| name == "README.md"), "{} documents", all.len());
    all
}

/// A part of a document.
#[derive(Debug, PartialEq)]
enum Part {
    /// A paragraph, an item of a list or a heading, in one line.
    Text(String),
    /// A cell of a table.
    Cell(String),
    /// The lines of a fenced block, and the line above it.
    Code(String, Vec<String>),
}

/// The cells of a row; a bar within code is none of its bars.
fn cells(row: &str) -> Vec<String> {
    let (mut cells, mut cell, mut in_code) = (Vec::new(), String::new(), false);
    for letter in row.trim().trim_matches('|').chars() {
        in_code ^= letter == '`';
        if letter == '|' && !in_code {
            cells.push(std::mem::take(&mut cell));
        } else {
            cell.push(letter);
        }
    }
    cells.push(cell);
    cells
}

/// Whether a line begins an item of a list.
fn is_item(line: &str) -> bool {
    let digits = line.trim_start_matches(|letter: char| letter.is_ascii_digit());
    line.starts_with("- ") || line.starts_with("* ") || (digits.len() < line.len() && digits.starts_with(". "))
}

fn parts(text: &str) -> Vec<Part> {
    let (mut parts, mut paragraph, mut above) = (Vec::new(), String::new(), String::new());
    let mut lines = text.lines().map(str::trim);
    while let Some(line) = lines.next() {
        let begins = |mark: &&str| line.starts_with(*mark);
        let ends = line.is_empty() || is_item(line) || ["#", "|", "```", "<!--", "!["].iter().any(begins);
        if ends && !paragraph.is_empty() {
            parts.push(Part::Text(std::mem::take(&mut paragraph)));
        }
        if line.starts_with("```") {
            let code = lines.by_ref().take_while(|line| !line.starts_with("```")).map(str::to_owned).collect();
            parts.push(Part::Code(above.clone(), code));
        } else if line.starts_with('|') {
            parts.extend(cells(line).into_iter().map(Part::Cell));
        } else if !line.starts_with("<!--") && !line.starts_with("![") {
            paragraph.push_str(line);
            paragraph.push(' ');
        }
        if !line.is_empty() {
            line.clone_into(&mut above);
        }
    }
    if !paragraph.is_empty() {
        parts.push(Part::Text(paragraph));
    }
    parts
}

/// What is read of a text: code is a name, a link is its words.
fn read_aloud(text: &str) -> String {
    let named: String = text.split('`').enumerate().map(|(n, part)| if n % 2 == 1 { "name" } else { part }).collect();
    let mut rest = named.as_str();
    let mut heard = String::new();
    while let Some((before, after)) = rest.split_once("](") {
        heard.push_str(before);
        rest = after.split_once(')').map_or("", |(_, after)| after);
    }
    heard + rest
}

fn count(text: &str) -> usize {
    text.split_whitespace().filter(|word| word.contains(char::is_alphanumeric)).count()
}

/// The sentences of a text.
fn sentences(text: &str) -> Vec<String> {
    let mut sentences = vec![String::new()];
    for word in read_aloud(text).split_whitespace() {
        let last = sentences.last_mut().unwrap();
        last.push_str(word);
        last.push(' ');
        if word.trim_end_matches([')', '"', '*']).ends_with(['.', '!', '?']) {
            sentences.push(String::new());
        }
    }
    sentences
}

/// What is wrong with the sentences and cells of a document, and with its length.
fn long_winded(name: &str, text: &str) -> Vec<String> {
    let mut wrong = Vec::new();
    for part in parts(text) {
        match part {
            Part::Text(text) => {
                for sentence in sentences(&text) {
                    if count(&sentence) > SENTENCE {
                        wrong.push(format!("{name}: {} words: {sentence}", count(&sentence)));
                    }
                    let opening = sentence.trim_start_matches(|letter: char| !letter.is_alphabetic());
                    if OPENINGS.iter().any(|words| opening.starts_with(words)) {
                        wrong.push(format!("{name}: begins with its verb: {sentence}"));
                    }
                }
            }
            Part::Cell(cell) if count(&read_aloud(&cell)) > CELL => {
                wrong.push(format!("{name}: a cell of {} words: {cell}", count(&read_aloud(&cell))));
            }
            Part::Cell(_) | Part::Code(..) => (),
        }
    }
    let words = text.split_whitespace().count();
    if words > PAGE && !REFERENCE.contains(&name) {
        wrong.push(format!("{name}: {words} words"));
    }
    wrong
}

#[test]
fn sentences_cells_and_pages_have_an_end() {
    let wrong: Vec<_> = documents().iter().flat_map(|(name, text)| long_winded(name, text)).collect();
    assert!(wrong.is_empty(), "{} places:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn every_fault_of_a_text_is_found() {
    let words = |count: usize| vec!["word"; count].join(" ");
    let faults = |text: &str| long_winded("a.md", text).len();
    assert_eq!(faults(&format!("# {}\n\n{}. {}.\n\n- {}\n", words(9), words(40), words(40), words(40))), 0);
    assert_eq!(faults(&format!("{}\n{}.\n", words(20), words(21))), 1, "over two lines");
    assert_eq!(faults(&format!("1. {}\n   {}\n2. {}\n", words(20), words(21), words(3))), 1, "in an item");
    assert_eq!(faults(&format!("[{}](a.md) `{}` {}.", words(20), words(20), words(19))), 0, "code is one word");
    assert_eq!(faults(&format!("| a | {} |\n|---|---|\n| `a|b` | {} |\n", words(30), words(31))), 1, "a cell");
    assert_eq!(faults("It ends. Sought are walls.\n\n**Stated is** more.\n\nWanted were 3.\n"), 3);
    assert_eq!(faults(&"word.\n".repeat(2_501)), 1, "a page");
    assert_eq!(faults(&format!("```\n{}\n```\n", words(99))), 0, "code");
}

/// What is wrong with the blocks of commands of a document; a test that is named has to be one of `tests`.
fn unmarked(name: &str, text: &str, is_test: impl Fn(&str) -> bool) -> Vec<String> {
    let mut wrong = Vec::new();
    for part in parts(text) {
        let Part::Code(above, lines) = part else { continue };
        let typed = |line: &&String| PROGRAMS.iter().any(|program| line.starts_with(program));
        let Some(command) = lines.iter().find(typed) else { continue };
        let remark = above.strip_prefix("<!-- ").and_then(|above| above.strip_suffix(" -->")).unwrap_or_default();
        let holds = match remark.strip_prefix("run by ") {
            Some(test) => is_test(test),
            None => remark.strip_prefix("not run: ").is_some_and(|reason| count(reason) > 1),
        };
        if !holds {
            let expected = "<!-- run by TEST --> or <!-- not run: REASON -->";
            wrong.push(format!("{name}: expected {expected} above `{command}`, found {above:?}"));
        }
    }
    wrong
}

#[test]
fn commands_are_run_by_a_test_or_say_why_not() {
    let is_test = |test: &str| !git(&["grep", "--name-only", &format!("fn {test}("), "--", "*.rs"]).is_empty();
    assert!(is_test("commands_are_run_by_a_test_or_say_why_not") && !is_test("no_such_test_is_anywhere"));
    let wrong: Vec<_> = documents().iter().flat_map(|(name, text)| unmarked(name, text, is_test)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_block_of_commands_without_a_mark_is_found() {
    let faults = |text: &str| unmarked("a.md", text, |test| test == "there").len();
    assert_eq!(faults("Do\n\n```\npromenade path a.csv\n```\n"), 1);
    assert_eq!(faults("1. Do\n   ```sh\n   cargo xtask test\n   ```\n"), 1, "in an item");
    assert_eq!(faults("<!-- run by nobody -->\n```\npython a.py\n```\n"), 1);
    assert_eq!(faults("<!-- not run: -->\n```\npython a.py\n```\n"), 1, "without a reason");
    assert_eq!(faults("<!-- run by there -->\n```\npython a.py\n```\n"), 0);
    assert_eq!(faults("<!-- not run: it serves -->\n```\npromenade web\n```\n"), 0);
    assert_eq!(faults("```\nwalk.csv: line 3\n```\n"), 0);
}
