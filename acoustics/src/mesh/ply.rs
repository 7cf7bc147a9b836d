//! PLY files, text and binary: polygons of one group.

use super::Mesh;
use crate::error::AcousticsError;
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};
use std::path::Path;

struct Vertex([f64; 3]);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self([f64::NAN; 3])
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let Some(axis) = ["x", "y", "z"].iter().position(|axis| *axis == name) else { return PropertyAccessResult::Ignored };
        self.0[axis] = match property {
            Property::Float(v) => f64::from(v),
            Property::Double(v) => v,
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

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

struct Other;

impl PropertyAccess for Other {
    fn new() -> Self {
        Self
    }
}

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Mesh, AcousticsError> {
    let damaged = |e: ParseError| AcousticsError::content(path, "a readable PLY file", e);
    let mut reader = Reader::new(bytes);
    let header = Parser::<Other>::new().read_header(&mut reader).map_err(damaged)?;
    let (mut vertices, mut faces): (Vec<Vertex>, Vec<Face>) = (Vec::new(), Vec::new());
    for (name, element) in &header.elements {
        // Each has a property of a byte at least.
        if element.count > bytes.len() || (element.properties.is_empty() && element.count > 0) {
            let found = format!("{} of {name} with {} properties", element.count, element.properties.len());
            return Err(AcousticsError::content(path, format!("at most {} elements with properties", bytes.len()), found));
        }
        match name.as_str() {
            "vertex" => {
                vertices = Parser::new().read_payload_for_element(&mut reader, element, &header).map_err(damaged)?;
            }
            "face" => faces = Parser::new().read_payload_for_element(&mut reader, element, &header).map_err(damaged)?,
            _ => {
                Parser::<Other>::new().read_payload_for_element(&mut reader, element, &header).map_err(damaged)?;
            }
        }
    }
    let mut mesh = Mesh { vertices: vertices.into_iter().map(|v| v.0).collect(), ..Mesh::default() };
    let group = mesh.group("surface");
    for (i, Face(corners)) in faces.iter().enumerate() {
        let corners: Option<Vec<u32>> = corners.iter().map(|c| u32::try_from(*c).ok()).collect();
        let wrong = || AcousticsError::content(path, format!("numbers of vertices in face {i}"), format!("{:?}", faces[i].0));
        mesh.fan(&corners.ok_or_else(wrong)?, group);
    }
    Ok(mesh)
}
