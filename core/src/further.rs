//! Further sources in a renderer's room: each has its own direct sound and early reflections, and all share what comes later.

use crate::decode::follow::Follower;
use crate::render::carriers::Carriers;
use crate::render::head::{RenderHead, Sums};
use crate::render::images::{ImageRenderer, ImageVoices};
use crate::render::lanes::{EarBlocks, blocks_for};
use crate::render::late::late_lead;
use crate::render::waves::WaveBass;
use crate::source::{Source, heard_at};
use crate::stft::Spectrum;
use crate::{Pose, Quality, Scene, StftGrid, Tier, TransferFunction, Trim};
use glam::Vec3;
use promenade_fourier::num_complex::Complex32;
use std::ops::Range;
use std::sync::Arc;

/// The most further sources of one renderer.
pub const MOST_FURTHER: usize = 63;
/// Explicit taps, of a hop each, that a further source has of its own: 60 ms at hops of 5 ms.
const OWN_TAPS: usize = 12;
/// A further source feeds the room that is shared by so much more than the first source, at most: 18 dB.
const MOST_GAIN: f32 = 8.0;

/// What a further source plays.
#[derive(Clone, Copy, Debug, Default)]
pub struct Further<'a> {
    /// Mono samples of the block; what is missing is silent.
    pub input: &'a [f32],
    /// How far it is from the emitter's place in the scene, metres. Its direct sound and its early reflections are those of an
    /// emitter that is moved there with its room ([`crate::EmitterParams::offset`]).
    pub offset: Vec3,
}

/// What further sources play, from some sample of their blocks on.
#[derive(Clone, Copy)]
pub(crate) struct Others<'a> {
    pub(crate) all: &'a [Further<'a>],
    pub(crate) start: usize,
}

impl Others<'_> {
    /// Nothing.
    pub(crate) const NONE: Self = Self { all: &[], start: 0 };

    /// Samples of one source.
    pub(crate) fn samples(&self, number: usize, span: Range<usize>) -> &[f32] {
        let input = self.all.get(number).map_or(&[][..], |further| further.input);
        let at = |sample: usize| (self.start + sample).min(input.len());
        &input[at(span.start)..at(span.end)]
    }

    /// The listener's pose as seen from one source.
    fn pose(&self, number: usize, pose: Pose) -> Pose {
        moved(pose, self.all.get(number).map_or(Vec3::ZERO, |further| further.offset))
    }
}

/// The listener's pose as an emitter sees it that is moved by an offset together with its room.
pub(crate) fn moved(pose: Pose, offset: Vec3) -> Pose {
    Pose { position: pose.position - offset, ..pose }
}

/// One of them.
struct One {
    source: Source,
    follower: Follower,
    head: RenderHead,
    images: Option<ImageVoices>,
    waves: Option<WaveBass>,
    /// Gains by band at which the shared part of the room hears it.
    gains: Vec<f32>,
    /// Hops since there was input.
    quiet: usize,
    /// Nothing of it sounds, so that it follows no pose.
    asleep: bool,
    /// It is asleep, and the hop that is taken in is silent so far.
    blank: bool,
}

/// All of them, and what both ears hear of their frames.
pub(crate) struct FurtherSources {
    all: Vec<One>,
    ears: Vec<EarBlocks>,
    sums: Sums,
    spectrum: Spectrum,
    hop_len: usize,
    /// Hops for which one sounds on after its input has ended, what is shared left out.
    longest: usize,
}

/// What holds for all sources of a room at a hop.
#[derive(Clone, Copy)]
pub(crate) struct Together<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) quality: Quality,
    pub(crate) trim: &'a Trim,
    pub(crate) room_gain: f32,
}

