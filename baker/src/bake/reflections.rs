//! Early reflections that image sources explain, lifted out of measured responses and played from where their images are.

use crate::bake::layout::Layout;
use crate::bake::room::{ResponseParts, Room};
use crate::error::BakeError;
use crate::player::render_response;
use crate::signal::spectrum::at;
use crate::sources::responses::{Response, Walls};
use promenade_acoustics::{BoxImage, box_images};
use promenade_core::glam::{DVec3, Vec3};
use promenade_core::head::harmonics;
use promenade_core::octave::KILOHERTZ;
use promenade_core::{
    AMBISONIC_CHANNELS, AmbisonicHead, Axis, Facing, Field, FieldGrid, Head, ImageSource, ImageSources, Mover, OCTAVES,
    OCTAVES_HZ, Rows, Scene, SceneParts, StftGrid, TransferShape, TurningRoom, Weather,
};
use promenade_fourier::Fourier;
use promenade_fourier::num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

/// Walls that an image has met, at most.
const ORDER: u32 = 3;
/// When images come after the direct sound at the earliest and at the latest, seconds. What comes earlier belongs to it.
const COMES_S: Range<f64> = 0.0025..0.040;
/// Length of what they are fitted to, seconds after the direct sound.
const FITTED_S: f64 = 0.050;
/// Images that are played, at most: each costs as much as some taps.
const MOST_IMAGES: usize = 32;
/// Share of the images' energy below which one is not worth its cost.
const LEAST_SHARE: f64 = 3e-4;
/// How much more an image's own energy counts in the fit: nothing that is explained badly is lifted out.
const RIDGE: f64 = 0.05;
/// How much gains of the octaves up to 500 Hz are held near those of the octave above, likewise.
const LOW_PULLS: [f64; KILOHERTZ] = [1.0, 1.0, 0.5];
/// Turns of the fit.
const TURNS: usize = 300;
/// Lead and length of the head's filters, seconds.
const HEAD_LEAD_S: f64 = 0.001;
const HEAD_LENGTH_S: f64 = 0.005;
/// Length of a direct sound, and how much later a head may hear it than was expected, in steps, seconds.
const DIRECT_S: f64 = 0.008;
const LATEST_S: f64 = 0.0006;
const TIME_STEP_S: f64 = 2e-6;
/// Distances that differ by more than this are several, metres.
const SAME_DISTANCE_M: f32 = 0.01;

/// Images and what the engine plays of them at each measured pose, from a quarter of a hop before the arrival on.
pub(crate) struct Reflections {
    pub(crate) images: ImageSources,
    pub(crate) played: Vec<[Vec<f32>; 2]>,
}

impl Reflections {
    /// Finds the images of a box and their gains by octave, the same for all responses, which are heard times `gain`: least
    /// squares of what follows the direct sound, none negative and none more than a mirror. `None` where images explain
    /// nothing.
    pub(crate) fn of(
        walls: &Walls,
        (measured, heard): (&[&Response], &[ResponseParts]),
        layout: &Layout,
        head: &Head,
        (grid, room): (&StftGrid, &Room),
        gain: f32,
    ) -> Result<Option<Self>, BakeError> {
        let rate = grid.sample_rate_hz;
        let head = AmbisonicHead::of(head, rate, (HEAD_LEAD_S * rate) as usize, (HEAD_LENGTH_S * rate) as usize);
        let head = timed(head, (measured, heard), layout);
        let Some(all) = candidates(walls, measured, layout, head)? else { return Ok(None) };
        let fit = Fit::of(&all, heard, layout, grid, f64::from(gain));
        let Some(images) = fit.images(&all) else { return Ok(None) };
        let played = played(&images, layout, grid, room)?;
        Ok(Some(Self { images, played }))
    }
}

