//! The `.promenade` file: safetensors with a JSON manifest in its metadata.

use super::check::{MAX_BANDS, MAX_HOPS, MAX_IMAGES, MAX_SITES, check_grid, check_nodes, limit};
use super::error::{SceneError, value};
use super::manifest::{
    MAX_SCENE_BYTES, Manifest, ManifestBass, ManifestCloud, ManifestCorners, ManifestField, ManifestImages, VERSION,
};
use super::older::OlderRoom;
use super::{
    AMBISONIC_CHANNELS, AmbisonicHead, Anchor, AnchorCloud, BASS_SIGNALS, BassEars, BassField, Corners, DiffractionEdge,
    ImageSource, ImageSources, Lifted, MeasuredHead, MeasuredRoom, SceneParts, Site, TailModel, Weather,
};
use crate::decode::field::{Basis, LowRank, Rows, mirrored};
use crate::head::HEAD_BANDS;
use crate::network::{CloudModel, CloudParts, Tensor};
use crate::number::{single, whole};
use crate::octave::{OCTAVES, Octaves};
use crate::{Bands, Field, StftGrid, TransferShape};
use glam::{Mat3, Vec3};
use half::f16;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use std::borrow::Cow;
use std::collections::HashMap;

/// Key of the manifest in the container's metadata.
pub(super) const MANIFEST: &str = "promenade";
const CHECKSUM: &str = "crc32";
/// Names of the two tables of transfer functions.
const FIELD: &str = "field";
const ROOM: &str = "room";
/// Numbers of a site of a response: direction, position, number of the response.
const SITE: usize = 7;
/// Prefix of the anchor cloud's weights, before the published names.
const WEIGHTS: &str = "cloud.weights.";

/// A tensor to be written.
struct Entry<'a> {
    name: Cow<'static, str>,
    shape: Vec<usize>,
    values: Cow<'a, [f32]>,
    dtype: Dtype,
}

impl Entry<'_> {
    /// As half floats where they say the same: bakers round tables that need no more.
    fn halved(self) -> Self {
        let exact = self.values.iter().all(|v| f16::from_f32(*v).to_f32() == *v);
        Self { dtype: if exact { Dtype::F16 } else { Dtype::F32 }, ..self }
    }

    fn bytes(&self) -> Vec<u8> {
        match self.dtype {
            Dtype::F16 => self.values.iter().flat_map(|v| f16::from_f32(*v).to_le_bytes()).collect(),
            _ => self.values.iter().flat_map(|v| v.to_le_bytes()).collect(),
        }
    }
}

fn entry<'a>(name: impl Into<Cow<'static, str>>, shape: &[usize], values: impl Into<Cow<'a, [f32]>>) -> Entry<'a> {
    Entry { name: name.into(), shape: shape.to_vec(), values: values.into(), dtype: Dtype::F32 }
}

