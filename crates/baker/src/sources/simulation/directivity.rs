//! The directivity of a source from a file.

use super::OCTAVES_HZ;
use crate::error::BakeError;
use promenade_acoustics::Directivity;
use promenade_sofa::read_directivity;
use std::path::Path;

/// Reads the directivity of a source from a SOFA file (AES69-2022, FreeFieldDirectivityTF), facing along x: the mean energy of
/// each octave, and where the file has no frequency in one, of the nearest that has.
///
/// # Errors
/// A file that cannot be read or is of another convention; no frequency from 88 Hz to 11 kHz; silence ahead.
pub fn directivity(path: &Path) -> Result<Directivity, BakeError> {
    let read = read_directivity(path)?;
    let within = |centre: f32| -> Vec<usize> {
        let (low, high) = (f64::from(centre) / 2.0_f64.sqrt(), f64::from(centre) * 2.0_f64.sqrt());
        let all = read.frequencies_hz.iter().enumerate();
        all.filter(|(_, hz)| (low..high).contains(*hz)).map(|(n, _)| n).collect()
    };
    let own: Vec<Vec<usize>> = OCTAVES_HZ.iter().map(|centre| within(*centre)).collect();
    let nearest = |octave: usize| (0..own.len()).filter(|o| !own[*o].is_empty()).min_by_key(|o| o.abs_diff(octave));
    let Some(taken) = (0..own.len()).map(nearest).collect::<Option<Vec<usize>>>() else {
        let found = format!("{} others", read.frequencies_hz.len());
        return Err(BakeError::argument("directivity", "frequencies from 88 Hz to 11 kHz", found));
    };
    let amplitude = |energies: &[f64], octave: usize| {
        let of = &own[taken[octave]];
        (of.iter().map(|n| energies[*n]).sum::<f64>() / of.len() as f64).sqrt() as f32
    };
    let direction = |(at, energies): &(promenade_core::glam::Vec3, Vec<f64>)| {
        (at.as_dvec3().to_array(), std::array::from_fn(|octave| amplitude(energies, octave)))
    };
    Directivity::measured(&read.directions.iter().map(direction).collect::<Vec<_>>())
}
