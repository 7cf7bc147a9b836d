//! Field baking: measured binaural responses become a scene.

mod arrivals;
mod between;
pub(crate) mod carried;
pub mod cloud_scene;
mod corners;
pub(crate) mod direct;
pub(crate) mod ears;
mod emission;
pub mod field;
pub mod geometry;
pub(crate) mod grains;
mod halved;
pub(crate) mod kriging;
pub(crate) mod late_unit;
pub(crate) mod layout;
mod levels;
pub(crate) mod log_transfer;
pub(crate) mod model;
pub(crate) mod model_head;
mod reflections;
pub(crate) mod room;
pub(crate) mod seed;
mod sides;
mod unwrap;

use crate::bake::carried::{carried, halved};
use crate::bake::kriging::{Site, of_ring, weights};
use crate::bake::layout::{LEVEL_Z, Layout};
use crate::bake::levels::levelled;
use crate::bake::log_transfer::{LogTransfer, delay_trend};
use crate::bake::model::{Model, Modelled};
use crate::bake::model_head::model_head;
use crate::bake::reflections::Reflections;
use crate::bake::room::Room;
use crate::bake::unwrap::unwrap_phases;
use crate::error::BakeError;
use crate::sources::responses::{Response, Responses};
use glam::Vec3;
use promenade_core::{
    Anchor, Field, FieldGrid, Head, HeldOut, MAX_SCENE_BYTES, MeasuredHead, Pose, Provenance, Rows, Scene, SceneParts,
    StftGrid, TransferFunction, TransferShape, glam,
};
use promenade_judge::{response_levels_db, response_measures};
use promenade_room::LONGEST_EARLY_S;
use rayon::prelude::*;

/// Of what a direct sound is at one place, this share of the variance is not what it is at others in the same direction.
const PLACES_NUGGET: f64 = 0.03;

/// Counts up when the same responses make another scene than before: the factory scenes are made again then. Scenes have it
/// among their notes.
pub const CONTENT: &str = "content 3 of scenes of measured responses";

/// Choices of a bake.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOptions {
    /// Frame of the short-time transform, seconds; the hop is a quarter of it and the latency 13 sixteenths.
    pub window_s: f64,
    /// Seed of the pseudo-random carriers.
    pub seed: u64,
    /// The head that the responses were measured with, where it is known.
    pub head: Option<Head>,
    /// How the scene is made, in one line, for its provenance.
    pub recipe: String,
}

impl Default for BakeOptions {
    fn default() -> Self {
        Self { window_s: 0.020, seed: 1, head: None, recipe: String::new() }
    }
}

/// Bakes a scene from responses; `is_held_out` picks those that are kept for judging it.
///
/// # Errors
/// No usable geometry, a silent response, options out of range, a table larger than a scene may have, or a reverberation time
/// that is too long or cannot be estimated since the responses end before.
pub fn bake_responses(
    responses: &Responses,
    is_held_out: impl Fn(&Response, usize) -> bool,
    options: &BakeOptions,
) -> Result<Scene, BakeError> {
    let all = Layout::of(responses)?;
    let held: Vec<bool> = responses.responses.iter().enumerate().map(|(i, r)| is_held_out(r, i)).collect();
    let used: Vec<usize> = (0..held.len()).filter(|i| !held[*i]).collect();
    if used.is_empty() {
        return Err(BakeError::argument("responses", "at least one to bake from", "none"));
    }
    let (responses, levelled) = levelled(responses, &all, &used);
    let responses = &*responses;
    let layout = all.only(&used);
    let measured: Vec<&Response> = used.iter().map(|&i| &responses.responses[i]).collect();
    let grid = grid_for(responses.sample_rate_hz, options)?;
    let nodes = layout.nodes();
    check_size(&layout, &nodes, &measured, &grid)?;
    let gain = unit_gain(&measured);
    let (room, heard) = Room::of(&measured, &grid, options.seed)?;
    let mut notes = vec![CONTENT.to_owned()];
    notes.extend_from_slice(&layout.notes);
    notes.extend(levelled);
    notes.extend_from_slice(&room.notes);
    let logs = heard.iter().zip(&layout.distances);
    let logs = logs.map(|(h, distance)| LogTransfer::of(&h.direct, f64::from(gain), f64::from(*distance))).collect();
    let measurements = Measurements::of(&layout, logs);
    if layout.is_half() {
        notes.push("one half space was measured: the other is its mirror image, front to back".to_owned());
    }
    let shape = TransferShape { taps: 0, ..room.shape };
    let model = options
        .head
        .as_ref()
        .map_or_else(|| Model::instead(model_head(), &grid, layout.direction_spacing()), |head| Model::of(head, &grid));
    let field = measurements.table(&nodes, &layout, &model, shape, &grid)?;
    let head = options.head.as_ref().unwrap_or_else(|| model_head());
    let lifted = responses.room.map(|walls| Reflections::of(&walls, (&measured, &heard), &layout, head, &grid, gain));
    let (images, lost) = lifted.transpose()?.flatten().map(|lifted| (lifted.images, lifted.lifted)).unzip();
    notes.extend(images.as_ref().map(|images| {
        let count = images.images.len();
        format!("away from where responses were measured, {count} early reflections come from a box's images")
    }));
    let carried = carried(
        &measured,
        &heard,
        &layout,
        (&measurements.sites, &measurements.origins),
        (&field, &grid),
        (&room, lost.as_deref()),
        gain,
    );
    let measured_head = options.head.as_ref().map(|head| head_of(head, &nodes, &layout));
    let bounds = layout.bounds();
    let held_out = held_out(responses, &all, &held, gain)?;
    Ok(Scene::new(SceneParts {
        provenance: provenance(responses, options, notes),
        taps: room.shape.taps,
        measured: Some(carried),
        measured_head,
        field: Some(field),
        images,
        top_hz: room.top_hz,
        start_pose: start_pose(&layout),
        bounds,
        anchors: anchors(&layout),
        held_out,
        ..SceneParts::new(grid, room.bands, room.tail)
    })?)
}

