//! Values that a host sends once a block, drawn out over the block.
//!
//! Hosts that read automation at the start of each block make stairs of a line, and stairs are heard: lines beside a tone while
//! the head turns. A host that gives its changes samples of their own makes no stairs, and means its steps.

use super::pose_sources::Sources;
use super::snapshot::{FurtherPlace, Snapshot};
use crate::parameter::cast::narrow;
use crate::project::host_values::Arrived;
use promenade_core::glam::Vec3;
use promenade_core::{BlockParams, EmitterParams, Trim};

/// Changes that are nearer to each other, and shorter blocks, are taken as they come, samples.
const FINE: usize = 64;
/// Samples after which a block's settings move on.
pub(crate) const STRETCH: usize = 64;
/// What turns faster is no line of automation but a step, radians a second.
const FASTEST_TURN: f32 = 300.0 * std::f32::consts::PI / 180.0;
/// What moves faster is a step, metres a second.
const FASTEST_M: f32 = 10.0;
/// A gain that changes by more in a block is a step: 3 dB.
const LARGEST_GAIN: f32 = 1.413;
/// So is a share that does.
const LARGEST_SHARE: f32 = 0.1;
/// So is a place on the camera path.
const LARGEST_PLACE: f64 = 0.02;

/// The values of one instance from block to block. The audio thread owns it.
#[derive(Default)]
pub(crate) struct Ramps<const FURTHER: usize> {
    last: Option<Snapshot<FURTHER>>,
    /// Samples since values last changed.
    since: usize,
    /// Whether the host has given any change a sample of its own.
    is_placed: bool,
}

/// A stretch of a block over which the host changes nothing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stretch {
    /// Samples.
    pub(crate) len: usize,
    /// Whether the transport was moved to it.
    pub(crate) jumps: bool,
    /// What the host has changed at its beginning.
    pub(crate) arrived: Arrived,
}

impl<const FURTHER: usize> Ramps<FURTHER> {
    /// The values from which a stretch moves to its own; none where it has its own from the beginning.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn follow(
        &mut self,
        now: &Snapshot<FURTHER>,
        Stretch { len, jumps, arrived }: Stretch,
        sample_rate_hz: f64,
    ) -> Option<Snapshot<FURTHER>> {
        self.is_placed |= arrived.is_placed;
        let Some(last) = self.last.replace(*now) else {
            self.since = len;
            return None;
        };
        let changed = parts(&last) != parts(now);
        let since = if changed { std::mem::take(&mut self.since) } else { 0 };
        self.since = self.since.saturating_add(len);
        // A line brings a value with each block or every other; what comes by itself is a step.
        let is_step = arrived.any && (self.is_placed || since > 2 * len);
        if jumps || is_step || len <= FINE || since <= FINE {
            return None;
        }
        let start = beginning(&last, now, narrow(len as f64 / sample_rate_hz));
        (parts(&start) != parts(now)).then_some(start)
    }
}

/// What is drawn out.
fn parts<const FURTHER: usize>(values: &Snapshot<FURTHER>) -> (Sources, f32, f32, Trim, EmitterParams, &[FurtherPlace]) {
    let BlockParams { mix, gain, trim, emitters, .. } = values.block;
    (values.sources, mix, gain, trim, emitters, &values.further)
}

/// The new values, but where they are a small step away from the last ones, those.
fn beginning<const FURTHER: usize>(last: &Snapshot<FURTHER>, now: &Snapshot<FURTHER>, length_s: f32) -> Snapshot<FURTHER> {
    let mut start = *now;
    let (reach, turn) = (FASTEST_M * length_s, FASTEST_TURN * length_s);
    let is_near = |a: Vec3, b: Vec3| a.distance(b) <= reach;
    let (from, to) = (&last.sources, &now.sources);
    if is_near(from.knobs.position, to.knobs.position) && from.knobs.orientation.angle_between(to.knobs.orientation) <= turn {
        start.sources.knobs = from.knobs;
    }
    if (from.path_share - to.path_share).abs() <= LARGEST_PLACE {
        start.sources.path_share = from.path_share;
    }
    let (from, to) = (&last.block, &now.block);
    let share = |from: f32, to: f32| if (from - to).abs() <= LARGEST_SHARE { from } else { to };
    let gain = |from: f32, to: f32| {
        let is_small = from > 0.0 && to > 0.0 && (from / to).max(to / from) <= LARGEST_GAIN;
        if is_small { from } else { to }
    };
    if is_near(from.emitters.offset, to.emitters.offset) && (from.emitters.spread - to.emitters.spread).abs() <= turn {
        start.block.emitters = from.emitters;
    }
    for (start, old) in start.further.iter_mut().zip(&last.further) {
        if is_near(old.offset, start.offset) {
            start.offset = old.offset;
        }
        start.gain = gain(old.gain, start.gain);
    }
    start.block.mix = share(from.mix, to.mix);
    start.block.gain = gain(from.gain, to.gain);
    start.block.trim = Trim {
        direct: gain(from.trim.direct, to.trim.direct),
        early: gain(from.trim.early, to.trim.early),
        late: gain(from.trim.late, to.trim.late),
        decay: share(from.trim.decay, to.trim.decay),
        distance_law: share(from.trim.distance_law, to.trim.distance_law),
        width: share(from.trim.width, to.trim.width),
        ..to.trim
    };
    start
}

/// Place and level of a further source at a share of the way through a block, 0 to 1.
pub(crate) fn place_at(from: &FurtherPlace, to: &FurtherPlace, share: f32) -> FurtherPlace {
    FurtherPlace { offset: from.offset.lerp(to.offset, share), gain: from.gain + share * (to.gain - from.gain) }
}

