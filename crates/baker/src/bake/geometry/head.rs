//! A head for scenes of image sources.

use crate::bake::direct::Direct;
use crate::bake::log_transfer::LogTransfer;
use crate::error::BakeError;
use crate::signal::spectrum::Analyser;
use crate::sources::ambisonic::{ambisonic_head, head_responses};
use crate::sources::simulation::Hrtf;
use promenade_core::glam::Vec3;
use promenade_core::{Axis, Bands, Facing, Field, FieldGrid, Rows, StftGrid, TransferShape};
use promenade_fourier::num_complex::Complex32;
use promenade_room::SceneHead;
use rayon::prelude::*;
use std::f32::consts::PI;

/// Directions that the direct sound is stored for: elevations from as low as heads are measured to straight up, degrees, close
/// where emitters mostly are, and azimuths.
const ELEVATIONS: [f32; 8] = [-40.0, -20.0, -10.0, 0.0, 10.0, 20.0, 45.0, 90.0];
const AZIMUTHS: usize = 32;
/// Frame of the short-time transform, seconds.
const WINDOW_S: f64 = 0.020;
/// A head is the same on both sides up to this share of its energy, and this interaural delay, seconds.
const MIRRORED_ERROR: f32 = 1e-5;
const MIRRORED_S: f32 = 5e-7;

/// A head at the sample rate of its responses.
///
/// # Errors
/// A head without sound in some direction.
pub fn scene_head(hrtf: &Hrtf) -> Result<SceneHead, BakeError> {
    let rate = f64::from(hrtf.sample_rate_hz());
    let grid = StftGrid::four_hops(rate, (rate * WINDOW_S / 4.0).round());
    let bands = Bands::for_rate(rate);
    let shape = TransferShape { bins: grid.bins(), bands: bands.count(), taps: 0 };
    let coherence = bands.centres_hz().iter().map(|hz| hrtf.coherence(f64::from(*hz))).collect();
    let head = direct_field(hrtf, &grid, shape)
        .and_then(|direct| SceneHead::new(grid, bands, coherence, &direct, ambisonic_head(hrtf)));
    let head = head.ok_or_else(|| BakeError::argument("head", "sound in all directions", "silence"))?;
    Ok(head.with_credit(&hrtf.credit, &hrtf.licence))
}

/// The direct sound at 1 m by direction, through the head.
fn direct_field(hrtf: &Hrtf, grid: &StftGrid, shape: TransferShape) -> Option<Field> {
    let position = [(); 3].map(|()| Axis::single(0.0));
    let elevation = Axis::new(ELEVATIONS.map(f32::to_radians).to_vec(), false)?;
    let azimuth = Axis::circle(-PI, AZIMUTHS);
    let nodes = FieldGrid { position, facing: Facing::Emitter { position: Vec3::ZERO, elevation, azimuth } };
    let analyser = Analyser::new(*grid);
    let silent = vec![0.0; shape.tap_len()];
    let row = |index: usize| -> Option<Vec<f32>> {
        let [left, right] = head_responses(hrtf, nodes.node(index).1);
        let mut direct = Direct::of([&left, &right], None, grid, &analyser)?;
        // The bass of a head's response rings longer than a direct sound is cut out, but its level is plain.
        for (gain, ear) in direct.gain.iter_mut().zip([&left, &right]) {
            let whole: Vec<f64> = ear.iter().map(|v| f64::from(*v)).collect();
            gain.iter_mut().zip(analyser.spectrum(&whole)).for_each(|(g, x)| *g = x.norm());
        }
        let transfer = LogTransfer::of(&direct, 1.0, 1.0).to_transfer(&shape, grid);
        Some(promenade_core::TransferFunction { late: silent.clone(), ..transfer }.to_row())
    };
    let rows: Option<Vec<Vec<f32>>> = (0..nodes.nodes()).into_par_iter().map(row).collect();
    let field = Field::new(nodes, shape, Rows::Whole(rows?.concat()))?;
    // A head that is the same on both sides needs half of its directions in a file.
    let mirrored = field.mirrored().filter(|mirrored| alike(&field, mirrored));
    Some(mirrored.unwrap_or(field))
}

/// Whether two tables sound the same, but for what half precision takes.
fn alike(one: &Field, other: &Field) -> bool {
    let (Rows::Whole(a), Rows::Whole(b)) = (one.rows(), other.rows()) else { return false };
    let (bins, len) = (one.shape().bins, one.shape().row_len());
    let ears = |row: &[f32]| -> Vec<Complex32> {
        let ear = |sign: f32, phase: usize| {
            (0..bins).map(move |k| Complex32::from_polar(row[k] * (1.0 + sign * row[bins + k]), row[phase + k]))
        };
        ear(-1.0, 2 * bins).chain(ear(1.0, 3 * bins)).collect()
    };
    let pairs = || a.chunks_exact(len).zip(b.chunks_exact(len));
    let energy: f32 = pairs().flat_map(|(a, _)| ears(a)).map(|x| x.norm_sqr()).sum();
    let error: f32 = pairs().flat_map(|(a, b)| ears(a).into_iter().zip(ears(b))).map(|(a, b)| (a - b).norm_sqr()).sum();
    let late_s = pairs().map(|(a, b)| (a[4 * bins] - b[4 * bins]).abs()).fold(0.0, f32::max);
    error < MIRRORED_ERROR * energy && late_s < MIRRORED_S
}
