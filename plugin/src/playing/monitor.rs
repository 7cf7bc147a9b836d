//! The audio thread's end of the telemetry: collects what an open editor shows.

use crate::listener::{HeardPose, clock::BlockTime, snapshot::Snapshot};
use crate::parameter::cast::narrow;
use crate::playing::Playing;
use crate::telemetry::{Frame, Telemetry, loudness::SoundWriter, raise};
use crate::worker::repaint::Repaint;
use promenade_core::{Spatializer, Voice};
use std::sync::Arc;
use std::time::Duration;

/// Time between two pictures when only levels or the time change, seconds.
const LEVELS_S: f64 = 1.0 / 30.0;

/// Channels cancel each other where their difference has so many times the energy of their sum, 20 dB, over some seconds.
const CANCELS: f32 = 100.0;
const CANCELS_S: f32 = 1.0;

/// Fainter samples are no sound: -100 dBFS.
const SILENCE: f32 = 1e-5;

/// Measures what is heard and asks the editor for a picture when it can be seen to change.
pub(crate) struct Monitor<const FURTHER: usize> {
    telemetry: Arc<Telemetry>,
    repaint: Repaint,
    frame: Frame,
    /// What the editor was last asked to show.
    shown: Frame,
    shown_snapshot: Option<Snapshot<FURTHER>>,
    since_shown_s: f64,
    sides: Sides,
    sound: SoundWriter,
}

impl<const FURTHER: usize> Monitor<FURTHER> {
    /// Shows nothing yet.
    pub(crate) fn new(telemetry: Arc<Telemetry>, repaint: Repaint) -> Self {
        let (frame, shown) = (Frame::default(), Frame::default());
        let (sides, sound) = Default::default();
        Self { telemetry, repaint, frame, shown, shown_snapshot: None, since_shown_s: 0.0, sides, sound }
    }

    /// Measures a part of the input's channels.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn measure_input(&mut self, channels: [&[f32]; 2], is_stereo: bool) {
        if self.telemetry.watched.is_on() {
            let peaks = channels.map(peak);
            raise(&mut self.frame.input_peak, peaks);
            self.frame.source_peaks[0] = peaks.into_iter().fold(self.frame.source_peaks[0], f32::max);
            if is_stereo {
                self.sides.take(channels);
            }
        }
    }

    /// Measures a part of the inputs of further sources, and notes which of them sound.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn measure_further(&mut self, further: &[Voice<'_>]) {
        if self.telemetry.watched.is_on() {
            for (number, source) in further.iter().enumerate() {
                let peak = source.level * peak(source.input);
                raise(&mut self.frame.input_peak, [peak, 0.0]);
                let held = &mut self.frame.source_peaks[1 + number];
                *held = held.max(peak);
                self.frame.sounding |= u64::from(peak > SILENCE) << number;
            }
        }
    }

    /// Shows a block: what is played and heard, both ears, and how long it took to process.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn show(
        &mut self,
        snapshot: &Snapshot<FURTHER>,
        time: &BlockTime,
        heard: &HeardPose,
        playing: &Playing,
        ears: [&[f32]; 2],
        took: Duration,
    ) {
        self.telemetry.pose.write(time.end_s(), &heard.pose);
        if !self.telemetry.watched.is_on() {
            self.sound.forget();
            return;
        }
        let rate_hz = playing.spatializer().map_or(0.0, Spatializer::sample_rate_hz);
        self.sound.write(&self.telemetry.sound, ears, rate_hz);
        let frame = &mut self.frame;
        raise(&mut frame.output_peak, ears.map(peak));
        (frame.transport_s, frame.playing) = (time.start_s, time.playing);
        (frame.pose, frame.base, frame.tracked, frame.leads) = (heard.pose, heard.base, heard.tracked, heard.leads);
        (frame.dry, frame.offline) = (playing.dry.is_some(), snapshot.block.live.wait);
        if let Some(renderer) = playing.spatializer().and_then(Spatializer::renderer) {
            frame.show(renderer);
        }
        frame.cancels = self.sides.cancel(narrow(time.length_s));
        frame.add_load(narrow(took.as_secs_f64() / time.length_s.max(1e-9)), narrow(time.length_s));
        // Levels and time alone are shown less often; none is lost, peaks wait for the next picture.
        self.since_shown_s += time.length_s;
        let runs = frame.is_loud() || (frame.playing && self.telemetry.shows_time.is_on());
        if (runs && self.since_shown_s >= LEVELS_S) || frame.differs_from(&self.shown) || self.shown_snapshot != Some(*snapshot)
        {
            self.shown.clone_from(frame);
            (self.shown_snapshot, self.since_shown_s) = (Some(*snapshot), 0.0);
            self.repaint.request_repaint();
        }
        self.telemetry.publish(frame);
        (frame.input_peak, frame.output_peak, frame.sounding) = ([0.0; 2], [0.0; 2], 0);
        frame.source_peaks.fill(0.0);
    }
}

/// Energies of both channels' sum and of their difference, of late.
#[derive(Default)]
struct Sides {
    sum: f32,
    difference: f32,
}

impl Sides {
    fn take(&mut self, [left, right]: [&[f32]; 2]) {
        for (left, right) in left.iter().zip(right) {
            self.sum += (left + right) * (left + right);
            self.difference += (left - right) * (left - right);
        }
    }

    /// Whether next to nothing is left of the sum, after a block of so many seconds.
    fn cancel(&mut self, length_s: f32) -> bool {
        let kept = (-length_s / CANCELS_S).exp();
        (self.sum, self.difference) = (self.sum * kept, self.difference * kept);
        self.difference > CANCELS * self.sum.max(SILENCE)
    }
}

/// The greatest level of a channel.
fn peak(channel: &[f32]) -> f32 {
    channel.iter().fold(0.0, |most, sample| sample.abs().max(most))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_that_cancel_each_other_are_noticed_and_others_are_not() {
        let tone: Vec<f32> = (0..4_800).map(|i| (0.05 * f32::from(u16::try_from(i).unwrap())).sin()).collect();
        let side = |gain: f32| tone.iter().map(|x| gain * x).collect::<Vec<_>>();
        for (gain, cancels) in [(-1.0, true), (-0.9, true), (-0.5, false), (0.0, false), (1.0, false)] {
            let mut sides = Sides::default();
            sides.take([&tone, &side(gain)]);
            assert_eq!(sides.cancel(0.1), cancels, "{gain}");
        }
        assert!(!Sides::default().cancel(0.1), "silence is no stereo");
    }
}
