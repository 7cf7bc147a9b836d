//! Addresses of ADM-OSC, and what they are about.

use super::super::value::numbers;
use rosc::OscType;

/// What an address is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::osc) enum Part {
    /// One of x, y and z.
    Axis(usize),
    /// x and y.
    Xy,
    /// x, y and z.
    Xyz,
    /// One of azimuth, elevation and distance.
    Polar(usize),
    /// Azimuth, elevation and distance.
    Aed,
    /// Linear gain.
    Gain,
    /// Whether it is silent.
    Mute,
    /// Metres of a distance of 1.
    Dmax,
    /// The listener's place.
    ListenerXyz,
    /// The listener's yaw, pitch and roll.
    ListenerYpr,
    /// Of the specification, without effect here.
    Ignored,
}

impl Part {
    /// Whether it is about an object, not about the listener or everything.
    pub(in crate::osc) fn is_of_object(self) -> bool {
        !matches!(self, Self::ListenerXyz | Self::ListenerYpr | Self::Ignored)
    }

    /// How many values it has.
    fn count(self) -> usize {
        match self {
            Self::Xyz | Self::Aed | Self::ListenerXyz | Self::ListenerYpr => 3,
            Self::Xy => 2,
            _ => 1,
        }
    }

    /// The finite values of a message about it.
    ///
    /// # Errors
    /// A message on arguments that are no such values.
    pub(super) fn values(self, arguments: &[OscType]) -> Result<Vec<f64>, String> {
        let found = numbers(arguments)?;
        if found.len() != self.count() {
            return Err(format!("expected {} values, found {}", self.count(), found.len()));
        }
        match found.iter().find(|value| !value.is_finite()) {
            Some(odd) => Err(format!("expected finite numbers, found {odd}")),
            None => Ok(found),
        }
    }
}

/// The part that an address asks of an object of that number; `None` for addresses of others.
pub(in crate::osc) fn parse(address: &str, object: u32) -> Option<Part> {
    let after = address.strip_prefix("/adm/")?;
    if let Some(part) = after.strip_prefix("lis/") {
        return match part {
            "xyz" => Some(Part::ListenerXyz),
            "ypr" => Some(Part::ListenerYpr),
            _ => None,
        };
    }
    if after == "env/change" {
        return Some(Part::Ignored);
    }
    let (number, part) = after.strip_prefix("obj/")?.split_once('/')?;
    if !promenade_acoustics::fits(number, &object.to_string(), Some('?')) {
        return None;
    }
    Some(match part {
        "x" => Part::Axis(0),
        "y" => Part::Axis(1),
        "z" => Part::Axis(2),
        "xy" => Part::Xy,
        "xyz" => Part::Xyz,
        "azim" => Part::Polar(0),
        "elev" => Part::Polar(1),
        "dist" => Part::Polar(2),
        "aed" => Part::Aed,
        "gain" => Part::Gain,
        "mute" => Part::Mute,
        "dmax" => Part::Dmax,
        "w" | "dref" | "name" => Part::Ignored,
        _ => return None,
    })
}

/// An address with the number of one object; of the listener as it is.
pub(in crate::osc) fn address_of(address: &str, object: u32) -> String {
    let part = address.strip_prefix("/adm/obj/").and_then(|after| after.split_once('/'));
    part.map_or_else(|| address.to_owned(), |(_, part)| format!("/adm/obj/{object}/{part}"))
}
