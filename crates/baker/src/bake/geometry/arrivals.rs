//! What the places of a room hear.

use super::options::GeometryOptions;
use crate::bake::corners::MOST_BENT;
use crate::error::BakeError;
use crate::sources::simulation::OCTAVES_HZ;
use promenade_acoustics::{
    Air, DiffractionPath, Echogram, Edges, Image, ImageOptions, Images, Mesh, Octaves, RayOptions, Reflected, Room, Source,
    late_field, speed_m_s,
};
use promenade_core::Pose;
use promenade_core::glam::{DVec3, Vec3};
use promenade_room::{LateEnergies, SceneHead};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Reverberation time of a room in which nothing decays in sight, seconds.
const UNKNOWN_T60_S: f64 = 0.3;
/// The longest and shortest time that rays are followed, seconds.
const RAY_LENGTH_S: (f64, f64) = (0.3, 8.0);

/// What one place hears.
pub(super) struct Arrivals {
    pub(super) at: DVec3,
    /// In the order of their indices.
    pub(super) images: Vec<Image>,
    /// Ways of the direct sound round edges where it is hidden, and of images that are.
    around: Vec<DiffractionPath>,
    bent: Vec<DiffractionPath>,
    pub(super) echogram: Echogram,
    /// Seconds of the direct sound, seen or not.
    direct_s: f64,
}

impl Arrivals {
    /// Whether the emitter itself is seen.
    pub(super) fn sees(&self) -> bool {
        self.images.iter().any(|image| image.order == 0)
    }
}

/// Images and echograms of all places, by bins of half a hop; rays are followed for a time, seconds.
pub(super) fn listen(
    (mesh, room, source): (&Mesh, &Room, &Source),
    places: &[DVec3],
    (hop_s, length_s): (f64, f64),
    options: &GeometryOptions,
    done: impl Fn(f64) + Sync,
) -> Result<(Images, Vec<Arrivals>), BakeError> {
    let listeners: Vec<[f64; 3]> = places.iter().map(DVec3::to_array).collect();
    let search = ImageOptions { order: options.order, beams: options.beams, ..ImageOptions::default() };
    let images = Images::new(room, source, &search)?;
    let edges = Edges::of(mesh);
    let diffracted = edges.diffracted_images(room, &images, Reflected::Specular)?;
    let rays = RayOptions {
        rays: options.rays,
        length_s: length_s.clamp(RAY_LENGTH_S.0, RAY_LENGTH_S.1),
        bin_s: 0.5 * hop_s,
        images: Some(&images),
        radius_m: None,
        air: options.air,
        seed: options.seed,
    };
    let late = late_field(room, source, &listeners, &rays, |share| done(0.9 * share))?;
    let heard: Result<Vec<Arrivals>, BakeError> = listeners
        .par_iter()
        .zip(late.echograms)
        .map(|(at, echogram)| {
            let bent = diffracted.paths(*at)?;
            let mut images = images.seen_from(room, *at, Reflected::Specular)?;
            diffracted.shade(*at, &bent, &mut images)?;
            let direct_s = DVec3::from(source.position).distance((*at).into()) / speed_m_s(options.air);
            let hidden = images.iter().all(|image| image.order > 0);
            let around = if hidden { edges.paths_round_one_or_two(room, source, *at)? } else { Vec::new() };
            Ok(Arrivals { at: (*at).into(), images, around, bent, echogram, direct_s })
        })
        .collect();
    done(1.0);
    let heard = heard?;
    Ok((images, heard))
}

/// What played images do not have: rays, all other images, and what comes round edges.
pub(super) fn left_over(
    heard: &Arrivals,
    kept: &BTreeSet<usize>,
    cornered: bool,
    head: &SceneHead,
    air: Option<Air>,
) -> LateEnergies {
    let mut late = LateEnergies::of(&heard.echogram, heard.direct_s, head);
    let emitter_m = heard.direct_s * speed_m_s(air);
    let speed = speed_m_s(air);
    let mut add = |position: [f64; 3], path_m: f64, low: f32, amplitudes: &Octaves| {
        let left = amplitudes.map(|a| f64::from(a).powi(2));
        let direction = (DVec3::from(position) - heard.at).normalize_or_zero();
        let air = |hz: f64| 10.0_f64.powf(-0.1 * air.map_or(0.0, |air| air.db_per_m(hz) * path_m));
        late.add(path_m / speed, direction, (f64::from(low).powi(2), &left), head, air);
    };
    for image in heard.images.iter().filter(|i| i.order > 0 && !kept.contains(&i.index)) {
        let way = heard.at.distance(image.position.into()).max(emitter_m);
        add(image.position, way, image.gain_63 / way as f32, &image.gains.map(|g| g / way as f32));
    }
    // The shortest way round an edge is heard by itself, as are the loudest of images.
    for way in heard.around.iter().skip(usize::from(cornered)) {
        let amplitudes = way.amplitudes();
        add(way.position, way.path_m, amplitudes[0], &amplitudes);
    }
    for way in heard.bent.iter().skip(if cornered { MOST_BENT } else { 0 }).filter(|way| !way.lit) {
        let amplitudes = way.amplitudes();
        add(way.position, way.path_m, amplitudes[0], &amplitudes);
    }
    late
}

/// The longest of the octaves' reverberation times, seconds, each a mean over all places that show one.
pub(super) fn typical_t60_s(heard: &[Arrivals]) -> f64 {
    let mean = |band: usize| {
        let times: Vec<f64> = heard.iter().filter_map(|h| h.echogram.t20_s(band)).collect();
        (!times.is_empty()).then(|| times.iter().sum::<f64>() / times.len() as f64)
    };
    (0..OCTAVES_HZ.len()).filter_map(mean).reduce(f64::max).unwrap_or(UNKNOWN_T60_S)
}

/// A pose that sees the emitter, at the place nearest to the middle of those that do.
pub(super) fn start_pose(heard: &[Arrivals], emitter: Vec3) -> Pose {
    let at = |h: &Arrivals| h.at.as_vec3();
    let middle = heard.iter().map(at).sum::<Vec3>() / heard.len() as f32;
    let seeing = heard.iter().filter(|h| h.sees()).map(at);
    let near = seeing.min_by(|a, b| a.distance(middle).total_cmp(&b.distance(middle))).unwrap_or_else(|| at(&heard[0]));
    let way = emitter - near;
    Pose::from_ypr(near, way.y.atan2(way.x), 0.0, 0.0)
}
