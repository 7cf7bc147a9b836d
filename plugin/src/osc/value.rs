//! Arguments as numbers, and values of parameters in their units or as text.

use crate::params::{Follow, GroupChoice, PromenadeParams, SceneChoice, TierChoice, TrackingChoice};
use crate::remote::Knob;
use nice_plug::prelude::Enum;
use rosc::OscType;

/// Arguments as numbers; arrays are opened.
///
/// # Errors
/// The reason in words: an argument that is no number.
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
        #[expect(clippy::cast_precision_loss, reason = "no value of a parameter or pose is that large")]
        OscType::Long(value) => Ok(*value as f64),
        OscType::Float(value) => Ok(f64::from(*value)),
        OscType::Double(value) => Ok(*value),
        OscType::Bool(value) => Ok(f64::from(u8::from(*value))),
        OscType::String(text) => text.trim().parse().map_err(|_| format!("expected a number, found {}", quoted(text))),
        other => Err(format!("expected a number, found {}", kind(other))),
    }
}

/// A parameter's plain value, as [`PromenadeParams::hosted`] counts, and whether it was out of range and has been clamped.
///
/// # Errors
/// The reason in words.
pub(super) fn plain(knob: Knob, arguments: &[OscType]) -> Result<(f32, bool), String> {
    let [argument] = arguments else { return Err(format!("expected 1 value, found {}", arguments.len())) };
    let value = match argument {
        OscType::String(text) => from_text(knob, text.trim())?,
        other => number(other)?,
    };
    if !value.is_finite() {
        return Err(format!("expected a finite number, found {value}"));
    }
    if knob.is_whole() && value.fract() != 0.0 {
        return Err(format!("expected a whole number, found {value}"));
    }
    #[expect(clippy::cast_possible_truncation, reason = "clamped to the range of a parameter next")]
    let value = (if is_percent(knob) { value / 100.0 } else { value }) as f32;
    let (least, most) = PromenadeParams::limits(knob);
    let kept = value.clamp(least, most);
    Ok((kept, kept != value))
}

/// Whether a parameter is a share of 1 that is written in per cent.
pub(super) fn is_percent(knob: Knob) -> bool {
    matches!(knob, Knob::Path | Knob::Mix)
}

/// The unit of a parameter's values, or nothing.
pub(super) fn unit(knob: Knob) -> &'static str {
    match knob {
        Knob::X | Knob::Y | Knob::Z | Knob::Ex | Knob::Ey | Knob::Ez => "m",
        Knob::Yaw | Knob::Pitch | Knob::Roll => "deg",
        Knob::Path | Knob::Mix => "%",
        Knob::Rate => "Hz",
        Knob::Gain => "dB",
        _ => "",
    }
}

/// The ids and the names of a choice.
pub(super) fn choices(knob: Knob) -> Option<(&'static [&'static str], &'static [&'static str])> {
    fn of<T: Enum + 'static>() -> Option<(&'static [&'static str], &'static [&'static str])> {
        Some((T::ids()?, T::variants()))
    }
    match knob {
        Knob::Follow => of::<Follow>(),
        Knob::Tracking => of::<TrackingChoice>(),
        Knob::Group => of::<GroupChoice>(),
        Knob::Tier => of::<TierChoice>(),
        Knob::Scene => of::<SceneChoice>(),
        _ => None,
    }
}

/// Whether a parameter is on or off.
pub(super) fn is_switch(knob: Knob) -> bool {
    matches!(knob, Knob::Offset | Knob::Lead | Knob::Bypass)
}

fn from_text(knob: Knob, text: &str) -> Result<f64, String> {
    if let Ok(value) = text.parse::<f64>() {
        return Ok(value);
    }
    let same = |known: &&str| known.eq_ignore_ascii_case(text);
    if let Some((ids, names)) = choices(knob) {
        let found = ids.iter().position(&same).or_else(|| names.iter().position(&same));
        #[expect(clippy::cast_precision_loss, reason = "a few choices")]
        return found
            .map(|index| index as f64)
            .ok_or_else(|| format!("expected one of {}, found {}", ids.join(", "), quoted(text)));
    }
    if is_switch(knob) {
        return match () {
            () if ["on", "true", "yes"].iter().any(same) => Ok(1.0),
            () if ["off", "false", "no"].iter().any(same) => Ok(0.0),
            () => Err(format!("expected on or off, found {}", quoted(text))),
        };
    }
    let unit = unit(knob);
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
        for (knob, argument, wanted) in [
            (Knob::Gain, OscType::Float(-6.0), -6.0),
            (Knob::Gain, text("-6 dB"), -6.0),
            (Knob::Mix, OscType::Int(25), 0.25),
            (Knob::Mix, text("25%"), 0.25),
            (Knob::Yaw, text("-90 deg"), -90.0),
            (Knob::X, OscType::Double(1.5), 1.5),
            (Knob::Rate, text("40hz"), 40.0),
            (Knob::Tier, text("reference"), 3.0),
            (Knob::Tracking, text("Head and position"), 2.0),
            (Knob::Follow, OscType::Float(2.0), 2.0),
            (Knob::Scene, text("1"), 1.0),
            (Knob::Bypass, OscType::Bool(true), 1.0),
            (Knob::Lead, text("off"), 0.0),
            (Knob::Offset, OscType::Int(1), 1.0),
            (Knob::Slot, OscType::Int(12), 12.0),
        ] {
            assert_eq!(plain(knob, std::slice::from_ref(&argument)), Ok((wanted, false)), "{knob:?} {argument:?}");
        }
    }

    #[test]
    fn what_is_out_of_range_is_clamped_and_what_is_no_value_refused() {
        assert_eq!(plain(Knob::Gain, &[OscType::Float(99.0)]), Ok((12.0, true)));
        assert_eq!(plain(Knob::Mix, &[OscType::Float(-1.0)]), Ok((0.0, true)));
        assert_eq!(plain(Knob::Tier, &[OscType::Int(9)]), Ok((3.0, true)));
        assert_eq!(plain(Knob::X, &[OscType::Double(1e300)]), Ok((50.0, true)));
        for (knob, argument, reason) in [
            (Knob::Tier, text("best"), "draft, standard, high, reference"),
            (Knob::Tier, OscType::Float(1.5), "whole"),
            (Knob::Gain, OscType::Float(f32::NAN), "finite"),
            (Knob::Gain, text("-6 m"), "of dB"),
            (Knob::Gain, text(""), "of dB"),
            (Knob::Gain, text("ö"), "of dB"),
            (Knob::Bypass, text("maybe"), "on or off"),
            (Knob::Slot, text("first"), "a number"),
            (Knob::X, OscType::Blob(vec![1]), "a blob"),
        ] {
            let found = plain(knob, &[argument]).unwrap_err();
            assert!(found.contains(reason), "{found}");
        }
        assert!(plain(Knob::X, &[]).unwrap_err().contains("1 value"));
    }

    #[test]
    fn every_whole_parameter_is_a_choice_a_switch_or_a_number_of_a_file() {
        for knob in Knob::ALL {
            let known = choices(knob).is_some() || is_switch(knob) || matches!(knob, Knob::Slot | Knob::Walk);
            assert_eq!(known, knob.is_whole(), "{knob:?}");
            assert_eq!(unit(knob).is_empty(), knob.is_whole(), "{knob:?}");
        }
    }
}
