//! Scenes of rooms as their files have them.

use crate::bake::field::Shapes;
use crate::error::BakeError;
use half::f16;
use promenade_core::{Basis, BassField, Emission, Field, ImageSources, LowRank, Rows, Scene, SceneParts};

/// What common shapes leave of time filters, root mean square, as a share of each one's mean. In the loft 32 shapes are within
/// 0.1 dB of the energy of each band at each ear, root mean square.
const SHAPES_ERROR: f64 = 0.04;

/// The scene as its file has it: tables of half precision, 0.004 dB, and 0.004 rad of phases up to 8; time filters as few
/// shapes where that takes fewer bytes.
pub(super) fn halved(scene: &Scene) -> Result<Scene, BakeError> {
    let direct = |table: &Field| {
        let Rows::Whole(rows) = table.rows() else { return None };
        Field::new(table.grid().clone(), table.shape(), Rows::Whole(all_halved(rows)))
    };
    let parts = scene.parts();
    let bass = parts.bass.as_ref().map(|bass| BassField { samples: all_halved(&bass.samples), ..bass.clone() });
    let images = parts.images.as_ref().map(|images| ImageSources {
        emission: images.emission.as_ref().map(|emission| Emission {
            levels: all_halved(emission.levels.as_flattened()).as_chunks().0.to_vec(),
            ..emission.clone()
        }),
        ..images.clone()
    });
    let room = parts.room.as_ref().and_then(|room| few_shapes(room).or_else(|| direct(room)));
    Ok(Scene::new(SceneParts { field: parts.field.as_ref().and_then(direct), room, images, bass, ..parts.clone() })?)
}

fn all_halved(values: &[f32]) -> Vec<f32> {
    values.iter().map(|v| f16::from_f32(*v).to_f32()).collect()
}

/// A table of time filters as coefficients of common shapes, in half precision; `None` where whole rows are smaller.
fn few_shapes(room: &Field) -> Option<Field> {
    let Rows::Whole(rows) = room.rows() else { return None };
    let gains: Vec<&[f32]> = rows.chunks_exact(room.shape().row_len()).map(|row| &row[1..]).collect();
    // Late hops are as true as early ones, so that all are told by their own mean.
    let mut means = vec![0.0_f32; gains.first()?.len()];
    for row in &gains {
        means.iter_mut().zip(*row).for_each(|(mean, gain)| *mean += gain / gains.len() as f32);
    }
    let relative = |row: &&[f32]| row.iter().zip(&means).map(|(gain, mean)| gain / mean.max(f32::MIN_POSITIVE)).collect();
    let relative: Vec<Vec<f32>> = gains.iter().map(relative).collect();
    let shapes = Shapes::of(&relative, SHAPES_ERROR);
    if shapes.rank() == 0 || shapes.values() + gains.len() * shapes.rank() >= rows.len() {
        return None;
    }
    let coefficients: Vec<f32> = relative.iter().flat_map(|row| shapes.coefficients(row)).collect();
    let basis = shapes.into_basis();
    let scaled = |values: &[f32]| -> Vec<f32> { values.iter().zip(means.iter().cycle()).map(|(v, mean)| v * mean).collect() };
    // Shapes have unit length, and their values would be below what half precision tells.
    let largest = coefficients.iter().fold(f32::MIN_POSITIVE, |most, c| most.max(c.abs()));
    let larger: Vec<f32> = basis.shapes.iter().map(|v| v * largest).collect();
    let taps = Basis { mean: all_halved(&scaled(&basis.mean)), shapes: all_halved(&scaled(&larger)) };
    let smaller: Vec<f32> = coefficients.iter().map(|c| c / largest).collect();
    let low = LowRank { levels: Basis::default(), taps, coefficients: all_halved(&smaller) };
    Field::new(room.grid().clone(), room.shape(), Rows::LowRank(low))
}
