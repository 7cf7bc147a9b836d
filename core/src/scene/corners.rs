//! How the emitter and its images are seen round corners.

use crate::Axis;
use crate::octave::Octaves;
use glam::Vec3;

/// Edges that a listener hears the emitter round at once, at most.
const MOST_EDGES: usize = 2;
/// Ways of the emitter and of its images round edges that a listener hears at once, at most.
pub(crate) const MOST_ROUND: usize = MOST_EDGES + 4;

/// Where the emitter is hidden, and which edge its sound comes round there: as the geometry has it, on a table of places of its
/// own.
#[derive(Clone, Debug, PartialEq)]
pub struct Corners {
    /// Places, metres, along x, y and z.
    pub places: [Axis; 3],
    /// How much of the emitter is seen at each, 0 to 1, `[z][y][x]`.
    pub direct: Vec<f32>,
    /// The edge that it is heard round there, or past which it is seen, by its number; [`Corners::NO_EDGE`] for none.
    pub round: Vec<f32>,
    /// The edges that images are heard round there, as many tables one after the other as a place has of them at most,
    /// `[table][z][y][x]`, with numbers as in [`Corners::round`].
    pub images: Vec<f32>,
    /// Which of the first images are seen there: a sum of powers of two, `2^i` for the image of number `i`, at most
    /// [`Corners::MOST_SEEN`] of them, `[z][y][x]`. Empty where only the images' own table knows.
    pub seen: Vec<f32>,
    /// The edges, one for each sound that comes round it: first those of the emitter itself.
    pub edges: Vec<DiffractionEdge>,
}

/// An edge that sound goes round.
#[derive(Clone, Debug, PartialEq)]
pub struct DiffractionEdge {
    /// World, metres.
    pub ends: [Vec3; 2],
    /// What the emitter sends to it, and what is left of that on the way: amplitude at 1 m by octave, as image sources have
    /// theirs. Below 0 where what sends it is seen past the edge: of that the edge leaves what [`lit_gain`] says.
    pub gains: Octaves,
    /// Where its sound comes from if that is not the emitter, world, metres: an image.
    pub from: Option<Vec3>,
    /// How much longer its way to the edge is than the straight one, metres: round another edge.
    pub longer_m: f32,
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

/// Amplitude that an edge leaves of a sound that passes it in sight, beside its shadow, when the way over it is this much
/// longer than the straight one: 5 dB below all of it at the border of the shadow, all from a Fresnel number of .19 on (Kurze
/// and Anderson 1971).
#[must_use]
pub fn lit_gain(detour_m: f64, hz: f64, speed_m_s: f64) -> f64 {
    let root = (std::f64::consts::TAU * 2.0 * detour_m.max(0.0) * hz / speed_m_s).sqrt();
    // The tangent passes all of it before it is infinite.
    if root > 1.2 { 1.0 } else { (10.0_f64.powf(-0.25) * root.max(1e-6).tan() / root.max(1e-6)).min(1.0) }
}

/// What is heard round an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Round {
    pub(crate) edge: usize,
    /// Share of it.
    pub(crate) weight: f32,
    /// Whether it is an image that is heard, not the emitter.
    pub(crate) image: bool,
}

/// The shortest way round an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Way {
    /// Where it passes the edge, world, metres.
    pub(crate) bend: Vec3,
    /// Its length, that of the straight way, and how much longer than that it is, metres.
    pub(crate) length_m: f32,
    pub(crate) direct_m: f32,
    pub(crate) detour_m: f32,
}

impl DiffractionEdge {
    /// Whether what sends its sound is seen past it.
    pub(crate) fn is_lit(&self) -> bool {
        self.gains[0] < 0.0
    }
}

impl Corners {
    /// No edge.
    pub const NO_EDGE: f32 = -1.0;
    /// Images of which it is known where they are seen, at most: single precision counts as far with one to spare.
    pub const MOST_SEEN: usize = 23;

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

    /// How much of each of the first images a listener sees, 0 to 1; `None` where that is not known here.
    pub(crate) fn images_at(&self, position: Vec3) -> Option<[f32; Self::MOST_SEEN + 1]> {
        if self.seen.is_empty() {
            return None;
        }
        let mut out = [0.0; Self::MOST_SEEN + 1];
        for (place, weight) in Axis::places_around(&self.places, position) {
            let seen = crate::number::whole(self.seen[place].into());
            out.iter_mut().enumerate().filter(|(i, _)| (seen >> i) & 1 == 1).for_each(|(_, out)| *out += weight);
        }
        Some(out)
    }

    /// The edges that a listener hears the emitter and its images round.
    pub(crate) fn round_at(&self, position: Vec3) -> [Option<Round>; MOST_ROUND] {
        let mut found: [Option<Round>; MOST_ROUND] = [None; MOST_ROUND];
        let (of_emitter, of_images) = found.split_at_mut(MOST_EDGES);
        let mut add = |number: f32, weight: f32, image: bool| {
            if number < 0.0 || weight <= 0.0 {
                return;
            }
            let edge = crate::number::whole(number.into());
            let slots = if image { &mut *of_images } else { &mut *of_emitter };
            if let Some(slot) = slots.iter_mut().find(|round| round.is_none_or(|round| round.edge == edge)) {
                let old = slot.map_or(0.0, |round| round.weight);
                *slot = Some(Round { edge, weight: old + weight, image });
            }
        };
        for (place, weight) in Axis::places_around(&self.places, position) {
            add(self.round[place], weight, false);
            for table in self.images.chunks_exact(self.direct.len().max(1)) {
                add(table[place], weight, true);
            }
        }
        found
    }