pub(super) fn write(parts: &SceneParts) -> Result<Vec<u8>, SceneError> {
    let manifest = Manifest {
        version: u64::from(VERSION),
        title: parts.provenance.title.clone(),
        credit: parts.provenance.credit.clone(),
        licence: parts.provenance.licence.clone(),
        recipe: parts.provenance.recipe.clone(),
        notes: parts.provenance.notes.clone(),
        grid: (&parts.grid).into(),
        seed: parts.tail.seed,
        taps: parts.taps,
        top_hz: parts.top_hz,
        start: (&parts.start_pose).into(),
        bounds: [parts.bounds.0.to_array(), parts.bounds.1.to_array()],
        weather: (parts.weather != Weather::default()).then(|| {
            let Weather { temperature_c, humidity_percent, pressure_kpa } = parts.weather;
            [temperature_c, humidity_percent, pressure_kpa]
        }),
        measured_hops: parts.measured.as_ref().map(|m| m.low_hops),
        measured_low_step: parts.measured.as_ref().map(|m| m.low_step),
        measured_lifted: parts.measured.as_ref().is_some_and(|m| m.lifted.is_some()),
        measured_head: parts.measured_head.as_ref().map(|h| h.name.clone()),
        field: parts.field.as_ref().map(ManifestField::of),
        room: parts.room.as_ref().map(ManifestField::of),
        images: parts.images.as_ref().map(ManifestImages::of),
        corners: parts.corners.as_ref().map(ManifestCorners::of),
        bass: parts.bass.as_ref().map(ManifestBass::of),
        cloud: parts.cloud.as_ref().map(ManifestCloud::of),
        held_out: parts.held_out.iter().map(Into::into).collect(),
    };
    let manifest = serde_json::to_string(&manifest).map_err(|e| SceneError::Manifest(e.to_string()))?;
    let points = |f: fn(&Anchor) -> Vec3| parts.anchors.iter().flat_map(|a| f(a).to_array()).collect::<Vec<f32>>();
    let mut entries = vec![
        entry("anchors.colour", &[parts.anchors.len(), 3], points(|a| a.colour)),
        entry("anchors.position", &[parts.anchors.len(), 3], points(|a| a.position)),
        entry("bands.centres_hz", &[parts.bands.count()], parts.bands.centres_hz()),
        entry("tail.coherence", &[parts.tail.coherence.len()], &parts.tail.coherence),
        entry("tail.t60_s", &[parts.tail.t60_s.len()], &parts.tail.t60_s),
    ];
    if let Some(measured) = &parts.measured {
        measured_entries(measured, parts, &mut entries);
    }
    if let Some(head) = &parts.measured_head {
        let [left, right] = &head.diffuse_db;
        entries.push(entry("measured.head", &[3, HEAD_BANDS], [head.around_db, *left, *right].concat()));
    }
    if let Some(field) = &parts.field {
        field_entries(FIELD, field, &mut entries);
    }
    if let Some(room) = &parts.room {
        field_entries(ROOM, room, &mut entries);
    }
    if let Some(images) = &parts.images {
        image_entries(images, &mut entries);
    }
    if let Some(corners) = &parts.corners {
        corner_entries(corners, &mut entries);
    }
    if let Some(bass) = &parts.bass {
        let shape = [bass.place_count(), BASS_SIGNALS, bass.len()];
        entries.push(entry("bass.responses", &shape, &bass.samples).halved());
    }
    if let Some(cloud) = &parts.cloud {
        cloud_entries(&cloud.model, &mut entries);
    }
    let size: usize = entries.iter().map(|e| size_of_val(&*e.values)).sum();
    if size > MAX_SCENE_BYTES {
        // What could not be read again is not written.
        return Err(SceneError::TooLarge { found: size });
    }
    entries.sort_by(|a, b| a.name.cmp(&b.name));
    let bytes: Vec<Vec<u8>> = entries.iter().map(Entry::bytes).collect();
    let mut views = entries
        .iter()
        .zip(&bytes)
        .map(|(e, data)| TensorView::new(e.dtype, e.shape.clone(), data).map(|view| (&*e.name, view)))
        .collect::<Result<Vec<_>, _>>()
        .map_err(|e| SceneError::Container(e.to_string()))?;
    let crc = checksum(&manifest, views.iter().map(|(name, view)| (*name, view))).to_le_bytes();
    let view = TensorView::new(Dtype::U32, vec![1], &crc).map_err(|e| SceneError::Container(e.to_string()))?;
    views.push((CHECKSUM, view));
    // One entry only: the container writes several in a random order, and the same scene must make the same bytes.
    let metadata = HashMap::from([(MANIFEST.to_owned(), manifest)]);
    safetensors::serialize(views, Some(metadata)).map_err(|e| SceneError::Container(e.to_string()))
}

