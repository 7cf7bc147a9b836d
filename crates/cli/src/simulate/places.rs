//! A simulated room as it is heard at places of recordings.

use super::room::{described, room, source, within};
use crate::args::{RoomArgs, SimulationArgs};
use crate::hrtf;
use anyhow::{Context, Result};
use promenade_acoustics::{Mesh, Room, Source};
use promenade_baker::anchors::{AnchorOptions, AnchorSet, WALL_COLOURS, box_points};
use promenade_baker::capture::Emitter;
use promenade_baker::geometry::{CorrectedResponse, GeometryOptions, bake_corrected};
use promenade_baker::simulation::{Hrtf, Inside, MeshOptions, Part, grid, scene_spacing_m, simulate_mesh, turned};
use promenade_baker::wav::{self, Format};
use promenade_baker::{BakeError, FileError, Response, Responses, sound};
use promenade_core::glam::Vec3;
use promenade_core::network::Placement;
use promenade_core::{Pose, Provenance, Scene};
use promenade_fit::MaterialsBeside;
use promenade_metrics::statistics::median_high;
use promenade_room::{Matched, PLAYED_IMAGES, Some7, match_room_t20};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// Beams that search the image sources, as `simulate` has them.
const BEAMS: usize = 8192;
/// Distance of a scene's places from surfaces, metres, as `simulate` has it.
const MARGIN_M: f32 = 0.3;
/// Listeners whose heights differ by more, metres, hear the bass at several.
const LAYERED_M: f32 = 0.3;
/// Turns of the head at each place where a scene is corrected.
const TURNS: usize = 4;
/// Turns of the head that a scene stores what comes from one side for, as `simulate` has them.
const HEAD_TURNS: usize = 6;
/// Their height over the floor where nobody has listened, metres.
const HEIGHT_M: f32 = 1.5;
/// Places of the listener at most whose decays are matched.
const DECAY_PLACES: usize = 12;
/// Anchors of a room, and their voxels, metres.
const ANCHORS: usize = 64;
const ANCHOR_VOXEL_M: f32 = 0.25;

