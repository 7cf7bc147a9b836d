//! Places that have come to rest where they do not belong.
//!
//! A place that is off by half a wave's length stays there. One whose response is left farther off than the others' is tried
//! from other places within its uncertainty, from coarse to fine, with everything else as it is.

use super::descent::{Descent, RATES};
use super::schedule::{COARSE_HZ, HIGHEST, LOWEST_HZ};
use crate::early::{Compared, Diffuse, Geometry, Iterate, Stage, Unknowns};
use crate::numerics::{Adam, Random};
use promenade_metrics::statistics::median_high;
use rayon::prelude::*;

/// A response that is left this much farther off than the median is tried.
const FARTHER: f64 = 1.15;
/// Other places to begin at, and steps at each range of frequencies.
const STARTS: u64 = 8;
const STEPS: usize = 25;
/// How much better one has to be.
const BETTER: f64 = 0.98;

impl Descent<'_> {
    /// Moves places that are off. Returns how many.
    pub(super) fn rescue(&self, x: &mut [f64], geometry: &Geometry, diffuse: &Diffuse, seed: u64) -> usize {
        let model = &self.model;
        let stages: Vec<Stage> = COARSE_HZ
            .into_iter()
            .chain([HIGHEST * model.rate_hz])
            .map(|hz| model.stage(Compared::Magnitudes, (LOWEST_HZ, hz)))
            .collect();
        let Some(finest) = stages.last() else { return 0 };
        let before = Iterate { x, geometry, stage: finest, diffuse };
        let left: Vec<f64> = (0..model.u.places).into_par_iter().map(|i| model.response(&before, i).0).collect();
        let Some(median) = median_high(left.iter().copied()) else { return 0 };
        let off: Vec<usize> = (0..left.len()).filter(|i| left[*i] > FARTHER * median).collect();
        let tried: Vec<(usize, f64, [f64; Unknowns::PLACE])> = off
            .par_iter()
            .flat_map_iter(|i| (0..STARTS).map(move |start| (*i, start)))
            .map(|(i, start)| {
                let mut own = x.to_vec();
                let sd = self.own_sd(i);
                let at = model.u.place(i);
                let mut random = Random::new(seed, i as u64 * STARTS + start);
                (0..6).for_each(|a| own[at + a] = sd[a] * random.normal());
                for stage in &stages {
                    let mut adam = Adam::new(own.len());
                    let mut rates = vec![0.0; own.len()];
                    (0..6).filter(|a| sd[*a] > 0.0).for_each(|a| rates[at + a] = RATES[2]);
                    rates[at + 6] = if self.clock_is_free(i) { RATES[3] } else { 0.0 };
                    for step in 0..STEPS {
                        let (_, by) = model.response(&Iterate { x: &own, geometry, stage, diffuse }, i);
                        let slow = 0.2_f64.powf(step as f64 / STEPS as f64);
                        let now: Vec<f64> = rates.iter().map(|r| r * slow).collect();
                        adam.step(&mut own, &by, &now);
                    }
                }
                let found = std::array::from_fn(|a| own[at + a]);
                (i, model.response(&Iterate { x: &own, ..before }, i).0, found)
            })
            .collect();
        let mut moved = 0;
        for i in off {
            let best = tried.iter().filter(|t| t.0 == i).min_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((_, value, found)) = best.filter(|t| t.1 < BETTER * left[i]) {
                debug_assert!(*value < left[i]);
                let at = model.u.place(i);
                x[at..at + Unknowns::PLACE].copy_from_slice(found);
                moved += 1;
            }
        }
        moved
    }

    /// Uncertainty of a measurement's coordinates that no other measurement shares; 0 of those that are known or shared.
    fn own_sd(&self, i: usize) -> [f64; 6] {
        let all = &self.model.set.all;
        let one = &all[i];
        let alone = |of: &dyn Fn(usize) -> [f64; 3]| (0..all.len()).all(|j| j == i || of(j) != of(i));
        let source = if alone(&|j| all[j].source.at_m) { one.source.sd_m } else { 0.0 };
        let microphone = if alone(&|j| all[j].microphone.at_m) { one.microphone.sd_m } else { 0.0 };
        [source, source, source, microphone, microphone, microphone]
    }
}