fn field_entries<'a>(table: &str, field: &'a Field, entries: &mut Vec<Entry<'a>>) {
    let name = |part: &str| format!("{table}.{part}");
    let nodes = field.grid().nodes();
    match field.rows() {
        Rows::Whole(rows) => {
            let half = mirrored::half(field);
            let nodes = if half.is_some() { mirrored::half_nodes(field.grid()).unwrap_or(nodes) } else { nodes };
            let rows = entry(name("rows"), &[nodes, field.shape().row_len()], half.map_or(Cow::from(rows), Cow::from));
            // Fields that hold everything keep the form that older versions read.
            let shape = field.shape();
            entries.push(if shape.taps == 0 || shape.bins == 0 { rows.halved() } else { rows });
        }
        Rows::LowRank(low) => {
            let ranks = [low.levels.rank(), low.taps.rank()];
            let [levels, taps] = [low.levels.mean.len(), low.taps.mean.len()];
            let parts = [
                entry(name("coefficients"), &[nodes, ranks[0] + ranks[1]], &low.coefficients),
                entry(name("levels.mean"), &[levels], &low.levels.mean),
                entry(name("levels.shapes"), &[ranks[0], levels], &low.levels.shapes),
                entry(name("taps.mean"), &[taps], &low.taps.mean),
                entry(name("taps.shapes"), &[ranks[1], taps], &low.taps.shapes),
            ];
            // Tables of a scene's first form keep whole floats.
            entries.extend(parts.into_iter().map(|part| if levels == 0 { part.halved() } else { part }));
        }
    }
}

fn measured_entries<'a>(measured: &'a MeasuredRoom, parts: &SceneParts, entries: &mut Vec<Entry<'a>>) {
    let (bands, count) = (parts.bands.count(), measured.count(&parts.bands));
    // A number of a response is exact as f32 up to 2^24.
    let site =
        |s: &Site| [s.direction.to_array(), s.position.to_array()].concat().into_iter().chain([single(s.response.into())]);
    let sites: Vec<f32> = measured.sites.iter().flat_map(site).collect();
    let low = measured.low.len() / (2 * count).max(1);
    entries.push(entry("measured.sites", &[measured.sites.len(), SITE], sites));
    entries.push(entry("measured.responses", &[count, 2, (parts.taps + 1) * parts.grid.hop], &measured.samples).halved());
    entries.push(entry("measured.low", &[count, 2, low], &measured.low).halved());
    entries.push(entry("measured.late", &[count, 2, bands], &measured.late));
    entries.push(entry("measured.late_before", &[measured.late_before.len() / (2 * bands), 2, bands], &measured.late_before));
    entries.push(entry("measured.gains", &[2, bands], &measured.gains));
    if let Some(lifted) = &measured.lifted {
        let places: Vec<f32> = lifted.places.iter().flat_map(Vec3::to_array).collect();
        entries
            .push(entry("measured.lifted", &[count, 2, lifted.samples.len() / (2 * count).max(1)], &lifted.samples).halved());
        entries.push(entry("measured.places", &[lifted.places.len(), 3], places));
    }
}

fn image_entries<'a>(images: &'a ImageSources, entries: &mut Vec<Entry<'a>>) {
    let (count, places) = (images.images.len(), images.place_count());
    let positions: Vec<f32> = images.images.iter().flat_map(|i| i.position.to_array()).collect();
    let gains: Vec<f32> = images.images.iter().flat_map(|i| i.gains).collect();
    if images.images.iter().any(|image| image.gain_63 != image.gains[0]) {
        let low: Vec<f32> = images.images.iter().map(|image| image.gain_63).collect();
        entries.push(entry("images.bass", &[count], low));
    }
    entries.push(entry("images.direct", &[places], &images.direct));
    entries.push(entry("images.gains", &[count, OCTAVES], gains));
    entries.push(entry("images.head", &[AMBISONIC_CHANNELS, 2, images.head.len()], &images.head.filters));
    entries.push(entry("images.position", &[count, 3], positions));
    entries.push(entry("images.seen", &[places, count], &images.seen));
    if let Some(room) = &images.turning {
        let mirrors: Vec<f32> = room.mirrors.iter().flat_map(Vec3::to_array).collect();
        entries.push(entry("images.mirrors", &[count, 3], mirrors).halved());
    }
    if let Some(emission) = &images.emission {
        let turns: Vec<f32> = emission.turns.iter().flat_map(Mat3::to_cols_array).collect();
        entries.push(entry("images.emission", &[emission.levels.len(), OCTAVES], emission.levels.as_flattened()).halved());
        entries.push(entry("images.turns", &[count, 3, 3], turns));
    }
}

