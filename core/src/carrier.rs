//! Fixed pseudo-random spectra that carry the time filters.

use crate::bands::{BandPlace, Bands};
use crate::{StftGrid, TailModel};
use realfft::RealFftPlanner;
use realfft::num_complex::Complex32;

/// Bins from one random angle of [`smooth_phases`] to the next.
const PHASE_BINS: usize = 10;

/// Spectra of both ears for one hop of a room's response.
pub(crate) type EarSpectra = [Vec<Complex32>; 2];

/// Where every bin of a host grid lies among a scene's bands.
pub(crate) fn band_places(grid: &StftGrid, bands: &Bands, top_hz: f32) -> Vec<BandPlace> {
    #[expect(clippy::cast_possible_truncation, reason = "a frequency in Hz")]
    (0..grid.bins()).map(|k| bands.place((grid.bin_hz(k) as f32).min(top_hz))).collect()
}

/// Carriers of explicit taps: noise one hop long, from [`StftGrid::lead`] before its tap on, of unit energy in every band. Sets with different `set`
/// numbers are unrelated.
///
/// Filters this short fit the room that frames leave for them, so they are time-invariant: no echo ahead of the direct sound, no
/// modulation at the hop rate, and tones stay tones, which phases drawn anew for every bin would not leave.
pub(crate) fn hop_carriers(grid: &StftGrid, places: &[BandPlace], tail: &TailModel, set: u64, hops: usize) -> Vec<EarSpectra> {
    let n = grid.n_fft;
    let forward = RealFftPlanner::new().plan_fft_forward(n);
    let mut scratch = forward.make_scratch_vec();
    let coherence = per_bin(places, &tail.coherence);
    let mut spectrum = |stream: u64, hop: usize| {
        let mut noise = Noise::new(tail.seed, stream, hop as u64);
        let mut time = vec![0.0; n];
        let scale = 1.0 / (grid.hop as f32).sqrt();
        for m in 0..grid.hop {
            time[(n + m - grid.lead()) % n] = scale * noise.gaussian();
        }
        let mut out = forward.make_output_vec();
        let done = forward.process_with_scratch(&mut time, &mut out, &mut scratch);
        debug_assert!(done.is_ok());
        out
    };
    (0..hops)
        .map(|hop| {
            let left = spectrum(2 * set, hop);
            let other = spectrum(2 * set + 1, hop);
            let mut ears = [left.clone(), blend_ears(&left, &other, &coherence)];
            for ear in &mut ears {
                level_bands(ear, places, tail.coherence.len());
            }
            ears
        })
        .collect()
}

/// Unit phasors that turn slowly from bin to bin: a random angle every [`PHASE_BINS`] bins, with a raised cosine in between.
pub(crate) fn smooth_phases(grid: &StftGrid, seed: u64, stream: u64) -> Vec<Complex32> {
    let mut noise = Noise::new(seed, stream, 0);
    let knots: Vec<f32> = (0..grid.bins() / PHASE_BINS + 2).map(|_| noise.phase()).collect();
    (0..grid.bins())
        .map(|k| {
            let (knot, along) = (k / PHASE_BINS, (k % PHASE_BINS) as f32 / PHASE_BINS as f32);
            let share = 0.5 - 0.5 * (std::f32::consts::PI * along).cos();
            Complex32::from_polar(1.0, knots[knot] + share * (knots[knot + 1] - knots[knot]))
        })
        .collect()
}

/// A value per band, spread over bins.
pub(crate) fn per_bin(places: &[BandPlace], bands: &[f32]) -> Vec<f32> {
    places.iter().map(|p| bands[p.band] + p.fraction * (bands[p.band + 1] - bands[p.band])).collect()
}

/// The right ear's carrier with the wanted interaural coherence (real, per bin) to the left's.
fn blend_ears(left: &[Complex32], other: &[Complex32], coherence: &[f32]) -> Vec<Complex32> {
    left.iter().zip(other).zip(coherence).map(|((l, o), c)| l * c + o * (1.0 - c * c).max(0.0).sqrt()).collect()
}

/// Scales a spectrum so that its mean energy is 1 in every band, whatever the draw: gains then mean the same at every host rate.
fn level_bands(spectrum: &mut [Complex32], places: &[BandPlace], bands: usize) {
    let (mut energy, mut weight) = (vec![0.0_f32; bands], vec![1e-9_f32; bands]);
    for (x, p) in spectrum.iter().zip(places) {
        for (band, w) in [(p.band, 1.0 - p.fraction), (p.band + 1, p.fraction)] {
            energy[band] += w * x.norm_sqr();
            weight[band] += w;
        }
    }
    let gain: Vec<f32> = energy.iter().zip(&weight).map(|(e, w)| if *e > 0.0 { (w / e).sqrt() } else { 0.0 }).collect();
    for (x, g) in spectrum.iter_mut().zip(per_bin(places, &gain)) {
        *x *= g;
    }
}

/// Counter-based noise: the same numbers for the same seed, stream and index on every machine.
struct Noise {
    state: u64,
}

impl Noise {
    fn new(seed: u64, stream: u64, index: u64) -> Self {
        Self { state: mix(mix(mix(seed) ^ stream) ^ index) }
    }

    /// Uniform in (0, 1).
    fn uniform(&mut self) -> f32 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        ((mix(self.state) >> 40) as f32 + 0.5) / 16_777_216.0
    }

    fn phase(&mut self) -> f32 {
        std::f32::consts::TAU * self.uniform()
    }

    /// Standard normal (Box and Muller 1958).
    fn gaussian(&mut self) -> f32 {
        (-2.0 * self.uniform().ln()).sqrt() * self.phase().cos()
    }
}

/// Finaliser of the splitmix64 generator (Steele, Lea and Flood 2014).
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
