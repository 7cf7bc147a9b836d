//! What the names of sound files say, where nobody has written it down: a pattern with the fields in their numbers.

use super::pattern::{Field, number, number_length};

/// Lengths from here on are no metres, and from there on no centimetres either.
const LEAST_CENTIMETRES: f64 = 20.0;
const LEAST_MILLIMETRES: f64 = 2_000.0;

/// Words before a number, in small letters, and what it is then.
const WORDS: [(Field, &[&str]); 9] = [
    (Field::Azimuth, &["azimuth", "azim", "azi", "az", "a", "phi", "t"]),
    (Field::Elevation, &["elevation", "elev", "ele", "el", "e", "theta", "p"]),
    (Field::Distance, &["distance", "dist", "d", "radius", "r"]),
    (Field::Yaw, &["yaw", "turn", "head", "rotation", "rot"]),
    (Field::Pitch, &["pitch"]),
    (Field::Roll, &["roll"]),
    (Field::X, &["x"]),
    (Field::Y, &["y"]),
    (Field::Z, &["z"]),
];

/// A pattern for all names.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Named {
    pub(super) pattern: String,
    pub(super) fields: Vec<Field>,
    /// Metres of a unit of its lengths.
    pub(super) length_unit_m: f64,
    /// What was assumed.
    pub(super) notes: Vec<String>,
}

/// A name as texts and numbers in turn; a number has its sign apart.
struct Parts {
    texts: Vec<String>,
    signs: Vec<Option<char>>,
    numbers: Vec<String>,
}

impl Parts {
    fn of(name: &str) -> Self {
        let (mut parts, mut text, mut rest) = (Self { texts: vec![], signs: vec![], numbers: vec![] }, String::new(), name);
        while let Some(first) = rest.chars().next() {
            if first.is_ascii_digit() {
                let length = number_length(rest);
                parts.numbers.push(rest[..length].to_owned());
                let sign = text.chars().last().filter(|c| matches!(c, '+' | '-'));
                if sign.is_some() {
                    text.pop();
                }
                parts.signs.push(sign);
                parts.texts.push(std::mem::take(&mut text));
                rest = &rest[length..];
            } else {
                text.push(first);
                rest = &rest[first.len_utf8()..];
            }
        }
        parts.texts.push(text);
        parts
    }
}

/// The pattern of some names, or what is wrong with them.
pub(super) fn pattern_of(names: &[String]) -> Result<Named, String> {
    let all: Vec<Parts> = names.iter().map(|n| Parts::of(n)).collect();
    let (Some(first), Some(example)) = (all.first(), names.first()) else { return Err("no sound files".to_owned()) };
    if let Some(other) = all.iter().position(|p| p.texts != first.texts) {
        return Err(format!("names of several forms, {example} and {}", names[other]));
    }
    let mut named = Named { pattern: String::new(), fields: vec![], length_unit_m: 1.0, notes: vec![] };
    let (mut longest, mut written_unit) = (0.0_f64, None);
    for slot in 0..first.numbers.len() {
        let (before, after) = (&first.texts[slot], &first.texts[slot + 1]);
        named.pattern += before;
        // A sign that all numbers have is a hyphen between words.
        let hyphen = first.signs[slot].filter(|sign| all.iter().all(|p| p.signs[slot] == Some(*sign)) && names.len() > 1);
        let value = |p: &Parts| {
            let sign = if hyphen.is_none() && p.signs[slot] == Some('-') { -1.0 } else { 1.0 };
            sign * number(&p.numbers[slot]).unwrap_or(0.0)
        };
        named.pattern.extend(hyphen);
        let varies = all.iter().any(|p| value(p) != value(first));
        let angle = starts_with_word(after, &["deg", "degrees", "degree", "\u{b0}"]);
        let field = by_word(before).or((varies && angle).then_some(Field::Azimuth)).filter(|f| !named.fields.contains(f));
        let field = match field {
            None if varies && all.iter().all(|p| value(p).abs() <= 360.0) && !named.fields.contains(&Field::Azimuth) => {
                named.notes.push(format!("the number {} in {example} was taken for an azimuth", first.numbers[slot]));
                Some(Field::Azimuth)
            }
            None if varies => {
                return Err(format!("the number {} in {example}, of which no word says what it is", first.numbers[slot]));
            }
            field => field,
        };
        let Some(field) = field else {
            named.pattern.extend(first.signs[slot].filter(|_| hyphen.is_none()));
            named.pattern += &first.numbers[slot];
            continue;
        };
        if matches!(field, Field::Distance | Field::X | Field::Y | Field::Z) {
            longest = all.iter().map(|p| value(p).abs()).fold(longest, f64::max);
            let units = [("cm", 0.01), ("mm", 0.001), ("m", 1.0)];
            written_unit = written_unit.or(units.iter().find(|(unit, _)| starts_with_word(after, &[unit])).map(|u| u.1));
        }
        named.pattern += &format!("{{{}}}", field.name());
        named.fields.push(field);
    }
    named.pattern += &first.texts[first.numbers.len()];
    named.length_unit_m = written_unit.unwrap_or_else(|| {
        let (unit, name) = match longest {
            v if v >= LEAST_MILLIMETRES => (0.001, "millimetres"),
            v if v >= LEAST_CENTIMETRES => (0.01, "centimetres"),
            _ => return 1.0,
        };
        named.notes.push(format!("lengths of up to {longest} in the names were taken for {name}"));
        unit
    });
    if named.fields.is_empty() {
        return Err(format!("names in which no number says where it was measured, such as {example}"));
    }
    Ok(named)
}

