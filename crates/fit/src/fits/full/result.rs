//! What a full fit has found, with its errors.

use super::descent::{Descent, State};
use super::fit::{Found, FullFit, SurfaceFit, UNDETERMINED, WallFound};
use super::schedule::{BEHIND_S, HIGHEST, LOWEST_HZ};
use crate::bands::{Estimate, FITTED_HZ};
use crate::early::{Chain, Compared, Iterate};
use crate::error::FitError;
use crate::late::{BIN_S, Histories, LateTie};
use crate::prediction::Residual;
use crate::room::FlatRoom;
use promenade_fourier::signal;
use rayon::prelude::*;

impl Descent<'_> {
    pub(super) fn result(&self, base: &FlatRoom, tie: &LateTie, state: &State) -> Result<FullFit, FitError> {
        let (model, u, x) = (&self.model, &self.model.u, &state.x);
        let geometry = &self.geometry(base, state)?;
        let range_hz = (LOWEST_HZ, HIGHEST * model.rate_hz);
        let stage = &model.stage(Compared::Magnitudes, range_hz);
        let diffuse = &tie.diffuse(model, x, &tie.early(self.options.window_s + BEHIND_S), true);
        let at = Iterate { x, geometry, stage, diffuse };
        let left = (0..u.places).into_par_iter().map(|i| model.response(&at, i).0).sum::<f64>() / u.places as f64;
        let slopes = tie.slopes(model, x, &self.chain_db(&state.chain));
        let waves = !self.agreeing(base, tie, state, range_hz.1)?.is_empty();
        let judged = waves.then(|| model.stage(Compared::Waves, range_hz));
        let errors = self.errors(tie, &slopes, &Iterate { stage: judged.as_ref().unwrap_or(stage), ..at }, left);
        let estimate = |i: usize| Estimate::of_logit(x[i], errors[i], errors[i] < UNDETERMINED * self.prior.sd[i]);
        let moved: Vec<f64> = x[u.wall(0)..u.wall(u.walls)].to_vec();
        let room = base.moved(&moved)?;
        let response = signal(state.chain.clone(), model.padded());
        let lead = self.chain.lead;
        let length = self.chain.response.len() + lead;
        let place = |i: usize| {
            let (source_m, microphone_m) = model.places(x, i).unwrap_or_default();
            let error = |from: usize| std::array::from_fn(|a| errors[u.place(i) + from + a]);
            let began_s = model.delay_s + 1e-3 * x[u.place(i) + 6];
            Found { source_m, source_error_m: error(0), microphone_m, microphone_error_m: error(3), began_s }
        };
        let fit = FullFit {
            walls: (0..u.walls)
                .map(|w| {
                    let scanned = state.scanned.get(w).copied().unwrap_or_default();
                    WallFound { moved_m: scanned.moved_m + moved[w], error_m: errors[u.wall(w)], scanned }
                })
                .collect(),
            histories: Histories::of_room(
                &room,
                model.set.air,
                place(0).source_m,
                BIN_S,
                tie.histories.bins as f64 * BIN_S,
                self.options.seed,
            )?,
            room,
            bands: model.bands.clone(),
            surfaces: base
                .surfaces
                .iter()
                .enumerate()
                .map(|(s, name)| SurfaceFit {
                    name: name.clone(),
                    absorption: std::array::from_fn(|b| estimate(u.absorption(s, b))),
                })
                .collect(),
            scattering: std::array::from_fn(|b| estimate(u.scattering(b))),
            node_levels: (0..u.nodes).map(|n| std::array::from_fn(|b| x[u.node(n, b)])).collect(),
            level: std::array::from_fn(|b| x[u.level(b)]),
            facing: model.facing,
            chain: Chain {
                response: (0..length).map(|i| response[(i + response.len() - lead) % response.len()]).collect(),
                ..self.chain.clone()
            },
            places: (0..u.places).map(place).collect(),
            missing_hz: FITTED_HZ.into_iter().filter(|hz| !tie.known_hz().contains(hz) && *hz <= 0.5 * model.rate_hz).collect(),
            left,
            waves,
            residual: Residual::default(),
            order: self.options.order,
            window_s: self.options.window_s,
            voxels: None,
            stated: model.set.all.iter().map(|m| [m.source.at_m, m.microphone.at_m]).collect(),
        };
        Ok(fit.with_residual(model.set))
    }
}
