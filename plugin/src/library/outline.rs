//! Walls of a scene, as far as its points tell: scenes of rooms have points along the edges of their walls, line by line.

use promenade_core::Anchor;
use promenade_core::glam::{Vec2, Vec3};

/// Steps along an edge that differ by less are the same, metres.
const SAME_M: f32 = 2e-3;
/// Two points that belong to no longer edge are one where they are no further apart, metres.
const SHORT_M: f32 = 0.26;
/// Points that lie in rows are an outline when so many of all do.
const IN_ROWS: f32 = 0.8;
/// Edges within this height of the lowest are the floor's, metres.
const FLOOR_M: f32 = 0.05;

/// The edges of a room's walls.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outline {
    /// Both ends of each, world, metres; none where a scene's points are something else.
    pub edges: Vec<[Vec3; 2]>,
    /// Edges of the floor, where they go round it.
    floor: Vec<[Vec2; 2]>,
}

impl Outline {
    /// That of a scene's points.
    pub fn of(anchors: &[Anchor]) -> Self {
        let at = |index: usize| anchors[index].position;
        let (mut edges, mut in_rows, mut first) = (Vec::new(), 0, 0);
        while first + 1 < anchors.len() {
            let step = at(first + 1) - at(first);
            let goes_on = |next: &usize| (at(*next) - at(next - 1)).distance(step) < SAME_M;
            let last = first + (first + 1..anchors.len()).take_while(goes_on).count();
            let is_row = last > first + 1;
            let is_edge = is_row || (SAME_M..SHORT_M).contains(&step.length());
            if is_edge {
                // Walls that meet have the edge between them each.
                let ends = [at(first), at(last)];
                let is_same = |[a, b]: &[Vec3; 2]| {
                    let near = |[c, d]: [Vec3; 2]| a.distance(c) < SAME_M && b.distance(d) < SAME_M;
                    near(ends) || near([ends[1], ends[0]])
                };
                if !edges.iter().any(is_same) {
                    edges.push(ends);
                }
                in_rows += if is_row { last - first + 1 } else { 0 };
            }
            first = if is_edge { last + 1 } else { first + 1 };
        }
        if (in_rows as f32) < IN_ROWS * anchors.len() as f32 || edges.is_empty() {
            return Self::default();
        }
        let low = edges.as_flattened().iter().fold(f32::INFINITY, |low, end| low.min(end.z));
        let is_low = |edge: &&[Vec3; 2]| edge.iter().all(|end| end.z < low + FLOOR_M);
        let floor: Vec<_> = edges.iter().filter(is_low).map(|edge| edge.map(Vec3::truncate)).collect();
        // Each corner has two edges where they go round.
        let ends = floor.as_flattened();
        let is_round = |end: &Vec2| ends.iter().filter(|other| other.distance(*end) < FLOOR_M).count().is_multiple_of(2);
        let floor = if ends.iter().all(is_round) { floor } else { Vec::new() };
        Self { edges, floor }
    }

    /// The corners of the box about the floor; none where it is not known.
    pub fn plan(&self) -> Option<[Vec2; 2]> {
        let ends = self.floor.as_flattened();
        let first = *ends.first()?;
        Some(ends.iter().fold([first; 2], |[low, high], end| [low.min(*end), high.max(*end)]))
    }

    /// Whether a place is between the walls; `None` where they are not known.
    pub fn is_inside(&self, at: Vec3) -> Option<bool> {
        let crosses = |[a, b]: &&[Vec2; 2]| {
            let beside = (a.x > at.x) != (b.x > at.x);
            beside && a.y + (at.x - a.x) / (b.x - a.x) * (b.y - a.y) > at.y
        };
        let heights = self.edges.as_flattened().iter().map(|end| end.z);
        let (low, high) = heights.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)));
        let within = (low..=high).contains(&at.z);
        (!self.floor.is_empty()).then(|| within && !self.floor.iter().filter(crosses).count().is_multiple_of(2))
    }

    /// Whether a place is between the walls and so far away from them on all sides of the plan, metres.
    pub fn is_clear(&self, at: Vec3, margin_m: f32) -> Option<bool> {
        let sides = [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];
        let inside = |(x, y): (f32, f32)| self.is_inside(at + margin_m * Vec3::new(x, y, 0.0));
        sides.into_iter().map(inside).try_fold(true, |all, one| Some(all && one?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::factory;
    use promenade_core::Scene;

    #[test]
    fn the_walls_of_the_loft_go_round_its_corner() {
        let scene = Scene::from_bytes(factory::LOFT.bytes).unwrap();
        let outline = Outline::of(scene.anchors());
        assert_eq!(outline.edges.len(), 18, "{:?}", outline.edges);
        for (x, y, inside) in [(0.0, 0.0, true), (-5.0, -9.0, true), (2.0, -5.0, false), (-7.0, 0.0, false), (0.0, 2.5, false)]
        {
            assert_eq!(outline.is_inside(Vec3::new(x, y, 0.0)), Some(inside), "{x}, {y}");
        }
        assert_eq!(outline.is_inside(Vec3::new(0.0, 0.0, 2.5)), Some(false), "above the ceiling");
        assert_eq!(
            (outline.is_clear(Vec3::new(0.0, 2.3, 0.0), 0.2), outline.is_clear(Vec3::ZERO, 0.2)),
            (Some(false), Some(true))
        );
    }

    #[test]
    fn points_of_a_cloud_are_no_walls() {
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/scenes/box.promenade");
        let cloud = Scene::from_bytes(&std::fs::read(file).unwrap()).unwrap();
        assert_eq!(Outline::of(cloud.anchors()), Outline::default());
        assert_eq!(Outline::default().is_inside(Vec3::ZERO), None);
    }

    #[test]
    fn every_place_of_the_library_has_walls() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/library");
        for place in factory::PLACES {
            let scene = Scene::from_bytes(&std::fs::read(folder.join(place.file)).unwrap()).unwrap();
            let outline = Outline::of(scene.anchors());
            let start = outline.is_inside(scene.start_pose().position);
            assert_eq!((start, outline.edges.len() > 7), (Some(true), true), "{}", place.file);
        }
    }
}
