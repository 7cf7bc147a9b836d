//! The image sources of a scene.

use super::corners::Corners;
use super::emission::Emission;
use super::turning_room::{Outlook, TurningRoom};
use crate::octave::{OCTAVES, OCTAVES_HZ, Octaves};
use crate::{Axis, Pose, number::whole};
use glam::Vec3;

/// Channels of third-order Ambisonics, in which image sources are added up.
pub const AMBISONIC_CHANNELS: usize = 16;

/// One image of the emitter: where its walls mirror it to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageSource {
    /// World position, metres.
    pub position: Vec3,
    /// What the walls leave of the amplitude in [`OCTAVES_HZ`], linear, at least 0.
    pub gains: Octaves,
    /// Linear gain in the octave at 63 Hz.
    pub gain_63: f32,
}

impl ImageSource {
    /// An image whose walls leave as much of the octave at 63 Hz as of that at 125.
    #[must_use]
    pub fn new(position: Vec3, gains: Octaves) -> Self {
        Self { position, gains, gain_63: gains[0] }
    }
}

/// Early reflections with a place of their own: each is heard from its image's direction, after its distance, and keeps its
/// place while the listener walks and turns.
///
/// Made by a simulation, a drawn room or the baker, or read from a scene file; a part of its scene, immutable, which the audio
/// thread reads.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageSources {
    /// Images, without the emitter itself where the field has it, the most important first.
    pub images: Vec<ImageSource>,
    /// What a metre of air takes in [`OCTAVES_HZ`], dB.
    pub air_db_per_m: Octaves,
    /// Places at which it is known which images are seen, metres, along x, y and z.
    pub places: [Axis; 3],
    /// How much of each image is seen at each place, 0 to 1, `[z][y][x][image]`.
    pub seen: Vec<f32>,
    /// How much of the emitter itself is seen at each place, 0 to 1, `[z][y][x]`.
    pub direct: Vec<f32>,
    /// The head that hears them.
    pub head: AmbisonicHead,
    /// How they lie in a room that turns with the head; without it they keep their place in the world.
    pub turning: Option<TurningRoom>,
    /// What the emitter sends where; without it the same in all directions. No room that turns has one.
    pub emission: Option<Emission>,
}

/// A head in third-order Ambisonics: what both ears hear of each channel (ACN, N3D), axes forward, left and up.
#[derive(Clone, Debug, PartialEq)]
pub struct AmbisonicHead {
    /// Rate of the filters, Hz.
    pub sample_rate_hz: f64,
    /// Samples before the sound is at the head's centre.
    pub lead: usize,
    /// Impulse responses, `[channel][ear][sample]`.
    pub filters: Vec<f32>,
}

impl AmbisonicHead {
    /// Samples of each impulse response.
    #[must_use]
    pub fn len(&self) -> usize {
        self.filters.len() / (2 * AMBISONIC_CHANNELS)
    }

