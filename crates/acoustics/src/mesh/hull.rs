//! Convex hulls of points with whole coordinates, exactly: no rounding decides on which side of a face a point lies.

use std::collections::HashMap;

/// A point with whole coordinates of up to 10^12, whose volumes fit.
type Point = [i64; 3];

struct Face {
    corners: [usize; 3],
    /// Points that it sees, each seen by one face.
    outside: Vec<usize>,
}

/// Faces of the hull by numbers of points, each once round to the left seen from outside; none where all points lie in a plane.
///
/// Quickhull: Barber, Dobkin and Huhdanpaa, "The Quickhull Algorithm for Convex Hulls", ACM Transactions on Mathematical
/// Software 22, 1996.
pub(super) fn hull(points: &[Point]) -> Option<Vec<[usize; 3]>> {
    let mut faces: HashMap<usize, Face> =
        first(points)?.map(|corners| Face { corners, outside: Vec::new() }).into_iter().enumerate().collect();
    // The face of each edge, in the direction that it goes round it.
    let mut beside: HashMap<(usize, usize), usize> =
        faces.iter().flat_map(|(number, face)| edges(face.corners).map(|edge| (edge, *number))).collect();
    share_out(points, &mut faces, &[0, 1, 2, 3], 0..points.len());
    let (mut waiting, mut next) = (vec![0, 1, 2, 3], 4);
    while let Some(number) = waiting.pop() {
        let Some(face) = faces.get(&number) else { continue };
        let Some(&top) = face.outside.iter().max_by_key(|p| volume(points, face.corners, **p)) else { continue };
        // Faces that the point sees, and the edges round them.
        let (mut seen, mut round, mut at) = (vec![number], Vec::new(), 0);
        while let Some(&of) = seen.get(at) {
            for (from, to) in edges(faces[&of].corners) {
                let other = beside[&(to, from)];
                if seen.contains(&other) {
                    continue;
                }
                if volume(points, faces[&other].corners, top) > 0 { seen.push(other) } else { round.push((from, to)) }
            }
            at += 1;
        }
        let gone: Vec<Face> = seen.iter().filter_map(|number| faces.remove(number)).collect();
        let new: Vec<usize> = (next..next + round.len()).collect();
        next += round.len();
        for (&number, (from, to)) in new.iter().zip(round) {
            let corners = [from, to, top];
            beside.extend(edges(corners).map(|edge| (edge, number)));
            faces.insert(number, Face { corners, outside: Vec::new() });
        }
        share_out(points, &mut faces, &new, gone.into_iter().flat_map(|face| face.outside));
        waiting.extend(new);
    }
    let mut found: Vec<(usize, [usize; 3])> = faces.into_iter().map(|(number, face)| (number, face.corners)).collect();
    found.sort_unstable();
    Some(found.into_iter().map(|(_, corners)| corners).collect())
}

/// A tetrahedron of points that are far apart.
fn first(points: &[Point]) -> Option<[[usize; 3]; 4]> {
    let all = || 0..points.len();
    let a = all().min_by_key(|i| points[*i])?;
    let b = all().max_by_key(|i| points[*i])?;
    let off = |i: usize| cross(minus(points[b], points[a]), minus(points[i], points[a])).map(i128::unsigned_abs);
    let c = all().max_by_key(|i| off(*i).into_iter().max())?;
    let d = all().max_by_key(|i| volume(points, [a, b, c], *i).unsigned_abs())?;
    let [b, c] = if volume(points, [a, b, c], d) > 0 { [c, b] } else { [b, c] };
    (volume(points, [a, b, c], d) != 0).then_some([[a, b, c], [a, c, d], [c, b, d], [b, a, d]])
}

