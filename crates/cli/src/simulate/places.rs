//! A simulated room as it is heard at places of recordings.

use super::room::{room, source, within};
use crate::args::{RoomArgs, SimulationArgs};
use crate::hrtf;
use anyhow::{Context, Result};
use promenade_acoustics::{Mesh, Room, Source};
use promenade_baker::capture::Emitter;
use promenade_baker::geometry::{CorrectedResponse, GeometryOptions, bake_corrected};
use promenade_baker::simulation::{Hrtf, Inside, MeshOptions, Part, grid, scene_spacing_m, simulate_mesh, turned};
use promenade_baker::{BakeError, Response, Responses};
use promenade_core::glam::Vec3;
use promenade_core::{Pose, Provenance, Scene};
use promenade_room::PLAYED_IMAGES;
use std::path::{Path, PathBuf};

/// Beams that search the image sources, as `simulate` has them.
const BEAMS: usize = 8192;
/// Distance of a scene's places from surfaces, and their height over the floor, metres, as `simulate` has them.
const MARGIN_M: f32 = 0.3;
/// Turns of the head at each place where a scene is corrected.
const TURNS: usize = 4;
/// Turns of the head that a scene stores what comes from one side for, as `simulate` has them.
const HEAD_TURNS: usize = 6;
const HEIGHT_M: f32 = 1.5;

/// A room with the emitters of recordings in it.
pub(crate) struct Places {
    mesh: Mesh,
    room: Room,
    hrtf: Hrtf,
    sources: Vec<Source>,
    options: MeshOptions,
}

/// A head whose ears hear the same from everywhere: a microphone in its middle.
fn microphone(rate_hz: u32) -> Responses {
    let click: Vec<f32> = (0..64).map(|i| if i == 16 { 1.0 } else { 0.0 }).collect();
    let from = |(number, source): (usize, Vec3)| Response {
        listener: Pose::IDENTITY,
        source,
        left: click.clone(),
        right: click.clone(),
        name: number.to_string(),
    };
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    let directions = axes.into_iter().flat_map(|axis| [axis, -axis]);
    Responses {
        title: "a microphone".to_owned(),
        sample_rate_hz: f64::from(rate_hz),
        responses: directions.enumerate().map(from).collect(),
        ..Responses::default()
    }
}

impl Places {
    /// The room of the arguments, if they have one, with these emitters.
    pub(crate) fn of(args: &SimulationArgs, emitters: &[Emitter], rate_hz: f64, seed: u64) -> Result<Option<Self>> {
        let Some(mesh) = &args.simulate else { return Ok(None) };
        let rate_hz = rate_hz.round() as u32;
        let set = match &args.head {
            Some(head) => hrtf::read(head)?,
            None => microphone(rate_hz),
        };
        let hrtf = hrtf::at(&set, rate_hz, args.head.as_deref().unwrap_or(Path::new("a microphone")))?;
        let of = |emitter: &Emitter| RoomArgs {
            mesh: mesh.clone(),
            source: emitter.position,
            materials: args.materials.clone(),
            material_table: Vec::<PathBuf>::new(),
            scale: args.world.scale,
            up: args.world.up,
            flatten: None,
            directivity: args.directivity.clone(),
            facing: emitter.facing_deg.map(|facing| facing.map(f64::from)),
        };
        let first = emitters.first().context("--simulate: expected a capture that says where its emitter is, found none")?;
        let (mesh, room, size) = room(&of(first))?;
        for emitter in emitters.iter().filter(|_| size.volume_m3.is_some()) {
            let named = if emitter.name.is_empty() { "emitter" } else { &emitter.name };
            within(named, &room, &mesh, emitter.position)?;
        }
        let sources = emitters.iter().map(|emitter| source(&of(emitter))).collect::<Result<_>>()?;
        let options = MeshOptions {
            order: args.order,
            beams: BEAMS,
            rays: args.rays as usize,
            t30_within: None,
            length_s: None,
            air: Some(args.air.air()),
            // What corrects a scene has none either.
            waves_hz: Some(0.0),
            seed,
            part: Part::WHOLE,
        };
        Ok(Some(Self { mesh, room, hrtf, sources, options }))
    }

    /// Both ears' responses to an emitter, by its number, at poses; `done` is given the share of the emitters that is done.
    pub(crate) fn ears(
        &self,
        emitter: usize,
        poses: &[Pose],
        done: impl Fn(f64) + Sync,
    ) -> Result<Vec<[Vec<f32>; 2]>, BakeError> {
        let done = |share| done((emitter as f64 + share) / self.sources.len() as f64);
        let source = &self.sources[emitter];
        let made = simulate_mesh(&self.mesh, &self.room, source, &self.hrtf, poses, &self.options, done)?;
        Ok(made.responses.responses.into_iter().map(|r| [r.left, r.right]).collect())
    }

    /// The scene of an emitter, by its number, whose responses at places all over the room are changed by `refined`.
    pub(crate) fn scene(
        &self,
        emitter: usize,
        about: Provenance,
        seed: u64,
        mut refined: impl FnMut(&Pose, &[Vec<f32>; 2]) -> Result<[Vec<f32>; 2]>,
    ) -> Result<Scene> {
        let at = Vec3::from(self.sources[emitter].position.map(|x| x as f32));
        let inside = Inside::new(&self.mesh, &self.room, at, MARGIN_M)?;
        let poses = turned(&grid(&inside, scene_spacing_m(&self.mesh), HEIGHT_M)?, TURNS);
        let mut response = |(pose, simulated): (&Pose, [Vec<f32>; 2])| {
            Ok(CorrectedResponse { at: pose.position, corrected: refined(pose, &simulated)?, simulated })
        };
        let ears = self.ears(emitter, &poses, |_| ())?;
        let responses = poses.iter().zip(ears).map(&mut response).collect::<Result<Vec<_>>>()?;
        let options = GeometryOptions {
            images: PLAYED_IMAGES,
            head_turns: HEAD_TURNS,
            order: self.options.order,
            beams: self.options.beams,
            rays: self.options.rays,
            spacing_m: scene_spacing_m(&self.mesh),
            height_m: HEIGHT_M,
            margin_m: MARGIN_M,
            air: self.options.air,
            waves_hz: None,
            gain_db: 0.0,
            seed,
            title: String::new(),
            recipe: String::new(),
        };
        let room = (&self.mesh, &self.room, &self.sources[emitter]);
        Ok(bake_corrected(room, &self.hrtf, &options, &responses, about)?)
    }
}
