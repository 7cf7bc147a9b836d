//! What patches of surfaces look like: colour and texture in photographs or of the points of a reconstruction, with where a
//! patch is.

use super::raster::Raster;
use crate::error::FitError;
use crate::room::{FlatRoom, Patch, Voxels};
use promenade_core::glam::{DVec3, Vec3};
use promenade_core::network::Placement;
use promenade_paths::colmap::{Image, Lens};
use rayon::prelude::*;

/// Least cosine between the way to a camera and the normal.
const LEAST_COSINE: f64 = 0.15;
/// Sight ends so much before its patch, as a share of the way.
const BEFORE: f64 = 0.98;
/// How far samples of a patch are from its middle on the way to its corners.
const SAMPLES: [f64; 2] = [0.35, 0.75];
/// Points within so many edges of a patch are its own, and as many at least.
const POINTS: (f64, usize) = (0.75, 3);
/// What place and direction count beside colour and texture.
const PLACE: f64 = 0.5;

/// A photograph and where it was taken.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Where.
    pub camera: Image,
    /// By what lens.
    pub lens: Lens,
    /// What it shows.
    pub photo: Raster,
}

/// What is known of the appearance of a room.
#[derive(Clone, Debug, PartialEq)]
pub struct Pictures {
    /// Photographs; where there are none, points tell.
    pub views: Vec<View>,
    /// Points of the reconstruction with their colours, 0 to 1.
    pub points: Vec<(Vec3, [f32; 3])>,
    /// Where the reconstruction's world is in the room's.
    pub placement: Placement,
}

fn luminance(rgb: &[f32; 3]) -> f64 {
    rgb.iter().zip([0.2126, 0.7152, 0.0722]).map(|(v, w)| f64::from(*v) * w).sum()
}

/// The deviation of some numbers from their mean.
fn deviation(all: &[f64]) -> f64 {
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    (all.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / all.len() as f64).sqrt()
}

/// Colour, the deviation of its luminance, and that from one sample to the next.
fn colour_and_texture(all: &[&[f32; 3]]) -> Vec<f64> {
    let count = all.len() as f64;
    let mut features: Vec<f64> = (0..3).map(|c| all.iter().map(|v| f64::from(v[c])).sum::<f64>() / count).collect();
    let light: Vec<f64> = all.iter().map(|v| luminance(v)).collect();
    let steps = light.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum::<f64>() / (count - 1.0).max(1.0);
    features.extend([deviation(&light), steps]);
    features
}

/// Places of a patch: its middle, and on the way from there to its corners.
fn samples(patch: &Patch) -> Vec<DVec3> {
    let middle = DVec3::from(patch.centre_m);
    let towards = |share: f64| patch.corners_m.iter().map(move |c| middle.lerp(DVec3::from(*c), share));
    std::iter::once(middle).chain(SAMPLES.into_iter().flat_map(towards)).collect()
}

/// Triangles that hide.
struct Occluders(Vec<[DVec3; 3]>);

impl Occluders {
    /// Whether nothing is between two places (Moeller and Trumbore 1997).
    fn are_free(&self, from: DVec3, to: DVec3) -> bool {
        let way = BEFORE * (to - from);
        self.0.iter().all(|[a, b, c]| {
            let (u, v) = (*b - *a, *c - *a);
            let across = way.cross(v);
            let along = u.dot(across);
            if along.abs() < 1e-12 {
                return true;
            }
            let start = from - *a;
            let first = start.dot(across) / along;
            let other = start.cross(u);
            let second = way.dot(other) / along;
            let at = v.dot(other) / along;
            !(first >= 0.0 && second >= 0.0 && first + second <= 1.0 && at > 1e-6 && at < 1.0)
        })
    }
}

impl Pictures {
    /// Features of each patch, none of those that nothing shows.
    ///
    /// # Errors
    /// A room that is none.
    pub fn features(&self, room: &FlatRoom, voxels: &Voxels) -> Result<Vec<Option<Vec<f64>>>, FitError> {
        let mesh = room.mesh()?;
        let corner = |c: u32| DVec3::from(mesh.vertices[c as usize]);
        let occluders = Occluders(mesh.triangles.iter().map(|t| t.corners.map(corner)).collect());
        let own: Vec<Option<Vec<f64>>> = voxels
            .patches
            .par_iter()
            .map(|patch| {
                if self.views.is_empty() {
                    self.of_points(patch, voxels.edge_m)
                } else {
                    self.of_views(patch, room, &occluders)
                }
            })
            .collect();
        let [low, high] = mesh.bounds();
        let place = |patch: &Patch| -> Vec<f64> {
            let normal = room.walls[patch.wall].normal;
            let at = |a: usize| ((patch.centre_m[a] - low[a]) / (high[a] - low[a]).max(1e-6) - 0.5) * PLACE;
            // Either side of a wall is the same wall.
            (0..3).map(at).chain((0..3).map(|a| normal[a].abs() * PLACE)).collect()
        };
        Ok(own.into_iter().zip(&voxels.patches).map(|(features, patch)| Some([features?, place(patch)].concat())).collect())
    }

