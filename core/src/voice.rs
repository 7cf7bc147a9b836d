//! A voice: a source on its way to the ears.

use crate::decode::Change;
use crate::decode::follow::Follower;
use crate::render::late::network::{LATE_HOPS, late_lead};
use crate::render::part::{Heard, Hop, PORTIONS, Part};
use crate::render::voice_filters::{Plan, VoiceFilters};
use crate::source::{Source, heard_at};
use crate::stft::Spectrum;
use crate::{DecodeWorker, LiveParams, Pose, Ramp, Scene, TransferFunction, TransferShape, Trim};
use glam::Vec3;
use std::ops::Range;
use std::sync::Arc;

/// The most voices of one renderer: two for the channels of a stereo sound, and 63 further ones.
pub const MOST_VOICES: usize = 65;
/// Explicit taps, of a hop each, that each of several voices has of its own: 60 ms at hops of 5 ms.
const OWN_TAPS: usize = 12;
/// Portions of what a voice works out before a hop is there.
pub(crate) const VOICE_PORTIONS: usize = 1 + PORTIONS;
/// A voice feeds the room that is shared by so much more than its first voice, at most: 18 dB.
const MOST_GAIN: f32 = 8.0;

/// What a voice plays in a block.
#[derive(Clone, Copy, Debug)]
pub struct Voice<'a> {
    /// Mono samples of the block; what is missing is silent.
    pub input: &'a [f32],
    /// How far it is from the emitter's place in the scene, metres. The room's response to it moves with it
    /// ([`crate::EmitterParams::offset`]).
    pub offset: Vec3,
    /// Gain of its sound, linear, from 0 on; it is glided to within a hop.
    pub level: f32,
    /// Its sound is not heard; what sounds in the room sounds on.
    pub mute: bool,
    /// It is neither heard nor worked out, from a hop's glide after it was switched off.
    pub off: bool,
}

impl Default for Voice<'_> {
    fn default() -> Self {
        Self { input: &[], offset: Vec3::ZERO, level: 1.0, mute: false, off: false }
    }
}

impl<'a> From<&'a [f32]> for Voice<'a> {
    /// At the emitter's place.
    fn from(input: &'a [f32]) -> Self {
        Self { input, ..Self::default() }
    }
}

impl<'a> Voice<'a> {
    /// A sound that comes from so far from the emitter's place, metres.
    #[must_use]
    pub fn at(input: &'a [f32], offset: Vec3) -> Self {
        Self { input, offset, ..Self::default() }
    }
}

impl Voice<'_> {
    /// The gain that is glided to.
    pub(crate) fn gain(&self) -> f32 {
        if self.mute || self.off || !self.level.is_finite() { 0.0 } else { self.level.max(0.0) }
    }

    /// The listener's pose as an emitter sees it that is moved by the offset together with its room.
    pub(crate) fn moved(&self, pose: Pose) -> Pose {
        Pose { position: pose.position - self.offset, ..pose }
    }

    /// From some samples of the block on.
    pub(crate) fn span(&self, span: Range<usize>) -> Self {
        let at = |sample: usize| sample.min(self.input.len());
        Self { input: &self.input[at(span.start)..at(span.end)], ..*self }
    }
}

/// What holds for all voices of a room at a hop.
#[derive(Clone, Copy)]
pub(crate) struct Together<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) live: LiveParams,
    pub(crate) trim: &'a Trim,
    /// Hops since all filters were brought to a pose.
    pub(crate) share: usize,
}

/// The state of a voice.
pub(crate) struct VoiceState {
    source: Source,
    follower: Follower,
    filters: VoiceFilters,
    parts: Vec<Box<dyn Part>>,
    level: Ramp,
    hop_len: usize,
    /// Whether it need not follow poses in silence, and whether the room follows its.
    sleeps: bool,
    leads: bool,
    /// Hops since there was input, and for which it sounds on.
    quiet: usize,
    longest: usize,
    /// It was switched off.
    off: bool,
    /// Nothing of it sounds, so that it follows no pose.
    asleep: bool,
    /// It is asleep, and the hop that is taken in is silent so far.
    blank: bool,
    /// The next pose is taken at once, and the next level.
    fresh: bool,
    jumps: bool,
    /// The pose of the frame before.
    before: Pose,
    /// Some of the hop has been worked out before it is there, and whether its filters were set out of turn.
    prepared: bool,
    moved: bool,
    /// What the user changes, as it is heard at its pose.
    trim: Trim,
}

/// Explicit taps that each of some voices has of its own.
pub(crate) fn own_taps(voices: usize, shape: &TransferShape) -> usize {
    // The late network hears a source from there on.
    if voices < 2 { shape.taps } else { OWN_TAPS.min(shape.taps - late_lead(shape.taps)) }
}

impl AsRef<VoiceFilters> for VoiceState {
    fn as_ref(&self) -> &VoiceFilters {
        &self.filters
    }
}