fn corner_entries<'a>(corners: &'a Corners, entries: &mut Vec<Entry<'a>>) {
    let places = corners.place_count();
    let ends: Vec<f32> = corners.edges.iter().flat_map(|edge| edge.ends).flat_map(|end| end.to_array()).collect();
    let gains: Vec<f32> = corners.edges.iter().flat_map(|edge| edge.gains).collect();
    entries.push(entry("corners.direct", &[places], &corners.direct).halved());
    entries.push(entry("corners.edges", &[corners.edges.len(), 2, 3], ends));
    entries.push(entry("corners.gains", &[corners.edges.len(), OCTAVES], gains));
    // Half precision counts to 2048.
    let numbers = |entry: Entry<'a>| if corners.edges.len() <= 2048 { entry.halved() } else { entry };
    entries.push(numbers(entry("corners.round", &[places], &corners.round)));
    if !corners.seen.is_empty() {
        entries.push(entry("corners.seen", &[places], &corners.seen));
    }
    let from: Vec<f32> = corners.edges.iter().filter_map(|edge| edge.from).flat_map(|from| from.to_array()).collect();
    if !from.is_empty() {
        entries.push(entry("corners.from", &[from.len() / 3, 3], from));
    }
    if !corners.images.is_empty() {
        let tables = corners.images.len() / places.max(1);
        entries.push(numbers(entry("corners.images", &[tables, places], &corners.images)));
    }
}

fn cloud_entries<'a>(cloud: &'a CloudModel, entries: &mut Vec<Entry<'a>>) {
    let parts = cloud.parts();
    let (n, features) = (parts.anchors.len(), cloud.sizes().features);
    let anchors: Vec<f32> = parts.anchors.iter().flat_map(Vec3::to_array).collect();
    entries.push(entry("cloud.anchors", &[n, 3], anchors));
    entries.push(entry("cloud.features", &[n, features], &parts.features));
    entries.push(entry("cloud.frequencies_hz", &[parts.frequencies.count()], parts.frequencies.centres_hz()));
    let weight = |(name, t): (&String, &'a Tensor)| Entry {
        name: format!("{WEIGHTS}{name}").into(),
        shape: t.shape.clone(),
        values: (&t.values).into(),
        dtype: Dtype::F32,
    };
    entries.extend(parts.weights.iter().map(weight));
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
    let m = manifest(text)?;
    let stored = bytes_of(&tensors, CHECKSUM, Dtype::U32, &[Some(1)])?;
    let expected = stored.as_chunks::<4>().0.first().map_or(0, |b| u32::from_le_bytes(*b));
    let all = tensors.tensors();
    let found = checksum(text, all.iter().map(|(name, view)| (name.as_str(), view)).filter(|(name, _)| *name != CHECKSUM));
    if found != expected {
        return Err(SceneError::Checksum { expected, found });
    }
    from_manifest(m, &tensors)
}

/// The manifest in a text.
pub(super) fn manifest(text: &str) -> Result<Manifest, SceneError> {
    // The version comes first: a manifest of another version may have other fields.
    let loose: serde_json::Value = serde_json::from_str(text).map_err(|e| SceneError::Manifest(e.to_string()))?;
    match loose.get("version").and_then(serde_json::Value::as_u64) {
        Some(found) if found == u64::from(VERSION) => {}
        Some(found) => return Err(SceneError::Version { found }),
        None => return Err(SceneError::Manifest("no version number".to_owned())),
    }
    serde_json::from_value(loose).map_err(|e| SceneError::Manifest(e.to_string()))
}

