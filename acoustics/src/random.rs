//! Random numbers that depend on a seed and a count alone, on no thread.

/// SplitMix64 (Steele, Lea and Flood 2014), one stream for each ray.
#[derive(Clone, Debug)]
pub(crate) struct Random(u64);

impl Random {
    /// The stream of ray number `index`.
    pub(crate) fn new(seed: u64, index: u64) -> Self {
        let mut start = Self(seed);
        let offset = start.next();
        let mut stream = Self(offset ^ index.wrapping_mul(0xD6E8_FEB8_6659_FD93));
        Self(stream.next())
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// From 0 to below 1.
    pub(crate) fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }
}
