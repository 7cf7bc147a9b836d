//! Follows poses through a field.

use crate::decode::field::{Cell, Field};
use crate::decode::sites::Sites;
use crate::decode::{Change, Decoder};
use crate::minimum_phase::{GIVEN_HZ, magnitude, octave_of, phase};
use crate::number::single;
use crate::octave::Octaves;
use crate::{Corners, ImageSources, LiveParams, MeasuredRoom, NEAREST_M, Pose, Scene, TransferFunction, lit_gain};
use glam::Vec3;
use std::sync::Arc;

/// A listener's place in a scene's field.
pub(crate) struct FieldDecoder {
    scene: Arc<Scene>,
    cell: Cell,
    /// The place in the scene's room, where its time filters have a table of their own.
    room: Option<Cell>,
    /// The scene's measurements, which carry its time filters then.
    measured: Option<Sites>,
    /// What air takes of the direct sound, where the scene states it.
    air: Option<Air>,
    /// What the emitter sends the listener, where that depends on the direction.
    sent: Option<Sent>,
    pose: Pose,
    /// Explicit taps that are followed: hops from there on are the late part's.
    taps: usize,
    transfer: TransferFunction,
}

impl FieldDecoder {
    /// For a head with some explicit taps; `None` where the scene has no field.
    pub(crate) fn new(scene: &Arc<Scene>, taps: usize) -> Option<Self> {
        let (cell, mut transfer) = (scene.field()?.cell(), scene.shape().silent());
        let measured = scene.measured().map(|measured| Sites::new(&measured.sites));
        if let Some(measured) = scene.measured() {
            set_taps(measured, &mut transfer);
        }
        let room = scene.parts().room.as_ref().map(Field::cell);
        let (air, sent) = (Air::new(scene), Sent::new(scene));
        Some(Self { scene: Arc::clone(scene), cell, room, measured, air, sent, pose: Pose::IDENTITY, taps, transfer })
    }
}

/// The transfer function at a pose by the tables of a scene.
pub(crate) fn heard(scene: &Scene, pose: &Pose) -> Option<TransferFunction> {
    let field = scene.field()?;
    let Some(measured) = scene.measured() else { return Some(scene.parts().room.as_ref().unwrap_or(field).decode(pose)) };
    let (direct, mut transfer) = (field.decode(pose), scene.shape().silent());
    set_taps(measured, &mut transfer);
    transfer = TransferFunction { mixture: direct.mixture, difference: direct.difference, ..transfer };
    (transfer.phase, transfer.delay_s) = (direct.phase, direct.delay_s);
    let emitter = field.emitter()?;
    let gain = 1.0 / pose.position.distance(emitter).max(NEAREST_M);
    mix_at(&Sites::new(&measured.sites), measured, pose, emitter, gain, &mut transfer);
    Some(transfer)
}

/// Gains of taps that measured responses carry.
fn set_taps(measured: &MeasuredRoom, transfer: &mut TransferFunction) {
    transfer.taps.chunks_exact_mut(measured.gains.len().max(1)).for_each(|gains| gains.copy_from_slice(&measured.gains));
}

/// Sets what is heard of the measurements around a pose.
fn mix_at(
    sites: &Sites,
    measured: &MeasuredRoom,
    pose: &Pose,
    emitter: Vec3,
    direct_gain: f32,
    transfer: &mut TransferFunction,
) {
    let direction = pose.to_head(emitter).normalize_or(Vec3::X);
    transfer.shares = sites.at(direction, pose.position, direct_gain);
    transfer.shares.lifted = measured.lifted.as_ref().map_or(0.0, |lifted| lifted.away(pose.position));
    measured.late_of(transfer.shares.entries(), &mut transfer.late);
}

/// Steps of distance that the air's gains are made for, nepers: whole ones, so that they depend on where the listener is and
/// not on where he was.
const DISTANCE_STEP: f32 = 0.01;

/// What air takes of the direct sound on its way.
struct Air {
    emitter: Vec3,
    /// Of a metre, nepers, by bin.
    nepers_per_m: Vec<f32>,
    /// Step of distance that the gains are made for.
    step: f32,
    gains: Vec<f32>,
}

impl Air {
    fn new(scene: &Scene) -> Option<Self> {
        let (images, emitter) = (scene.images()?, scene.emitter()?);
        let grid = scene.grid();
        let nepers_per_m: Vec<f32> = (0..grid.bins()).map(|k| single(images.air_nepers_per_m(grid.bin_hz(k)))).collect();
        Some(Self { emitter, gains: vec![1.0; nepers_per_m.len()], nepers_per_m, step: f32::NEG_INFINITY })
    }

    fn apply(&mut self, pose: &Pose, mixture: &mut [f32]) {
        let distance = pose.position.distance(self.emitter);
        let step = (distance.ln() / DISTANCE_STEP).round();
        if step != self.step {
            self.step = step;
            let distance = (step * DISTANCE_STEP).exp();
            self.gains.iter_mut().zip(&self.nepers_per_m).for_each(|(g, a)| *g = (-a * distance).exp());
        }
        mixture.iter_mut().zip(&self.gains).for_each(|(m, g)| *m *= g);
    }
}

