//! PLY files: clouds of points, 3D Gaussian splats and meshes; text and binary of either byte order.

use super::mesh::{Corner, Surface};
use super::point::{GREY, HARMONIC, Point};
use super::{MAX_POINTS, Place, PointOptions, Reconstruction};
use crate::BakeError;
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Property, PropertyAccess, PropertyAccessResult};
use promenade_core::glam::Vec3;
use std::path::Path;

/// Harmonics of a splat's colour.
const SPLAT: [&str; 3] = ["f_dc_0", "f_dc_1", "f_dc_2"];

/// What is used of a vertex.
struct Vertex {
    position: [f64; 3],
    colour: [f64; 3],
    harmonics: [f64; 3],
    opacity: f64,
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self { position: [f64::NAN; 3], colour: GREY.map(f64::from), harmonics: [0.0; 3], opacity: f64::INFINITY }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let slot = match name {
            "x" => &mut self.position[0],
            "y" => &mut self.position[1],
            "z" => &mut self.position[2],
            "red" | "r" | "diffuse_red" => &mut self.colour[0],
            "green" | "g" | "diffuse_green" => &mut self.colour[1],
            "blue" | "b" | "diffuse_blue" => &mut self.colour[2],
            "f_dc_0" => &mut self.harmonics[0],
            "f_dc_1" => &mut self.harmonics[1],
            "f_dc_2" => &mut self.harmonics[2],
            "opacity" => &mut self.opacity,
            _ => return PropertyAccessResult::Ignored,
        };
        // Whole numbers are shares of the largest.
        *slot = match property {
            Property::Float(v) => f64::from(v),
            Property::Double(v) => v,
            Property::UChar(v) => f64::from(v) / 255.0,
            Property::UShort(v) => f64::from(v) / 65_535.0,
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
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

pub(super) fn read(path: &Path, bytes: &[u8], options: &PointOptions) -> Result<Place, BakeError> {
    let damaged = |e: ParseError| BakeError::unreadable(path, "PLY file", e);
    let mut reader = Reader::new(bytes);
    let header = Parser::<Other>::new().read_header(&mut reader).map_err(damaged)?;
    let mut vertices: Option<(Vec<Vertex>, bool)> = None;
    let mut faces = Vec::new();
    for (name, element) in &header.elements {
        let wrong = |expected: String, found: String| BakeError::entry(path, format!("element {name}"), expected, found);
        // Each has a property of a byte at least.
        if element.count > bytes.len().min(MAX_POINTS) || (element.properties.is_empty() && element.count > 0) {
            let found = format!("{} with {} properties", element.count, element.properties.len());
            return Err(wrong(format!("at most {} with properties", bytes.len().min(MAX_POINTS)), found));
        }
        match name.as_str() {
            "vertex" => {
                let has = |names: [&str; 3]| names.iter().all(|n| element.properties.contains_key(*n));
                if !has(["x", "y", "z"]) {
                    return Err(wrong("properties x, y and z".to_owned(), names(element)));
                }
                let read = Parser::<Vertex>::new().read_payload_for_element(&mut reader, element, &header);
                vertices = Some((read.map_err(damaged)?, has(SPLAT)));
            }
            "face" => {
                faces = Parser::<Face>::new().read_payload_for_element(&mut reader, element, &header).map_err(damaged)?;
            }
            _ => {
                Parser::<Other>::new().read_payload_for_element(&mut reader, element, &header).map_err(damaged)?;
            }
        }
    }
    let Some((vertices, splats)) = vertices else {
        return Err(BakeError::content(path, "an element vertex", "none"));
    };
    let points = vertices
        .iter()
        .enumerate()
        .map(|(index, v)| {
            point(v, splats).map_err(|found| {
                let expected = "a finite position, and a colour of 0 to 1 where it is of floats";
                BakeError::entry(path, format!("vertex {index}"), expected, found)
            })
        })
        .collect::<Result<Vec<Point>, _>>()?;
    if !faces.is_empty() {
        return surface(path, &points, &faces).map(Place::Surface);
    }
    let total = points.len();
    // Opacities of splats are logits.
    let solid = |v: &Vertex| !splats || 1.0 / (1.0 + (-v.opacity).exp()) >= f64::from(options.min_opacity);
    let points: Vec<Point> = points.into_iter().zip(&vertices).filter(|(_, v)| solid(v)).map(|(p, _)| p).collect();
    Ok(Place::Points(Reconstruction { left_out: total - points.len(), points, cameras: Vec::new() }))
}

fn names(element: &ElementDef) -> String {
    let names: Vec<&str> = element.properties.keys().take(8).map(String::as_str).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

fn point(vertex: &Vertex, splat: bool) -> Result<Point, String> {
    let narrow = |v: [f64; 3]| v.map(|c| c as f32);
    let position = Vec3::from_array(narrow(vertex.position));
    let colour =
        if splat { narrow(vertex.harmonics).map(|h| (0.5 + HARMONIC * h).clamp(0.0, 1.0)) } else { narrow(vertex.colour) };
    if position.is_finite() && colour.iter().all(|c| (0.0..=1.0).contains(c)) && !vertex.opacity.is_nan() {
        Ok(Point { position, colour })
    } else {
        Err(format!("{position} of colour {colour:?}"))
    }
}

/// Polygons as fans of triangles.
fn surface(path: &Path, points: &[Point], faces: &[Face]) -> Result<Surface, BakeError> {
    let mut triangles = Vec::with_capacity(faces.len());
    for (index, Face(corners)) in faces.iter().enumerate() {
        let corner = |number: i64| {
            let point = usize::try_from(number).ok().and_then(|n| points.get(n)).ok_or_else(|| {
                let expected = format!("vertices 0 to {}", points.len().saturating_sub(1));
                BakeError::entry(path, format!("face {index}"), expected, number)
            })?;
            Ok::<Corner, BakeError>(Corner { position: point.position, colour: point.colour })
        };
        if corners.len() < 3 {
            return Err(BakeError::entry(path, format!("face {index}"), "3 vertices or more", corners.len()));
        }
        for pair in corners[1..].windows(2) {
            triangles.push([corner(corners[0])?, corner(pair[0])?, corner(pair[1])?]);
        }
    }
    Ok(Surface::new(triangles))
}
