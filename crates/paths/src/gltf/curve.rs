//! A property of a node over time.

use super::accessor::elements;
use super::document::Document;
use crate::PathFileError;
use glam::{DQuat, DVec3, DVec4};
use gltf::json::animation::{Interpolation, Sampler};
use gltf::json::validation::Checked;
use std::ops::{Add, Mul};

/// Keys of a translation, a scale (vectors) or a rotation (quaternions x, y, z, w), at least one, rising in time.
#[derive(Debug)]
pub(super) struct Curve<V> {
    /// Seconds.
    times_s: Vec<f64>,
    keys: Vec<Key<V>>,
    interpolation: Interpolation,
}

#[derive(Clone, Copy, Debug)]
struct Key<V> {
    /// Slopes before and after the key, per second; only of splines.
    slope_in: V,
    value: V,
    slope_out: V,
}

impl<V: Copy + Add<Output = V> + Mul<f64, Output = V>> Curve<V> {
    /// Reads a sampler; `of` names it in errors.
    pub(super) fn read<const N: usize>(
        document: &mut Document<'_, '_>,
        of: &str,
        sampler: &Sampler,
        value: impl Fn([f64; N]) -> V,
    ) -> Result<Self, PathFileError> {
        let Checked::Valid(interpolation) = sampler.interpolation else {
            return Err(document.wrong(of, "an interpolation LINEAR, STEP or CUBICSPLINE", "another"));
        };
        let times_s: Vec<f64> = elements::<1>(document, sampler.input.value())?.into_iter().map(|[t]| t).collect();
        if times_s.is_empty() {
            return Err(document.wrong(of, "keys", "none"));
        }
        if let Some(key) = (1..times_s.len()).find(|k| times_s[*k] <= times_s[k - 1]) {
            let expected = format!("a time after {} s at key {key}", times_s[key - 1]);
            return Err(document.wrong(of, expected, format!("{} s", times_s[key])));
        }
        let values: Vec<V> = elements::<N>(document, sampler.output.value())?.into_iter().map(value).collect();
        let spline = interpolation == Interpolation::CubicSpline;
        let expected = if spline { 3 * times_s.len() } else { times_s.len() };
        if values.len() != expected {
            return Err(document.wrong(of, format!("{expected} values for {} keys", times_s.len()), values.len().to_string()));
        }
        let keys = if spline {
            values.chunks_exact(3).map(|k| Key { slope_in: k[0], value: k[1], slope_out: k[2] }).collect()
        } else {
            values.iter().map(|v| Key { slope_in: *v, value: *v, slope_out: *v }).collect()
        };
        Ok(Self { times_s, keys, interpolation })
    }

    /// Times of the keys, seconds.
    pub(super) fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// The value at a time, seconds; `mix` goes straight from one value to the other. The ends hold.
    fn at(&self, t_s: f64, mix: impl Fn(V, V, f64) -> V) -> V {
        let next = self.times_s.partition_point(|t| *t <= t_s);
        if next == 0 {
            return self.keys[0].value;
        }
        let a = self.keys[next - 1];
        let Some(b) = self.keys.get(next) else { return a.value };
        let span = self.times_s[next] - self.times_s[next - 1];
        let u = (t_s - self.times_s[next - 1]) / span;
        match self.interpolation {
            Interpolation::Step => a.value,
            Interpolation::Linear => mix(a.value, b.value, u),
            // glTF 2.0, appendix C.
            Interpolation::CubicSpline => {
                let (u2, u3) = (u * u, u * u * u);
                a.value * (2.0 * u3 - 3.0 * u2 + 1.0)
                    + a.slope_out * (span * (u3 - 2.0 * u2 + u))
                    + b.value * (3.0 * u2 - 2.0 * u3)
                    + b.slope_in * (span * (u3 - u2))
            }
        }
    }
}

impl Curve<DVec3> {
    /// A translation or scale at a time.
    pub(super) fn vector(&self, t_s: f64) -> DVec3 {
        self.at(t_s, DVec3::lerp)
    }
}

impl Curve<DVec4> {
    /// A rotation at a time; not finite where the file's numbers make none.
    pub(super) fn rotation(&self, t_s: f64) -> DQuat {
        let unit = |v: DVec4| DQuat::from_vec4(v).normalize();
        let mix = |a: DVec4, b: DVec4, u: f64| DVec4::from(unit(a).slerp(unit(b), u));
        unit(self.at(t_s, mix))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve<V: Copy>(interpolation: Interpolation, keys: &[(f64, [V; 3])]) -> Curve<V> {
        Curve {
            times_s: keys.iter().map(|k| k.0).collect(),
            keys: keys.iter().map(|(_, [i, v, o])| Key { slope_in: *i, value: *v, slope_out: *o }).collect(),
            interpolation,
        }
    }

    #[test]
    fn steps_and_lines_and_splines() {
        let (z, x) = (DVec3::ZERO, DVec3::X);
        let keys = [(1.0, [z, z, x * 2.0]), (3.0, [z, x, z])];
        let at = |interpolation, t| curve(interpolation, &keys).vector(t).x;
        assert_eq!([0.0, 1.5, 2.9, 3.0, 9.0].map(|t| at(Interpolation::Step, t)), [0.0, 0.0, 0.0, 1.0, 1.0]);
        assert_eq!([0.0, 1.5, 3.5].map(|t| at(Interpolation::Linear, t)), [0.0, 0.25, 1.0]);
        // The cubic that leaves 0 with slope 2 and comes to 1 with slope 0 within 2 s: 4 u - 5 u^2 + 2 u^3.
        for u in [0.0, 0.25, 0.5, 1.0] {
            let expected = 4.0 * u - 5.0 * u * u + 2.0 * u * u * u;
            assert!((at(Interpolation::CubicSpline, 1.0 + 2.0 * u) - expected).abs() < 1e-12, "{u}");
        }
    }

    #[test]
    fn rotations_go_the_short_way_at_constant_speed() {
        let at = |degrees: f64| DVec4::from(DQuat::from_rotation_z(degrees.to_radians()));
        // The second one is the same rotation, written with the other sign.
        let keys = [(0.0, [at(0.0); 3]), (1.0, [-at(120.0); 3])];
        let third = curve(Interpolation::Linear, &keys).rotation(1.0 / 3.0);
        assert!(third.angle_between(DQuat::from_rotation_z(40.0_f64.to_radians())) < 1e-6);
        let doubled = curve(Interpolation::Linear, &[(0.0, [at(30.0) * 2.0; 3])]);
        assert!(doubled.rotation(0.0).is_normalized());
    }
}
