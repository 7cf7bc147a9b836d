//! What a full fit may move, and in which order.

use crate::early::Compared;
use crate::measurements::{Clock, Measurements};

/// How a fit goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FullOptions {
    /// Reflections of images.
    pub order: u32,
    /// Seconds from the direct sound on that are compared.
    pub window_s: f64,
    /// Whether walls are scanned and moved.
    pub geometry: bool,
    /// Whether places move within their uncertainty.
    pub places: bool,
    /// Whether what the source sends by direction is sought, where the data can tell.
    pub source: bool,
    /// Seed of rays and of the choice of responses.
    pub seed: u64,
}

impl Default for FullOptions {
    fn default() -> Self {
        Self { order: 8, window_s: 0.05, geometry: true, places: true, source: true, seed: 0 }
    }
}

/// Lowest frequency that is compared, hertz.
pub(super) const LOWEST_HZ: f64 = 90.0;
/// Highest, as a share of the sample rate.
pub(super) const HIGHEST: f64 = 0.46;
/// Frequencies up to which places are moved, one after the other, hertz.
pub(super) const COARSE_HZ: [f64; 3] = [500.0, 1000.0, 2500.0];

/// Seconds beyond the window in which sound may have been on its way.
pub(super) const BEHIND_S: f64 = 0.2;

/// Which numbers move.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Free {
    pub(super) surfaces: bool,
    pub(super) source: bool,
    pub(super) places: bool,
    pub(super) walls: bool,
}

/// Some rounds of descent in one range of frequencies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Leg {
    /// Highest frequency, hertz.
    pub(super) top_hz: f64,
    pub(super) rounds: usize,
    pub(super) free: Free,
    /// How many of its first rounds begin with a new chain.
    pub(super) chains: usize,
    /// Whether places that are off are tried anew before it.
    pub(super) rescues: bool,
    /// Share of the rates that are left at the end.
    pub(super) slows_to: f64,
    pub(super) what: Compared,
    /// Factor of all rates.
    pub(super) slower: f64,
}

impl FullOptions {
    /// The legs of a whole fit, with so many nodes of the source.
    pub(super) fn legs(&self, set: &Measurements, nodes: usize) -> Vec<Leg> {
        let top_hz = HIGHEST * f64::from(set.sample_rate_hz);
        let uncertain = set.all.iter().any(|m| m.source.sd_m.max(m.microphone.sd_m) > 0.0 || m.clock == Clock::Free);
        let places = self.places && uncertain;
        let walls = self.geometry;
        let leg = |top_hz: f64, rounds: usize, free: Free| Leg {
            top_hz,
            rounds,
            free,
            chains: 0,
            rescues: false,
            slows_to: 0.3,
            what: Compared::Magnitudes,
            slower: 1.0,
        };
        let surfaces = Free { surfaces: true, ..Free::default() };
        let moving = Free { places, walls, ..surfaces };
        let mut legs = Vec::new();
        if places || walls {
            legs.push(leg(COARSE_HZ[1], 2, surfaces));
            legs.extend(COARSE_HZ.map(|hz| leg(hz, 2, moving)));
            legs.push(Leg { chains: 2, ..leg(top_hz, 3, moving) });
        }
        let source = nodes > 0;
        let all = Free { source, ..moving };
        legs.push(Leg { chains: 3, rescues: places, slows_to: 0.03, ..leg(top_hz, 6, all) });
        legs.push(Leg { what: Compared::Waves, slower: 0.3, slows_to: 0.03, ..leg(top_hz, 4, all) });
        legs
    }
}
