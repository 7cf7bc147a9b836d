//! What a scene promises about its numbers.

use super::cost::Cost;
use super::error::{SceneError, value};
use super::{
    AMBISONIC_CHANNELS, AnchorCloud, BASS_SIGNALS, BassField, Corners, DiffractionEdge, Emission, ImageSources, MeasuredRoom,
    SceneParts, TurningRoom, Weather,
};
use crate::decode::TURNS;
use crate::decode::field::{Field, FieldGrid};
use crate::grid::LONGEST_LATENCY_S;
use crate::number::{single, whole};
use crate::published::{ConvMode, Projection};
use crate::{StftGrid, TransferShape};
use glam::Vec3;

/// The largest numbers of things in a scene, checked before anything is allocated for them.
const MAX_NODES: usize = 1 << 22;
const MAX_FRONT: usize = 1024;
const MAX_ANCHORS: usize = 65_536;
const MAX_BINS: usize = 1 << 15;
pub(super) const MAX_BANDS: usize = 512;
pub(super) const MAX_HOPS: usize = 4096;
const MAX_HELD_OUT: usize = 65_536;
pub(super) const MAX_SITES: usize = 65_536;
pub(super) const MAX_IMAGES: usize = 1024;
/// How far images may be from the emitter, metres: the delay line is as long as that.
const FARTHEST_IMAGE_M: f32 = 200.0;
/// Edges that are heard round.
const MAX_EDGES: usize = 4096;
/// The largest number by which a place says which images it sees.
const MOST_SEEN: f32 = ((1_u32 << (Corners::MOST_SEEN + 1)) - 1) as f32;
/// Tables of edges that images are heard round, at most.
const MAX_BENT: usize = 8;
/// Where waves may end, Hz, and how long they sound, seconds.
const CROSSOVERS_HZ: (f64, f64) = (20.0, 1_000.0);
const LONGEST_BASS_S: f64 = 20.0;
/// The longest filters of a head, seconds.
const LONGEST_HEAD_S: f64 = 0.1;

pub(super) fn limit(what: &str, found: usize, low: usize, high: usize) -> Result<(), SceneError> {
    if (low..=high).contains(&found) { Ok(()) } else { Err(value(what, format!("{low} to {high}"), found)) }
}

