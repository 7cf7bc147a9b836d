//! Values on the command line: what they must look like, in words.

use promenade_baker::reconstruction::Landmark;
use promenade_baker::simulation::Part;
use promenade_core::glam::Vec3;
use promenade_core::published::Projection;
use promenade_paths::Origin;
use promenade_player::command::values;

pub(super) use values::{point as parse_point, pose as parse_pose};

pub(super) fn parse_bounds(text: &str) -> Result<(Vec3, Vec3), String> {
    let [a, b, c, d, e, f] = values::numbers(text, "x,y,z of the lower and of the upper corner")?;
    let (low, high) = (Vec3::new(a, b, c), Vec3::new(d, e, f));
    if low.cmple(high).all() {
        Ok((low, high))
    } else {
        Err(format!("expected the lower corner first, found {low} and {high}"))
    }
}

/// Parses the lengths of a box: `X,Y,Z`, or `XxYxZ` as drawings have them.
pub(super) fn parse_lengths(text: &str) -> Result<Vec3, String> {
    parse_point(&text.replace('x', ","))
}

pub(super) fn parse_pair(text: &str) -> Result<(f32, f32), String> {
    values::numbers(text, "low,high").map(|[low, high]| (low, high))
}

/// Parses the size of a picture.
pub(super) fn parse_pixels(text: &str) -> Result<[usize; 2], String> {
    let [width, height] = values::numbers::<f32, 2>(&text.replace('x', ","), "width,height")?;
    let fits = |n: f32| (1.0..=8192.0).contains(&n) && n.fract() == 0.0;
    if fits(width) && fits(height) {
        Ok([width as usize, height as usize])
    } else {
        Err(format!("expected a width and a height of 1 to 8192 pixels, found {text}"))
    }
}

/// Yaw and pitch, degrees.
pub(super) fn parse_facing(text: &str) -> Result<[f64; 2], String> {
    values::numbers::<f64, 2>(text, "yaw,pitch")
}

/// Parses `K/N`, the `K`th of `N` parts.
pub(super) fn parse_part(text: &str) -> Result<Part, String> {
    let numbers = text.split_once('/').map(|(k, n)| (k.trim().parse::<u32>(), n.trim().parse::<u32>()));
    match numbers {
        Some((Ok(number), Ok(of))) if (1..=of).contains(&number) => Ok(Part { number, of }),
        _ => Err("expected K/N, part K of N, from 1/N to N/N".to_owned()),
    }
}

/// Parses an axis such as `-y`, or `X,Y,Z`.
pub(super) fn parse_direction(text: &str) -> Result<Vec3, String> {
    let (sign, axis) = text.strip_prefix('-').map_or((1.0, text), |axis| (-1.0, axis));
    let axis = ["x", "y", "z"].iter().position(|name| axis.eq_ignore_ascii_case(name));
    let direction = match axis {
        Some(axis) => sign * Vec3::AXES[axis],
        None => parse_point(text).map_err(|why| format!("expected an axis such as y, or a direction: {why}"))?,
    };
    direction.try_normalize().ok_or_else(|| "expected a direction, found no length".to_owned())
}

/// Parses one of some names.
pub(super) fn named<T>(from: fn(&str) -> Option<T>, names: &'static str) -> impl Fn(&str) -> Result<T, String> + Clone {
    move |text| from(text).ok_or_else(|| format!("expected {names}"))
}

pub(super) fn parse_projection(text: &str) -> Result<Projection, String> {
    let wrong = || "expected diagonal or row=N".to_owned();
    match text.strip_prefix("row=") {
        None if text == "diagonal" => Ok(Projection::Diagonal),
        row => row.and_then(|n| n.parse().ok()).map(Projection::Row).ok_or_else(wrong),
    }
}

/// Parses numbers between two others.
pub(super) fn within<T>(low: T, high: T) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: Copy + std::str::FromStr + PartialOrd + std::fmt::Display + Send + Sync + 'static,
{
    move |text| values::within(text, low, high)
}

pub(super) fn parse_setting(text: &str) -> Result<(String, String), String> {
    let pair = text.split_once('=').filter(|(name, _)| !name.is_empty());
    pair.map(|(name, value)| (name.to_owned(), value.to_owned())).ok_or_else(|| "expected NAME=VALUE".to_owned())
}

pub(super) fn parse_metres_per_unit(text: &str) -> Result<f64, String> {
    values::within(text, 1e-6, 1e6)
}

pub(super) fn parse_origin(text: &str) -> Result<Origin, String> {
    let wrong = |_| format!("expected one of {}, or x,y,z", Origin::NAMED.map(|(name, _)| name).join(", "));
    match Origin::NAMED.iter().find(|(name, _)| *name == text) {
        Some((_, origin)) => Ok(*origin),
        None => parse_point(text).map(Origin::Point).map_err(wrong),
    }
}

/// A point where it reads like one, else the name of a camera.
pub(super) fn parse_landmark(text: &str) -> Landmark {
    parse_point(text).map_or_else(|_| Landmark::Camera(text.to_owned()), Landmark::Point)
}

/// Metres and radians of metres and degrees.
pub(super) fn parse_tolerance(text: &str) -> Result<(f32, f32), String> {
    let [metres, degrees] = values::numbers::<f32, 2>(text, "metres,degrees")?;
    if metres < 0.0 || degrees < 0.0 {
        return Err(format!("expected tolerances of 0 or more, found {metres} and {degrees}"));
    }
    Ok((metres, degrees.to_radians()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_are_in_degrees() {
        let (metres, radians) = parse_tolerance("0.5, 180").unwrap();
        assert!(metres == 0.5 && (radians - std::f32::consts::PI).abs() < 1e-6);
        assert!(parse_tolerance("0.5").is_err() && parse_tolerance("-1,1").is_err());
    }
}