/// All images that come early at any pose, with gains of 1.
fn candidates(
    walls: &Walls,
    measured: &[&Response],
    layout: &Layout,
    head: AmbisonicHead,
) -> Result<Option<ImageSources>, BakeError> {
    let places = measured.iter().flat_map(|r| [("listener", r.listener.position), ("source", r.source)]);
    walls.check(places)?;
    let Some(first) = measured.first() else { return Ok(None) };
    let turning = layout.turns.then(|| {
        let longest = layout.distances.iter().fold(0.0, |a: f32, d| a.max(*d));
        let even = layout.distances.iter().all(|d| longest - d < SAME_DISTANCE_M);
        TurningRoom {
            listener: first.listener,
            centre: Vec3::ZERO,
            moves: walls.moves.unwrap_or(if even { Mover::Listener } else { Mover::Source }),
            side: if layout.is_half() { layout.sites.iter().map(|s| s.direction.x).sum::<f32>().signum() } else { 0.0 },
            mirrors: Vec::new(),
        }
    });
    let turned = |r: &&Response| r.listener.orientation.angle_between(first.listener.orientation) > 1e-3;
    if turning.is_some() && measured.iter().any(turned) {
        let expected = "one orientation of the head in a room that sources were measured around it in";
        return Err(BakeError::argument("room of the responses", expected, "several"));
    }
    let emitter = turning.as_ref().map_or(layout.emitter, |room| room.reference(layout.emitter));
    let [source, size] = [emitter - walls.corner, walls.size].map(|v| v.as_dvec3().to_array());
    let boxes: Vec<BoxImage> = box_images(ORDER).into_iter().skip(1).collect();
    let place = |image: &BoxImage| walls.corner + DVec3::from(image.position(source, size)).as_vec3();
    let mirror = |image: &BoxImage| Vec3::from_array(image.rooms.map(|n| if n % 2 == 0 { 1.0 } else { -1.0 }));
    let mut images = ImageSources {
        images: boxes.iter().map(|b| ImageSource { position: place(b), gains: [1.0; OCTAVES] }).collect(),
        air_db_per_m: [0.0; OCTAVES],
        places: layout.emitter.to_array().map(Axis::single),
        seen: vec![1.0; boxes.len()],
        direct: vec![1.0],
        head,
        turning: turning.map(|room| TurningRoom { mirrors: boxes.iter().map(mirror).collect(), ..room }),
    };
    let speed = Weather::default().speed_m_s();
    let early: Vec<usize> = (0..boxes.len())
        .filter(|&image| {
            let after = layout
                .poses
                .iter()
                .zip(&layout.distances)
                .map(|(pose, direct)| (images.seen_from_head(image, pose, layout.emitter).length() - direct) / speed);
            let after: Vec<f64> = after.map(f64::from).collect();
            // One that is the direct sound's at a pose cannot be told from it there.
            after.iter().all(|s| *s >= COMES_S.start) && after.iter().any(|s| *s < COMES_S.end)
        })
        .collect();
    images = only(&images, &early);
    Ok((!early.is_empty()).then_some(images))
}

/// Some of the images.
fn only(all: &ImageSources, kept: &[usize]) -> ImageSources {
    ImageSources {
        images: kept.iter().map(|i| all.images[*i]).collect(),
        seen: vec![1.0; kept.len()],
        turning: all.turning.clone().map(|room| {
            let mirrors = kept.iter().map(|i| room.mirrors[*i]).collect();
            TurningRoom { mirrors, ..room }
        }),
        ..all.clone()
    }
}

/// The octave of a frequency.
fn octave(hz: f64) -> Option<usize> {
    let place = (hz / f64::from(OCTAVES_HZ[0])).max(1e-9).log2().round();
    (0.0..OCTAVES as f64).contains(&place).then_some(place as usize)
}

/// What a head hears of places, as spectra.
struct Ears {
    rate: f64,
    n_fft: usize,
    fourier: Fourier<f64>,
    /// Bins that are looked at, each with its octave.
    bins: Vec<(usize, usize)>,
    /// Of each filter of the head.
    filters: Vec<Vec<Complex64>>,
    /// Samples of the head before the sound is at its centre.
    lead: f64,
}

impl Ears {
    /// For signals of `len` samples.
    fn new(head: &AmbisonicHead, len: usize) -> Self {
        let (rate, n_fft) = (head.sample_rate_hz, (len + head.len()).next_power_of_two());
        let fourier = Fourier::<f64>::new(n_fft);
        let spectrum = |filter: &[f32]| fourier.spectrum(filter.iter().map(|v| f64::from(*v)));
        Self {
            rate,
            n_fft,
            bins: (1..n_fft / 2).filter_map(|k| Some((k, octave(k as f64 * rate / n_fft as f64)?))).collect(),
            filters: head.filters.chunks_exact(head.len()).map(spectrum).collect(),
            lead: head.lead as f64,
            fourier,
        }
    }

