//! Field baking: measured binaural responses become a scene.

pub mod cloud_scene;
pub(crate) mod direct;
pub mod field;
pub mod geometry;
pub(crate) mod kriging;
pub(crate) mod late_unit;
pub(crate) mod layout;
pub(crate) mod log_transfer;
pub(crate) mod mixing;
pub(crate) mod room;
pub(crate) mod seed;
mod sides;

use crate::bake::direct::Direct;
use crate::bake::kriging::{Site, weights};
use crate::bake::layout::{LEVEL_Z, Layout};
use crate::bake::log_transfer::{LogTransfer, align_phases, delay_trend};
use crate::bake::mixing::{Hops, PER_NODE, ResponseShare, shares};
use crate::bake::room::Room;
use crate::error::BakeError;
use crate::sources::responses::{Response, Responses};
use glam::Vec3;
use promenade_core::{
    Anchor, Axis, Field, FieldGrid, Head, HeldOut, MAX_SCENE_BYTES, MeasuredHead, NodeShares, Provenance, Rows, Scene,
    SceneParts, StftGrid, glam,
};
use promenade_judge::response_measures;
use promenade_room::LONGEST_EARLY_S;
use rayon::prelude::*;

/// Choices of a bake.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOptions {
    /// Frame of the short-time transform, seconds; the hop is a quarter of it and the latency 13 sixteenths.
    pub window_s: f64,
    /// Length of the explicit time filters, seconds; the exponential late part follows. `None`: half the room's reverberation
    /// time, as much of it as T20 is measured on, up to 0.22 s.
    pub early_s: Option<f64>,
    /// Seed of the pseudo-random carriers.
    pub seed: u64,
    /// The head that the responses were measured with, where it is known.
    pub head: Option<Head>,
    /// How the scene is made, in one line, for its provenance.
    pub recipe: String,
}

