//! Where heads are in a room.

use crate::BakeError;
use promenade_acoustics::{Mesh, Room};
use promenade_core::glam::{Vec2, Vec3};
use promenade_core::random::Random;
use promenade_core::{CameraPath, Pose};

/// Least distance of a random head from the emitter, metres.
const FROM_EMITTER_M: f32 = 0.5;
/// Places of a grid, at most.
const MOST_PLACES: f32 = 1e6;
/// Places of the listener that a scene has about by itself, and the finest and widest spacing that this makes, metres.
const SCENE_PLACES: f32 = 60.0;
const SCENE_SPACING_M: (f32, f32) = (0.5, 5.0);
/// Share of the emitter's surfaces that a place has at least.
const ENCLOSED: f64 = 0.9;
/// Heads that are drawn for each that is wanted, at most.
const TRIES: usize = 1000;

/// Poses at `count` times evenly from the beginning of a path to its end.
#[must_use]
pub fn along(path: &CameraPath, count: usize) -> Vec<Pose> {
    let start = path.keyframes()[0].t_s;
    let step = path.duration_s() / (count.saturating_sub(1)).max(1) as f64;
    (0..count).map(|i| path.pose_at(start + i as f64 * step)).collect()
}

/// Heads at places, level, each turned to `turns` yaws evenly round the circle, the first along x.
#[must_use]
pub fn turned(places: &[Vec3], turns: usize) -> Vec<Pose> {
    let yaw = |i: usize| {
        let share = i as f32 / turns as f32;
        std::f32::consts::TAU * if share > 0.5 { share - 1.0 } else { share }
    };
    places.iter().flat_map(|at| (0..turns).map(move |i| Pose::from_ypr(*at, yaw(i), 0.0, 0.0))).collect()
}

/// Places of a mesh's room on a grid, metres apart, at a height over its lowest point: those that [`Inside`] holds.
///
/// # Errors
/// A spacing that is not above 0 or makes more than a million places, a room without such a place.
pub fn grid(inside: &Inside<'_>, spacing_m: f32, height_m: f32) -> Result<Vec<Vec3>, BakeError> {
    let [low, high] = inside.bounds;
    let steps = ((high - low - Vec3::splat(2.0 * inside.margin_m)) / spacing_m).truncate().floor().max(Vec2::ZERO);
    if !(spacing_m > 0.0 && steps.is_finite() && steps.x * steps.y < MOST_PLACES) {
        let found = format!("{spacing_m} m for a room of {} m", high - low);
        return Err(BakeError::argument("grid", "a spacing of at most a million places", found));
    }
    // The same distance is left over on both sides.
    let first = 0.5 * (high + low).truncate() - 0.5 * spacing_m * steps;
    let (columns, rows) = (steps.x as usize + 1, steps.y as usize + 1);
    let all = (0..rows)
        .flat_map(|j| (0..columns).map(move |i| (first + spacing_m * Vec2::new(i as f32, j as f32)).extend(low.z + height_m)));
    let places: Vec<Vec3> = all.filter(|at| inside.holds(*at)).collect();
    if places.is_empty() {
        let found = format!("none at a height of {height_m} m and {} m off surfaces", inside.margin_m);
        return Err(BakeError::argument("grid", "a place in the room", found));
    }
    Ok(places)
}

/// The spacing at which a scene of a mesh has some 60 places, metres, 0.5 to 5.
#[must_use]
pub fn scene_spacing_m(mesh: &Mesh) -> f32 {
    let [low, high] = mesh.bounds();
    let area = ((high[0] - low[0]) * (high[1] - low[1])) as f32;
    (area / SCENE_PLACES).sqrt().clamp(SCENE_SPACING_M.0, SCENE_SPACING_M.1)
}

/// Heads at random places of a mesh's room, turned as those of [`random_poses`]. The same each time for one seed.
///
/// # Errors
/// A room in which places that [`Inside`] holds are too rare.
pub fn random_inside(inside: &Inside<'_>, count: usize, seed: u64) -> Result<Vec<Pose>, BakeError> {
    let [low, high] = inside.bounds;
    drawn(count, inside.margin_m, seed, |random| {
        let position = low + (high - low) * anywhere(random);
        inside.holds(position).then(|| turned_anywhere(position, random))
    })
}

