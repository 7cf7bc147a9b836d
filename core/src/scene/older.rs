//! Scenes of measured responses as they were written before measurements had sites: shares of responses and gains of taps at
//! each node of the field.

use super::{MeasuredRoom, Site};
use crate::decode::field::{Field, Rows};
use crate::number::whole;
use crate::render::late::late_lead;
use crate::{Bands, StftGrid, TransferShape};
use glam::Vec3;

/// A share that is all of a node.
const ALL: f32 = 0.999;
/// Directions closer than this are one, as a chord.
const SAME_DIRECTION: f32 = 0.01;

/// What such a scene holds of its measurements.
pub(super) struct OlderRoom {
    /// Whole responses, `[response][ear][hop * sample]`.
    pub(super) samples: Vec<f32>,
    pub(super) hops: usize,
    /// Numbers of the responses at each node and their shares, `[node][per_node]`.
    pub(super) responses: Vec<f32>,
    pub(super) shares: Vec<f32>,
}

impl OlderRoom {
    /// The measurements at the nodes where each was heard most, and the field without taps. `None` where a response is heard
    /// nowhere, or the sizes do not fit.
    pub(super) fn converted(&self, field: &Field, bands: &Bands, grid: &StftGrid) -> Option<(MeasuredRoom, Field)> {
        let shape = field.shape();
        let Rows::Whole(rows) = field.rows() else { return None };
        let one = 2 * self.hops * grid.hop;
        let count = self.samples.len() / one.max(1);
        let found = self.nodes(count, field)?;
        let mut sites = Vec::new();
        for (response, nodes) in found.iter().enumerate() {
            for node in nodes {
                let (position, direction) = field.grid().node(*node);
                sites.push(Site { direction, position, response: u32::try_from(response).ok()? });
            }
        }
        let row = |response: usize| &rows[found[response][0] * shape.row_len()..][..shape.row_len()];
        let late: Vec<f32> = (0..count).flat_map(|r| &row(r)[shape.row_len() - shape.tap_len()..]).copied().collect();
        let ears = self.samples.chunks_exact(self.hops * grid.hop);
        let low_step = MeasuredRoom::step_of(grid);
        let room = MeasuredRoom {
            sites,
            samples: ears.clone().flat_map(|ear| &ear[..(shape.taps + 1) * grid.hop]).copied().collect(),
            low: ears.flat_map(|ear| MeasuredRoom::bass_of(ear, low_step, grid, self.hops)).collect(),
            low_step,
            low_hops: self.hops,
            late,
            late_before: self.late_before(count, row, &shape, bands, grid),
            gains: vec![1.0; shape.tap_len()],
            lifted: None,
        };
        let direct = TransferShape { taps: 0, ..shape };
        // A row of a field without taps has a late part all the same.
        let direct_rows = rows
            .chunks_exact(shape.row_len())
            .flat_map(|row| row[..shape.direct_len()].iter().chain(&row[shape.row_len() - shape.tap_len()..]).copied());
        let field = Field::new(field.grid().clone(), direct, Rows::Whole(direct_rows.collect()))?;
        Some((room, field))
    }

    /// The node at which each response is heard most, the one at the height of the head first, and its mirror image, front to
    /// back, where that is heard alone too.
    fn nodes(&self, count: usize, field: &Field) -> Option<Vec<Vec<usize>>> {
        let per_node = self.shares.len() / field.grid().nodes().max(1);
        let entries = || {
            let entries = self.responses.iter().zip(&self.shares).enumerate().filter(|(_, (_, share))| **share > 0.0);
            entries.map(|(i, (response, share))| (i / per_node, whole(f64::from(*response)), *share))
        };
        let mut best: Vec<Option<(usize, f32)>> = vec![None; count];
        for (node, response, share) in entries() {
            let rank = share.min(ALL) - 1e-3 * field.grid().node(node).1.z.abs();
            let best = best.get_mut(response)?;
            if best.is_none_or(|(_, old)| rank > old) {
                *best = Some((node, rank));
            }
        }
        let mut found = best.into_iter().map(|best| best.map(|(node, _)| vec![node])).collect::<Option<Vec<_>>>()?;
        for (node, response, share) in entries() {
            let (at, seen) = field.grid().node(found[response][0]);
            let (position, direction) = field.grid().node(node);
            let mirrored = direction.distance(seen * Vec3::new(-1.0, 1.0, 1.0)) < SAME_DIRECTION;
            let fits = share >= ALL && position == at && mirrored && found[response].len() == 1;
            if fits && node != found[response][0] {
                found[response].push(node);
            }
        }
        Some(found)
    }

    /// Energy that the late part had before it is at its level, by what it was taken off the gains of the last taps: mean over
    /// the responses.
    fn late_before<'a>(
        &self,
        count: usize,
        row: impl Fn(usize) -> &'a [f32],
        shape: &TransferShape,
        bands: &Bands,
        grid: &StftGrid,
    ) -> Vec<f32> {
        let (len, taps) = (shape.tap_len(), shape.taps);
        let lead = late_lead(taps);
        let mut sums = vec![0.0_f32; lead * len];
        for response in 0..count {
            let gains = &row(response)[shape.direct_len()..];
            let late = &gains[taps * len..];
            for (i, sums) in sums.chunks_exact_mut(len).enumerate() {
                let tap = taps - lead + i;
                for (ear, sums) in sums.chunks_exact_mut(bands.count()).enumerate() {
                    let start = ((2 * response + ear) * self.hops + tap + 1) * grid.hop;
                    let piece = self.samples[start..start + grid.hop].iter().map(|x| f64::from(*x));
                    let spectrum = promenade_fourier::spectrum(piece, grid.n_fft);
                    let (mut energy, mut weights) = (vec![0.0; bands.count()], vec![1e-9; bands.count()]);
                    for (k, x) in spectrum.iter().enumerate() {
                        for (band, weight) in bands.weights(crate::number::single(grid.bin_hz(k))) {
                            energy[band] += f64::from(weight) * x.norm_sqr();
                            weights[band] += f64::from(weight);
                        }
                    }
                    for (band, sum) in sums.iter_mut().enumerate() {
                        let at = ear * bands.count() + band;
                        let taken = (1.0 - gains[tap * len + at].powi(2)).max(0.0);
                        let density = crate::number::single(energy[band] / weights[band]);
                        *sum += taken * density / (late[at] * late[at]).max(1e-20) / count as f32;
                    }
                }
            }
        }
        sums
    }
}
