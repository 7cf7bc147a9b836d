//! What the files of a crate name, read from its sources as far as the tests of the architecture need it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Names with `::` between them.
pub type Names = Vec<String>;

/// A file of a crate, without its tests.
#[derive(Debug)]
pub struct Source {
    /// The path of the file.
    pub file: PathBuf,
    /// All paths that it names, in `use` and elsewhere, each with its line. A glob ends in `*`.
    pub paths: Vec<(usize, Names)>,
    /// What it hands on: paths by their names here.
    pub exports: BTreeMap<String, Names>,
    /// All names in it but those in `use`.
    pub names: BTreeSet<String>,
    /// The macros that it calls, each with its line.
    pub macros: Vec<(usize, String)>,
    /// What it reads of values: the names behind a dot, of fields and methods.
    pub members: BTreeSet<String>,
}

/// The folder of a crate of this repository, by the folder's name: at the root or in `crates/`.
#[must_use]
pub fn folder(name: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    [root.join(name), root.join("crates").join(name)].into_iter().find(|f| f.join("Cargo.toml").exists()).unwrap_or_default()
}

/// The names of the folders of all crates.
///
/// # Panics
/// They cannot be read.
#[must_use]
pub fn members() -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let entries = [root.clone(), root.join("crates")].into_iter().flat_map(|folder| fs::read_dir(folder).unwrap());
    let packages = entries.map(Result::unwrap).filter(|entry| entry.path().join("Cargo.toml").exists());
    let names: Vec<String> = packages.map(|entry| entry.file_name().into_string().unwrap()).collect();
    assert!(names.len() > 10 && ["core", "judge"].iter().all(|name| names.iter().any(|n| n == name)), "{names:?}");
    names
}

/// The files of a crate by module; the root is the module without a name.
///
/// # Panics
/// They cannot be read.
#[must_use]
pub fn of_crate(folder: &Path) -> BTreeMap<Names, Source> {
    let source = folder.join("src");
    let mut found = BTreeMap::new();
    collect(&source, &mut Vec::new(), &mut found);
    assert!(found.contains_key(&Names::new()), "{} has no root", source.display());
    found
}

fn collect(folder: &Path, module: &mut Names, found: &mut BTreeMap<Names, Source>) {
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let (path, name) = (entry.path(), entry.file_name().into_string().unwrap());
        if path.is_dir() {
            module.push(name);
            collect(&path, module, found);
            module.pop();
        } else if let Some(stem) = name.strip_suffix(".rs").filter(|stem| !stem.ends_with("tests")) {
            let mut here = module.clone();
            if !(stem == "mod" || module.is_empty() && ["lib", "main"].contains(&stem)) {
                here.push(stem.to_owned());
            }
            found.insert(here, read(&path));
        }
    }
}

fn read(file: &Path) -> Source {
    let text = fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let tokens = without_tests(&tokens(&text));
    let members =
        tokens.windows(2).filter(|pair| pair[0].1 == "." && is_name(&pair[1].1)).map(|pair| pair[1].1.clone()).collect();
    let (paths, exports, names, macros) = (Vec::new(), BTreeMap::new(), BTreeSet::new(), Vec::new());
    let mut source = Source { file: file.to_owned(), paths, exports, names, macros, members };
    let mut at = 0;
    while let Some((line, token)) = tokens.get(at) {
        let follows = |n: usize, what: &str| tokens.get(at + n).is_some_and(|(_, token)| token == what);
        if token != "use" && is_name(token) {
            source.names.insert(token.clone());
        }
        if token == "use" {
            let public = at > 0 && ["pub", ")"].contains(&tokens[at - 1].1.as_str());
            let mut paths = Vec::new();
            at = tree(&tokens, at + 1, &Vec::new(), &mut paths);
            for (line, name, path) in paths {
                if public {
                    source.exports.insert(name, path.clone());
                }
                source.paths.push((line, path));
            }
        } else if is_name(token) && follows(1, "!") {
            source.macros.push((*line, token.clone()));
            at += 2;
        } else if is_name(token) && follows(1, "::") {
            let mut path = vec![token.clone()];
            while tokens.get(at + 1).is_some_and(|t| t.1 == "::") && tokens.get(at + 2).is_some_and(|t| is_name(&t.1)) {
                path.push(tokens[at + 2].1.clone());
                at += 2;
            }
            source.paths.push((*line, path));
            at += 1;
        } else {
            at += 1;
        }
    }
    source
}