fn from_manifest(m: Manifest, tensors: &SafeTensors<'_>) -> Result<SceneParts, SceneError> {
    let grid = StftGrid::from(&m.grid);
    check_grid(&grid)?;
    let centres = floats(tensors, "bands.centres_hz", &[None])?;
    let band_count = centres.len();
    limit("bands", band_count, 2, MAX_BANDS)?;
    limit("taps", m.taps, 0, MAX_HOPS)?;
    let shape = TransferShape { bins: grid.bins(), bands: band_count, taps: m.taps };
    let field_taps = if m.room.is_some() || m.measured_low_step.is_some() { 0 } else { m.taps };
    let positions = floats(tensors, "anchors.position", &[None, Some(3)])?;
    let colours = floats(tensors, "anchors.colour", &[Some(positions.len() / 3), Some(3)])?;
    let anchors = positions
        .chunks_exact(3)
        .zip(colours.chunks_exact(3))
        .map(|(p, c)| Anchor { position: Vec3::from_slice(p), colour: Vec3::from_slice(c) })
        .collect();
    let provenance = m.provenance();
    let bands = rising(centres, "band centres")?;
    let mut field = m.field.map(|f| read_field(FIELD, f, TransferShape { taps: field_taps, ..shape }, tensors)).transpose()?;
    let mut measured = match (m.measured_hops, m.measured_low_step) {
        (Some(hops), Some(step)) => Some(read_measured(hops, step, m.taps, &bands, &grid, tensors)?),
        (Some(hops), None) => {
            let (measured, direct) = read_older(hops, field.take(), &bands, &grid, tensors)?;
            field = Some(direct);
            Some(measured)
        }
        (None, _) => None,
    };
    if let Some(measured) = measured.as_mut().filter(|_| m.measured_lifted) {
        measured.lifted = Some(read_lifted(measured.count(&bands), tensors)?);
    }
    Ok(SceneParts {
        provenance,
        tail: TailModel {
            seed: m.seed,
            t60_s: floats(tensors, "tail.t60_s", &[Some(band_count)])?,
            coherence: floats(tensors, "tail.coherence", &[Some(band_count)])?,
        },
        grid,
        bands,
        taps: m.taps,
        top_hz: m.top_hz,
        start_pose: (&m.start).into(),
        bounds: (m.bounds[0].into(), m.bounds[1].into()),
        weather: m.weather.map_or_else(Weather::default, |[temperature_c, humidity_percent, pressure_kpa]| Weather {
            temperature_c,
            humidity_percent,
            pressure_kpa,
        }),
        anchors,
        held_out: m.held_out.iter().map(Into::into).collect(),
        measured_head: m.measured_head.map(|name| read_head(name, tensors)).transpose()?,
        field,
        room: m.room.map(|f| read_field(ROOM, f, TransferShape { bins: 0, ..shape }, tensors)).transpose()?,
        images: m.images.map(|i| read_images(i, tensors)).transpose()?,
        corners: m.corners.map(|c| read_corners(c, tensors)).transpose()?,
        bass: m.bass.map(|b| read_bass(b, tensors)).transpose()?,
        measured,
        cloud: m.cloud.map(|c| read_cloud(&c, tensors)).transpose()?,
    })
}

fn rising(centres: Vec<f32>, what: &str) -> Result<Bands, SceneError> {
    let count = centres.len();
    Bands::new(centres).ok_or_else(|| value(what, "at least 2, rising, in Hz", count))
}

fn read_field(table: &str, m: ManifestField, shape: TransferShape, tensors: &SafeTensors<'_>) -> Result<Field, SceneError> {
    let (low_rank, is_mirrored) = (m.low_rank, m.mirrored);
    let grid =
        m.grid().ok_or_else(|| value(&format!("axis of the {table}"), "rising positions, angles within one turn", "others"))?;
    let name = |part: &str| format!("{table}.{part}");
    check_nodes(&grid)?;
    let nodes = grid.nodes();
    let rows = if low_rank {
        let basis = |mean: &str, shapes: &str, len: usize| -> Result<Basis, SceneError> {
            let mean = floats(tensors, mean, &[Some(len)])?;
            Ok(Basis { mean, shapes: floats(tensors, shapes, &[None, Some(len)])? })
        };
        let levels = basis(&name("levels.mean"), &name("levels.shapes"), 2 * shape.bins)?;
        let taps = basis(&name("taps.mean"), &name("taps.shapes"), shape.tap_len() * (shape.taps + 1))?;
        let coefficients = floats(tensors, &name("coefficients"), &[Some(nodes), Some(levels.rank() + taps.rank())])?;
        Rows::LowRank(LowRank { levels, taps, coefficients })
    } else if is_mirrored {
        let none = || value(&format!("azimuths of the {table}"), "an even circle from behind, of a mirrored table", "others");
        let nodes = mirrored::half_nodes(&grid).ok_or_else(none)?;
        let half = floats(tensors, &name("rows"), &[Some(nodes), Some(shape.row_len())])?;
        Rows::Whole(mirrored::whole(&half, &grid, shape).ok_or_else(none)?)
    } else {
        Rows::Whole(floats(tensors, &name("rows"), &[Some(nodes), Some(shape.row_len())])?)
    };
    Field::new(grid, shape, rows).ok_or_else(|| value(table, "a row per node", "another number"))
}

