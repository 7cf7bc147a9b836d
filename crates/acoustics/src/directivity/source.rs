//! Sources, and how much they send in each direction.

use crate::directivity::lattice::direction;
use crate::error::AcousticsError;
use crate::octave::{BANDS, Octaves};
use glam::{DQuat, DVec3};

/// Nodes of a directivity, and how soon a node's share falls off beside it: with the angle's cosine `c` it is `exp(8 (c - 1))`
/// of all shares, a spherical Gaussian (as Wang et al. 2024, "Hearing Anything Anywhere", have it).
const NODES: usize = 128;
const SHARPNESS: f64 = 8.0;
/// Directions in which less is sent have this amplitude: 30 dB below the axis.
const LEAST: f64 = 0.0316;
/// Steps in which the nodes are brought to what is given.
const STEPS: usize = 60;
/// Directions that are given, at most.
const MOST: usize = 100_000;

/// A source: where it is, and what it sends where.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// Metres.
    pub position: [f64; 3],
    /// What it sends where.
    pub directivity: Directivity,
}

impl From<[f64; 3]> for Source {
    /// A source that sends the same in all directions.
    fn from(position: [f64; 3]) -> Self {
        Self { position, directivity: Directivity::default() }
    }
}

impl From<&Source> for Source {
    fn from(source: &Source) -> Self {
        source.clone()
    }
}

/// How much a source sends in each direction, by octave, beside its axis. By default the same in all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Directivity {
    /// Directions in the room and logarithms of amplitudes; none for the same in all directions.
    nodes: Vec<(DVec3, [f64; BANDS])>,
}

impl Directivity {
    /// Patterns of the first order by the names that microphones have for them, and their omnidirectional parts.
    pub const PATTERNS: [(&str, f64); 5] =
        [("omni", 1.0), ("subcardioid", 0.75), ("cardioid", 0.5), ("supercardioid", 0.37), ("figure-of-eight", 0.0)];

    /// One of the [`Directivity::PATTERNS`]; `None` for any other name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::PATTERNS.iter().find(|(of, _)| *of == name).map(|(_, omni)| Self::first_order(*omni))
    }

    /// Of amplitudes by octave in some directions, in the source's own axes: x ahead, y to its left, z up. It faces along x.
    /// Levels between the directions are interpolated, and those below -30 dB beside the axis are raised to that.
    ///
    /// # Errors
    /// No direction or more than 100,000, one that is zero or not finite, an amplitude that is negative or not finite, silence
    /// ahead.
    pub fn measured(directions: &[([f64; 3], Octaves)]) -> Result<Self, AcousticsError> {
        if !(1..=MOST).contains(&directions.len()) {
            return Err(AcousticsError::argument("directivity", format!("1 to {MOST} directions"), directions.len()));
        }
        let mut given = Vec::with_capacity(directions.len());
        for (at, amplitudes) in directions {
            let Some(towards) = DVec3::from_array(*at).try_normalize() else {
                return Err(AcousticsError::argument("directivity", "directions of a finite length", format!("{at:?}")));
            };
            if !amplitudes.iter().all(|a| a.is_finite() && *a >= 0.0) {
                return Err(AcousticsError::argument("directivity", "amplitudes of 0 or more", format!("{amplitudes:?}")));
            }
            given.push((towards, amplitudes.map(f64::from)));
        }
        // Beside the direction that is nearest to the axis.
        let ahead = given.iter().max_by(|a, b| a.0.x.total_cmp(&b.0.x)).map_or([0.0; BANDS], |(_, amplitudes)| *amplitudes);
        if ahead.iter().any(|a| *a <= 0.0) {
            return Err(AcousticsError::argument(
                "directivity",
                "sound ahead of the source in every octave",
                format!("{ahead:?}"),
            ));
        }
        let logs = |amplitudes: [f64; BANDS]| std::array::from_fn(|b| (amplitudes[b] / ahead[b]).max(LEAST).ln());
        Ok(Self::through(&given.into_iter().map(|(towards, a)| (towards, logs(a))).collect::<Vec<_>>()))
    }

    /// A first-order pattern: `omni + (1 - omni) cos` of the angle to its axis, x, the same in all octaves. 1 sends the same
    /// everywhere, 0.5 is a cardioid, 0 a figure of eight.
    #[must_use]
    pub fn first_order(omni: f64) -> Self {
        let omni = omni.clamp(0.0, 1.0);
        if omni >= 1.0 {
            return Self::default();
        }
        let lattice = (0..8 * NODES).map(|i| direction(i, 8 * NODES));
        let log = |towards: DVec3| (omni + (1.0 - omni) * towards.x).abs().max(LEAST).ln();
        Self::through(&lattice.map(|towards| (towards, [log(towards); BANDS])).collect::<Vec<_>>())
    }

    /// Whether it is the same in all directions.
    #[must_use]
    pub fn is_omni(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The directivity of the source turned: first its front up by `pitch`, then to its left by `yaw`, radians.
    #[must_use]
    pub fn turned(&self, yaw: f64, pitch: f64) -> Self {
        let turn = DQuat::from_rotation_z(yaw) * DQuat::from_rotation_y(-pitch);
        Self { nodes: self.nodes.iter().map(|(at, logs)| (turn * *at, *logs)).collect() }
    }

    /// Amplitudes that are sent in a direction of the room, over those on the axis.
    #[must_use]
    pub fn towards(&self, towards: [f64; 3]) -> Octaves {
        if self.is_omni() {
            return [1.0; BANDS];
        }
        let towards = DVec3::from_array(towards).normalize_or_zero();
        mean(&self.nodes, towards).map(|log| log.exp() as f32)
    }

    /// Nodes whose means are the given logarithms: each step spreads what is still missing over the nodes.
    fn through(given: &[(DVec3, [f64; BANDS])]) -> Self {
        let mut nodes: Vec<(DVec3, [f64; BANDS])> = (0..NODES).map(|i| (direction(i, NODES), [0.0; BANDS])).collect();
        for _ in 0..STEPS {
            let mut sums = vec![(0.0, [0.0; BANDS]); NODES];
            for (towards, logs) in given {
                let there = mean(&nodes, *towards);
                // What is loud has to be right.
                let loud = logs.iter().fold(LEAST, |most, log| most.max(log.exp()));
                for ((weight, sum), (at, _)) in sums.iter_mut().zip(&nodes) {
                    let share = loud * share(*at, *towards);
                    *weight += share;
                    sum.iter_mut().zip(logs.iter().zip(there)).for_each(|(s, (log, there))| *s += share * (log - there));
                }
            }
            for ((_, logs), (weight, sum)) in nodes.iter_mut().zip(&sums) {
                logs.iter_mut().zip(sum).for_each(|(log, s)| *log += s / weight);
            }
        }
        let axis = mean(&nodes, DVec3::X);
        nodes.iter_mut().for_each(|(_, logs)| logs.iter_mut().zip(axis).for_each(|(log, axis)| *log -= axis));
        Self { nodes }
    }
}

