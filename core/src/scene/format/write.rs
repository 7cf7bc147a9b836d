//! Scenes to bytes.

use super::{CHECKSUM, FIELD, FRONT, MANIFEST, ROOM, SITE, WEIGHTS, checksum};
use crate::Field;
use crate::decode::field::{Rows, mirrored};
use crate::head::HEAD_BANDS;
use crate::network::{CloudModel, Tensor};
use crate::number::single;
use crate::octave::OCTAVES;
use crate::scene::error::SceneError;
use crate::scene::manifest::{
    MAX_SCENE_BYTES, Manifest, ManifestBass, ManifestCloud, ManifestCorners, ManifestField, ManifestImages, VERSION,
};
use crate::scene::{
    AMBISONIC_CHANNELS, Anchor, BASS_SIGNALS, Corners, FrontPoint, ImageSources, MeasuredRoom, SceneParts, Site, Weather,
};
use glam::{Mat3, Vec3};
use half::f16;
use safetensors::tensor::{Dtype, TensorView};
use std::borrow::Cow;
use std::collections::HashMap;

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

/// The bytes of a file.
pub(in crate::scene) fn write(parts: &SceneParts) -> Result<Vec<u8>, SceneError> {
    let manifest = serde_json::to_string(&manifest_of(parts)).map_err(|e| SceneError::Manifest(e.to_string()))?;
    let entries = entries_of(parts);
    let size: usize = entries.iter().map(|e| size_of_val(&*e.values)).sum();
    if size > MAX_SCENE_BYTES {
        // What could not be read again is not written.
        return Err(SceneError::TooLarge { found: size });
    }
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

fn manifest_of(parts: &SceneParts) -> Manifest {
    Manifest {
        version: u64::from(VERSION),
        title: parts.provenance.title.clone(),
        credit: parts.provenance.credit.clone(),
        licence: parts.provenance.licence.clone(),
        recipe: parts.provenance.recipe.clone(),
        notes: parts.provenance.notes.clone(),
        grid: (&parts.grid).into(),
        seed: parts.tail.seed,
        noise_by_phase: parts.tail.by_phase,
        taps: parts.taps,
        refresh: (parts.refresh != 1).then_some(parts.refresh),
        decodes: (parts.decodes != usize::MAX).then_some(parts.decodes),
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
    }
}

/// All tensors but the checksum, by name.
fn entries_of(parts: &SceneParts) -> Vec<Entry<'_>> {
    let points = |f: fn(&Anchor) -> Vec3| parts.anchors.iter().flat_map(|a| f(a).to_array()).collect::<Vec<f32>>();
    let mut entries = vec![
        entry("anchors.colour", &[parts.anchors.len(), 3], points(|a| a.colour)),
        entry("anchors.position", &[parts.anchors.len(), 3], points(|a| a.position)),
        entry("bands.centres_hz", &[parts.bands.count()], parts.bands.centres_hz()),
        entry("tail.coherence", &[parts.tail.coherence.len()], &parts.tail.coherence),
        entry("tail.t60_s", &[parts.tail.t60_s.len()], &parts.tail.t60_s),
    ];
    if !parts.front.is_empty() {
        let numbers: Vec<f32> = parts.front.iter().flat_map(FrontPoint::numbers).collect();
        entries.push(entry(FRONT, &[parts.front.len(), FrontPoint::NUMBERS], numbers));
    }
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
    entries.sort_by(|a, b| a.name.cmp(&b.name));
    entries
}

fn field_entries<'a>(table: &str, field: &'a Field, entries: &mut Vec<Entry<'a>>) {
    let name = |part: &str| format!("{table}.{part}");
    let nodes = field.grid().nodes();
    match field.rows() {
        Rows::Whole(rows) => {
            let half = mirrored::half(field);
            let nodes = if half.is_some() { mirrored::half_nodes(field.grid()).unwrap_or(nodes) } else { nodes };
            let rows = entry(name("rows"), &[nodes, field.shape().row_len()], half.map_or(Cow::from(rows), Cow::from));
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
    if corners.edges.iter().any(|edge| edge.longer_m > 0.0) {
        let longer: Vec<f32> = corners.edges.iter().map(|edge| edge.longer_m).collect();
        entries.push(entry("corners.longer", &[corners.edges.len()], longer));
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