impl AsMut<VoiceFilters> for VoiceState {
    fn as_mut(&mut self) -> &mut VoiceFilters {
        &mut self.filters
    }
}

impl VoiceState {
    /// Frames are rendered with the pose of `late` hops ago; the room is heard from the place of the voice that leads.
    pub(crate) fn new(plan: &Plan<'_>, scene: &Arc<Scene>, parts: Vec<Box<dyn Part>>, late: usize, leads: bool) -> Self {
        let Plan { grid, shape, own_taps, .. } = *plan;
        // Where responses were measured, each voice has the lowest bins of all taps.
        let followed = if leads || plan.carriers.measured.is_some() { shape.taps } else { own_taps };
        let filters = VoiceFilters::new(plan);
        let tail = parts.iter().map(|part| part.tail_samples()).max().unwrap_or(0);
        let sleeps = own_taps < shape.taps;
        Self {
            source: Source::new(*grid, late),
            follower: Follower::new(scene, followed + LATE_HOPS + plan.low_hops(), followed),
            level: Ramp::at(1.0),
            hop_len: grid.hop,
            sleeps,
            leads,
            quiet: usize::MAX / 2,
            longest: tail.div_ceil(grid.hop).max(filters.hops() + grid.n_fft.div_ceil(grid.hop)) + 2,
            off: false,
            asleep: sleeps,
            blank: sleeps,
            fresh: true,
            jumps: true,
            before: Pose::IDENTITY,
            prepared: false,
            moved: false,
            trim: Trim::NEUTRAL,
            filters,
            parts,
        }
    }

    /// Gives it what decodes poses.
    pub(crate) fn set_worker(&mut self, worker: Box<dyn DecodeWorker>, scene: &Scene, hop_s: f64) {
        self.follower.set_live(worker, scene, hop_s);
    }

    pub(crate) fn follower(&self) -> &Follower {
        &self.follower
    }

    /// The pose that is rendered with the frame that the hop ends with, once it is known.
    pub(crate) fn next_pose(&self) -> Option<Pose> {
        self.source.next_pose()
    }

    /// The pose that is rendered.
    pub(crate) fn pose(&self) -> Pose {
        self.source.pose()
    }

    /// Samples for which its parts sound on after its input.
    pub(crate) fn tail_samples(&self) -> usize {
        self.parts.iter().map(|part| part.tail_samples()).max().unwrap_or(0)
    }

    /// Takes the next pose of the listener at once.
    pub(crate) fn jump(&mut self, pose: Pose) {
        self.source.jump(pose);
        self.prepared = false;
        self.parts.iter_mut().for_each(|part| part.forget_prepared());
        (self.fresh, self.jumps) = (true, true);
    }

    /// Takes the newest pose of the listener.
    pub(crate) fn note_pose(&mut self, pose: Pose) {
        self.source.note_pose(pose);
    }

    /// Takes some samples of the hop, with a low cut of some corner, Hz, or none.
    pub(crate) fn take(&mut self, span: Range<usize>, voice: &Voice<'_>, low_cut_hz: f32) {
        self.off = voice.off;
        self.level.aim(voice.gain(), self.hop_len);
        let jumps = std::mem::take(&mut self.jumps);
        if jumps || self.asleep {
            self.level.jump();
        }
        self.source.aim(low_cut_hz, jumps);
        let input = if self.asleep && voice.gain() == 0.0 { &[] } else { voice.input };
        // Most of many inputs have no sound at most times.
        self.blank = self.blank && input.is_empty();
        if !self.blank {
            self.source.take(span, input, &mut self.level);
        }
    }

    /// Brings its filters to its pose and to what the user changes; `whole` leaves nothing for the hops to come.
    pub(crate) fn follow(&mut self, together: &Together<'_>, whole: bool) -> Change {
        let Together { scene, live, trim, share } = *together;
        if self.filters.set_decay(trim.decay) {
            self.follower.refresh();
        }
        let pose = self.next_pose().unwrap_or(self.pose());
        let change = self.follower.follow(&pose, &live, (whole, share));
        self.filters.update(self.follower.transfer(), &change);
        self.trim = heard_at(trim, scene, &pose);
        change
    }

    /// Is brought to its pose at once where it has slept or jumped, and then as the hops come.
    fn arrive(&mut self, together: &Together<'_>) {
        let whole = std::mem::take(&mut self.fresh) | std::mem::take(&mut self.asleep);
        if self.leads {
            return;
        }
        if whole {
            self.follow(together, true);
        }
        self.moved |= whole | self.follow(together, false).turn.is_none();
    }

    /// Begins a hop of what does not wait for a frame, from a pose or from that of the frame before.
    pub(crate) fn begin(&mut self, from: Option<Pose>) {
        let filter = self.filters.joined(&self.trim);
        let (from, to) = (from.unwrap_or(self.before), self.source.pose());
        let hop = Hop { from, to, trim: self.trim, filter };
        self.parts.iter_mut().for_each(|part| part.begin(&hop));
    }

