//! How measurements lie around one emitter.

use crate::bake::kriging::Site;
use crate::error::BakeError;
use crate::sources::responses::Responses;
use glam::{Quat, Vec3};
use promenade_core::{Axis, Facing, FieldGrid, Pose, glam};

/// Two positions closer than this are one, metres.
const SAME_PLACE_M: f32 = 1e-3;
/// The densest directions that are kept apart, radians.
const FINEST_STEP: f32 = 2.5 * std::f32::consts::PI / 180.0;
/// The widest distance between the directions of a field, radians.
const COARSEST_STEP: f32 = 15.0 * std::f32::consts::PI / 180.0;
/// Directions lower and higher than this, as the vertical part of a unit vector, lie at the height of the head (2 degrees).
pub(crate) const LEVEL_Z: f32 = 0.035;
/// Positions along one axis of a field, at most.
const MOST_POSITIONS: usize = 24;

/// Measurements as listener poses around one emitter.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    /// Emitter in the scene's world, metres.
    pub(crate) emitter: Vec3,
    /// Listener pose of each response in the scene's world.
    pub(crate) poses: Vec<Pose>,
    /// The same as emitter directions and listener positions.
    pub(crate) sites: Vec<Site>,
    /// Distance from listener to emitter of each response, metres.
    pub(crate) distances: Vec<f32>,
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
        Ok(Self { emitter, poses, sites, distances, notes })
    }

    /// The same around fewer responses, by number.
    pub(crate) fn only(&self, used: &[usize]) -> Self {
        Self {
            emitter: self.emitter,
            poses: used.iter().map(|&i| self.poses[i]).collect(),
            sites: used.iter().map(|&i| self.sites[i]).collect(),
            distances: used.iter().map(|&i| self.distances[i]).collect(),
            notes: self.notes.clone(),
        }
    }

    /// Nodes for a field: as dense as the measurements where they are dense, over all directions.
    pub(crate) fn nodes(&self) -> FieldGrid {
        let pi = std::f32::consts::PI;
        let level = self.is_level();
        // Nodes between the measurements of a ring, since the gains of a mix do not follow a straight line from one to the
        // next.
        let density = if level { 2.0 } else { 1.0 };
        let spacing = self.direction_spacing().min(COARSEST_STEP * density) / density;
        let spacing = spacing.max(FINEST_STEP);
        let azimuths = count(2.0 * pi / spacing).max(4);
        let elevations = if level { 3 } else { count(pi / spacing).max(4) + 1 };
        let axis = |pick: fn(Vec3) -> f32| {
            let values = self.sites.iter().map(|s| pick(s.position));
            let (low, high) = values.fold((f32::MAX, f32::MIN), |(l, h), v| (l.min(v), h.max(v)));
            let spacing = median_spacing(self.sites.iter().map(|s| s.position)).max(0.05);
            let steps = if high - low < SAME_PLACE_M { 0 } else { count((high - low) / spacing).clamp(1, MOST_POSITIONS - 1) };
            if steps == 0 { Axis::single(low) } else { Axis::uniform(low, (high - low) / steps as f32, steps + 1) }
        };
        FieldGrid {
            position: [axis(|p| p.x), axis(|p| p.y), axis(|p| p.z)],
            facing: Facing::Emitter {
                position: self.emitter,
                elevation: Axis::uniform(-pi / 2.0, pi / (elevations - 1) as f32, elevations),
                azimuth: Axis::circle(-pi, azimuths),
            },
        }
    }

    /// Median distance from a direction to the nearest other one heard in the same place. Other places see the emitter a little
    /// beside, which does not make the measurements any denser. Where no place has two directions, all count.
    fn direction_spacing(&self) -> f32 {
        let mut nearest: Vec<f32> = Vec::new();
        for site in &self.sites {
            let beside = self.sites.iter().filter(|s| s.position.distance(site.position) < SAME_PLACE_M);
            let distances = beside.map(|s| s.direction.distance(site.direction)).filter(|d| *d > SAME_PLACE_M);
            nearest.extend(distances.reduce(f32::min));
        }
        nearest.sort_by(f32::total_cmp);
        let all = || median_spacing(self.sites.iter().map(|s| s.direction));
        nearest.get(nearest.len() / 2).copied().unwrap_or_else(all)
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
    let mut nearest: Vec<f32> = points
        .iter()
        .map(|p| points.iter().map(|q| p.distance(*q)).filter(|d| *d > SAME_PLACE_M).fold(f32::MAX, f32::min))
        .filter(|d| *d < f32::MAX)
        .collect();
    nearest.sort_by(f32::total_cmp);
    nearest.get(nearest.len() / 2).copied().unwrap_or(1.0)
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
        assert_eq!((azimuth.count(), elevation.count()), (36, 19), "directions 10 degrees apart, not all at the head's height");
    }
}
