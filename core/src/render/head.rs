//! The render head: applies a transfer function to short-time spectra.

use crate::decode::{Change, Hops, QUICK_BELOW_HZ, TURNS};
use crate::number::whole;
use crate::render::ahead::{Ahead, Applied, FRAMES, group};
use crate::render::bass::Bass;
use crate::render::carriers::Carriers;
use crate::render::decay::Decay;
use crate::render::direct::DirectFilter;
use crate::render::lanes::{Accumulate, Block, EarBlocks, LANES, blocks_for};
use crate::render::late::late_lead;
use crate::render::later::Later;
use crate::render::meeting::Mixture;
use crate::render::ring::Ring;
use crate::render::taps::{Taps, add_mix};
use crate::{EARLY_S, StftGrid, TAP_LEAD_HOPS, TailModel, TransferFunction, TransferShape, Trim};
use glam::Quat;
use promenade_fourier::num_complex::Complex32;
use pulp::{Arch, WithSimd};
use std::ops::Range;
use std::sync::Arc;

/// Taps that share the direct sound's interaural delay. The first reflections, of floor and ceiling, come from the source's
/// lateral angle: in measured rooms the ears' coherence below 1.5 kHz is about 0.5 at that delay and 0.25 without it over these
/// hops, and the same either way later.
pub(crate) const DELAYED_TAPS: usize = 2;

/// Streaming form of AV-Cloud's Spatial Audio Render Head: masks and interaural delay for the direct sound, complex taps with
/// fixed carriers for the room, and an exponential late part that feeds itself.
///
/// Per bin k and frame t: `Y[k,t] = D[k] X[k,t] + sum_l g_l[k] C_l[k] X[k,t-l] + sum_j h_j[k] E_j[k] Z[k,t-j]`, with `l` from 1
/// to the number of taps and `Z` the output of [`Late`](crate::render::late::Late).
pub(crate) struct RenderHead {
    arch: Arch,
    shape: TransferShape,
    /// Blocks of bins that follow a pose quickly.
    quick_blocks: usize,
    direct: DirectFilter,
    taps: Taps,
    /// What comes after the taps; another source's where there is none.
    later: Option<Later>,
    /// Later taps and the late part in the bins that follow slowly, where they are worked out for several frames at once.
    ahead: Option<Ahead>,
    /// The group of these bins whose turn it is.
    turn: usize,
    bass: Bass,
    carriers: Arc<Carriers>,
    decay: Decay,
    /// Explicit taps that are early reflections.
    early_taps: usize,
    /// Hops, the direct sound the first, that are played without waiting for a frame: all frames come so many hops earlier.
    apart: usize,
    /// The filter of these, and the levels that it was added up with, as long as its parts have not changed.
    joined: Vec<EarBlocks>,
    joined_at: Option<(f32, Trim)>,
    /// Gains of a tap, both ears.
    tap_gains: Vec<f32>,
    /// How much of a mix of responses is left as it is, by ear and band.
    plain: Vec<[f32; LANES]>,
    /// The newest input spectra, at least one more than there are taps.
    input: Ring,
    sums: Sums,
    /// Frames since anything was heard.
    dead_frames: usize,
}

/// Room in which a frame's parts are added up.
#[derive(Default)]
pub(crate) struct Sums {
    direct: Vec<EarBlocks>,
    room: Vec<EarBlocks>,
    /// What comes after the early reflections, where its level is another than theirs.
    late: Vec<EarBlocks>,
}

impl Sums {
    pub(crate) fn new(grid: &StftGrid) -> Self {
        let silent = || vec![EarBlocks::default(); blocks_for(grid.bins())];
        Self { direct: silent(), room: silent(), late: silent() }
    }
}

impl RenderHead {
    /// Prepares for a host grid; `scene_grid` is the one the transfer functions are sampled on.
    pub(crate) fn new(
        grid: StftGrid,
        scene_grid: &StftGrid,
        shape: TransferShape,
        tail: &TailModel,
        carriers: Arc<Carriers>,
    ) -> Self {
        let mut head = Self::early(grid, scene_grid, shape, tail, carriers, shape.taps);
        head.sums = Sums::new(&grid);
        let has_time = head.late_age() >= FRAMES - 1 && head.apart + FRAMES - 2 < shape.taps;
        head.ahead = has_time.then(|| Ahead::new(head.quick_blocks..head.direct.blocks().len()));
        let ahead = if has_time { FRAMES - 1 } else { 0 };
        head.later = Some(Later::new(&grid, scene_grid, shape, tail, &head.carriers, &head.decay, ahead));
        head
    }