fn read_images(mut m: ManifestImages, tensors: &SafeTensors<'_>) -> Result<ImageSources, SceneError> {
    let gains = floats(tensors, "images.gains", &[None, Some(OCTAVES)])?;
    let count = gains.len() / OCTAVES;
    limit("number of images", count, 1, MAX_IMAGES)?;
    let position = floats(tensors, "images.position", &[Some(count), Some(3)])?;
    let gains = gains.as_chunks::<7>().0;
    let image = |(p, gains): (&[f32], &Octaves)| ImageSource::new(Vec3::from_slice(p), *gains);
    let mut images: Vec<ImageSource> = position.chunks_exact(3).zip(gains).map(image).collect();
    if tensors.tensor("images.bass").is_ok() {
        let low = floats(tensors, "images.bass", &[Some(count)])?;
        images.iter_mut().zip(low).for_each(|(image, low)| image.gain_63 = low);
    }
    let (air_db_per_m, sample_rate_hz, lead) = (m.air_db_per_m, m.head_rate_hz, m.head_lead);
    let mut turning = m.turning();
    if let Some(room) = &mut turning {
        let mirrors = floats(tensors, "images.mirrors", &[Some(count), Some(3)])?;
        room.mirrors = mirrors.chunks_exact(3).map(Vec3::from_slice).collect();
    }
    let rising = || value("axis of the emitter's directions", "rising angles within one turn", "others");
    let mut emission = m.emission().ok_or_else(rising)?;
    if let Some(emission) = &mut emission {
        let levels = floats(tensors, "images.emission", &[None, Some(OCTAVES)])?;
        emission.levels = levels.as_chunks::<OCTAVES>().0.to_vec();
        let turns = floats(tensors, "images.turns", &[Some(count), Some(3), Some(3)])?;
        emission.turns = turns.as_chunks::<9>().0.iter().map(Mat3::from_cols_array).collect();
    }
    let filters = floats(tensors, "images.head", &[Some(AMBISONIC_CHANNELS), Some(2), None])?;
    let places = m.places.axes().ok_or_else(|| value("axis of the images' places", "rising positions", "others"))?;
    let place_count = places.iter().fold(1_usize, |total, axis| total.saturating_mul(axis.count()));
    let seen = floats(tensors, "images.seen", &[Some(place_count), Some(count)])?;
    let direct = floats(tensors, "images.direct", &[Some(place_count)])?;
    let head = AmbisonicHead { sample_rate_hz, lead, filters };
    Ok(ImageSources { images, air_db_per_m, places, seen, direct, head, turning, emission })
}

fn read_corners(m: ManifestCorners, tensors: &SafeTensors<'_>) -> Result<Corners, SceneError> {
    let places = m.places.axes().ok_or_else(|| value("axis of the places of corners", "rising positions", "others"))?;
    let count = places.iter().fold(1_usize, |total, axis| total.saturating_mul(axis.count()));
    let direct = floats(tensors, "corners.direct", &[Some(count)])?;
    let round = floats(tensors, "corners.round", &[Some(count)])?;
    let ends = floats(tensors, "corners.edges", &[None, Some(2), Some(3)])?;
    let ends = ends.as_chunks::<6>().0;
    let gains = floats(tensors, "corners.gains", &[Some(ends.len()), Some(OCTAVES)])?;
    // Either may be absent.
    let some = |name: &str, shape: &[Option<usize>]| match tensors.tensor(name) {
        Ok(_) => floats(tensors, name, shape),
        Err(_) => Ok(Vec::new()),
    };
    let images = some("corners.images", &[None, Some(count)])?;
    let seen = some("corners.seen", &[Some(count)])?;
    let from = some("corners.from", &[None, Some(3)])?;
    let from: Vec<Vec3> = from.as_chunks::<3>().0.iter().map(|from| Vec3::from_array(*from)).collect();
    let of_emitter = ends.len().saturating_sub(from.len());
    let edge = |(number, (ends, gains)): (usize, (&[f32; 6], &Octaves))| DiffractionEdge {
        ends: [Vec3::from_slice(&ends[..3]), Vec3::from_slice(&ends[3..])],
        gains: *gains,
        from: number.checked_sub(of_emitter).and_then(|place| from.get(place).copied()),
    };
    let edges = ends.iter().zip(gains.as_chunks::<OCTAVES>().0).enumerate().map(edge).collect();
    Ok(Corners { places, direct, round, images, seen, edges })
}

