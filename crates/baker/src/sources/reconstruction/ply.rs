//! PLY files: clouds of points, 3D Gaussian splats and meshes; text and binary of either byte order.

use super::mesh::{Corner, Surface};
use super::point::{GREY, Point};
use super::{MAX_POINTS, Place, PointOptions, Reconstruction};
use crate::BakeError;
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};
use promenade_acoustics::{Ply, PlyError, PlyLimits};
use promenade_core::glam::Vec3;
use promenade_core::network::HARMONIC;
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

pub(super) fn read(path: &Path, bytes: &[u8], options: &PointOptions) -> Result<Place, BakeError> {
    let wrong = |e: PlyError| match e.place.strip_suffix(": ") {
        Some(place) => BakeError::entry(path, place, e.expected, e.found),
        None if e.is_damage() => BakeError::unreadable(path, "PLY file", e.found),
        None => BakeError::content(path, e.expected, e.found),
    };
    let limits = PlyLimits { vertices: MAX_POINTS, faces: MAX_POINTS };
    let ply = Ply::<Vertex>::read(bytes, limits).map_err(wrong)?;
    let vertices = &ply.vertices;
    let splats = SPLAT.iter().all(|name| ply.properties.iter().any(|property| property == name));
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
    let faces = ply.triangles(|vertex| vertex.position).map_err(wrong)?;
    if ply.has_faces() {
        let corner = |number: u32| points.get(number as usize).map(|p| Corner { position: p.position, colour: p.colour });
        let corners = faces.iter().filter_map(|[a, b, c]| Some([corner(*a)?, corner(*b)?, corner(*c)?]));
        return Ok(Place::Surface(Surface::new(corners.collect())));
    }
    let total = points.len();
    // Opacities of splats are logits.
    let solid = |v: &Vertex| !splats || 1.0 / (1.0 + (-v.opacity).exp()) >= f64::from(options.min_opacity);
    let points: Vec<Point> = points.into_iter().zip(vertices).filter(|(_, v)| solid(v)).map(|(p, _)| p).collect();
    Ok(Place::Points(Reconstruction { left_out: total - points.len(), points, ..Reconstruction::default() }))
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
