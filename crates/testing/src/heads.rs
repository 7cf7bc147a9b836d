//! Heads made of numbers.

use hdf5_pure::{AttrValue, FileBuilder};
use promenade_core::Head;
use promenade_core::glam::Vec3;
use promenade_core::head::{HeadDirection, head_band_hz, lattice};
use std::f32::consts::FRAC_PI_2;
use std::path::Path;

/// Speed of sound, metres a second.
const SPEED_M_S: f32 = 343.0;

/// What a rigid sphere with ears at its sides makes of a direction: delays after Woodworth (1938), and a shadow of one pole and
/// one zero (Brown and Duda 1998).
#[must_use]
pub fn direction(towards: Vec3, radius_m: f32) -> HeadDirection {
    let unit = towards.normalize();
    let corner_hz = SPEED_M_S / (std::f32::consts::TAU * radius_m);
    let angle = |side: f32| (side * unit.y).clamp(-1.0, 1.0).acos();
    let way = |side: f32| if angle(side) < FRAC_PI_2 { -angle(side).cos() } else { angle(side) - FRAC_PI_2 };
    let level = |side: f32, hz: f32| {
        let alpha = 1.05 + 0.95 * (angle(side) * 1.2).min(std::f32::consts::PI).cos();
        let ratio = (hz / corner_hz).powi(2);
        10.0 * ((1.0 + (0.5 * alpha).powi(2) * ratio) / (1.0 + 0.25 * ratio)).log10()
    };
    HeadDirection {
        direction: towards,
        delays_s: [1.0, -1.0].map(|side| way(side) * radius_m / SPEED_M_S),
        levels_db: [1.0, -1.0].map(|side| std::array::from_fn(|band| level(side, head_band_hz(band) as f32))),
    }
}

/// A sphere of a radius in metres, heard in 500 directions.
///
/// # Panics
/// A radius that no head has.
#[must_use]
pub fn sphere(radius_m: f32) -> Head {
    let measured = (0..500).map(|i| direction(lattice(i, 500), radius_m)).collect();
    Head::new("Sphere", "nobody", measured).unwrap()
}

/// Writes the delays of a sphere as a SOFA file of 72 directions: pulses at 48 kHz, half as high at the far ear.
///
/// # Panics
/// The file cannot be written.
pub fn write_sofa(path: &Path, radius_m: f32) {
    write_sofa_of(path, radius_m, 24, 128);
}

/// The same with `around` directions at each of three heights, and responses of `frames` samples.
///
/// # Panics
/// The file cannot be written.
pub fn write_sofa_of(path: &Path, radius_m: f32, around: u32, frames: u32) {
    const RATE_HZ: f64 = 48_000.0;
    let mut file = FileBuilder::new();
    let text = |t: &str| AttrValue::AsciiString(t.to_owned());
    for (name, value) in [("SOFAConventions", "SimpleFreeFieldHRIR"), ("DataType", "FIR"), ("Title", "Sphere")] {
        file.set_attr(name, text(value));
    }
    let directions: Vec<[f64; 3]> = [-45.0, 0.0, 45.0]
        .iter()
        .flat_map(|e| (0..around).map(move |i| [360.0 / f64::from(around) * f64::from(i), *e, 1.5]))
        .collect();
    let count = directions.len() as u64;
    let positions = file.create_dataset("SourcePosition");
    positions.with_f64_data(directions.as_flattened()).with_shape(&[count, 3]).set_attr("Type", text("spherical"));
    file.create_dataset("ListenerPosition").with_f64_data(&[0.0; 3]).with_shape(&[1, 3]).set_attr("Type", text("cartesian"));
    file.create_dataset("Data.SamplingRate").with_f64_data(&[RATE_HZ]).with_shape(&[1]);
    let mut samples = Vec::new();
    for [azimuth, elevation, _] in directions {
        let (azimuth, elevation) = (azimuth.to_radians() as f32, elevation.to_radians() as f32);
        let towards = Vec3::new(azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin());
        for (delay_s, side) in direction(towards, radius_m).delays_s.into_iter().zip([1.0, -1.0]) {
            let (late, gain) = (20.0 + f64::from(delay_s) * RATE_HZ, 0.75 + 0.25 * side * f64::from(towards.y));
            samples.extend((0..frames).map(|i| gain * (-0.5 * ((f64::from(i) - late) / 1.2).powi(2)).exp()));
        }
    }
    file.create_dataset("Data.IR").with_f64_data(&samples).with_shape(&[count, 2, u64::from(frames)]);
    file.write(path).unwrap();
}

/// Writes a SOFA file of a source that looks along y and sends `1 + cos` of the angle to that at 1 kHz, half of it at 2 kHz, to
/// 12 receivers in a circle, so many times. `times` and `receivers`, of which the file has places, and the direction that it
/// says the source looks in, may also be wrong.
///
/// # Panics
/// The file cannot be written.
pub fn write_directivity(path: &Path, convention: &str, [times, receivers]: [u64; 2], view: [f64; 3]) {
    let mut file = FileBuilder::new();
    let text = |t: &str| AttrValue::AsciiString(t.to_owned());
    for (name, value) in [("SOFAConventions", convention), ("DataType", "TF")] {
        file.set_attr(name, text(value));
    }
    file.create_dataset("N").with_f64_data(&[1000.0, 2000.0]).with_shape(&[2]);
    let around: Vec<[f64; 3]> = (0..12).map(|i| [30.0 * f64::from(i), 0.0, 2.0]).collect();
    let positions = file.create_dataset("ReceiverPosition");
    let places = around[..receivers as usize].as_flattened();
    positions.with_f64_data(places).with_shape(&[receivers, 3, 1]).set_attr("Type", text("spherical"));
    for (name, at) in [("ListenerPosition", [0.0; 3]), ("SourcePosition", [0.0; 3]), ("SourceView", view)] {
        file.create_dataset(name).with_f64_data(&at).with_shape(&[1, 3]).set_attr("Type", text("cartesian"));
    }
    let sent = |azimuth: f64| 1.0 + (azimuth - 90.0).to_radians().cos();
    let values: Vec<f64> = (0..times).flat_map(|_| around.iter().flat_map(|at| [sent(at[0]), 0.5 * sent(at[0])])).collect();
    for name in ["Data.Real", "Data.Imag"] {
        file.create_dataset(name).with_f64_data(&values).with_shape(&[times, 12, 2]);
    }
    file.write(path).unwrap();
}
