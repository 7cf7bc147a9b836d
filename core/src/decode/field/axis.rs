//! Positions of a field's nodes along one coordinate.

use glam::Vec3;
use std::f32::consts::TAU;

/// Rising positions along one coordinate of a field, evenly spaced or not.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    nodes: Vec<f32>,
    circle: bool,
}

impl Axis {
    /// Takes finite, strictly rising positions; on a `circle` they are angles, radians, within one turn, and the last one
    /// neighbours the first. `None` otherwise.
    #[must_use]
    pub fn new(nodes: Vec<f32>, circle: bool) -> Option<Self> {
        let rising = nodes.windows(2).all(|w| w[0] < w[1]) && nodes.iter().all(|v| v.is_finite());
        let turn = !circle || nodes.len() < 2 || nodes[nodes.len() - 1] - nodes[0] < TAU;
        (!nodes.is_empty() && rising && turn).then_some(Self { nodes, circle })
    }

    /// An axis with a single position.
    #[must_use]
    pub fn single(at: f32) -> Self {
        Self { nodes: vec![at], circle: false }
    }

    /// `count` evenly spaced positions, `step` above 0 apart; the ends hold.
    #[must_use]
    pub fn uniform(start: f32, step: f32, count: usize) -> Self {
        Self { nodes: (0..count.max(1)).map(|i| start + step * i as f32).collect(), circle: false }
    }

    /// `count` evenly spaced angles on a full circle, radians.
    #[must_use]
    pub fn circle(start: f32, count: usize) -> Self {
        let step = TAU / count.max(1) as f32;
        Self { circle: true, ..Self::uniform(start, step, count) }
    }

    /// Number of positions, at least 1.
    #[must_use]
    pub fn count(&self) -> usize {
        self.nodes.len()
    }

    /// All positions, rising.
    #[must_use]
    pub fn nodes(&self) -> &[f32] {
        &self.nodes
    }

    /// Mean distance from a position to its neighbours, over that of all positions: 1 where they are evenly spaced.
    pub(crate) fn share(&self, index: usize) -> f32 {
        let (count, n) = (self.count(), &self.nodes);
        if count < 2 {
            return 1.0;
        }
        let turn = if self.circle { TAU } else { 0.0 };
        let below = if index > 0 { Some(n[index] - n[index - 1]) } else { self.circle.then(|| n[0] + turn - n[count - 1]) };
        let above = if index + 1 < count { Some(n[index + 1] - n[index]) } else { self.circle.then(|| n[0] + turn - n[index]) };
        let gaps = below.into_iter().chain(above);
        let (sum, number) = gaps.fold((0.0, 0.0), |(sum, number), gap| (sum + gap, number + 1.0));
        let whole = if self.circle { TAU / count as f32 } else { (n[count - 1] - n[0]) / (count - 1) as f32 };
        sum / (number * whole)
    }

    /// Whether the last position neighbours the first.
    #[must_use]
    pub fn is_circle(&self) -> bool {
        self.circle
    }

    /// First position.
    #[must_use]
    pub fn start(&self) -> f32 {
        self.nodes[0]
    }

    /// Last position.
    #[must_use]
    pub fn end(&self) -> f32 {
        self.nodes[self.nodes.len() - 1]
    }

    /// The one or two nodes around a value with their weights, and how many there are; beyond the ends the last ones hold.
    #[must_use]
    pub fn linear(&self, value: f32) -> ([(usize, f32); 4], usize) {
        let (low, high, fraction) = self.around(value);
        ([(low, 1.0 - fraction), (high, fraction), (0, 0.0), (0, 0.0)], if fraction > 0.0 { 2 } else { 1 })
    }

    /// The places `[z][y][x]` around a position among those of three axes, with weights that sum to 1.
    pub(crate) fn places_around(axes: &[Self; 3], position: Vec3) -> impl Iterator<Item = (usize, f32)> + use<> {
        let [x, y, z] = [0, 1, 2].map(|axis| axes[axis].linear(position[axis]));
        let [nx, ny] = [0, 1].map(|axis| axes[axis].count());
        let pairs = |(nodes, count): ([(usize, f32); 4], usize)| nodes.into_iter().take(count);
        pairs(z).flat_map(move |(k, wz)| {
            pairs(y).flat_map(move |(j, wy)| pairs(x).map(move |(i, wx)| ((k * ny + j) * nx + i, wx * wy * wz)))
        })
    }

    /// The two nodes around a value and the weight of the second.
    fn around(&self, value: f32) -> (usize, usize, f32) {
        let last = self.nodes.len() - 1;
        if last == 0 {
            return (0, 0, 0.0);
        }
        let value = if self.circle { self.start() + (value - self.start()).rem_euclid(TAU) } else { value };
        let above = self.nodes.partition_point(|n| *n <= value);
        if above == 0 {
            return (0, 0, 0.0);
        }
        let low = above - 1;
        let (high, end) = match (above <= last, self.circle) {
            (true, _) => (above, self.nodes[above]),
            (false, true) => (0, self.start() + TAU),
            (false, false) => return (last, last, 0.0),
        };
        let fraction = (value - self.nodes[low]) / (end - self.nodes[low]);
        // A value that is no number falls to the lower node.
        if (0.0..=1.0).contains(&fraction) { (low, high, fraction) } else { (low, low, 0.0) }
    }
}