fn share(node: DVec3, towards: DVec3) -> f64 {
    (SHARPNESS * (node.dot(towards) - 1.0)).exp()
}

/// The nodes' logarithms in a direction.
fn mean(nodes: &[(DVec3, [f64; BANDS])], towards: DVec3) -> [f64; BANDS] {
    let (mut weight, mut sum) = (0.0, [0.0; BANDS]);
    for (at, logs) in nodes {
        let share = share(*at, towards);
        weight += share;
        sum.iter_mut().zip(logs).for_each(|(sum, log)| *sum += share * log);
    }
    sum.map(|sum| sum / weight)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn db(amplitudes: Octaves) -> f64 {
        20.0 * f64::from(amplitudes[3]).log10()
    }

    #[test]
    fn patterns_are_what_they_are_called() {
        for (name, omni) in Directivity::PATTERNS {
            let pattern = Directivity::named(name).unwrap();
            for degrees in (0..=120).step_by(5) {
                let (sine, cosine) = f64::from(degrees).to_radians().sin_cos();
                let (found, meant) = (db(pattern.towards([cosine, 0.6 * sine, 0.8 * sine])), omni + (1.0 - omni) * cosine);
                let meant = 20.0 * meant.abs().max(LEAST).log10();
                // What falls to nothing at the side is flatter ahead between directions that are given.
                let within = if meant > -6.0 && omni > 0.0 { 0.6 } else { 1.5 };
                assert!(meant < -14.0 || (found - meant).abs() < within, "{name} at {degrees}: {found} of {meant} dB");
            }
        }
        assert_eq!(Directivity::named("Cardioid"), None);
        assert!(db(Directivity::first_order(0.5).towards([-1.0, 0.0, 0.0])) < -18.0);
        assert_eq!(Directivity::first_order(1.0).towards([0.0, 1.0, 0.0]), [1.0; BANDS]);
    }

    #[test]
    fn it_faces_where_it_is_turned_and_its_octaves_are_its_own() {
        let pattern = Directivity::first_order(0.5);
        let left = pattern.turned(FRAC_PI_2, 0.0);
        assert!(db(left.towards([0.0, 2.0, 0.0])).abs() < 1e-6 && db(left.towards([0.0, -1.0, 0.0])) < -18.0);
        let up = pattern.turned(FRAC_PI_2, FRAC_PI_2);
        assert!(db(up.towards([0.0, 0.0, 1.0])).abs() < 1e-6);
        // Only the highest octave is beamed, and the source was measured 6 dB too loud.
        let amplitudes = |towards: DVec3| -> Octaves {
            let mut all = [2.0; BANDS];
            all[6] = (1.0 + towards.x) as f32;
            all
        };
        let given: Vec<_> = (0..600).map(|i| direction(i, 600)).map(|d| (d.to_array(), amplitudes(d))).collect();
        let measured = Directivity::measured(&given).unwrap().turned(PI, 0.0);
        let aside = measured.towards([0.0, 0.0, 1.0]);
        assert!((aside[0] - 1.0).abs() < 1e-3 && (aside[6] - 0.5).abs() < 0.03, "{aside:?}");
        assert!(measured.towards([1.0, 0.0, 0.0])[6] < 0.1 && (measured.towards([-1.0, 0.0, 0.0])[6] - 1.0).abs() < 1e-6);
    }

    #[test]
    fn nonsense_is_refused() {
        let one = [1.0; BANDS];
        assert!(Directivity::measured(&[]).is_err());
        assert!(Directivity::measured(&[([0.0; 3], one)]).is_err());
        assert!(Directivity::measured(&[([f64::NAN, 0.0, 0.0], one)]).is_err());
        assert!(Directivity::measured(&[([1.0, 0.0, 0.0], [f32::NAN; BANDS])]).is_err());
        assert!(Directivity::measured(&[([1.0, 0.0, 0.0], [0.0; BANDS])]).is_err());
        assert_eq!(Directivity::measured(&[([1.0, 0.0, 0.0], one)]).unwrap().towards([0.0, 1.0, 0.0]), one);
    }
}
