//! The dry sound, and the gains that were set when it came in, until the rendered sound is there.

use std::ops::Range;

/// Rings of the dry sound on both channels, of the rendered sound's gain and of the dry sound's.
pub(crate) struct Past {
    rows: [Vec<f32>; 4],
    /// Place of the next sample.
    now: usize,
}

impl Past {
    /// Silence at no gain; `longest` is the longest delay and `most` the most samples that come at a time.
    pub(crate) fn new(longest: usize, most: usize) -> Self {
        Self { rows: std::array::from_fn(|_| vec![0.0; longest + most]), now: 0 }
    }

    /// Where `samples` samples lie, the first of which lies `back` before the next one: the places of the first of them, and
    /// those of the rest.
    fn spans(&self, back: usize, samples: usize) -> [Range<usize>; 2] {
        let len = self.rows[0].len();
        let from = (self.now + len - back) % len;
        let first = samples.min(len - from);
        [from..from + first, 0..samples - first]
    }

    /// Takes the next samples: dry sound left and right, gain of the rendered sound and of the dry one.
    pub(crate) fn take(&mut self, next: [&[f32]; 4]) {
        let samples = next[0].len();
        let [first, rest] = self.spans(0, samples);
        for (row, next) in self.rows.iter_mut().zip(next) {
            let (head, tail) = next.split_at(first.len());
            row[first.clone()].copy_from_slice(head);
            row[rest.clone()].copy_from_slice(tail);
        }
        self.now = (self.now + samples) % self.rows[0].len();
    }

    /// Takes the rendered sound of the newest samples to what is heard, where it lags by `delay` samples; `stand_in` is the
    /// share of its gain that the dry sound is heard with.
    pub(crate) fn mix(&self, delay: usize, stand_in: f32, ears: [&mut [f32]; 2]) {
        let samples = ears[0].len();
        let [first, rest] = self.spans(samples + delay, samples);
        let [of_left, of_right, wet_gain, dry_gain] = &self.rows;
        for (ear, dry) in ears.into_iter().zip([of_left, of_right]) {
            let (head, tail) = ear.split_at_mut(first.len());
            for (part, span) in [(head, first.clone()), (tail, rest.clone())] {
                let gains = wet_gain[span.clone()].iter().zip(&dry_gain[span.clone()]);
                for ((x, dry), (wet_gain, dry_gain)) in part.iter_mut().zip(&dry[span]).zip(gains) {
                    *x = *x * wet_gain + dry * (dry_gain + stand_in * wet_gain);
                }
            }
        }
    }

    /// Is as new again.
    pub(crate) fn reset(&mut self) {
        self.rows.iter_mut().for_each(|row| row.fill(0.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_sample_is_heard_once_with_the_gains_that_it_came_with() {
        let mut past = Past::new(7, 4);
        let (mut heard, mut came) = ([Vec::new(), Vec::new()], 0.0);
        for samples in [4, 1, 3, 2, 4, 4, 1, 4, 4, 3] {
            let sound: Vec<f32> = (1..=samples).map(|i| came + i as f32).collect();
            let [minus, tenfold] = [-1.0, 10.0].map(|gain| sound.iter().map(|x| gain * x).collect::<Vec<f32>>());
            past.take([&sound, &minus, &tenfold, &[0.5; 4][..samples]]);
            came += samples as f32;
            let mut ears = [vec![1.0; samples], vec![1.0; samples]];
            past.mix(7, 0.0, ears.each_mut().map(|ear| &mut ear[..]));
            heard.iter_mut().zip(ears).for_each(|(heard, ear)| heard.extend(ear));
        }
        for (heard, each) in heard.iter().zip([10.5, 9.5]) {
            let wanted = |i: usize| if i < 7 { 0.0 } else { each * (i - 6) as f32 };
            assert!(heard.iter().enumerate().all(|(i, x)| *x == wanted(i)), "{heard:?}");
        }
    }
}