    fn hz(&self, bin: usize) -> f64 {
        bin as f64 * self.rate / self.n_fft as f64
    }

    /// What an ear hears of a place, seen from the head, whose sound is at the head's centre after so many samples, by bin.
    fn of_place(&self, way: Vec3, samples: f64, ear: usize) -> Vec<Complex64> {
        let distance = way.length().max(1e-3);
        let shares = harmonics(AMBISONIC_CHANNELS.isqrt() - 1, way / distance);
        let delay = samples - self.lead;
        let turned = |(k, _): &(usize, usize)| {
            let sum: Complex64 = (0..AMBISONIC_CHANNELS).map(|c| self.filters[2 * c + ear][*k] * f64::from(shares[c])).sum();
            sum * Complex64::from_polar(1.0 / f64::from(distance), -TAU * *k as f64 * delay / self.n_fft as f64)
        };
        self.bins.iter().map(turned).collect()
    }
}

/// The head with its sounds as late after their arrival as those that were measured.
fn timed(head: AmbisonicHead, (measured, heard): (&[&Response], &[ResponseParts]), layout: &Layout) -> AmbisonicHead {
    let ears = Ears::new(&head, (DIRECT_S * head.sample_rate_hz) as usize);
    let before = (0.25 * DIRECT_S * head.sample_rate_hz) as i64;
    let mut cross = vec![Complex64::default(); ears.bins.len()];
    for ((response, heard), pose) in measured.iter().zip(heard).zip(&layout.poses) {
        for (ear, samples) in [&response.left, &response.right].into_iter().enumerate() {
            let (rest, from) = (&heard.direct.rest[ear], heard.direct.arrival - before);
            let direct = (0..ears.n_fft as i64).map(|i| at(samples, from + i) - at(rest, from + i));
            let spectrum = ears.fourier.spectrum(direct);
            let own = ears.of_place(pose.to_head(layout.emitter), before as f64, ear);
            for ((sum, own), (k, _)) in cross.iter_mut().zip(own).zip(&ears.bins) {
                *sum += spectrum[*k] * own.conj();
            }
        }
    }
    let alike = |late_s: f64| -> f64 {
        let turned =
            |(x, (k, _)): (&Complex64, &(usize, usize))| (x * Complex64::from_polar(1.0, TAU * ears.hz(*k) * late_s)).re;
        cross.iter().zip(&ears.bins).map(turned).sum()
    };
    let steps = (LATEST_S / TIME_STEP_S) as i32;
    let late = (-steps..=steps).map(|i| f64::from(i) * TIME_STEP_S);
    let late_s = late.max_by(|a, b| alike(*a).total_cmp(&alike(*b))).unwrap_or(0.0);
    delayed(head, late_s)
}

/// A head that hears everything later.
fn delayed(head: AmbisonicHead, late_s: f64) -> AmbisonicHead {
    let len = head.len();
    let n_fft = (2 * len).next_power_of_two();
    let filters = head.filters.chunks_exact(len).flat_map(|filter| {
        let mut spectrum = promenade_fourier::spectrum(filter.iter().map(|v| f64::from(*v)), n_fft);
        for (k, x) in spectrum.iter_mut().enumerate() {
            *x *= Complex64::from_polar(1.0, -TAU * k as f64 * late_s * head.sample_rate_hz / n_fft as f64);
        }
        promenade_fourier::signal(spectrum, n_fft).into_iter().take(len).map(|v| v as f32)
    });
    AmbisonicHead { filters: filters.collect(), ..head }
}

/// Normal equations of the images' gains by octave.
struct Fit {
    /// What each two images have in common, `[octave][image][image]`.
    common: Vec<Vec<Vec<f64>>>,
    /// What each has in common with the measurements, `[octave][image]`.
    explained: Vec<Vec<f64>>,
    /// Energies by octave of the direct sound, and of what it would be with an amplitude of 1 at 1 m.
    energies: [[f64; 2]; OCTAVES],
}

