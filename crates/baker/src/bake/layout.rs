//! How measurements lie around one emitter.

use crate::bake::kriging::Site;
use crate::error::BakeError;
use crate::sources::responses::Responses;
use glam::{Quat, Vec3};
use promenade_core::{Axis, Facing, FieldGrid, Pose, glam};
use promenade_metrics::statistics::median_high;

/// Two positions closer than this are one, metres.
pub(crate) const SAME_PLACE_M: f32 = 1e-3;
/// The densest directions that are kept apart, radians.
const FINEST_STEP: f32 = 2.5 * std::f32::consts::PI / 180.0;
/// The widest distance between the directions of a field, radians.
const COARSEST_STEP: f32 = 15.0 * std::f32::consts::PI / 180.0;
/// Directions lower and higher than this, as the vertical part of a unit vector, lie at the height of the head (2 degrees).
pub(crate) const LEVEL_Z: f32 = 0.035;
/// Directions higher and lower than this, as the vertical part of a unit vector, have no azimuth.
const ALMOST_UP: f32 = 0.9999;
/// Angles closer than this are one, radians.
const SAME_ANGLE: f32 = 1e-3;
/// Elevations above and below a ring, radians: a model head alone says what lies there.
const MODELLED_STEP: f32 = 22.5 * std::f32::consts::PI / 180.0;
/// Measured azimuths and elevations that are nodes, at most; where there are more, nodes are evenly spaced.
const MOST_AZIMUTHS: usize = 144;
const MOST_ELEVATIONS: usize = 48;
/// The densest directions of a field where several places were measured, radians.
const PLACES_STEP: f32 = 7.5 * std::f32::consts::PI / 180.0;

/// Measurements as listener poses around one emitter.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    /// Emitter in the scene's world, metres.
    pub(crate) emitter: Vec3,
    /// Listener pose of each response in the scene's world.
    pub(crate) poses: Vec<Pose>,
    /// Of each response the direction of the emitter and the listener's position.
    pub(crate) sites: Vec<Site>,
    /// Distance from listener to emitter of each response, metres.
    pub(crate) distances: Vec<f32>,
    /// Whether the room turns with the head: sources were measured around one listener.
    pub(crate) turns: bool,
    /// What was assumed, in words.
    pub(crate) notes: Vec<String>,
}

impl Layout {
    /// Finds the emitter and the poses around it.
    ///
    /// A source that stays is the emitter. Sources that move around a listener who stays are read as one emitter straight ahead
    /// of the origin, with the listener turned so that it is seen from the head as the source was: the room then turns with the
    /// head.
    pub(crate) fn of(responses: &Responses) -> Result<Self, BakeError> {
        let all = &responses.responses;
        let sources = count_places(all.iter().map(|r| r.source));
        let listeners = count_places(all.iter().map(|r| r.listener.position));
        let mut notes = Vec::new();
        let relative: Vec<Vec3> = all.iter().map(|r| r.listener.to_head(r.source)).collect();
        let distances: Vec<f32> = relative.iter().map(|v| v.length()).collect();
        if let Some(i) = distances.iter().position(|d| *d < SAME_PLACE_M) {
            let found = format!("both in one place in '{}'", all[i].name);
            return Err(BakeError::argument("responses", "a distance between listener and source", found));
        }
        let turns = sources > 1 && listeners == 1;
        let (emitter, poses): (Vec3, Vec<Pose>) = match (sources, listeners) {
            (0, _) => return Err(BakeError::argument("responses", "at least one", "none")),
            (1, _) => (all[0].source, all.iter().map(|r| r.listener).collect()),
            (_, 1) => {
                notes.push(format!(
                    "{sources} sources around one listener: read as one emitter, with the room turning with the head"
                ));
                let ahead = distances.iter().sum::<f32>() / distances.len() as f32;
                let emitter = Vec3::new(ahead, 0.0, 0.0);
                let pose = |(v, d): (&Vec3, &f32)| {
                    let azimuth = v.y.atan2(v.x);
                    let elevation = (v.z / d).clamp(-1.0, 1.0).asin();
                    let seen = Quat::from_rotation_z(azimuth) * Quat::from_rotation_y(-elevation);
                    Pose { position: emitter - Vec3::X * *d, orientation: seen.inverse().normalize() }
                };
                (emitter, relative.iter().zip(&distances).map(pose).collect())
            }
            _ => {
                let found = format!("{sources} sources and {listeners} listener positions");
                return Err(BakeError::argument("responses", "one source or one listener position (choose a source)", found));
            }
        };
        let stays = listeners == 1;
        let sites = relative
            .iter()
            .zip(&distances)
            .zip(&poses)
            .map(|((v, d), pose)| Site { direction: *v / *d, position: if stays { Vec3::ZERO } else { pose.position } })
            .collect();
        Ok(Self { emitter, poses, sites, distances, turns, notes })
    }

