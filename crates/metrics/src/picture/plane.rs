//! Numbers by pixel.

/// Weights of the low-pass between two levels of a pyramid (Burt and Adelson, IEEE Trans. Communications 31, 1983).
const LOW_PASS: [f32; 5] = [1.0 / 16.0, 0.25, 0.375, 0.25, 1.0 / 16.0];

/// Numbers of a picture, row by row from above.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Pixels in a row, at least 1.
    pub width: usize,
    /// Rows, at least 1.
    pub height: usize,
    /// `width * height` numbers.
    pub of: Vec<f32>,
}

impl Plane {
    /// Of numbers; none unless there is one for each of at least one pixel.
    #[must_use]
    pub fn new([width, height]: [usize; 2], of: Vec<f32>) -> Option<Self> {
        (!of.is_empty() && width.checked_mul(height) == Some(of.len())).then_some(Self { width, height, of })
    }

    /// The largest number, at least 0.
    pub(super) fn most(&self) -> f32 {
        self.of.iter().copied().fold(0.0, f32::max)
    }

    /// A number for each pixel of this plane and another of its size.
    pub(super) fn with(&self, other: &Self, of: impl Fn(f32, f32) -> f32) -> Self {
        let of = self.of.iter().zip(&other.of).map(|(a, b)| of(*a, *b)).collect();
        Self { width: self.width, height: self.height, of }
    }

    pub(super) fn map(&self, of: impl Fn(f32) -> f32) -> Self {
        Self { width: self.width, height: self.height, of: self.of.iter().map(|v| of(*v)).collect() }
    }

    /// Filtered with an odd number of weights along rows and others along columns; beyond its edges the plane is as at them.
    pub(super) fn filtered(&self, along: &[f32], down: &[f32]) -> Self {
        let (width, height) = (self.width, self.height);
        let mut rows = vec![0.0; self.of.len()];
        let reach = along.len() / 2;
        for (row, to) in self.of.chunks(width).zip(rows.chunks_mut(width)) {
            for (x, to) in to.iter_mut().enumerate() {
                let at = |k: usize| row[(x + k).saturating_sub(reach).min(width - 1)];
                *to = along.iter().enumerate().map(|(k, weight)| weight * at(k)).sum();
            }
        }
        let mut of = vec![0.0; self.of.len()];
        let reach = down.len() / 2;
        for (y, to) in of.chunks_mut(width).enumerate() {
            for (k, weight) in down.iter().enumerate() {
                let from = (y + k).saturating_sub(reach).min(height - 1) * width;
                for (to, from) in to.iter_mut().zip(&rows[from..from + width]) {
                    *to += weight * from;
                }
            }
        }
        Self { width, height, of }
    }

    /// The next level of a pyramid: low-passed, every second pixel.
    pub(super) fn halved(&self) -> Self {
        let smooth = self.filtered(&LOW_PASS, &LOW_PASS);
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let of = (0..width * height).map(|i| smooth.of[2 * (i / width) * self.width + 2 * (i % width)]).collect();
        Self { width, height, of }
    }

    /// At another size, bilinear between the middles of pixels.
    pub(super) fn resized(&self, [width, height]: [usize; 2]) -> Self {
        let place = |to: usize, of: usize, from: usize| {
            let at = ((to as f32 + 0.5) * from as f32 / of as f32 - 0.5).clamp(0.0, (from - 1) as f32);
            (at as usize, (at as usize + 1).min(from - 1), at.fract())
        };
        let mut of = Vec::with_capacity(width * height);
        for y in 0..height {
            let (above, below, down) = place(y, height, self.height);
            for x in 0..width {
                let (left, right, along) = place(x, width, self.width);
                let row = |y: usize| {
                    let (a, b) = (self.of[y * self.width + left], self.of[y * self.width + right]);
                    a + (b - a) * along
                };
                of.push(row(above) + (row(below) - row(above)) * down);
            }
        }
        Self { width, height, of }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_even_stays_even_at_any_size() {
        let plane = Plane::new([7, 5], vec![0.25; 35]).unwrap();
        let half = plane.halved();
        assert_eq!((half.width, half.height), (4, 3));
        assert!(half.of.iter().chain(&half.resized([9, 2]).of).all(|v| (v - 0.25).abs() < 1e-6));
        assert!(Plane::new([7, 5], vec![0.0; 34]).is_none() && Plane::new([0, 5], Vec::new()).is_none());
    }

    #[test]
    fn a_slope_is_a_slope_at_twice_the_size() {
        let plane = Plane::new([4, 1], vec![0.0, 1.0, 2.0, 3.0]).unwrap();
        assert_eq!(plane.resized([8, 1]).of, [0.0, 0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 3.0]);
    }
}
