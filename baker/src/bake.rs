//! Field baking: measured binaural responses become a scene.

pub(crate) mod calibrate;
pub mod cloud_scene;
pub(crate) mod direct;
pub mod field;
pub(crate) mod kriging;
pub(crate) mod layout;
pub(crate) mod log_row;
pub(crate) mod room;

use crate::bake::calibrate::{Calibrator, Target, share_rooms};
use crate::bake::direct::{Direct, minimum_phase};
use crate::bake::kriging::{Site, weights};
use crate::bake::layout::{Layout, LayoutError};
use crate::bake::log_row::{LogRow, NO_GAIN, delay_trend};
use crate::bake::room::{HopEnergies, coherence, hops_above_noise, late_gain, t60_s};
use crate::judge::response_measures::response_measures;
use crate::signal::spectrum::{Analyser, bandwidths};
use crate::sources::responses::{Response, Responses};
use glam::Vec3;
use promenade_core::{
    Anchor, Bands, Field, HeldOut, Provenance, Rows, Scene, SceneError, SceneParts, StftGrid, TailModel, TransferFunction,
    TransferShape, glam,
};
use std::num::NonZero;
use thiserror::Error;

/// Choices of a bake.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOptions {
    /// Frame of the short-time transform, seconds; the hop is a quarter of it and the latency 13 sixteenths.
    pub window_s: f64,
    /// Length of the explicit time filters, seconds; the exponential late part follows.
    pub early_s: f64,
    /// Seed of the pseudo-random carriers.
    pub seed: u64,
    /// How the scene is made, in one line, for its provenance.
    pub recipe: String,
}

impl Default for BakeOptions {
    fn default() -> Self {
        Self { window_s: 0.020, early_s: 0.160, seed: 1, recipe: String::new() }
    }
}

/// Share of the Nyquist frequency that measurements are trusted up to; above it anti-alias filters close.
const TRUSTED_SHARE: f64 = 0.85;

/// Why responses could not be baked.
#[derive(Debug, Error)]
pub enum BakeFailure {
    /// The measurements do not lie around one emitter or one listener.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// A response is silent or too short.
    #[error("response '{name}': {problem}")]
    Response {
        /// Its name.
        name: String,
        /// What is wrong with it.
        problem: String,
    },
    /// An option is out of range.
    #[error("{option}: expected {expected}, found {found}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Its range.
        expected: &'static str,
        /// The value given.
        found: f64,
    },
    /// The result does not hold together.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// Bakes a scene from responses; `is_held_out` picks those that are kept for judging it.
///
/// # Errors
/// No usable geometry, a silent response, or options out of range.
pub fn bake_responses(
    responses: &Responses,
    is_held_out: impl Fn(&Response, usize) -> bool,
    options: &BakeOptions,
) -> Result<Scene, BakeFailure> {
    let whole = Layout::of(responses)?;
    let held: Vec<bool> = responses.responses.iter().enumerate().map(|(i, r)| is_held_out(r, i)).collect();
    let used: Vec<usize> = (0..held.len()).filter(|i| !held[*i]).collect();
    if used.is_empty() {
        return Err(LayoutError::Empty.into());
    }
    let layout = whole.only(&used);
    let measured: Vec<&Response> = used.iter().map(|&i| &responses.responses[i]).collect();
    let grid = grid_for(responses.sample_rate_hz, options)?;
    let scene_level = level(&measured);
    let room = Room::of(&measured, &grid, options, scene_level)?;
    let mut notes = layout.notes.clone();
    let calibrator = Calibrator::new(&grid, &room);
    let mut targets = measured
        .iter()
        .zip(&room.firsts)
        .map(|(r, first)| {
            let scaled = [&r.left, &r.right].map(|e| e.iter().map(|v| v * scene_level).collect::<Vec<f32>>());
            calibrator.target(scaled, first.arrival, &r.name)
        })
        .collect::<Result<Vec<_>, BakeFailure>>()?;
    share_rooms(&mut targets, &layout.sites, &bandwidths(&grid, &room.bands));
    let firsts: Vec<TransferFunction> = room.firsts.into_iter().map(|first| first.transfer).collect();
    let transfers = fit_all(&calibrator, firsts, &targets)?;

    let (mut sites, mut rows) = (layout.sites.clone(), Vec::new());
    for (transfer, distance) in transfers.iter().zip(&layout.distances) {
        rows.push(LogRow::of(transfer, f64::from(*distance)));
    }
    if layout.is_half() {
        notes.push("one half space was measured: the other is its mirror image, front to back".to_owned());
        for i in 0..layout.sites.len() {
            let s = layout.sites[i];
            if s.direction.x.abs() > 0.05 {
                sites.push(Site { direction: s.direction * Vec3::new(-1.0, 1.0, 1.0), ..s });
                rows.push(rows[i].clone());
            }
        }
    }
    let nodes = layout.grid();
    let trend = delay_trend(&sites, &rows);
    let mut table = Vec::with_capacity(nodes.nodes() * room.shape.row_len());
    for index in 0..nodes.nodes() {
        let (position, direction) = nodes.node(index);
        let node = Site { direction, position };
        table.extend(
            LogRow::blend(&rows, &sites, &weights(&sites, &node), trend, &node).to_transfer(&room.shape, &grid).to_row(),
        );
    }
    let [x, y, z] = &nodes.position;
    let bounds = (Vec3::new(x.start(), y.start(), z.start()), Vec3::new(x.end(), y.end(), z.end()));
    let field = Field::new(nodes, room.shape, Rows::Whole(table)).ok_or(LayoutError::Empty)?;
    let held_out = held_out(responses, &whole, &held)?;
    let ahead = |i: &usize| layout.sites[*i].direction.x;
    let start = (0..used.len()).max_by(|a, b| ahead(a).total_cmp(&ahead(b))).map_or(0, |i| i);
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
        grid,
        bands: room.bands,
        tail: room.tail,
        taps: room.shape.taps,
        field: Some(field),
        cloud: None,
        top_hz: room.top_hz,
        start_pose: layout.poses[start],
        bounds,
        anchors,
        held_out,
    })?)
}