fn read_bass(m: ManifestBass, tensors: &SafeTensors<'_>) -> Result<BassField, SceneError> {
    let (crossover_hz, rate_hz, direct) = (m.crossover_hz, m.rate_hz, m.direct);
    let places = m.places.axes().ok_or_else(|| value("axis of the places of the bass", "rising positions", "others"))?;
    let count = places.iter().fold(1_usize, |total, axis| total.saturating_mul(axis.count()));
    let samples = floats(tensors, "bass.responses", &[Some(count), Some(BASS_SIGNALS), None])?;
    Ok(BassField { crossover_hz, rate_hz, places, direct, samples, ears: BassEars::Head })
}

fn read_measured(
    low_hops: usize,
    low_step: usize,
    taps: usize,
    bands: &Bands,
    grid: &StftGrid,
    tensors: &SafeTensors<'_>,
) -> Result<MeasuredRoom, SceneError> {
    limit("hops of the responses", low_hops, 1, MAX_HOPS)?;
    limit("step of the responses' bass", low_step, 1, grid.hop)?;
    let of_ears = Some(bands.count());
    let late = floats(tensors, "measured.late", &[None, Some(2), of_ears])?;
    let count = late.len() / (2 * bands.count());
    let sites = floats(tensors, "measured.sites", &[None, Some(SITE)])?;
    limit("sites of responses", sites.len() / SITE, 1, MAX_SITES)?;
    let site = |s: &[f32]| Site {
        direction: Vec3::from_slice(s),
        position: Vec3::from_slice(&s[3..]),
        response: u32::try_from(whole(s[6].into())).unwrap_or(u32::MAX),
    };
    let low = Some(MeasuredRoom::low_len(low_hops, grid, low_step));
    Ok(MeasuredRoom {
        sites: sites.chunks_exact(SITE).map(site).collect(),
        samples: floats(tensors, "measured.responses", &[Some(count), Some(2), Some((taps + 1) * grid.hop)])?,
        low: floats(tensors, "measured.low", &[Some(count), Some(2), low])?,
        low_step,
        low_hops,
        late,
        late_before: floats(tensors, "measured.late_before", &[None, Some(2), of_ears])?,
        gains: floats(tensors, "measured.gains", &[Some(2), of_ears])?,
        lifted: None,
    })
}

fn read_lifted(responses: usize, tensors: &SafeTensors<'_>) -> Result<Lifted, SceneError> {
    let places = floats(tensors, "measured.places", &[None, Some(3)])?;
    limit("places of responses", places.len() / 3, 1, MAX_SITES)?;
    Ok(Lifted {
        places: places.chunks_exact(3).map(Vec3::from_slice).collect(),
        samples: floats(tensors, "measured.lifted", &[Some(responses), Some(2), None])?,
    })
}

/// Measurements of a file whose field says at each node which of them are heard there, and the field without that.
fn read_older(
    hops: usize,
    field: Option<Field>,
    bands: &Bands,
    grid: &StftGrid,
    tensors: &SafeTensors<'_>,
) -> Result<(MeasuredRoom, Field), SceneError> {
    let wrong = || value("responses", "with shares of them at the nodes of a field", "others");
    let field = field.ok_or_else(wrong)?;
    limit("hops of the responses", hops, field.shape().taps + 1, MAX_HOPS)?;
    let nodes = field.grid().nodes();
    let shares = floats(tensors, "field.shares", &[Some(nodes), None])?;
    let room = OlderRoom {
        samples: floats(tensors, "measured.responses", &[None, Some(2), Some(hops * grid.hop)])?,
        hops,
        responses: floats(tensors, "field.responses", &[Some(nodes), Some(shares.len() / nodes)])?,
        shares,
    };
    room.converted(&field, bands, grid).ok_or_else(wrong)
}