impl Default for BakeOptions {
    fn default() -> Self {
        Self { window_s: 0.020, early_s: None, seed: 1, head: None, recipe: String::new() }
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
    let layout = all.only(&used);
    let measured: Vec<&Response> = used.iter().map(|&i| &responses.responses[i]).collect();
    let grid = grid_for(responses.sample_rate_hz, options)?;
    let nodes = layout.nodes();
    check_table(&nodes, Room::shape(&measured, &grid, options.early_s.unwrap_or(LONGEST_EARLY_S)).row_len())?;
    let gain = unit_gain(&measured);
    let (room, heard) = Room::of(&measured, &grid, options.early_s, options.seed)?;
    let mut notes = layout.notes.clone();
    let logs = heard.iter().zip(&layout.distances);
    let logs = logs.map(|(h, distance)| LogTransfer::of(&h.direct, &h.late, f64::from(gain), f64::from(*distance)));
    let mut logs: Vec<LogTransfer> = logs.collect();
    let directs: Vec<&Direct> = heard.iter().map(|h| &h.direct).collect();
    let hops = Hops::of(&directs, &layout.distances, &grid, &room, gain);

    let mut sites = layout.sites.clone();
    // The response of each site.
    let mut origins: Vec<usize> = (0..sites.len()).collect();
    if layout.is_half() {
        notes.push("one half space was measured: the other is its mirror image, front to back".to_owned());
        for i in 0..layout.sites.len() {
            let s = layout.sites[i];
            if s.direction.x.abs() > 0.05 {
                sites.push(Site { direction: s.direction * Vec3::new(-1.0, 1.0, 1.0), ..s });
                logs.push(logs[i].clone());
                origins.push(i);
            }
        }
    }
    align_phases(&mut logs, &sites, &grid);
    let trend = delay_trend(&sites, &logs);
    let level = layout.is_level();
    let baked: Vec<(Vec<f32>, Vec<ResponseShare>)> = (0..nodes.nodes())
        .into_par_iter()
        .map(|index| {
            let (position, direction) = nodes.node(index);
            let node = Site { direction, position };
            let near = shares(&sites, &node, level);
            // In the plane of a ring its neighbours say most; elsewhere all measurements have a say.
            let around = if level && direction.z.abs() < LEVEL_Z { near.clone() } else { weights(&sites, &node) };
            let log = LogTransfer::blend(&logs, &sites, &around, trend, &node);
            let mix: Vec<ResponseShare> = near.iter().map(|(site, share)| (origins[*site], *share)).collect();
            let late = log.late();
            (log.to_transfer(&room.shape, &grid, hops.gains(&mix, &late, &room)).to_row(), mix)
        })
        .collect();
    let padded = |(_, mix): &(Vec<f32>, Vec<ResponseShare>)| {
        let none = std::iter::repeat((0, 0.0));
        mix.iter().copied().chain(none).take(PER_NODE).collect::<Vec<ResponseShare>>()
    };
    let mixes: Vec<ResponseShare> = baked.iter().flat_map(padded).collect();
    let numbers = mixes.iter().map(|(response, _)| *response as u32).collect();
    let node_shares = NodeShares::new(PER_NODE, numbers, mixes.iter().map(|(_, share)| *share as f32).collect());
    let table = baked.into_iter().flat_map(|(row, _)| row).collect();
    // What lies behind may be the mirror image of what was measured ahead, or the other way round.
    let mirrored = if layout.is_half() { Some(layout.sites.iter().map(|s| s.direction.x).sum::<f32>().signum()) } else { None };
    let measured_head = options
        .head
        .as_ref()
        .map(|head| MeasuredHead::of(head, &nodes, |d| mirrored.map_or(d, |side| Vec3::new(side * d.x.abs(), d.y, d.z))));
    let field = Field::new(nodes.clone(), room.shape, Rows::Whole(table)).zip(node_shares);
    let field = field.and_then(|(field, shares)| field.with_shares(shares));
    let [x, y, z] = &nodes.position;
    let bounds = (Vec3::new(x.start(), y.start(), z.start()), Vec3::new(x.end(), y.end(), z.end()));
    let held_out = held_out(responses, &all, &held)?;
    let ahead = |i: &usize| layout.sites[*i].direction.x;
    let start = (0..used.len()).max_by(|a, b| ahead(a).total_cmp(&ahead(b))).unwrap_or(0);
    let mut anchors: Vec<Anchor> = Vec::new();
    for pose in &layout.poses {
        if !anchors.iter().any(|a| a.position.distance(pose.position) < 1e-3) {
            anchors.push(Anchor { position: pose.position, colour: Vec3::splat(0.7) });
        }
    }
    anchors.push(Anchor { position: layout.emitter, colour: Vec3::new(0.9, 0.5, 0.2) });
    Ok(Scene::new(SceneParts {
        provenance: Provenance {
            title: responses.title.clone(),
            credit: responses.credit.clone(),
            licence: responses.licence.clone(),
            recipe: options.recipe.clone(),
            notes,
        },
        taps: room.shape.taps,
        measured: Some(hops.into_room()),
        measured_head,
        field,
        top_hz: room.top_hz,
        start_pose: layout.poses[start],
        bounds,
        anchors,
        held_out,
        ..SceneParts::new(grid, room.bands, room.tail)
    })?)
}

fn grid_for(sample_rate_hz: f64, options: &BakeOptions) -> Result<StftGrid, BakeError> {
    if !(0.004..=0.1).contains(&options.window_s) {
        return Err(BakeError::argument("window", "0.004 to 0.1 s", options.window_s));
    }
    if let Some(early_s) = options.early_s.filter(|early_s| !(0.0..=4.0).contains(early_s)) {
        return Err(BakeError::argument("early part", "0 to 4 s", early_s));
    }
    Ok(StftGrid::four_hops(sample_rate_hz, (sample_rate_hz * options.window_s / 4.0).round().max(4.0)))
}

/// Refuses a table that no scene may hold before any work is done for it.
fn check_table(nodes: &FieldGrid, row_len: usize) -> Result<(), BakeError> {
    let bytes = nodes.nodes().saturating_mul(row_len).saturating_mul(size_of::<f32>());
    if bytes <= MAX_SCENE_BYTES {
        return Ok(());
    }
    let [x, y, z] = nodes.position.each_ref().map(Axis::count);
    let directions = nodes.nodes() / (x * y * z);
    let expected = format!("at most {MAX_SCENE_BYTES} bytes (fewer positions or directions, or a shorter early part)");
    let found = format!("{bytes} bytes for {x} x {y} x {z} positions and {directions} directions at each");
    Err(BakeError::argument("table of the scene", expected, found))
}

/// Gain that brings the loudest ear of all responses to unit energy: noise comes out no louder than it went in.
fn unit_gain(responses: &[&Response]) -> f32 {
    let energy = |x: &[f32]| x.iter().map(|v| f64::from(*v) * f64::from(*v)).sum::<f64>();
    let loudest = responses.iter().map(|r| energy(&r.left).max(energy(&r.right))).fold(0.0, f64::max);
    if loudest > 0.0 { loudest.sqrt().recip() as f32 } else { 1.0 }
}

fn held_out(responses: &Responses, layout: &Layout, held: &[bool]) -> Result<Vec<HeldOut>, BakeError> {
    let mut out = Vec::new();
    for (i, r) in responses.responses.iter().enumerate().filter(|(i, _)| held[*i]) {
        let measured = response_measures(&r.left, &r.right, responses.sample_rate_hz)
            .map_err(|why| BakeError::unmeasurable(format!("response '{}'", r.name), why))?;
        out.push(HeldOut { name: r.name.clone(), pose: layout.poses[i], measured });
    }
    Ok(out)
}
