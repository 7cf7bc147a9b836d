//! Rooms around points: the surfaces of a place that is given by points on its walls, as by reconstructions from pictures.

use super::Mesh;
use crate::error::AcousticsError;
use glam::DVec2;

/// Points that a room is made of, at least.
const LEAST_POINTS: usize = 100;
/// Share of the points beyond each wall at most: what is seen through windows, and what was reconstructed wrongly.
const OUTSIDE: f64 = 0.02;
/// A wall is looked for in this share of the room from each side.
const OUTER: f64 = 0.25;
/// Half of the thickness of a wall of points, as a share of the room's length across it.
const HALF_WALL: f64 = 0.01;
/// Walls are no nearer than this to a place that they hold, metres.
const AWAY_M: f64 = 0.3;
/// Steps in which the walls' direction is looked for, in a quarter of a turn.
const TURNS: usize = 180;

/// A box found around points.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundBox {
    /// The box, with groups `floor`, `ceiling`, `back` and `front` (least and greatest along the direction below), `right` and
    /// `left`.
    pub mesh: Mesh,
    /// Length along the direction, width across it, and height, metres.
    pub size_m: [f64; 3],
    /// Direction of the length, radians from x towards y, from 0 up to a quarter of a turn.
    pub turn_rad: f64,
    /// Share of the points that lie on each wall, in the order back, front, right, left, floor, ceiling.
    pub on_wall: [f64; 6],
}

impl Mesh {
    /// The upright box on whose walls the most points lie, z up, of those that hold some places, as of cameras.
    ///
    /// Its direction is the one in which the points, but the outermost 2 % on each side, and the places fill the smallest
    /// rectangle. Each wall is then where most points lie in the outer quarter on its side, and 0.3 m off the places.
    ///
    /// # Errors
    /// Fewer than 100 points, one that is not finite, or points that enclose nothing.
    pub fn box_around(points: &[[f64; 3]], held: &[[f64; 3]]) -> Result<FoundBox, AcousticsError> {
        check(points, held)?;
        let turned = |points: &[[f64; 3]], turn: f64| {
            let axis = DVec2::from_angle(turn);
            let along = points.iter().map(|p| axis.dot(DVec2::new(p[0], p[1]))).collect::<Vec<_>>();
            let across = points.iter().map(|p| axis.perp_dot(DVec2::new(p[0], p[1]))).collect::<Vec<_>>();
            [along, across]
        };
        let area = |turn: f64| -> f64 {
            let [points, held] = [turned(points, turn), turned(held, turn)];
            let lengths = points.into_iter().zip(&held).map(|(points, held)| {
                let [low, high] = with(range(points), held);
                high - low
            });
            lengths.product()
        };
        let step = std::f64::consts::FRAC_PI_2 / TURNS as f64;
        let coarse = least((0..TURNS).map(|i| i as f64 * step), area);
        let turn = least((-10..=10).map(|i| coarse + 0.1 * step * f64::from(i)), area).rem_euclid(std::f64::consts::FRAC_PI_2);
        let heights = |points: &[[f64; 3]]| points.iter().map(|p| p[2]).collect::<Vec<_>>();
        let ([along, across], [held_along, held_across]) = (turned(points, turn), turned(held, turn));
        let walls = [(along, held_along), (across, held_across), (heights(points), heights(held))]
            .map(|(values, held)| walls(&values, &held));
        let size_m = walls.map(|[low, high]| high.0 - low.0);
        if size_m.iter().any(|length| *length <= 0.0) {
            return Err(AcousticsError::argument("points", "those of a room", format!("a box of {size_m:?} m")));
        }
        let axis = DVec2::from_angle(turn);
        let corner = |i: usize| {
            let side = |axis: usize| walls[axis][i >> axis & 1].0;
            let plan = side(0) * axis + side(1) * axis.perp();
            [plan.x, plan.y, side(2)]
        };
        let mut mesh = Self { vertices: (0..8).map(corner).collect(), ..Self::default() };
        for (name, corners) in [
            ("back", [0, 4, 6, 2]),
            ("front", [1, 3, 7, 5]),
            ("right", [0, 1, 5, 4]),
            ("left", [2, 6, 7, 3]),
            ("floor", [0, 2, 3, 1]),
            ("ceiling", [4, 5, 7, 6]),
        ] {
            let group = mesh.group(name);
            mesh.fan(&corners, group);
        }
        let on_wall = walls.as_flattened().iter().map(|(_, share)| *share).collect::<Vec<_>>();
        Ok(FoundBox { mesh, size_m, turn_rad: turn, on_wall: std::array::from_fn(|i| on_wall[i]) })
    }
}

pub(super) fn check(points: &[[f64; 3]], held: &[[f64; 3]]) -> Result<(), AcousticsError> {
    if points.len() < LEAST_POINTS {
        return Err(AcousticsError::argument("points", format!("{LEAST_POINTS} or more"), points.len()));
    }
    match points.iter().chain(held).flatten().find(|x| !x.is_finite() || x.abs() > 1e6) {
        Some(x) => Err(AcousticsError::argument("points", "coordinates within 1000 km", *x)),
        None => Ok(()),
    }
}

/// A whole number, which coordinates within 1000 km and cells above a micrometre have.
#[expect(clippy::cast_possible_truncation, reason = "saturates")]
fn nearest(x: f64) -> i64 {
    x.round() as i64
}

/// Where most values lie, but for [`OUTSIDE`] on each side.
fn range(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    let out = nearest(OUTSIDE * values.len() as f64).unsigned_abs() as usize;
    [values[out], values[values.len() - 1 - out]]
}