/// The settings at a share of the way through a block, 0 to 1.
pub(crate) fn at(from: &BlockParams, to: &BlockParams, share: f32) -> BlockParams {
    let mid = |from: f32, to: f32| from + share * (to - from);
    BlockParams {
        mix: mid(from.mix, to.mix),
        gain: mid(from.gain, to.gain),
        trim: Trim {
            direct: mid(from.trim.direct, to.trim.direct),
            early: mid(from.trim.early, to.trim.early),
            late: mid(from.trim.late, to.trim.late),
            decay: mid(from.trim.decay, to.trim.decay),
            distance_law: mid(from.trim.distance_law, to.trim.distance_law),
            width: mid(from.trim.width, to.trim.width),
            ..to.trim
        },
        emitters: EmitterParams {
            offset: from.emitters.offset.lerp(to.emitters.offset, share),
            spread: mid(from.emitters.spread, to.emitters.spread),
        },
        ..*to
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::params::PromenadeParams;
    use promenade_core::Pose;

    const RATE_HZ: f64 = 48_000.0;

    /// Values with the head turned, degrees, and a gain, dB.
    fn values(yaw_deg: f32, gain_db: f32) -> Snapshot<4> {
        let mut values = Snapshot::of(&PromenadeParams::default().with_further(4), None);
        values.sources.knobs = Pose::from_ypr(Vec3::ZERO, yaw_deg.to_radians(), 0.0, 0.0);
        values.block.gain = 10_f32.powf(gain_db / 20.0);
        values
    }

    const ONCE: Arrived = Arrived { at: 0, any: true, is_placed: false };

    /// Whether each block of values begins with those of the block before.
    fn drawn_out(blocks: &[(Snapshot<4>, usize)]) -> Vec<bool> {
        let mut ramps = Ramps::default();
        let mut follow = |(values, len): &(Snapshot<4>, usize)| {
            ramps.follow(values, Stretch { len: *len, jumps: false, arrived: ONCE }, RATE_HZ).is_some()
        };
        blocks.iter().map(&mut follow).collect()
    }

    #[test]
    fn once_a_block_is_drawn_out_and_what_comes_often_or_is_a_step_is_not() {
        let line = [0.0, 1.0, 2.0, 2.0, 3.0].map(|yaw| (values(yaw, 0.0), 1024));
        assert_eq!(drawn_out(&line), [false, true, true, false, true]);
        let fine = [0.0, 0.03, 0.06].map(|yaw| (values(yaw, 0.0), 32));
        // A long block that ends a line of fine ones is its last point.
        assert_eq!(drawn_out(&[&fine[..], &[(values(0.09, 0.0), 1024)]].concat()), [false; 4]);
        assert_eq!(drawn_out(&[0.0, 45.0].map(|yaw| (values(yaw, 0.0), 1024))), [false; 2]);
        assert_eq!(drawn_out(&[0.0, -6.0].map(|gain| (values(0.0, gain), 1024))), [false; 2]);
        assert_eq!(drawn_out(&[0.0, -1.0].map(|gain| (values(0.0, gain), 1024))), [false, true]);
        let mut ramps = Ramps::default();
        let mut moved =
            |yaw, jumps| ramps.follow(&values(yaw, 0.0), Stretch { len: 1024, jumps, arrived: ONCE }, RATE_HZ).is_none();
        assert!(moved(0.0, false));
        assert!(moved(1.0, true), "the transport was moved");
    }

    #[test]
    fn what_comes_by_itself_or_with_a_sample_of_its_own_is_a_step() {
        let follow = |ramps: &mut Ramps<4>, yaw, len, arrived| {
            ramps.follow(&values(yaw, 0.0), Stretch { len, jumps: false, arrived }, RATE_HZ).is_some()
        };
        let mut ramps = Ramps::default();
        let still = [0.0; 4].map(|yaw| follow(&mut ramps, yaw, 512, Arrived::default()));
        assert_eq!((still, follow(&mut ramps, 1.0, 512, ONCE)), ([false; 4], false), "by itself");
        assert!(follow(&mut ramps, 2.0, 512, ONCE), "a line");
        // Its samples show in the block's first stretch already.
        let placed = Arrived { at: 0, any: true, is_placed: true };
        assert_eq!([3.0, 4.0].map(|yaw| follow(&mut ramps, yaw, 256, placed)), [false; 2]);
        assert!(!follow(&mut ramps, 5.0, 512, ONCE), "a host that places its changes");
        assert!(follow(&mut ramps, 6.0, 512, Arrived::default()), "the editor's, which have no samples");
    }

    #[test]
    fn a_further_source_that_moves_a_little_is_drawn_out() {
        let at = |x: f32| {
            let mut values = values(0.0, 0.0);
            values.further[3].offset = Vec3::X * x;
            values
        };
        assert_eq!(drawn_out(&[0.0, 0.1, 5.0].map(|x| (at(x), 1024))), [false, true, false]);
        let start = beginning(&at(0.0), &at(0.1), 0.02);
        assert_eq!(place_at(&start.further[3], &at(0.1).further[3], 0.5).offset, Vec3::new(0.05, 0.0, 0.0));
    }

    #[test]
    fn a_small_turn_is_drawn_out_beside_a_large_gain() {
        let start = beginning(&values(0.0, 0.0), &values(1.0, -20.0), 0.02);
        assert_eq!((start.sources.knobs, start.block.gain), (values(0.0, 0.0).sources.knobs, values(0.0, -20.0).block.gain));
        let (from, to) = (values(0.0, 0.0).block, values(0.0, -2.0).block);
        assert_eq!((at(&from, &to, 0.0), at(&from, &to, 1.0).mix), (from, to.mix));
        let middle = at(&from, &to, 0.5).gain;
        assert!(middle < from.gain && middle > to.gain);
    }
}
