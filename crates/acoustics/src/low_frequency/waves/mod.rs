//! The bass of a room from the wave equation, by finite differences.

mod cells;
mod differences;
mod probe;
mod record;
mod stencil;
mod wall;

use crate::error::{AcousticsError, place};
use crate::low_frequency::low_field::{LowField, LowResponse, RATE};
use crate::room::Room;
use cells::Cells;
use probe::Probe;
use rayon::prelude::*;
use record::{Pulse, Recorder};
use stencil::Stencil;
use wall::Wall;

/// Cells in the shortest wave that responses have whole.
const CELLS_A_WAVE: f64 = 6.0;

/// How the waves of a room are computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WaveOptions {
    /// Up to this frequency responses are whole, Hz.
    pub top_hz: f64,
    /// Length of the responses, seconds.
    pub length_s: f64,
    /// Metres per second.
    pub speed_m_s: f64,
    /// Cells in the shortest wave; 0 takes as many as responses need.
    pub cells_a_wave: f64,
}

impl WaveOptions {
    fn step_m(&self) -> f64 {
        let cells = if self.cells_a_wave > 0.0 { self.cells_a_wave } else { CELLS_A_WAVE };
        self.speed_m_s / (self.top_hz * cells)
    }

    /// How many values are computed for a room, about: cells times time steps.
    #[must_use]
    pub fn cost(&self, room: &Room) -> f64 {
        let step = glam::DVec3::splat(self.step_m());
        Cells::estimate(room, self.step_m()) * self.length_s / Stencil::time_step_s(step, self.speed_m_s)
    }
}

/// What places in a room hear of a source at low frequencies: pressure and its gradient, with all that walls reflect and all
/// that goes round corners. One computation for all places.
///
/// # Errors
/// A frequency, a length, a source or a place that is not finite; a source so near to surfaces that no cell lies between.
/// Places that no sound reaches hear nothing.
pub fn waves(
    room: &Room,
    source: [f64; 3],
    places: &[[f64; 3]],
    options: &WaveOptions,
    done: impl Fn(f64),
) -> Result<LowField, AcousticsError> {
    for (what, value) in [("frequency", options.top_hz), ("length", options.length_s), ("speed of sound", options.speed_m_s)] {
        if !(value.is_finite() && value > 0.0) {
            return Err(AcousticsError::argument(what, "finite and above 0", value));
        }
    }
    let at = place("source", source)?;
    let too_near = || AcousticsError::argument("source", "in the air of the room, off its surfaces", at);
    let cells = Cells::new(room, at, options.step_m()).ok_or_else(too_near)?;
    let walls: Vec<Wall> = room.materials().iter().map(Wall::of).collect();
    let mut stencil = Stencil::new(room, &cells, &walls, options.speed_m_s);
    let probe = |at: glam::DVec3| {
        let nearest = cells.nearest(room, at).filter(|index| cells.inside[*index])?;
        Some(Probe::new(&cells, nearest, at))
    };
    let source = probe(at).ok_or_else(too_near)?.pressure;
    let source: Vec<(usize, f64)> = source.iter().map(|(cell, share)| (*cell as usize, f64::from(*share))).collect();
    let probes = places.iter().map(|at| Ok(probe(place("place", *at)?).unwrap_or_default()));
    let probes: Vec<Probe> = probes.collect::<Result<_, AcousticsError>>()?;
    let pulse = Pulse::new(options.top_hz, stencil.dt_s);
    let recorder = Recorder::new(pulse, options.top_hz);
    let steps = pulse.steps() + (options.length_s / stencil.dt_s).ceil() as usize;
    let mut recorded: Vec<[Vec<f32>; 4]> = vec![Default::default(); places.len()];
    for step in 0..steps {
        if step % recorder.every == 0 {
            for (probe, recorded) in probes.iter().zip(&mut recorded) {
                let [x, y, z] = &probe.gradient;
                for (cells, out) in [&probe.pressure, x, y, z].into_iter().zip(recorded) {
                    out.push(stencil.pressure(cells));
                }
            }
            done(0.9 * step as f64 / steps as f64);
        }
        stencil.step(if step < pulse.steps() { pulse.at(step) } else { 0.0 }, &source);
    }
    let rate_hz = RATE * options.top_hz;
    let length = (options.length_s * rate_hz).ceil() as usize;
    let places = recorded.par_iter().map(|[pressure, x, y, z]| LowResponse {
        pressure: recorder.response(pressure, length, rate_hz),
        gradient: [x, y, z].map(|of| recorder.response(of, length, rate_hz)),
    });
    Ok(LowField { rate_hz, top_hz: options.top_hz, places: places.collect() })
}
