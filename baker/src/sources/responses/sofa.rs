//! SOFA files (AES69-2022): FIR responses of two receivers, for one source or for emitters around it. Read raw: nothing is
//! resampled, normalised or interpolated.

use super::spherical::to_cartesian;
use super::{LoadOptions, Response, Responses, Side, check};
use crate::{BakeError, file};
use hdf5_pure::{Dataset, File};
use promenade_core::Pose;
use promenade_core::glam::{Mat3, Quat, Vec3};
use std::path::Path;

/// Values of a variable other than the responses.
const MAX_VALUES: u64 = 1 << 24;
/// Values of responses read at a time.
const BLOCK_VALUES: usize = 1 << 23;
/// A delay stored beside a response, samples.
const MAX_DELAY: f64 = 1_000_000.0;

pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Responses, BakeError> {
    file::check(path).map_err(BakeError::read(path))?;
    Sofa { path, file: File::open_streaming(path).map_err(failed(path))? }.load(options)
}

fn failed<E: Into<hdf5_pure::Error>>(path: &Path) -> impl Fn(E) -> BakeError {
    let path = path.to_path_buf();
    move |source| BakeError::Sofa { path: path.clone(), source: Box::new(source.into()) }
}

struct Sofa<'a> {
    path: &'a Path,
    file: File,
}

/// Points, one for each measurement or one for all.
struct Points {
    points: Vec<Vec3>,
    spherical: bool,
}

impl Points {
    fn at(&self, measurement: usize) -> Vec3 {
        self.points[if self.points.len() == 1 { 0 } else { measurement }]
    }
}

