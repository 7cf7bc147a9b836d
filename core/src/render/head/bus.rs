//! Ambisonic channels that images are added to.

use crate::render::head::ambisonic::{Channels, HeadConvolver, HeadSpectra};
use crate::scene::AMBISONIC_CHANNELS;
use crate::simd::LANES;
use promenade_fourier::num_complex::Complex32;
use pulp::{Arch, Simd, WithSimd};
use std::sync::Arc;

/// Images that are directed at once, so that a channel's sum is read and written once for all of them.
const ROWS: usize = 8;
/// Channels whose sums are kept in registers at a time, and of the last, where so many are left.
const TILE: usize = 8;
const LAST_TILE: usize = 4;

/// Samples of all channels that are worked on at a time, `[channel][sample]`.
type Chunk = [[f32; LANES]; AMBISONIC_CHANNELS];

/// A hop of all Ambisonic channels.
pub(crate) struct Bus {
    hop: usize,
    /// Channels that are heard; the others stay silent.
    channels: usize,
    chunks: Vec<Chunk>,
    /// Sound of images that have no direction yet, `[row][padded hop]`.
    sound: Vec<f32>,
    /// Harmonics of the direction of each at the start of the hop, and how they change until its end.
    from: [Channels; ROWS],
    change: [Channels; ROWS],
    rows: usize,
}

impl Bus {
    /// For so many pairs of channels.
    pub(crate) fn new(hop: usize, pairs: usize) -> Self {
        let chunks = hop.div_ceil(LANES);
        Self {
            hop,
            channels: 2 * pairs,
            chunks: vec![[[0.0; LANES]; AMBISONIC_CHANNELS]; chunks],
            sound: vec![0.0; ROWS * chunks * LANES],
            from: [[0.0; AMBISONIC_CHANNELS]; ROWS],
            change: [[0.0; AMBISONIC_CHANNELS]; ROWS],
            rows: 0,
        }
    }

    /// Samples of a hop.
    pub(crate) fn hop(&self) -> usize {
        self.hop
    }

    pub(crate) fn clear(&mut self) {
        self.chunks.fill([[0.0; LANES]; AMBISONIC_CHANNELS]);
        self.rows = 0;
    }

    /// Room for a sound whose harmonics go from some to others, the hop in whole chunks. Once it is written, it is added by
    /// [`Bus::add`].
    #[inline(always)]
    pub(crate) fn row(&mut self, from: &Channels, to: &Channels) -> &mut [[f32; LANES]] {
        let len = self.chunks.len();
        self.from[self.rows] = *from;
        self.change[self.rows] = std::array::from_fn(|c| to[c] - from[c]);
        &mut self.sound.as_chunks_mut().0[self.rows * len..][..len]
    }

    /// Adds the sound that was written last.
    #[inline(always)]
    pub(crate) fn add<S: Simd>(&mut self, simd: S) {
        self.rows += 1;
        if self.rows == ROWS {
            self.direct(simd);
        }
    }

    /// Directs what still waits for it. Then the hop may be read.
    pub(crate) fn finish(&mut self, arch: Arch) {
        arch.dispatch(Finish(self));
    }

    #[inline(always)]
    fn direct<S: Simd>(&mut self, simd: S) {
        let Self { hop, channels, chunks, sound, from, change, rows } = self;
        let len = chunks.len();
        let sound = sound.as_chunks::<LANES>().0;
        for (n, chunk) in chunks.iter_mut().enumerate() {
            // Directions turn by a small part of a degree from one chunk to the next.
            let along = ((n * LANES + LANES / 2) as f32 / *hop as f32).min(1.0);
            let mut shares = *from;
            for (share, change) in shares.as_flattened_mut().iter_mut().zip(change.as_flattened()) {
                *share += along * change;
            }
            for first in (0..*channels).step_by(TILE) {
                let waiting = (&shares[..*rows], sound, (len, n));
                if *channels - first > LAST_TILE {
                    tile::<S, TILE>(simd, first, waiting, chunk);
                } else {
                    tile::<S, LAST_TILE>(simd, first, waiting, chunk);
                }
            }
        }
        *rows = 0;
    }

    /// Writes the hop of two channels, the even one as real part.
    pub(crate) fn read(&self, pair: usize, out: &mut [Complex32]) {
        let sample = |chunk: &Chunk, i: usize| Complex32::new(chunk[2 * pair][i], chunk[2 * pair + 1][i]);
        let (whole, rest) = out[..self.hop].as_chunks_mut::<LANES>();
        for (out, chunk) in whole.iter_mut().zip(&self.chunks) {
            *out = std::array::from_fn(|i| sample(chunk, i));
        }
        if let Some(chunk) = self.chunks.last() {
            rest.iter_mut().enumerate().for_each(|(i, out)| *out = sample(chunk, i));
        }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.chunks) + size_of_val(&*self.sound)
    }
}