impl Fit {
    fn zero(count: usize) -> Self {
        Self {
            common: vec![vec![vec![0.0; count]; count]; OCTAVES],
            explained: vec![vec![0.0; count]; OCTAVES],
            energies: [[0.0; 2]; OCTAVES],
        }
    }

    fn of(all: &ImageSources, heard: &[ResponseParts], layout: &Layout, grid: &StftGrid, gain: f64) -> Self {
        let len = grid.lead() + (FITTED_S * grid.sample_rate_hz) as usize;
        let ears = Ears::new(&all.head, len);
        let parts: Vec<Self> = (0..heard.len())
            .into_par_iter()
            .map(|r| Self::of_response(all, (&ears, len), (heard, r), layout, grid, gain))
            .collect();
        parts.into_iter().fold(Self::zero(all.images.len()), Self::add)
    }

    fn of_response(
        all: &ImageSources,
        (ears, len): (&Ears, usize),
        (heard, response): (&[ResponseParts], usize),
        layout: &Layout,
        grid: &StftGrid,
        gain: f64,
    ) -> Self {
        let (direct, pose, distance) = (&heard[response].direct, &layout.poses[response], layout.distances[response]);
        let count = all.images.len();
        let mut sums = Self::zero(count);
        let per_m = grid.sample_rate_hz / f64::from(Weather::default().speed_m_s());
        let lead = grid.lead() as f64;
        let ways: Vec<Vec3> = (0..count).map(|i| all.seen_from_head(i, pose, layout.emitter)).collect();
        for ear in 0..2 {
            let from = direct.arrival - grid.lead() as i64;
            let fade = |i: usize| (4.0 * (len - i) as f64 / len as f64).min(1.0);
            let samples = (0..len).map(|i| gain * fade(i) * at(&direct.rest[ear], from + i as i64));
            let spectrum = ears.fourier.spectrum(samples);
            let after = |way: &Vec3| lead + f64::from(way.length() - distance) * per_m;
            let images: Vec<Vec<Complex64>> = ways.iter().map(|way| ears.of_place(*way, after(way), ear)).collect();
            let own = ears.of_place(pose.to_head(layout.emitter), lead, ear);
            for (place, (k, octave)) in ears.bins.iter().enumerate() {
                let (common, explained) = (&mut sums.common[*octave], &mut sums.explained[*octave]);
                for (i, a) in images.iter().enumerate() {
                    let a = a[place].conj();
                    explained[i] += (a * spectrum[*k]).re;
                    for (sum, b) in common[i].iter_mut().zip(&images[..=i]) {
                        *sum += (a * b[place]).re;
                    }
                }
                let bin = ((ears.hz(*k) / grid.bin_hz(1)).round() as usize).min(grid.bins() - 1);
                let found = [(gain * direct.gain[ear][bin]).powi(2), own[place].norm_sqr()];
                sums.energies[*octave].iter_mut().zip(found).for_each(|(sum, energy)| *sum += energy);
            }
        }
        for common in &mut sums.common {
            let lower = common.clone();
            for (j, row) in common.iter_mut().enumerate() {
                for (i, other) in lower.iter().enumerate().skip(j + 1) {
                    row[i] = other[j];
                }
            }
        }
        sums
    }

    fn add(mut self, other: Self) -> Self {
        let of = |sums: &mut [f64], more: &[f64]| sums.iter_mut().zip(more).for_each(|(sum, v)| *sum += v);
        for octave in 0..OCTAVES {
            of(&mut self.explained[octave], &other.explained[octave]);
            of(&mut self.energies[octave], &other.energies[octave]);
            self.common[octave].iter_mut().zip(&other.common[octave]).for_each(|(sums, more)| of(sums, more));
        }
        self
    }

    /// The most that an image may have of the amplitude in an octave: what the emitter sends to the head.
    fn most(&self, octave: usize) -> f64 {
        let [direct, one] = self.energies[octave];
        if one > 0.0 { (direct / one).sqrt() } else { 0.0 }
    }