    /// How much longer a way round an edge can be than that to the emitter, metres, wherever the listener is.
    pub(crate) fn longest_m(&self, emitter: Vec3) -> f32 {
        let longest = |edge: &DiffractionEdge| {
            let from = edge.from.unwrap_or(emitter);
            let [a, b] = edge.ends.map(|end| from.distance(end) + end.distance(emitter));
            a.max(b) + edge.longer_m
        };
        self.edges.iter().map(longest).fold(0.0, f32::max)
    }

    /// The way round an edge: both sides unfolded into a plane, it is straight.
    pub(crate) fn way(&self, edge: usize, emitter: Vec3, listener: Vec3) -> Way {
        let DiffractionEdge { ends: [start, end], from, longer_m, .. } = self.edges[edge];
        let emitter = from.unwrap_or(emitter);
        let along = (end - start).normalize_or_zero();
        let cylinder = |at: Vec3| {
            let z = (at - start).dot(along);
            (z, (at - start - z * along).length())
        };
        let ((z, r), (other_z, other_r)) = (cylinder(emitter), cylinder(listener));
        let at = z + (other_z - z) * r / (r + other_r).max(1e-6);
        let bend = start + at.clamp(0.0, start.distance(end)) * along;
        let length_m = emitter.distance(bend) + bend.distance(listener) + longer_m;
        let direct_m = emitter.distance(listener);
        Way { bend, length_m, direct_m, detour_m: (length_m - direct_m).max(0.0) }
    }

    /// Bytes in memory.
    pub(crate) fn memory_bytes(&self) -> usize {
        let tables = [&self.direct, &self.round, &self.images, &self.seen].map(|table| size_of_val(&**table));
        tables.iter().sum::<usize>() + size_of_val(&*self.edges)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octave::OCTAVES;

    #[test]
    fn what_is_hidden_is_heard_round_its_edge() {
        // A corner at (1, 1) hides the emitter from the last column.
        let ends = [Vec3::new(1.0, 1.0, -2.0), Vec3::new(1.0, 1.0, 2.0)];
        let edge = |from| DiffractionEdge { ends, gains: [1.0; OCTAVES], from, longer_m: 0.0 };
        let corners = Corners {
            places: [Axis::uniform(0.0, 0.5, 3), Axis::single(0.0), Axis::single(0.0)],
            direct: vec![1.0, 1.0, 0.0],
            round: vec![Corners::NO_EDGE, Corners::NO_EDGE, 0.0],
            images: vec![Corners::NO_EDGE, 1.0, 1.0],
            seen: vec![5.0, 1.0, 2.0],
            edges: [None, Some(Vec3::new(4.0, 1.0, 0.0))].map(edge).to_vec(),
        };
        assert_eq!(corners.direct_at(Vec3::new(0.75, 3.0, 0.0)), 0.5);
        assert_eq!(corners.round_at(Vec3::new(0.0, 0.0, 0.0)), [None; MOST_ROUND]);
        assert_eq!(corners.round_at(Vec3::new(0.9, 0.0, 0.0))[0].map(|r| (r.edge, (r.weight * 10.0).round())), Some((0, 8.0)));
        let way = corners.way(0, Vec3::new(1.0, 4.0, 1.0), Vec3::new(1.0, 0.0, 0.0));
        assert!(way.bend.distance(Vec3::new(1.0, 1.0, 0.25)) < 1e-6 && way.detour_m.abs() < 1e-6, "{way:?}");
        // An image is heard round it where the emitter itself is in sight.
        let image = corners.round_at(Vec3::new(0.4, 0.0, 0.0))[MOST_EDGES].unwrap();
        assert!(image.image && image.edge == 1 && (image.weight - 0.8).abs() < 1e-6, "{image:?}");
        // The first image is seen from the first two places, the second from the last and the third from the first.
        assert_eq!(corners.images_at(Vec3::new(0.25, 0.0, 0.0)).unwrap()[..4], [1.0, 0.0, 0.5, 0.0]);
        assert_eq!(corners.images_at(Vec3::new(0.625, 0.0, 0.0)).unwrap()[..4], [0.75, 0.25, 0.0, 0.0]);
        assert!((corners.longest_m(Vec3::ZERO) - (13.0_f32.sqrt() + 6.0_f32.sqrt())).abs() < 1e-5);
        assert_eq!(corners.way(1, Vec3::ZERO, Vec3::X), corners.way(0, Vec3::new(4.0, 1.0, 0.0), Vec3::X));
        let way = corners.way(0, Vec3::new(4.0, 1.0, 0.0), Vec3::new(1.0, 0.0, 0.0));
        assert!((way.detour_m - (4.0 - 10.0_f32.sqrt())).abs() < 1e-6, "{way:?}");
    }
}