/// Direct sounds as they were measured and, where one half space was, as they are in the other.
struct Measurements {
    sites: Vec<Site>,
    logs: Vec<LogTransfer>,
    /// The response of each.
    origins: Vec<usize>,
}

impl Measurements {
    fn of(layout: &Layout, logs: Vec<LogTransfer>) -> Self {
        let mut all = Self { sites: layout.sites.clone(), logs, origins: (0..layout.sites.len()).collect() };
        for (i, site) in layout.sites.iter().enumerate().filter(|_| layout.is_half()) {
            if site.direction.x.abs() > 0.05 {
                all.sites.push(Site { direction: site.direction * Vec3::new(-1.0, 1.0, 1.0), ..*site });
                all.logs.push(all.logs[i].clone());
                all.origins.push(i);
            }
        }
        all
    }

    /// The direct sound at all nodes: what a direction makes of it, wherever it was measured.
    fn table(
        &self,
        nodes: &FieldGrid,
        layout: &Layout,
        model: &Model,
        shape: TransferShape,
        grid: &StftGrid,
    ) -> Result<Field, BakeError> {
        let towards: Vec<Site> = self.sites.iter().map(|s| Site { position: Vec3::ZERO, ..*s }).collect();
        let models: Vec<Modelled> = towards.par_iter().map(|site| model.at(site.direction)).collect();
        let trend = delay_trend(&models, &self.logs);
        let (level, nugget) = (layout.is_level(), if layout.has_places() { PLACES_NUGGET } else { 1e-9 });
        let at = |index: usize| {
            let node = Site { direction: nodes.node(index).1, position: Vec3::ZERO };
            // In the plane of a ring its neighbours say most; elsewhere all measurements have a say.
            let in_plane = level && node.direction.z.abs() < LEVEL_Z;
            let around = if in_plane { of_ring(&towards, &node, nugget) } else { weights(&towards, &node, nugget) };
            LogTransfer::blend(&self.logs, &models, &around, trend, &model.at(node.direction)).to_transfer(&shape, grid)
        };
        let mut transfers: Vec<TransferFunction> = (0..nodes.nodes()).into_par_iter().map(at).collect();
        unwrap_phases(nodes, &mut transfers);
        let rows: Vec<f32> = transfers.iter().flat_map(|transfer| halved(transfer.to_row())).collect();
        let field = Field::new(nodes.clone(), shape, Rows::Whole(rows));
        field.ok_or_else(|| BakeError::argument("table of the scene", "a row for each node", "others"))
    }
}

