//! Texts as editors and equalisers save them.

use super::HeadphonesError;
use super::autoeq::refused;

/// A text in UTF-8, or in UTF-16 as its first bytes say; without any, UTF-16 is known by the zeros of plain letters.
pub(super) fn text(bytes: &[u8]) -> Result<String, HeadphonesError> {
    let wide = |bytes: &[u8], unit: fn([u8; 2]) -> u16| {
        let units = bytes.as_chunks::<2>().0.iter().map(|pair| unit(*pair));
        char::decode_utf16(units)
            .collect::<Result<String, _>>()
            .map_err(|e| refused("text", "whole letters in UTF-16", e.to_string()))
    };
    match bytes {
        [0xff, 0xfe, rest @ ..] => wide(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => wide(rest, u16::from_be_bytes),
        [letter, 0, ..] if *letter != 0 => wide(bytes, u16::from_le_bytes),
        [0, letter, ..] if *letter != 0 => wide(bytes, u16::from_be_bytes),
        _ => match str::from_utf8(bytes) {
            Ok(text) => Ok(text.to_owned()),
            Err(e) => {
                Err(refused("text", "letters in UTF-8 or UTF-16", format!("another byte after {} bytes", e.valid_up_to())))
            }
        },
    }
}
