//! Early reflections with a place of their own: each image source delayed, coloured by its walls and heard from its direction.
//!
//! Images are played in the time domain and added up in third-order Ambisonics, so that delays glide as the listener walks and
//! the head is one convolution for all of them.

mod delay_line;
mod level;
mod spline;
mod voice;
mod wall;

use crate::decode::NEAREST_M;
use crate::latency::Pace;
use crate::minimum_phase::{GIVEN_HZ, LogGains, octave_of};
use crate::number::{single, whole};
use crate::octave::KILOHERTZ;
use crate::render::head::ambisonic::{HeadSpectra, harmonics};
use crate::render::head::bus::{AmbisonicBus, Bus};
use crate::render::late::decay_curve::DecayCurve;
use crate::render::part::{Heard, Hop, PORTIONS, Part};
use crate::scene::{ImageSources, Lifted, MOST_ROUND, Round, barrier_db, lit_gain};
use crate::{Corners, DiffractionEdge, Pose, Scene, StftGrid, Trim};
use delay_line::DelayLine;
use glam::Vec3;
use level::Levels;
use pulp::Arch;
use spline::{AFTER, BEFORE};
use std::ops::Range;
use std::sync::Arc;
use voice::{Moment, Voice, scratch_len};
use wall::{WallFilters, Weights};

/// The shortest delay that can be interpolated, samples.
const SHORTEST: f64 = (AFTER + 2) as f64;
/// Images whose walls and air are brought to the pose at a hop: air changes them slowly.
const REFRESHED: usize = 2;

/// What all renderers of a scene's images share at one rate.
pub(crate) struct ImageFilters {
    pace: Pace,
    /// Delay of what arrives with the direct sound, samples.
    base: f64,
    /// Whether what is heard of a block needs nothing of it, so that it can be played before the block is there.
    is_early: bool,
    walls: WallFilters,
    head: Arc<HeadSpectra>,
}

impl ImageFilters {
    pub(crate) fn new(images: &ImageSources, grid: &StftGrid, pace: &Pace) -> Self {
        let rate = grid.sample_rate_hz;
        let head = HeadSpectra::new(&images.head, rate, pace.block);
        // The head's filters begin early, and what the line gives comes late.
        let base = pace.delay as f64 - head.lead - DelayLine::LAG as f64;
        let is_early = !pace.is_short() && base >= scratch_len(pace.block) as f64;
        Self { pace: *pace, base, is_early, walls: WallFilters::new(rate), head: Arc::new(head) }
    }

    /// Where the images of voices are added up.
    pub(crate) fn bus(some: Option<&Self>) -> AmbisonicBus {
        AmbisonicBus::new(some.map(|filters| &filters.head), some.is_some_and(|filters| filters.is_early))
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        self.head.memory_bytes()
    }
}

/// Natural logarithm of the amplitude that is a decibel.
const NEPERS_PER_DB: f32 = std::f32::consts::LN_10 / 20.0;
/// How far an image may lie from where an edge has its sound from, metres: scenes have one place for near ones.
const SAME_M: f32 = 0.3;

/// By edge past which sound is seen, the image that sends it.
fn lit(images: &ImageSources, corners: &Corners, emitter: Vec3) -> Vec<Option<usize>> {
    let of_edge = |edge: &DiffractionEdge| {
        let from = edge.from.unwrap_or(emitter);
        let near = images.images.iter().map(|image| image.position.distance(from)).enumerate();
        near.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, away)| edge.is_lit() && *away < SAME_M).map(|(image, _)| image)
    };
    corners.edges.iter().map(of_edge).collect()
}

/// The emitter or an image round an edge, as it sounds.
#[derive(Clone, Copy, Default)]
struct RoundVoice {
    heard: Option<Round>,
    now: Moment,
    /// Where it was before what was played ahead.
    before: Moment,
    weights: Weights,
}

/// The image sources of a scene as one voice is heard by them.
pub(crate) struct ImageVoices {
    scene: Arc<Scene>,
    emitter: Vec3,
    filters: Arc<ImageFilters>,
    arch: Arch,
    line: DelayLine,
    scratch: Vec<f32>,
    /// Samples per metre.
    per_m: f64,
    /// Delay of what arrives with the direct sound, samples.
    base: f64,
    longest: f64,
    weights: Vec<Weights>,
    /// What a metre of air takes, nepers.
    air: LogGains,
    /// The next image whose walls are brought to the pose.
    refreshed: usize,
    /// Images whose walls are still those of an older pose.
    stale: usize,
    now: Vec<Moment>,
    round: [RoundVoice; MOST_ROUND],
    /// By edge past which sound is seen, the image that sends it.
    lit: Vec<Option<usize>>,
    /// What edges leave of images that are seen past them, by the images' numbers.
    shades: [Option<(usize, LogGains)>; MOST_ROUND],
    seen: Vec<f32>,
    /// Gain of all, below 1 where measured responses still have their reflections.
    level: f32,
    /// The pose that was played last.
    played: Option<Pose>,
    levels: Levels,
    /// Blocks since there was input.
    quiet_blocks: usize,
    longest_blocks: usize,
    /// The hop that is played.
    hop: (Pose, Pose, Trim),
    /// Where the listener goes to in the block that is played, whether anything moves, and whether nothing was heard before.
    aimed: Option<(Pose, bool, bool)>,
    /// Where images were before that, and the next one to be refreshed: what was played ahead may be forgotten.
    before: Vec<Moment>,
    refreshed_before: usize,
    /// Images of the block that were played.
    played_to: usize,
}

