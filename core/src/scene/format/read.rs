//! Bytes to scenes.

use super::{CHECKSUM, FIELD, FRONT, MANIFEST, ROOM, SITE, WEIGHTS, checksum};
use crate::decode::field::{Basis, LowRank, Rows, mirrored};
use crate::head::HEAD_BANDS;
use crate::network::{CloudModel, CloudParts, Tensor};
use crate::number::whole;
use crate::octave::{OCTAVES, Octaves};
use crate::scene::check::{MAX_BANDS, MAX_HOPS, MAX_IMAGES, MAX_SITES, check_grid, check_nodes, limit};
use crate::scene::error::{SceneError, value};
use crate::scene::manifest::{
    MAX_SCENE_BYTES, Manifest, ManifestBass, ManifestCloud, ManifestCorners, ManifestField, ManifestImages, VERSION,
};
use crate::scene::{
    AMBISONIC_CHANNELS, AmbisonicHead, Anchor, AnchorCloud, BASS_SIGNALS, BassEars, BassField, Corners, DiffractionEdge,
    FrontPoint, ImageSource, ImageSources, Lifted, Measure, MeasuredHead, MeasuredRoom, SceneParts, Site, TailModel, Weather,
};
use crate::{Bands, Field, StftGrid, TransferShape};
use glam::{Mat3, Vec3};
use half::f16;
use safetensors::tensor::{Dtype, SafeTensors};

pub(in crate::scene) fn read(bytes: &[u8]) -> Result<SceneParts, SceneError> {
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
pub(in crate::scene) fn manifest(text: &str) -> Result<Manifest, SceneError> {
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
    let provenance = m.provenance();
    let bands = rising(centres, "band centres")?;
    let field = m.field.map(|f| read_field(FIELD, f, TransferShape { taps: field_taps, ..shape }, tensors)).transpose()?;
    let mut measured = match (m.measured_hops, m.measured_low_step) {
        (Some(hops), Some(step)) => Some(read_measured(hops, step, m.taps, &bands, &grid, tensors)?),
        (Some(_), None) => return Err(value("measured_low_step", "the step of the responses' bass", "none: an older scene")),
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
            by_phase: m.noise_by_phase,
        },
        grid,
        bands,
        front: read_front(tensors)?,
        taps: m.taps,
        refresh: m.refresh.unwrap_or(1),
        decodes: m.decodes.unwrap_or(usize::MAX),
        top_hz: m.top_hz,
        start_pose: (&m.start).into(),
        bounds: (m.bounds[0].into(), m.bounds[1].into()),
        weather: m.weather.map_or_else(Weather::default, |[temperature_c, humidity_percent, pressure_kpa]| Weather {
            temperature_c,
            humidity_percent,
            pressure_kpa,
        }),
        anchors: read_anchors(tensors)?,
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

fn read_front(tensors: &SafeTensors<'_>) -> Result<Vec<FrontPoint>, SceneError> {
    if tensors.tensor(FRONT).is_err() {
        return Ok(Vec::new());
    }
    let values = floats(tensors, FRONT, &[None, Some(FrontPoint::NUMBERS)])?;
    let none = || value("measure of the front", format!("0 to {}", Measure::ALL.len() - 1), "another");
    values.as_chunks().0.iter().map(|numbers| FrontPoint::of_numbers(numbers).ok_or_else(none)).collect()
}

fn read_anchors(tensors: &SafeTensors<'_>) -> Result<Vec<Anchor>, SceneError> {
    let positions = floats(tensors, "anchors.position", &[None, Some(3)])?;
    let colours = floats(tensors, "anchors.colour", &[Some(positions.len() / 3), Some(3)])?;
    let points = positions.chunks_exact(3).zip(colours.chunks_exact(3));
    Ok(points.map(|(p, c)| Anchor { position: Vec3::from_slice(p), colour: Vec3::from_slice(c) }).collect())
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
    // Each may be absent.
    let some = |name: &str, shape: &[Option<usize>]| match tensors.tensor(name) {
        Ok(_) => floats(tensors, name, shape),
        Err(_) => Ok(Vec::new()),
    };
    let images = some("corners.images", &[None, Some(count)])?;
    let seen = some("corners.seen", &[Some(count)])?;
    let from = some("corners.from", &[None, Some(3)])?;
    let from: Vec<Vec3> = from.as_chunks::<3>().0.iter().map(|from| Vec3::from_array(*from)).collect();
    let longer = some("corners.longer", &[Some(ends.len())])?;
    let of_emitter = ends.len().saturating_sub(from.len());
    let edge = |(number, (ends, gains)): (usize, (&[f32; 6], &Octaves))| DiffractionEdge {
        ends: [Vec3::from_slice(&ends[..3]), Vec3::from_slice(&ends[3..])],
        gains: *gains,
        from: number.checked_sub(of_emitter).and_then(|place| from.get(place).copied()),
        longer_m: longer.get(number).copied().unwrap_or_default(),
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
