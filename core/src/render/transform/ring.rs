//! The newest spectra of a sound.

use crate::render::transform::block::Block;
use crate::simd::LANES;
use promenade_fourier::num_complex::Complex32;

/// As many frames as there are slots, in blocks of bins.
pub(crate) struct Ring {
    /// `[block][slot]`; after the newest frame's slot comes that of the frame before it, and so on round the ring.
    blocks: Vec<Block>,
    slots: usize,
    newest: usize,
}

impl Ring {
    /// Silent frames.
    pub(crate) fn new(blocks: usize, slots: usize) -> Self {
        Self { blocks: vec![Block::default(); blocks * slots], slots, newest: 0 }
    }

    /// Frames that are kept.
    pub(crate) fn slots(&self) -> usize {
        self.slots
    }

    /// Makes room for the next frame in the place of the oldest.
    pub(crate) fn advance(&mut self) -> SlotMut<'_> {
        self.newest = self.newest.checked_sub(1).unwrap_or(self.slots - 1);
        self.at_mut(0)
    }

    /// Takes the next frame, as many bins as there is room for.
    pub(crate) fn write(&mut self, spectrum: &[Complex32]) {
        self.advance().write(spectrum);
    }

    /// A frame that is `age` frames older than the newest, below the number of slots.
    pub(crate) fn at(&self, age: usize) -> Slot<'_> {
        Slot { blocks: &self.blocks, slots: self.slots, at: (self.newest + age) % self.slots }
    }

    /// The slot of a spectrum that is `age` hops old, to write to.
    pub(crate) fn at_mut(&mut self, age: usize) -> SlotMut<'_> {
        SlotMut { blocks: &mut self.blocks, slots: self.slots, at: (self.newest + age) % self.slots }
    }

    /// Silence in all frames.
    pub(crate) fn reset(&mut self) {
        self.blocks.fill(Block::default());
        self.newest = 0;
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.blocks)
    }
}

/// One frame of a ring, and those that are older, up to the end of the ring and from its beginning on.
#[derive(Clone, Copy)]
pub(crate) struct Slot<'a> {
    blocks: &'a [Block],
    slots: usize,
    at: usize,
}

impl<'a> Slot<'a> {
    /// A frame that is by itself.
    #[cfg(any(test, feature = "gradients"))]
    pub(crate) fn of(blocks: &'a [Block]) -> Self {
        Self { blocks, slots: 1, at: 0 }
    }

    /// Block by block, what has been taken in: this frame, then as many older ones as there are slots.
    #[inline(always)]
    pub(crate) fn histories(self) -> impl Iterator<Item = [&'a [Block]; 2]> {
        self.blocks.chunks_exact(self.slots).map(move |row| {
            let (before, from) = row.split_at(self.at);
            [from, before]
        })
    }

    /// Its blocks.
    #[inline(always)]
    pub(crate) fn blocks(self) -> impl Iterator<Item = &'a Block> {
        self.blocks.chunks_exact(self.slots).map(move |row| &row[self.at])
    }
}

/// One frame of a ring, to write to.
pub(crate) struct SlotMut<'a> {
    blocks: &'a mut [Block],
    slots: usize,
    at: usize,
}

impl<'a> SlotMut<'a> {
    /// A frame that is by itself.
    pub(crate) fn of(blocks: &'a mut [Block]) -> Self {
        Self { blocks, slots: 1, at: 0 }
    }

    /// Its blocks.
    #[inline(always)]
    pub(crate) fn blocks(self) -> impl Iterator<Item = &'a mut Block> {
        self.blocks.chunks_exact_mut(self.slots).map(move |row| &mut row[self.at])
    }

    /// Writes a spectrum, as many bins as there is room for; the rest of its last block is silent.
    pub(crate) fn write(self, spectrum: &[Complex32]) {
        for (block, bins) in self.blocks().zip(spectrum.chunks(LANES)) {
            match bins.first_chunk::<LANES>() {
                Some(bins) => *block = Block { re: bins.map(|x| x.re), im: bins.map(|x| x.im) },
                None => {
                    *block = Block::default();
                    for (i, x) in bins.iter().enumerate() {
                        (block.re[i], block.im[i]) = (x.re, x.im);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_found_by_their_age() {
        let (bins, slots) = (LANES + 3, 4);
        let mut ring = Ring::new(2, slots);
        for frame in 1..10 {
            let at = |bin: usize| Complex32::new((100 * frame + bin) as f32, -1.0);
            ring.write(&(0..bins).map(at).collect::<Vec<_>>());
            for age in 0..slots.min(frame) {
                let wanted = |bin: usize| (100 * (frame - age) + bin) as f32;
                let found: Vec<_> = ring.at(age).blocks().collect();
                assert_eq!((found[0].re[2], found[1].re[2], found[1].re[3]), (wanted(2), wanted(LANES + 2), 0.0));
                let histories: Vec<_> = ring.at(age).histories().map(|parts| parts.concat()).collect();
                assert_eq!((histories[1].len(), histories[1][0].re[0]), (slots, wanted(LANES)));
                let older = &histories[0][..slots.min(frame) - age];
                assert!(older.iter().enumerate().all(|(i, block)| block.re[0] == wanted(0) - 100.0 * i as f32));
            }
        }
        ring.at_mut(1).blocks().for_each(|block| block.re[0] = 7.0);
        assert!(ring.at(1).blocks().all(|block| block.re[0] == 7.0));
        ring.reset();
        assert!(ring.at(0).blocks().all(|block| *block == Block::default()));
    }
}
