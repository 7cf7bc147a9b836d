//! The images of a source in a room, and which of them a listener sees.
//!
//! Beams from the source, on a lattice of directions, say in which planes it is mirrored and in which order; on flat walls the
//! apex of a beam is the exact image of the source (Heckbert and Hanrahan 1984; Funkhouser et al. 1998). All orders of few
//! planes are added without asking a beam. A listener sees an image if a ray to it, reflected wherever it meets a wall, arrives
//! at the source after as many reflections as the image has.

use super::cone::Cone;
use super::tree::{Candidate, Candidates, SAME_IMAGE_M, Tree};
use crate::SPEED_OF_SOUND_M_S;
use crate::directivity::source::{Directivity, Source};
use crate::error::{AcousticsError, place};
use crate::images::image::{Image, MAX_ORDER, Reflected};
use crate::images::shoebox::Shoebox;
use crate::octave::{BANDS, LOW_HZ, OCTAVES_HZ, Octaves};
use crate::room::Room;
use crate::room::ray::Ray;
use glam::DVec3;

/// How images are searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageOptions {
    /// Reflections at most; at most [`MAX_ORDER`].
    pub order: u32,
    /// Beams from the source.
    pub beams: usize,
    /// Up to this order images in all sequences of planes are tried as well, as long as an order has at most 16,384.
    pub exact_order: u32,
}

impl Default for ImageOptions {
    fn default() -> Self {
        Self { order: 6, beams: 8192, exact_order: 2 }
    }
}

/// The images of one source. Searched once in a [`Room`], then asked for what each listener sees, from any thread.
#[derive(Clone, Debug)]
pub struct Images {
    source: DVec3,
    directivity: Directivity,
    order: u32,
    all: Candidates,
    /// Of each plane, as [`Room::facets`] has them.
    facets: Vec<[f64; 2]>,
}

/// Shares of energy by octave, then at 63 Hz.
pub(crate) type Held = [f32; BANDS + 1];

impl Images {
    /// The images of a source, among which those that a place sees are found by [`Images::seen_from`].
    ///
    /// # Errors
    /// A source that is not finite, an order or a number of beams out of range.
    pub fn new(room: &Room, source: impl Into<Source>, options: &ImageOptions) -> Result<Self, AcousticsError> {
        let Source { position, directivity } = source.into();
        let source = place("source", position)?;
        if options.order > MAX_ORDER {
            return Err(AcousticsError::argument("order of images", format!("at most {MAX_ORDER}"), options.order));
        }
        if !(1..=1 << 22).contains(&options.beams) {
            return Err(AcousticsError::argument("beams", "1 to 4194304", options.beams));
        }
        let mut tree = Tree::new(source);
        tree.grow_exactly(room, options.exact_order.min(options.order));
        let all = Candidates::distinct(tree.grow_along(room, options.order, options.beams));
        Ok(Self { source, directivity, order: options.order, all, facets: room.facets() })
    }

    /// Those of a source in a box, which are known without a search. Whoever is in the box sees them.
    ///
    /// # Errors
    /// A source that is not in the box, or an order above [`MAX_ORDER`].
    pub fn of_box(walls: &Shoebox, source: impl Into<Source>, order: u32) -> Result<Self, AcousticsError> {
        let Source { position, directivity } = source.into();
        let images = walls.images(position, order, Reflected::Whole)?.into_iter();
        let seen = |i: Image| Candidate { position: i.position.into(), order: i.order, cone: Cone::EVERYWHERE };
        Ok(Self {
            source: position.into(),
            directivity,
            order,
            all: Candidates::distinct(images.map(seen).collect()),
            facets: Vec::new(),
        })
    }

    /// Reflections that they have at most.
    pub(crate) fn order(&self) -> u32 {
        self.order
    }

    /// Whether a listener has the image of this order at a place from here, if nothing is in its way. What rays bring along
    /// such a way is the image's; along any other way it is theirs.
    pub(crate) fn has(&self, order: u32, position: DVec3, listener: DVec3) -> bool {
        self.all.at(order, position).is_some_and(|candidate| candidate.cone.holds(listener - candidate.position))
    }

    /// Whether walls are curved, so that images have a share only of what mirrors send on.
    pub(crate) fn are_shared(&self) -> bool {
        !self.facets.is_empty()
    }

    /// The share that images have of what planes mirror, each met at a distance on a way of some length, metres: of each facet
    /// of a curved wall what falls within it of the first Fresnel zone, and the rest is the rays'.
    pub(crate) fn held(&self, met: &[(u32, f64)], whole_m: f64) -> Held {
        let mut held = [1.0; BANDS + 1];
        if !self.are_shared() {
            return held;
        }
        for (plane, way_m) in met {
            let between_m = way_m * (whole_m - way_m).max(0.0) / whole_m.max(f64::MIN_POSITIVE);
            for size in self.facets[*plane as usize] {
                for (share, hz) in held.iter_mut().zip(OCTAVES_HZ.iter().map(|hz| f64::from(*hz)).chain([LOW_HZ])) {
                    let zone_m = 2.0 * (SPEED_OF_SOUND_M_S / hz * between_m).sqrt();
                    *share *= (size / zone_m).min(1.0).powi(2) as f32;
                }
            }
        }
        held
    }