    /// Frames by which the one that feeds the late network at a frame is older than it.
    fn late_age(&self) -> usize {
        self.shape.taps + 1 - late_lead(self.shape.taps) - self.apart
    }

    /// A head of the first `taps` explicit taps alone, without room to add up in: what comes later is for another head to
    /// play ([`RenderHead::join`]).
    pub(crate) fn early(
        grid: StftGrid,
        scene_grid: &StftGrid,
        shape: TransferShape,
        tail: &TailModel,
        carriers: Arc<Carriers>,
        taps: usize,
    ) -> Self {
        let blocks = blocks_for(grid.bins());
        let apart = carriers.pace.early_hops();
        let places = &carriers.places;
        let decay = Decay::new(&grid, tail, places, Arc::clone(&carriers.curve), shape.taps);
        let bass = Bass::new(carriers.measured.as_ref().map(|m| &m.bass), apart);
        let slots = (taps + 1).max(bass.hops());
        let mixed_vectors = carriers.measured.as_ref().map_or(0, |m| m.meeting.vectors());
        Self {
            arch: Arch::new(),
            shape: TransferShape { taps, ..shape },
            quick_blocks: blocks_for(whole(QUICK_BELOW_HZ / grid.bin_hz(1))).min(blocks),
            direct: DirectFilter::new(&grid, scene_grid, carriers.top_hz),
            taps: Taps::new(taps, places, shape.bands),
            later: None,
            ahead: None,
            turn: 0,
            bass,
            carriers,
            decay,
            early_taps: whole(EARLY_S / grid.hop_s() - TAP_LEAD_HOPS).min(taps).max(apart),
            apart,
            joined: vec![EarBlocks::default(); if apart > 0 { blocks } else { 0 }],
            joined_at: None,
            tap_gains: vec![0.0; shape.tap_len()],
            plain: vec![[0.0; LANES]; mixed_vectors],
            input: Ring::new(blocks, slots),
            sums: Sums::default(),
            dead_frames: usize::MAX / 2,
        }
    }

    /// Explicit taps, late hops and hops of the bass together: what [`RenderHead::update`] counts.
    pub(crate) fn filter_hops(&self) -> usize {
        self.shape.taps + self.later.as_ref().map_or(0, Later::hops)
    }

    /// What the taps are made of.
    pub(crate) fn carriers(&self) -> Arc<Carriers> {
        Arc::clone(&self.carriers)
    }

    /// Sets the reverberation time as a multiple of the scene's. Returns whether it has changed: then all time filters are to
    /// be brought up to date.
    pub(crate) fn set_decay(&mut self, times: f32) -> bool {
        let changed = self.decay.set(times);
        if let Some(later) = self.later.as_mut().filter(|_| changed) {
            later.decay_by(&self.decay);
        }
        changed
    }

    /// Turns the late field with the head, at once or as the frames come.
    pub(crate) fn face(&mut self, orientation: Quat, at_once: bool) {
        self.later.iter_mut().for_each(|later| later.face(orientation, at_once));
    }