impl Axis {
    /// Up to four nodes around a value with the weights of the cubic through them (Lagrange's form), and how many there are;
    /// beyond the ends the last ones hold. Fewer than four nodes carry a polynomial of lower degree.
    #[must_use]
    pub fn cubic(&self, value: f32) -> ([(usize, f32); 4], usize) {
        let mut out = [(0, 0.0); 4];
        let (low, _, fraction) = self.around(value);
        out[0] = (low, 1.0);
        if fraction == 0.0 {
            return (out, 1);
        }
        let count = self.count();
        let points = count.min(4);
        // On a circle a node before the first is one of the last turn.
        let first = match self.circle {
            true => low + count - usize::from(points > 2),
            false => (low.saturating_sub(1)).min(count - points),
        };
        let position = |i: usize| match self.circle {
            true => self.nodes[i % count] + TAU * ((i / count) as f32 - 1.0),
            false => self.nodes[i],
        };
        let value = if self.circle { self.start() + (value - self.start()).rem_euclid(TAU) } else { value };
        for (j, slot) in out.iter_mut().take(points).enumerate() {
            let mut weight = 1.0;
            for k in (0..points).filter(|k| *k != j) {
                weight *= (value - position(first + k)) / (position(first + j) - position(first + k));
            }
            *slot = ((first + j) % count, weight);
        }
        (out, points)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_exact_for_cubics_between_uneven_nodes() {
        let f = |x: f32| 1.0 - 2.0 * x + 0.5 * x * x + 0.25 * x * x * x;
        let axis = Axis::new(vec![-2.0, -1.5, 0.0, 0.5, 2.0], false).unwrap();
        for x in [-2.0, -1.9, -1.0, 0.2, 1.0, 1.9, 2.0] {
            let (nodes, count) = axis.cubic(x);
            let found: f32 = nodes[..count].iter().map(|(i, w)| w * f(axis.nodes()[*i])).sum();
            assert!((found - f(x)).abs() < 1e-5, "{x}: {found}");
        }
        assert_eq!(axis.cubic(9.0).0[0], (4, 1.0));
        let line = Axis::uniform(0.0, 2.0, 2);
        assert_eq!(line.cubic(0.5), ([(0, 0.75), (1, 0.25), (0, 0.0), (0, 0.0)], 2));
    }

    #[test]
    fn a_cubic_closes_the_circle() {
        let axis = Axis::circle(-3.0, 24);
        for x in [-3.1_f32, -2.9, 0.3, 3.0, 3.2, 9.0] {
            let (nodes, count) = axis.cubic(x);
            let found: f32 = nodes[..count].iter().map(|(i, w)| w * axis.nodes()[*i].sin()).sum();
            assert!(count == 4 && (found - x.sin()).abs() < 2e-4, "{x}: {found}");
        }
    }

    #[test]
    fn values_lie_between_their_neighbours_and_hold_beyond_the_ends() {
        let axis = Axis::new(vec![-1.0, 0.0, 4.0], false).unwrap();
        assert_eq!(axis.around(-0.75), (0, 1, 0.25));
        assert_eq!(axis.around(3.0), (1, 2, 0.75));
        assert_eq!(axis.around(0.0), (1, 2, 0.0));
        assert_eq!((axis.around(-9.0), axis.around(9.0)), ((0, 0, 0.0), (2, 2, 0.0)));
        assert_eq!(axis.around(f32::NAN).2, 0.0);
    }

    #[test]
    fn a_position_stands_for_its_share_of_the_axis() {
        let line = Axis::new(vec![0.0, 1.0, 4.0], false).unwrap();
        assert_eq!([0, 1, 2].map(|i| line.share(i)), [0.5, 1.0, 1.5]);
        let circle = Axis::new(vec![0.0, 0.5 * std::f32::consts::PI, std::f32::consts::PI], true).unwrap();
        for (index, share) in [1.125, 0.75, 1.125].into_iter().enumerate() {
            assert!((circle.share(index) - share).abs() < 1e-5, "{index}");
        }
        assert_eq!(Axis::uniform(-1.0, 0.5, 5).share(0), 1.0);
        assert_eq!(Axis::single(2.0).share(0), 1.0);
    }

    #[test]
    fn a_circle_closes() {
        let axis = Axis::circle(-std::f32::consts::PI, 4);
        let (low, high, fraction) = axis.around(0.75 * std::f32::consts::PI);
        assert!((low, high) == (3, 0) && (fraction - 0.5).abs() < 1e-6);
        assert_eq!(axis.around(10.0 * std::f32::consts::PI).0, 2);
        assert!(Axis::new(vec![0.0, 6.5], true).is_none() && Axis::new(vec![1.0, 1.0], false).is_none());
    }
}
