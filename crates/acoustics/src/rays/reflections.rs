//! Which surfaces rays meet and when, whatever these take.

use crate::directivity::lattice::direction;
use crate::error::{AcousticsError, place};
use crate::room::Room;
use crate::room::ray::Ray;
use promenade_core::random::Random;
use rayon::prelude::*;

/// Meetings of one ray at most.
const MOST_MET: usize = 100_000;

/// A meeting of a ray with a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Met {
    /// Metres on the way from the source.
    pub way_m: f64,
    /// Number of the mesh's group; none where the ray has left through an opening.
    pub group: Option<u32>,
}

/// Follows rays from a source for so many metres: after Lambert's law from a share of their reflections, as from a mirror from
/// the others. The same input and seed give the same ways.
///
/// # Errors
/// A source that is not finite.
pub fn reflections(
    room: &Room,
    source: [f64; 3],
    rays: usize,
    reach_m: f64,
    scattered: f64,
    seed: u64,
) -> Result<Vec<Vec<Met>>, AcousticsError> {
    let source = place("source", source)?;
    let one = |i: usize| {
        let mut random = Random::stream(seed, i as u64);
        let mut ray = Ray::new(source, direction(i, rays));
        let (mut met, mut way) = (Vec::new(), 0.0);
        while met.len() < MOST_MET {
            let Some(hit) = ray.cast(room) else {
                met.push(Met { way_m: way, group: None });
                break;
            };
            way += hit.distance;
            if way >= reach_m {
                break;
            }
            met.push(Met { way_m: way, group: Some(room.material(hit.face) as u32) });
            if random.uniform_f64() < scattered {
                ray.scatter(room, &hit, &mut random);
            } else {
                ray.mirror(room, &hit);
            }
        }
        met
    };
    Ok((0..rays).into_par_iter().map(one).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::images::shoebox::Shoebox;
    use crate::materials::material::Material;

    #[test]
    fn rays_in_a_box_meet_a_wall_every_mean_free_path() {
        let walls = Shoebox { size: [6.0, 5.0, 3.0], materials: std::array::from_fn(|_| Material::even("", 0.1, 0.1)) };
        let mesh = walls.mesh().unwrap();
        let room = Room::new(&mesh, &walls.materials).unwrap();
        let all = reflections(&room, [2.0, 2.0, 1.0], 500, 300.0, 0.3, 1).unwrap();
        let met = all.iter().map(Vec::len).sum::<usize>() as f64 / 500.0;
        // 4 V / S.
        assert!((300.0 / met / (4.0 * 90.0 / 126.0) - 1.0).abs() < 0.03, "{met}");
        assert!(all.iter().flatten().all(|m| m.group.is_some()));
        let mut open = mesh.clone();
        open.triangles.retain(|t| t.group != 5);
        let room = Room::new(&open, &walls.materials).unwrap();
        let all = reflections(&room, [2.0, 2.0, 1.0], 500, 300.0, 0.3, 1).unwrap();
        assert!(all.iter().filter(|r| r.last().is_some_and(|m| m.group.is_none())).count() > 450);
    }
}