impl ImageVoices {
    /// `None` for a scene without images. `filters` and `curve` are the scene's at the grid's rate.
    pub(crate) fn new(
        scene: &Arc<Scene>,
        grid: &StftGrid,
        filters: &Arc<ImageFilters>,
        curve: &Arc<DecayCurve>,
    ) -> Option<Self> {
        let (images, emitter) = (scene.images()?, scene.emitter()?);
        let per_m = grid.sample_rate_hz / f64::from(scene.weather().speed_m_s());
        let (head, block) = (&filters.head, filters.pace.block);
        let base = filters.base;
        let round_m = scene.corners().map_or(0.0, |corners| corners.longest_m(emitter));
        let longest = (base + f64::from(images.longest_m(emitter).max(round_m)) * per_m).max(SHORTEST);
        let line = DelayLine::new(&filters.walls, whole(longest.ceil()) + BEFORE + AFTER + 2, block);
        let longest_blocks = (whole(longest) + head.tail()) / block + 2;
        let count = images.images.len();
        Some(Self {
            emitter,
            filters: Arc::clone(filters),
            arch: Arch::new(),
            line,
            scratch: vec![0.0; scratch_len(block)],
            per_m,
            base,
            longest,
            weights: vec![Weights::default(); count],
            air: GIVEN_HZ.map(|hz| single(images.air_nepers_per_m(f64::from(hz)))),
            refreshed: 0,
            stale: 0,
            now: vec![Moment::default(); count],
            round: [RoundVoice::default(); MOST_ROUND],
            lit: scene.corners().map_or(Vec::new(), |corners| lit(images, corners, emitter)),
            shades: [None; MOST_ROUND],
            seen: vec![0.0; count],
            level: 1.0,
            played: None,
            levels: Levels::new(scene, curve, grid),
            quiet_blocks: usize::MAX / 2,
            longest_blocks,
            hop: (Pose::IDENTITY, Pose::IDENTITY, Trim::NEUTRAL),
            aimed: None,
            before: vec![Moment::default(); count],
            refreshed_before: 0,
            played_to: 0,
            scene: Arc::clone(scene),
        })
    }

    /// Whether anything of the newest block or of those before is heard.
    fn sounds(&self) -> bool {
        self.quiet_blocks <= self.longest_blocks
    }

    /// Plays a block of dry sound, but for what was played of it before, while the listener moves to `pose` over it.
    fn play(&mut self, block: &[f32], pose: &Pose, bus: &mut AmbisonicBus) {
        self.quiet_blocks = if block.iter().any(|x| *x != 0.0) { 0 } else { self.quiet_blocks.saturating_add(1) };
        if self.aimed.is_none() {
            self.aim(pose);
        }
        if self.sounds() {
            self.line.write(block);
        }
        self.play_images(usize::MAX, block.len(), bus);
        self.aimed = None;
    }

    /// Goes to `pose` in the next block.
    fn aim(&mut self, pose: &Pose) {
        let (.., trim) = self.hop;
        let scene = Arc::clone(&self.scene);
        let Some(images) = scene.images() else { return };
        let moves = self.levels.set(&trim) || self.played != Some(*pose);
        let fresh = self.played.is_none();
        if moves {
            images.seen_at(pose.position, scene.corners(), &mut self.seen);
            if let Some(corners) = scene.corners() {
                let own = images.images.iter().zip(&mut self.seen).filter(|(image, _)| image.position == self.emitter);
                own.for_each(|(_, seen)| *seen = corners.direct_at(pose.position));
            }
            let lifted = scene.measured().and_then(|measured| measured.lifted.as_ref());
            self.level = lifted.map_or(1.0, |lifted| Lifted::images_gain(lifted.away(pose.position)));
            self.played = Some(*pose);
            self.stale = self.weights.len();
            self.shade(pose);
        }
        self.before.copy_from_slice(&self.now);
        self.round.iter_mut().for_each(|voice| voice.before = voice.now);
        self.refreshed_before = self.refreshed;
        self.refresh(images, pose, fresh);
        self.aimed = Some((*pose, moves, fresh));
        self.played_to = 0;
    }

