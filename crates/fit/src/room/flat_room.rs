//! Rooms of flat walls: a box, or any mesh whose walls are moved along their normals.

use super::vectors::{along, cross, dot};
use super::voxels::Voxels;
use super::wall::FlatWall;
use super::walls::{WALLS, Walls, outwards};
use crate::error::FitError;
use promenade_acoustics::{Material, Mesh, Shoebox};
use std::sync::Arc;

/// Walls of a mesh at most: each is a number that is sought.
const MOST_WALLS: usize = 512;
/// Two triangles of a group whose normals or distances differ by less are of one wall: a share, and metres.
const SAME: (f64, f64) = (1e-4, 1e-3);

/// What is known of a room's form.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// A box along the axes, a surface for each wall.
    Box(Walls),
    /// Any mesh of flat walls, a surface for each of its groups.
    Mesh(Arc<Mesh>),
}

/// A room of flat walls with a surface for each.
#[derive(Clone, Debug, PartialEq)]
pub struct FlatRoom {
    /// Its form.
    pub form: Form,
    /// Names of the surfaces.
    pub surfaces: Vec<String>,
    /// Walls.
    pub walls: Vec<FlatWall>,
    /// Of each triangle of a mesh its wall; nothing of degenerate ones.
    pub(super) of_triangle: Vec<Option<u16>>,
    /// Its surfaces in patches; paths then meet these.
    pub voxels: Option<Arc<Voxels>>,
}

impl FlatRoom {
    /// A box.
    ///
    /// # Errors
    /// A length that is not 0.5 to 200 m.
    pub fn of_box(walls: Walls) -> Result<Self, FitError> {
        walls.check()?;
        let mut room = Self {
            form: Form::Box(walls),
            surfaces: WALLS.iter().map(|n| (*n).to_owned()).collect(),
            walls: Vec::new(),
            of_triangle: Vec::new(),
            voxels: None,
        };
        room.walls = box_walls(&walls);
        Ok(room)
    }

    /// A mesh: triangles of one group in one plane are a wall.
    ///
    /// # Errors
    /// A mesh without triangles, or with more than 512 walls.
    pub fn of_mesh(mesh: Mesh) -> Result<Self, FitError> {
        let mut walls: Vec<FlatWall> = Vec::new();
        let mut of_triangle = Vec::new();
        for t in &mesh.triangles {
            let [a, b, c] = t.corners.map(|i| mesh.vertices[i as usize]);
            let area = cross(along(b, -1.0, a), along(c, -1.0, a));
            let twice = dot(area, area).sqrt();
            if twice < 1e-12 {
                of_triangle.push(None);
                continue;
            }
            let normal = area.map(|c| c / twice);
            let at_m = dot(normal, a);
            let same = walls.iter().position(|w| {
                let side = dot(w.normal, normal);
                w.surface == t.group as usize && side.abs() > 1.0 - SAME.0 && (w.at_m - side.signum() * at_m).abs() < SAME.1
            });
            let wall = same.unwrap_or(walls.len());
            if same.is_none() {
                walls.push(FlatWall { normal, at_m, surface: t.group as usize, area_m2: 0.0 });
            }
            walls[wall].area_m2 += 0.5 * twice;
            of_triangle.push(Some(wall as u16));
        }
        if walls.is_empty() || walls.len() > MOST_WALLS {
            return Err(FitError::argument("flat walls of the mesh", format!("1 to {MOST_WALLS}"), walls.len()));
        }
        Ok(Self { surfaces: mesh.groups.clone(), form: Form::Mesh(Arc::new(mesh)), walls, of_triangle, voxels: None })
    }