    /// Whether a place sees an image, by its [`Image::index`].
    ///
    /// # Errors
    /// A place that is not finite.
    pub fn sees(&self, room: &Room, at: [f64; 3], index: usize) -> Result<bool, AcousticsError> {
        Ok(self.is_seen(room, place("listener", at)?, index))
    }

    pub(crate) fn is_seen(&self, room: &Room, at: DVec3, index: usize) -> bool {
        self.all.get(index).is_some_and(|candidate| {
            let mut met = Vec::new();
            candidate.cone.holds(at - candidate.position) && reached(room, at, candidate, self.source, &mut met).is_some()
        })
    }

    /// How many images there are, the source itself among them.
    #[must_use]
    pub fn count(&self) -> usize {
        self.all.iter().count()
    }

    /// Of those that have no more than so many reflections.
    pub(crate) fn count_up_to(&self, order: u32) -> usize {
        self.all.iter().take_while(|candidate| candidate.order <= order).count()
    }

    /// The images that a listener sees, the nearest orders first and in the order of their indices.
    ///
    /// # Errors
    /// A listener that is not finite.
    pub fn seen_from(&self, room: &Room, listener: [f64; 3], share: Reflected) -> Result<Vec<Image>, AcousticsError> {
        self.seen_up_to(MAX_ORDER, room, listener, share)
    }

    /// Of those that have no more than so many reflections.
    pub(crate) fn seen_up_to(
        &self,
        order: u32,
        room: &Room,
        listener: [f64; 3],
        share: Reflected,
    ) -> Result<Vec<Image>, AcousticsError> {
        let listener = place("listener", listener)?;
        let gains: Vec<(Octaves, f32)> = room.materials().iter().map(|m| (share.gains(m), share.gain_63(m))).collect();
        let near = 4.0 * room.skin().max(SAME_IMAGE_M);
        let mut met = Vec::new();
        let mut seen: Vec<Image> = Vec::new();
        for (index, candidate) in self.all.iter().take_while(|candidate| candidate.order <= order).enumerate() {
            if !candidate.cone.holds(listener - candidate.position) {
                continue;
            }
            let Some(towards) = reached(room, listener, candidate, self.source, &mut met) else { continue };
            // Of walls that are nearly flat or square, images lie about each other that the same way leads to.
            let same = |other: &&Image| candidate.position.distance_squared(other.position.into()) < near * near;
            if seen.iter().rev().take_while(|other| other.order == candidate.order).any(|other| same(&other)) {
                continue;
            }
            let directivity = self.directivity.towards((-towards).to_array());
            let (mut left, mut gain_63) = (directivity, directivity[0]);
            for (octaves, low) in met.iter().map(|(face, _)| gains[room.material(*face)]) {
                left.iter_mut().zip(octaves).for_each(|(l, g)| *l *= g);
                gain_63 *= low;
            }
            let mut directivity = directivity;
            if self.are_shared() {
                let planes: Vec<(u32, f64)> = met.iter().map(|(face, way_m)| (room.plane(*face), *way_m)).collect();
                let held = self.held(&planes, candidate.position.distance(listener)).map(f32::sqrt);
                for octaves in [&mut left, &mut directivity] {
                    octaves.iter_mut().zip(held).for_each(|(gain, held)| *gain *= held);
                }
                gain_63 *= held[BANDS];
            }
            let faces = met.iter().rev().map(|(face, _)| room.triangle(*face)).collect();
            seen.push(Image {
                position: candidate.position.to_array(),
                order: candidate.order,
                gains: left,
                gain_63,
                directivity,
                index,
                faces,
            });
        }
        Ok(seen)
    }
}

/// The direction in which a ray from a listener to an image arrives at the source, if it does, the faces that it meets and how
/// far from the listener.
fn reached(room: &Room, listener: DVec3, image: &Candidate, source: DVec3, met: &mut Vec<(u32, f64)>) -> Option<DVec3> {
    met.clear();
    let way = image.position - listener;
    let whole = way.length();
    let mut left = whole;
    if left <= 0.0 {
        return (image.order == 0).then_some(DVec3::ZERO);
    }
    // As far as images lie apart that are taken for one.
    let near = room.skin().max(SAME_IMAGE_M);
    let mut ray = Ray::new(listener, way / left);
    for _ in 0..image.order {
        let hit = ray.cast(room).filter(|hit| hit.distance <= left + near)?;
        ray.mirror(room, &hit);
        left = (left - hit.distance).max(0.0);
        met.push((hit.face, whole - left));
    }
    let arrives = ray.at(left).distance(source) <= near && ray.cast(room).is_none_or(|hit| hit.distance >= left - near);
    arrives.then_some(ray.direction)
}
