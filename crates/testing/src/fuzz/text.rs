//! Changes of texts: words, numbers and lines.

use fastrand::Rng;

/// Numbers and what stands in their place.
const NUMBERS: [&str; 26] = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "0.5",
    "1e9",
    "1e-9",
    "1e39",
    "-1e39",
    "1e308",
    "1e309",
    "1e-320",
    "NaN",
    "inf",
    "-inf",
    "255",
    "65536",
    "2147483648",
    "4294967295",
    "4294967296",
    "-9223372036854775808",
    "18446744073709551616",
    "0x10",
    "1,5",
    "",
];
/// What has a meaning in some form.
const ODD: [&str; 20] = [
    "\"",
    "'",
    "\\",
    "\0",
    "\u{feff}",
    "\r",
    "\n",
    "\t",
    " ",
    "#",
    "/",
    ",",
    ";",
    "\u{1f3a7}",
    "&amp;",
    "<a/>",
    "--",
    "[",
    "{",
    "]]>",
];

/// The text changed in one place; none if it is not a text.
pub(super) fn changed(rng: &mut Rng, bytes: &[u8]) -> Option<Vec<u8>> {
    let text = std::str::from_utf8(bytes).ok().filter(|text| !text.is_empty())?;
    let [few, many] = [300, 5000].map(|most| 1 + rng.usize(..most));
    let what = match rng.u8(0..8) {
        0..3 => return Some(number(rng, text).into_bytes()),
        3 => return Some(lines(rng, text).into_bytes()),
        4 => return Some(word(rng, text).into_bytes()),
        5 => ODD[rng.usize(..ODD.len())].to_owned(),
        6 => ["[", "{\"a\":", "<a>", "("][rng.usize(..4)].repeat(few),
        _ => ["7", "x", " ", "9.", "\n"][rng.usize(..5)].repeat(many),
    };
    let changed = insert(rng, text, &what);
    Some(changed.into_bytes())
}

/// Another number in the place of one.
fn number(rng: &mut Rng, text: &str) -> String {
    let part = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+');
    replaced(rng, text, part, |rng, _| NUMBERS[rng.usize(..NUMBERS.len())].to_owned())
}

/// A word lost, twice there, or as another.
fn word(rng: &mut Rng, text: &str) -> String {
    replaced(
        rng,
        text,
        |c| c.is_alphanumeric() || c == '_',
        |rng, word| match rng.u8(0..4) {
            0 => String::new(),
            1 => format!("{word} {word}"),
            2 => word.to_uppercase(),
            _ => ["null", "true", "e", "Infinity", "float", "list", "end_header"][rng.usize(..7)].to_owned(),
        },
    )
}

/// A run of such characters, drawn, as something else.
fn replaced(rng: &mut Rng, text: &str, part: impl Fn(char) -> bool, by: impl Fn(&mut Rng, &str) -> String) -> String {
    let mut runs = Vec::new();
    let mut start = None;
    for (at, c) in text.char_indices().chain([(text.len(), '\u{1}')]) {
        match start {
            None if part(c) => start = Some(at),
            Some(from) if !part(c) => {
                runs.push(from..at);
                start = None;
            }
            _ => (),
        }
    }
    if runs.is_empty() {
        return text.to_owned();
    }
    let run = runs[rng.usize(..runs.len())].clone();
    let new = by(rng, &text[run.clone()]);
    [&text[..run.start], &new, &text[run.end..]].concat()
}

/// A line lost, repeated, or in another place.
fn lines(rng: &mut Rng, text: &str) -> String {
    let mut lines: Vec<&str> = text.split_inclusive(['\n', '>', '}']).collect();
    let at = rng.usize(..lines.len());
    match rng.u8(0..4) {
        0 => drop(lines.remove(at)),
        1 => lines.insert(at, lines[at]),
        2 => {
            let line = lines[at];
            lines.splice(at..at, std::iter::repeat_n(line, 1 + rng.usize(..100)));
        }
        _ => {
            let to = rng.usize(..lines.len());
            lines.swap(at, to);
        }
    }
    lines.concat()
}

fn insert(rng: &mut Rng, text: &str, what: &str) -> String {
    let mut at = rng.usize(..=text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    [&text[..at], what, &text[at..]].concat()
}
