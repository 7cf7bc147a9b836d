//! Which measured responses carry the time filters at each node of a field.

use crate::transfer::{MOST_SHARES, Shares};

/// Shares of measured responses at the nodes of a field.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeShares {
    per_node: usize,
    responses: Vec<u32>,
    weights: Vec<f32>,
}

impl NodeShares {
    /// Takes numbers of responses and their shares, both `[node][per_node]`; the shares of a node sum to 1, and those of 0
    /// stand for none. `None` if the lengths differ or `per_node` is not between 1 and [`MOST_SHARES`].
    #[must_use]
    pub fn new(per_node: usize, responses: Vec<u32>, weights: Vec<f32>) -> Option<Self> {
        let fits =
            (1..=MOST_SHARES).contains(&per_node) && responses.len() == weights.len() && weights.len().is_multiple_of(per_node);
        fits.then_some(Self { per_node, responses, weights })
    }

    /// Responses of a node.
    #[must_use]
    pub fn per_node(&self) -> usize {
        self.per_node
    }

    /// Numbers of responses, `[node][per_node]`.
    #[must_use]
    pub fn responses(&self) -> &[u32] {
        &self.responses
    }

    /// Shares, `[node][per_node]`, in [0, 1].
    #[must_use]
    pub fn weights(&self) -> &[f32] {
        &self.weights
    }

    /// Number of nodes.
    pub(super) fn nodes(&self) -> usize {
        self.weights.len() / self.per_node
    }

    /// Shares in a cell with these corners, each a node and its weight, where the direct sound has a gain.
    pub(super) fn at(&self, corners: &[(u32, f32)], direct_gain: f32) -> Shares {
        let mut out = Shares::none(direct_gain);
        for &(node, weight) in corners {
            let start = node as usize * self.per_node;
            let range = start..start + self.per_node;
            for (response, share) in self.responses[range.clone()].iter().zip(&self.weights[range]) {
                if weight * share > 0.0 {
                    out.add(*response, weight * share);
                }
            }
        }
        out.normalise();
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_a_cell_sum_to_one_and_name_each_response_once() {
        let shares = NodeShares::new(2, vec![0, 1, 1, 2], vec![0.5, 0.5, 1.0, 0.0]).unwrap();
        let found = shares.at(&[(0, 0.25), (1, 0.75)], 1.0);
        assert_eq!(found.entries(), [(0, 0.125), (1, 0.875)]);
        assert_eq!(shares.nodes(), 2);
        assert!(NodeShares::new(2, vec![0; 3], vec![0.0; 3]).is_none());
    }

    #[test]
    fn the_largest_shares_are_kept_where_there_are_too_many() {
        let many = u32::try_from(2 * MOST_SHARES).unwrap();
        let shares = NodeShares::new(1, (0..many).collect(), vec![1.0; 2 * MOST_SHARES]).unwrap();
        let corners: Vec<(u32, f32)> = (0..many).map(|i| (i, i as f32)).collect();
        let found = shares.at(&corners, 1.0);
        assert_eq!(found.entries().len(), MOST_SHARES);
        assert!(found.entries().iter().all(|(r, _)| *r >= many / 2));
        assert!((found.entries().iter().map(|e| e.1).sum::<f32>() - 1.0).abs() < 1e-6);
    }
}
