//! What a full fit has found, with its errors.

use super::descent::{BEHIND_S, Full, HIGHEST, LOWEST_HZ};
use super::{Found, FullFit, SurfaceFit, UNDETERMINED, WallFound};
use crate::chain::Chain;
use crate::early_model::logistic;
use crate::energy_model::BIN_S;
use crate::error::FitError;
use crate::estimate::Estimate;
use crate::flat_room::FlatRoom;
use crate::foretell::Foretold;
use crate::histories::Histories;
use crate::late_tie::LateTie;
use crate::loss::Compared;
use crate::measurements::Measurements;
use crate::residual::Residual;
use crate::saved::Saved;
use crate::wall_scan::Scanned;
use promenade_fourier::signal;
use rayon::prelude::*;

impl FullFit {
    /// What surfaces do not explain, anew.
    pub(crate) fn with_residual(mut self, set: &Measurements) -> Self {
        self.residual = Residual::default();
        self.residual = Foretold::of_full(&self, set).unexplained(set);
        self
    }
}

impl Full<'_> {
    pub(super) fn result(&self, base: &FlatRoom, tie: &LateTie, state: &Saved) -> Result<FullFit, FitError> {
        let (model, u, x) = (&self.model, &self.model.u, &state.x);
        let around = self.around(base, state)?;
        let range_hz = (LOWEST_HZ, HIGHEST * model.rate_hz);
        let stage = model.stage(Compared::Magnitudes, range_hz);
        let diffuse = tie.diffuse(model, x, &tie.early(self.options.window_s + BEHIND_S), true);
        let left: f64 = (0..u.places).into_par_iter().map(|i| model.response(x, &around, &stage, &diffuse, i).0).sum::<f64>()
            / u.places as f64;
        let slopes = tie.slopes(model, x, &self.chain_db(&state.chain));
        let waves = !self.agreeing(base, tie, state, range_hz.1)?.is_empty();
        let judged = if waves { model.stage(Compared::Waves, range_hz) } else { stage };
        let errors = self.errors(tie, &slopes, x, (&around, &judged, &diffuse), left);
        let estimate = |i: usize| {
            let value = logistic(x[i]);
            let determined = errors[i] < UNDETERMINED * self.prior.sd[i];
            Estimate { value, error: errors[i] * value * (1.0 - value), determined }
        };
        let moved: Vec<f64> = x[u.wall(0)..u.wall(u.walls)].to_vec();
        let room = base.moved(&moved)?;
        let stays = Scanned { moved_m: 0.0, stands_out: 0.0, found: false };
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
                    let scanned = state.scanned.get(w).copied().unwrap_or(stays);
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
            sent: (0..u.nodes).map(|n| std::array::from_fn(|b| x[u.node(n, b)])).collect(),
            level: std::array::from_fn(|b| x[u.level(b)]),
            facing: model.facing,
            chain: Chain {
                response: (0..length).map(|i| response[(i + response.len() - lead) % response.len()]).collect(),
                ..self.chain.clone()
            },
            places: (0..u.places).map(place).collect(),
            missing_hz: crate::octaves::FITTED_HZ
                .into_iter()
                .filter(|hz| !tie.known_hz().contains(hz) && *hz <= 0.5 * model.rate_hz)
                .collect(),
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
