//! Loudness of what leaves the plugin, after EBU R 128, measured off the audio thread.

use crate::parameter::cast::narrow;
use crate::worker::{Task, lock::lock};
use crossbeam_queue::ArrayQueue;
use ebur128::{EbuR128, Mode};
use std::sync::{Arc, Mutex};
use std::time::Instant;

/// Samples that are handed over at a time.
const CHUNK: usize = 1024;
/// As much sound may wait to be measured, seconds.
const WAITING_S: f64 = 1.0;
/// And as many chunks at most.
const MOST_CHUNKS: usize = 400;
/// A level below this is silence, LUFS: the absolute gate of ITU-R BS.1770.
const GATE_LUFS: f64 = -70.0;

/// A piece of both ears' sound.
struct Chunk {
    ears: [[f32; CHUNK]; 2],
    len: usize,
    rate_hz: f64,
    /// Samples that were lost before it.
    lost: usize,
}

/// Levels, LUFS; `None` for silence.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Loudness {
    /// Over the last 400 ms.
    pub momentary: Option<f32>,
    /// Over the last 3 s.
    pub short_term: Option<f32>,
    /// Gated, since the measurement began.
    pub integrated: Option<f32>,
    /// Whether sound came faster than it was measured, so that some of it is missing.
    pub gaps: bool,
}

/// Between the audio thread and the meter. Chunks go round; there are none before a meter is open.
pub struct SoundQueue {
    fresh: ArrayQueue<Box<Chunk>>,
    spare: ArrayQueue<Box<Chunk>>,
}

impl Default for SoundQueue {
    fn default() -> Self {
        Self { fresh: ArrayQueue::new(MOST_CHUNKS), spare: ArrayQueue::new(MOST_CHUNKS) }
    }
}

impl SoundQueue {
    /// Makes chunks for sound of a rate.
    fn open(&self, rate_hz: f64) {
        self.close();
        let wanted = crate::parameter::cast::index(narrow((WAITING_S * rate_hz / CHUNK as f64).ceil())).clamp(4, MOST_CHUNKS);
        while self.fresh.len() + self.spare.len() < wanted {
            let chunk = Chunk { ears: [[0.0; CHUNK]; 2], len: 0, rate_hz, lost: 0 };
            if self.spare.push(Box::new(chunk)).is_err() {
                return;
            }
        }
    }

    /// Drops all chunks.
    fn close(&self) {
        while self.fresh.pop().is_some() || self.spare.pop().is_some() {}
    }
}

/// The audio thread's end.
#[derive(Default)]
pub(crate) struct SoundWriter {
    chunk: Option<Box<Chunk>>,
    lost: usize,
}

impl SoundWriter {
    /// Hands over both ears' next samples; what there is no room for is counted.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn write(&mut self, queue: &SoundQueue, [mut left, mut right]: [&[f32]; 2], rate_hz: f64) {
        while !left.is_empty() {
            let chunk = match &mut self.chunk {
                Some(chunk) => chunk,
                empty => {
                    let Some(mut chunk) = queue.spare.pop() else {
                        self.lost = self.lost.saturating_add(left.len());
                        return;
                    };
                    (chunk.len, chunk.rate_hz, chunk.lost) = (0, rate_hz, std::mem::take(&mut self.lost));
                    empty.insert(chunk)
                }
            };
            let count = left.len().min(right.len()).min(CHUNK - chunk.len);
            if count == 0 {
                return;
            }
            for (to, from) in chunk.ears.iter_mut().zip([&mut left, &mut right]) {
                let (now, later) = from.split_at(count);
                to[chunk.len..chunk.len + count].copy_from_slice(now);
                *from = later;
            }
            chunk.len += count;
            if chunk.len == CHUNK
                && let Some(full) = self.chunk.take()
            {
                // There is room for all chunks.
                drop(queue.fresh.push(full));
            }
        }
    }

    /// Forgets what was not handed over.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn forget(&mut self) {
        self.lost = 0;
        if let Some(chunk) = &mut self.chunk {
            chunk.len = 0;
        }
    }
}

/// Measures what the audio thread hands over, while an editor is open.
pub struct LoudnessMeter {
    queue: Arc<SoundQueue>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    meter: Option<EbuR128>,
    rate_hz: f64,
    newest: Loudness,
}

impl LoudnessMeter {
    /// A meter of sound of a rate.
    pub fn new(queue: Arc<SoundQueue>, rate_hz: f64) -> Arc<Self> {
        queue.open(rate_hz);
        Arc::new(Self { queue, state: Mutex::default() })
    }

    /// The newest levels.
    pub fn newest(&self) -> Loudness {
        lock(&self.state).newest
    }

    /// Begins anew.
    pub fn restart(&self) {
        *lock(&self.state) = State::default();
    }
}

