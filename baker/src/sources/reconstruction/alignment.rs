//! Where a reconstruction lies in metres and upright.

use super::{Camera, Reconstruction, colmap};
use crate::BakeError;
use promenade_core::glam::{Quat, Vec3};
use promenade_core::network::Alignment;
use promenade_paths::{Origin, colmap as paths};
use std::path::Path;

/// What is known of a reconstruction's place in the world. What is not given is as for a path of its cameras.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AlignmentOptions {
    /// Direction of up in the reconstruction's world; without it as its cameras were held, or z where it has none.
    pub up: Option<Vec3>,
    /// Size of a unit; without it a unit is taken as a metre.
    pub scale: Option<Scale>,
    /// The scene's origin; without it the first camera, or the reconstruction's own where it has none.
    pub origin: Option<SceneOrigin>,
}

/// How large a unit is.
#[derive(Clone, Debug, PartialEq)]
pub enum Scale {
    /// Metres of one unit, above 0.
    MetresPerUnit(f32),
    /// Two places whose distance is known.
    Distance {
        /// One.
        from: Landmark,
        /// The other.
        to: Landmark,
        /// Metres between them, above 0.
        metres: f32,
    },
}

/// A place in a reconstruction.
#[derive(Clone, Debug, PartialEq)]
pub enum Landmark {
    /// Where the camera of an image stood: its name, or the end of it where only one ends so.
    Camera(String),
    /// A point, the reconstruction's units.
    Point(Vec3),
}

/// What becomes the scene's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SceneOrigin {
    /// As for a path of the cameras: the first or their mean, and the first looks along x; or the reconstruction's own.
    Cameras(Origin),
    /// A point, the reconstruction's units.
    Point(Vec3),
}

impl Reconstruction {
    /// The alignment that [`AlignmentOptions`] ask for; what was assumed is added to `notes`.
    ///
    /// With the same up, scale and origin a path of the reconstruction's cameras lies in the same world.
    ///
    /// # Errors
    /// A scale out of range, a landmark that is not there, landmarks on one spot, or an origin by cameras where there are none.
    pub fn align(&self, options: &AlignmentOptions, notes: &mut Vec<String>) -> Result<Alignment, BakeError> {
        let metres_per_unit = self.metres_per_unit(options.scale.as_ref(), notes)?;
        let (turn, centre) = if self.cameras.is_empty() {
            self.without_cameras(options, notes)?
        } else {
            let origin = match options.origin {
                None => Origin::First,
                Some(SceneOrigin::Cameras(origin)) => origin,
                Some(SceneOrigin::Point(_)) => Origin::Keep,
            };
            let world = paths::world("cameras", &self.cameras, options.up, origin, notes)
                .map_err(|source| colmap::unreadable(Path::new("reconstruction"), source))?;
            if options.origin.is_none() {
                notes.push(format!("the first camera, {}, stands at the origin and looks along x", self.cameras[0].name));
            }
            (world.turn.as_quat().normalize(), world.centre.as_vec3())
        };
        let translation = if let Some(SceneOrigin::Point(point)) = options.origin { point } else { centre };
        Ok(Alignment { scale: metres_per_unit.recip(), rotation: turn.inverse(), translation })
    }

    fn without_cameras(&self, options: &AlignmentOptions, notes: &mut Vec<String>) -> Result<(Quat, Vec3), BakeError> {
        if let Some(SceneOrigin::Cameras(origin @ (Origin::First | Origin::Centroid))) = options.origin {
            let expected = "keep or a point, where there are no cameras".to_owned();
            return Err(BakeError::Argument { what: "origin", expected, found: origin.name().to_owned() });
        }
        if options.up.is_none() {
            notes.push("up is taken as 0,0,1 of the cloud's world; the option up says otherwise".to_owned());
        }
        let up = options.up.and_then(Vec3::try_normalize).unwrap_or(Vec3::Z);
        Ok((Quat::from_rotation_arc(Vec3::Z, up).inverse(), Vec3::ZERO))
    }

    fn metres_per_unit(&self, scale: Option<&Scale>, notes: &mut Vec<String>) -> Result<f32, BakeError> {
        let metres_per_unit = match scale {
            None => {
                notes.push("the scale of a reconstruction is arbitrary: one unit is taken as 1 m; a scale or a distance says otherwise".to_owned());
                1.0
            }
            Some(Scale::MetresPerUnit(metres)) => *metres,
            Some(Scale::Distance { from, to, metres }) => {
                let units = self.place(from)?.distance(self.place(to)?);
                notes.push(format!("{metres} m are {units:.4} units: a unit is {:.6} m", metres / units));
                metres / units
            }
        };
        if (1e-6..=1e6).contains(&metres_per_unit) {
            return Ok(metres_per_unit);
        }
        let expected = "0.000001 to 1000000, between places that lie apart".to_owned();
        Err(BakeError::Argument { what: "metres per unit", expected, found: metres_per_unit.to_string() })
    }

    fn place(&self, landmark: &Landmark) -> Result<Vec3, BakeError> {
        let name = match landmark {
            Landmark::Point(point) => return Ok(*point),
            Landmark::Camera(name) => name,
        };
        let exact: Vec<&Camera> = self.cameras.iter().filter(|c| c.name == *name).collect();
        let ending: Vec<&Camera> = self.cameras.iter().filter(|c| c.name.ends_with(name.as_str())).collect();
        match (&exact[..], &ending[..]) {
            ([camera], _) | (_, [camera]) => Ok(camera.centre().as_vec3()),
            (_, some) => {
                let found = format!("{name:?}, with which {} of {} images end", some.len(), self.cameras.len());
                Err(BakeError::Argument { what: "camera", expected: "the name of one image".to_owned(), found })
            }
        }
    }
}
