//! How far a rendered clip is from its recording, and the derivative by every sample.

use crate::settings::LossSettings;
use promenade_fourier::num_complex::Complex32;
use promenade_fourier::{ComplexToReal, RealToComplex};
use std::f32::consts::TAU;
use std::sync::Arc;

/// Ratios of magnitudes, below 1e19 each, whose product is surely finite.
const FACTORS: usize = 16;
/// Added to the energies of the ratio between ears.
const RATIO_EPS: f64 = 1e-5;

/// Terms of the loss over several resolutions, with their transforms.
pub(crate) struct SpectralLoss {
    settings: LossSettings,
    grids: Vec<Grid>,
}

/// A short-time transform without padding but for half a frame at both ends.
struct Grid {
    n: usize,
    hop: usize,
    window: Vec<f32>,
    forward: Arc<dyn RealToComplex<f32>>,
    inverse: Arc<dyn ComplexToReal<f32>>,
    time: Vec<f32>,
    rendered: Vec<Complex32>,
    wanted: Vec<Complex32>,
    scratch: Vec<Complex32>,
}

impl Grid {
    fn new(n: usize) -> Self {
        let (forward, inverse) = (promenade_fourier::forward(n), promenade_fourier::inverse(n));
        let spectrum = || vec![Complex32::default(); n / 2 + 1];
        Self {
            n,
            hop: n / 4,
            window: (0..n).map(|i| 0.5 - 0.5 * (TAU * i as f32 / n as f32).cos()).collect(),
            time: vec![0.0; n],
            rendered: spectrum(),
            wanted: spectrum(),
            scratch: vec![Complex32::default(); forward.get_scratch_len().max(inverse.get_scratch_len())],
            forward,
            inverse,
        }
    }

    fn frames(&self, len: usize) -> usize {
        len.div_ceil(self.hop) + 1
    }

    /// Samples of a frame, from this one on; half a frame lies before the clip.
    fn start(&self, frame: usize) -> isize {
        (frame * self.hop).cast_signed() - (self.n / 2).cast_signed()
    }

    fn transform(&mut self, frame: usize, signal: &[f32], rendered: bool) {
        let start = self.start(frame);
        for ((i, t), w) in self.time.iter_mut().enumerate().zip(&self.window) {
            let at = start.checked_add_unsigned(i).and_then(|at| usize::try_from(at).ok());
            *t = w * at.and_then(|at| signal.get(at)).copied().unwrap_or(0.0);
        }
        let out = if rendered { &mut self.rendered } else { &mut self.wanted };
        let done = self.forward.process_with_scratch(&mut self.time, out, &mut self.scratch);
        debug_assert!(done.is_ok());
    }

    /// One ear: the loss is returned, its derivative added to `gradient`.
    fn ear(&mut self, settings: &LossSettings, share: f32, rendered: &[f32], wanted: &[f32], gradient: &mut [f32]) -> f64 {
        let mut loss = 0.0;
        let frames = self.frames(rendered.len());
        let scale = share / (frames * self.rendered.len()) as f32;
        for frame in 0..frames {
            self.transform(frame, wanted, false);
            self.transform(frame, rendered, true);
            let last = self.n / 2;
            // The logarithms' differences are summed as the logarithm of a product, a few factors at a time.
            let mut product = 1.0_f64;
            let mut differences = 0.0_f32;
            for (k, (x, y)) in self.rendered.iter_mut().zip(&self.wanted).enumerate() {
                let (a, b) = (x.norm_sqr().sqrt(), y.norm_sqr().sqrt());
                product *= f64::from((1.0 + a.max(b)) / (1.0 + a.min(b)));
                if k % FACTORS == FACTORS - 1 || k == last {
                    loss += f64::from(scale * settings.log) * product.ln();
                    product = 1.0;
                }
                differences += (a - b).abs();
                // A magnitude of 0 has no direction to grow in.
                let slope = scale * sign(a - b) * (settings.log / (1.0 + a) + settings.linear) / a.max(1e-9);
                let whole = k == 0 || k == last;
                // Half of an inner bin, since the inverse transform adds its mirror image.
                *x *= if whole { slope } else { 0.5 * slope };
                if whole {
                    x.im = 0.0;
                }
            }
            loss += f64::from(scale * settings.linear * differences);
            let done = self.inverse.process_with_scratch(&mut self.rendered, &mut self.time, &mut self.scratch);
            debug_assert!(done.is_ok());
            let start = self.start(frame);
            for ((i, t), w) in self.time.iter().enumerate().zip(&self.window) {
                let at = start.checked_add_unsigned(i).and_then(|at| usize::try_from(at).ok());
                if let Some(g) = at.and_then(|at| gradient.get_mut(at)) {
                    *g += w * t;
                }
            }
        }
        loss
    }
}

