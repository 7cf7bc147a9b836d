//! Arguments as numbers, and values of parameters in their units or as text.

use crate::parameter::{Parameter, cast::narrow, choices::Variants};
use rosc::OscType;

/// Arguments as numbers; arrays are opened.
///
/// # Errors
/// A message on the argument that is not a number.
pub(super) fn numbers(arguments: &[OscType]) -> Result<Vec<f64>, String> {
    let mut numbers = Vec::with_capacity(arguments.len());
    for argument in arguments {
        match argument {
            OscType::Array(array) => numbers.extend(self::numbers(&array.content)?),
            one => numbers.push(number(one)?),
        }
    }
    Ok(numbers)
}

fn number(argument: &OscType) -> Result<f64, String> {
    match argument {
        OscType::Int(value) => Ok(f64::from(*value)),
        OscType::Long(value) => Ok(*value as f64),
        OscType::Float(value) => Ok(f64::from(*value)),
        OscType::Double(value) => Ok(*value),
        OscType::Bool(value) => Ok(f64::from(u8::from(*value))),
        OscType::String(text) => text.trim().parse().map_err(|_| format!("expected a number, found {}", quoted(text))),
        other => Err(format!("expected a number, found {}", kind(other))),
    }
}

/// A parameter's plain value, as [`Parameter`] counts, and whether it was out of range and has been clamped.
///
/// # Errors
/// A message on the fault.
pub(super) fn plain(parameter: Parameter, arguments: &[OscType]) -> Result<(f32, bool), String> {
    let [argument] = arguments else { return Err(format!("expected 1 value, found {}", arguments.len())) };
    let value = match argument {
        OscType::String(text) => from_text(parameter, text.trim())?,
        other => number(other)?,
    };
    if !value.is_finite() {
        return Err(format!("expected a finite number, found {value}"));
    }
    if parameter.is_whole() && value.fract() != 0.0 {
        return Err(format!("expected a whole number, found {value}"));
    }
    let value = narrow(if parameter.is_share() { value / 100.0 } else { value });
    let (least, most) = parameter.limits();
    let kept = value.clamp(least, most);
    Ok((kept, kept != value))
}

fn from_text(parameter: Parameter, text: &str) -> Result<f64, String> {
    if let Ok(value) = text.parse::<f64>() {
        return Ok(value);
    }
    let same = |known: &&str| known.eq_ignore_ascii_case(text);
    if let Some(Variants { ids, names, .. }) = parameter.variants() {
        let found = ids.iter().position(&same).or_else(|| names.iter().position(&same));
        return found
            .map(|index| index as f64)
            .ok_or_else(|| format!("expected one of {}, found {}", ids.join(", "), quoted(text)));
    }
    if parameter.is_switch() {
        return match () {
            () if ["on", "true", "yes"].iter().any(same) => Ok(1.0),
            () if ["off", "false", "no"].iter().any(same) => Ok(0.0),
            () => Err(format!("expected on or off, found {}", quoted(text))),
        };
    }
    let unit = parameter.unit();
    let without = text.len().checked_sub(unit.len()).and_then(|end| text.split_at_checked(end));
    without
        .filter(|(_, end)| !unit.is_empty() && end.eq_ignore_ascii_case(unit))
        .and_then(|(value, _)| value.trim().parse().ok())
        .ok_or_else(|| format!("expected a number{}{unit}, found {}", if unit.is_empty() { "" } else { " of " }, quoted(text)))
}

/// The beginning of a text, for a reason.
fn quoted(text: &str) -> String {
    format!("{:?}", text.chars().take(40).collect::<String>())
}

fn kind(argument: &OscType) -> &'static str {
    match argument {
        OscType::Time(_) => "a time",
        OscType::Blob(_) => "a blob",
        OscType::Char(_) => "a character",
        OscType::Color(_) => "a colour",
        OscType::Midi(_) => "a MIDI message",
        OscType::Array(_) => "an array",
        OscType::Nil => "nothing",
        OscType::Inf => "an impulse",
        _ => "a number",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rosc::OscArray;

    fn text(text: &str) -> OscType {
        OscType::String(text.to_owned())
    }

    #[test]
    fn every_kind_of_number_is_one() {
        let all = [
            OscType::Int(1),
            OscType::Long(-2),
            OscType::Float(0.5),
            OscType::Double(0.25),
            text(" 3.5 "),
            OscType::Bool(true),
            OscType::Array(OscArray { content: vec![OscType::Int(7), OscType::Int(8)] }),
        ];
        assert_eq!(numbers(&all).unwrap(), [1.0, -2.0, 0.5, 0.25, 3.5, 1.0, 7.0, 8.0]);
        assert!(numbers(&[text("left")]).unwrap_err().contains("\"left\""));
        assert!(numbers(&[OscType::Nil]).unwrap_err().contains("nothing"));
    }

    #[test]
    fn values_come_in_their_units() {
        for (parameter, argument, wanted) in [
            (Parameter::Gain, OscType::Float(-6.0), -6.0),
            (Parameter::Gain, text("-6 dB"), -6.0),
            (Parameter::Mix, OscType::Int(25), 0.25),
            (Parameter::Mix, text("25%"), 0.25),
            (Parameter::Yaw, text("-90 deg"), -90.0),
            (Parameter::X, OscType::Double(1.5), 1.5),
            (Parameter::Rate, text("40hz"), 40.0),
            (Parameter::Latency, text("none"), 2.0),
            (Parameter::Tracking, text("Head and position"), 2.0),
            (Parameter::Follow, OscType::Float(2.0), 2.0),
            (Parameter::Scene, text("1"), 1.0),
            (Parameter::Bypass, OscType::Bool(true), 1.0),
            (Parameter::Lead, text("off"), 0.0),
            (Parameter::Offset, OscType::Int(1), 1.0),
            (Parameter::Slot, OscType::Int(12), 12.0),
        ] {
            assert_eq!(plain(parameter, std::slice::from_ref(&argument)), Ok((wanted, false)), "{parameter:?} {argument:?}");
        }
    }

    #[test]
    fn what_is_out_of_range_is_clamped_and_what_is_no_value_refused() {
        assert_eq!(plain(Parameter::Gain, &[OscType::Float(99.0)]), Ok((12.0, true)));
        assert_eq!(plain(Parameter::Mix, &[OscType::Float(-1.0)]), Ok((0.0, true)));
        assert_eq!(plain(Parameter::Latency, &[OscType::Int(9)]), Ok((2.0, true)));
        assert_eq!(plain(Parameter::X, &[OscType::Double(1e300)]), Ok((50.0, true)));
        for (parameter, argument, reason) in [
            (Parameter::Latency, text("best"), "frame, 64, none"),
            (Parameter::Latency, OscType::Float(1.5), "whole"),
            (Parameter::Gain, OscType::Float(f32::NAN), "finite"),
            (Parameter::Gain, text("-6 m"), "of dB"),
            (Parameter::Gain, text(""), "of dB"),
            (Parameter::Gain, text("ö"), "of dB"),
            (Parameter::Bypass, text("maybe"), "on or off"),
            (Parameter::Slot, text("first"), "a number"),
            (Parameter::X, OscType::Blob(vec![1]), "a blob"),
        ] {
            let found = plain(parameter, &[argument]).unwrap_err();
            assert!(found.contains(reason), "{found}");
        }
        assert!(plain(Parameter::X, &[]).unwrap_err().contains("1 value"));
    }
}