/// Fits every transfer function to its target, on all cores; the order and the numbers do not depend on how many there are.
fn fit_all(
    calibrator: &Calibrator,
    firsts: Vec<TransferFunction>,
    targets: &[Target],
) -> Result<Vec<TransferFunction>, BakeFailure> {
    let share = firsts.len().div_ceil(std::thread::available_parallelism().map_or(1, NonZero::get)).max(1);
    let jobs: Vec<(TransferFunction, &Target)> = firsts.into_iter().zip(targets).collect();
    std::thread::scope(|scope| {
        let fit = |part: &[(TransferFunction, &Target)]| {
            part.iter().map(|(first, target)| calibrator.fit(first.clone(), target)).collect::<Result<Vec<_>, _>>()
        };
        let threads: Vec<_> = jobs.chunks(share).map(|part| scope.spawn(move || fit(part))).collect();
        let parts = threads.into_iter().map(|t| t.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        Ok(parts.collect::<Result<Vec<_>, _>>()?.concat())
    })
}

fn grid_for(sample_rate_hz: f64, options: &BakeOptions) -> Result<StftGrid, BakeFailure> {
    if !(0.004..=0.1).contains(&options.window_s) {
        return Err(BakeFailure::Option { option: "window", expected: "0.004 to 0.1 s", found: options.window_s });
    }
    if !(0.0..=4.0).contains(&options.early_s) {
        return Err(BakeFailure::Option { option: "early part", expected: "0 to 4 s", found: options.early_s });
    }
    Ok(StftGrid::four_hops(sample_rate_hz, (sample_rate_hz * options.window_s / 4.0).round().max(4.0)))
}

/// Gain that brings the loudest ear of all responses to unit energy: noise comes out no louder than it went in.
fn level(responses: &[&Response]) -> f32 {
    let energy = |x: &[f32]| x.iter().map(|v| f64::from(*v) * f64::from(*v)).sum::<f64>();
    let loudest = responses.iter().map(|r| energy(&r.left).max(energy(&r.right))).fold(0.0, f64::max);
    #[expect(clippy::cast_possible_truncation, reason = "a gain")]
    let gain = if loudest > 0.0 { loudest.sqrt().recip() as f32 } else { 1.0 };
    gain
}

fn held_out(responses: &Responses, layout: &Layout, held: &[bool]) -> Result<Vec<HeldOut>, BakeFailure> {
    let mut out = Vec::new();
    for (i, r) in responses.responses.iter().enumerate().filter(|(i, _)| held[*i]) {
        let measured = response_measures(&r.left, &r.right, responses.sample_rate_hz).map_err(|e| unmeasurable(&r.name, &e))?;
        out.push(HeldOut { name: r.name.clone(), pose: layout.poses[i], measured });
    }
    Ok(out)
}

/// The failure of a response that cannot be measured.
pub(crate) fn unmeasurable(name: &str, problem: &impl ToString) -> BakeFailure {
    BakeFailure::Response { name: name.to_owned(), problem: problem.to_string() }
}

/// A first estimate of one response's transfer function.
struct First {
    arrival: i64,
    transfer: TransferFunction,
}

/// What all responses share, and a first estimate of each.
pub(crate) struct Room {
    pub(crate) bands: Bands,
    pub(crate) tail: TailModel,
    pub(crate) shape: TransferShape,
    pub(crate) top_hz: f32,
    /// Hops that stand above the measurements' noise per band.
    pub(crate) above_noise: Vec<usize>,
    firsts: Vec<First>,
}

impl Room {
    fn of(measured: &[&Response], grid: &StftGrid, options: &BakeOptions, gain: f32) -> Result<Self, BakeFailure> {
        let analyser = Analyser::new(*grid);
        let bands = Bands::for_rate(grid.sample_rate_hz);
        let silent = |r: &Response| BakeFailure::Response { name: r.name.clone(), problem: "an ear is silent".to_owned() };
        let mut directs = Vec::new();
        for r in measured {
            directs.push(Direct::of([&r.left, &r.right], grid, &analyser).ok_or_else(|| silent(r))?);
        }
        let longest = measured.iter().map(|r| r.left.len()).max().unwrap_or(0);
        let hops = longest / grid.hop + 1;
        let energies: Vec<[HopEnergies; 2]> =
            directs.iter().map(|d| [0, 1].map(|ear| analyser.hop_energies(&d.rest[ear], d.arrival, hops, &bands))).collect();
        let ears = (2 * energies.len()) as f64;
        let mean: HopEnergies = (0..hops)
            .map(|l| {
                let all = energies.iter().flatten();
                (0..bands.count()).map(|b| all.clone().map(|e| e[l][b]).sum::<f64>() / ears).collect()
            })
            .collect();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of hops")]
        let taps = ((options.early_s / grid.hop_s()).round() as usize).min(hops.saturating_sub(2)).max(1);
        let t60 = t60_s(&mean, taps, grid.hop_s());
        let above_noise: Vec<usize> = (0..bands.count()).map(|b| hops_above_noise(&mean, b)).collect();
        let mut sums = [vec![0.0; bands.count()], vec![0.0; bands.count()], vec![0.0; bands.count()]];
        for d in &directs {
            #[expect(clippy::cast_possible_wrap, reason = "samples of a response")]
            let start = d.arrival + 4 * grid.hop as i64;
            let part = coherence([&d.rest[0], &d.rest[1]], start, taps, grid, &bands, &analyser);
            for (s, p) in sums.iter_mut().flatten().zip(part.iter().flatten()) {
                *s += p;
            }
        }
        #[expect(clippy::cast_possible_truncation, reason = "a coherence")]
        let coherence = (0..bands.count())
            .map(|b| (sums[0][b] / (sums[1][b] * sums[2][b]).sqrt().max(1e-30)).clamp(-1.0, 1.0) as f32)
            .collect();
        let tail = TailModel { seed: options.seed, t60_s: t60, coherence };
        let shape = TransferShape { bins: grid.bins(), bands: bands.count(), taps };
        let gain = f64::from(gain);
        let firsts = directs
            .iter()
            .zip(&energies)
            .map(|(d, e)| First { arrival: d.arrival, transfer: first_transfer(d, e, &above_noise, &tail, shape, grid, gain) })
            .collect();
        #[expect(clippy::cast_possible_truncation, reason = "a frequency in Hz")]
        let top_hz = (TRUSTED_SHARE * grid.sample_rate_hz / 2.0) as f32;
        Ok(Self { bands, tail, shape, top_hz, above_noise, firsts })
    }
}

fn first_transfer(
    direct: &Direct,
    energies: &[HopEnergies; 2],
    above_noise: &[usize],
    tail: &TailModel,
    shape: TransferShape,
    grid: &StftGrid,
    gain: f64,
) -> TransferFunction {
    let mut out = shape.silent();
    for k in 0..shape.bins {
        set_ears(&mut out, k, [gain * direct.gain[0][k], gain * direct.gain[1][k]]);
    }
    out.phase = direct.gain.iter().flat_map(|g| minimum_phase(&floored_log(g), grid)).collect();
    let first_late = shape.taps + 1;
    for (ear, hops) in energies.iter().enumerate() {
        for band in 0..shape.bands {
            #[expect(clippy::cast_possible_truncation, reason = "gains")]
            for tap in 0..shape.taps {
                out.taps[(tap * 2 + ear) * shape.bands + band] = (gain * hops[tap + 1][band].sqrt()) as f32;
            }
            let decay = 10.0_f64.powf(-3.0 * grid.hop_s() / f64::from(tail.t60_s[band]));
            let until = above_noise[band];
            // Where the noise begins before the late part does, the late part continues the last taps. Where the response itself
            // ends there, as an anechoic one does, nothing is known to follow.
            let late = if hops.len() <= first_late + 2 {
                0.0
            } else if until > first_late + 2 {
                late_gain(hops, band, first_late, until, decay)
            } else {
                let from = until.saturating_sub(8).max(1);
                #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "a hop count")]
                let steps = first_late as i32 - from as i32;
                late_gain(hops, band, from, until.max(from + 1), decay) * decay.powi(steps)
            };
            #[expect(clippy::cast_possible_truncation, reason = "a gain")]
            let late = (gain * late) as f32;
            out.late[ear * shape.bands + band] = late;
        }
    }
    out
}

/// Log of a magnitude, no lower than 60 dB below its peak: a deeper notch would only lengthen the response.
fn floored_log(gain: &[f64]) -> Vec<f64> {
    let floor = 1e-3 * gain.iter().fold(NO_GAIN, |a, b| a.max(*b));
    gain.iter().map(|g| g.max(floor).ln()).collect()
}

/// Sets the masks of a bin from the gains of both ears.
pub(crate) fn set_ears(transfer: &mut TransferFunction, bin: usize, [left, right]: [f64; 2]) {
    let sum = left + right;
    #[expect(clippy::cast_possible_truncation, reason = "gains")]
    {
        transfer.mixture[bin] = (0.5 * sum) as f32;
        transfer.difference[bin] = if sum > 0.0 { ((right - left) / sum) as f32 } else { 0.0 };
    }
}