/// A room with the emitters of recordings in it.
pub(crate) struct Places {
    mesh: Mesh,
    room: Room,
    hrtf: Hrtf,
    sources: Vec<Source>,
    options: MeshOptions,
    rate_hz: u32,
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
            // Learnt gains are those of images and rays; the scene itself has waves.
            waves_hz: Some(0.0),
            seed,
            part: Part::WHOLE,
        };
        Ok(Some(Self { mesh, room, hrtf, sources, options, rate_hz }))
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

    /// Gives the walls the reverberation times that are told at places of the listener, by octave: each surface absorbs more or
    /// less in the same proportion.
    pub(crate) fn match_decays(&mut self, wanted_s: &Some7, listeners: &[Vec3]) -> Result<Matched> {
        let every = listeners.len().div_ceil(DECAY_PLACES).max(1);
        let at: Vec<[f64; 3]> = listeners.iter().step_by(every).map(|p| p.as_dvec3().to_array()).collect();
        let of = (&self.sources[0], &at[..]);
        let air = self.options.air.unwrap_or_default();
        let (matched, room) = match_room_t20((&self.mesh, &self.room), air, of, wanted_s, self.options.seed)?;
        self.room = room;
        Ok(matched)
    }

    /// Anchors of the box around the room.
    pub(crate) fn anchors(&self) -> Result<AnchorSet> {
        let [low, high] = self.mesh.bounds().map(|at| Vec3::from(at.map(|x| x as f32)));
        let mut points = box_points(high - low, ANCHOR_VOXEL_M, &WALL_COLOURS)?;
        points.iter_mut().for_each(|point| point.position += low);
        let options =
            AnchorOptions { count: ANCHORS, voxel_m: ANCHOR_VOXEL_M, seed: self.options.seed, ..AnchorOptions::default() };
        Ok(AnchorSet::from_points(&points, Placement::IDENTITY, &options)?.0)
    }

    /// The mesh with its groups' materials, as `simulate` reads them.
    pub(crate) fn files(&self, made: &str) -> (String, MaterialsBeside) {
        // One group for all, which a reader parts by where surfaces look, has a rule for all.
        let name = |group: &String| if self.mesh.groups.len() == 1 { "*".to_owned() } else { group.clone() };
        let materials = self.mesh.groups.iter().zip(self.room.materials());
        let materials = materials.map(|(group, material)| (name(group), described(material))).collect();
        (self.mesh.to_obj(), MaterialsBeside { made: made.to_owned(), materials, source: None })
    }

    /// The responses of [`Self::ears`] from a folder, where they are once they were made.
    pub(crate) fn kept_ears(
        &self,
        folder: &Path,
        emitter: usize,
        poses: &[Pose],
        done: impl Fn(f64) + Sync,
    ) -> Result<Vec<[Vec<f32>; 2]>, BakeError> {
        let mut key = DefaultHasher::new();
        let room = (&self.mesh, self.room.materials(), &self.sources[emitter], &self.options, self.hrtf.directions());
        format!("{room:?} {poses:?}").hash(&mut key);
        let file = folder.join(format!("emitter-{}-{:016x}.wav", emitter + 1, key.finish()));
        if !file.is_file() {
            let made = self.ears(emitter, poses, done)?;
            let all = [0, 1].map(|ear| made.iter().flat_map(|ears| ears[ear].iter().copied()).collect::<Vec<f32>>());
            std::fs::create_dir_all(folder).map_err(FileError::write(folder))?;
            wav::write(&file, self.rate_hz, &all.each_ref().map(Vec::as_slice), Format::Float32)?;
            return Ok(made);
        }
        let kept = sound::read(&file)?;
        let length = kept.frames() / poses.len().max(1);
        let [left, right] = match &kept.channels[..] {
            [left, right] if length > 0 && left.len() == length * poses.len() => [left, right],
            _ => {
                let found = format!("{} channels of {} samples", kept.channels.len(), kept.frames());
                return Err(BakeError::content(&file, format!("both ears' responses at {} places", poses.len()), found));
            }
        };
        Ok(left.chunks_exact(length).zip(right.chunks_exact(length)).map(|(l, r)| [l.to_vec(), r.to_vec()]).collect())
    }

    /// The scene of an emitter, by its number, whose responses at places all over the room, at the height of listeners, are
    /// changed by `refined`; with their level, or with that of the simulated room.
    pub(crate) fn scene(
        &self,
        (emitter, listeners): (usize, &[Vec3]),
        about: Provenance,
        (seed, is_levelled): (u64, bool),
        mut refined: impl FnMut(&Pose, &[Vec<f32>; 2]) -> Result<[Vec<f32>; 2]>,
    ) -> Result<Scene> {
        let at = Vec3::from(self.sources[emitter].position.map(|x| x as f32));
        let inside = Inside::new(&self.mesh, &self.room, at, MARGIN_M)?;
        let [low, high] = self.mesh.bounds().map(|at| at[2] as f32);
        let heights = || listeners.iter().map(|at| at.z - low);
        let middle = median_high(heights().map(f64::from)).map_or(HEIGHT_M, |height| height as f32);
        let height_m = middle.clamp(MARGIN_M, (high - low - MARGIN_M).max(MARGIN_M));
        let [lowest, highest] = [heights().fold(middle, f32::min), heights().fold(middle, f32::max)];
        let poses = turned(&grid(&inside, scene_spacing_m(&self.mesh), height_m)?, TURNS);
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
            height_m,
            layered: highest - lowest > LAYERED_M,
            margin_m: MARGIN_M,
            air: self.options.air,
            waves_hz: None,
            gain_db: 0.0,
            seed,
            title: String::new(),
            recipe: String::new(),
        };
        let room = (&self.mesh, &self.room, &self.sources[emitter]);
        Ok(bake_corrected(room, &self.hrtf, &options, (&responses, is_levelled), about)?)
    }
}