/// Gives each point to the first of some faces that it lies outside of; those inside are of no more concern.
fn share_out(points: &[Point], faces: &mut HashMap<usize, Face>, among: &[usize], seen: impl Iterator<Item = usize>) {
    for point in seen {
        if let Some(number) = among.iter().find(|number| volume(points, faces[number].corners, point) > 0)
            && let Some(face) = faces.get_mut(number)
        {
            face.outside.push(point);
        }
    }
}

fn edges([a, b, c]: [usize; 3]) -> [(usize, usize); 3] {
    [(a, b), (b, c), (c, a)]
}

/// Six times the volume between a face and a point, above 0 where the point is outside.
fn volume(points: &[Point], [a, b, c]: [usize; 3], p: usize) -> i128 {
    let from = |to: usize| minus(points[to], points[a]);
    cross(from(b), from(c)).into_iter().zip(from(p)).map(|(n, x)| n * x).sum()
}

fn minus(a: Point, b: Point) -> [i128; 3] {
    [0, 1, 2].map(|k| i128::from(a[k]) - i128::from(b[k]))
}

fn cross(a: [i128; 3], b: [i128; 3]) -> [i128; 3] {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| a[i] * b[j] - a[j] * b[i])
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::random::Random;

    /// Checks that nothing is outside, that each edge has two faces, and that volume and corners are right.
    fn check(points: &[Point], corners: usize, volume6: i128) {
        let faces = hull(points).unwrap();
        let mut used: Vec<usize> = faces.concat();
        used.sort_unstable();
        used.dedup();
        assert_eq!((used.len(), faces.len()), (corners, 2 * corners - 4), "Euler's formula");
        for face in &faces {
            assert!((0..points.len()).all(|p| volume(points, *face, p) <= 0), "{face:?}");
            assert!(edges(*face).iter().all(|(a, b)| faces.iter().any(|other| edges(*other).contains(&(*b, *a)))));
        }
        let whole: i128 = faces.iter().map(|face| -volume(points, *face, used[0])).sum();
        assert_eq!(whole, volume6);
    }

    #[test]
    fn a_grid_of_points_is_a_box() {
        let points: Vec<Point> = (0..7 * 5 * 4).map(|i| [i % 7, i / 7 % 5, i / 35]).collect();
        // Points within edges and faces are no corners, but some may lie on the rim of a triangle.
        let faces = hull(&points).unwrap();
        assert!(faces.iter().all(|face| (0..points.len()).all(|p| volume(&points, *face, p) <= 0)));
        let whole: i128 = faces.iter().map(|face| -volume(&points, *face, 0)).sum();
        assert_eq!(whole, 6 * 6 * 4 * 3);
        let far: Vec<Point> =
            (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(|bit| (2 * bit - 1) * 1_000_000_000_000)).collect();
        check(&far, 8, 6 * 8 * 1_000_000_000_000_i128.pow(3));
    }

    #[test]
    fn points_on_a_sphere_are_all_corners_and_those_inside_none() {
        let mut random = Random::new(5);
        let mut at = |radius: f64| loop {
            let p = [0; 3].map(|_| f64::from(random.normal()));
            let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
            if length > 0.1 {
                break p.map(|x| (radius * x / length).round() as i64);
            }
        };
        let points: Vec<Point> = (0..300).map(|i| at(if i < 200 { 1e9 } else { 9e8 })).collect();
        let faces = hull(&points).unwrap();
        assert_eq!(faces.len(), 2 * 200 - 4);
        assert!(faces.concat().iter().all(|corner| *corner < 200));
        check(&points, 200, faces.iter().map(|face| -volume(&points, *face, 0)).sum());
    }

    #[test]
    fn points_in_a_plane_have_no_hull() {
        assert_eq!(hull(&[]), None);
        assert_eq!(hull(&[[1, 2, 3]]), None);
        assert_eq!(hull(&[[0, 0, 0], [1, 1, 1], [2, 2, 2], [3, 3, 3]]), None);
        assert_eq!(hull(&(0..30).map(|i| [i, i * i, i + 1]).collect::<Vec<_>>()), None);
    }
}
