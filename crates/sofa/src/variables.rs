//! Variables of a SOFA file, checked: numbers, texts, points in their coordinates.

use crate::SofaError;
use crate::spherical::{Side, to_cartesian};
use hdf5_pure::{Dataset, File};
use promenade_core::glam::{Mat3, Quat, Vec3};
use std::fmt::Display;
use std::path::Path;

/// Values of a variable other than the responses.
const MAX_VALUES: u64 = 1 << 24;

pub(crate) fn failed<E: Into<hdf5_pure::Error>>(path: &Path) -> impl Fn(E) -> SofaError {
    move |source| SofaError::unreadable(path, "SOFA (HDF5) file", source.into())
}

/// An open file.
pub(crate) struct Variables<'a> {
    pub(crate) path: &'a Path,
    pub(crate) file: File,
}

/// Points, one for each measurement or one for all.
pub(crate) struct Points {
    pub(crate) points: Vec<Vec3>,
    pub(crate) spherical: bool,
}

impl Points {
    pub(crate) fn at(&self, measurement: usize) -> Vec3 {
        self.points[if self.points.len() == 1 { 0 } else { measurement }]
    }
}

impl Variables<'_> {
    pub(crate) fn wrong(&self, variable: &str, expected: impl Display, found: impl Display) -> SofaError {
        SofaError::entry(self.path, variable, expected, found)
    }

    /// A global text, empty where there is none.
    pub(crate) fn attribute(&self, name: &str) -> String {
        let attributes = self.file.root().attrs().unwrap_or_default();
        attributes.get(name).and_then(|v| v.as_str()).unwrap_or_default().trim().to_owned()
    }

    pub(crate) fn dataset(&self, name: &str) -> Result<Dataset, SofaError> {
        self.file.dataset(name).map_err(failed(self.path))
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.file.dataset(name).is_ok()
    }

    pub(crate) fn shape(&self, name: &str) -> Result<Vec<usize>, SofaError> {
        let shape = self.dataset(name)?.shape().map_err(failed(self.path))?;
        Ok(shape.iter().map(|&n| usize::try_from(n).unwrap_or(usize::MAX)).collect())
    }

    /// All values of a small variable with its shape.
    pub(crate) fn values(&self, name: &str) -> Result<(Vec<usize>, Vec<f64>), SofaError> {
        let dataset = self.dataset(name)?;
        let shape = self.shape(name)?;
        let count = shape.iter().fold(1_u64, |n, &s| n.saturating_mul(s as u64));
        if count > MAX_VALUES {
            return Err(self.wrong(name, format!("at most {MAX_VALUES} values"), count));
        }
        let values = dataset.read_f64().map_err(failed(self.path))?;
        if values.len() as u64 != count || !values.iter().all(|v| v.is_finite()) {
            return Err(self.wrong(name, format!("{count} finite numbers"), "others"));
        }
        Ok((shape, values))
    }

    pub(crate) fn sample_rate(&self) -> Result<f64, SofaError> {
        let (_, rates) = self.values("Data.SamplingRate")?;
        let rate = rates.first().copied().unwrap_or(0.0);
        let believed = f64::from(*promenade_audio::sound::SAMPLE_RATES_HZ.start())
            ..=f64::from(*promenade_audio::sound::SAMPLE_RATES_HZ.end());
        if !believed.contains(&rate) || rates.iter().any(|&r| r != rate) {
            let expected = format!("one rate of {} to {} Hz", believed.start(), believed.end());
            return Err(self.wrong("Data.SamplingRate", expected, format!("{rates:?}")));
        }
        Ok(rate)
    }

    /// A text of a variable in small letters, empty where there is none.
    pub(crate) fn text(&self, name: &str, key: &str) -> Result<String, SofaError> {
        let attributes = self.dataset(name)?.attrs().map_err(failed(self.path))?;
        Ok(attributes.get(key).and_then(|v| v.as_str()).unwrap_or_default().trim().to_ascii_lowercase())
    }

    /// Whether the coordinates of a variable are angles, and whether they are in degrees.
    pub(crate) fn coordinates(&self, name: &str) -> Result<(bool, bool), SofaError> {
        match self.text(name, "Type")?.as_str() {
            "spherical" => Ok((true, !self.text(name, "Units")?.starts_with("rad"))),
            "cartesian" | "" => Ok((false, true)),
            other => Err(self.wrong(name, "cartesian or spherical coordinates", format!("\"{other}\""))),
        }
    }

    /// Points of a variable of shape [measurements or 1, 3], or [.., 3, measurements or 1] of which row `row` is taken.
    pub(crate) fn points(&self, name: &str, row: usize, measurements: usize, positive: Side) -> Result<Points, SofaError> {
        let (spherical, degrees) = self.coordinates(name)?;
        self.points_as(name, row, measurements, positive, spherical, degrees)
    }

    /// Points of a variable of shape [measurements or 1, 3], or one point where it is missing.
    pub(crate) fn points_or(&self, name: &str, measurements: usize, missing: Vec3) -> Result<Points, SofaError> {
        if self.has(name) {
            self.points(name, 0, measurements, Side::Left)
        } else {
            Ok(Points { points: vec![missing], spherical: false })
        }
    }

    pub(crate) fn points_as(
        &self,
        name: &str,
        row: usize,
        measurements: usize,
        positive: Side,
        spherical: bool,
        degrees: bool,
    ) -> Result<Points, SofaError> {
        let (shape, values) = self.values(name)?;
        let at: Box<dyn Fn(usize, usize) -> f64> = match shape[..] {
            [n, 3] if n == 1 || n == measurements => Box::new(move |m, c| values[m * 3 + c]),
            [rows, 3, n] if row < rows && (n == 1 || n == measurements) => Box::new(move |m, c| values[(row * 3 + c) * n + m]),
            _ => {
                let expected = format!("3 coordinates for 1 or {measurements} measurements");
                return Err(self.wrong(name, expected, format!("{shape:?}")));
            }
        };
        let count = if shape.len() == 2 { shape[0] } else { shape[2] };
        let point = |m: usize| cartesian([at(m, 0), at(m, 1), at(m, 2)], spherical, degrees, positive);
        Ok(Points { points: (0..count).map(point).collect(), spherical })
    }

    /// Points of a variable of shape [count, 3], or [count, 3, times] if they stay where they are.
    pub(crate) fn fixed_points(&self, name: &str, count: usize) -> Result<Vec<Vec3>, SofaError> {
        let (shape, values) = self.values(name)?;
        let times = match shape[..] {
            [rows, 3] if rows == count => 1,
            [rows, 3, times] if rows == count && times > 0 => times,
            _ => return Err(self.wrong(name, format!("3 coordinates for each of {count}"), format!("{shape:?}"))),
        };
        if values.chunks_exact(times).any(|over_time| over_time.iter().any(|v| (v - over_time[0]).abs() > 1e-3)) {
            return Err(self.wrong(name, "points that stay where they are", "others"));
        }
        let (spherical, degrees) = self.coordinates(name)?;
        let at = |row: usize| std::array::from_fn(|c| values[(row * 3 + c) * times]);
        Ok((0..count).map(|row| cartesian(at(row), spherical, degrees, Side::Left)).collect())
    }

    /// Up vectors are in the coordinates of their view, but writers often leave the Cartesian 0, 0, 1 beside spherical views,
    /// so the reading that lies across the views is taken.
    pub(crate) fn ups(&self, name: &str, view: &str, measurements: usize, views: &Points) -> Result<Points, SofaError> {
        let across = |ups: &Points| (0..measurements).all(|m| facing(views.at(m), ups.at(m)).is_some());
        if views.spherical && self.has(name) && !self.coordinates(name)?.0 {
            let degrees = self.coordinates(view)?.1;
            let spherical = self.points_as(name, 0, measurements, Side::Left, true, degrees)?;
            if across(&spherical) {
                return Ok(spherical);
            }
        }
        self.points_or(name, measurements, Vec3::Z)
    }
}

