//! What was heard over the time of the transport.

use crate::parameter::cast::{index, narrow};

/// Peaks that are kept a second, and for how long, seconds.
const PEAKS_PER_S: f64 = 20.0;
const LONGEST_S: f64 = 6.0 * 3600.0;

/// Levels of the input over the transport's time, as far as it was played while an editor was open.
#[derive(Clone, Debug, Default)]
pub struct Waveform {
    peaks: Vec<f32>,
    /// The one that was taken last.
    newest: usize,
}

impl Waveform {
    /// Takes a peak, linear, at a time of the transport, seconds.
    pub fn add(&mut self, t_s: f64, peak: f32) {
        if (0.0..LONGEST_S).contains(&t_s) {
            let at = bin(t_s);
            if self.peaks.len() <= at {
                self.peaks.resize(at + 1, 0.0);
            }
            // What is played again takes the place of what was played before.
            self.peaks[at] = if at == self.newest { self.peaks[at].max(peak) } else { peak };
            self.newest = at;
        }
    }

    /// The greatest peak between two times, seconds; 0 where nothing was heard.
    pub fn peak(&self, from_s: f64, to_s: f64) -> f32 {
        let end = (bin(to_s) + 1).min(self.peaks.len());
        self.peaks.get(bin(from_s)..end).map_or(0.0, |peaks| peaks.iter().copied().fold(0.0, f32::max))
    }
}

fn bin(t_s: f64) -> usize {
    index(narrow(t_s.max(0.0) * PEAKS_PER_S))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_heard_is_found_at_its_time() {
        let mut waveform = Waveform::default();
        for (t_s, peak) in [(0.0, 0.1), (3.01, 0.5), (3.03, 0.4), (-1.0, 1.0), (1e9, 1.0), (f64::NAN, 1.0)] {
            waveform.add(t_s, peak);
        }
        assert_eq!((waveform.peak(2.9, 3.1), waveform.peak(1.0, 2.0), waveform.peak(50.0, 60.0)), (0.5, 0.0, 0.0));
        waveform.add(1.0, 0.2);
        waveform.add(3.02, 0.3);
        assert_eq!((waveform.peak(3.0, 3.1), waveform.peaks.len()), (0.3, 61), "played again");
    }
}
