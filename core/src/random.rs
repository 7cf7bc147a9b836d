//! Numbers for noise, rays, trials and starting weights, the same on every machine.

/// Numbers that look random and depend on a seed alone (splitmix64; Steele, Lea and Flood 2014).
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// One seed gives one sequence of numbers.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Stream number `index` of a seed, such as that of a ray, on whatever thread.
    #[must_use]
    pub fn stream(seed: u64, index: u64) -> Self {
        let offset = Self(seed).bits();
        Self(Self(offset ^ index.wrapping_mul(0xD6E8_FEB8_6659_FD93)).bits())
    }

    /// 64 bits.
    #[inline]
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        mix(self.0)
    }

    /// The next number, in [0, 1).
    #[inline]
    pub fn uniform(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / 16_777_216.0
    }

    /// The next number in double precision, in [0, 1).
    #[inline]
    pub fn uniform_f64(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Standard normal (Box and Muller 1958).
    pub fn normal(&mut self) -> f32 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f32::consts::TAU * self.uniform()).cos()
    }

    /// A whole number below `end`, which is above 0.
    #[expect(clippy::cast_possible_truncation, reason = "it is below a whole number of that kind")]
    pub fn below(&mut self, end: usize) -> usize {
        ((u128::from(self.bits()) * end as u128) >> 64) as usize
    }

    /// The numbers below `end` in random order (Fisher and Yates).
    pub fn order(&mut self, end: usize) -> Vec<usize> {
        let mut order: Vec<_> = (0..end).collect();
        for i in (1..end).rev() {
            order.swap(i, self.below(i + 1));
        }
        order
    }
}

/// Finaliser of the generator: a number that looks random of any other.
#[inline]
pub(crate) fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_are_those_of_splitmix64() {
        // The first of the reference implementation (S. Vigna, splitmix64.c) for the seed 1234567.
        let mut random = Random::new(1_234_567);
        let expected = [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        assert_eq!([random.bits(), random.bits(), random.bits()], expected);
    }

    #[test]
    fn streams_of_a_seed_are_their_own() {
        let first = |seed, index| Random::stream(seed, index).bits();
        let all: std::collections::BTreeSet<u64> = (0..1000).map(|index| first(7, index)).chain([first(8, 0)]).collect();
        assert_eq!(all.len(), 1001);
        assert_eq!(first(7, 3), first(7, 3));
    }

    #[test]
    fn an_order_has_every_number_once() {
        let mut order = Random::new(1).order(100);
        assert_ne!(order, (0..100).collect::<Vec<_>>());
        order.sort_unstable();
        assert_eq!(order, (0..100).collect::<Vec<_>>());
    }
}
