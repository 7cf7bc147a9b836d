//! What the audio thread reports to the editor: values that go one way.

pub mod attention;
pub mod host_side;
pub mod loudness;
pub mod members;
pub mod waveform;

use crate::listener::{pose_cell::PoseCell, pose_sources::Base};
use crate::parameter::cast::{index, narrow};
use crate::parameter::source_knob::MOST_INPUTS;
use crate::telemetry::loudness::SoundQueue;
use crate::worker::flag::Flag;
use crossbeam_queue::ArrayQueue;
use promenade_core::{Pose, Renderer};
use std::sync::Arc;

/// Frequencies at which the masks are shown.
pub const MASK_POINTS: usize = 96;
/// The lowest of them, Hz.
pub const LOWEST_HZ: f32 = 40.0;
/// The highest of them, Hz.
pub const HIGHEST_HZ: f32 = 20_000.0;
/// What a silent mask is shown as, dB.
pub const FLOOR_DB: f32 = -120.0;

/// One picture of what is heard.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// The listener's pose, from all sources.
    pub pose: Pose,
    /// What it comes from.
    pub base: Base,
    /// Whether a head tracker turns or moves it.
    pub tracked: bool,
    /// Whether this instance leads its listener group.
    pub leads: bool,
    /// Time of the transport, seconds.
    pub transport_s: f64,
    /// Whether the transport runs.
    pub playing: bool,
    /// Whether the dry sound passes because there is no scene.
    pub dry: bool,
    /// Whether the host renders offline.
    pub offline: bool,
    /// Direct sound of the left and the right ear at [`frequency_hz`], dB.
    pub masks_db: [[f32; MASK_POINTS]; 2],
    /// Interaural delay of the direct sound, seconds; positive = left ear later.
    pub itd_s: f32,
    /// Level of the right ear over the left in the direct sound, all bins alike, dB.
    pub ild_db: f32,
    /// Further sources that have sounded since the last frame, a bit each from the lowest on.
    pub sounding: u64,
    /// Peak of each source since the last frame, that of the first and those of further ones, linear.
    pub source_peaks: [f32; MOST_INPUTS],
    /// Whether the input's channels cancel each other where one source plays both.
    pub cancels: bool,
    /// Peaks of the input's channels since the last frame, linear.
    pub input_peak: [f32; 2],
    /// Peaks of both ears since the last frame, linear.
    pub output_peak: [f32; 2],
    /// Processor time over audio time, averaged over the last second or so.
    pub load: f32,
}

impl Default for Frame {
    fn default() -> Self {
        Self {
            pose: Pose::IDENTITY,
            base: Base::default(),
            tracked: false,
            leads: false,
            transport_s: 0.0,
            playing: false,
            dry: false,
            offline: false,
            masks_db: [[FLOOR_DB; MASK_POINTS]; 2],
            itd_s: 0.0,
            ild_db: 0.0,
            sounding: 0,
            source_peaks: [0.0; MOST_INPUTS],
            cancels: false,
            input_peak: [0.0; 2],
            output_peak: [0.0; 2],
            load: 0.0,
        }
    }
}

/// Frequency of a point of the masks, Hz; evenly spaced in octaves.
pub fn frequency_hz(point: usize) -> f32 {
    hertz(point as f32 / (MASK_POINTS - 1) as f32)
}

/// The frequency at a share of the way from the lowest to the highest, Hz.
pub(crate) fn hertz(along: f32) -> f32 {
    LOWEST_HZ * (HIGHEST_HZ / LOWEST_HZ).powf(along)
}

/// Steps that can be seen: position, metres; orientation, radians; masks and levels, dB; load, share of 1.
const SEEN_M: f32 = 5e-4;
const SEEN_RAD: f32 = 5e-4;
const SEEN_DB: f32 = 0.05;
const SEEN_LOAD: f32 = 0.004;
/// Peaks below this are not shown, dB.
const QUIET_DB: f32 = -60.0;
/// Time constant over which the load is averaged, seconds.
const LOAD_S: f32 = 0.7;

