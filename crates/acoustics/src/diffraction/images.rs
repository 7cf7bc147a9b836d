//! Diffraction of a source's images.

use super::edge::End;
use super::path::DiffractionPath;
use super::{ASKED, Edges, NEAR_M};
use crate::error::{AcousticsError, place};
use crate::images::image::{Image, Reflected};
use crate::images::search::Images;
use crate::octave::{BANDS, OCTAVES_HZ};
use crate::room::Room;
use glam::DVec3;
use rayon::prelude::*;

/// Reflections of images that are diffracted, at most.
const MOST_REFLECTIONS: u32 = 2;
/// Pairs of an edge and an image that are looked at, at most: of meshes with more, the longest edges diffract images.
const MOST_PAIRS: usize = 2_000_000;

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
        let asked = MOST_PAIRS / (ASKED.len() * images.count_up_to(MOST_REFLECTIONS)).max(1);
        let seen = |number: usize| -> Result<Vec<(usize, Image)>, AcousticsError> {
            let edge = &self.all[number];
            let mut found: Vec<(usize, Image)> = Vec::new();
            for asked in ASKED {
                let at = self.beside(edge, edge.at(asked * edge.length)).to_array();
                for image in images.seen_up_to(MOST_REFLECTIONS, room, at, share)? {
                    if image.order > 0 && !found.iter().any(|(_, known)| known.index == image.index) {
                        found.push((number, image));
                    }
                }
            }
            Ok(found)
        };
        let all: Result<Vec<_>, AcousticsError> = (0..self.all.len().min(asked)).into_par_iter().map(seen).collect();
        Ok(DiffractedImages { edges: self, room, images, all: all?.into_iter().flatten().collect() })
    }
}

impl DiffractedImages<'_> {
    /// The paths of images to a listener round one edge each, the loudest at 1 kHz first: of those that the edge hides, and of
    /// those that are seen past it what it takes ([`DiffractionPath::lit`]).
    ///
    /// # Errors
    /// A listener that is not finite.
    pub fn paths(&self, listener: [f64; 3]) -> Result<Vec<DiffractionPath>, AcousticsError> {
        let listener = place("listener", listener)?;
        let path = |(number, image): &(usize, Image)| {
            let edge = &self.edges.all[*number];
            let pass = edge.passed(End::at(image.position.into()), End::at(listener))?;
            if !pass.hidden && pass.detour_m > NEAR_M {
                return None;
            }
            let beside = self.edges.beside(edge, pass.at);
            let sees = |at: DVec3| self.images.is_seen(self.room, at, image.index);
            if !self.edges.free(self.room, listener, beside) || !sees(beside) {
                return None;
            }
            let lit = sees(listener);
            edge.path([image.position.into(), pass.at, listener], 0.0, image.gains, lit).filter(|_| lit || pass.hidden)
        };
        let mut found: Vec<DiffractionPath> = self.all.iter().filter_map(path).collect();
        self.edges.distinct(&mut found);
        found.sort_by(|a, b| b.amplitude(1000.0).abs().total_cmp(&a.amplitude(1000.0).abs()));
        Ok(found)
    }

    /// Takes from the images that a listener sees, and from the source itself among them, what edges take of them beside their
    /// shadows; `paths` are those of [`Self::paths`].
    ///
    /// # Errors
    /// A listener that is not finite.
    pub fn shade(&self, listener: [f64; 3], paths: &[DiffractionPath], images: &mut [Image]) -> Result<(), AcousticsError> {
        let listener = place("listener", listener)?;
        for image in images.iter_mut().take_while(|image| image.order <= MOST_REFLECTIONS) {
            let mut left = [1.0; BANDS];
            if image.order == 0 {
                self.edges.shade(self.room, [End::at(image.position.into()), End::at(listener)], None, &mut left);
            }
            for path in paths.iter().filter(|path| path.lit && path.from == image.position) {
                left.iter_mut().zip(OCTAVES_HZ).for_each(|(left, hz)| *left *= path.left(hz.into()) as f32);
            }
            for gains in [&mut image.directivity, &mut image.gains] {
                gains.iter_mut().zip(left).for_each(|(gain, left)| *gain *= left);
            }
            image.gain_63 *= left[0];
        }
        Ok(())
    }
}
