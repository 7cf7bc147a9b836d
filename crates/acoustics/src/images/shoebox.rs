//! Box rooms, whose images need no search.

use crate::error::{AcousticsError, place};
use crate::images::image::{Image, MAX_ORDER, Reflected};
use crate::materials::air::Air;
use crate::materials::eyring;
use crate::materials::material::Material;
#[cfg(feature = "meshes")]
use crate::mesh::{Mesh, Triangle};
use crate::octave::BANDS;

/// A box from the origin to its size.
#[derive(Clone, Debug, PartialEq)]
pub struct Shoebox {
    /// Metres along x, y and z.
    pub size: [f64; 3],
    /// Of the walls at x = 0, x = size, y = 0, y = size, z = 0 and z = size.
    pub materials: [Material; 6],
}

/// An image in a box by the number of rooms that it lies away along each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoxImage {
    /// Rooms along x, y and z.
    pub rooms: [i32; 3],
}

/// All images that at most `order` walls have made, the source itself first (Allen and Berkley 1979).
#[must_use]
pub fn box_images(order: u32) -> Vec<BoxImage> {
    let reach = order.cast_signed();
    let axis = || -reach..=reach;
    let all = axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| BoxImage { rooms: [x, y, z] })));
    let mut images: Vec<BoxImage> = all.filter(|i| i.order() <= order).collect();
    images.sort_by_key(BoxImage::order);
    images
}

impl BoxImage {
    /// Reflections that made it.
    #[must_use]
    pub fn order(&self) -> u32 {
        self.rooms.iter().map(|n| n.unsigned_abs()).sum()
    }

    /// Where it lies, for a source in the box from the origin to `size`, metres.
    #[must_use]
    pub fn position(&self, source: [f64; 3], size: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|a| {
            let n = self.rooms[a];
            f64::from(n) * size[a] + if n % 2 == 0 { source[a] } else { size[a] - source[a] }
        })
    }

    /// How often each wall has reflected it, in the order of [`Shoebox::materials`]: beyond an odd number, once more the one on
    /// its own side.
    #[must_use]
    pub fn hits(&self) -> [u32; 6] {
        let [x, y, z] = self.rooms.map(|n| {
            let m = n.unsigned_abs();
            [(m + u32::from(n < 0)) / 2, (m + u32::from(n > 0)) / 2]
        });
        [x[0], x[1], y[0], y[1], z[0], z[1]]
    }

    /// The walls that it has met along one axis, the one on its own side last.
    fn walls(&self, axis: usize) -> impl Iterator<Item = u32> {
        let n = self.rooms[axis];
        let own = 2 * axis as u32 + u32::from(n > 0);
        let count = n.unsigned_abs();
        (0..count).map(move |k| if (count - 1 - k).is_multiple_of(2) { own } else { own ^ 1 })
    }
}

impl Shoebox {
    /// The images of a source, all of which are seen from everywhere in the box. [`Image::faces`] are numbers of walls, those
    /// of one axis after those of another: where the axes change places depends on the listener.
    ///
    /// # Errors
    /// A size that is not finite and above 0, a share of a material outside 0 to 1, a source outside the box, an order above
    /// [`MAX_ORDER`].
    pub fn images(&self, source: [f64; 3], order: u32, share: Reflected) -> Result<Vec<Image>, AcousticsError> {
        self.check()?;
        self.check_source(source)?;
        if order > MAX_ORDER {
            return Err(AcousticsError::argument("order of images", format!("at most {MAX_ORDER}"), order));
        }
        let gains = self.materials.each_ref().map(|m| share.gains(m));
        let images = box_images(order).into_iter().enumerate().map(|(index, image)| {
            let hits = image.hits();
            let gain = |band: usize| gains.iter().zip(hits).map(|(g, n)| g[band].powi(n.cast_signed())).product();
            let low = self.materials.iter().zip(hits).map(|(m, n)| share.gain_63(m).powi(n.cast_signed()));
            Image {
                position: image.position(source, self.size),
                order: image.order(),
                directivity: [1.0; BANDS],
                gains: std::array::from_fn::<f32, BANDS, _>(gain),
                gain_63: low.product(),
                index,
                faces: (0..3).flat_map(|axis| image.walls(axis)).collect(),
            }
        });
        Ok(images.collect())
    }

    /// The box as a mesh of twelve triangles that face inwards, with a group for each wall: `x0`, `x1`, `y0`, `y1`, `floor`,
    /// `ceiling`.
    ///
    /// # Errors
    /// A size that is not finite and above 0.
    #[cfg(feature = "meshes")]
    pub fn mesh(&self) -> Result<Mesh, AcousticsError> {
        self.check()?;
        let vertices = (0..8).map(|i| std::array::from_fn(|a| if (i >> a) & 1 == 1 { self.size[a] } else { 0.0 })).collect();
        let corners: [[u32; 4]; 6] = [[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]];
        let triangles = corners
            .iter()
            .zip(0..)
            .flat_map(|(c, group)| [[c[0], c[1], c[2]], [c[0], c[2], c[3]]].map(|corners| Triangle { corners, group }));
        let groups = ["x0", "x1", "y0", "y1", "floor", "ceiling"].map(str::to_owned);
        Ok(Mesh { vertices, triangles: triangles.collect(), groups: groups.to_vec() })
    }

    /// Cubic metres.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        self.size.iter().product()
    }

    /// Reverberation time by octave, seconds (Eyring 1930), with what the air takes; infinite where nothing absorbs.
    #[must_use]
    pub fn eyring_t60_s(&self, air: Option<Air>) -> [f64; BANDS] {
        let area = |wall: usize| self.volume_m3() / self.size[wall / 2];
        eyring::t60_s((0..6).map(|wall| (area(wall), &self.materials[wall])), self.volume_m3(), air)
    }

    pub(crate) fn check_source(&self, source: [f64; 3]) -> Result<(), AcousticsError> {
        let at = place("source", source)?;
        if at.cmpge(glam::DVec3::ZERO).all() && at.cmple(self.size.into()).all() {
            return Ok(());
        }
        Err(AcousticsError::argument("source", format!("inside the box of {:?} m", self.size), at))
    }

    pub(crate) fn check(&self) -> Result<(), AcousticsError> {
        if !self.size.iter().all(|s| s.is_finite() && *s > 0.0) {
            let found = format!("{:?}", self.size);
            return Err(AcousticsError::argument("size of the box", "three lengths above 0 m", found));
        }
        self.materials.iter().try_for_each(Material::check)
    }
}
