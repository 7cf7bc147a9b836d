//! What a source sends by direction: a mean of spherical Gaussians about nodes, of sharpness 8 (Jin et al. 2025).

use promenade_acoustics::fibonacci;

/// Directions in which a source is known.
pub(crate) const NODES: usize = 128;
/// Sharpness of the Gaussians about them.
const SHARPNESS: f64 = 8.0;
/// Nodes with less than this share are left out.
const LEAST_SHARE: f64 = 0.01;
/// What a source sends by direction: shares of nodes.
pub(crate) type Shares = Vec<(u16, f64)>;

/// Directions of a source as it stands.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Nodes(Vec<[f64; 3]>);

impl Nodes {
    pub(crate) fn new(count: usize) -> Self {
        Self((0..count).map(|i| fibonacci(i, count)).collect())
    }

    /// Cosines between the nodes and the axis, which is x.
    pub(crate) fn cosines(&self) -> Vec<f64> {
        self.0.iter().map(|n| n[0]).collect()
    }

    /// Shares of the nodes in a direction of the room, for a source that faces somewhere, or stands as the room does.
    pub(crate) fn shares(&self, departure: [f64; 3], facing: Option<[f64; 3]>) -> Shares {
        let own = facing.map_or(departure, |f| turned(departure, f));
        let mut shares: Shares = self
            .0
            .iter()
            .zip(0..)
            .filter_map(|(n, i)| {
                let share = (SHARPNESS * (n.iter().zip(own).map(|(a, b)| a * b).sum::<f64>() - 1.0)).exp();
                (share > LEAST_SHARE).then_some((i, share))
            })
            .collect();
        let sum: f64 = shares.iter().map(|(_, s)| s).sum();
        shares.iter_mut().for_each(|(_, s)| *s /= sum);
        shares
    }
}

/// A direction as a source sees it that faces along x, with z up as far as it can.
fn turned(direction: [f64; 3], facing: [f64; 3]) -> [f64; 3] {
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let flat = facing[0].hypot(facing[1]);
    let left = if flat > 1e-6 { [-facing[1] / flat, facing[0] / flat, 0.0] } else { [0.0, 1.0, 0.0] };
    let up = [
        facing[1] * left[2] - facing[2] * left[1],
        facing[2] * left[0] - facing[0] * left[2],
        facing[0] * left[1] - facing[1] * left[0],
    ];
    [dot(direction, facing), dot(direction, left), dot(direction, up)]
}
