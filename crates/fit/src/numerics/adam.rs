//! Descent along derivatives that jump: Adam (Kingma and Ba 2015).

const DECAY: (f64, f64) = (0.9, 0.999);

/// The state of a descent over some numbers.
pub(crate) struct Adam {
    mean: Vec<f64>,
    power: Vec<f64>,
    steps: i32,
}

impl Adam {
    pub(crate) fn new(count: usize) -> Self {
        Self { mean: vec![0.0; count], power: vec![0.0; count], steps: 0 }
    }

    /// Moves numbers against their derivatives by about a rate each; what has a rate of 0 stays.
    pub(crate) fn step(&mut self, numbers: &mut [f64], by: &[f64], rates: &[f64]) {
        self.steps += 1;
        let (first, second) = (1.0 - DECAY.0.powi(self.steps), 1.0 - DECAY.1.powi(self.steps));
        for (i, number) in numbers.iter_mut().enumerate() {
            self.mean[i] = DECAY.0 * self.mean[i] + (1.0 - DECAY.0) * by[i];
            self.power[i] = DECAY.1 * self.power[i] + (1.0 - DECAY.1) * by[i] * by[i];
            *number -= rates[i] * (self.mean[i] / first) / ((self.power[i] / second).sqrt() + 1e-12);
        }
    }
}