fn read_head(name: String, tensors: &SafeTensors<'_>) -> Result<MeasuredHead, SceneError> {
    let levels = floats(tensors, "measured.head", &[Some(3), Some(HEAD_BANDS)])?;
    let row = |i: usize| std::array::from_fn(|band| levels[i * HEAD_BANDS + band]);
    Ok(MeasuredHead { name, around_db: row(0), diffuse_db: [row(1), row(2)] })
}

fn read_cloud(m: &ManifestCloud, tensors: &SafeTensors<'_>) -> Result<AnchorCloud, SceneError> {
    let named = |what: &str| SceneError::Manifest(format!("an anchor cloud of an unknown {what}"));
    let anchors = floats(tensors, "cloud.anchors", &[None, Some(3)])?;
    let mut weights = std::collections::BTreeMap::new();
    for name in tensors.names() {
        if let Some(published) = name.strip_prefix(WEIGHTS) {
            let shape = tensors.tensor(name).map(|t| t.shape().to_vec()).unwrap_or_default();
            let any: Vec<_> = shape.iter().map(|_| None).collect();
            weights.insert(published.to_owned(), Tensor { values: floats(tensors, name, &any)?, shape });
        }
    }
    let model = CloudModel::new(CloudParts {
        kind: m.kind().ok_or_else(|| named("kind"))?,
        heads: m.heads,
        max_norm: m.max_norm,
        convention: m.convention().ok_or_else(|| named("pose convention"))?,
        placement: m.placement(),
        frequencies: rising(floats(tensors, "cloud.frequencies_hz", &[None])?, "frequencies of the anchor cloud")?,
        features: floats(tensors, "cloud.features", &[Some(anchors.len() / 3), None])?,
        anchors: anchors.chunks_exact(3).map(Vec3::from_slice).collect(),
        weights,
    })?;
    let conv = m.conv().ok_or_else(|| named("use of its convolution layers"))?;
    Ok(AnchorCloud { model, conv, projection: m.projection(), emitter: m.emitter() })
}

/// A tensor of f32; `None` in the shape stands for any size.
fn floats(tensors: &SafeTensors<'_>, name: &str, shape: &[Option<usize>]) -> Result<Vec<f32>, SceneError> {
    if tensors.tensor(name).is_ok_and(|view| view.dtype() == Dtype::F16) {
        let data = bytes_of(tensors, name, Dtype::F16, shape)?;
        return Ok(data.as_chunks::<2>().0.iter().map(|b| f16::from_le_bytes(*b).to_f32()).collect());
    }
    let data = bytes_of(tensors, name, Dtype::F32, shape)?;
    Ok(data.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect())
}

fn bytes_of<'a>(tensors: &SafeTensors<'a>, name: &str, dtype: Dtype, shape: &[Option<usize>]) -> Result<&'a [u8], SceneError> {
    let expected = || {
        let sizes: Vec<_> = shape.iter().map(|s| s.map_or("any".to_owned(), |n| n.to_string())).collect();
        format!("{dtype:?} [{}]", sizes.join(", "))
    };
    let Ok(view) = tensors.tensor(name) else {
        return Err(SceneError::Tensor { name: name.to_owned(), expected: expected(), found: "nothing".to_owned() });
    };
    let fits = view.shape().len() == shape.len()
        && view.shape().iter().zip(shape).all(|(found, want)| want.is_none_or(|w| w == *found));
    if view.dtype() != dtype || !fits {
        let found = format!("{:?} {:?}", view.dtype(), view.shape());
        return Err(SceneError::Tensor { name: name.to_owned(), expected: expected(), found });
    }
    Ok(view.data())
}