/// What the word before a number says.
fn by_word(before: &str) -> Option<Field> {
    let trimmed = before.trim_end_matches(['_', '-', '=', ' ', '.']);
    let start = trimmed
        .rfind(|c: char| !c.is_ascii_alphabetic())
        .map_or(0, |i| i + trimmed[i..].chars().next().map_or(1, char::len_utf8));
    let word = trimmed[start..].to_ascii_lowercase();
    WORDS.iter().find(|(_, words)| words.contains(&&word[..])).map(|(field, _)| *field)
}

/// Whether a text begins with one of some words.
fn starts_with_word(text: &str, words: &[&str]) -> bool {
    let end = text.find(|c: char| !c.is_alphabetic() && c != '\u{b0}').unwrap_or(text.len());
    words.contains(&&text[..end])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(names: &[&str]) -> Result<Named, String> {
        pattern_of(&names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn words_and_units_say_what_numbers_are() {
        for (names, pattern, unit) in [
            (&["Brir_0_32s_-5deg_16k.wav", "Brir_0_32s_10deg_16k.wav"][..], "Brir_0_32s_{azimuth}deg_16k.wav", 1.0),
            (&["azi_30_dist_150.wav", "azi_60_dist_300.wav"], "azi_{azimuth}_dist_{distance}.wav", 0.01),
            (&["az30_ele-15.wav", "az60_ele0.wav"], "az{azimuth}_ele{elevation}.wav", 1.0),
            (&["x1.5_y2_yaw+30.wav", "x2_y2_yaw-30.wav"], "x{x}_y{y}_yaw{yaw}.wav", 1.0),
            (&["hall-010.wav", "hall-350.wav"], "hall-{azimuth}.wav", 1.0),
            // LISTEN (IRCAM) and SADIE (York).
            (
                &["IRC_1002_C_R0195_T030_P315.wav", "IRC_1002_C_R0195_T045_P000.wav"],
                "IRC_1002_C_R{distance}_T{azimuth}_P{elevation}.wav",
                0.01,
            ),
            (&["azi_0,0_ele_-10,5.wav", "azi_5,5_ele_0,0.wav"], "azi_{azimuth}_ele_{elevation}.wav", 1.0),
            (&["d 1500mm az 5.wav", "d 2500mm az 9.wav"], "d {distance}mm az {azimuth}.wav", 0.001),
        ] {
            let found = of(names).unwrap();
            assert_eq!((&found.pattern[..], found.length_unit_m), (pattern, unit), "{:?}", found.notes);
        }
        assert!(of(&["hall-010.wav", "hall-350.wav"]).unwrap().notes[0].contains("the number 010 in hall-010.wav"));
    }

    #[test]
    fn what_names_do_not_say_is_said() {
        for (names, clue) in [
            (&["a1.wav", "b2.wav"][..], "names of several forms, a1.wav and b2.wav"),
            (&["left.wav"], "no number says where it was measured, such as left.wav"),
            (&["take1_az5.wav", "take500_az9.wav"], "the number 1 in take1_az5.wav, of which no word says what it is"),
            (&[], "no sound files"),
        ] {
            let error = of(names).unwrap_err();
            assert!(error.contains(clue), "{error}");
        }
    }
}
