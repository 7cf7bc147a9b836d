//! How much a source sends in each direction, as measured (AES69-2022, convention FreeFieldDirectivityTF).

use crate::error::SofaError;
use crate::file::Sofa;
use crate::variables::facing;
use promenade_core::glam::Vec3;
use std::path::Path;

/// The convention.
const CONVENTION: &str = "FreeFieldDirectivityTF";

/// What a source sends where.
#[derive(Clone, Debug, PartialEq)]
pub struct Directions {
    /// Hz.
    pub frequencies_hz: Vec<f64>,
    /// Directions in the source's own axes, x ahead, y to its left, z up, of any length, and energies at the frequencies, means
    /// over all measurements.
    pub directions: Vec<(Vec3, Vec<f64>)>,
}

/// Reads the directivity of a source: receivers around it are its directions.
///
/// # Errors
/// A file that cannot be read, is of another convention, is damaged, whose receivers move or lie at the source. The message
/// names file and variable.
pub fn read_directivity(path: &Path) -> Result<Directions, SofaError> {
    let sofa = Sofa::open(path)?;
    let file = sofa.variables();
    let convention = file.attribute("SOFAConventions");
    if convention != CONVENTION {
        let found = if convention.is_empty() { "none".to_owned() } else { convention };
        return Err(file.wrong("SOFAConventions", format!("the directivity of a source ({CONVENTION})"), found));
    }
    let (shape, real) = file.values("Data.Real")?;
    let (other, imaginary) = file.values("Data.Imag")?;
    let (&[measurements, receivers, frequencies], false) = (&shape[..], shape.contains(&0)) else {
        return Err(file.wrong("Data.Real", "the 3 axes MRN, at least one of each", format!("{shape:?}")));
    };
    if other != shape {
        return Err(file.wrong("Data.Imag", format!("the axes of Data.Real, {shape:?}"), format!("{other:?}")));
    }
    let (_, frequencies_hz) = file.values("N")?;
    if frequencies_hz.len() != frequencies || frequencies_hz.iter().any(|hz| *hz < 0.0) {
        return Err(file.wrong("N", format!("{frequencies} frequencies in hertz"), frequencies_hz.len()));
    }
    let one = |name: &str, missing: Vec3| -> Result<Vec3, SofaError> {
        let points = file.points_or(name, measurements, missing)?;
        if points.points.iter().any(|at| at.distance(points.points[0]) > 1e-3) {
            return Err(file.wrong(name, "one for all measurements", "several"));
        }
        Ok(points.points[0])
    };
    let from = one("ListenerPosition", Vec3::ZERO)? - one("SourcePosition", Vec3::ZERO)?;
    let (view, up) = (one("SourceView", Vec3::X)?, one("SourceUp", Vec3::Z)?);
    let turn = facing(view, up).ok_or_else(|| file.wrong("SourceUp", "a direction across SourceView", format!("{up}")))?;
    let places = file.fixed_points("ReceiverPosition", receivers)?;
    let direction = |(receiver, place): (usize, &Vec3)| {
        let energy = |n: usize| {
            let all = (0..measurements).map(|m| (m * receivers + receiver) * frequencies + n);
            all.map(|i| real[i].powi(2) + imaginary[i].powi(2)).sum::<f64>() / measurements as f64
        };
        (turn.inverse() * (*place + from), (0..frequencies).map(energy).collect())
    };
    let directions: Vec<(Vec3, Vec<f64>)> = places.iter().enumerate().map(direction).collect();
    if let Some(receiver) = directions.iter().position(|(at, _)| at.length() < 1e-3) {
        return Err(file.wrong("ReceiverPosition", "receivers around the source", format!("receiver {receiver} at it")));
    }
    Ok(Directions { frequencies_hz, directions })
}
