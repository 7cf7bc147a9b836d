//! The low half of a stream through the responses of both ears, at a low rate.

use crate::number::{single, whole};
use crate::render::low::bass_filters::{AtRate, BassFilters, REACH};
use crate::scene::BassField;
use crate::{EARLY_S, Trim};

/// Time over which a response goes from early to late, seconds.
const BORDER_S: f64 = 0.005;

/// The newest samples of a stream, so kept that as many as wanted lie one after the other, the newest first.
struct Newest {
    samples: Vec<f32>,
    length: usize,
    at: usize,
}

impl Newest {
    fn new(length: usize) -> Self {
        Self { samples: vec![0.0; 2 * length], length, at: 0 }
    }

    fn push(&mut self, x: f32) {
        self.at = if self.at == 0 { self.length - 1 } else { self.at - 1 };
        self.samples[self.at] = x;
        self.samples[self.at + self.length] = x;
    }

    fn all(&self) -> &[f32] {
        &self.samples[self.at..self.at + self.length]
    }

    fn reset(&mut self) {
        self.samples.fill(0.0);
    }
}

/// Sum of products; what lies beyond the shorter is left out.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let (a, a_rest) = a[..a.len().min(b.len())].as_chunks::<8>();
    let (b, b_rest) = b.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for i in 0..8 {
            sums[i] += a[i] * b[i];
        }
    }
    let b_rest = b.get(a.len()).map_or(b_rest, |chunk| &chunk[..]);
    sums.iter().sum::<f32>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f32>()
}

/// What one stream hears at one of the low rates.
pub(super) struct Convolver {
    /// The low half at the host's rate, and how many samples are missing to the next of the low rate.
    fine: Newest,
    pub(super) missing: usize,
    low: Newest,
    /// What both ears hear at the low rate.
    heard: [Newest; 2],
    /// Responses of both ears, as they are and as they were.
    pub(super) now: [Vec<f32>; 2],
    pub(super) before: [Vec<f32>; 2],
    pub(super) mixed: Vec<f32>,
    pub(super) gains: Vec<f32>,
    /// The decay that `gains` are of.
    decayed: Option<(f32, f32, f32)>,
}

impl Convolver {
    pub(super) fn new(at: &AtRate) -> Self {
        let taps = if at.part.is_empty() { at.length + whole(at.wait.max(0.0).ceil()) + 2 } else { at.part.len() };
        let ears = || [vec![0.0; taps], vec![0.0; taps]];
        Self {
            fine: Newest::new(at.window.len()),
            missing: at.every,
            low: Newest::new(taps),
            heard: [(); 2].map(|()| Newest::new(2 * REACH + 2)),
            now: ears(),
            before: ears(),
            mixed: vec![0.0; at.length],
            gains: vec![1.0; at.length],
            decayed: None,
        }
    }

    /// Takes a sample of the low half, and gives what both ears hear of it; `along` says how far between the responses of
    /// before and those of now, if they differ.
    pub(super) fn hear(&mut self, at: &AtRate, low: f32, along: Option<f32>) -> [f32; 2] {
        self.fine.push(low);
        self.missing -= 1;
        if self.missing == 0 {
            self.missing = at.every;
            self.low.push(dot(&at.window, self.fine.all()));
            for ((heard, now), before) in self.heard.iter_mut().zip(&self.now).zip(&self.before) {
                let new = dot(now, self.low.all());
                heard.push(along.map_or(new, |along| {
                    let old = dot(before, self.low.all());
                    old + along * (new - old)
                }));
            }
        }
        // Samples since the newest of the low rate.
        let since = at.every - self.missing;
        self.heard.each_ref().map(|heard| {
            let phases = at.window.iter().skip(since % at.every).step_by(at.every);
            let sum: f32 = phases.zip(heard.all()).map(|(w, x)| w * x).sum();
            sum * at.every as f32
        })
    }

    /// Sets the gains of a response's samples: early and late, and the decay.
    pub(super) fn set_gains(&mut self, bass: &BassField, filters: &BassFilters, (at, travels): (&AtRate, f64), trim: &Trim) {
        let plain = trim.early == 1.0 && trim.late == 1.0 && trim.decay == 1.0;
        let wanted = (trim.early, trim.late, trim.decay);
        if plain && self.decayed != Some(wanted) {
            self.gains.fill(1.0);
        }
        if !plain {
            for (i, gain) in self.gains.iter_mut().enumerate() {
                let after_s = (i as f64 - travels).max(0.0) / at.rate_hz;
                let border = ((after_s - EARLY_S) / BORDER_S + 0.5).clamp(0.0, 1.0);
                let times = f64::from(trim.decay);
                let decay = if times == 1.0 { 0.0 } else { filters.curve.log_gain(0, after_s * bass.rate_hz, times) };
                *gain = (trim.early + single(border) * (trim.late - trim.early)) * single(decay.exp());
            }
        }
        self.decayed = Some(wanted);
    }

    pub(super) fn silence(&mut self) {
        self.fine.reset();
        self.low.reset();
        self.heard.iter_mut().for_each(Newest::reset);
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let taps = self.now[0].len();
        4 * (4 * taps + 2 * taps + self.mixed.len() + self.gains.len() + 2 * self.fine.length)
    }
}
