//! Random numbers that depend on a seed alone.

use promenade_core::random::Random as Bits;

/// The engine's generator in double precision.
#[derive(Clone, Debug)]
pub struct Random(Bits);

impl Random {
    /// A stream of its own for each seed and number.
    #[must_use]
    pub fn new(seed: u64, number: u64) -> Self {
        let offset = Bits::new(seed ^ 0x5851_F42D_4C95_7F2D).bits();
        Self(Bits::new(offset ^ number.wrapping_mul(0xD6E8_FEB8_6659_FD93)))
    }

    /// From 0 to below 1.
    pub fn uniform(&mut self) -> f64 {
        self.0.uniform_f64()
    }

    /// Of mean 0 and variance 1 (Box and Muller 1958).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }

    /// `count` different numbers below `of` in rising order, or all where there are no more; these ask for no random number.
    pub(crate) fn batch(&mut self, count: usize, of: usize) -> Vec<usize> {
        if of <= count { (0..of).collect() } else { self.choose(count, of) }
    }

    /// `count` different numbers below `of`, in rising order.
    pub fn choose(&mut self, count: usize, of: usize) -> Vec<usize> {
        let mut all: Vec<usize> = (0..of).collect();
        for i in 0..count.min(of) {
            let other = i + (self.uniform() * (of - i) as f64) as usize;
            all.swap(i, other.min(of - 1));
        }
        all.truncate(count);
        all.sort_unstable();
        all
    }
}