    /// Plays samples of the hop that do not wait for a frame.
    pub(crate) fn play(&mut self, span: Range<usize>, together: &Together<'_>, heard: &mut Heard<'_>) {
        if self.blank {
            return;
        }
        if self.asleep {
            self.arrive(together);
            self.filters.forget_joined();
            self.parts.iter_mut().for_each(|part| part.reset());
            self.begin(Some(self.source.pose()));
        }
        for part in &mut self.parts {
            part.take(self.source.newest(), span.clone(), heard);
        }
    }

    /// Ends a hop: transforms its newest frame, after what is played of it by parts that wait for one. `shared` is the transfer
    /// function of the voice that leads. Says whether it is to be heard other than before.
    pub(crate) fn end_hop(
        &mut self,
        together: &Together<'_>,
        shared: Option<&TransferFunction>,
        waits: Option<&mut Heard<'_>>,
        spectrum: &mut Spectrum,
    ) -> bool {
        let was_heard = std::mem::take(&mut self.filters.is_heard);
        let prepared = std::mem::take(&mut self.prepared);
        if self.blank {
            self.before = self.source.step();
            return was_heard;
        }
        let silent = self.source.newest().iter().all(|x| *x == 0.0);
        self.quiet = if silent { self.quiet.saturating_add(1) } else { 0 };
        if self.off && silent && self.level.is_zero() {
            // What still sounds in it is forgotten.
            self.source.silence();
            self.filters.reset();
            self.parts.iter_mut().for_each(|part| part.reset());
            self.quiet = usize::MAX / 2;
        }
        if self.quiet > self.longest && (self.sleeps || self.off) {
            (self.asleep, self.blank) = (true, true);
            self.before = self.source.step();
            return was_heard;
        }
        if !prepared {
            self.arrive(together);
            if waits.is_some() {
                self.begin_at_frame();
            }
        }
        if let Some(shared) = shared {
            let late = &self.follower.transfer().late;
            shared_gains(late, &shared.late, &mut self.filters.gains);
        }
        self.filters.direct_gain = self.trim.direct;
        self.filters.is_heard = true;
        if let Some(heard) = waits {
            let newest = self.source.newest();
            let len = newest.len();
            self.parts.iter_mut().for_each(|part| part.take(newest, 0..len, heard));
        }
        self.source.analyse(spectrum);
        self.filters.write(spectrum);
        self.before = self.source.step();
        std::mem::take(&mut self.moved) | !was_heard
    }

    /// Works out a portion, each of [`VOICE_PORTIONS`] in turn, of what the hop that is taken in needs none of its samples for.
    pub(crate) fn prepare(&mut self, portion: usize, together: &Together<'_>, heard: &mut Heard<'_>) {
        if portion == 0 && !self.blank {
            self.arrive(together);
            self.begin_at_frame();
            self.prepared = true;
        }
        if let Some(portion) = portion.checked_sub(1).filter(|_| self.prepared) {
            self.parts.iter_mut().for_each(|part| part.prepare(portion, heard));
        }
    }

    /// What is given out with a frame is that of the frame before, nearly: it belongs to the pose of that time.
    fn begin_at_frame(&mut self) {
        let (from, to) = (self.source.before(), self.source.before());
        let hop = Hop { from, to, trim: self.trim, filter: None };
        self.parts.iter_mut().for_each(|part| part.begin(&hop));
    }

    /// Leaves the last word on a hop of both ears to its parts.
    pub(crate) fn finish(&mut self, ears: &mut [Vec<f32>; 2]) {
        let published = self.follower.decoded().and_then(|decoded| decoded.published.as_ref());
        self.parts.iter_mut().for_each(|part| part.finish(published, ears));
    }

    /// Is as new again.
    pub(crate) fn reset(&mut self) {
        self.source.reset();
        self.follower.reset();
        self.filters.reset();
        self.parts.iter_mut().for_each(|part| part.reset());
        self.quiet = usize::MAX / 2;
        (self.asleep, self.blank) = (self.sleeps, self.sleeps);
        (self.prepared, self.moved) = (false, false);
        (self.fresh, self.jumps) = (true, true);
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let parts = self.parts.iter().map(|part| part.memory_bytes()).sum::<usize>();
        self.source.memory_bytes() + self.filters.memory_bytes() + parts
    }
}

/// Gains by band that bring a late part from the energy of both ears that it has for one voice to that for another. Gains of
/// late parts are `[ear][band]`, linear amplitudes.
fn shared_gains(wanted: &[f32], shared: &[f32], gains: &mut [f32]) {
    let bands = gains.len();
    for (band, gain) in gains.iter_mut().enumerate() {
        let energy = |late: &[f32]| late[band].powi(2) + late[bands + band].powi(2);
        let (wanted, shared) = (energy(wanted), energy(shared));
        *gain = if shared > 0.0 { (wanted / shared).sqrt().min(MOST_GAIN) } else { 1.0 };
    }
}
