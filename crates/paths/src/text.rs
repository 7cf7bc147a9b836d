//! Text of files: what is checked before anything is parsed, and numbers that are written.

use crate::PathFileError;

/// The bytes as text, without a byte order mark.
pub(crate) fn of<'a>(file: &str, bytes: &'a [u8]) -> Result<&'a str, PathFileError> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let line = 1 + bytes.iter().take(e.valid_up_to()).filter(|b| **b == b'\n').count();
        let found = bytes.get(e.valid_up_to()).map_or("nothing".to_owned(), |b| format!("the byte {b:#04x}"));
        PathFileError::entry(file, format!("line {line}"), "text in UTF-8", found)
    })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

/// What a user wrote, quoted and short enough for an error in one line.
pub(crate) fn quoted(text: &str) -> String {
    const LONGEST: usize = 60;
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{:?}...", &text[..end]),
        None => format!("{text:?}"),
    }
}

/// A finite number, or what is wrong.
pub(crate) fn number(file: &str, line: u64, name: &str, field: &str) -> Result<f64, PathFileError> {
    let value = field.parse::<f64>().ok().filter(|v| v.is_finite());
    value
        .ok_or_else(|| PathFileError::entry(file, format!("line {line}"), format!("a finite number for {name}"), quoted(field)))
}

/// An angle in degrees to 1e-7 rad, which is as fine as orientations are, as short as that allows and without a negative zero.
pub(crate) fn decimal(degrees: f64) -> String {
    let text = format!("{degrees:.5}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".to_owned() } else { short.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn says_where_text_stops_being_text() {
        let error = of("a.csv", b"t\n0\n\xff").unwrap_err().to_string();
        assert_eq!(error, "a.csv: line 3: expected text in UTF-8, found the byte 0xff");
        assert_eq!(of("a.csv", b"\xef\xbb\xbft").unwrap(), "t");
    }

    #[test]
    fn long_words_are_cut_between_characters() {
        assert_eq!(quoted("ab"), "\"ab\"");
        assert_eq!(quoted(&"é".repeat(100)), format!("\"{}\"...", "é".repeat(60)));
    }

    #[test]
    fn numbers_are_finite() {
        assert_eq!(number("a", 1, "x", "-1.5e2").unwrap(), -150.0);
        for wrong in ["", "nan", "inf", "1e999", "0,5"] {
            let error = number("a.csv", 7, "x", wrong).unwrap_err().to_string();
            assert_eq!(error, format!("a.csv: line 7: expected a finite number for x, found \"{wrong}\""));
        }
    }
}