    /// A layout of some of the responses, by number.
    pub(crate) fn only(&self, used: &[usize]) -> Self {
        Self {
            emitter: self.emitter,
            poses: used.iter().map(|&i| self.poses[i]).collect(),
            sites: used.iter().map(|&i| self.sites[i]).collect(),
            distances: used.iter().map(|&i| self.distances[i]).collect(),
            turns: self.turns,
            notes: self.notes.clone(),
        }
    }

    /// Nodes for a field of the direct sound: every measured direction, and between them as dense as the measurements are where
    /// they are dense, over all directions. Where several places were measured, directions are those of a head alone, and need
    /// no more than [`PLACES_STEP`].
    pub(crate) fn nodes(&self) -> FieldGrid {
        let (level, places) = (self.is_level(), self.has_places());
        let finest = if places { PLACES_STEP } else { FINEST_STEP };
        // Twice as dense along a ring: levels of neighbours are blended by their logarithms from node to node.
        let density = if level && !places { 2.0 } else { 1.0 };
        let spacing = (self.direction_spacing() / density).clamp(finest, COARSEST_STEP);
        let directions = self.heard_directions();
        let (mut azimuths, mut elevations): (Vec<f32>, Vec<f32>) = (
            directions.iter().filter(|d| d.z.abs() < ALMOST_UP).map(|d| d.y.atan2(d.x)).collect(),
            directions.iter().map(|d| d.z.clamp(-1.0, 1.0).asin()).collect(),
        );
        if places {
            // As far as they are measured, no closer than the step.
            thinned(&mut azimuths, 0.9 * spacing);
            thinned(&mut elevations, 0.9 * spacing);
        }
        let first = self.sites.first().map_or(Vec3::ZERO, |s| s.position);
        let elevation = if level { elevation_axis(vec![0.0], MODELLED_STEP) } else { elevation_axis(elevations, spacing) };
        FieldGrid {
            position: first.to_array().map(Axis::single),
            facing: Facing::Emitter { position: self.emitter, elevation, azimuth: azimuth_axis(azimuths, spacing) },
        }
    }

    /// Whether responses were measured in more than one place.
    pub(crate) fn has_places(&self) -> bool {
        self.sites.iter().any(|s| s.position.distance(self.sites[0].position) > SAME_PLACE_M)
    }

    /// Corners of the box around all positions.
    pub(crate) fn bounds(&self) -> (Vec3, Vec3) {
        let positions = || self.sites.iter().map(|s| s.position);
        (positions().fold(Vec3::MAX, Vec3::min), positions().fold(Vec3::MIN, Vec3::max))
    }

    /// Directions of all sites, with their mirror images where one half space was measured.
    fn heard_directions(&self) -> Vec<Vec3> {
        let half = self.is_half();
        let seen = self.sites.iter().map(|s| s.direction);
        let mirrored = seen.clone().filter(|_| half).map(|d| d * Vec3::new(-1.0, 1.0, 1.0));
        seen.chain(mirrored).collect()
    }