pub(super) fn check_grid(grid: &StftGrid) -> Result<(), SceneError> {
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

pub(super) fn check_nodes(nodes: &FieldGrid) -> Result<(), SceneError> {
    let total = nodes.axes().iter().fold(1_usize, |total, axis| total.saturating_mul(axis.count()));
    limit("number of nodes", total, 1, MAX_NODES)
}

fn check_field(field: &Field, shape: TransferShape) -> Result<(), SceneError> {
    check_nodes(field.grid())?;
    let found = field.shape();
    if found != shape {
        return Err(value("shape of the field", format!("{shape:?}"), format!("{found:?}")));
    }
    for values in field.rows().values() {
        in_range("field", values, -1e6, 1e6)?;
    }
    field.emitter().map_or(Ok(()), |e| in_range("emitter position", &e.to_array(), -1e6, 1e6))
}

fn check_room(room: &Field, parts: &SceneParts, shape: TransferShape) -> Result<(), SceneError> {
    if parts.field.is_none() || parts.measured.is_some() {
        return Err(value("room of its own", "beside a field, without measured responses", "another scene"));
    }
    check_field(room, TransferShape { bins: 0, ..shape })
}

fn check_measured(measured: &MeasuredRoom, parts: &SceneParts) -> Result<(), SceneError> {
    let (grid, taps, bands) = (&parts.grid, parts.taps, parts.bands.count());
    parts.field.as_ref().and_then(Field::emitter).ok_or_else(|| value("responses", "with an emitter", "none"))?;
    limit("hops of the responses", measured.low_hops, taps + 1, MAX_HOPS)?;
    limit("sites of responses", measured.sites.len(), 1, MAX_SITES)?;
    let count = measured.late.len() / (2 * bands);
    limit("responses", count, 1, measured.sites.len())?;
    let step = measured.low_step;
    limit("step of the responses' bass", step, 1, grid.hop)?;
    let fits = |what: &str, found: usize, wanted: usize| limit(what, found, wanted, wanted);
    fits("gains of the responses' late part", measured.late.len(), 2 * bands * count)?;
    fits("gains of the responses", measured.gains.len(), 2 * bands)?;
    fits("samples of the responses", measured.samples.len(), 2 * count * (taps + 1) * grid.hop)?;
    let low = MeasuredRoom::low_len(measured.low_hops, grid, step);
    fits("samples of the responses' bass", measured.low.len(), 2 * count * low)?;
    let before = measured.late_before.len() / (2 * bands);
    limit("taps that the late part begins before", before, 0, taps)?;
    fits("energies of the late part", measured.late_before.len(), 2 * bands * before)?;
    for site in &measured.sites {
        limit("number of a response", whole(site.response.into()), 0, count - 1)?;
        in_range("length of a direction", &[site.direction.length()], 0.99, 1.01)?;
        in_range("position of a response", &site.position.to_array(), -1e6, 1e6)?;
    }
    in_range("responses", &measured.samples, -1e6, 1e6)?;
    in_range("bass of the responses", &measured.low, -1e6, 1e6)?;
    in_range("late part of the responses", &measured.late, 0.0, 1e6)?;
    in_range("energies of the late part", &measured.late_before, 0.0, 1e12)?;
    in_range("gains of the responses", &measured.gains, 0.0, 1e6)?;
    let Some(lifted) = &measured.lifted else { return Ok(()) };
    if parts.images.is_none() {
        return Err(value("reflections lifted out of responses", "with image sources that play them", "none"));
    }
    limit("places of responses", lifted.places.len(), 1, MAX_SITES)?;
    let hops = lifted.samples.len() / (2 * count * grid.hop);
    limit("hops that reflections are lifted out of", hops, 1, taps + 1)?;
    fits("samples of lifted reflections", lifted.samples.len(), 2 * count * hops * grid.hop)?;
    in_range("lifted reflections", &lifted.samples, -1e6, 1e6)?;
    lifted.places.iter().try_for_each(|place| in_range("place of responses", &place.to_array(), -1e6, 1e6))
}

fn check_images(images: &ImageSources, emitter: Option<Vec3>) -> Result<(), SceneError> {
    let emitter = emitter.ok_or_else(|| value("image sources", "with an emitter", "none"))?;
    let (count, places) = (images.images.len(), images.place_count());
    limit("number of images", count, 1, MAX_IMAGES)?;
    limit("number of what is seen of images", images.seen.len(), count * places, count * places)?;
    limit("number of what is seen of the emitter", images.direct.len(), places, places)?;
    if let Some(room) = &images.turning {
        check_turning(room, count)?;
    }
    if let Some(emission) = &images.emission {
        if images.turning.is_some() {
            return Err(value("directions of the emitter", "in a room that does not turn", "one that does"));
        }
        check_emission(emission, count)?;
    }
    let emitter = images.emitter(emitter);
    for image in &images.images {
        in_range("position of an image", &image.position.to_array(), -1e6, 1e6)?;
        in_range("distance of an image from the emitter", &[image.position.distance(emitter)], 0.0, FARTHEST_IMAGE_M)?;
        in_range("gain of an image", &image.gains, 0.0, 1e3)?;
        in_range("gain of an image at 63 Hz", &[image.gain_63], 0.0, 1e3)?;
    }
    in_range("air absorption", &images.air_db_per_m, 0.0, 10.0)?;
    in_range("what is seen of an image", &images.seen, 0.0, 1.0)?;
    in_range("what is seen of the emitter", &images.direct, 0.0, 1.0)?;
    let head = &images.head;
    if !(8_000.0..=192_000.0).contains(&head.sample_rate_hz) {
        return Err(value("rate of the head", "8000 to 192000 Hz", head.sample_rate_hz));
    }
    limit("samples of the head", head.len(), 1, whole(LONGEST_HEAD_S * head.sample_rate_hz))?;
    limit("values of the head", head.filters.len(), 2 * AMBISONIC_CHANNELS * head.len(), 2 * AMBISONIC_CHANNELS * head.len())?;
    limit("lead of the head", head.lead, 0, whole(2e-3 * head.sample_rate_hz))?;
    in_range("filters of the head", &head.filters, -1e3, 1e3)
}

fn check_turning(room: &TurningRoom, images: usize) -> Result<(), SceneError> {
    limit("number of mirrors of images", room.mirrors.len(), images, images)?;
    let turn = room.listener.orientation.length();
    in_range("orientation of the head in its room", &[turn], 0.99, 1.01)?;
    in_range("position of the head in its room", &room.listener.position.to_array(), -1e6, 1e6)?;
    in_range("place of the head", &room.centre.to_array(), -1e6, 1e6)?;
    in_range("side of what was measured", &[room.side], -1.0, 1.0)?;
    room.mirrors.iter().try_for_each(|mirror| in_range("mirror of an image", &mirror.to_array(), -1.0, 1.0))
}

fn check_emission(emission: &Emission, images: usize) -> Result<(), SceneError> {
    let directions = emission.elevation.count().saturating_mul(emission.azimuth.count());
    limit("directions of the emitter", emission.levels.len(), directions, directions)?;
    limit("number of turns of images", emission.turns.len(), images, images)?;
    in_range("what the emitter sends", emission.levels.as_flattened(), -20.0, 20.0)?;
    emission.turns.iter().try_for_each(|turn| in_range("turn of an image", &turn.to_cols_array(), -1.001, 1.001))
}

fn check_corners(corners: &Corners, images: Option<&ImageSources>) -> Result<(), SceneError> {
    images.ok_or_else(|| value("corners", "with image sources", "none"))?;
    let places = corners.place_count();
    limit("places of corners", places, 1, MAX_NODES)?;
    limit("number of what is seen of the emitter round corners", corners.direct.len(), places, places)?;
    limit("number of edges by place", corners.round.len(), places, places)?;
    limit("number of edges of images by place", corners.images.len(), 0, MAX_BENT * places)?;
    limit("number of edges of images beyond whole tables", corners.images.len() % places, 0, 0)?;
    limit("number of edges", corners.edges.len(), 0, MAX_EDGES)?;
    in_range("what is seen of the emitter round corners", &corners.direct, 0.0, 1.0)?;
    limit("number of places that see images", corners.seen.len(), 0, places)?;
    limit("number of places that see images, beside those of corners", corners.seen.len() % places, 0, 0)?;
    in_range("which images are seen", &corners.seen, 0.0, MOST_SEEN)?;
    for numbers in [&corners.round, &corners.images] {
        in_range("number of an edge", numbers, Corners::NO_EDGE, single(corners.edges.len() as f64) - 1.0)?;
    }
    if !corners.edges.is_sorted_by_key(|edge| edge.from.is_some()) {
        return Err(value("edges", "those of the emitter before those of images", "others"));
    }
    for DiffractionEdge { ends, gains, from, longer_m } in &corners.edges {
        from.map_or(Ok(()), |from| in_range("place of the sound at an edge", &from.to_array(), -1e6, 1e6))?;
        in_range("gain of an edge", gains, -1e3, 1e3)?;
        in_range("way round another edge", &[*longer_m], 0.0, 1e4)?;
        ends.iter().try_for_each(|end| in_range("end of an edge", &end.to_array(), -1e6, 1e6))?;
    }
    Ok(())
}

fn check_bass(bass: &BassField, emitter: Option<Vec3>) -> Result<(), SceneError> {
    emitter.ok_or_else(|| value("bass of waves", "with an emitter", "none"))?;
    if !(CROSSOVERS_HZ.0..=CROSSOVERS_HZ.1).contains(&bass.crossover_hz) {
        let expected = format!("{} to {} Hz", CROSSOVERS_HZ.0, CROSSOVERS_HZ.1);
        return Err(value("crossover", expected, bass.crossover_hz));
    }
    if !(2.0..=20.0).contains(&(bass.rate_hz / bass.crossover_hz)) {
        return Err(value("rate of the bass", "2 to 20 times its crossover", bass.rate_hz));
    }
    limit("places of the bass", bass.place_count(), 1, MAX_NODES)?;
    limit("samples of the bass", bass.len(), 1, whole(LONGEST_BASS_S * bass.rate_hz))?;
    let count = BASS_SIGNALS * bass.place_count() * bass.len();
    limit("values of the bass", bass.samples.len(), count, count)?;
    in_range("direct sound of the bass", &[bass.direct], 0.0, 1e6)?;
    in_range("bass", &bass.samples, -1e6, 1e6)
}

fn check_cloud(cloud: &AnchorCloud, grid: &StftGrid, shape: TransferShape) -> Result<(), SceneError> {
    let sizes = cloud.model.sizes();
    if sizes.tap_shapes > 0 {
        limit("hops of the tap shapes", sizes.tap_hops, shape.taps + 1, shape.taps + 1)?;
        limit("bands of the tap shapes", sizes.tap_bands, shape.bands, shape.bands)?;
    }
    if let Some(emitter) = &cloud.emitter {
        in_range("emitter position", &emitter.position.to_array(), -1e6, 1e6)?;
        in_range("head radius", &[emitter.head_radius_m], 0.0, 1.0)?;
        in_range("shape of the interaural delay", &emitter.delay_shape_ms, -2.0, 2.0)?;
    }
    if let Projection::Row(row) = cloud.projection {
        limit("row of the time filter", row, 0, sizes.frames.saturating_sub(1))?;
    }
    if cloud.conv == ConvMode::Off {
        return Ok(());
    }
    if !sizes.conv {
        return Err(value("convolution layers", "a model that has some", "none"));
    }
    limit("bands of the anchor cloud, for its convolution layers", sizes.bands, grid.bins(), grid.bins())?;
    let latency_s = cloud.stream_options(0).latency_samples(grid) as f64 / grid.sample_rate_hz;
    if latency_s > 0.9 * LONGEST_LATENCY_S {
        return Err(value("look-ahead", format!("a latency of at most {} s", 0.9 * LONGEST_LATENCY_S), latency_s));
    }
    Ok(())
}

/// Everything that a scene promises about its numbers.
pub(super) fn check(parts: &SceneParts) -> Result<(), SceneError> {
    check_grid(&parts.grid)?;
    limit("bands", parts.bands.count(), 2, MAX_BANDS)?;
    limit("taps", parts.taps, 0, MAX_HOPS)?;
    limit("slowness of refreshing", parts.refresh, 1, TURNS)?;
    limit("decodes a second", parts.decodes, 1, usize::MAX)?;
    let shape = parts.shape();
    if parts.field.is_none() && parts.cloud.is_none() {
        return Err(value("decoder", "a field or an anchor cloud", "neither"));
    }
    if let Some(field) = &parts.field {
        // Time filters are in one table.
        let taps = if parts.room.is_some() || parts.measured.is_some() { 0 } else { shape.taps };
        check_field(field, TransferShape { taps, ..shape })?;
    }
    if let Some(room) = &parts.room {
        check_room(room, parts, shape)?;
    }
    if let Some(images) = &parts.images {
        check_images(images, parts.field.as_ref().and_then(Field::emitter))?;
    }
    if let Some(corners) = &parts.corners {
        check_corners(corners, parts.images.as_ref())?;
    }
    if let Some(bass) = &parts.bass {
        check_bass(bass, parts.field.as_ref().and_then(Field::emitter))?;
    }
    if let Some(cloud) = &parts.cloud {
        check_cloud(cloud, &parts.grid, shape)?;
    }
    if let Some(measured) = &parts.measured {
        check_measured(measured, parts)?;
    }
    for levels in parts.measured_head.iter().flat_map(|h| [&h.around_db, &h.diffuse_db[0], &h.diffuse_db[1]]) {
        in_range("levels of the measured head", levels, -200.0, 200.0)?;
    }
    limit("points of the front", parts.front.len(), 0, MAX_FRONT)?;
    for point in &parts.front {
        in_range("errors of the front", &[point.error.jnds], 0.0, 1e6)?;
        in_range("costs of the front", &[point.cost], 0.0, 1e3)?;
    }
    limit("anchors", parts.anchors.len(), 0, MAX_ANCHORS)?;
    limit("held-out measurements", parts.held_out.len(), 0, MAX_HELD_OUT)?;
    Cost::new(parts, &parts.grid).check(&parts.grid)?;
    check_surroundings(parts)
}

/// The late part, the bounds, the air, the anchors and the poses.
fn check_surroundings(parts: &SceneParts) -> Result<(), SceneError> {
    let (tail, bands) = (&parts.tail, parts.bands.count());
    for (name, len) in [("reverberation times", tail.t60_s.len()), ("coherences", tail.coherence.len())] {
        limit(&format!("number of {name}"), len, bands, bands)?;
    }
    in_range("reverberation time", &tail.t60_s, 1e-3, 1e3)?;
    in_range("coherence", &tail.coherence, -1.0, 1.0)?;
    in_range("highest frequency", &[parts.top_hz], 1.0, 1e6)?;
    let (low, high) = parts.bounds;
    for corner in [low, high] {
        in_range("bounds", &corner.to_array(), -1e6, 1e6)?;
    }
    if !low.cmple(high).all() {
        return Err(value("bounds", "the lower corner first", format!("{low} and {high}")));
    }
    let Weather { temperature_c, humidity_percent, pressure_kpa } = parts.weather;
    for (what, value, low, high) in [
        ("temperature", temperature_c, -50.0, 60.0),
        ("humidity", humidity_percent, 0.0, 100.0),
        ("pressure", pressure_kpa, 10.0, 200.0),
    ] {
        in_range(what, &[single(value)], low, high)?;
    }
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