fn cartesian(coordinates: [f64; 3], spherical: bool, degrees: bool, positive: Side) -> Vec3 {
    let [a, b, c] = coordinates.map(|v| v as f32);
    match (spherical, degrees) {
        (false, _) => Vec3::new(a, b, c),
        (true, true) => to_cartesian(a, b, c, positive),
        (true, false) => to_cartesian(a.to_degrees(), b.to_degrees(), c, positive),
    }
}

/// The turn that brings x to `view` and z as near to `up` as it goes; `None` where both are one line or zero.
pub(crate) fn facing(view: Vec3, up: Vec3) -> Option<Quat> {
    let x = view.try_normalize()?;
    let up = up.try_normalize()?;
    let z = (up - x * up.dot(x)).try_normalize().filter(|_| up.dot(x).abs() < 0.99)?;
    Some(Quat::from_mat3(&Mat3::from_cols(x, z.cross(x), z)).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_where_it_looks() {
        let left = facing(Vec3::Y, Vec3::Z).unwrap();
        assert!((left * Vec3::X - Vec3::Y).length() < 1e-6 && (left * Vec3::Y - Vec3::NEG_X).length() < 1e-6);
        assert!(facing(Vec3::Z, Vec3::Z).is_none() && facing(Vec3::ZERO, Vec3::Z).is_none());
    }
}
