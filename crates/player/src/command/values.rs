//! Values on a command line: what they must look like, in words.

use promenade_audio::wav::Format;
use promenade_core::glam::{DVec3, Vec3};
use promenade_core::{Latency, Pose};
use std::fmt::Display;
use std::str::FromStr;

/// Parses finite numbers with commas between them; `names` says which.
///
/// # Errors
/// Something else, in words.
pub fn numbers<T: FromStr + Copy + Into<f64>, const N: usize>(text: &str, names: &str) -> Result<[T; N], String> {
    let numbers: Result<Vec<T>, _> = text.split(',').map(|n| n.trim().parse::<T>()).collect();
    match numbers {
        Ok(numbers) if numbers.len() != N => Err(format!("expected {N} numbers {names}, found {}", numbers.len())),
        Ok(numbers) if numbers.iter().all(|v| (*v).into().is_finite()) => {
            numbers.try_into().map_err(|_| format!("expected {N} numbers {names}"))
        }
        _ => Err(format!("expected {N} finite numbers {names}")),
    }
}

/// Parses `X,Y,Z,YAW,PITCH,ROLL`, metres and degrees.
///
/// # Errors
/// Something else, in words.
pub fn pose(text: &str) -> Result<Pose, String> {
    // In double precision: networks multiply what is rounded here by a thousand.
    let [x, y, z, yaw, pitch, roll] = numbers::<f64, 6>(text, "x,y,z,yaw,pitch,roll")?;
    let pose = Pose::from_ypr64(DVec3::new(x, y, z).as_vec3(), [yaw, pitch, roll].map(f64::to_radians));
    if pose.is_valid() { Ok(pose) } else { Err(format!("expected a position within {:e} m, found {text}", Pose::FARTHEST_M)) }
}

/// Parses `X,Y,Z`, metres.
///
/// # Errors
/// Something else, in words.
pub fn point(text: &str) -> Result<Vec3, String> {
    numbers(text, "x,y,z").map(Vec3::from_array)
}

/// Parses the name of a latency.
///
/// # Errors
/// Something else, in words.
pub fn latency(text: &str) -> Result<Latency, String> {
    let found = Latency::ALL.into_iter().find(|latency| latency.name() == text);
    found.ok_or_else(|| format!("expected {}", Latency::ALL.map(Latency::name).join(", ")))
}

/// Parses how samples are stored.
///
/// # Errors
/// Something else, in words.
pub fn bits(text: &str) -> Result<Format, String> {
    match text {
        "16" => Ok(Format::Int16),
        "24" => Ok(Format::Int24),
        "32" => Ok(Format::Int32),
        "32f" => Ok(Format::Float32),
        _ => Err("expected 16, 24, 32 or 32f".to_owned()),
    }
}

/// Parses a number between two others, which are allowed.
///
/// # Errors
/// Something else, in words.
pub fn within<T: FromStr + PartialOrd + Display>(text: &str, low: T, high: T) -> Result<T, String> {
    let wrong = || format!("expected a number from {low} to {high}");
    let value = text.parse::<T>().map_err(|_| wrong())?;
    if value >= low && value <= high { Ok(value) } else { Err(wrong()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_are_in_degrees() {
        let turned = pose("1,2,3, 90,0,0").unwrap();
        assert!((turned.orientation * Vec3::X - Vec3::Y).length() < 1e-6, "yaw 90 faces left");
        assert_eq!(turned.position, Vec3::new(1.0, 2.0, 3.0));
        assert!(pose("1,2,3").unwrap_err().contains("found 3"));
        assert!(pose("1,2,3,inf,0,0").is_err() && pose("a,b").is_err());
        assert!(pose("1e20,2,3,0,0,0").unwrap_err().contains("1e12 m"));
    }
}
