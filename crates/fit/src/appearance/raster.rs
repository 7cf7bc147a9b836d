//! Photographs as colours at places.

use crate::error::FitError;

/// Colours at places of a photograph, in rows from its upper left corner.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    /// Places in a row, and rows.
    pub size: [usize; 2],
    /// Red, green and blue of each place, 0 to 1.
    pub values: Vec<[f32; 3]>,
}

impl Raster {
    /// # Errors
    /// Colours that are not as many as places.
    pub fn new(size: [usize; 2], values: Vec<[f32; 3]>) -> Result<Self, FitError> {
        if size[0].checked_mul(size[1]) != Some(values.len()) || values.is_empty() {
            return Err(FitError::argument("picture", format!("colours of {size:?} places"), values.len()));
        }
        Ok(Self { size, values })
    }

    /// This raster at another size, by means over what comes to lie in one place, or the nearest.
    #[must_use]
    pub fn resized(&self, size: [usize; 2]) -> Self {
        let [wide, high] = size.map(|side| side.max(1));
        let range = |to: usize, sides: usize, of: usize| {
            let first = to * of / sides;
            first..((to + 1) * of / sides).max(first + 1)
        };
        let mean = |(y, x): (usize, usize)| {
            let (rows, columns) = (range(y, high, self.size[1]), range(x, wide, self.size[0]));
            let count = (rows.len() * columns.len()) as f32;
            let places = || rows.clone().flat_map(|r| columns.clone().map(move |k| r * self.size[0] + k));
            std::array::from_fn(|c| places().map(|p| self.values[p][c]).sum::<f32>() / count)
        };
        let values = (0..high).flat_map(|y| (0..wide).map(move |x| (y, x))).map(mean).collect();
        Self { size: [wide, high], values }
    }

    /// The colour at a place from 0 to 1 across and down.
    pub(super) fn at(&self, [x, y]: [f64; 2]) -> &[f32; 3] {
        let [x, y] = [(x, self.size[0]), (y, self.size[1])].map(|(v, n)| ((v * n as f64) as usize).min(n - 1));
        &self.values[y * self.size[0] + x]
    }
}