/// The value with the least of some measure.
fn least(values: impl Iterator<Item = f64>, measure: impl Fn(f64) -> f64) -> f64 {
    values.map(|value| (measure(value), value)).min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |(_, value)| value)
}

/// A range that holds these values too.
fn with(range: [f64; 2], held: &[f64]) -> [f64; 2] {
    held.iter().fold(range, |[low, high], value| [low.min(*value), high.max(*value)])
}

/// Both walls across an axis: where they are, and the share of all points on each.
fn walls(values: &[f64], held: &[f64]) -> [(f64, f64); 2] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let [low, high] = with(range(sorted.clone()), held);
    let length = high - low;
    let half = HALF_WALL * length;
    // As far as a wall may reach inwards.
    let [first, last] = with([f64::INFINITY, f64::NEG_INFINITY], held);
    let inner = [first - AWAY_M, last + AWAY_M];
    let found = |from: f64, to: f64| {
        let between = |a: f64, b: f64| sorted.partition_point(|x| *x < a)..sorted.partition_point(|x| *x <= b);
        let count = |at: f64| between(at - half, at + half).len();
        let steps = (0..=200).map(|i| from + (to - from) * f64::from(i) / 200.0);
        let most = least(steps, |at| -(count(at) as f64));
        // The median of what is there: the steps are too coarse, and floor and ceiling lie on one side only.
        let on = between(most - half, most + half);
        let median = sorted.get(on.start + on.len() / 2).copied().unwrap_or(most);
        (median, on.len() as f64 / sorted.len() as f64)
    };
    let low_wall = found((low - half).min(inner[0]), (low + OUTER * length).min(inner[0]));
    let high_wall = found((high - OUTER * length).max(inner[1]), (high + half).max(inner[1]));
    // Half a wall of points may lie nearer.
    [(low_wall.0.min(inner[0]), low_wall.1), (high_wall.0.max(inner[1]), high_wall.1)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::random::Random;

    /// Points on the walls of a box about the origin, turned, with noise, furniture and what is seen through a window.
    fn scanned(size: [f64; 3], turn: f64) -> Vec<[f64; 3]> {
        let mut random = Random::stream(3, 0);
        let axis = DVec2::from_angle(turn);
        let mut points = Vec::new();
        for i in 0..20_000 {
            let mut at = [0, 1, 2].map(|k| (random.uniform_f64() - 0.5) * size[k]);
            match i % 20 {
                // A table in the middle, and the street.
                0..3 => at = [at[0] * 0.3, at[1] * 0.3, -0.2 * size[2]],
                3 if i % 80 == 3 => at[0] = (0.6 + 2.0 * random.uniform_f64()) * size[0],
                _ => {
                    let wall = i % 6;
                    at[wall / 2] =
                        (wall % 2) as f64 * size[wall / 2] - 0.5 * size[wall / 2] + 0.02 * (random.uniform_f64() - 0.5);
                }
            }
            let plan = at[0] * axis + at[1] * axis.perp();
            points.push([plan.x, plan.y, at[2]]);
        }
        points
    }

    #[test]
    fn a_box_is_found_in_the_points_of_its_walls() {
        for turn in [0.0, 0.3, 1.2] {
            let found = Mesh::box_around(&scanned([7.0, 4.5, 2.8], turn), &[]).unwrap();
            // Either side may be the length.
            let quarter = std::f64::consts::FRAC_PI_2;
            let apart = (found.turn_rad - turn + 0.5 * quarter).rem_euclid(quarter) - 0.5 * quarter;
            assert!(apart.abs() < 0.01, "{turn}: {}", found.turn_rad);
            for (length, stated) in found.size_m.iter().zip([7.0, 4.5, 2.8]) {
                assert!((length - stated).abs() < 0.02, "{turn}: {:?}", found.size_m);
            }
            assert!(found.on_wall.iter().all(|share| *share > 0.1), "{:?}", found.on_wall);
            assert_eq!(found.mesh.groups.len(), 6);
            found.mesh.check().unwrap();
        }
    }

    #[test]
    fn rooms_hold_the_places_that_they_were_seen_from() {
        // Of a corner, photographs from where no points are.
        let points: Vec<[f64; 3]> = scanned([4.0, 4.0, 2.4], 0.4).into_iter().filter(|p| p[0] < 0.3).collect();
        let held: Vec<[f64; 3]> =
            (0..20).map(|i| [2.0 + 0.05 * f64::from(i), 0.1 * f64::from(i), 0.07 * f64::from(i)]).collect();
        let boxed = Mesh::box_around(&points, &held).unwrap();
        let mesh = &boxed.mesh;
        let room = crate::Room::new(mesh, &vec![crate::Material::even("", 0.1, 0.1); mesh.groups.len()]).unwrap();
        assert!(held.iter().all(|at| room.encloses(*at).unwrap() && room.surroundings(*at).unwrap().clearance_m > 0.2));
        assert!(boxed.on_wall.iter().any(|share| *share < 0.01), "{:?}", boxed.on_wall);
    }

    #[test]
    fn what_encloses_nothing_is_refused() {
        let refused = |points: &[[f64; 3]]| Mesh::box_around(points, &[]).unwrap_err().to_string();
        assert!(refused(&[[0.0; 3]; 5]).contains("100 or more"));
        assert!(refused(&[[0.0, 0.0, f64::NAN]; 200]).contains("NaN"));
        assert!(refused(&[[1.0, 2.0, 3.0]; 200]).contains("those of a room"));
    }
}
