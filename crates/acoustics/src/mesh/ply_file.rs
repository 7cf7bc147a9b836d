//! PLY files, text and binary: vertices with the properties that a reader names, and polygons.

use super::polygon::Cutter;
use crate::error::AcousticsError;
use glam::DVec3;
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType};
use std::path::Path;
use thiserror::Error;

/// Elements that a file may hold; each kind has a limit of its own as well.
#[derive(Clone, Copy, Debug)]
pub struct PlyLimits {
    /// Most vertices.
    pub vertices: usize,
    /// Most polygons.
    pub faces: usize,
}

/// Why a PLY file cannot be read.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{place}expected {expected}, found {found}")]
pub struct PlyError {
    /// Part of the file, with a colon behind it; empty for the file as a whole.
    pub place: String,
    /// What would have been right.
    pub expected: String,
    /// What is there.
    pub found: String,
}

/// What is expected of a file that is cut short or no PLY file.
const READABLE: &str = "a readable PLY file";

impl PlyError {
    /// Whether the file is damaged as a whole, rather than that it holds something else than what is needed.
    #[must_use]
    pub fn is_damage(&self) -> bool {
        self.expected == READABLE
    }

    /// The error of a file.
    pub(super) fn at(self, path: &Path) -> AcousticsError {
        AcousticsError::content(path, format!("{}{}", self.place, self.expected), self.found)
    }

    fn of(place: impl Into<String>, expected: impl Into<String>, found: impl ToString) -> Self {
        Self { place: place.into(), expected: expected.into(), found: found.to_string() }
    }
}

/// What a file holds.
#[derive(Clone, Debug)]
pub struct Ply<V> {
    /// In the order of the file.
    pub vertices: Vec<V>,
    /// Names of the vertices' properties.
    pub properties: Vec<String>,
    faces: Vec<Vec<i64>>,
}

/// Numbers of a polygon's vertices.
struct Face(Vec<i64>);

impl PropertyAccess for Face {
    fn new() -> Self {
        Self(Vec::new())
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !matches!(name, "vertex_indices" | "vertex_index") {
            return PropertyAccessResult::Ignored;
        }
        self.0 = match property {
            Property::ListUChar(v) => v.into_iter().map(i64::from).collect(),
            Property::ListUShort(v) => v.into_iter().map(i64::from).collect(),
            Property::ListShort(v) => v.into_iter().map(i64::from).collect(),
            Property::ListInt(v) => v.into_iter().map(i64::from).collect(),
            Property::ListUInt(v) => v.into_iter().map(i64::from).collect(),
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// What has no use here.
struct Other;

impl PropertyAccess for Other {
    fn new() -> Self {
        Self
    }
}

impl<V: PropertyAccess> Ply<V> {
    /// Reads a whole file.
    ///
    /// # Errors
    /// A file that is damaged, without vertices that have x, y and z, or with more elements than the limits or its bytes allow.
    pub fn read(bytes: &[u8], limits: PlyLimits) -> Result<Self, PlyError> {
        let damaged = |e: ParseError| PlyError::of("", READABLE, e);
        let mut reader = Reader::new(bytes);
        let header = Parser::<Other>::new().read_header(&mut reader).map_err(damaged)?;
        let mut vertices = None;
        let mut faces: Vec<Face> = Vec::new();
        for (name, element) in &header.elements {
            let most = match name.as_str() {
                "vertex" => limits.vertices,
                "face" => limits.faces,
                _ => usize::MAX,
            };
            let most = most.min(bytes.len() / least_bytes(element).max(1));
            if element.count > most || (element.properties.is_empty() && element.count > 0) {
                let found = format!("{} with {} properties", element.count, element.properties.len());
                return Err(PlyError::of(format!("element {name}: "), format!("at most {most} with properties"), found));
            }
            match name.as_str() {
                "vertex" => {
                    let properties: Vec<String> = element.properties.keys().cloned().collect();
                    if !["x", "y", "z"].iter().all(|axis| properties.iter().any(|name| name == axis)) {
                        let some = properties.iter().take(8).cloned().collect::<Vec<_>>().join(", ");
                        let found = if some.is_empty() { "none".to_owned() } else { some };
                        return Err(PlyError::of("element vertex: ", "properties x, y and z", found));
                    }
                    let read = Parser::<V>::new().read_payload_for_element(&mut reader, element, &header);
                    vertices = Some((read.map_err(damaged)?, properties));
                }
                "face" => faces = Parser::new().read_payload_for_element(&mut reader, element, &header).map_err(damaged)?,
                _ => {
                    Parser::<Other>::new().read_payload_for_element(&mut reader, element, &header).map_err(damaged)?;
                }
            }
        }
        let (vertices, properties) = vertices.ok_or_else(|| PlyError::of("", "an element vertex", "none"))?;
        Ok(Self { vertices, properties, faces: faces.into_iter().map(|face| face.0).collect() })
    }

    /// Whether there is a polygon.
    #[must_use]
    pub fn has_faces(&self) -> bool {
        !self.faces.is_empty()
    }

    /// The polygons as triangles of numbers of vertices, whose places are told.
    ///
    /// # Errors
    /// A polygon of fewer than three corners or with one that is not there, or too many corners in polygons that are not
    /// convex.
    pub fn triangles(&self, place: impl Fn(&V) -> [f64; 3]) -> Result<Vec<[u32; 3]>, PlyError> {
        let mut cutter = Cutter::default();
        let mut triangles = Vec::with_capacity(self.faces.len());
        for (index, corners) in self.faces.iter().enumerate() {
            let at = || format!("face {index}: ");
            if corners.len() < 3 {
                return Err(PlyError::of(at(), "3 vertices or more", corners.len()));
            }
            let vertex = |number: &i64| {
                let vertex = usize::try_from(*number).ok().and_then(|n| self.vertices.get(n));
                let expected = || format!("vertices 0 to {}", self.vertices.len().saturating_sub(1));
                vertex.map(|v| DVec3::from_array(place(v))).ok_or_else(|| PlyError::of(at(), expected(), number))
            };
            let places: Vec<DVec3> = corners.iter().map(vertex).collect::<Result<_, _>>()?;
            let cut = cutter.cut(&places).map_err(|found| PlyError::of(at(), Cutter::EXPECTED, found))?;
            triangles.extend(cut.into_iter().map(|t| t.map(|i| corners[i] as u32)));
        }
        Ok(triangles)
    }
}

/// Bytes that an element takes at least, in text as in binary.
fn least_bytes(element: &ElementDef) -> usize {
    let scalar = |of: &ScalarType| match of {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        // In text a digit and a space.
        _ => 2,
    };
    let property = |of: &PropertyType| match of {
        PropertyType::Scalar(one) | PropertyType::List(one, _) => scalar(one),
    };
    element.properties.iter().map(|(_, p)| property(&p.data_type)).sum()
}