/// Reads one branch of a `use`; returns where the next token is.
fn tree(tokens: &[(usize, String)], mut at: usize, stem: &Names, paths: &mut Vec<(usize, String, Names)>) -> usize {
    let mut path = stem.clone();
    loop {
        let (line, token) = &tokens[at];
        match token.as_str() {
            "{" => {
                at += 1;
                while tokens[at].1 != "}" {
                    at = tree(tokens, at, &path, paths);
                    at += usize::from(tokens[at].1 == ",");
                }
                return at + 1;
            }
            "::" => at += 1,
            name => {
                // `self` within braces is what stands before them.
                if name != "self" || path.is_empty() {
                    path.push(name.to_owned());
                }
                at += 1;
                if tokens[at].1 == "::" {
                    continue;
                }
                let mut as_name = path.last().cloned().unwrap_or_default();
                if tokens[at].1 == "as" {
                    as_name.clone_from(&tokens[at + 1].1);
                    at += 2;
                }
                paths.push((*line, as_name, path));
                return at;
            }
        }
    }
}

fn is_name(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Names, `::` and single marks, each with its line; no comments, texts and numbers.
fn tokens(text: &str) -> Vec<(usize, String)> {
    let (bytes, mut at, mut line, mut found) = (text.as_bytes(), 0, 1, Vec::new());
    let starts = |at: usize, what: &str| text[at..].starts_with(what);
    while at < bytes.len() {
        let start = at;
        let mut token = false;
        match bytes[at] {
            b'/' if starts(at, "//") => at += text[at..].find('\n').unwrap_or(text.len() - at),
            b'r' if starts(at, "r\"") || starts(at, "r#\"") => {
                let end = if starts(at, "r\"") { "\"" } else { "\"#" };
                at += 3;
                at += text[at..].find(end).unwrap() + end.len();
            }
            b'"' => {
                at += 1;
                while bytes[at] != b'"' {
                    at += if bytes[at] == b'\\' { 2 } else { 1 };
                }
                at += 1;
            }
            // A character, and not a lifetime.
            b'\'' if bytes[at + 1] == b'\\' => at += 3 + text[at + 3..].find('\'').unwrap(),
            b'\'' if text[at + 1..].chars().nth(1) == Some('\'') => at += 2 + text[at + 1..].chars().next().unwrap().len_utf8(),
            b':' if starts(at, "::") => (at, token) = (at + 2, true),
            byte if byte.is_ascii_alphanumeric() || byte == b'_' => {
                at += text[at..].bytes().take_while(|b| b.is_ascii_alphanumeric() || *b == b'_').count();
                token = !byte.is_ascii_digit();
            }
            byte => {
                at += text[at..].chars().next().unwrap().len_utf8();
                token = byte.is_ascii_punctuation();
            }
        }
        if token {
            found.push((line, text[start..at].to_owned()));
        }
        line += text[start..at].matches('\n').count();
    }
    found
}

/// Leaves out items under `#[cfg(test)]`.
fn without_tests(tokens: &[(usize, String)]) -> Vec<(usize, String)> {
    let (mut kept, mut at) = (Vec::new(), 0);
    while at < tokens.len() {
        if !tokens[at..].iter().map(|t| t.1.as_str()).take(7).eq(["#", "[", "cfg", "(", "test", ")", "]"]) {
            kept.push(tokens[at].clone());
            at += 1;
            continue;
        }
        let mut depth = 0;
        at += 7;
        loop {
            let token = tokens[at].1.as_str();
            at += 1;
            depth += i32::from(token == "{") - i32::from(token == "}");
            if depth == 0 && ["}", ";"].contains(&token) {
                break;
            }
        }
    }
    kept
}