/// Takes from the direct sound what edges take beside their shadows.
fn shade(scene: &Scene, corners: &Corners, emitter: Vec3, position: Vec3, mixture: &mut [f32]) {
    let seen = corners.direct_at(position).max(1e-6);
    let (grid, speed) = (scene.grid(), f64::from(scene.weather().speed_m_s()));
    for round in corners.round_at(position).into_iter().flatten() {
        let edge = &corners.edges[round.edge];
        if !edge.is_lit() || edge.from.is_some() {
            continue;
        }
        let detour_m = f64::from(corners.way(round.edge, emitter, position).detour_m);
        for (k, gain) in mixture.iter_mut().enumerate() {
            let taken = 1.0 - single(lit_gain(detour_m, grid.bin_hz(k), speed));
            // It falls with frequency.
            if taken <= 0.0 {
                break;
            }
            *gain *= 1.0 - (round.weight / seen).min(1.0) * taken;
        }
    }
}

/// The colour that the direct sound has by the direction in which it leaves the emitter.
struct Sent {
    emitter: Vec3,
    /// By bin what its level and its minimum phase have of the octaves' logarithms.
    shares: Vec<[Octaves; 2]>,
}

impl Sent {
    fn new(scene: &Scene) -> Option<Self> {
        let (images, emitter) = (scene.images()?, scene.emitter()?);
        images.emission.as_ref()?;
        // Beyond the first and the last octave their values hold.
        let octaves = |shares: [f64; GIVEN_HZ.len()]| {
            let mut out = Octaves::default();
            shares.iter().enumerate().for_each(|(given, share)| out[octave_of(given)] += single(*share));
            out
        };
        let of_bin = |k: usize| {
            let hz = scene.grid().bin_hz(k).max(1.0);
            [octaves(magnitude(hz)), octaves(phase(hz))]
        };
        Some(Self { emitter, shares: (0..scene.grid().bins()).map(of_bin).collect() })
    }

    fn apply(&self, images: &ImageSources, pose: &Pose, transfer: &mut TransferFunction) {
        let Some(emission) = &images.emission else { return };
        let sent = emission.towards(pose.position - self.emitter);
        let sum = |shares: &Octaves| shares.iter().zip(sent).map(|(share, log)| share * log).sum::<f32>();
        let (left, right) = transfer.phase.split_at_mut(self.shares.len());
        for (([level, turn], gain), (left, right)) in
            self.shares.iter().zip(&mut transfer.mixture).zip(left.iter_mut().zip(right))
        {
            let turn = sum(turn);
            *gain *= sum(level).exp();
            *left += turn;
            *right += turn;
        }
    }
}

impl Decoder for FieldDecoder {
    fn follow(&mut self, pose: &Pose, whole: bool, _params: &LiveParams) -> bool {
        let Some(field) = self.scene.field().filter(|_| whole || *pose != self.pose) else { return false };
        self.pose = *pose;
        field.locate(pose, &mut self.cell);
        if let Some(images) = self.scene.images() {
            let seen = self.scene.corners().map(|corners| corners.direct_at(pose.position));
            self.cell.dim(seen.unwrap_or_else(|| images.direct_at(pose.position)));
        }
        if let (Some(room), Some(cell)) = (&self.scene.parts().room, &mut self.room) {
            room.locate(pose, cell);
        }
        field.masks(&mut self.cell, &mut self.transfer);
        if let (Some(sites), Some(measured), Some(emitter)) = (&self.measured, self.scene.measured(), field.emitter()) {
            mix_at(sites, measured, pose, emitter, self.cell.direct_gain(), &mut self.transfer);
        }
        if let Some(air) = &mut self.air {
            air.apply(pose, &mut self.transfer.mixture);
        }
        if let (Some(corners), Some(emitter)) = (self.scene.corners(), field.emitter()) {
            shade(&self.scene, corners, emitter, pose.position, &mut self.transfer.mixture);
        }
        if let (Some(sent), Some(images)) = (&self.sent, self.scene.images()) {
            sent.apply(images, pose, &mut self.transfer);
        }
        true
    }

    fn update_filters(&mut self, change: &Change) {
        let parts = self.scene.parts();
        if parts.measured.is_some() {
            return;
        }
        let (field, cell) = match (&parts.room, &mut self.room, &parts.field) {
            (Some(room), Some(cell), _) => (room, cell),
            (_, _, Some(field)) => (field, &mut self.cell),
            _ => return,
        };
        // Neighbouring taps lie one after the other in the table.
        let mut hop = 0;
        while hop < self.taps {
            let end = (hop..self.taps).find(|tap| !change.names_tap(*tap)).unwrap_or(self.taps);
            if hop < end {
                field.taps(cell, hop..end, &mut self.transfer);
            }
            hop = end + 1;
        }
        // All hops of the late part have one row of gains.
        if change.filters[1].iter().any(|hop| hop >= self.taps) {
            let late = field.shape().taps;
            field.taps(cell, late..late + 1, &mut self.transfer);
        }
    }

    fn transfer(&self) -> &TransferFunction {
        &self.transfer
    }
}
