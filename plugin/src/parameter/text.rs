//! Numbers as users type them, with or without a unit.

use super::cast::narrow;
use super::row::{Unit, Values};

/// Units as they are typed, in lower case, each with how many of the parameter's it is.
fn spellings(unit: Unit) -> &'static [(&'static str, f64)] {
    match unit {
        Unit::Metre => &[("", 1.0), ("m", 1.0), ("cm", 0.01), ("mm", 0.001)],
        Unit::Degree => &[("", 1.0), ("deg", 1.0), ("°", 1.0), ("degrees", 1.0)],
        Unit::Share => &[("", 0.01), ("%", 0.01)],
        Unit::Hertz => &[("", 1.0), ("hz", 1.0), ("k", 1e3), ("khz", 1e3)],
        Unit::Decibel => &[("", 1.0), ("db", 1.0)],
    }
}

/// The plain value of a text; `None` for what is no number in the unit. A whole turn goes round, and `-inf` is the least level.
pub fn number(values: Values, text: &str) -> Option<f32> {
    let Values::Number(unit, least, greatest) = values else { return None };
    let text = text.trim().to_lowercase().replace('\u{2212}', "-").replace(',', ".");
    let end = text.find(|c: char| !(c.is_ascii_digit() || "+-.".contains(c))).unwrap_or(text.len());
    let (digits, unit_text) = (&text[..end], text[end..].trim());
    if unit == Unit::Decibel && digits == "-" && ["inf", "inf db", "∞", "∞ db"].contains(&unit_text) {
        return Some(least);
    }
    let value: f64 = digits.parse().ok()?;
    let (_, factor) = spellings(unit).iter().find(|(spelling, _)| *spelling == unit_text)?;
    let value = narrow(value * factor);
    let turns = unit == Unit::Degree && greatest - least == 360.0;
    // What is within the limits stays as it is: both ends are the same direction.
    Some(if turns && !(least..=greatest).contains(&value) { (value - least).rem_euclid(360.0) + least } else { value })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::Parameter;

    #[test]
    fn numbers_are_read_as_they_are_typed() {
        let of = |parameter: Parameter, text| number(parameter.row().values, text);
        for (parameter, text, value) in [
            (Parameter::Gain, "-6dB", Some(-6.0)),
            (Parameter::Gain, " \u{2212}6,5 db ", Some(-6.5)),
            (Parameter::Gain, "-inf dB", Some(-60.0)),
            (Parameter::X, "2m", Some(2.0)),
            (Parameter::X, "-35 cm", Some(-0.35)),
            (Parameter::Rate, "1k", Some(1000.0)),
            (Parameter::Rate, ".1 kHz", Some(100.0)),
            (Parameter::Pitch, "30°", Some(30.0)),
            (Parameter::Yaw, "370", Some(10.0)),
            (Parameter::Yaw, "-181 deg", Some(179.0)),
            (Parameter::Yaw, "180", Some(180.0)),
            (Parameter::Mix, "50", Some(0.5)),
            (Parameter::Mix, "50 %", Some(0.5)),
        ] {
            assert_eq!(of(parameter, text), value, "{text}");
        }
        for text in ["nan", "inf", "", "dB", "2 Hz", "1e400", "--1", "1 2"] {
            assert_eq!(of(Parameter::Gain, text), None, "{text}");
        }
    }
}