    /// Takes what has changed in a transfer function; `room` says whether more than the direct sound is wanted.
    pub(crate) fn update(&mut self, tf: &TransferFunction, change: &Change, room: bool) {
        if change.direct || (1..self.apart).any(|hop| change.names_tap(hop - 1)) {
            self.joined_at = None;
        }
        if change.direct {
            self.bass.forget_pose();
            self.direct.set(tf);
            if let Some(measured) = &self.carriers.measured {
                let mixed = (tf.shares.entries(), measured.lifted(0, &tf.shares));
                add_mix(self.arch, &measured.first, 0, mixed, tf.shares.direct_gain, self.direct.blocks_mut());
            }
        }
        if let Some(measured) = self.carriers.measured.as_ref().filter(|_| !room) {
            self.bass.set(&measured.bass, tf.shares.entries(), tf.shares.direct_gain);
        }
        match change.turn {
            Some(turn) => self.turn = turn,
            None => self.ahead.iter_mut().for_each(Ahead::forget),
        }
        if [change.filters, change.quick] == <[[Hops; 2]; 2]>::default() {
            return;
        }
        let taps = self.shape.taps;
        let carriers = Arc::clone(&self.carriers);
        let mut plain = std::mem::take(&mut self.plain);
        let mixture = carriers.measured.as_ref().map(|m| m.meeting.mixture(tf.shares.entries(), &mut plain));
        if let (Some(later), Some(mixture)) = (&mut self.later, &mixture)
            && change.filters != <[Hops; 2]>::default()
        {
            later.go_on(tf, mixture);
        }
        let (quick, slow) = (0..self.quick_blocks, self.quick_blocks..self.direct.blocks().len());
        let group = change.turn.map_or(slow.clone(), |turn| group(&slow, turn));
        for hop in (0..taps).filter(|hop| change.names_tap(*hop)) {
            let is_due = |hops: &[Hops; 2]| hops.iter().any(|hops| hops.contains(hop));
            let blocks = [(is_due(&change.quick), quick.clone()), (is_due(&change.filters), group.clone())];
            let blocks = blocks.into_iter().filter(|(is_due, _)| *is_due).map(|(_, blocks)| blocks);
            self.update_tap(tf, mixture.as_ref(), hop, blocks);
        }
        for hop in change.filters[1].iter().filter(|hop| *hop >= taps) {
            if let Some(later) = &mut self.later {
                // Each hop has one turn in which the bins that follow quickly have it too.
                let is_due = change.turn.is_none_or(|turn| hop % TURNS == turn);
                let quick = Some(quick.clone()).filter(|_| is_due);
                later.set(hop - taps, tf, &mut self.decay, &carriers, quick, group.clone());
            }
        }
        self.plain = plain;
    }

    /// Brings some blocks of bins of a tap to the pose.
    fn update_tap(
        &mut self,
        tf: &TransferFunction,
        mixture: Option<&Mixture<'_>>,
        hop: usize,
        blocks: impl Iterator<Item = Range<usize>>,
    ) {
        self.tap_gains.copy_from_slice(&tf.taps[hop * self.shape.tap_len()..(hop + 1) * self.shape.tap_len()]);
        if let Some(mixture) = mixture {
            mixture.apply(self.arch, hop, &tf.late, &mut self.tap_gains);
        }
        let gains = self.decay.gains(&self.tap_gains, hop + 1);
        let lost = self.carriers.measured.as_ref().and_then(|measured| measured.lifted(hop + 1, &tf.shares));
        for blocks in blocks {
            self.taps.set(hop, &self.carriers.taps, tf.shares.entries(), gains, blocks.clone(), lost);
            if hop < DELAYED_TAPS && self.carriers.measured.is_none() {
                self.taps.turn(hop, self.direct.turn(), blocks);
            }
        }
    }

    /// Lets this room be heard after the first taps of another source, which are its own: takes the frame that they have just
    /// passed on, at gains per band. To be called before either head renders its next frame at `room_gain`.
    pub(crate) fn join(&mut self, other: &Self, gains: &[f32], room_gain: f32) {
        // As old as the frame that the last of its taps has had.
        let age = other.shape.taps;
        // Where only direct sound is heard, its bass would hear the frame as its own.
        let apart = room_gain > 0.0 || self.bass.hops() <= age + 1;
        if other.is_dead() || age + 1 >= self.input.slots() || !apart {
            return;
        }
        self.taps.inject(gains, other.input.at(age), self.input.at_mut(age));
        if let (Some(later), Some(lowest)) = (&mut self.later, self.input.at(age).blocks().next()) {
            later.rewrite(age, lowest);
        }
        self.dead_frames = 0;
    }

    /// Whether nothing has sounded for so long that nothing is left.
    fn is_dead(&self) -> bool {
        self.dead_frames > self.filter_hops().max(self.input.slots()) + 1
    }