    /// The mean over photographs that show a patch.
    fn of_views(&self, patch: &Patch, room: &FlatRoom, occluders: &Occluders) -> Option<Vec<f64>> {
        let middle = DVec3::from(patch.centre_m);
        let normal = DVec3::from(room.walls[patch.wall].normal);
        let (mut sum, mut count): (Vec<f64>, f64) = (Vec::new(), 0.0);
        for view in &self.views {
            let from = self.placement.to_scene(view.camera.centre().as_vec3()).as_dvec3();
            let way = middle - from;
            if normal.dot(way.normalize_or_zero()).abs() < LEAST_COSINE || !occluders.are_free(from, middle) {
                continue;
            }
            let pixel = |at: &DVec3| -> Option<[f64; 2]> {
                let foreign = self.placement.to_foreign(at.as_vec3()).as_dvec3();
                let [x, y] = view.lens.pixel(view.camera.rotation * foreign + view.camera.translation)?;
                Some([x / f64::from(view.lens.size[0]), y / f64::from(view.lens.size[1])])
            };
            let Some(at): Option<Vec<[f64; 2]>> = samples(patch).iter().map(pixel).collect() else { continue };
            let own = colour_and_texture(&at.iter().map(|p| view.photo.at(*p)).collect::<Vec<_>>());
            sum.resize(own.len(), 0.0);
            sum.iter_mut().zip(&own).for_each(|(s, o)| *s += o);
            count += 1.0;
        }
        (count > 0.0).then(|| sum.iter().map(|s| s / count).collect())
    }

    /// Colour and its texture of the points about a patch, and how many there are.
    fn of_points(&self, patch: &Patch, edge_m: f64) -> Option<Vec<f64>> {
        let middle = DVec3::from(patch.centre_m).as_vec3();
        let near = |at: Vec3| f64::from(self.placement.to_scene(at).distance(middle)) < POINTS.0 * edge_m;
        let all: Vec<&[f32; 3]> = self.points.iter().filter(|(at, _)| near(*at)).map(|(_, rgb)| rgb).collect();
        if all.len() < POINTS.1 {
            return None;
        }
        let mut features = colour_and_texture(&all);
        features[4] = (all.len() as f64).ln();
        Some(features)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::room::Walls;
    use promenade_core::glam::DQuat;
    use promenade_paths::colmap::lenses;

    /// A camera in the middle that looks along x, z up: right is -y, down is -z.
    fn camera(at: DVec3) -> Image {
        let to_camera = promenade_core::glam::DMat3::from_cols(DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y);
        let rotation = DQuat::from_mat3(&to_camera);
        Image { id: 0, name: "a".to_owned(), camera: 1, rotation, translation: -(rotation * at) }
    }

    fn pictures() -> (FlatRoom, Voxels, Pictures) {
        let room = FlatRoom::of_box(Walls::of_size([4.0, 3.0, 2.0]).unwrap()).unwrap();
        let voxels = room.patches(0.5).unwrap();
        let lens = lenses("cameras.txt", b"1 PINHOLE 40 20 20 20 20 10").unwrap()[&1];
        // Red on the left, blue on the right.
        let values = (0..20 * 40).map(|i| if i % 40 < 20 { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] }).collect();
        let photo = Raster::new([40, 20], values).unwrap();
        let view = View { camera: camera(DVec3::new(2.0, 1.5, 1.0)), lens, photo };
        (room, voxels, Pictures { views: vec![view], points: Vec::new(), placement: Placement::IDENTITY })
    }

    #[test]
    fn a_photograph_tells_the_colour_of_what_it_shows() {
        let (room, voxels, mut pictures) = pictures();
        let features = pictures.features(&room, &voxels).unwrap();
        for (patch, features) in voxels.patches.iter().zip(&features) {
            if patch.surface != 1 {
                // The lens shows 45 degrees to either side: of other walls a part.
                assert!(patch.surface != 0 || features.is_none(), "nothing behind the camera is shown");
                continue;
            }
            let features = features.as_ref().expect("the wall ahead is shown");
            assert_eq!(features.len(), 5 + 6);
            // Left is where y is larger.
            let left = patch.centre_m[1] > 1.5;
            assert_eq!((features[0] > 0.99, features[2] > 0.99), (left, !left), "{patch:?} {features:?}");
        }
        // Points tell where there are no photographs.
        pictures.views.clear();
        pictures.points = (0..4).map(|i| (Vec3::new(4.0, 0.75, 0.7 + 0.02 * i as f32), [0.2, 0.4, 0.6])).collect();
        let features = pictures.features(&room, &voxels).unwrap();
        let shown: Vec<usize> = (0..features.len()).filter(|p| features[*p].is_some()).collect();
        assert!((1..=2).contains(&shown.len()) && voxels.patches[shown[0]].surface == 1, "{shown:?}");
        assert!((features[shown[0]].as_ref().unwrap()[1] - 0.4).abs() < 1e-6);
    }

    #[test]
    fn what_hides_a_piece_is_seen() {
        let wall = Occluders(vec![[DVec3::new(1.0, -1.0, -1.0), DVec3::new(1.0, 1.0, -1.0), DVec3::new(1.0, 0.0, 1.0)]]);
        assert!(!wall.are_free(DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0)));
        assert!(wall.are_free(DVec3::ZERO, DVec3::new(2.0, 0.0, 3.0)));
        assert!(wall.are_free(DVec3::ZERO, DVec3::new(1.0, 0.0, 0.0)), "a patch does not hide itself");
    }

    #[test]
    fn a_smaller_picture_is_the_mean_of_what_it_shows() {
        assert!(Raster::new([2, 2], vec![[0.0; 3]; 5]).is_err());
        let grey = |values: &[f32]| values.iter().map(|v| [*v; 3]).collect::<Vec<_>>();
        let small = Raster::new([4, 1], grey(&[1.0, 3.0, 5.0, 9.0])).unwrap();
        assert_eq!(small.resized([2, 2]).values, grey(&[2.0, 7.0, 2.0, 7.0]));
        assert_eq!(small.resized([8, 1]).values, grey(&[1.0, 1.0, 3.0, 3.0, 5.0, 5.0, 9.0, 9.0]));
    }
}
