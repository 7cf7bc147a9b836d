//! Diffraction of a source's images.

use super::path::DiffractionPath;
use super::{ASKED, Edges};
use crate::error::{AcousticsError, place};
use crate::images::image::{Image, Reflected};
use crate::images::search::Images;
use crate::room::Room;
use glam::DVec3;

/// Reflections of images that are diffracted, at most.
const MOST_REFLECTIONS: u32 = 2;

/// Edges with the images of a source that reach them.
#[derive(Clone, Debug)]
pub struct DiffractedImages<'a> {
    edges: &'a Edges,
    room: &'a Room,
    images: &'a Images,
    /// Number of an edge, and an image that is seen from it.
    all: Vec<(usize, Image)>,
}

impl Edges {
    /// The images of a source, of two reflections at most, that reach edges.
    ///
    /// # Errors
    /// None of a mesh whose edges are finite.
    pub fn diffracted_images<'a>(
        &'a self,
        room: &'a Room,
        images: &'a Images,
        share: Reflected,
    ) -> Result<DiffractedImages<'a>, AcousticsError> {
        let mut all: Vec<(usize, Image)> = Vec::new();
        for (number, edge) in self.all.iter().enumerate() {
            let first = all.len();
            for asked in ASKED {
                let at = self.beside(edge, edge.at(asked * edge.length)).to_array();
                for image in images.seen_up_to(MOST_REFLECTIONS, room, at, share)? {
                    if image.order > 0 && !all[first..].iter().any(|(_, known)| known.index == image.index) {
                        all.push((number, image));
                    }
                }
            }
        }
        Ok(DiffractedImages { edges: self, room, images, all })
    }
}

impl DiffractedImages<'_> {
    /// The paths of images to a listener in their shadow round one edge each, the loudest at 1 kHz first.
    ///
    /// # Errors
    /// A listener that is not finite.
    pub fn paths(&self, listener: [f64; 3]) -> Result<Vec<DiffractionPath>, AcousticsError> {
        let listener = place("listener", listener)?;
        let path = |(number, image): &(usize, Image)| {
            let edge = &self.edges.all[*number];
            let at = edge.bend(image.position.into(), listener)?;
            let beside = self.edges.beside(edge, at);
            let sees = |at: DVec3| self.images.is_seen(self.room, at, image.index);
            let diffracted = self.edges.free(self.room, listener, beside) && sees(beside) && !sees(listener);
            edge.path(image.position.into(), at, listener, image.gains).filter(|_| diffracted)
        };
        let mut found: Vec<DiffractionPath> = self.all.iter().filter_map(path).collect();
        self.edges.distinct(&mut found);
        found.sort_by(|a, b| b.amplitude(1000.0).total_cmp(&a.amplitude(1000.0)));
        Ok(found)
    }
}