impl Frame {
    /// Whether there is a level to show.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn is_loud(&self) -> bool {
        [self.input_peak, self.output_peak].as_flattened().iter().any(|peak| decibels(*peak) > QUIET_DB)
    }

    /// Whether it looks other than one that was seen before, levels and time apart.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn differs_from(&self, seen: &Self) -> bool {
        let states = |f: &Self| (f.base, f.tracked, f.leads, f.playing, f.dry, f.offline, f.sounding, f.cancels);
        let near = |a: f32, b: f32, step: f32| (a - b).abs() < step;
        let moved = (self.pose.position - seen.pose.position).length() >= SEEN_M;
        // The chord between two unit quaternions of the same sign is half the angle.
        let (a, b) = (self.pose.orientation, seen.pose.orientation);
        let turned = 2.0 * (a - b).length().min((a + b).length()) >= SEEN_RAD;
        let masks = self.masks_db.as_flattened().iter().zip(seen.masks_db.as_flattened());
        moved
            || turned
            || states(self) != states(seen)
            || !near(self.load, seen.load, SEEN_LOAD)
            || !near(self.ild_db, seen.ild_db, SEEN_DB)
            || !near(self.itd_s, seen.itd_s, 1e-6)
            || masks.into_iter().any(|(a, b)| !near(*a, *b, SEEN_DB))
    }

    /// Averages the load of a block into what is shown.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn add_load(&mut self, load: f32, block_s: f32) {
        let share = 1.0 - (-block_s / LOAD_S).exp();
        self.load += share * (load - self.load);
    }

    /// Shows the direct sound that a renderer plays.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn show(&mut self, renderer: &Renderer) {
        let (transfer, scene) = (renderer.heard(), renderer.scene());
        let gains = |bin: usize| {
            let (m, d) = (transfer.mixture[bin], transfer.difference[bin]);
            [(1.0 - d) * m, (1.0 + d) * m]
        };
        let bins = transfer.mixture.len().min(transfer.difference.len());
        let Some(last) = bins.checked_sub(1) else { return };
        let (grid, [left_db, right_db]) = (scene.grid(), &mut self.masks_db);
        for (point, (left, right)) in left_db.iter_mut().zip(right_db).enumerate() {
            let place = frequency_hz(point) * grid.n_fft as f32 / narrow(grid.sample_rate_hz);
            let bin = index(place).min(last);
            let share = (place - bin as f32).clamp(0.0, 1.0);
            let (low, high) = (gains(bin), gains((bin + 1).min(last)));
            [*left, *right] = [0, 1].map(|ear| decibels(low[ear] + share * (high[ear] - low[ear])));
        }
        let energy = (0..bins).fold([0.0_f32; 2], |[l, r], bin| {
            let [left, right] = gains(bin);
            [l + left * left, r + right * right]
        });
        self.itd_s = transfer.delay_s;
        self.ild_db = decibels(energy[1].sqrt()) - decibels(energy[0].sqrt());
    }
}

/// A linear gain as dB, not below [`FLOOR_DB`].
pub fn decibels(gain: f32) -> f32 {
    if gain > 1e-6 { 20.0 * gain.log10() } else { FLOOR_DB }
}

/// Raises the peaks of channels to others.
pub(crate) fn raise<const N: usize>(peaks: &mut [f32; N], to: [f32; N]) {
    peaks.iter_mut().zip(to).for_each(|(peak, to)| *peak = peak.max(to));
}

/// Between one instance's audio thread and its editor. Frames go round: the audio thread never allocates one.
pub struct Telemetry {
    /// Whether an editor is open; otherwise nothing is collected.
    pub watched: Flag,
    /// Whether the pose is sent to others.
    pub sent: Flag,
    /// Whether the editor shows the time of the transport, so that it is drawn while that runs.
    pub shows_time: Flag,
    fresh: ArrayQueue<Box<Frame>>,
    spare: ArrayQueue<Box<Frame>>,
    /// The listener's pose at the end of the newest block, with the time of the transport.
    pub pose: PoseCell,
    /// What leaves the plugin, for the loudness meter of an open editor.
    pub sound: Arc<SoundQueue>,
}