    /// The highest order of which anything is heard, 0 to 3.
    #[must_use]
    pub fn order(&self) -> usize {
        let channels = self.filters.rchunks_exact(2 * self.len().max(1));
        let silent = channels.take_while(|filters| filters.iter().all(|x| *x == 0.0)).count();
        (AMBISONIC_CHANNELS - 1).saturating_sub(silent).isqrt()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl ImageSources {
    /// Number of places.
    #[must_use]
    pub fn place_count(&self) -> usize {
        self.places.iter().map(Axis::count).product()
    }

    /// What a metre of air takes of the amplitude at a frequency, nepers: a straight line over logarithms between octaves and
    /// beyond.
    pub(crate) fn air_nepers_per_m(&self, hz: f64) -> f64 {
        let place = (hz.max(1.0) / f64::from(OCTAVES_HZ[0])).log2();
        let below = whole(place.clamp(0.0, (OCTAVES - 2) as f64));
        let [a, b] = [below, below + 1].map(|octave| f64::from(self.air_db_per_m[octave]).max(1e-9).ln());
        (a + (place - below as f64) * (b - a)).exp() * std::f64::consts::LN_10 / 20.0
    }

    /// How much of the emitter itself a listener sees, 0 to 1.
    #[must_use]
    pub fn direct_at(&self, position: Vec3) -> f32 {
        Axis::places_around(&self.places, position).map(|(place, weight)| weight * self.direct[place]).sum()
    }

    /// Where the emitter is in the space that the images' positions are stated in.
    pub(crate) fn emitter(&self, emitter: Vec3) -> Vec3 {
        self.turning.as_ref().map_or(emitter, |room| room.reference(emitter))
    }

    /// How much longer the way to an image can be than that to the emitter, metres, wherever the listener is.
    pub(crate) fn longest_m(&self, emitter: Vec3) -> f32 {
        let from = self.emitter(emitter);
        let longest = self.images.iter().map(|image| image.position.distance(from)).fold(0.0, f32::max);
        longest + self.turning.as_ref().map_or(0.0, |room| room.beyond_m(emitter))
    }

    /// Where an image is seen from a head, metres, head axes.
    #[must_use]
    pub fn seen_from_head(&self, image: usize, pose: &Pose, emitter: Vec3) -> Vec3 {
        let outlook = self.outlook(pose, emitter);
        outlook.pose.to_head(self.place(image, &outlook))
    }

    /// A pose as the images are seen from.
    pub(crate) fn outlook(&self, pose: &Pose, emitter: Vec3) -> Outlook {
        self.turning.as_ref().map_or(Outlook { pose: *pose, shift: Vec3::ZERO }, |room| room.outlook(pose, emitter))
    }

    /// Where an image is for a pose.
    pub(crate) fn place(&self, image: usize, outlook: &Outlook) -> Vec3 {
        let position = self.images.get(image).map_or(Vec3::ZERO, |image| image.position);
        let mirror = self.turning.as_ref().and_then(|room| room.mirrors.get(image));
        mirror.map_or(position, |mirror| position + *mirror * outlook.shift)
    }

    /// What the emitter sends to an image as a listener hears it, natural logarithms of amplitudes; `None` where that is the
    /// same in all directions.
    pub(crate) fn sent(&self, image: usize, listener: &Pose) -> Option<Octaves> {
        let (emission, position) = (self.emission.as_ref()?, self.images.get(image)?.position);
        Some(emission.of_image(image, listener.position - position))
    }

    /// How much of each of the first images a listener sees, 0 to 1: as the corners have it where they know.
    pub(crate) fn seen_at(&self, position: Vec3, corners: Option<&Corners>, out: &mut [f32]) {
        out.fill(0.0);
        let count = self.images.len();
        let known = corners.and_then(|corners| corners.images_at(position));
        let mut seeing = [0.0; Corners::MOST_SEEN + 1];
        for (place, weight) in Axis::places_around(&self.places, position) {
            let shares = &self.seen[place * count..][..count];
            out.iter_mut().zip(shares).for_each(|(o, s)| *o += weight * s);
            seeing.iter_mut().zip(shares).filter(|(_, s)| **s > 0.0).for_each(|(sum, _)| *sum += weight);
        }
        // Where it is seen it is as loud as at those places around that see it.
        for ((out, seen), seeing) in out.iter_mut().zip(known.into_iter().flatten()).zip(seeing) {
            *out = seen * if seeing > 0.0 { *out / seeing } else { 1.0 };
        }
    }

    /// Bytes in memory.
    pub(crate) fn memory_bytes(&self) -> usize {
        let emission = self.emission.as_ref().map_or(0, Emission::memory_bytes);
        let tables = [&self.seen, &self.direct, &self.head.filters].map(|table| size_of_val(&**table));
        size_of_val(&*self.images) + tables.iter().sum::<usize>() + emission
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_seen_fades_from_place_to_place() {
        let image = ImageSource::new(Vec3::X, [1.0; OCTAVES]);
        let head = AmbisonicHead { sample_rate_hz: 48_000.0, lead: 0, filters: Vec::new() };
        let images = ImageSources {
            images: vec![image; 2],
            air_db_per_m: [0.0; OCTAVES],
            places: [Axis::uniform(0.0, 1.0, 2), Axis::uniform(0.0, 2.0, 2), Axis::single(1.0)],
            seen: vec![1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0],
            direct: vec![1.0, 1.0, 0.0, 0.0],
            head,
            turning: None,
            emission: None,
        };
        let mut seen = [0.0; 2];
        images.seen_at(Vec3::new(0.25, 0.0, 9.0), None, &mut seen);
        assert_eq!(seen, [0.75, 0.0]);
        images.seen_at(Vec3::new(0.5, 1.0, 0.0), None, &mut seen);
        assert_eq!(seen, [0.5, 0.5]);
        assert_eq!(images.direct_at(Vec3::new(0.3, 0.5, 0.0)), 0.75);
    }
}