    /// This room with a surface for each wall, named after its own with a number: `wall.2`.
    #[must_use]
    pub fn per_wall(&self) -> Self {
        let Form::Mesh(mesh) = &self.form else { return self.clone() };
        let mut each = self.clone();
        let mut mesh = (**mesh).clone();
        let mut of_surface = vec![0; self.surfaces.len()];
        each.surfaces = self
            .walls
            .iter()
            .map(|w| {
                of_surface[w.surface] += 1;
                format!("{}.{}", self.surfaces[w.surface], of_surface[w.surface])
            })
            .collect();
        each.walls.iter_mut().enumerate().for_each(|(i, w)| w.surface = i);
        // Triangles without an area belong to no wall, and reflect nothing.
        for (t, wall) in mesh.triangles.iter_mut().zip(&self.of_triangle) {
            t.group = wall.map_or(0, u32::from);
        }
        mesh.groups.clone_from(&each.surfaces);
        each.form = Form::Mesh(Arc::new(mesh));
        each
    }

    /// Its surfaces as a mesh, a group for each.
    ///
    /// # Errors
    /// A box without a volume.
    pub fn mesh(&self) -> Result<Mesh, FitError> {
        let walls = match &self.form {
            Form::Mesh(mesh) => return Ok((**mesh).clone()),
            Form::Box(walls) => walls,
        };
        let materials = std::array::from_fn(|_| Material::even("", 0.1, 0.1));
        let mut mesh = Shoebox { size: walls.size_m(), materials }.mesh()?;
        for v in &mut mesh.vertices {
            *v = along(*v, 1.0, walls.low_m);
        }
        Ok(mesh)
    }

    /// Its triangles with the wall of each.
    fn triangles(&self) -> Result<(Mesh, Vec<Option<u16>>), FitError> {
        let mesh = self.mesh()?;
        let walls = match &self.form {
            Form::Mesh(_) => self.of_triangle.clone(),
            Form::Box(_) => mesh.triangles.iter().map(|t| Some(t.group as u16)).collect(),
        };
        Ok((mesh, walls))
    }

    /// The patches of its surfaces in voxels of an edge of at most `edge_m`.
    ///
    /// # Errors
    /// An edge that is not above 0, or more patches than [`MOST_PATCHES`](super::MOST_PATCHES).
    pub fn patches(&self, edge_m: f64) -> Result<Voxels, FitError> {
        let (mesh, of_triangle) = self.triangles()?;
        Voxels::new(&self.walls, &mesh, &of_triangle, edge_m)
    }

    /// This room as a mesh whose paths meet the patches of its surfaces; its paths are as long as before.
    ///
    /// # Errors
    /// An edge that is not above 0, or more patches than [`MOST_PATCHES`](super::MOST_PATCHES).
    pub fn in_voxels(&self, edge_m: f64) -> Result<Self, FitError> {
        let (mesh, of_triangle) = self.triangles()?;
        let voxels = Arc::new(Voxels::new(&self.walls, &mesh, &of_triangle, edge_m)?);
        Ok(Self { form: Form::Mesh(Arc::new(mesh)), of_triangle, voxels: Some(voxels), ..self.clone() })
    }

    /// This room with its walls moved along their normals, metres. Corners of a mesh move to where their walls meet, in the
    /// sense of least squares and of least motion.
    ///
    /// # Errors
    /// A box that is none any more.
    pub fn moved(&self, by_m: &[f64]) -> Result<Self, FitError> {
        let mut moved = self.clone();
        moved.walls.iter_mut().zip(by_m).for_each(|(w, by)| w.at_m += by);
        match &mut moved.form {
            Form::Box(walls) => {
                for (w, by) in by_m.iter().enumerate().take(6) {
                    walls.set_wall(w, walls.wall_m(w) + outwards(w) * by);
                }
                walls.check()?;
                moved.walls = box_walls(walls);
            }
            Form::Mesh(mesh) => move_corners(Arc::make_mut(mesh), &self.of_triangle, &self.walls, by_m),
        }
        Ok(moved)
    }

