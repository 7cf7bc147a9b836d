//! Standard errors of what a full fit has found: what the early part, rays and what was known before say together, about where
//! the numbers are.

use super::descent::Descent;
use crate::early::{Compared, Iterate};
use crate::late::{LateTie, Slopes};
use nalgebra::DMatrix;

/// By how much errors are larger than noise makes them, since rooms are no models of rooms: 12 to 19 % of the absorptions of
/// made rooms were more than two of noise's errors off, where a normal distribution of this width has 5 %.
const MODEL_ERROR: f64 = 1.4;

impl Descent<'_> {
    /// Standard errors of all numbers: of surfaces, scattering, level, walls, places and clocks; 0 of those that do not move,
    /// and of the directivity, which is left out.
    pub(super) fn errors(&self, tie: &LateTie, slopes: &Slopes, at: &Iterate<'_>, left: f64) -> Vec<f64> {
        let u = &self.model.u;
        let gains: Vec<usize> = (0..u.node(0, 0)).collect();
        let moving: Vec<usize> = (u.wall(0)..u.count()).filter(|n| self.moves(*n) && self.stands_for(*n) == *n).collect();
        let numbers: Vec<usize> = gains.iter().chain(&moving).copied().collect();
        let mut precision = DMatrix::<f64>::zeros(numbers.len(), numbers.len());
        for i in 0..u.places {
            let mut columns = self.model.tangents(at, i, &gains);
            let own: Vec<usize> = (0..u.walls).map(|w| u.wall(w)).chain((0..7).map(|a| u.place(i) + a)).collect();
            let own: Vec<usize> = own.into_iter().filter(|n| self.moves(*n)).collect();
            columns.extend(self.model.moving_tangents(at, i, &own));
            let places: Vec<usize> = gains
                .iter()
                .copied()
                .chain(own.iter().map(|n| numbers.binary_search(&self.stands_for(*n)).unwrap_or(0)))
                .collect();
            let rows = columns.first().map_or(1, Vec::len).max(1);
            let matrix = DMatrix::from_fn(rows, columns.len(), |r, c| columns[c][r]);
            // Windows overlap: they say no more than half of their samples.
            let share = self.model.length as f64 / rows as f64;
            let weight = match at.stage.what {
                Compared::Magnitudes => 0.5 * share / left.max(0.02).powi(2),
                Compared::Waves => share,
            } / MODEL_ERROR.powi(2);
            let own = matrix.tr_mul(&matrix) * weight;
            for (a, pa) in places.iter().enumerate() {
                places.iter().enumerate().for_each(|(b, pb)| precision[(*pa, *pb)] += own[(a, b)]);
            }
        }
        self.prior.add_precision(&numbers, &mut precision);
        // A clock has no prior of its own: a little holds one that says nothing.
        numbers.iter().enumerate().for_each(|(k, _)| precision[(k, k)] += 1e-9);
        let mut late = DMatrix::<f64>::zeros(numbers.len(), numbers.len());
        tie.add_precision(slopes, at.x, &mut late);
        precision += late / MODEL_ERROR.powi(2);
        let variances = precision.cholesky().map(|c| c.inverse().diagonal());
        let mut errors = vec![0.0; u.count()];
        for (k, n) in numbers.iter().enumerate() {
            errors[*n] = variances.as_ref().map_or(f64::INFINITY, |v| v[k].max(0.0).sqrt());
        }
        for n in (u.wall(0)..u.count()).filter(|n| self.moves(*n)) {
            errors[n] = errors[self.stands_for(n)];
        }
        errors
    }

    /// Whether a number of a wall, a place or a clock moves in this fit.
    fn moves(&self, number: usize) -> bool {
        let u = &self.model.u;
        if number < u.place(0) {
            return self.options.geometry;
        }
        let (i, a) = ((number - u.place(0)) / 7, (number - u.place(0)) % 7);
        let one = &self.model.set.all[i];
        match a {
            0..3 => self.options.places && one.source.sd_m > 0.0,
            3..6 => self.options.places && one.microphone.sd_m > 0.0,
            _ => self.clock_is_free(i),
        }
    }

    /// The number of the first measurement that has the same place.
    fn stands_for(&self, number: usize) -> usize {
        let (u, all) = (&self.model.u, &self.model.set.all);
        if number < u.place(0) {
            return number;
        }
        let (i, a) = ((number - u.place(0)) / 7, (number - u.place(0)) % 7);
        let same = |j: &usize| match a {
            0..3 => all[*j].source.at_m == all[i].source.at_m,
            3..6 => all[*j].microphone.at_m == all[i].microphone.at_m,
            _ => *j == i,
        };
        u.place((0..=i).find(same).unwrap_or(i)) + a
    }
}