    /// Plays the images up to one of some number, and what comes round edges after the last; `newest` samples of the block are
    /// in the line.
    fn play_images(&mut self, end: usize, newest: usize, bus: &mut AmbisonicBus) {
        let scene = Arc::clone(&self.scene);
        let (Some(images), Some((pose, moves, fresh))) = (scene.images(), &self.aimed) else { return };
        let (pose, moves, fresh, count) = (&pose.clone(), *moves, *fresh, self.now.len());
        let (.., trim) = self.hop;
        let (trim, sounds) = (&trim, self.sounds());
        let mut bus = if sounds { Some(bus.open()) } else { None };
        let direct = f64::from(pose.position.distance(self.emitter));
        let outlook = images.outlook(pose, self.emitter);
        let from = std::mem::replace(&mut self.played_to, end.min(count + 1));
        let voices = images.images.iter().zip(&mut self.now).zip(&self.weights).enumerate();
        for (i, ((image, now), weights)) in voices.take(end).skip(from) {
            let mut to = *now;
            if moves {
                let way = outlook.pose.to_head(images.place(i, &outlook));
                let distance = way.length();
                let after = (f64::from(distance) - direct) * self.per_m;
                // In Ambisonics the emitter itself is among them.
                let level = if image.position == self.emitter { trim.direct } else { self.level * self.levels.gain(after) };
                let sent = images.sent(i, pose).map_or(1.0, |sent| sent[KILOHERTZ].exp());
                to.gain = self.seen[i] / distance.max(NEAREST_M) * level * sent;
                let delay = self.base + after;
                to.delay = delay.clamp(SHORTEST, self.longest);
                if to.gain > 0.0 {
                    to.direction = harmonics(way / distance.max(1e-6));
                }
            }
            let from = if fresh { to } else { *now };
            *now = to;
            if let Some(bus) = bus.as_deref_mut().filter(|_| from.gain > 0.0 || to.gain > 0.0) {
                let scratch = &mut self.scratch;
                self.arch.dispatch(Voice { line: &self.line, newest, weights, from, to, scratch, bus });
            }
        }
        if end > count && from <= count {
            self.play_round(pose, moves, fresh, (newest, trim), bus);
        }
    }

    /// Plays the same block as it comes round edges where the emitter or images are hidden.
    fn play_round(&mut self, pose: &Pose, moves: bool, fresh: bool, (newest, trim): (usize, &Trim), mut bus: Option<&mut Bus>) {
        let scene = Arc::clone(&self.scene);
        let Some(corners) = scene.corners() else { return };
        if moves {
            let hidden = |round: &Round| !corners.edges[round.edge].is_lit();
            self.assign(corners.round_at(pose.position).map(|round| round.filter(hidden)));
        }
        let direct = pose.position.distance(self.emitter);
        let speed = f64::from(scene.weather().speed_m_s());
        for voice in &mut self.round {
            let mut to = voice.now;
            if moves {
                to.gain = 0.0;
                if let Some(round) = voice.heard.filter(|round| round.weight > 0.0) {
                    let way = corners.way(round.edge, self.emitter, pose.position);
                    let after = f64::from(way.length_m - direct) * self.per_m;
                    let level = if round.image { self.level * self.levels.gain(after) } else { trim.direct };
                    let gains = &corners.edges[round.edge].gains;
                    to.gain = round.weight / way.direct_m.max(NEAREST_M) * level;
                    let delay = self.base + after;
                    to.delay = delay.clamp(SHORTEST, self.longest);
                    to.direction = harmonics(pose.to_head(way.bend).normalize_or_zero());
                    let log_gains = std::array::from_fn(|given| {
                        let octave = octave_of(given);
                        let decay = if round.image { self.levels.log_gain(octave, after) } else { 0.0 };
                        let gain = gains[octave].max(1e-5).ln() + decay - way.length_m * self.air[given];
                        gain - NEPERS_PER_DB * single(barrier_db(way.detour_m.into(), GIVEN_HZ[given].into(), speed))
                    });
                    voice.weights = self.filters.walls.weights(&log_gains);
                }
            }
            let from = if fresh { to } else { voice.now };
            voice.now = to;
            if let Some(bus) = bus.as_deref_mut().filter(|_| from.gain > 0.0 || to.gain > 0.0) {
                let (weights, scratch) = (&voice.weights, &mut self.scratch);
                self.arch.dispatch(Voice { line: &self.line, newest, weights, from, to, scratch, bus });
            }
        }
    }

