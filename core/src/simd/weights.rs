//! Weights in the order in which sums over inputs read them.

/// Outputs whose weights lie side by side.
pub(crate) const TILE: usize = 8;

/// Weights and biases from inputs to outputs, in tiles of [`TILE`] outputs; what fills up the last tile is 0.
#[derive(Clone, Debug)]
pub(crate) struct Weights {
    /// `[output / TILE][input][output % TILE]`.
    packed: Vec<[f32; TILE]>,
    bias: Vec<[f32; TILE]>,
    inputs: usize,
    outputs: usize,
}

impl Weights {
    /// From a value by input and output, without biases.
    pub(crate) fn new(inputs: usize, outputs: usize, at: impl Fn(usize, usize) -> f32) -> Self {
        let tiles = outputs.div_ceil(TILE);
        let (packed, bias) = (vec![[0.0; TILE]; tiles * inputs], vec![[0.0; TILE]; tiles]);
        let mut weights = Self { packed, bias, inputs, outputs };
        weights.set(at);
        weights
    }

    /// Takes other values, by input and output. Does not allocate.
    pub(crate) fn set(&mut self, at: impl Fn(usize, usize) -> f32) {
        for (tile, block) in self.packed.chunks_exact_mut(self.inputs.max(1)).enumerate() {
            for (input, w) in block.iter_mut().enumerate() {
                for (w, output) in w.iter_mut().zip(tile * TILE..self.outputs) {
                    *w = at(input, output);
                }
            }
        }
    }

    /// Takes the values of rows, one per input, of the outputs' values filled up to whole tiles. Does not allocate.
    pub(crate) fn set_rows<'a>(&mut self, row: impl Fn(usize) -> &'a [f32]) {
        for (tile, block) in self.packed.chunks_exact_mut(self.inputs.max(1)).enumerate() {
            for (input, w) in block.iter_mut().enumerate() {
                w.copy_from_slice(&row(input)[tile * TILE..][..TILE]);
            }
        }
    }

    /// Takes a bias per output. Does not allocate.
    pub(crate) fn set_bias(&mut self, bias: &[f32]) {
        self.bias.as_flattened_mut().iter_mut().zip(bias).for_each(|(b, bias)| *b = *bias);
    }

    pub(crate) fn inputs(&self) -> usize {
        self.inputs
    }

    pub(crate) fn outputs(&self) -> usize {
        self.outputs
    }

    /// Weights of a tile of outputs, one entry per input.
    #[inline(always)]
    pub(crate) fn tile(&self, tile: usize) -> &[[f32; TILE]] {
        &self.packed[tile * self.inputs..][..self.inputs]
    }

    /// The weights of all tiles, one after the other.
    #[inline(always)]
    pub(crate) fn packed(&self) -> &[[f32; TILE]] {
        &self.packed
    }

    /// Biases by tile.
    #[inline(always)]
    pub(crate) fn bias(&self) -> &[[f32; TILE]] {
        &self.bias
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of::<[f32; TILE]>() * (self.packed.len() + self.bias.len())
    }
}
