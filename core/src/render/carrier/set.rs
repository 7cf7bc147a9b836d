//! Carriers as the render head reads them: spectra of hops in blocks of bins.

use crate::Shares;
use crate::bands::BandPlace;
use crate::render::carrier::noise::EarSpectra;
use crate::render::transform::lanes::{EarBlocks, LANES, blocks_for};

/// Spectra of hops in blocks of bins.
pub(crate) struct CarrierSet {
    hops: usize,
    blocks: usize,
    /// `[response][hop][block]`
    spectra: Vec<EarBlocks>,
}

impl CarrierSet {
    /// Packs spectra, `[response][hop]`, of `bins` bins or of as many as the spectra have.
    pub(crate) fn pack(spectra: impl Iterator<Item = EarSpectra>, hops: usize, bins: usize) -> Self {
        let blocks = blocks_for(bins);
        let mut packed = Vec::new();
        for ears in spectra {
            let start = packed.len();
            packed.resize(start + blocks, EarBlocks::default());
            for (ear, spectrum) in ears.iter().enumerate() {
                for (k, x) in spectrum.iter().take(bins).enumerate() {
                    let block = &mut packed[start + k / LANES].ears[ear];
                    block.re[k % LANES] = x.re;
                    block.im[k % LANES] = x.im;
                }
            }
        }
        Self { hops, blocks, spectra: packed }
    }

    /// Hops of each response.
    pub(crate) fn hops(&self) -> usize {
        self.hops
    }

    /// Number of responses.
    pub(crate) fn count(&self) -> usize {
        self.spectra.len() / (self.hops * self.blocks).max(1)
    }

    /// One hop of a response, block by block.
    pub(crate) fn hop(&self, response: u32, hop: usize) -> &[EarBlocks] {
        let start = (response as usize * self.hops + hop) * self.blocks;
        &self.spectra[start..start + self.blocks]
    }

    /// Energy of one hop of carriers, each with its share, by band.
    pub(crate) fn carried(&self, hop: usize, shares: &Shares, places: &[BandPlace]) -> Vec<f64> {
        let bands = places.iter().map(|place| place.band + 2).max().unwrap_or(0);
        let (mut sums, mut weights) = (vec![0.0; bands], vec![1e-9; bands]);
        for (response, share) in shares.entries() {
            let blocks = self.hop(*response, hop);
            for (k, place) in places.iter().enumerate() {
                let block = &blocks[k / LANES];
                let power: f32 = block.ears.iter().map(|ear| ear.re[k % LANES].powi(2) + ear.im[k % LANES].powi(2)).sum();
                for (band, weight) in [(place.band, 1.0 - place.fraction), (place.band + 1, place.fraction)] {
                    sums[band] += f64::from(0.5 * share * weight * power);
                    weights[band] += f64::from(share * weight);
                }
            }
        }
        sums.iter().zip(weights).map(|(sum, weight)| sum / weight).collect()
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.spectra)
    }
}