/// So many of the poses that are drawn. The same each time for one seed.
fn drawn(
    count: usize,
    margin_m: f32,
    seed: u64,
    mut draw: impl FnMut(&mut Random) -> Option<Pose>,
) -> Result<Vec<Pose>, BakeError> {
    let mut random = Random::new(seed ^ 0x5EED_0F90_5E50);
    let poses: Vec<Pose> = (0..count.saturating_mul(TRIES)).filter_map(|_| draw(&mut random)).take(count).collect();
    if poses.len() < count {
        let expected = format!("one that leaves places {FROM_EMITTER_M} m off the emitter");
        return Err(BakeError::argument("margin", expected, format!("{margin_m} m")));
    }
    Ok(poses)
}

/// A place in a cube of side 1.
fn anywhere(random: &mut Random) -> Vec3 {
    Vec3::new(random.uniform(), random.uniform(), random.uniform())
}

/// Which places of a mesh's room heads may be at: a margin off its surfaces, 0.5 m off the emitter, and as much enclosed as the
/// emitter.
#[derive(Debug)]
pub struct Inside<'a> {
    room: &'a Room,
    /// Least and greatest coordinates, metres.
    bounds: [Vec3; 2],
    emitter: Vec3,
    margin_m: f32,
    /// Least share of directions in which a place has a surface.
    enclosed: f64,
}

impl<'a> Inside<'a> {
    /// # Errors
    /// An emitter that is not finite.
    pub fn new(mesh: &Mesh, room: &'a Room, emitter: Vec3, margin_m: f32) -> Result<Self, BakeError> {
        let bounds = mesh.bounds().map(|corner| Vec3::from_array(corner.map(|c| c as f32)));
        let enclosed = ENCLOSED * room.surroundings(emitter.as_dvec3().to_array())?.enclosed;
        Ok(Self { room, bounds, emitter, margin_m, enclosed })
    }

    /// Whether a head may be at a place.
    #[must_use]
    pub fn holds(&self, at: Vec3) -> bool {
        at.distance(self.emitter) >= FROM_EMITTER_M && self.encloses(at)
    }

    /// Whether a place is inside, the margin off all walls.
    pub(crate) fn encloses(&self, at: Vec3) -> bool {
        let lies = self.room.surroundings(at.as_dvec3().to_array());
        lies.is_ok_and(|s| s.clearance_m >= f64::from(self.margin_m) && s.enclosed >= self.enclosed)
    }
}

/// Moves and scales poses together, so that the box around them touches the walls of a box room, from the origin to its size,
/// less a margin in metres, in one direction at least, and its middle is the room's. Orientations stay.
///
/// # Errors
/// A margin below 0 or so wide that no room is left, or no poses.
pub fn fit(poses: &[Pose], size: Vec3, margin_m: f32) -> Result<Vec<Pose>, BakeError> {
    let left = free(size, margin_m)?;
    let low = poses.iter().fold(Vec3::INFINITY, |a, p| a.min(p.position));
    let high = poses.iter().fold(Vec3::NEG_INFINITY, |a, p| a.max(p.position));
    if !(low.is_finite() && high.is_finite()) {
        return Err(BakeError::argument("path", "poses at finite places", format!("{} from {low} to {high}", poses.len())));
    }
    let scale = (left / (high - low).max(Vec3::splat(1e-6))).min_element();
    // Poses on one spot have no size to scale.
    let scale = if (high - low).max_element() < 1e-5 { 1.0 } else { scale };
    let place = |p: &Pose| Pose { position: 0.5 * size + scale * (p.position - 0.5 * (low + high)), ..*p };
    Ok(poses.iter().map(place).collect())
}

