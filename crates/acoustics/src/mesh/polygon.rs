//! Polygons as triangles.

use earcut::Earcut;
use glam::{DVec2, DVec3};

/// Largest sum of squares of corners of the polygons of a mesh that are not convex: cutting them takes as long.
const MOST_WORK: usize = 1 << 26;

/// Cuts polygons, and adds up what that takes.
#[derive(Default)]
pub(crate) struct Cutter {
    work: usize,
}

impl Cutter {
    /// What is said where there are too many corners.
    pub(crate) const EXPECTED: &str = "polygons that are convex, or whose corners' squares sum up to at most 67108864";

    /// Cuts a flat polygon into triangles of numbers of its corners, whose places are given in their order.
    ///
    /// # Errors
    /// The sum of the squares of corners where it is too large.
    pub(crate) fn cut(&mut self, places: &[DVec3]) -> Result<Vec<[usize; 3]>, String> {
        let count = places.len();
        if count < 3 {
            return Ok(Vec::new());
        }
        // Newell's normal, as long as twice the area.
        let around = || places.iter().zip(places.iter().cycle().skip(1));
        let normal = around().fold(DVec3::ZERO, |sum, (a, b)| sum + (*a - places[0]).cross(*b - places[0]));
        let Some(normal) = normal.try_normalize() else { return Ok(halved(count)) };
        let (along, across) = normal.any_orthonormal_pair();
        let flat: Vec<DVec2> = places.iter().map(|p| *p - places[0]).map(|p| DVec2::new(p.dot(along), p.dot(across))).collect();
        if is_convex(&flat) {
            return Ok(halved(count));
        }
        self.work = self.work.saturating_add(count.saturating_mul(count));
        if self.work > MOST_WORK {
            return Err(format!("a polygon of {count} corners that is not convex"));
        }
        Ok(ears(&flat))
    }
}

/// Whether a polygon that goes round to the left turns left at each corner, and goes round once.
fn is_convex(flat: &[DVec2]) -> bool {
    let count = flat.len();
    let side = |i: usize| flat[(i + 1) % count] - flat[i];
    let mut turned = 0.0;
    for i in 0..count {
        let (before, after) = (side(i), side((i + 1) % count));
        let scale = before.length() * after.length();
        if before.perp_dot(after) < -1e-9 * scale
            || (scale > 0.0 && before.dot(after) < 0.0 && before.perp_dot(after).abs() <= 1e-9 * scale)
        {
            return false;
        }
        turned += before.perp_dot(after).atan2(before.dot(after));
    }
    turned < 1.5 * std::f64::consts::TAU
}

/// Triangles of a convex polygon. Of few corners a fan; else halves of halves, whose triangles lie over each other's bounding
/// boxes less than a fan's.
fn halved(count: usize) -> Vec<[usize; 3]> {
    if count <= 8 {
        return (1..count - 1).map(|i| [0, i, i + 1]).collect();
    }
    let mut triangles = Vec::with_capacity(count - 2);
    let mut waiting = vec![(0, count - 1)];
    while let Some((from, to)) = waiting.pop() {
        if to - from >= 2 {
            let middle = from + (to - from) / 2;
            triangles.push([from, middle, to]);
            waiting.extend([(from, middle), (middle, to)]);
        }
    }
    triangles
}

/// Triangles of a polygon that goes round to the left, as it does.
fn ears(flat: &[DVec2]) -> Vec<[usize; 3]> {
    let mut corners: Vec<usize> = Vec::new();
    Earcut::new().earcut(flat.iter().map(|p| p.to_array()), &[], &mut corners);
    let turn = |[a, b, c]: [usize; 3]| (flat[b] - flat[a]).perp_dot(flat[c] - flat[b]);
    let to_the_left = |[a, b, c]: [usize; 3]| if turn([a, b, c]) < 0.0 { [a, c, b] } else { [a, b, c] };
    corners.as_chunks().0.iter().copied().map(to_the_left).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(places: &[DVec3], triangles: &[[usize; 3]]) -> f64 {
        triangles.iter().map(|t| t.map(|i| places[i])).map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum()
    }

    #[test]
    fn an_l_is_not_covered_beyond_its_corner() {
        let l = [[0, 0], [6, 0], [6, 3], [3, 3], [3, 6], [0, 6]];
        for turn in 0..6 {
            // A plane that is not level, begun at any corner, in either direction.
            let mut places: Vec<DVec3> =
                l.iter().map(|[x, y]| DVec3::new(f64::from(*x), f64::from(*y), 0.5 * f64::from(*x))).collect();
            places.rotate_left(turn);
            for _ in 0..2 {
                let triangles = Cutter::default().cut(&places).unwrap();
                assert_eq!(triangles.len(), 4);
                assert!((area(&places, &triangles) - 27.0 * 1.25_f64.sqrt()).abs() < 1e-9, "{turn} {triangles:?}");
                places.reverse();
            }
        }
    }

    #[test]
    fn round_polygons_are_whole() {
        for count in [3, 4, 9, 1000, 200_000] {
            let at = |i: usize| std::f64::consts::TAU * i as f64 / count as f64;
            let places: Vec<DVec3> = (0..count).map(|i| DVec3::new(at(i).cos(), at(i).sin(), 2.0)).collect();
            let triangles = Cutter::default().cut(&places).unwrap();
            let exact = 0.5 * count as f64 * (std::f64::consts::TAU / count as f64).sin();
            assert_eq!(triangles.len(), count - 2);
            assert!((area(&places, &triangles) - exact).abs() < 1e-6, "{count}");
        }
    }

    #[test]
    fn stars_take_no_more_than_is_stated() {
        let star = |count: usize| -> Vec<DVec3> {
            let at = |i: usize| std::f64::consts::TAU * i as f64 / count as f64;
            (0..count).map(|i| DVec3::new(at(i).cos(), at(i).sin(), 0.0) * (1.0 + (i % 2) as f64)).collect()
        };
        let whole = Cutter::default().cut(&star(1000)).unwrap();
        assert_eq!(whole.len(), 998);
        let error = Cutter::default().cut(&star(20_000)).unwrap_err();
        assert!(error.contains("20000 corners"), "{error}");
    }

    #[test]
    fn polygons_that_are_none_end() {
        for places in [vec![DVec3::ZERO; 7], (0..9).map(|i| DVec3::X * f64::from(i)).collect(), vec![DVec3::Y; 2]] {
            let _ = Cutter::default().cut(&places).unwrap();
        }
        // A bow.
        let bow = [DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0), DVec3::X, DVec3::new(0.0, 1.1, 0.0), DVec3::new(0.0, 0.5, 0.0)];
        assert!(!Cutter::default().cut(&bow).unwrap().is_empty());
    }
}