/// Adds sounds, each `chunks` long, to `N` channels of chunk `n`, from one channel on, by their shares in each.
#[inline(always)]
fn tile<S: Simd, const N: usize>(
    simd: S,
    first: usize,
    (shares, sound, (chunks, n)): (&[Channels], &[[f32; LANES]], (usize, usize)),
    chunk: &mut Chunk,
) {
    let channels = &mut chunk[first..][..N];
    for part in 0..LANES / S::F32_LANES {
        let mut sums: [S::f32s; N] = std::array::from_fn(|c| S::as_simd_f32s(&channels[c]).0[part]);
        for (row, shares) in shares.iter().enumerate() {
            let values = S::as_simd_f32s(&sound[row * chunks + n]).0[part];
            for c in 0..N {
                sums[c] = simd.mul_add_e_f32s(simd.splat_f32s(shares[first + c]), values, sums[c]);
            }
        }
        for c in 0..N {
            S::as_mut_simd_f32s(&mut channels[c]).0[part] = sums[c];
        }
    }
}

/// Where the moving arrivals of all voices are added up, and heard block by block; silence without a head.
pub(crate) struct AmbisonicBus {
    arch: Arch,
    bus: Bus,
    convolver: Option<HeadConvolver>,
    /// Whether anything was added in the running block.
    sounds: bool,
    /// Whether a block may end before it is there, and whether this one has.
    is_early: bool,
    has_ended: bool,
    /// What the ears hear of the block before.
    heard: [Vec<f32>; 2],
}

impl AmbisonicBus {
    /// For blocks as long as those of the head's spectra, which may end before they are there or not.
    pub(crate) fn new(head: Option<&Arc<HeadSpectra>>, is_early: bool) -> Self {
        let [block, pairs] = head.map_or([0; 2], |head| [head.hop(), head.pairs()]);
        Self {
            arch: Arch::new(),
            bus: Bus::new(block, pairs),
            convolver: head.map(|head| HeadConvolver::new(Arc::clone(head))),
            sounds: false,
            is_early,
            has_ended: false,
            heard: [vec![0.0; block], vec![0.0; block]],
        }
    }

    /// Makes ready for a voice of which something sounds; the first empties the bus.
    pub(crate) fn open(&mut self) -> &mut Bus {
        if !std::mem::replace(&mut self.sounds, true) {
            self.bus.clear();
        }
        &mut self.bus
    }

    /// Ends a block, which is heard during the next, unless it has ended early; the level of the difference between the ears
    /// goes to `width`.
    pub(crate) fn end_block(&mut self, width: f32) {
        if std::mem::take(&mut self.has_ended) {
            self.sounds = false;
            return;
        }
        self.heard.iter_mut().for_each(|ear| ear.fill(0.0));
        if let Some(convolver) = self.convolver.as_mut().filter(|_| std::mem::take(&mut self.sounds)) {
            self.bus.finish(self.arch);
            convolver.add(|pair, out| self.bus.read(pair, out), width, &mut self.heard);
        }
    }

    /// Ends a block before it is there.
    pub(crate) fn end_early(&mut self, width: f32) {
        if self.is_early {
            self.end_block(width);
            self.has_ended = true;
        }
    }

    /// Forgets what was added for a block.
    pub(crate) fn forget_prepared(&mut self) {
        (self.sounds, self.has_ended) = (false, false);
    }

    /// Adds what the ears hear of the block before, from a sample on.
    pub(crate) fn add_to(&self, at: usize, ears: [&mut [f32]; 2]) {
        for (ear, heard) in ears.into_iter().zip(&self.heard) {
            ear.iter_mut().zip(heard.iter().skip(at)).for_each(|(ear, x)| *ear += x);
        }
    }

    /// Forgets the past.
    pub(crate) fn reset(&mut self) {
        self.convolver.iter_mut().for_each(HeadConvolver::reset);
        self.forget_prepared();
        self.heard.iter_mut().for_each(|ear| ear.fill(0.0));
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let convolver = self.convolver.as_ref().map_or(0, HeadConvolver::memory_bytes);
        convolver + self.bus.memory_bytes() + 2 * size_of_val(&*self.heard[0])
    }
}

struct Finish<'a>(&'a mut Bus);

impl WithSimd for Finish<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.0.direct(simd);
    }
}