    /// Gains of some images in an octave, pulled towards others: least squares with bounds, one after the other.
    fn octave_gains(&self, octave: usize, kept: &[usize], (towards, pull): (&[f64], f64)) -> Vec<f64> {
        let (common, explained, most) = (&self.common[octave], &self.explained[octave], self.most(octave));
        let mut gains = vec![0.0; kept.len()];
        for _ in 0..TURNS {
            for (place, &i) in kept.iter().enumerate() {
                let others: f64 = kept.iter().zip(&gains).map(|(j, g)| if *j == i { 0.0 } else { common[i][*j] * g }).sum();
                let wanted = explained[i] - others + pull * common[i][i] * towards[place];
                let own = common[i][i] * (1.0 + pull);
                gains[place] = if own > 0.0 { (wanted / own).clamp(0.0, most) } else { 0.0 };
            }
        }
        gains
    }

    /// Gains of some images, `[octave][image]`. Long waves do not tell images apart: their gains are held near those of the
    /// octave above.
    fn gains(&self, kept: &[usize]) -> Vec<Vec<f64>> {
        let none = vec![0.0; kept.len()];
        let mut gains: Vec<Vec<f64>> = (0..OCTAVES)
            .map(|octave| if octave < KILOHERTZ { none.clone() } else { self.octave_gains(octave, kept, (&none, RIDGE)) })
            .collect();
        for octave in (0..KILOHERTZ).rev() {
            gains[octave] = self.octave_gains(octave, kept, (&gains[octave + 1], LOW_PULLS[octave]));
        }
        for octave in 1..OCTAVES {
            if self.most(octave) == 0.0 {
                gains[octave] = gains[octave - 1].clone();
            }
        }
        gains
    }

    /// Energy that each of some images has at gains.
    fn energies(&self, kept: &[usize], gains: &[Vec<f64>]) -> Vec<f64> {
        let of = |(place, i): (usize, &usize)| {
            gains.iter().zip(&self.common).map(|(gains, common)| gains[place].powi(2) * common[*i][*i]).sum()
        };
        kept.iter().enumerate().map(of).collect()
    }

    /// The images that are worth playing, the strongest first.
    fn images(&self, all: &ImageSources) -> Option<ImageSources> {
        let mut kept: Vec<usize> = (0..all.images.len()).collect();
        let found = self.energies(&kept, &self.gains(&kept));
        let whole: f64 = found.iter().sum();
        kept.retain(|i| found[*i] > LEAST_SHARE * whole);
        kept.sort_by(|a, b| found[*b].total_cmp(&found[*a]));
        kept.truncate(MOST_IMAGES);
        let gains = self.gains(&kept);
        let mut images = only(all, &kept);
        for (place, image) in images.images.iter_mut().enumerate() {
            image.gains = std::array::from_fn(|octave| gains[octave][place] as f32);
        }
        (!kept.is_empty()).then_some(images)
    }
}

/// What the engine plays of images at the measured poses, `[response][ear]`, from a quarter of a hop before the arrival on.
fn played(images: &ImageSources, layout: &Layout, grid: &StftGrid, room: &Room) -> Result<Vec<[Vec<f32>; 2]>, BakeError> {
    let shape = TransferShape { taps: 1, ..room.shape };
    let [x, y, z] = layout.emitter.to_array().map(Axis::single);
    let [elevation, azimuth] = [(); 2].map(|()| Axis::single(0.0));
    let nodes = FieldGrid { position: [x, y, z], facing: Facing::Emitter { position: layout.emitter, elevation, azimuth } };
    let field = Field::new(nodes, shape, Rows::Whole(shape.silent().to_row()));
    let parts = SceneParts {
        taps: shape.taps,
        field,
        images: Some(images.clone()),
        top_hz: room.top_hz,
        ..SceneParts::new(*grid, room.bands.clone(), room.tail.clone())
    };
    let scene = Arc::new(Scene::new(parts)?);
    let farthest = (0..images.images.len()).flat_map(|image| {
        let of_pose = move |(pose, direct): (&_, &f32)| images.seen_from_head(image, pose, layout.emitter).length() - direct;
        layout.poses.iter().zip(&layout.distances).map(of_pose)
    });
    let farthest_s = farthest.fold(0.0, f32::max) / Weather::default().speed_m_s();
    let len = (f64::from(farthest_s) * grid.sample_rate_hz) as usize + 2 * images.head.len() + grid.hop;
    let lead = grid.lead();
    layout.poses.par_iter().map(|pose| render_response(&scene, *pose, lead, lead + len)).collect()
}
