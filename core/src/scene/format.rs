//! The `.promenade` file: safetensors with a JSON manifest in its metadata.

use super::{Anchor, HeldOut, Provenance, SceneParts, TailModel};
use crate::field::Axis;
use crate::metrics::Binaural;
use crate::spatializer::LONGEST_LATENCY_S;
use crate::{Bands, Field, FieldGrid, Pose, StftGrid, TransferShape};
use glam::{Quat, Vec3};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use thiserror::Error;

/// Version of the format that this code writes and reads.
const VERSION: u32 = 1;
/// The largest scene file that is read, bytes.
pub const MAX_SCENE_BYTES: usize = 1 << 30;
/// The largest numbers of things in a scene, checked before anything is allocated for them.
const MAX_NODES: usize = 1 << 22;
const MAX_ANCHORS: usize = 65_536;
const MAX_BINS: usize = 1 << 15;
const MAX_BANDS: usize = 512;
const MAX_HOPS: usize = 4096;
const MAX_HELD_OUT: usize = 65_536;

const MANIFEST: &str = "promenade";
const CHECKSUM: &str = "crc32";

/// Why bytes are no scene.
#[derive(Debug, Error)]
pub enum SceneError {
    /// The file is larger than is read.
    #[error("the scene has {found} bytes, expected at most {MAX_SCENE_BYTES}")]
    TooLarge {
        /// Its size, bytes.
        found: usize,
    },
    /// The container is cut off or damaged.
    #[error("not a whole scene file (safetensors container): {0}")]
    Container(String),
    /// The container holds no manifest, or one that is not understood.
    #[error("the scene's manifest is damaged or missing: {0}")]
    Manifest(String),
    /// Written by another version of Promenade.
    #[error("the scene has format version {found}, expected {VERSION}")]
    Version {
        /// Its version.
        found: u64,
    },
    /// The content does not match its checksum.
    #[error("the scene is damaged: its checksum is {found:08x}, expected {expected:08x}")]
    Checksum {
        /// Checksum stored in the file.
        expected: u32,
        /// Checksum of what was read.
        found: u32,
    },
    /// A tensor is missing or has another type or shape.
    #[error("tensor '{name}' of the scene: expected {expected}, found {found}")]
    Tensor {
        /// Name of the tensor.
        name: &'static str,
        /// Type and shape that the manifest asks for.
        expected: String,
        /// Type and shape in the file.
        found: String,
    },
    /// A value is out of range or not finite.
    #[error("{what} of the scene: expected {expected}, found {found}")]
    Value {
        /// What the value is.
        what: String,
        /// Its range.
        expected: String,
        /// The value.
        found: String,
    },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Manifest {
    version: u64,
    title: String,
    credit: String,
    licence: String,
    recipe: String,
    notes: Vec<String>,
    grid: ManifestGrid,
    seed: u64,
    taps: usize,
    top_hz: f32,
    emitter: [f32; 3],
    start: ManifestPose,
    position: [ManifestAxis; 3],
    elevation: ManifestAxis,
    azimuth: ManifestAxis,
    held_out: Vec<ManifestHeldOut>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ManifestGrid {
    sample_rate_hz: f64,
    n_fft: usize,
    hop: usize,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ManifestAxis {
    start: f32,
    step: f32,
    count: usize,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ManifestPose {
    position: [f32; 3],
    /// w, x, y, z.
    quat: [f32; 4],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ManifestHeldOut {
    name: String,
    pose: ManifestPose,
    itd_s: f64,
    ild_db: f64,
    t20_s: Option<f64>,
    edt_s: Option<f64>,
    c50_db: Option<f64>,
}

impl From<&Axis> for ManifestAxis {
    fn from(a: &Axis) -> Self {
        Self { start: a.start, step: a.step, count: a.count }
    }
}

impl From<ManifestAxis> for Axis {
    fn from(a: ManifestAxis) -> Self {
        Self { start: a.start, step: a.step, count: a.count }
    }
}

impl From<&Pose> for ManifestPose {
    fn from(p: &Pose) -> Self {
        let q = p.orientation;
        Self { position: p.position.to_array(), quat: [q.w, q.x, q.y, q.z] }
    }
}

impl From<ManifestPose> for Pose {
    fn from(p: ManifestPose) -> Self {
        let [w, x, y, z] = p.quat;
        Self { position: Vec3::from_array(p.position), orientation: Quat::from_xyzw(x, y, z, w) }
    }
}

fn value(what: &str, expected: impl ToString, found: impl ToString) -> SceneError {
    SceneError::Value { what: what.to_owned(), expected: expected.to_string(), found: found.to_string() }
}

pub(super) fn write(parts: &SceneParts) -> Result<Vec<u8>, SceneError> {
    let field = &parts.field;
    let nodes = field.grid();
    let manifest = Manifest {
        version: u64::from(VERSION),
        title: parts.provenance.title.clone(),
        credit: parts.provenance.credit.clone(),
        licence: parts.provenance.licence.clone(),
        recipe: parts.provenance.recipe.clone(),
        notes: parts.provenance.notes.clone(),
        grid: ManifestGrid { sample_rate_hz: parts.grid.sample_rate_hz, n_fft: parts.grid.n_fft, hop: parts.grid.hop },
        seed: parts.tail.seed,
        taps: field.shape().taps,
        top_hz: parts.top_hz,
        emitter: field.emitter().to_array(),
        start: (&parts.start_pose).into(),
        position: [&nodes.position[0], &nodes.position[1], &nodes.position[2]].map(Into::into),
        elevation: (&nodes.elevation).into(),
        azimuth: (&nodes.azimuth).into(),
        held_out: parts
            .held_out
            .iter()
            .map(|h| ManifestHeldOut {
                name: h.name.clone(),
                pose: (&h.pose).into(),
                itd_s: h.measured.itd_s,
                ild_db: h.measured.ild_db,
                t20_s: h.measured.t20_s,
                edt_s: h.measured.edt_s,
                c50_db: h.measured.c50_db,
            })
            .collect(),
    };
    let manifest = serde_json::to_string(&manifest).map_err(|e| SceneError::Manifest(e.to_string()))?;
    let bytes = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let points = |f: fn(&Anchor) -> Vec3| parts.anchors.iter().flat_map(|a| f(a).to_array()).collect::<Vec<f32>>();
    let tensors = [
        ("anchors.colour", vec![parts.anchors.len(), 3], bytes(&points(|a| a.colour))),
        ("anchors.position", vec![parts.anchors.len(), 3], bytes(&points(|a| a.position))),
        ("bands.centres_hz", vec![parts.bands.count()], bytes(parts.bands.centres_hz())),
        ("field.rows", vec![nodes.nodes(), field.shape().row_len()], bytes(field.rows())),
        ("tail.coherence", vec![parts.tail.coherence.len()], bytes(&parts.tail.coherence)),
        ("tail.t60_s", vec![parts.tail.t60_s.len()], bytes(&parts.tail.t60_s)),
    ];
    let mut views = tensors
        .iter()
        .map(|(name, shape, data)| TensorView::new(Dtype::F32, shape.clone(), data).map(|view| (*name, view)))
        .collect::<Result<Vec<_>, _>>()
        .map_err(|e| SceneError::Container(e.to_string()))?;
    let crc = checksum(&manifest, views.iter().map(|(name, view)| (*name, view))).to_le_bytes();
    let view = TensorView::new(Dtype::U32, vec![1], &crc).map_err(|e| SceneError::Container(e.to_string()))?;
    views.push((CHECKSUM, view));
    // One entry only: the container writes several in a random order, and the same scene must make the same bytes.
    let metadata = HashMap::from([(MANIFEST.to_owned(), manifest)]);
    safetensors::serialize(views, Some(metadata)).map_err(|e| SceneError::Container(e.to_string()))
}

/// Checksum over the manifest and, by name, every tensor's name, shape and bytes.
fn checksum<'a, 'b: 'a>(manifest: &str, tensors: impl Iterator<Item = (&'a str, &'a TensorView<'b>)>) -> u32 {
    let mut tensors: Vec<_> = tensors.collect();
    tensors.sort_by_key(|(name, _)| *name);
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(manifest.as_bytes());
    for (name, view) in tensors {
        hasher.update(name.as_bytes());
        for size in view.shape() {
            hasher.update(&(*size as u64).to_le_bytes());
        }
        hasher.update(view.data());
    }
    hasher.finalize()
}

pub(super) fn read(bytes: &[u8]) -> Result<SceneParts, SceneError> {
    if bytes.len() > MAX_SCENE_BYTES {
        return Err(SceneError::TooLarge { found: bytes.len() });
    }
    let container = |e: safetensors::SafeTensorError| SceneError::Container(e.to_string());
    let (_, header) = SafeTensors::read_metadata(bytes).map_err(container)?;
    let tensors = SafeTensors::deserialize(bytes).map_err(container)?;
    let metadata = header.metadata().as_ref();
    let entry = |key: &str| {
        metadata.and_then(|m| m.get(key)).ok_or_else(|| SceneError::Manifest(format!("no '{key}' in the metadata")))
    };
    let text = entry(MANIFEST)?;
    // The version comes first: a manifest of another version may have other fields.
    let loose: serde_json::Value = serde_json::from_str(text).map_err(|e| SceneError::Manifest(e.to_string()))?;
    match loose.get("version").and_then(serde_json::Value::as_u64) {
        Some(found) if found == u64::from(VERSION) => {}
        Some(found) => return Err(SceneError::Version { found }),
        None => return Err(SceneError::Manifest("no version number".to_owned())),
    }
    let m: Manifest = serde_json::from_value(loose).map_err(|e| SceneError::Manifest(e.to_string()))?;
    let stored = bytes_of(&tensors, CHECKSUM, Dtype::U32, &[Some(1)])?;
    let expected = stored.as_chunks::<4>().0.first().map_or(0, |b| u32::from_le_bytes(*b));
    let all = tensors.tensors();
    let found = checksum(text, all.iter().map(|(name, view)| (name.as_str(), view)).filter(|(name, _)| *name != CHECKSUM));
    if found != expected {
        return Err(SceneError::Checksum { expected, found });
    }
    from_manifest(m, &tensors)
}

fn from_manifest(m: Manifest, tensors: &SafeTensors<'_>) -> Result<SceneParts, SceneError> {
    let grid = StftGrid { sample_rate_hz: m.grid.sample_rate_hz, n_fft: m.grid.n_fft, hop: m.grid.hop };
    check_grid(&grid)?;
    let centres = floats(tensors, "bands.centres_hz", &[None])?;
    let band_count = centres.len();
    let bands = Bands::new(centres).ok_or_else(|| value("band centres", "at least 2, rising, in Hz", band_count))?;
    limit("bands", band_count, 2, MAX_BANDS)?;
    limit("taps", m.taps, 0, MAX_HOPS)?;
    let nodes = FieldGrid { position: m.position.map(Into::into), elevation: m.elevation.into(), azimuth: m.azimuth.into() };
    check_nodes(&nodes)?;
    let shape = TransferShape { bins: grid.bins(), bands: band_count, taps: m.taps };
    let rows = floats(tensors, "field.rows", &[Some(nodes.nodes()), Some(shape.row_len())])?;
    let field = Field::new(nodes, shape, Vec3::from_array(m.emitter), rows)
        .ok_or_else(|| value("field", "a row per node", "another number"))?;
    let positions = floats(tensors, "anchors.position", &[None, Some(3)])?;
    let colours = floats(tensors, "anchors.colour", &[Some(positions.len() / 3), Some(3)])?;
    let point = |v: &[f32]| Vec3::new(v[0], v[1], v[2]);
    let anchors = positions
        .chunks_exact(3)
        .zip(colours.chunks_exact(3))
        .map(|(p, c)| Anchor { position: point(p), colour: point(c) })
        .collect();
    let held_out = m
        .held_out
        .into_iter()
        .map(|h| HeldOut {
            name: h.name,
            pose: h.pose.into(),
            measured: Binaural { itd_s: h.itd_s, ild_db: h.ild_db, t20_s: h.t20_s, edt_s: h.edt_s, c50_db: h.c50_db },
        })
        .collect();
    Ok(SceneParts {
        provenance: Provenance { title: m.title, credit: m.credit, licence: m.licence, recipe: m.recipe, notes: m.notes },
        tail: TailModel {
            seed: m.seed,
            t60_s: floats(tensors, "tail.t60_s", &[Some(band_count)])?,
            coherence: floats(tensors, "tail.coherence", &[Some(band_count)])?,
        },
        grid,
        bands,
        field,
        top_hz: m.top_hz,
        start_pose: m.start.into(),
        anchors,
        held_out,
    })
}

/// A tensor of f32; `None` in the shape stands for any size.
fn floats(tensors: &SafeTensors<'_>, name: &'static str, shape: &[Option<usize>]) -> Result<Vec<f32>, SceneError> {
    let data = bytes_of(tensors, name, Dtype::F32, shape)?;
    Ok(data.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect())
}

fn bytes_of<'a>(
    tensors: &SafeTensors<'a>,
    name: &'static str,
    dtype: Dtype,
    shape: &[Option<usize>],
) -> Result<&'a [u8], SceneError> {
    let expected = || {
        let sizes: Vec<_> = shape.iter().map(|s| s.map_or("any".to_owned(), |n| n.to_string())).collect();
        format!("{dtype:?} [{}]", sizes.join(", "))
    };
    let Ok(view) = tensors.tensor(name) else {
        return Err(SceneError::Tensor { name, expected: expected(), found: "nothing".to_owned() });
    };
    let fits = view.shape().len() == shape.len()
        && view.shape().iter().zip(shape).all(|(found, want)| want.is_none_or(|w| w == *found));
    if view.dtype() != dtype || !fits {
        let found = format!("{:?} {:?}", view.dtype(), view.shape());
        return Err(SceneError::Tensor { name, expected: expected(), found });
    }
    Ok(view.data())
}

fn limit(what: &str, found: usize, low: usize, high: usize) -> Result<(), SceneError> {
    if (low..=high).contains(&found) { Ok(()) } else { Err(value(what, format!("{low} to {high}"), found)) }
}

fn check_grid(grid: &StftGrid) -> Result<(), SceneError> {
    let rate = grid.sample_rate_hz;
    if !(1_000.0..=768_000.0).contains(&rate) {
        return Err(value("sample rate", "1000 to 768000 Hz", rate));
    }
    limit("transform length", grid.n_fft, 4, 2 * (MAX_BINS - 1))?;
    limit("hop", grid.hop, 1, grid.n_fft / 2)?;
    if !grid.n_fft.is_multiple_of(2) {
        return Err(value("transform length", "an even number", grid.n_fft));
    }
    let latency = grid.n_fft as f64 / rate;
    if latency > 0.9 * LONGEST_LATENCY_S {
        return Err(value("window", format!("at most {} s", 0.9 * LONGEST_LATENCY_S), latency));
    }
    Ok(())
}

fn check_nodes(nodes: &FieldGrid) -> Result<(), SceneError> {
    let axes = [
        ("position x", &nodes.position[0]),
        ("position y", &nodes.position[1]),
        ("position z", &nodes.position[2]),
        ("elevation", &nodes.elevation),
        ("azimuth", &nodes.azimuth),
    ];
    let mut total = 1_usize;
    for (name, axis) in axes {
        limit(&format!("number of nodes along {name}"), axis.count, 1, MAX_NODES)?;
        total = total.saturating_mul(axis.count);
        if !(axis.start.is_finite() && axis.step.is_finite() && axis.step > 0.0) {
            return Err(value(&format!("axis {name}"), "a finite start and a step above 0", format!("{axis:?}")));
        }
    }
    limit("number of nodes", total, 1, MAX_NODES)
}

/// Everything that a scene promises about its numbers.
pub(super) fn check(parts: &SceneParts) -> Result<(), SceneError> {
    check_grid(&parts.grid)?;
    check_nodes(parts.field.grid())?;
    let shape = parts.field.shape();
    limit("bins", shape.bins, parts.grid.bins(), parts.grid.bins())?;
    limit("bands", shape.bands, parts.bands.count(), parts.bands.count())?;
    limit("taps", shape.taps, 0, MAX_HOPS)?;
    limit("anchors", parts.anchors.len(), 0, MAX_ANCHORS)?;
    limit("held-out measurements", parts.held_out.len(), 0, MAX_HELD_OUT)?;
    let tail = &parts.tail;
    for (name, len, want) in
        [("reverberation times", tail.t60_s.len(), shape.bands), ("coherences", tail.coherence.len(), shape.bands)]
    {
        limit(&format!("number of {name}"), len, want, want)?;
    }
    in_range("field", parts.field.rows(), -1e6, 1e6)?;
    in_range("reverberation time", &tail.t60_s, 1e-3, 1e3)?;
    in_range("coherence", &tail.coherence, -1.0, 1.0)?;
    in_range("highest frequency", &[parts.top_hz], 1.0, 1e6)?;
    in_range("emitter position", &parts.field.emitter().to_array(), -1e6, 1e6)?;
    for a in &parts.anchors {
        in_range("anchor position", &a.position.to_array(), -1e6, 1e6)?;
        in_range("anchor colour", &a.colour.to_array(), 0.0, 1.0)?;
    }
    let poses = parts.held_out.iter().map(|h| &h.pose).chain([&parts.start_pose]);
    for pose in poses {
        if !pose.is_valid() {
            return Err(value("pose", "finite with a unit quaternion", format!("{pose:?}")));
        }
    }
    Ok(())
}

fn in_range(what: &str, values: &[f32], low: f32, high: f32) -> Result<(), SceneError> {
    match values.iter().find(|v| !(low..=high).contains(*v)) {
        None => Ok(()),
        Some(found) => Err(value(what, format!("{low} to {high}"), found)),
    }
}
