//! Fourier transforms: plans, whole signals by one call, and conversion between sample rates by them.
//!
//! A planner is generic, and a crate that makes one compiles all algorithms of the library again. Here they are compiled once,
//! for single and for double precision.
//!
//! ```
//! use promenade_fourier::{signal, spectrum};
//!
//! // A click, delayed by three samples: a phase that falls in proportion to frequency.
//! let mut bins = spectrum([1.0_f64, 0.0, 0.0, 0.0], 16);
//! assert!(bins.len() == 9 && bins.iter().all(|bin| (bin.norm() - 1.0).abs() < 1e-12));
//! for (k, bin) in bins.iter_mut().enumerate() {
//!     let turn = -std::f64::consts::TAU * 3.0 * k as f64 / 16.0;
//!     *bin *= promenade_fourier::num_complex::Complex::from_polar(1.0, turn);
//! }
//! let delayed = signal(bins, 16);
//! assert!(delayed.iter().enumerate().all(|(i, sample)| (sample - f64::from(u8::from(i == 3))).abs() < 1e-12));
//! ```

pub use realfft::{ComplexToReal, FftNum, RealToComplex, num_complex};
pub use rustfft::Fft;

mod minimum_phase;
mod rate;
mod whole;

pub use minimum_phase::{NO_GAIN, floored_log, minimum_phase, minimum_phase_log};
pub use rate::{RateConverter, resampled};
pub use whole::{Fourier, signal, spectrum};

use realfft::RealFftPlanner;
use rustfft::FftPlanner;
use std::cell::RefCell;
use std::sync::Arc;

/// A transform of `length` real samples to `length / 2 + 1` bins, unscaled. Making one allocates, using it does not.
#[must_use]
pub fn forward<T: Sample>(length: usize) -> Arc<dyn RealToComplex<T>> {
    T::forward(length)
}

/// A transform of `length / 2 + 1` bins to `length` real samples, unscaled: after [`forward`], `length` times the signal.
/// Making one allocates, using it does not.
#[must_use]
pub fn inverse<T: Sample>(length: usize) -> Arc<dyn ComplexToReal<T>> {
    T::inverse(length)
}

/// Transforms of `length` complex samples, forward and inverse, unscaled. Making them allocates, using them does not.
#[must_use]
pub fn complex(length: usize) -> [Arc<dyn Fft<f32>>; 2] {
    let mut planner = FftPlanner::new();
    [planner.plan_fft_forward(length), planner.plan_fft_inverse(length)]
}

/// Samples that there are transforms of: `f32` and `f64`.
pub trait Sample: FftNum {
    /// [`forward`] of these.
    fn forward(length: usize) -> Arc<dyn RealToComplex<Self>>;
    /// [`inverse`] of these.
    fn inverse(length: usize) -> Arc<dyn ComplexToReal<Self>>;
}

/// Plans and their lengths, the last one used last.
type Last<T> = Vec<(usize, Arc<T>)>;
/// As many are kept by a thread.
const KEPT_PLANS: usize = 6;

/// One of this thread's last plans if one is of this length, else a new one, which is kept: who transforms many signals of few
/// lengths need not hand plans around.
fn kept<T: ?Sized>(last: &mut Last<T>, length: usize, plan: impl FnOnce() -> Arc<T>) -> Arc<T> {
    let known = last.iter().position(|(of, _)| *of == length).map(|place| last.remove(place));
    let (_, plan) = known.unwrap_or_else(|| (length, plan()));
    if last.len() >= KEPT_PLANS {
        last.remove(0);
    }
    last.push((length, Arc::clone(&plan)));
    plan
}

macro_rules! sample {
    ($($float:ty),+) => {$(
        impl Sample for $float {
            fn forward(length: usize) -> Arc<dyn RealToComplex<Self>> {
                thread_local! {
                    static LAST: RefCell<Last<dyn RealToComplex<$float>>> = const { RefCell::new(Vec::new()) };
                }
                LAST.with_borrow_mut(|last| kept(last, length, || RealFftPlanner::new().plan_fft_forward(length)))
            }

            fn inverse(length: usize) -> Arc<dyn ComplexToReal<Self>> {
                thread_local! {
                    static LAST: RefCell<Last<dyn ComplexToReal<$float>>> = const { RefCell::new(Vec::new()) };
                }
                LAST.with_borrow_mut(|last| kept(last, length, || RealFftPlanner::new().plan_fft_inverse(length)))
            }
        }
    )+};
}

sample!(f32, f64);
