//! The direct sound and the images, through the head.

use super::hrtf::Hrtf;
use super::tail::ends_real;
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use promenade_fourier::ComplexToReal;
use promenade_fourier::num_complex::{Complex32, Complex64};
use std::sync::Arc;

/// Samples before the arrival of an image at which its piece begins: the ripples of a fractional delay.
const LEAD: usize = 32;

/// What a head hears of one place.
pub(super) struct Arriving<'a> {
    /// World metres.
    pub(super) position: Vec3,
    /// What walls and air leave of its amplitude, by bin.
    pub(super) left: &'a [Complex32],
}

/// Filters and delays of images.
pub(super) struct Early<'a> {
    hrtf: &'a Hrtf,
    speed_m_s: f32,
    inverse: Arc<dyn ComplexToReal<f32>>,
}

impl<'a> Early<'a> {
    /// At a speed of sound in metres per second.
    pub(super) fn new(hrtf: &'a Hrtf, speed_m_s: f32) -> Self {
        Self { hrtf, speed_m_s, inverse: promenade_fourier::inverse(hrtf.bins.n_fft) }
    }

    /// Adds images to what a head hears: `1/r`, after `r` over the speed of sound.
    pub(super) fn add<'b>(&self, pose: &Pose, images: impl IntoIterator<Item = Arriving<'b>>, ears: &mut [Vec<f32>; 2]) {
        let bins = self.hrtf.bins;
        let mut spectrum = self.inverse.make_input_vec();
        let mut piece = self.inverse.make_output_vec();
        let mut scratch = self.inverse.make_scratch_vec();
        for image in images {
            let to_head = pose.to_head(image.position);
            let distance = to_head.length();
            let near = self.hrtf.near(to_head / distance);
            for (ear, out) in ears.iter_mut().enumerate() {
                let arrival = f64::from(distance / self.speed_m_s) * bins.sample_rate_hz + f64::from(near.delay(ear));
                let start = arrival.floor() - LEAD as f64;
                if start >= out.len() as f64 {
                    continue;
                }
                near.spectrum(ear, &mut spectrum);
                turn(&mut spectrum, image.left, arrival - start, bins.n_fft, 1.0 / (distance * bins.n_fft as f32));
                // The lengths come from the plan, and the ends are real: the only things that the transform checks.
                let done = self.inverse.process_with_scratch(&mut spectrum, &mut piece, &mut scratch);
                debug_assert!(done.is_ok());
                let start = start as i64;
                let skip = usize::try_from(-start).unwrap_or(0);
                let from = usize::try_from(start).unwrap_or(0);
                for (o, v) in out.iter_mut().skip(from).zip(piece.iter().skip(skip)) {
                    *o += v;
                }
            }
        }
    }
}

/// Reflects, delays by samples and scales.
fn turn(spectrum: &mut [Complex32], walls: &[Complex32], delay: f64, n_fft: usize, gain: f32) {
    let angle = -2.0 * std::f64::consts::PI * delay / n_fft as f64;
    let step = Complex64::cis(angle);
    let mut phase = Complex64::new(f64::from(gain), 0.0);
    for (s, w) in spectrum.iter_mut().zip(walls) {
        let p = Complex32::new(phase.re as f32, phase.im as f32);
        *s *= w * p;
        phase *= step;
    }
    ends_real(spectrum);
}