    /// Finds what edges take of images beside their shadows at a pose.
    fn shade(&mut self, pose: &Pose) {
        let scene = Arc::clone(&self.scene);
        let Some(corners) = scene.corners() else { return };
        let speed = f64::from(scene.weather().speed_m_s());
        let rounds = corners.round_at(pose.position);
        for (shade, round) in self.shades.iter_mut().zip(rounds) {
            *shade = round.and_then(|round| {
                let image = self.lit[round.edge]?;
                let detour_m = corners.way(round.edge, self.emitter, pose.position).detour_m.into();
                let weight = f64::from((round.weight / self.seen[image].max(1e-6)).min(1.0));
                let left = |hz: f32| 1.0 - weight * (1.0 - lit_gain(detour_m, hz.into(), speed));
                Some((image, GIVEN_HZ.map(|hz| single(left(hz).ln()))))
            });
        }
    }

    /// Gives each edge that is heard a voice, the one that it had.
    fn assign(&mut self, found: [Option<Round>; MOST_ROUND]) {
        let named = |edge: usize| found.iter().flatten().any(|round| round.edge == edge);
        for voice in &mut self.round {
            if let Some(heard) = &mut voice.heard {
                heard.weight = 0.0;
            }
        }
        for round in found.into_iter().flatten() {
            let own = self.round.iter().position(|voice| voice.heard.is_some_and(|heard| heard.edge == round.edge));
            let free = || self.round.iter().position(|voice| voice.heard.is_none_or(|heard| !named(heard.edge)));
            if let Some(slot) = own.or_else(free) {
                self.round[slot].heard = Some(round);
            }
        }
    }

    /// Brings walls and air of some images, or of all, to a pose.
    fn refresh(&mut self, images: &ImageSources, pose: &Pose, all: bool) {
        let count = self.weights.len();
        let now = if all { count } else { REFRESHED.min(self.stale) };
        self.stale -= now.min(self.stale);
        let outlook = images.outlook(pose, self.emitter);
        let shades = self.shades;
        // What edges take changes with every step.
        let shaded = shades.iter().flatten().map(|(image, _)| *image).filter(|_| self.stale > 0);
        let first = self.refreshed;
        self.refreshed = (first + now) % count;
        for i in (first..first + now).map(|i| i % count).chain(shaded) {
            let image = &images.images[i];
            let distance = outlook.pose.position.distance(images.place(i, &outlook));
            let after = f64::from(distance - pose.position.distance(self.emitter)) * self.per_m;
            let sent = images.sent(i, pose);
            let log_gains = std::array::from_fn(|given| {
                let octave = octave_of(given);
                let colour = sent.map_or(0.0, |sent| sent[octave] - sent[KILOHERTZ]);
                let wall =
                    if given == 0 { image.gain_63 } else { image.gains[octave] }.max(1e-5).ln() - distance * self.air[given];
                let decay = if image.position == self.emitter { 0.0 } else { self.levels.log_gain(octave, after) };
                let of_image = shades.iter().flatten().filter(|(image, _)| *image == i);
                wall + decay + colour + of_image.map(|(_, shade)| shade[given]).sum::<f32>()
            });
            self.weights[i] = self.filters.walls.weights(&log_gains);
        }
    }
}

impl Part for ImageVoices {
    fn begin(&mut self, hop: &Hop<'_>) {
        self.hop = (hop.from, hop.to, hop.trim);
    }

    fn prepare(&mut self, portion: usize, heard: &mut Heard<'_>) {
        if !self.filters.is_early {
            return;
        }
        if portion == 0 {
            let (_, to, ..) = self.hop;
            self.aim(&to);
        }
        self.play_images((portion + 1) * (self.now.len() + 1) / PORTIONS, 0, heard.images);
    }

    fn forget_prepared(&mut self) {
        if self.aimed.take().is_some() {
            self.now.copy_from_slice(&self.before);
            self.round.iter_mut().for_each(|voice| voice.now = voice.before);
            self.refreshed = self.refreshed_before;
        }
        // All images are aimed at anew.
        self.levels.forget();
    }

    fn take(&mut self, hop: &mut [f32], span: Range<usize>, heard: &mut Heard<'_>) {
        let block = self.filters.pace.block;
        if span.end.is_multiple_of(block) {
            let (from, to, ..) = self.hop;
            let pose = if from == to { to } else { from.toward(&to, span.end as f32 / hop.len() as f32) };
            self.play(&hop[span.end - block..span.end], &pose, heard.images);
        }
    }

    fn tail_samples(&self) -> usize {
        whole(self.longest) + self.filters.head.tail()
    }

    fn reset(&mut self) {
        self.line.reset();
        self.quiet_blocks = usize::MAX / 2;
        self.played = None;
        self.round = [RoundVoice::default(); MOST_ROUND];
        (self.refreshed, self.stale, self.aimed) = (0, 0, None);
    }

    fn memory_bytes(&self) -> usize {
        self.line.memory_bytes() + size_of_val(&*self.weights) + 2 * size_of_val(&*self.now)
    }
}