    /// Median distance from a direction to the nearest other one heard in the same place. Other places see the emitter a little
    /// beside, which does not make the measurements any denser. Where no place has two directions, all count.
    pub(crate) fn direction_spacing(&self) -> f32 {
        let mut nearest: Vec<f32> = Vec::new();
        for site in &self.sites {
            let beside = self.sites.iter().filter(|s| s.position.distance(site.position) < SAME_PLACE_M);
            let distances = beside.map(|s| s.direction.distance(site.direction)).filter(|d| *d > SAME_PLACE_M);
            nearest.extend(distances.reduce(f32::min));
        }
        let all = || median_spacing(self.sites.iter().map(|s| s.direction));
        median_high(nearest.into_iter().map(f64::from)).map_or_else(all, |spacing| spacing as f32)
    }

    /// Whether all sources lie at the height of the head.
    pub(crate) fn is_level(&self) -> bool {
        self.sites.iter().all(|s| s.direction.z.abs() < LEVEL_Z)
    }

    /// Whether no measurement has the emitter behind the head (or none before it).
    pub(crate) fn is_half(&self) -> bool {
        let behind = |s: &Site| s.direction.x < -0.2;
        let ahead = |s: &Site| s.direction.x > 0.2;
        self.sites.iter().any(behind) != self.sites.iter().any(ahead)
    }
}

/// A full circle with nodes at these angles, radians, and between them no farther apart than `spacing`.
fn azimuth_axis(mut angles: Vec<f32>, spacing: f32) -> Axis {
    let turn = 2.0 * std::f32::consts::PI;
    distinct(&mut angles);
    if angles.len() > 1 && turn - (angles[angles.len() - 1] - angles[0]) < SAME_ANGLE {
        angles.pop();
    }
    let measured = angles.first().filter(|_| angles.len() <= MOST_AZIMUTHS).map(|first| first + turn);
    let between = measured.and_then(|end| {
        angles.push(end);
        let mut nodes = filled(&angles, spacing);
        nodes.pop();
        Axis::new(nodes, true)
    });
    let even = || Axis::circle(-std::f32::consts::PI, count(turn / spacing));
    between.filter(|axis| axis.count() >= 4).unwrap_or_else(even)
}

/// All elevations, with nodes at these, radians, and between them no farther apart than `spacing`.
fn elevation_axis(mut angles: Vec<f32>, spacing: f32) -> Axis {
    let up = 0.5 * std::f32::consts::PI;
    angles.extend([-up, up]);
    distinct(&mut angles);
    let steps = count(2.0 * up / spacing).max(4);
    let even = || Axis::uniform(-up, 2.0 * up / steps as f32, steps + 1);
    if angles.len() > MOST_ELEVATIONS { even() } else { Axis::new(filled(&angles, spacing), false).unwrap_or_else(even) }
}

/// Sorts angles, and leaves out those that are the same as the one before.
fn distinct(angles: &mut Vec<f32>) {
    angles.sort_by(f32::total_cmp);
    angles.dedup_by(|angle, before| *angle - *before < SAME_ANGLE);
}

/// Sorts angles, and leaves out those that lie within `step` of the one before.
fn thinned(angles: &mut Vec<f32>, step: f32) {
    angles.sort_by(f32::total_cmp);
    angles.dedup_by(|angle, before| *angle - *before < step);
}

/// Rising angles with others between them, evenly spaced in each interval, so that none is much wider than `spacing`.
fn filled(angles: &[f32], spacing: f32) -> Vec<f32> {
    let mut nodes = Vec::new();
    for pair in angles.windows(2) {
        let steps = ((pair[1] - pair[0]) / spacing - 0.1).ceil().max(1.0);
        nodes.extend((0..count(steps)).map(|i| pair[0] + (pair[1] - pair[0]) * i as f32 / steps));
    }
    nodes.extend(angles.last());
    nodes
}