    /// Applies the filters to the newest frame, everything but the direct sound at `room_gain`, 0 to 1, and each part at its
    /// level, and adds what both ears hear of other sources. `None` when nothing sounds any more: both ears are silent.
    pub(crate) fn render(
        &mut self,
        spectrum: &[Complex32],
        room_gain: f32,
        trim: &Trim,
        others: Option<&[EarBlocks]>,
        ears: [&mut [Complex32]; 2],
    ) -> Option<()> {
        if others.is_some() {
            self.dead_frames = 0;
        }
        let arch = self.arch;
        let mut sums = std::mem::take(&mut self.sums);
        let heard = self.sum(spectrum, room_gain, trim, &mut sums);
        if let Some(heard) = heard {
            for (ear, out) in ears.into_iter().enumerate() {
                arch.dispatch(Mix { ear, heard, others, out });
            }
        }
        let sounds = heard.map(|_| ());
        self.sums = sums;
        sounds
    }

    /// Renders a frame and adds it to what both ears hear of others; `sums` is room to work in.
    pub(crate) fn render_into(
        &mut self,
        spectrum: &[Complex32],
        room_gain: f32,
        trim: &Trim,
        sums: &mut Sums,
        ears: &mut [EarBlocks],
    ) {
        let arch = self.arch;
        if let Some(heard) = self.sum(spectrum, room_gain, trim, sums) {
            arch.dispatch(MixInto { heard, ears });
        }
    }

    /// Applies the filters to the newest frame.
    fn sum<'a>(&mut self, spectrum: &[Complex32], room_gain: f32, trim: &Trim, sums: &'a mut Sums) -> Option<Heard<'a>> {
        let has_room = room_gain > 0.0;
        let silent = spectrum.iter().all(|x| x.re == 0.0 && x.im == 0.0);
        if silent && self.is_dead() {
            return None;
        }
        let late_age = self.late_age();
        self.input.write(spectrum);
        if let Some(later) = &mut self.later {
            later.write(spectrum);
            if has_room {
                later.advance(self.input.at(late_age - later.ahead()));
            }
        }
        let dead = silent && (!has_room || self.later.as_ref().is_none_or(Later::is_silent));
        self.dead_frames = if dead { self.dead_frames.saturating_add(1) } else { 0 };

        let Sums { direct, room, late } = sums;
        direct.fill(EarBlocks::default());
        let (arch, input) = (self.arch, &self.input);
        let (filter, hops) = (self.taps.filters(), self.taps.hops());
        // What is played apart is the direct sound and the taps before this one.
        let first = self.apart.saturating_sub(1);
        let add_taps = |taps: Range<usize>, sums: &mut [EarBlocks]| {
            let newest = [input.at(taps.start + 1 - self.apart)];
            Accumulate { arch, newest, filter, hops, taps, sums }.run();
        };
        if self.apart == 0 {
            let filter = self.direct.blocks();
            Accumulate { arch, newest: [input.at(0)], filter, hops: 1, taps: 0..1, sums: direct }.run();
        }
        self.bass.add(input.at(0), 1.0 - room_gain, direct);
        let apart = trim.early != trim.late;
        if has_room {
            room.fill(EarBlocks::default());
            let early = if apart { self.early_taps } else { self.shape.taps };
            match (self.ahead.as_mut().filter(|_| !apart), &self.later) {
                (Some(ahead), Some(later)) => {
                    // The first tap whose frame is the newest for the last of the frames.
                    let next = self.apart + FRAMES - 2;
                    add_taps(first..next, room);
                    let quick = &mut room[..ahead.first()];
                    add_taps(next..early, quick);
                    later.add(quick);
                    let taps = Applied { newest: input.at(0), right: None, filter, hops, first_tap: next };
                    ahead.add(self.turn, &[taps, later.applied()], room);
                }
                (_, later) => {
                    add_taps(first..early, room);
                    let rest = if apart { &mut *late } else { &mut *room };
                    if apart {
                        rest.fill(EarBlocks::default());
                        add_taps(early..self.shape.taps, rest);
                    }
                    if let Some(later) = later {
                        later.add(rest);
                    }
                }
            }
        }
        if apart || !has_room {
            self.ahead.iter_mut().for_each(Ahead::forget);
        }
        let late = if apart { Some(&late[..]) } else { None };
        Some(Heard { direct, room, late, gains: Gains::new(room_gain, trim) })
    }

    /// The filter of the hops that are played apart, on the host's bins, each hop at its time, where it has changed since
    /// it was asked for.
    pub(crate) fn joined(&mut self, room_gain: f32, trim: &Trim) -> Option<&[EarBlocks]> {
        if self.joined_at.replace((room_gain, *trim)) == Some((room_gain, *trim)) {
            return None;
        }
        let gains = Gains::new(room_gain, trim);
        let bass = (self.bass.filters(), self.bass.hops(), 1.0 - room_gain);
        self.arch.dispatch(Join {
            direct: self.direct.blocks(),
            taps: (self.taps.filters(), self.taps.hops()),
            bass,
            count: self.apart,
            gains,
            out: &mut self.joined,
        });
        Some(&self.joined)
    }

    /// Empties the late part.
    pub(crate) fn forget_late(&mut self) {
        self.later.iter_mut().for_each(Later::forget);
        self.ahead.iter_mut().for_each(Ahead::forget);
    }

    /// Leaves time for what other sources' heads bring ([`RenderHead::join`]): every frame is worked out as late as it can be.
    pub(crate) fn wait_for_others(&mut self) {
        self.ahead = None;
        self.later.iter_mut().for_each(Later::wait);
    }

    pub(crate) fn reset(&mut self) {
        self.input.reset();
        self.joined_at = None;
        self.later.iter_mut().for_each(Later::reset);
        self.ahead.iter_mut().for_each(Ahead::forget);
        self.dead_frames = usize::MAX / 2;
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let ear_blocks = self.joined.len() + 3 * self.sums.direct.len() + self.direct.blocks().len();
        ear_blocks * size_of::<EarBlocks>()
            + self.input.memory_bytes()
            + self.taps.memory_bytes()
            + self.later.as_ref().map_or(0, Later::memory_bytes)
            + self.ahead.as_ref().map_or(0, Ahead::memory_bytes)
            + self.bass.memory_bytes()
            + self.decay.memory_bytes()
    }
}