impl Sofa<'_> {
    fn load(&self, options: &LoadOptions) -> Result<Responses, BakeError> {
        let data_type = self.attribute("DataType");
        if !matches!(data_type.as_str(), "FIR" | "FIRE" | "FIR-E") {
            return Err(self.wrong("DataType", "FIR, FIRE or FIR-E", format!("\"{data_type}\"")));
        }
        let shape = self.shape("Data.IR")?;
        let [measurements, receivers, emitters, frames] = match shape[..] {
            [m, r, n] => [m, r, 1, n],
            [m, r, e, n] => [m, r, e, n],
            _ => return Err(self.wrong("Data.IR", "3 or 4 dimensions", format!("{shape:?}"))),
        };
        check::size(self.path, measurements, frames)?;
        if receivers != 2 {
            return Err(self.wrong("Data.IR", "2 receivers, the ears", receivers));
        }
        let emitter = match options.source {
            Some(n) if n < emitters => n,
            None if emitters == 1 => 0,
            chosen => {
                let found = chosen.map_or("none chosen".to_owned(), |n| n.to_string());
                let expected = format!("the number of one of its {emitters} emitters, counted from 0");
                return Err(self.wrong("Data.IR", expected, found));
            }
        };
        let sample_rate_hz = self.sample_rate()?;
        let left = self.left_receiver()?;
        let listeners = self.listeners(measurements)?;
        let sources = self.sources(measurements, emitters, emitter, options)?;
        let delays = self.delays(measurements, emitters, emitter)?;
        let per_measurement = receivers * emitters * frames;
        let block = (BLOCK_VALUES / per_measurement.max(1)).max(1);
        let data = self.dataset("Data.IR")?;
        let mut responses = Vec::with_capacity(measurements);
        for first in (0..measurements).step_by(block) {
            let count = block.min(measurements - first);
            let values = data.read_f64_rows(first as u64, count as u64).map_err(failed(self.path))?;
            if values.len() != count * per_measurement {
                return Err(self.wrong("Data.IR", format!("{} values", count * per_measurement), values.len()));
            }
            for (offset, values) in values.chunks_exact(per_measurement).enumerate() {
                let m = first + offset;
                let ear = |receiver: usize| {
                    let start = (receiver * emitters + emitter) * frames;
                    delayed(&values[start..start + frames], delays[m][receiver])
                };
                responses.push(Response {
                    listener: listeners[m],
                    source: sources[m],
                    left: ear(left),
                    right: ear(1 - left),
                    name: format!("measurement {m}"),
                });
            }
        }
        let title =
            [self.attribute("Title"), self.attribute("DatabaseName")].into_iter().find(|t| !t.is_empty() && t != "none");
        let file_name = || self.path.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let credit = [self.attribute("Organization"), self.attribute("AuthorContact")];
        let mut set = Responses {
            title: title.unwrap_or_else(file_name),
            credit: credit.into_iter().filter(|c| !c.is_empty()).collect::<Vec<_>>().join(", "),
            licence: self.attribute("License"),
            sample_rate_hz,
            responses,
            notes: Vec::new(),
        };
        // Labels in the unusual order are sometimes wrong: the ears themselves tell.
        if left == 1 && check::ears_contradict(&set) {
            set.responses.iter_mut().for_each(|r| std::mem::swap(&mut r.left, &mut r.right));
            set.notes.push(
                "ReceiverPosition lists the right ear first, but the first receiver hears as a left ear and was taken as one"
                    .to_owned(),
            );
        }
        Ok(set)
    }

    fn wrong(&self, variable: &str, expected: impl Into<String>, found: impl ToString) -> BakeError {
        BakeError::entry(self.path, variable, expected, found)
    }

    /// A global text, empty where there is none.
    fn attribute(&self, name: &str) -> String {
        let attributes = self.file.root().attrs().unwrap_or_default();
        attributes.get(name).and_then(|v| v.as_str()).unwrap_or_default().trim().to_owned()
    }

    fn dataset(&self, name: &str) -> Result<Dataset, BakeError> {
        self.file.dataset(name).map_err(failed(self.path))
    }

    fn has(&self, name: &str) -> bool {
        self.file.dataset(name).is_ok()
    }

    fn shape(&self, name: &str) -> Result<Vec<usize>, BakeError> {
        let shape = self.dataset(name)?.shape().map_err(failed(self.path))?;
        Ok(shape.iter().map(|&n| usize::try_from(n).unwrap_or(usize::MAX)).collect())
    }

    /// All values of a small variable with its shape.
    fn values(&self, name: &str) -> Result<(Vec<usize>, Vec<f64>), BakeError> {
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

    fn sample_rate(&self) -> Result<f64, BakeError> {
        let (_, rates) = self.values("Data.SamplingRate")?;
        let rate = rates.first().copied().unwrap_or(0.0);
        let believed = f64::from(*crate::wav::SAMPLE_RATES_HZ.start())..=f64::from(*crate::wav::SAMPLE_RATES_HZ.end());
        if !believed.contains(&rate) || rates.iter().any(|&r| r != rate) {
            let expected = format!("one rate of {} to {} Hz", believed.start(), believed.end());
            return Err(self.wrong("Data.SamplingRate", expected, format!("{rates:?}")));
        }
        Ok(rate)
    }

    /// Whether the coordinates of a variable are angles, and whether they are in degrees.
    fn coordinates(&self, name: &str) -> Result<(bool, bool), BakeError> {
        let attributes = self.dataset(name)?.attrs().map_err(failed(self.path))?;
        let text = |key: &str| attributes.get(key).and_then(|v| v.as_str()).unwrap_or_default().trim().to_ascii_lowercase();
        match text("Type").as_str() {
            "spherical" => Ok((true, !text("Units").starts_with("rad"))),
            "cartesian" | "" => Ok((false, true)),
            other => Err(self.wrong(name, "cartesian or spherical coordinates", format!("\"{other}\""))),
        }
    }

    /// Points of a variable of shape [measurements or 1, 3], or [.., 3, measurements or 1] of which row `row` is taken.
    fn points(&self, name: &str, row: usize, measurements: usize, positive: Side) -> Result<Points, BakeError> {
        let (spherical, degrees) = self.coordinates(name)?;
        self.points_as(name, row, measurements, positive, spherical, degrees)
    }

    /// The same of a variable that may be missing.
    fn points_or(&self, name: &str, measurements: usize, missing: Vec3) -> Result<Points, BakeError> {
        if self.has(name) {
            self.points(name, 0, measurements, Side::Left)
        } else {
            Ok(Points { points: vec![missing], spherical: false })
        }
    }

    fn points_as(
        &self,
        name: &str,
        row: usize,
        measurements: usize,
        positive: Side,
        spherical: bool,
        degrees: bool,
    ) -> Result<Points, BakeError> {
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
        let point = |m: usize| {
            let [a, b, c] = [at(m, 0), at(m, 1), at(m, 2)].map(|v| v as f32);
            match (spherical, degrees) {
                (false, _) => Vec3::new(a, b, c),
                (true, true) => to_cartesian(a, b, c, positive),
                (true, false) => to_cartesian(a.to_degrees(), b.to_degrees(), c, positive),
            }
        };
        Ok(Points { points: (0..count).map(point).collect(), spherical })
    }

    /// Which of the two receivers is the left ear: the one further along y. Files list them in either order.
    fn left_receiver(&self) -> Result<usize, BakeError> {
        if !self.has("ReceiverPosition") {
            return Ok(0);
        }
        let (shape, _) = self.values("ReceiverPosition")?;
        let columns = shape.get(2).copied().unwrap_or(1);
        let y: Vec<f32> = match shape[..] {
            [2, 3] => self.points("ReceiverPosition", 0, 2, Side::Left)?.points.iter().map(|p| p.y).collect(),
            _ => (0..2)
                .map(|r| Ok(self.points("ReceiverPosition", r, columns, Side::Left)?.at(0).y))
                .collect::<Result<_, BakeError>>()?,
        };
        // Receivers that are not told apart are left and right, the order of the standard's conventions.
        Ok(usize::from(y[1] > y[0] + 1e-6))
    }

    fn listeners(&self, measurements: usize) -> Result<Vec<Pose>, BakeError> {
        let positions = self.points_or("ListenerPosition", measurements, Vec3::ZERO)?;
        let views = self.points_or("ListenerView", measurements, Vec3::X)?;
        let ups = self.ups("ListenerUp", "ListenerView", measurements, &views)?;
        (0..measurements)
            .map(|m| {
                let orientation = facing(views.at(m), ups.at(m)).ok_or_else(|| {
                    let found = format!("view {} and up {} of measurement {m}", views.at(m), ups.at(m));
                    self.wrong("ListenerView", "a view and an up across it", found)
                })?;
                Ok(Pose { position: positions.at(m), orientation })
            })
            .collect()
    }

    /// Up vectors are in the coordinates of their view, but writers often leave the Cartesian 0, 0, 1 beside spherical views, so the
    /// reading that lies across the views is taken.
    fn ups(&self, name: &str, view: &str, measurements: usize, views: &Points) -> Result<Points, BakeError> {
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

    fn sources(
        &self,
        measurements: usize,
        emitters: usize,
        emitter: usize,
        options: &LoadOptions,
    ) -> Result<Vec<Vec3>, BakeError> {
        let positive = options.azimuth_positive.unwrap_or(Side::Left);
        let positions = self.points("SourcePosition", 0, measurements, positive)?;
        // A single emitter stands for the source itself; several lie around it in its own axes.
        let around = (emitters > 1).then(|| self.points("EmitterPosition", emitter, measurements, positive)).transpose()?;
        if positive == Side::Right && !positions.spherical && !around.as_ref().is_some_and(|a| a.spherical) {
            let expected = "spherical coordinates, whose azimuths may run to the right";
            return Err(self.wrong("SourcePosition", expected, "Cartesian ones"));
        }
        let Some(around) = around else {
            return Ok((0..measurements).map(|m| positions.at(m)).collect());
        };
        let views = self.points_or("SourceView", measurements, Vec3::X)?;
        let ups = self.ups("SourceUp", "SourceView", measurements, &views)?;
        let turn = |m: usize| facing(views.at(m), ups.at(m)).unwrap_or(Quat::IDENTITY);
        Ok((0..measurements).map(|m| positions.at(m) + turn(m) * around.at(m)).collect())
    }

    /// Delays of both receivers for each measurement, samples.
    fn delays(&self, measurements: usize, emitters: usize, emitter: usize) -> Result<Vec<[f64; 2]>, BakeError> {
        if !self.has("Data.Delay") {
            return Ok(vec![[0.0; 2]; measurements]);
        }
        let (shape, values) = self.values("Data.Delay")?;
        let (rows, columns) = match shape[..] {
            [rows, 2] => (rows, 1),
            [rows, 2, e] if e == 1 || e == emitters => (rows, e),
            _ => return Err(self.wrong("Data.Delay", "a delay for each of 2 receivers", format!("{shape:?}"))),
        };
        if rows != 1 && rows != measurements {
            return Err(self.wrong("Data.Delay", format!("1 or {measurements} measurements"), rows));
        }
        if let Some(bad) = values.iter().find(|v| !(0.0..=MAX_DELAY).contains(*v)) {
            return Err(self.wrong("Data.Delay", format!("0 to {MAX_DELAY} samples"), bad));
        }
        let column = if columns == 1 { 0 } else { emitter };
        let at = |m: usize, r: usize| values[((if rows == 1 { 0 } else { m }) * 2 + r) * columns + column];
        Ok((0..measurements).map(|m| [at(m, 0), at(m, 1)]).collect())
    }
}

/// The turn that brings x to `view` and z as near to `up` as it goes; `None` where both are one line or zero.
fn facing(view: Vec3, up: Vec3) -> Option<Quat> {
    let x = view.try_normalize()?;
    let up = up.try_normalize()?;
    let z = (up - x * up.dot(x)).try_normalize().filter(|_| up.dot(x).abs() < 0.99)?;
    Some(Quat::from_mat3(&Mat3::from_cols(x, z.cross(x), z)).normalize())
}

/// A response with its separately stored delay put back: whole samples by shifting, the rest by a windowed sinc of 16 samples to
/// each side (Laakso et al. 1996).
fn delayed(samples: &[f64], delay: f64) -> Vec<f32> {
    const REACH: i32 = 16;
    let whole = delay.round();
    let rest = delay - whole;
    let shift = whole as usize;
    let narrow = |v: &f64| *v as f32;
    let padding = std::iter::repeat_n(0.0, shift);
    if rest.abs() < 1e-3 {
        return padding.chain(samples.iter().map(narrow)).collect();
    }
    let tap = |k: i32| {
        let t = f64::from(k) - rest;
        let phase = std::f64::consts::PI * t;
        phase.sin() / phase * (0.5 + 0.5 * (phase / f64::from(REACH + 1)).cos())
    };
    let taps: Vec<f64> = (-REACH..=REACH).map(tap).collect();
    let at = |i: i64| usize::try_from(i).ok().and_then(|i| samples.get(i)).copied().unwrap_or(0.0);
    let length = i64::try_from(samples.len()).unwrap_or(i64::MAX).saturating_add(i64::from(REACH));
    let filtered =
        (0..length).map(|i| taps.iter().enumerate().map(|(k, t)| t * at(i - k as i64 + i64::from(REACH))).sum::<f64>());
    padding.chain(filtered.map(|v| narrow(&v))).collect()
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

    #[test]
    fn delays_whole_and_broken() {
        let mut pulse = vec![0.0; 64];
        for (i, v) in pulse.iter_mut().enumerate() {
            *v = (-0.5 * ((i as f64 - 30.0) / 2.0).powi(2)).exp();
        }
        assert_eq!(delayed(&pulse, 3.0)[33], 1.0);
        let quarter = delayed(&pulse, 2.25);
        for (i, v) in quarter.iter().take(64).enumerate() {
            let expected = (-0.5 * ((i as f64 - 32.25) / 2.0).powi(2)).exp();
            assert!((f64::from(*v) - expected).abs() < 2e-4, "sample {i}: {v} for {expected}");
        }
    }
}
