//! Photographs, and what networks make of them, as numbers at places.

use crate::error::FitError;

/// Numbers at places of a photograph, in rows from its upper left corner, all numbers of a place together.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    /// Places in a row, and rows.
    pub size: [usize; 2],
    /// Numbers of a place: red, green and blue from 0 to 1 of a photograph.
    pub channels: usize,
    /// All of them.
    pub values: Vec<f32>,
}

impl Raster {
    /// # Errors
    /// Numbers that are not as many as places times channels.
    pub fn new(size: [usize; 2], channels: usize, values: Vec<f32>) -> Result<Self, FitError> {
        let count = size[0].checked_mul(size[1]).and_then(|n| n.checked_mul(channels));
        if count != Some(values.len()) || values.is_empty() {
            return Err(FitError::argument("picture", format!("{size:?} places of {channels} numbers"), values.len()));
        }
        Ok(Self { size, channels, values })
    }

    /// This raster at another size, by means over what comes to lie in one place, or the nearest.
    #[must_use]
    pub fn resized(&self, size: [usize; 2]) -> Self {
        let [wide, high] = size.map(|side| side.max(1));
        let range = |to: usize, sides: usize, of: usize| {
            let first = to * of / sides;
            first..((to + 1) * of / sides).max(first + 1)
        };
        let mut values = Vec::with_capacity(wide * high * self.channels);
        for (y, x) in (0..high).flat_map(|y| (0..wide).map(move |x| (y, x))) {
            let (rows, columns) = (range(y, high, self.size[1]), range(x, wide, self.size[0]));
            let count = (rows.len() * columns.len()) as f32;
            for c in 0..self.channels {
                let places = rows.clone().flat_map(|r| columns.clone().map(move |k| r * self.size[0] + k));
                values.push(places.map(|p| self.values[p * self.channels + c]).sum::<f32>() / count);
            }
        }
        Self { size: [wide, high], channels: self.channels, values }
    }

    /// The numbers at a place from 0 to 1 across and down.
    pub(super) fn at(&self, [x, y]: [f64; 2]) -> &[f32] {
        let [x, y] = [(x, self.size[0]), (y, self.size[1])].map(|(v, n)| ((v * n as f64) as usize).min(n - 1));
        &self.values[(y * self.size[0] + x) * self.channels..][..self.channels]
    }
}