fn count(x: f32) -> usize {
    x.round().max(0.0) as usize
}

fn count_places(places: impl Iterator<Item = Vec3>) -> usize {
    let mut found: Vec<Vec3> = Vec::new();
    for p in places {
        if !found.iter().any(|f| f.distance(p) < SAME_PLACE_M) {
            found.push(p);
        }
    }
    found.len()
}

/// Median distance from a point to the nearest other point that is not the same; 1 where there is none.
fn median_spacing(points: impl Iterator<Item = Vec3>) -> f32 {
    let points: Vec<Vec3> = points.collect();
    let nearest = points
        .iter()
        .map(|p| points.iter().map(|q| p.distance(*q)).filter(|d| *d > SAME_PLACE_M).fold(f32::MAX, f32::min))
        .filter(|d| *d < f32::MAX);
    median_high(nearest.map(f64::from)).map_or(1.0, |spacing| spacing as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sources::responses::Response;

    #[test]
    fn several_places_are_no_denser_than_each_of_them() {
        let source = Vec3::new(4.4, 3.1, 1.4);
        let places = [[2.1, 1.7], [2.6, 2.2], [3.1, 1.4], [1.6, 2.9]].map(|[x, y]| Vec3::new(x, y, 1.5));
        let turned = |i: usize| {
            let listener = Pose::from_ypr(places[i % 4], (i / 4) as f32 * 10.0_f32.to_radians(), 0.0, 0.0);
            Response { listener, source, left: vec![1.0], right: vec![1.0], name: String::new() }
        };
        let set = Responses { sample_rate_hz: 48_000.0, responses: (0..4 * 36).map(turned).collect(), ..Responses::default() };
        let nodes = Layout::of(&set).unwrap().nodes();
        let Facing::Emitter { elevation, azimuth, .. } = &nodes.facing else { panic!("an emitter") };
        assert!((34..=180).contains(&azimuth.count()) && elevation.count() >= 19, "directions 10 degrees apart, not all level");
    }

    #[test]
    fn every_measured_direction_is_a_node() {
        // A room of loudspeakers: rings at uneven angles, and one above.
        let layers: [(f32, &[f32]); 4] = [
            (0.0, &[0.0, 30.0, 47.0, 110.0, 180.0, -30.0, -47.0]),
            (40.0, &[0.0, 45.5, -110.0]),
            (-26.0, &[0.0]),
            (90.0, &[0.0]),
        ];
        let source = |azimuth: f32, elevation: f32| {
            let (a, e) = (azimuth.to_radians(), elevation.to_radians());
            2.0 * Vec3::new(e.cos() * a.cos(), e.cos() * a.sin(), e.sin())
        };
        let response = |source| {
            let name = String::new();
            Response { listener: Pose::IDENTITY, source, left: vec![1.0], right: vec![1.0], name }
        };
        let all = layers.iter().flat_map(|(elevation, azimuths)| azimuths.iter().map(|a| response(source(*a, *elevation))));
        let set = Responses { sample_rate_hz: 48_000.0, responses: all.collect(), ..Responses::default() };
        let layout = Layout::of(&set).unwrap();
        let nodes = layout.nodes();
        for site in &layout.sites {
            let nearest = (0..nodes.nodes()).map(|i| nodes.node(i).1.distance(site.direction)).fold(f32::MAX, f32::min);
            assert!(nearest < 1e-3, "{:?}: {nearest}", site.direction);
        }
        let Facing::Emitter { azimuth, .. } = &nodes.facing else { panic!("an emitter") };
        let gaps = azimuth.nodes().windows(2).map(|w| w[1] - w[0]);
        assert!(gaps.fold(0.0, f32::max) < 1.2 * COARSEST_STEP, "{azimuth:?}");
    }
}