    /// This room with its walls moved along their normals, metres, for its paths alone: corners of a mesh stay.
    pub(crate) fn shifted(&self, by_m: &[f64]) -> Self {
        let mut shifted = self.clone();
        shifted.walls.iter_mut().zip(by_m).for_each(|(w, by)| w.at_m += by);
        if let Form::Box(walls) = &mut shifted.form {
            for (w, wall) in shifted.walls.iter().enumerate() {
                walls.set_wall(w, outwards(w) * wall.at_m);
            }
        }
        shifted
    }

    /// Its least and greatest coordinates, metres.
    #[must_use]
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        match &self.form {
            Form::Box(walls) => [walls.low_m, walls.high_m],
            Form::Mesh(mesh) => mesh.bounds(),
        }
    }

    /// Square metres by surface.
    #[must_use]
    pub fn areas_m2(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.surfaces.len()];
        self.walls.iter().for_each(|w| areas[w.surface] += w.area_m2);
        areas
    }

    /// Cubic metres; of a mesh that is not closed it means little.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        match &self.form {
            Form::Box(walls) => walls.volume_m3(),
            Form::Mesh(mesh) => {
                let sixth = |t: &promenade_acoustics::Triangle| {
                    let [a, b, c] = t.corners.map(|i| mesh.vertices[i as usize]);
                    dot(a, cross(b, c)) / 6.0
                };
                mesh.triangles.iter().map(sixth).sum::<f64>().abs()
            }
        }
    }
}

fn box_walls(walls: &Walls) -> Vec<FlatWall> {
    let areas = walls.areas_m2();
    let wall = |w: usize| {
        let mut normal = [0.0; 3];
        normal[w / 2] = outwards(w);
        FlatWall { normal, at_m: outwards(w) * walls.wall_m(w), surface: w, area_m2: areas[w] }
    };
    (0..6).map(wall).collect()
}

/// Moves each corner by the least that puts it on its walls: Gauss-Seidel on the walls that meet there.
fn move_corners(mesh: &mut Mesh, of_triangle: &[Option<u16>], walls: &[FlatWall], by_m: &[f64]) {
    let mut meeting: Vec<Vec<u16>> = vec![Vec::new(); mesh.vertices.len()];
    for (t, wall) in mesh.triangles.iter().zip(of_triangle) {
        for (corner, wall) in t.corners.iter().zip(std::iter::repeat(*wall)) {
            let own = &mut meeting[*corner as usize];
            if let Some(wall) = wall.filter(|w| !own.contains(w)) {
                own.push(wall);
            }
        }
    }
    for (vertex, own) in mesh.vertices.iter_mut().zip(&meeting) {
        let start = *vertex;
        for _ in 0..200 {
            for w in own {
                let (wall, by) = (&walls[usize::from(*w)], by_m[usize::from(*w)]);
                let gone = dot(along(*vertex, -1.0, start), wall.normal);
                *vertex = along(*vertex, by - gone, wall.normal);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_follow_their_walls() {
        let walls = Shoebox { size: [5.5, 4.1, 2.9], materials: std::array::from_fn(|_| Material::even("", 0.1, 0.0)) };
        let room = FlatRoom::of_mesh(walls.mesh().unwrap()).unwrap();
        let by: Vec<f64> = (0..6).map(|w| 0.01 * f64::from(w + 1)).collect();
        let moved = room.moved(&by).unwrap();
        for (before, after) in room.walls.iter().zip(&moved.walls) {
            assert!((after.at_m - before.at_m).abs() > 5e-3);
        }
        let Form::Mesh(mesh) = &moved.form else { panic!() };
        for (t, wall) in mesh.triangles.iter().zip(&moved.of_triangle) {
            let wall = &moved.walls[usize::from(wall.unwrap())];
            for c in t.corners {
                assert!((dot(wall.normal, mesh.vertices[c as usize]) - wall.at_m).abs() < 1e-9);
            }
        }
        let inwards = room.walls.iter().all(|w| dot(w.normal, [2.0, 2.0, 1.5]) > w.at_m);
        assert!(inwards, "the box's mesh faces inwards");
    }
}
