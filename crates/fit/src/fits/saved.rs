//! The state of a fit between two rounds, to the bit.

use crate::error::FitError;
use crate::numerics::Adam;
use crate::search::Scanned;
use promenade_fourier::num_complex::Complex64;

/// What a file of it begins with.
const MAGIC: &[u8; 8] = b"PROMFIT1";
/// Numbers of one kind in a file at most.
const MOST: usize = 1 << 24;

/// A fit that goes on from here comes to the same bits as one that was never left.
#[derive(Clone, Debug, PartialEq)]
pub struct Saved {
    /// Rounds that are done.
    pub(crate) round: usize,
    pub(crate) x: Vec<f64>,
    pub(crate) adam: Adam,
    /// The chain's spectrum.
    pub(crate) chain: Vec<Complex64>,
    pub(crate) scanned: Vec<Scanned>,
    /// What it is of.
    pub(crate) digest: u64,
}

impl Saved {
    /// Rounds that are done.
    #[must_use]
    pub fn rounds(&self) -> usize {
        self.round
    }

    /// As the content of a file.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        let mut number = |n: u64| bytes.extend(n.to_le_bytes());
        [self.digest, self.round as u64, self.adam.steps.cast_unsigned().into()].into_iter().for_each(&mut number);
        [self.x.len(), self.chain.len(), self.scanned.len()].into_iter().for_each(|n| number(n as u64));
        let chain = self.chain.iter().flat_map(|c| [c.re, c.im]);
        let scanned = self.scanned.iter().flat_map(|s| [s.moved_m, s.stands_out, f64::from(u8::from(s.found))]);
        let all = self.x.iter().chain(&self.adam.mean).chain(&self.adam.power).copied().chain(chain).chain(scanned);
        all.for_each(|v| number(v.to_bits()));
        bytes
    }

    /// From the content of a file.
    ///
    /// # Errors
    /// One that is none, or cut off.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, FitError> {
        let wrong = |found: String| FitError::argument("state of a fit", "a whole one of this version", found);
        let rest = bytes.strip_prefix(MAGIC.as_slice()).ok_or_else(|| wrong("something else".to_owned()))?;
        let (words, over) = rest.as_chunks::<8>();
        let words: Vec<u64> = words.iter().map(|w| u64::from_le_bytes(*w)).collect();
        let [digest, round, steps, x, chain, scanned, ..] = words[..] else {
            return Err(wrong(format!("{} bytes", bytes.len())));
        };
        let [x, chain, scanned] = [x, chain, scanned].map(|n| usize::try_from(n).unwrap_or(usize::MAX));
        let most = [x, chain, scanned].into_iter().max().unwrap_or(0);
        if most > MOST || words.len() != 6 + 3 * x + 2 * chain + 3 * scanned || !over.is_empty() {
            return Err(wrong(format!("{} bytes", bytes.len())));
        }
        let mut all = words[6..].iter().map(|w| f64::from_bits(*w));
        let mut some = |count: usize| all.by_ref().take(count).collect::<Vec<f64>>();
        let (x, mean, power) = (some(x), some(x), some(x));
        let (chain, scanned) = (some(2 * chain), some(3 * scanned));
        Ok(Self {
            round: usize::try_from(round).map_err(|_| wrong(format!("round {round}")))?,
            x,
            adam: Adam { mean, power, steps: i32::try_from(steps).map_err(|_| wrong(format!("step {steps}")))? },
            chain: chain.as_chunks::<2>().0.iter().map(|[re, im]| Complex64::new(*re, *im)).collect(),
            scanned: scanned
                .as_chunks::<3>()
                .0
                .iter()
                .map(|[moved_m, stands_out, found]| Scanned { moved_m: *moved_m, stands_out: *stands_out, found: *found > 0.5 })
                .collect(),
            digest,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_comes_back_to_the_bit_and_a_damaged_one_does_not() {
        let mut adam = Adam::new(3);
        adam.step(&mut [0.1, 0.2, 0.3], &[1.0, -2.0, 1e-300], &[0.1; 3]);
        let saved = Saved {
            round: 7,
            x: vec![0.1 + 0.2, -0.0, f64::MIN_POSITIVE],
            adam,
            chain: vec![Complex64::new(1.0, -0.3); 5],
            scanned: vec![Scanned { moved_m: 0.1, stands_out: 3.0, found: true }; 6],
            digest: u64::MAX - 3,
        };
        let bytes = saved.to_bytes();
        assert_eq!(Saved::from_bytes(&bytes).unwrap(), saved);
        for wrong in [&bytes[..bytes.len() - 1], &bytes[..40], &bytes[1..], &[]] {
            assert!(Saved::from_bytes(wrong).is_err());
        }
        let mut huge = bytes.clone();
        huge[8 + 3 * 8 + 7] = 0x7F;
        assert!(Saved::from_bytes(&huge).is_err());
    }
}
