//! How the emitter is seen round corners.

use crate::Axis;
use crate::octave::Octaves;
use glam::Vec3;

/// Edges that a listener hears the emitter round at once, at most.
pub(crate) const MOST_EDGES: usize = 2;

/// Where the emitter is hidden, and which edge its sound comes round there: as the geometry has it, on a table of places of its
/// own.
#[derive(Clone, Debug, PartialEq)]
pub struct Corners {
    /// Places, metres, along x, y and z.
    pub places: [Axis; 3],
    /// How much of the emitter is seen at each, 0 to 1, `[z][y][x]`.
    pub direct: Vec<f32>,
    /// The edge that it is heard round there, by its number; [`Corners::NO_EDGE`] for none.
    pub round: Vec<f32>,
    /// The edges.
    pub edges: Vec<DiffractionEdge>,
}

/// An edge that sound goes round.
#[derive(Clone, Debug, PartialEq)]
pub struct DiffractionEdge {
    /// World, metres.
    pub ends: [Vec3; 2],
    /// What the emitter sends to it: amplitude at 1 m by octave, as image sources have theirs.
    pub gains: Octaves,
}

/// What an edge takes of a sound whose way round it is this much longer than the straight one, dB: 5 at the border of the
/// shadow, 13 for half a wavelength (Kurze and Anderson 1971, after Maekawa 1968).
#[must_use]
pub fn barrier_db(detour_m: f64, hz: f64, speed_m_s: f64) -> f64 {
    let fresnel = 2.0 * detour_m.max(0.0) * hz / speed_m_s;
    let root = (std::f64::consts::TAU * fresnel).sqrt();
    let ratio = if root < 1e-6 { 1.0 } else { root / root.tanh() };
    5.0 + 20.0 * ratio.log10()
}

/// What is heard round an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Round {
    pub(crate) edge: usize,
    /// Share of it.
    pub(crate) weight: f32,
}

/// The shortest way round an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Way {
    /// Where it passes the edge, world, metres.
    pub(crate) bend: Vec3,
    /// Its length, and how much longer than the straight way that is, metres.
    pub(crate) length_m: f32,
    pub(crate) detour_m: f32,
}

impl Corners {
    /// No edge.
    pub const NO_EDGE: f32 = -1.0;

    /// Number of places.
    #[must_use]
    pub fn place_count(&self) -> usize {
        self.places.iter().map(Axis::count).product()
    }

    /// How much of the emitter a listener sees, 0 to 1.
    #[must_use]
    pub fn direct_at(&self, position: Vec3) -> f32 {
        Axis::places_around(&self.places, position).map(|(place, weight)| weight * self.direct[place]).sum()
    }

    /// The edges that a listener hears the emitter round.
    pub(crate) fn round_at(&self, position: Vec3) -> [Option<Round>; MOST_EDGES] {
        let mut found: [Option<Round>; MOST_EDGES] = [None; MOST_EDGES];
        for (place, weight) in Axis::places_around(&self.places, position) {
            let edge = self.round[place];
            if edge < 0.0 || weight <= 0.0 {
                continue;
            }
            let edge = crate::number::whole(edge.into());
            let weight = weight * (1.0 - self.direct[place]);
            let slot = found.iter().position(|round| round.is_none_or(|round| round.edge == edge));
            if let Some(slot) = slot {
                let old = found[slot].map_or(0.0, |round| round.weight);
                found[slot] = Some(Round { edge, weight: old + weight });
            }
        }
        found
    }

    /// The way round an edge: both sides unfolded into a plane, it is straight.
    pub(crate) fn way(&self, edge: usize, emitter: Vec3, listener: Vec3) -> Way {
        let [start, end] = self.edges[edge].ends;
        let along = (end - start).normalize_or_zero();
        let cylinder = |at: Vec3| {
            let z = (at - start).dot(along);
            (z, (at - start - z * along).length())
        };
        let ((z, r), (other_z, other_r)) = (cylinder(emitter), cylinder(listener));
        let at = z + (other_z - z) * r / (r + other_r).max(1e-6);
        let bend = start + at.clamp(0.0, start.distance(end)) * along;
        let length_m = emitter.distance(bend) + bend.distance(listener);
        Way { bend, length_m, detour_m: (length_m - emitter.distance(listener)).max(0.0) }
    }

    /// Bytes in memory.
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.direct) + size_of_val(&*self.round) + size_of_val(&*self.edges)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octave::OCTAVES;

    #[test]
    fn what_is_hidden_is_heard_round_its_edge() {
        // A corner at (1, 1) hides the emitter from the last column.
        let corners = Corners {
            places: [Axis::uniform(0.0, 0.5, 3), Axis::single(0.0), Axis::single(0.0)],
            direct: vec![1.0, 1.0, 0.0],
            round: vec![Corners::NO_EDGE, Corners::NO_EDGE, 0.0],
            edges: vec![DiffractionEdge { ends: [Vec3::new(1.0, 1.0, -2.0), Vec3::new(1.0, 1.0, 2.0)], gains: [1.0; OCTAVES] }],
        };
        assert_eq!(corners.direct_at(Vec3::new(0.75, 3.0, 0.0)), 0.5);
        assert_eq!(corners.round_at(Vec3::new(0.2, 0.0, 0.0)), [None, None]);
        assert_eq!(corners.round_at(Vec3::new(0.9, 0.0, 0.0))[0].map(|r| (r.edge, (r.weight * 10.0).round())), Some((0, 8.0)));
        let way = corners.way(0, Vec3::new(1.0, 4.0, 1.0), Vec3::new(1.0, 0.0, 0.0));
        assert!(way.bend.distance(Vec3::new(1.0, 1.0, 0.25)) < 1e-6 && way.detour_m.abs() < 1e-6, "{way:?}");
        let way = corners.way(0, Vec3::new(4.0, 1.0, 0.0), Vec3::new(1.0, 0.0, 0.0));
        assert!((way.detour_m - (4.0 - 10.0_f32.sqrt())).abs() < 1e-6, "{way:?}");
    }
}