impl Drop for LoudnessMeter {
    fn drop(&mut self) {
        self.queue.close();
    }
}

impl State {
    fn add(&mut self, chunk: &Chunk) {
        if self.meter.is_none() || self.rate_hz != chunk.rate_hz {
            let rate = u32::try_from(crate::parameter::cast::index(narrow(chunk.rate_hz.round()))).unwrap_or(0);
            // A rate that the meter does not know has no loudness.
            self.meter = EbuR128::new(2, rate, Mode::M | Mode::S | Mode::I).ok();
            self.rate_hz = chunk.rate_hz;
            self.newest = Loudness::default();
        }
        self.newest.gaps |= chunk.lost > 0;
        let ears = chunk.ears.each_ref().map(|ear| &ear[..chunk.len]);
        if let Some(meter) = &mut self.meter
            && meter.add_frames_planar_f32(&ears).is_err()
        {
            self.newest.gaps = true;
        }
    }

    fn read(&mut self) {
        let Some(meter) = &self.meter else { return };
        let heard = |level: Result<f64, ebur128::Error>| level.ok().filter(|level| *level > GATE_LUFS).map(narrow);
        self.newest = Loudness {
            momentary: heard(meter.loudness_momentary()),
            short_term: heard(meter.loudness_shortterm()),
            integrated: heard(meter.loudness_global()),
            gaps: self.newest.gaps,
        };
    }
}

impl Task for LoudnessMeter {
    fn run(&self) -> Option<Instant> {
        let mut state = lock(&self.state);
        let mut any = false;
        while let Some(chunk) = self.queue.fresh.pop() {
            state.add(&chunk);
            any = true;
            drop(self.queue.spare.push(chunk));
        }
        if any {
            state.read();
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Plays a stereo sine of a level through the queue in blocks.
    fn play(writer: &mut SoundWriter, meter: &LoudnessMeter, seconds: f64, dbfs: f64, rate_hz: f64) {
        let peak = 10.0_f64.powf(dbfs / 20.0);
        let wave = |i: usize| (peak * (std::f64::consts::TAU * 997.0 * i as f64 / rate_hz).sin()) as f32;
        let sine: Vec<f32> = (0..(seconds * rate_hz) as usize).map(wave).collect();
        for block in sine.chunks(480) {
            writer.write(&meter.queue, [block, block], rate_hz);
            meter.run();
        }
    }

    #[test]
    fn signals_of_tech_3341_have_their_loudness() {
        // EBU Tech 3341 (2016), table 1, cases 1 to 3, shortened: a gated level depends on the length by the blocks at its ends
        // alone.
        let near = |level: Option<f32>, lufs: f32| level.is_some_and(|level| (level - lufs).abs() <= 0.1);
        for (rate_hz, dbfs) in [(48_000.0, -23.0), (44_100.0, -33.0), (96_000.0, -23.0)] {
            let meter = LoudnessMeter::new(Arc::default(), rate_hz);
            play(&mut SoundWriter::default(), &meter, 5.0, dbfs, rate_hz);
            let Loudness { momentary, short_term, integrated, gaps } = meter.newest();
            for level in [momentary, short_term, integrated] {
                assert!(near(level, dbfs as f32), "{level:?} of {dbfs} at {rate_hz}");
            }
            assert!(!gaps);
        }
        let meter = LoudnessMeter::new(Arc::default(), 48_000.0);
        let mut writer = SoundWriter::default();
        for (seconds, dbfs) in [(2.0, -36.0), (20.0, -23.0), (2.0, -36.0)] {
            play(&mut writer, &meter, seconds, dbfs, 48_000.0);
        }
        assert!(near(meter.newest().integrated, -23.0), "the soft parts are gated: {:?}", meter.newest());
        meter.restart();
        assert_eq!(meter.newest(), Loudness::default());
        play(&mut writer, &meter, 4.0, -90.0, 48_000.0);
        assert_eq!(meter.newest(), Loudness::default(), "silence has no loudness");
    }

    #[test]
    fn what_comes_too_fast_is_counted_and_nothing_waits_for_it() {
        let meter = LoudnessMeter::new(Arc::default(), 48_000.0);
        let mut writer = SoundWriter::default();
        let block = [0.1; 480];
        (0..1000).for_each(|_| writer.write(&meter.queue, [&block, &block], 48_000.0));
        meter.run();
        assert!(!meter.newest().gaps, "what was measured is whole");
        (0..10).for_each(|_| writer.write(&meter.queue, [&block, &block], 48_000.0));
        meter.run();
        assert!(meter.newest().gaps);
        let queue = Arc::clone(&meter.queue);
        drop(meter);
        assert!(queue.spare.is_empty() && queue.fresh.is_empty());
        writer.forget();
        writer.write(&queue, [&block, &block], 48_000.0);
    }
}