/// The head that was measured, at the nodes. What lies behind may be the mirror image of what was measured ahead, or the other
/// way round.
fn head_of(head: &Head, nodes: &FieldGrid, layout: &Layout) -> MeasuredHead {
    let side = layout.is_half().then(|| layout.sites.iter().map(|s| s.direction.x).sum::<f32>().signum());
    MeasuredHead::of(head, nodes, |d| side.map_or(d, |side| Vec3::new(side * d.x.abs(), d.y, d.z)))
}

fn provenance(responses: &Responses, options: &BakeOptions, notes: Vec<String>) -> Provenance {
    Provenance {
        title: responses.title.clone(),
        credit: responses.credit.clone(),
        licence: responses.licence.clone(),
        recipe: options.recipe.clone(),
        notes,
    }
}

/// The pose that looks at the emitter most.
fn start_pose(layout: &Layout) -> Pose {
    let ahead = |i: &usize| layout.sites[*i].direction.x;
    let start = (0..layout.poses.len()).max_by(|a, b| ahead(a).total_cmp(&ahead(b))).unwrap_or(0);
    layout.poses[start]
}

/// Places where responses were measured, each once, and the emitter.
fn anchors(layout: &Layout) -> Vec<Anchor> {
    let mut anchors: Vec<Anchor> = Vec::new();
    for pose in &layout.poses {
        if !anchors.iter().any(|a| a.position.distance(pose.position) < 1e-3) {
            anchors.push(Anchor { position: pose.position, colour: Vec3::splat(0.7) });
        }
    }
    anchors.push(Anchor { position: layout.emitter, colour: Vec3::new(0.9, 0.5, 0.2) });
    anchors
}

fn grid_for(sample_rate_hz: f64, options: &BakeOptions) -> Result<StftGrid, BakeError> {
    if !(0.004..=0.1).contains(&options.window_s) {
        return Err(BakeError::argument("window", "0.004 to 0.1 s", options.window_s));
    }
    Ok(StftGrid::four_hops(sample_rate_hz, (sample_rate_hz * options.window_s / 4.0).round().max(4.0)))
}

/// Refuses what no scene may hold before any work is done for it.
fn check_size(layout: &Layout, nodes: &FieldGrid, measured: &[&Response], grid: &StftGrid) -> Result<(), BakeError> {
    let shape = TransferShape { taps: 0, ..Room::shape(measured, grid, LONGEST_EARLY_S) };
    let table = nodes.nodes().saturating_mul(shape.row_len()).saturating_mul(size_of::<f32>());
    let longest = measured.iter().map(|r| r.left.len()).max().unwrap_or(0);
    let samples = longest.min((LONGEST_EARLY_S * grid.sample_rate_hz) as usize);
    let responses = layout.sites.len().saturating_mul(2 * samples).saturating_mul(size_of::<f32>());
    let bytes = table.saturating_add(responses);
    if bytes <= MAX_SCENE_BYTES {
        return Ok(());
    }
    let expected = format!("at most {MAX_SCENE_BYTES} bytes (fewer responses, or a lower sample rate)");
    let found = format!("{bytes} bytes for {} responses and {} directions", layout.sites.len(), nodes.nodes());
    Err(BakeError::argument("size of the scene", expected, found))
}

/// Gain that brings the loudest ear of all responses to unit energy: noise comes out no louder than it went in.
fn unit_gain(responses: &[&Response]) -> f32 {
    let energy = |x: &[f32]| x.iter().map(|v| f64::from(*v) * f64::from(*v)).sum::<f64>();
    let loudest = responses.iter().map(|r| energy(&r.left).max(energy(&r.right))).fold(0.0, f64::max);
    if loudest > 0.0 { loudest.sqrt().recip() as f32 } else { 1.0 }
}

fn held_out(responses: &Responses, layout: &Layout, held: &[bool], gain: f32) -> Result<Vec<HeldOut>, BakeError> {
    let mut out = Vec::new();
    for (i, r) in responses.responses.iter().enumerate().filter(|(i, _)| held[*i]) {
        let measured = response_measures(&r.left, &r.right, responses.sample_rate_hz)
            .map_err(|why| crate::error::unmeasurable(&format!("response '{}'", r.name), why))?;
        let gain_db = 20.0 * f64::from(gain).log10();
        let levels = response_levels_db(&r.left, &r.right, responses.sample_rate_hz);
        let levels_db = levels.into_iter().map(|level| level + gain_db).collect();
        out.push(HeldOut { name: r.name.clone(), pose: layout.poses[i], measured, levels_db });
    }
    Ok(out)
}