/// Levels of the parts of what is heard.
#[derive(Clone, Copy)]
struct Gains {
    direct: f32,
    early: f32,
    late: f32,
    /// Level of the difference between the ears in the room's sound.
    width: f32,
}

impl Gains {
    fn new(room_gain: f32, trim: &Trim) -> Self {
        Self { direct: trim.direct, early: room_gain * trim.early, late: room_gain * trim.late, width: trim.width }
    }

    /// What an ear hears of its own sum, and of the other ear's.
    fn across(&self) -> [f32; 2] {
        [0.5 + 0.5 * self.width, 0.5 - 0.5 * self.width]
    }
}

/// Adds up the filters of the first hops, each hop at its time, in frames of four hops.
struct Join<'a> {
    direct: &'a [EarBlocks],
    /// Filters as `[block][hop]`, and their hops.
    taps: (&'a [EarBlocks], usize),
    /// The direct sound's bass as `[block][hop]`, its hops and its level.
    bass: (&'a [EarBlocks], usize, f32),
    count: usize,
    gains: Gains,
    out: &'a mut [EarBlocks],
}

/// By what each bin of a block turns in a quarter of the frame, times so many hops: real and imaginary part.
fn quarter_turns(hops: usize) -> [[f32; LANES]; 2] {
    let turn = |i: usize| [(1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (0.0, 1.0)][i * hops % 4];
    [std::array::from_fn(|i| turn(i).0), std::array::from_fn(|i| turn(i).1)]
}

impl WithSimd for Join<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _simd: S) {
        let Self { direct, taps: (taps, taps_hops), bass: (bass, bass_hops, bass_gain), count, gains, out } = self;
        let [own, other] = gains.across().map(|share| share * gains.early);
        for ((block, out), direct) in out.iter_mut().enumerate().zip(direct) {
            for ear in 0..2 {
                out.ears[ear] = scaled(&direct.ears[ear], gains.direct);
            }
            for hop in 0..count {
                let mut here = EarBlocks::default();
                if let Some(bass) = bass.get(block * bass_hops + hop).filter(|_| hop < bass_hops && bass_gain != 0.0) {
                    for ear in 0..2 {
                        add(&mut here.ears[ear], bass, ear, [bass_gain * gains.direct, 0.0]);
                    }
                }
                if let Some(tap) = hop.checked_sub(1).map(|tap| &taps[block * taps_hops + tap]) {
                    for ear in 0..2 {
                        add(&mut here.ears[ear], tap, ear, [own, other]);
                    }
                }
                let [cos, sin] = quarter_turns(hop);
                for (out, here) in out.ears.iter_mut().zip(&here.ears) {
                    for i in 0..LANES {
                        out.re[i] += cos[i] * here.re[i] - sin[i] * here.im[i];
                        out.im[i] += cos[i] * here.im[i] + sin[i] * here.re[i];
                    }
                }
            }
        }
    }
}

