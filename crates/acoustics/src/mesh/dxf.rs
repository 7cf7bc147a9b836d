//! DXF files in text: faces (`3DFACE`) and meshes of them (`POLYLINE` with faces or a grid), in groups by layer (Autodesk,
//! *DXF Reference*). Solids and blocks that are inserted elsewhere are left out.

use super::names::Names;
use super::polygon::Cutter;
use super::{Mesh, Triangle};
use crate::error::AcousticsError;
use glam::DVec3;
use std::path::Path;

/// Flags of a polyline that is a mesh of faces, a grid, and a grid that is closed in either direction.
const FACES: i64 = 64;
const GRID: i64 = 16;
const CLOSED: [i64; 2] = [1, 32];
/// Flags of a vertex that is a place of a mesh of faces, and one that is no place but a face.
const PLACE: i64 = 64;
const OF_MESH: i64 = 128;

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Mesh, AcousticsError> {
    if bytes.starts_with(b"AutoCAD Binary DXF") {
        return Err(AcousticsError::content(path, "a DXF file in text", "one in binary form"));
    }
    let text = String::from_utf8_lossy(bytes);
    let mut reader =
        Reader { path, mesh: Mesh::default(), groups: Names::default(), cutter: Cutter::default(), polyline: None };
    let mut lines = (1_u64..).zip(text.lines());
    let (mut entity, mut within, mut named) = (Entity::default(), false, false);
    while let (Some((number, code)), Some((_, value))) = (lines.next(), lines.next()) {
        let code: u16 = code
            .trim()
            .parse()
            .map_err(|_| AcousticsError::content(path, format!("line {number}: a group code"), format!("{:?}", short(code))))?;
        let value = value.trim();
        match (code, value) {
            (0, _) => {
                if within {
                    reader.take(&std::mem::take(&mut entity))?;
                }
                (named, within) = (value == "SECTION", within && value != "ENDSEC");
                entity = Entity { kind: value.to_owned(), ..Entity::default() };
            }
            (2, "ENTITIES") if named => within = true,
            _ => entity.add(code, value),
        }
    }
    reader.take(&entity)?;
    reader.mesh.groups = reader.groups.into_all();
    Ok(reader.mesh)
}

fn short(text: &str) -> String {
    text.chars().take(40).collect()
}

/// An entity as far as faces are concerned.
#[derive(Default)]
struct Entity {
    kind: String,
    layer: String,
    corners: [[f64; 3]; 4],
    flags: i64,
    /// Numbers from 1, below 0 where an edge is not drawn; or how many places a grid has.
    numbers: [i64; 4],
}

impl Entity {
    fn add(&mut self, code: u16, value: &str) {
        let corner = usize::from(code % 10);
        match code {
            8 => self.layer = value.to_owned(),
            10..=13 | 20..=23 | 30..=33 => {
                self.corners[corner][usize::from(code / 10) - 1] = value.parse().unwrap_or(f64::NAN);
            }
            70 => self.flags = value.parse().unwrap_or(0),
            71..=74 => self.numbers[usize::from(code) - 71] = value.parse().unwrap_or(0),
            _ => {}
        }
    }
}

/// A polyline whose vertices are being read.
struct Polyline {
    layer: String,
    flags: i64,
    counts: [i64; 2],
    places: Vec<DVec3>,
    faces: Vec<[i64; 4]>,
}

struct Reader<'a> {
    path: &'a Path,
    mesh: Mesh,
    groups: Names,
    cutter: Cutter,
    polyline: Option<Polyline>,
}

impl Reader<'_> {
    fn take(&mut self, entity: &Entity) -> Result<(), AcousticsError> {
        let [place, ..] = entity.corners.map(DVec3::from);
        match (entity.kind.as_str(), &mut self.polyline) {
            ("3DFACE", _) => {
                let mut around: Vec<DVec3> = entity.corners.iter().map(|corner| DVec3::from(*corner)).collect();
                around.dedup();
                return self.face(&entity.layer, &around);
            }
            ("POLYLINE", _) => {
                let [m, n, ..] = entity.numbers;
                self.polyline = Some(Polyline {
                    layer: entity.layer.clone(),
                    flags: entity.flags,
                    counts: [m, n],
                    places: Vec::new(),
                    faces: Vec::new(),
                });
            }
            ("VERTEX", Some(polyline)) if entity.flags & OF_MESH != 0 && entity.flags & PLACE == 0 => {
                polyline.faces.push(entity.numbers);
            }
            ("VERTEX", Some(polyline)) => polyline.places.push(place),
            (_, Some(_)) => {
                if let Some(polyline) = self.polyline.take() {
                    return self.faces(&polyline);
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn faces(&mut self, polyline: &Polyline) -> Result<(), AcousticsError> {
        let Polyline { layer, flags, counts, places, faces } = polyline;
        let at = |number: usize| {
            let found = places.get(number).copied();
            found.ok_or_else(|| AcousticsError::content(self.path, format!("a vertex among {}", places.len()), number + 1))
        };
        let mut all: Vec<Vec<DVec3>> = Vec::new();
        if flags & FACES != 0 {
            for face in faces {
                let numbers = face.iter().take_while(|number| **number != 0).map(|number| number.unsigned_abs() as usize - 1);
                all.push(numbers.map(at).collect::<Result<_, _>>()?);
            }
        } else if flags & GRID != 0 {
            let [m, n] = counts.map(|count| usize::try_from(count).unwrap_or(0).min(places.len()));
            let ends = [m, n]
                .into_iter()
                .zip(CLOSED)
                .map(|(count, closed)| if flags & closed == 0 { count.max(1) - 1 } else { count });
            let [rows, columns] = ends.collect::<Vec<_>>()[..] else { return Ok(()) };
            for (i, j) in (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j))) {
                let corner = |i: usize, j: usize| at((i % m) * n + j % n);
                all.push(vec![corner(i, j)?, corner(i + 1, j)?, corner(i + 1, j + 1)?, corner(i, j + 1)?]);
            }
        }
        all.iter().try_for_each(|around| self.face(layer, around))
    }

    fn face(&mut self, layer: &str, around: &[DVec3]) -> Result<(), AcousticsError> {
        let group = self.groups.number(if layer.is_empty() { "surface" } else { layer });
        let first = self.mesh.vertices.len() as u32;
        let cut = self.cutter.cut(around).map_err(|found| AcousticsError::content(self.path, Cutter::EXPECTED, found))?;
        self.mesh.triangles.extend(cut.into_iter().map(|t| Triangle { corners: t.map(|i| first + i as u32), group }));
        self.mesh.vertices.extend(around.iter().map(DVec3::to_array));
        self.mesh.within_limits().map_err(|found| AcousticsError::content(self.path, Mesh::EXPECTED, found))
    }
}