/// -1, 0 or 1.
fn sign(x: f32) -> f32 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

impl SpectralLoss {
    /// Prepares the transforms.
    #[must_use]
    pub(crate) fn new(settings: &LossSettings) -> Self {
        let grids = settings.n_fft.iter().map(|n| Grid::new(*n)).collect();
        Self { settings: settings.clone(), grids }
    }

    /// The loss of a clip: per ear and resolution the mean difference of magnitudes, logarithmic and linear, averaged over ears
    /// and resolutions; and the difference of the energy ratios between ears; all of it times `share`. Derivatives by the
    /// rendered samples go into `gradient`.
    pub(crate) fn of(&mut self, rendered: [&[f32]; 2], wanted: [&[f32]; 2], share: f32, gradient: &mut [Vec<f32>; 2]) -> f64 {
        let mut loss = 0.0;
        let part = 0.5 * share / self.grids.len() as f32;
        for ((rendered, wanted), gradient) in rendered.into_iter().zip(wanted).zip(&mut *gradient) {
            gradient.clear();
            gradient.resize(rendered.len(), 0.0);
            for grid in &mut self.grids {
                loss += grid.ear(&self.settings, part, rendered, wanted, gradient);
            }
        }
        let energy = |x: &[f32]| RATIO_EPS + x.iter().map(|v| f64::from(*v) * f64::from(*v)).sum::<f64>();
        let of = |ears: [&[f32]; 2]| ears.map(energy);
        let (got, want) = (of(rendered), of(wanted));
        let decibels = 10.0 / std::f64::consts::LN_10;
        let off = decibels * ((got[0] / got[1]).ln() - (want[0] / want[1]).ln());
        let weight = f64::from(share * self.settings.ratio);
        loss += weight * off.abs();
        for ((ear, gradient), (x, energy)) in [1.0, -1.0].into_iter().zip(gradient).zip(rendered.into_iter().zip(got)) {
            let slope = (weight * off.signum() * ear * decibels * 2.0 / energy) as f32;
            gradient.iter_mut().zip(x).for_each(|(g, x)| *g += slope * x);
        }
        loss
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_testing::noise;

    #[test]
    fn the_gradient_is_the_derivative_and_nothing_differs_from_itself() {
        let settings = LossSettings { n_fft: vec![32, 64], log: 1.0, linear: 0.4, ratio: 0.05, ..LossSettings::default() };
        let mut loss = SpectralLoss::new(&settings);
        let (a, b) = ([noise(1, 150), noise(2, 150)], [noise(3, 150), noise(4, 150).iter().map(|v| 0.5 * v).collect()]);
        let pair = |x: &'_ [Vec<f32>; 2]| -> [Vec<f32>; 2] { x.clone() };
        let mut gradient = [vec![], vec![]];
        loss.of([&a[0], &a[1]], [&b[0], &b[1]], 1.0, &mut gradient);
        let mut none = [vec![], vec![]];
        assert!(loss.of([&a[0], &a[1]], [&a[0], &a[1]], 1.0, &mut none) < 1e-9);
        // Sums of absolute values have kinks: many samples are moved at once, along the gradient.
        for ear in 0..2 {
            for from in [0, 40, 110] {
                let step = 2e-3;
                let norm: f32 = gradient[ear][from..from + 40].iter().map(|g| g * g).sum::<f32>().sqrt();
                let mut value = |side: f32| {
                    let mut moved = pair(&a);
                    let g = &gradient[ear][from..from + 40];
                    moved[ear][from..from + 40].iter_mut().zip(g).for_each(|(x, g)| *x += side * step * g / norm);
                    loss.of([&moved[0], &moved[1]], [&b[0], &b[1]], 1.0, &mut [vec![], vec![]])
                };
                let slope = (value(1.0) - value(-1.0)) / (2.0 * f64::from(step));
                assert!((slope - f64::from(norm)).abs() < 0.03 * f64::from(norm), "{slope} against {norm}");
            }
        }
    }
}
