//! Command lines that the repository's documents tell a reader to type.

use std::fs;
use std::path::{Path, PathBuf};

/// The words of each command line that begins with a program, without it, and the document that has it. Lines that leave
/// something out (`...`) are no command lines; a variable of the shell is 1.
///
/// # Panics
/// A document cannot be read.
#[must_use]
pub fn commands(program: &str) -> Vec<(PathBuf, Vec<String>)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut found = Vec::new();
    for folder in ["", "docs", "presets"] {
        for entry in fs::read_dir(root.join(folder)).expect("the folder is there") {
            let path = entry.expect("the folder can be read").path();
            if path.extension().is_some_and(|ending| ending == "md") {
                let text = fs::read_to_string(&path).expect("a document is text");
                found.extend(commands_of(&text, program).into_iter().map(|words| (path.clone(), words)));
            }
        }
    }
    found
}

/// The command lines of a program in the fenced blocks of a text.
fn commands_of(text: &str, program: &str) -> Vec<Vec<String>> {
    let blocks = text.replace("\\\n", " ");
    let code = blocks.split("```").skip(1).step_by(2).flat_map(str::lines);
    let lines = code.flat_map(|line| line.split(" && ")).map(str::trim);
    let of_program = lines.filter_map(|line| line.strip_prefix(program)?.strip_prefix(' '));
    of_program.map(words).filter(|words| !words.iter().any(|word| word.contains("..."))).collect()
}

/// The words of a line as a shell has them, up to a remark.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None);
    let mut letters = line.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            _ if quote == Some(letter) => quote = None,
            '"' | '\'' if quote.is_none() => {
                quote = Some(letter);
                word.get_or_insert_default();
            }
            '#' if word.is_none() && quote.is_none() => break,
            ' ' if quote.is_none() => words.extend(word.take()),
            '$' if quote != Some('\'') => {
                while letters.next_if(|next| next.is_alphanumeric() || *next == '_').is_some() {}
                word.get_or_insert_default().push('1');
            }
            _ => word.get_or_insert_default().push(letter),
        }
    }
    words.extend(word);
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_words_as_a_shell_has_them() {
        let text = "`promenade a`\n\n```\npromenade b 'c d'  # e\nfor y in 1; do\n  promenade f \\\n    \"g\"$y,h#i && \
                    promenade j\npromenade k ...\npromenade-player l\n```\npromenade m\n";
        assert_eq!(commands_of(text, "promenade"), [vec!["b", "c d"], vec!["f", "g1,h#i"], vec!["j"]]);
    }
}
