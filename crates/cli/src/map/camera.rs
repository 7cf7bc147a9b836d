//! What a camera sees, coloured by the sound that falls on it.

use super::exr;
use crate::args::MapArgs;
use crate::plot;
use crate::report;
use anyhow::{Result, bail};
use promenade_acoustics::{Intensity, Room, Seen, Source};
use promenade_baker::atomic;
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use rayon::prelude::*;

/// Rays, unless told: each leaves a particle at every wall that it meets until one absorbs it.
const RAYS: u32 = 262_144;

/// Pictures are smoothed over this share of their width to either side.
const SMOOTHED: usize = 64;

/// A picture's numbers, row by row from above.
pub(super) struct View {
    size: [usize; 2],
    /// Metres; NaN where the room is open.
    distance_m: Vec<f32>,
    /// Sound that falls on what is seen, dB beside the direct sound at 1 m; NaN where there is none.
    pub(super) level_db: Vec<f32>,
}

/// Makes the pictures.
pub(super) fn run(args: &MapArgs, room: &Room, source: Source, camera: &Pose) -> Result<()> {
    let bar = report::Bar::new("tracing", 1.0);
    let intensity = Intensity::new(room, source, &args.trace.options(args.rays.unwrap_or(RAYS)))?;
    let view = View::new(&intensity, camera, args.size, args.fov)?;
    drop(bar);
    for path in &args.output {
        if super::ending(path) == "exr" {
            exr::write(path, view.size, vec![("distance", view.distance_m.clone()), ("level", view.level_db.clone())])?;
        } else {
            atomic::write(path, &plot::picture_png(view.size, &view.level_db, None)?)?;
        }
    }
    let mut levels: Vec<f32> = view.level_db.iter().copied().filter(|level| level.is_finite()).collect();
    if levels.is_empty() {
        bail!("--camera: no sound falls on anything that it sees");
    }
    levels.sort_by(f32::total_cmp);
    let at = |share: f64| format!("{:.1}", levels[((levels.len() - 1) as f64 * share) as usize]);
    report::print(&format!(
        "level of what falls on surfaces, dB beside the direct sound at 1 m: least {}, median {}, most {}\n",
        at(0.0),
        at(0.5),
        at(1.0)
    ))
}

impl View {
    /// What a camera at a pose sees, the horizontal angle of its picture in degrees.
    pub(super) fn new(intensity: &Intensity<'_>, camera: &Pose, size: [usize; 2], angle_deg: f32) -> Result<Self> {
        let [width, height] = size;
        let from = camera.position.as_dvec3().to_array();
        let half = (0.5 * angle_deg.to_radians()).tan();
        let pixel = |index: usize| {
            let (x, y) = ((index % width) as f32 + 0.5, (index / width) as f32 + 0.5);
            let (left, up) = (0.5 * width as f32 - x, 0.5 * height as f32 - y);
            let scale = 2.0 * half / width as f32;
            let way = camera.orientation * Vec3::new(1.0, scale * left, scale * up);
            intensity.seen(from, way.as_dvec3().to_array())
        };
        let seen = (0..width * height).into_par_iter().map(pixel).collect::<Result<Vec<_>, _>>()?;
        let intensities = smoothed(&seen, size);
        let level = |intensity: f64| if intensity > 0.0 { (10.0 * intensity.log10()) as f32 } else { f32::NAN };
        Ok(Self {
            size,
            distance_m: seen.iter().map(|seen| seen.map_or(f32::NAN, |seen| seen.distance_m as f32)).collect(),
            level_db: intensities.into_iter().map(level).collect(),
        })
    }
}

/// Intensities of pixels, each a mean over those about it that show the same plane, by Hann's window along rows and columns:
/// what is left of single particles is smaller than what is seen of the sound.
fn smoothed(seen: &[Option<Seen>], [width, height]: [usize; 2]) -> Vec<f64> {
    let reach = width / SMOOTHED;
    let weight = |away: usize| 1.0 + (std::f64::consts::PI * away as f64 / (reach + 1) as f64).cos();
    let along = |of: &[f64], step: usize, count: usize, place: usize, index: usize| -> f64 {
        let Some(own) = seen[index] else { return 0.0 };
        let (mut sum, mut weights) = (0.0, 0.0);
        for other in place.saturating_sub(reach)..(place + reach + 1).min(count) {
            let at = index + other * step - place * step;
            if seen[at].is_some_and(|seen| seen.plane == own.plane) {
                sum += weight(other.abs_diff(place)) * of[at];
                weights += weight(other.abs_diff(place));
            }
        }
        sum / weights
    };
    let pixels = 0..width * height;
    let own: Vec<f64> = seen.iter().map(|seen| seen.map_or(0.0, |seen| seen.intensity)).collect();
    let rows: Vec<f64> = pixels.clone().map(|i| along(&own, 1, width, i % width, i)).collect();
    pixels.map(|i| along(&rows, width, height, i / width, i)).collect()
}
