//! The baseline of distance and HRTF: free field, no room.

use super::Method;
use crate::signal::convolve::{convolve, shape};
use crate::{BakeError, Capture, Clip, Responses, resample};
use promenade_core::NEAREST_M;
use promenade_core::glam::Vec3;
use promenade_core::network::{HEAD_RADIUS_M, SPEED_OF_SOUND_M_S};
use promenade_fourier::num_complex::{Complex32, Complex64};
use std::f64::consts::PI;

/// Dry sound before a clip that is filtered with it, seconds.
const PRE_ROLL_S: f64 = 0.25;

/// Where the ears' responses come from.
enum EarResponses {
    /// Responses without a room at the capture's rate: the direction that each is for, and both ears.
    Measured(Vec<(Vec3, [Vec<f32>; 2])>),
    /// A rigid sphere.
    Sphere,
}

/// The dry sounds over their distances, heard from their emitters' directions, with one gain for all clips.
pub(super) struct DistanceAndHrtf {
    hrtf: EarResponses,
    pub(super) gain: f32,
}

impl DistanceAndHrtf {
    pub(super) fn new(capture: &Capture, hrtf: Option<&Responses>) -> Result<Self, BakeError> {
        let Some(set) = hrtf else { return Ok(Self { hrtf: EarResponses::Sphere, gain: 1.0 }) };
        let (from, to) = (set.sample_rate_hz.round() as u32, capture.sample_rate_hz.round() as u32);
        let one = |r: &crate::Response| {
            let direction = r.listener.to_head(r.source).normalize_or_zero();
            let mut ears = resample::response(&[r.left.clone(), r.right.clone()], from, to)?.into_iter();
            Ok((direction, [ears.next().unwrap_or_default(), ears.next().unwrap_or_default()]))
        };
        let responses = set.responses.iter().map(one).collect::<Result<Vec<_>, BakeError>>()?;
        Ok(Self { hrtf: EarResponses::Measured(responses), gain: 1.0 })
    }
}

impl Method for DistanceAndHrtf {
    fn name(&self) -> &'static str {
        "distance-and-head"
    }

    fn note(&self) -> &'static str {
        ""
    }

    fn predict(&mut self, capture: &Capture, clip: &Clip) -> Result<[Vec<f32>; 2], BakeError> {
        let rate = capture.sample_rate_hz;
        let before = (PRE_ROLL_S * rate) as usize;
        let mut sum = [vec![0.0; clip.len], vec![0.0; clip.len]];
        for voice in capture.voices(clip, before) {
            let Some(emitter) = voice.emitter.map(|number| capture.emitters[number].position) else { continue };
            let seen = clip.pose.to_head(emitter);
            let gain = self.gain / seen.length().max(NEAREST_M);
            let direction = seen.try_normalize().unwrap_or(Vec3::X);
            let dry: Vec<f32> = voice.dry.iter().map(|v| gain * v).collect();
            let ears = match &self.hrtf {
                EarResponses::Measured(all) => {
                    let nearest = all.iter().max_by(|a, b| a.0.dot(direction).total_cmp(&b.0.dot(direction)));
                    nearest.map_or_else(|| [dry.clone(), dry.clone()], |(_, [l, r])| convolve(&dry, [l, r]))
                }
                EarResponses::Sphere => {
                    shape(&dry, rate, |hz| [1.0, -1.0].map(|side| sphere(f64::from(side * direction.y), hz)))
                }
            };
            for (sum, ear) in sum.iter_mut().zip(ears) {
                sum.iter_mut().zip(&ear[before..]).for_each(|(sum, x)| *sum += x);
            }
        }
        Ok(sum)
    }
}

/// Response of one ear of a sphere to a source far away: one pole and one zero for the shadow, and the way round the sphere
/// (Brown and Duda 1998, "A structural model for binaural sound synthesis", equations 3 to 5). `towards` is the cosine of the
/// angle between the source and the ear's axis.
fn sphere(towards: f64, hz: f64) -> Complex32 {
    const LEAST: f64 = 0.1;
    const DARKEST: f64 = 150.0 / 180.0;
    let angle = towards.clamp(-1.0, 1.0).acos();
    let radius_s = f64::from(HEAD_RADIUS_M) / f64::from(SPEED_OF_SOUND_M_S);
    let alpha = (1.0 + 0.5 * LEAST) + (1.0 - 0.5 * LEAST) * (angle / DARKEST).cos();
    let w = 2.0 * PI * hz;
    let shadow = Complex64::new(1.0, 0.5 * alpha * w * radius_s) / Complex64::new(1.0, 0.5 * w * radius_s);
    // From the ear that is nearest to the source's plane wave on.
    let way = if angle < 0.5 * PI { 1.0 - angle.cos() } else { 1.0 + angle - 0.5 * PI };
    let value = shadow * Complex64::from_polar(1.0, -w * way * radius_s);
    Complex32::new(value.re as f32, value.im as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_near_ear_is_louder_and_earlier() {
        let (near, far) = (sphere(1.0, 6000.0), sphere(-1.0, 6000.0));
        assert!(near.norm() > 1.7 && far.norm() < 0.6, "{near} {far}");
        assert!((sphere(0.0, 50.0).norm() - sphere(1.0, 50.0).norm()).abs() < 0.01, "long waves go round");
        // Woodworth: (a / c) (pi / 2 + 1) from ear to ear, 656 us.
        let hz = 200.0;
        let lag = (sphere(1.0, hz).arg() - sphere(-1.0, hz).arg()).rem_euclid(std::f32::consts::TAU)
            / (std::f32::consts::TAU * 200.0);
        assert!((600e-6..900e-6).contains(&lag), "{lag}");
    }
}