/// What is heard of a frame, before its parts have their levels.
#[derive(Clone, Copy)]
struct Heard<'a> {
    direct: &'a [EarBlocks],
    /// Early reflections, with all that comes later where that has no sum of its own.
    room: &'a [EarBlocks],
    late: Option<&'a [EarBlocks]>,
    gains: Gains,
}

impl Heard<'_> {
    /// A block of what an ear hears: direct sound, room and, where it has a sum of its own, what comes later.
    #[inline(always)]
    fn block(&self, ear: usize, block: usize) -> Block {
        let Self { direct, room, late, gains } = self;
        let mut sum = scaled(&direct[block].ears[ear], gains.direct);
        let [own, other] = gains.across();
        add(&mut sum, &room[block], ear, [own * gains.early, other * gains.early]);
        if let Some(late) = late {
            add(&mut sum, &late[block], ear, [own * gains.late, other * gains.late]);
        }
        sum
    }
}

/// Writes what one ear hears, with what it hears of other sources.
struct Mix<'a> {
    ear: usize,
    heard: Heard<'a>,
    others: Option<&'a [EarBlocks]>,
    out: &'a mut [Complex32],
}

impl Mix<'_> {
    #[inline(always)]
    fn block(&self, block: usize, out: &mut [Complex32]) {
        let mut sum = self.heard.block(self.ear, block);
        if let Some(others) = self.others {
            add(&mut sum, &others[block], self.ear, [1.0, 0.0]);
        }
        for (i, x) in out.iter_mut().enumerate() {
            *x = Complex32::new(sum.re[i], sum.im[i]);
        }
    }
}

/// Adds what both ears hear to their sums.
struct MixInto<'a> {
    heard: Heard<'a>,
    ears: &'a mut [EarBlocks],
}

impl WithSimd for MixInto<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _simd: S) {
        for (block, ears) in self.ears.iter_mut().enumerate() {
            for (ear, sum) in ears.ears.iter_mut().enumerate() {
                let heard = self.heard.block(ear, block);
                for i in 0..LANES {
                    sum.re[i] += heard.re[i];
                    sum.im[i] += heard.im[i];
                }
            }
        }
    }
}

#[inline(always)]
fn scaled(block: &Block, gain: f32) -> Block {
    let mut out = *block;
    for i in 0..LANES {
        out.re[i] *= gain;
        out.im[i] *= gain;
    }
    out
}

/// Adds some of an ear's sound and of the other's, which mostly has no share.
#[inline(always)]
fn add(sum: &mut Block, ears: &EarBlocks, ear: usize, [own, other]: [f32; 2]) {
    for (ear, gain) in [(ear, own), (1 - ear, other)] {
        if gain != 0.0 {
            let part = &ears.ears[ear];
            for i in 0..LANES {
                sum.re[i] += gain * part.re[i];
                sum.im[i] += gain * part.im[i];
            }
        }
    }
}

impl WithSimd for Mix<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(mut self, _simd: S) {
        let out = std::mem::take(&mut self.out);
        let (whole, rest) = out.as_chunks_mut::<LANES>();
        for (block, out) in whole.iter_mut().enumerate() {
            self.block(block, out);
        }
        if !rest.is_empty() {
            self.block(whole.len(), rest);
        }
    }
}

#[cfg(test)]
mod tests;