impl Telemetry {
    /// Whether somebody follows what happens, also in silence.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn is_followed(&self) -> bool {
        self.watched.is_on() || self.sent.is_on()
    }

    /// No editor is open yet.
    pub fn new() -> Arc<Self> {
        let telemetry = Self {
            watched: Flag::default(),
            sent: Flag::default(),
            shows_time: Flag::default(),
            fresh: ArrayQueue::new(1),
            spare: ArrayQueue::new(3),
            pose: PoseCell::new(),
            sound: Arc::default(),
        };
        for _ in 0..3 {
            drop(telemetry.spare.push(Box::default()));
        }
        Arc::new(telemetry)
    }

    /// Gives the editor a frame, in place of one that it has not fetched; peaks of that one are kept.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn publish(&self, frame: &Frame) {
        let unseen = self.fresh.pop();
        let kept = unseen.as_ref().map(|old| (old.input_peak, old.output_peak, old.sounding, old.source_peaks));
        if let Some(mut held) = unseen.or_else(|| self.spare.pop()) {
            *held = frame.clone();
            if let Some((input, output, sounding, sources)) = kept {
                held.sounding |= sounding;
                raise(&mut held.source_peaks, sources);
                raise(&mut held.input_peak, input);
                raise(&mut held.output_peak, output);
            }
            // The only writer has just emptied the queue.
            drop(self.fresh.push(held));
        }
    }

    /// Fetches the newest frame; returns whether there was one.
    pub fn fetch(&self, into: &mut Frame) -> bool {
        let Some(frame) = self.fresh.pop() else { return false };
        *into = (*frame).clone();
        drop(self.spare.push(frame));
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::factory;
    use promenade_core::glam::Vec3;
    use promenade_core::{RenderParams, Scene};

    #[test]
    fn the_newest_frame_is_fetched_once_with_the_peaks_of_those_before() {
        let telemetry = Telemetry::new();
        let mut frame = Frame::default();
        assert!(!telemetry.fetch(&mut frame));
        for peak in [0.5, 0.9, 0.1] {
            telemetry.publish(&Frame { input_peak: [peak, 0.0], load: peak, ..Frame::default() });
        }
        assert!(telemetry.fetch(&mut frame));
        assert_eq!((frame.input_peak[0], frame.load), (0.9, 0.1));
        assert!(!telemetry.fetch(&mut frame));
        for _ in 0..10 {
            telemetry.publish(&frame);
            assert!(telemetry.fetch(&mut frame), "a frame is lost");
        }
    }

    #[test]
    fn what_cannot_be_seen_asks_for_no_picture() {
        let seen = Frame::default();
        let like = |change: &dyn Fn(&mut Frame)| {
            let mut frame = Frame::default();
            change(&mut frame);
            !frame.differs_from(&seen)
        };
        assert!(like(&|_| {}));
        assert!(like(&|f| f.pose.position.x = 1e-4) && !like(&|f| f.pose.position.x = 1e-3));
        assert!(!like(&|f| f.pose = Pose::from_ypr(Vec3::ZERO, 1e-3, 0.0, 0.0)));
        assert!(like(&|f| f.pose.orientation = -f.pose.orientation), "the same orientation");
        assert!(like(&|f| f.transport_s = 9.0) && !like(&|f| f.playing = true));
        assert!(!Frame { input_peak: [0.0, 1e-4], ..Frame::default() }.is_loud());
        assert!(Frame { output_peak: [0.0, 0.1], ..Frame::default() }.is_loud());
        assert!(like(&|f| f.load = 0.003) && !like(&|f| f.load = 0.01));
        assert!(!like(&|f| f.masks_db[1][7] += 0.1));
    }

    #[test]
    fn the_load_is_averaged() {
        let mut frame = Frame::default();
        for _ in 0..1000 {
            frame.add_load(0.2, 0.01);
        }
        assert!((frame.load - 0.2).abs() < 1e-3);
        frame.add_load(1.0, 0.01);
        assert!(frame.load < 0.22);
    }

    #[test]
    fn a_head_turned_to_the_left_has_the_source_at_its_right_ear() {
        let scene = Arc::new(Scene::from_bytes(factory::ROOM_A.bytes).unwrap());
        let mut renderer = Renderer::new(scene, 48_000.0).unwrap();
        let pose = Pose::from_ypr(Vec3::ZERO, 1.0, 0.0, 0.0);
        let (mut left, mut right) = ([0.0; 512], [0.0; 512]);
        renderer.process(&[[0.1; 512][..].into()], [&mut left, &mut right], RenderParams::default(), &mut |_| pose);
        let mut frame = Frame::default();
        frame.show(&renderer);
        assert!(frame.ild_db > 2.0, "{}", frame.ild_db);
        assert!(frame.itd_s > 2e-4, "{}", frame.itd_s);
        assert!(frame.masks_db[1][60] > frame.masks_db[0][60] + 2.0);
    }
}