impl FurtherSources {
    /// So many for a scene on a host's grid; frames are rendered with the pose of `late` hops ago.
    pub(crate) fn new(count: usize, scene: &Arc<Scene>, grid: &StftGrid, carriers: &Arc<Carriers>, late: usize) -> Self {
        let shape = scene.shape();
        // The late network hears a source from here on.
        let own = OWN_TAPS.min(shape.taps.saturating_sub(late_lead(shape.taps)));
        let one = || {
            let head = RenderHead::early(*grid, scene.grid(), shape, scene.tail(), Arc::clone(carriers), own);
            let images = carriers.images.as_ref();
            let waves = carriers.waves.as_ref();
            One {
                source: Source::new(*grid, late),
                follower: Follower::of_taps(scene, own + 1, own),
                head,
                images: images.and_then(|filters| ImageVoices::new(scene, grid, filters, &carriers.curve)),
                waves: waves.and_then(|filters| WaveBass::new(scene, grid, filters)),
                gains: vec![1.0; shape.bands],
                quiet: usize::MAX / 2,
                asleep: true,
                blank: true,
            }
        };
        let all: Vec<_> = (0..count.min(MOST_FURTHER)).map(|_| one()).collect();
        let tail = |one: &One| {
            let images = one.images.as_ref().map_or(0, ImageVoices::tail_samples);
            let waves = one.waves.as_ref().map_or(0, WaveBass::tail_samples);
            images.max(waves).div_ceil(grid.hop).max(own + grid.n_fft.div_ceil(grid.hop)) + 2
        };
        Self {
            longest: all.first().map_or(0, tail),
            all,
            ears: vec![EarBlocks::default(); blocks_for(grid.bins())],
            sums: Sums::new(grid),
            spectrum: vec![Complex32::default(); grid.bins()],
            hop_len: grid.hop,
        }
    }

    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.all.len()
    }

    /// Sets the corner of the low cut that is glided to, Hz, or jumped to; 0 for none.
    pub(crate) fn aim(&mut self, low_cut_hz: f32, jump: bool) {
        self.all.iter_mut().for_each(|one| one.source.aim(low_cut_hz, jump));
    }

    /// Takes the next pose of the listener at once.
    pub(crate) fn jump(&mut self, block: &Others<'_>, pose: Pose) {
        for (number, one) in self.all.iter_mut().enumerate() {
            one.source.jump(block.pose(number, pose));
            one.asleep = true;
        }
    }

    /// Takes some samples of the hop, which are those of `span` in the block.
    pub(crate) fn take(&mut self, to: Range<usize>, block: &Others<'_>, span: Range<usize>) {
        for (number, one) in self.all.iter_mut().enumerate() {
            let samples = block.samples(number, span.clone());
            // Most of many inputs have no sound at most times.
            one.blank = one.blank && samples.is_empty();
            if !one.blank {
                one.source.take(to.clone(), samples);
            }
        }
    }

    /// Takes the newest pose of the listener.
    pub(crate) fn note_pose(&mut self, block: &Others<'_>, pose: Pose) {
        for (number, one) in self.all.iter_mut().enumerate() {
            one.source.note_pose(block.pose(number, pose));
        }
    }

    /// Renders a hop of all. `room` is the head of the room that is shared, whose transfer function is `shared`; it hears what
    /// the sources' own taps have passed on. Returns what both ears hear of their frames, `None` where that is nothing.
    pub(crate) fn hop(
        &mut self,
        together: Together<'_>,
        room: &mut RenderHead,
        shared: &TransferFunction,
        mut images: Option<&mut ImageRenderer>,
    ) -> Option<&[EarBlocks]> {
        let mut heard = false;
        for one in &mut self.all {
            let before = one.source.step();
            if one.blank {
                continue;
            }
            let silent = one.source.newest().iter().all(|x| *x == 0.0);
            one.quiet = if silent { one.quiet.saturating_add(1) } else { 0 };
            if one.quiet > self.longest {
                (one.asleep, one.blank) = (true, true);
                continue;
            }
            if !std::mem::replace(&mut heard, true) {
                self.ears.fill(EarBlocks::default());
            }
            one.follow(together, shared);
            let trim = heard_at(together.trim, together.scene, &one.source.pose());
            let newest = one.source.newest();
            if let Some(waves) = &mut one.waves {
                waves.begin(&before, &trim);
                waves.take(newest, 0);
            }
            if let (Some(images), Some(voices)) = (&mut images, &mut one.images) {
                images.take_other(voices, newest, &before, together.quality.tier == Tier::Draft, &trim);
            }
            one.source.analyse(&mut self.spectrum);
            room.join(&one.head, &one.gains, together.room_gain);
            one.head.render_into(&self.spectrum, together.room_gain, &trim, &mut self.sums, &mut self.ears);
        }
        if heard { Some(&self.ears) } else { None }
    }

    /// Adds what is heard of the bass of waves in the hop that was rendered last.
    pub(crate) fn add_waves(&self, ears: &mut [Vec<f32>; 2]) {
        for one in self.all.iter().filter(|one| !one.asleep) {
            if let Some(waves) = &one.waves {
                waves.add_to(0, ears.each_mut().map(|ear| &mut ear[..self.hop_len]));
            }
        }
    }

    /// Is as new again.
    pub(crate) fn reset(&mut self) {
        for one in &mut self.all {
            one.source.reset();
            one.follower.reset();
            one.head.reset();
            one.images.iter_mut().for_each(ImageVoices::reset);
            one.waves.iter_mut().for_each(WaveBass::reset);
            (one.quiet, one.asleep, one.blank) = (usize::MAX / 2, true, true);
        }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let one = |one: &One| {
            let images = one.images.as_ref().map_or(0, ImageVoices::memory_bytes);
            let waves = one.waves.as_ref().map_or(0, WaveBass::memory_bytes);
            one.source.memory_bytes() + one.head.memory_bytes() + images + waves
        };
        self.all.iter().map(one).sum::<usize>() + 4 * size_of_val(&*self.ears) + size_of_val(&*self.spectrum)
    }
}

impl One {
    /// Brings the head to the pose and to what the user changes.
    fn follow(&mut self, together: Together<'_>, shared: &TransferFunction) {
        // The first pose after a silence is taken at once, before the hop begins.
        if std::mem::take(&mut self.asleep) {
            self.bring(together, true);
        }
        self.bring(together, false);
        shared_gains(&self.follower.transfer().late, &shared.late, &mut self.gains);
    }

    fn bring(&mut self, together: Together<'_>, whole: bool) {
        if self.head.set_decay(together.trim.decay) {
            self.follower.refresh();
        }
        let quality = Quality { tier: together.quality.tier.min(Tier::Standard), ..together.quality };
        let change = self.follower.follow(&self.source.pose(), &quality, whole, together.room_gain > 0.0);
        self.head.update(self.follower.transfer(), &change, quality.tier != Tier::Draft);
    }
}

/// Gains by band that bring a late part from the energy of both ears that it has for one source to that for another. Gains of
/// late parts are `[ear][band]`, linear amplitudes.
fn shared_gains(wanted: &[f32], shared: &[f32], gains: &mut [f32]) {
    let bands = gains.len();
    for (band, gain) in gains.iter_mut().enumerate() {
        let energy = |late: &[f32]| late[band].powi(2) + late[bands + band].powi(2);
        let (wanted, shared) = (energy(wanted), energy(shared));
        *gain = if shared > 0.0 { (wanted / shared).sqrt().min(MOST_GAIN) } else { 1.0 };
    }
}
