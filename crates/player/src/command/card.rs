//! To the sound card.

use super::options::Options;
use super::setup::{Walk, player};
use super::terminal::Bar;
use crate::{PlayerError, Source};
use cpal::traits::{DeviceTrait, HostTrait, StreamTrait};
use cpal::{Device, ErrorKind, FromSample, I24, SampleFormat, SizedSample, Stream, StreamConfig};
use promenade_audio::FileError;
use promenade_core::Scene;
use rtrb::{Consumer, Producer, RingBuffer};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::Duration;

/// Samples of both ears that wait for the card, at most: half a second at 48 kHz.
const AHEAD: usize = 2 * 24_000;
/// Between two looks at what waits.
const LOOK: Duration = Duration::from_millis(5);

/// Plays a sound at the card's rate, and returns when it has ended.
pub(super) fn play(options: &Options, scene: &Arc<Scene>, walk: &Walk) -> Result<(), PlayerError> {
    let wrong = |found: &dyn ToString| PlayerError::argument("--play", "a sound card that plays", found.to_string());
    let device = cpal::default_host().default_output_device().ok_or_else(|| wrong(&"none"))?;
    let config = device.default_output_config().map_err(|e| wrong(&e))?;
    let source = Source::open(&options.files[1], Some(config.sample_rate()))?;
    let (rate, frames) = (f64::from(source.sample_rate_hz()), source.frames());
    let mut player = player(options, scene, &source)?;
    let (to, from) = RingBuffer::new(AHEAD);
    let stopped = Arc::new(AtomicBool::new(false));
    let mut queue = Queue { to, stopped: Arc::clone(&stopped) };
    let build = match config.sample_format() {
        SampleFormat::I16 => stream::<i16>,
        SampleFormat::I24 => stream::<I24>,
        SampleFormat::I32 => stream::<i32>,
        SampleFormat::U16 => stream::<u16>,
        SampleFormat::F32 => stream::<f32>,
        other => return Err(wrong(&format_args!("one of samples in {other}"))),
    };
    let stream = build(&device, config.config(), from, stopped).map_err(|e| wrong(&e))?;
    stream.play().map_err(|e| wrong(&e))?;
    let bar = Bar::new("playing", frames as f64 / rate + player.tail_s());
    let mut played = 0;
    player.play(source, options.mix(), options.block(), &mut |s| walk.pose_at(s), &mut |ears: [&[f32]; 2]| {
        played += ears[0].len();
        bar.at(played as f64 / rate);
        queue.put(ears)
    })?;
    queue.drain()
}

/// What waits for the card.
struct Queue {
    to: Producer<f32>,
    /// Whether the card has given up.
    stopped: Arc<AtomicBool>,
}

impl Queue {
    fn put(&mut self, [left, right]: [&[f32]; 2]) -> Result<(), FileError> {
        for (left, right) in left.iter().zip(right) {
            self.wait(2)?;
            for x in [left, right] {
                // There is room.
                let _ = self.to.push(*x);
            }
        }
        Ok(())
    }

    /// Waits until all has been taken.
    fn drain(&mut self) -> Result<(), FileError> {
        self.wait(AHEAD)
    }

    /// Waits until there is room for some samples.
    fn wait(&mut self, samples: usize) -> Result<(), FileError> {
        while self.to.slots() < samples {
            if self.stopped.load(Ordering::Acquire) {
                let gone = std::io::Error::other("it does not play any more");
                return Err(FileError::write(Path::new("the sound card"))(gone));
            }
            sleep(LOOK);
        }
        Ok(())
    }
}

/// A stream that plays what it is handed, and silence where nothing is there.
fn stream<T: SizedSample + FromSample<f32>>(
    device: &Device,
    config: StreamConfig,
    mut from: Consumer<f32>,
    stopped: Arc<AtomicBool>,
) -> Result<Stream, cpal::Error> {
    let channels = usize::from(config.channels);
    let give_up = move |error: cpal::Error| {
        // After these the card goes on.
        if !matches!(error.kind(), ErrorKind::Xrun | ErrorKind::DeviceChanged | ErrorKind::RealtimeDenied) {
            stopped.store(true, Ordering::Release);
        }
    };
    device.build_output_stream(config, move |data: &mut [T], _| fill(&mut from, data, channels), give_up, None)
}

/// Fills the card's next frames: both ears in the first two channels, or their mean in one.
///
/// # Real-time
/// Audio thread; no allocation, lock or I/O.
fn fill<T: SizedSample + FromSample<f32>>(from: &mut Consumer<f32>, data: &mut [T], channels: usize) {
    for frame in data.chunks_mut(channels.max(1)) {
        // Both ears wait or none.
        let ears = if from.slots() >= 2 { [from.pop(), from.pop()].map(|x| x.unwrap_or(0.0)) } else { [0.0; 2] };
        frame.fill(T::EQUILIBRIUM);
        match frame {
            [one] => *one = T::from_sample(0.5 * (ears[0] + ears[1])),
            [left, right, ..] => (*left, *right) = (T::from_sample(ears[0]), T::from_sample(ears[1])),
            [] => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ears_are_the_first_channels_and_silence_follows() {
        let (mut to, mut from) = RingBuffer::new(8);
        for x in [0.5, -0.5, 0.25, 0.75] {
            to.push(x).unwrap();
        }
        let mut data = [1.0_f32; 9];
        fill(&mut from, &mut data, 3);
        assert_eq!(data, [0.5, -0.5, 0.0, 0.25, 0.75, 0.0, 0.0, 0.0, 0.0]);
        for x in [0.5, 0.25] {
            to.push(x).unwrap();
        }
        let mut data = [7_i16; 2];
        fill(&mut from, &mut data, 1);
        assert_eq!(data, [12_288, 0], "one channel has the mean");
    }

    #[test]
    fn a_card_that_has_stopped_is_not_waited_for() {
        let (to, from) = RingBuffer::new(2);
        let mut queue = Queue { to, stopped: Arc::new(AtomicBool::new(true)) };
        queue.put([&[0.1], &[0.2]]).unwrap();
        let said = queue.put([&[0.1], &[0.2]]).unwrap_err().to_string();
        assert!(said.contains("sound card"), "{said}");
        drop(from);
    }
}