/// Heads at random places of a box room, from the origin to its size, a margin in metres off its walls and 0.5 m off the
/// emitter, turned anywhere, with pitches within 30 and rolls within 15 degrees. The same each time for one seed.
///
/// # Errors
/// A margin below 0 or so wide that no place is left.
pub fn random_poses(size: Vec3, emitter: Vec3, count: usize, margin_m: f32, seed: u64) -> Result<Vec<Pose>, BakeError> {
    let left = free(size, margin_m)?;
    drawn(count, margin_m, seed, |random| {
        let pose = turned_anywhere(Vec3::splat(margin_m) + left * anywhere(random), random);
        (pose.position.distance(emitter) >= FROM_EMITTER_M).then_some(pose)
    })
}

fn turned_anywhere(position: Vec3, random: &mut Random) -> Pose {
    let mut within = |degrees: f32| (degrees * (2.0 * random.uniform() - 1.0)).to_radians();
    Pose::from_ypr(position, within(180.0), within(30.0), within(15.0))
}

/// Size of the room less its margins.
fn free(size: Vec3, margin_m: f32) -> Result<Vec3, BakeError> {
    let left = size - Vec3::splat(2.0 * margin_m);
    if margin_m >= 0.0 && left.min_element() > 0.0 {
        return Ok(left);
    }
    let expected = format!("0 to less than half of the room's least size, {}", 0.5 * size.min_element());
    Err(BakeError::argument("margin", expected, margin_m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::Keyframe;

    const SIZE: Vec3 = Vec3::new(6.0, 4.0, 3.0);

    #[test]
    fn a_walk_is_scaled_until_it_fits() {
        let at = |t_s, x, y| Keyframe { t_s, pose: Pose::from_ypr(Vec3::new(x, y, 7.0), 0.3, 0.0, 0.0) };
        let path = CameraPath::new(vec![at(5.0, -100.0, 0.0), at(6.0, 0.0, 20.0), at(8.0, 100.0, 40.0)]).unwrap();
        let poses = along(&path, 7);
        assert_eq!((poses[0], poses[6]), (path.pose_at(5.0), path.pose_at(8.0)));
        let fitted = fit(&poses, SIZE, 0.5).unwrap();
        assert!((fitted[0].position - Vec3::new(0.5, 1.5, 1.5)).length() < 1e-4, "{}", fitted[0].position);
        assert!((fitted[6].position - Vec3::new(5.5, 2.5, 1.5)).length() < 1e-4);
        assert_eq!(fitted[3].orientation, poses[3].orientation);
        assert_eq!(along(&path, 1), [path.pose_at(5.0)]);
        let still = fit(&poses[..1], SIZE, 0.5).unwrap();
        assert!((still[0].position - 0.5 * SIZE).length() < 1e-5);
        for margin in [-0.1, 1.5, f32::NAN] {
            assert!(fit(&poses, SIZE, margin).unwrap_err().to_string().contains("margin: expected 0 to less than half"));
        }
        assert!(fit(&[], SIZE, 0.5).is_err());
    }

    #[test]
    fn random_heads_are_apart_from_walls_and_emitter() {
        let emitter = Vec3::new(3.0, 2.0, 1.5);
        let poses = random_poses(SIZE, emitter, 500, 0.6, 3).unwrap();
        assert_eq!((poses.len(), &poses), (500, &random_poses(SIZE, emitter, 500, 0.6, 3).unwrap()));
        assert_ne!(poses, random_poses(SIZE, emitter, 500, 0.6, 4).unwrap());
        for p in &poses {
            let wall = p.position.min(SIZE - p.position).min_element();
            assert!(wall >= 0.6 - 1e-5 && p.position.distance(emitter) >= 0.5 && p.ypr().1.abs() < 0.53, "{p:?}");
        }
        assert!(poses.iter().any(|p| p.ypr().0 > 2.0) && poses.iter().any(|p| p.ypr().0 < -2.0));
        assert!(random_poses(SIZE, emitter, 5, 1.4, 1).is_ok());
        assert!(
            random_poses(Vec3::ONE, Vec3::splat(0.5), 5, 0.3, 1).unwrap_err().to_string().contains("0.5 m off the emitter")
        );
    }
}
