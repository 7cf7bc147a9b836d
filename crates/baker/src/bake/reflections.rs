//! Early reflections that image sources explain: lifted out of measured responses away from where those were measured, and
//! played from where their images are.

use crate::bake::ears::Ears;
use crate::bake::grains::{Arrival, Grains, LOWEST};
use crate::bake::layout::Layout;
use crate::bake::room::ResponseParts;
use crate::error::BakeError;
use crate::signal::spectrum::at;
use crate::sources::responses::{Response, Walls};
use promenade_acoustics::{BoxImage, box_images};
use promenade_core::glam::{DVec3, Vec3};
use promenade_core::{
    AmbisonicHead, Axis, Head, ImageSource, ImageSources, Mover, OCTAVES, OCTAVES_HZ, StftGrid, TurningRoom, Weather,
};
use promenade_fourier::num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::ops::Range;

/// Walls that an image has met, at most.
const ORDER: u32 = 3;
/// When images come after the direct sound at the earliest and at the latest, seconds. What comes earlier belongs to it.
const COMES_S: Range<f64> = 0.0025..0.040;
/// Length of what they are lifted out of, seconds after the direct sound, and of its end, where it fades.
const LENGTH_S: f64 = 0.050;
const FADE_S: f64 = 0.008;
/// Images that are played, at most: each costs as much as some taps.
const MOST_IMAGES: usize = 32;
/// Share of the images' energy below which one is not worth its cost.
const LEAST_SHARE: f64 = 3e-4;
/// What gains of an octave below those that are fitted have of the amplitude of the one above.
const LOWER: f32 = 0.5;
/// Lead and length of the head's filters, seconds.
const HEAD_LEAD_S: f64 = 0.001;
const HEAD_LENGTH_S: f64 = 0.005;
/// Length of a direct sound, and how much later a head may hear it than was expected, in steps, seconds.
const DIRECT_S: f64 = 0.008;
const LATEST_S: f64 = 0.0006;
const TIME_STEP_S: f64 = 2e-6;
/// Frequencies at which they are compared, Hz.
const COMPARED_HZ: (f64, f64) = (88.0, 11_300.0);
/// Distances that differ by more than this are several, metres.
const SAME_DISTANCE_M: f32 = 0.01;

/// Images, and what each response loses where they are played, `[response][ear][sample]`, from a quarter of a hop before the
/// arrival on.
pub(crate) struct Reflections {
    pub(crate) images: ImageSources,
    pub(crate) lifted: Vec<[Vec<f32>; 2]>,
}

impl Reflections {
    /// Finds the images of a room and their gains by octave, the same for all responses, which are heard times `gain`, by the
    /// energy that arrives when they do. `None` where images explain nothing.
    pub(crate) fn of(
        walls: &Walls,
        (measured, heard): (&[&Response], &[ResponseParts]),
        layout: &Layout,
        head: &Head,
        grid: &StftGrid,
        gain: f32,
    ) -> Result<Option<Self>, BakeError> {
        let rate = grid.sample_rate_hz;
        let head = AmbisonicHead::of(head, rate, (HEAD_LEAD_S * rate) as usize, (HEAD_LENGTH_S * rate) as usize);
        let head = timed(head, (measured, heard), layout);
        let Some(all) = candidates(walls, measured, layout, head)? else { return Ok(None) };
        let len = grid.lead() + (LENGTH_S * rate) as usize;
        let heard = Heard { responses: heard, layout, lead: grid.lead(), len, gain: f64::from(gain) };
        let ears = Ears::new(&all.head, len);
        let most = heard.most(&ears, &all.head);
        let found = heard.gains(&all, &ears, &most);
        let Some(kept) = worth_playing(&all, &found, layout) else { return Ok(None) };
        let mut images = only(&all, &kept);
        let (gains, lifted) = heard.lifted(&images, &ears, &most);
        for (place, image) in images.images.iter_mut().enumerate() {
            let octaves = &gains[place];
            image.gains = std::array::from_fn(|octave| match octave.checked_sub(LOWEST) {
                Some(fitted) => octaves[fitted.min(octaves.len() - 1)].sqrt() as f32,
                None => octaves[0].sqrt() as f32 * LOWER.powi((LOWEST - octave) as i32),
            });
        }
        Ok(Some(Self { images, lifted }))
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
    let size = walls.size.to_array().map(|size| if size.is_finite() { f64::from(size) } else { 0.0 });
    let source = (emitter - walls.corner).as_dvec3().to_array();
    // Walls that nothing is known of mirror nothing.
    let known = |image: &BoxImage| image.rooms.iter().zip(walls.size.to_array()).all(|(n, size)| *n == 0 || size.is_finite());
    let boxes: Vec<BoxImage> = box_images(ORDER).into_iter().skip(1).filter(known).collect();
    let place = |image: &BoxImage| walls.corner + DVec3::from(image.position(source, size)).as_vec3();
    let mirror = |image: &BoxImage| Vec3::from_array(image.rooms.map(|n| if n % 2 == 0 { 1.0 } else { -1.0 }));
    let mut images = ImageSources {
        images: boxes.iter().map(|b| ImageSource::new(place(b), [1.0; OCTAVES])).collect(),
        air_db_per_m: [0.0; OCTAVES],
        places: layout.emitter.to_array().map(Axis::single),
        seen: vec![1.0; boxes.len()],
        direct: vec![1.0],
        head,
        turning: turning.map(|room| TurningRoom { mirrors: boxes.iter().map(mirror).collect(), ..room }),
        emission: None,
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

/// The head with its sounds as late after their arrival as those that were measured.
fn timed(head: AmbisonicHead, (measured, heard): (&[&Response], &[ResponseParts]), layout: &Layout) -> AmbisonicHead {
    let ears = Ears::new(&head, (DIRECT_S * head.sample_rate_hz) as usize);
    let before = (0.25 * DIRECT_S * head.sample_rate_hz) as i64;
    let mut cross = vec![Complex64::default(); ears.n_fft / 2 + 1];
    for ((response, heard), pose) in measured.iter().zip(heard).zip(&layout.poses) {
        for (ear, samples) in [&response.left, &response.right].into_iter().enumerate() {
            let (rest, from) = (&heard.direct.rest[ear], heard.direct.arrival - before);
            let direct = (0..ears.n_fft as i64).map(|i| at(samples, from + i) - at(rest, from + i));
            let spectrum = ears.fourier.spectrum(direct);
            let own = ears.of_place(pose.to_head(layout.emitter), before as f64, ear);
            cross.iter_mut().zip(spectrum).zip(own).for_each(|((sum, x), own)| *sum += x * own.conj());
        }
    }
    let compared = COMPARED_HZ.0..COMPARED_HZ.1.min(0.5 * ears.rate);
    let alike = |late_s: f64| -> f64 {
        let turned = |(k, x): (usize, &Complex64)| (x * Complex64::from_polar(1.0, TAU * ears.hz(k) * late_s)).re;
        cross.iter().enumerate().filter(|(k, _)| compared.contains(&ears.hz(*k))).map(turned).sum()
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

/// The responses as a head hears them, each from a quarter of a hop before its arrival on.
struct Heard<'a> {
    responses: &'a [ResponseParts],
    layout: &'a Layout,
    /// Samples before the arrival, and all.
    lead: usize,
    len: usize,
    gain: f64,
}

impl Heard<'_> {
    /// The most energy that an image may have in an octave from [`LOWEST`] on, over what a source of an amplitude of 1 at 1 m
    /// has: what the emitter sends to the head.
    fn most(&self, ears: &Ears, head: &AmbisonicHead) -> Vec<f64> {
        let pose = |r: usize| self.layout.poses[r].to_head(self.layout.emitter);
        let mut ratios = Vec::new();
        let last = ears.last_octave();
        let mut energies = vec![[0.0; 2]; last + 1 - LOWEST];
        for (r, response) in self.responses.iter().enumerate() {
            let bins = response.direct.gain[0].len();
            for ear in 0..2 {
                let own = ears.of_place(pose(r), head.lead as f64, ear);
                for (octave, energies) in energies.iter_mut().enumerate() {
                    let centre = f64::from(OCTAVES_HZ[octave + LOWEST]);
                    let within = centre * std::f64::consts::FRAC_1_SQRT_2..centre * std::f64::consts::SQRT_2;
                    let mean = |power: &dyn Fn(usize) -> f64, bins: usize| {
                        let hz = |k: usize| k as f64 * 0.5 * ears.rate / (bins - 1) as f64;
                        let all = (0..bins).filter(|k| within.contains(&hz(*k)));
                        all.clone().map(power).sum::<f64>() / all.count().max(1) as f64
                    };
                    energies[0] += mean(&|k| (self.gain * response.direct.gain[ear][k]).powi(2), bins);
                    energies[1] += mean(&|k| own[k].norm_sqr(), own.len());
                }
            }
        }
        ratios.extend(energies.iter().map(|[direct, one]| if *one > 0.0 { direct / one } else { 0.0 }));
        ratios
    }

    /// What follows the direct sound of a response.
    fn grains(&self, response: usize, ears: &Ears) -> Grains {
        let direct = &self.responses[response].direct;
        let from = direct.arrival - self.lead as i64;
        let fade = |i: usize| ((self.len - i) as f64 / (FADE_S * ears.rate)).min(1.0);
        let samples = |ear: usize| (0..self.len).map(move |i| self.gain * fade(i) * at(&direct.rest[ear], from + i as i64));
        let spectra = [0, 1].map(|ear| ears.fourier.spectrum(samples(ear)));
        Grains::of(ears, [&spectra[0], &spectra[1]], self.len)
    }

    /// The images that come while a response is looked at, by number, with how they would arrive.
    fn arrivals(&self, images: &ImageSources, response: usize, ears: &Ears) -> (Vec<usize>, Vec<Arrival>) {
        let (pose, direct) = (&self.layout.poses[response], self.layout.distances[response]);
        let arrival = |image: usize| {
            let way = images.seen_from_head(image, pose, self.layout.emitter);
            let after_s = f64::from((way.length() - direct) / Weather::default().speed_m_s());
            let at = self.lead as f64 + after_s * ears.rate;
            COMES_S.contains(&after_s).then(|| {
                let spectra = [0, 1].map(|ear| ears.of_place(way, at, ear));
                let energies = Grains::of(ears, [&spectra[0], &spectra[1]], self.len).into_energies();
                (image, Arrival { at: at.round() as usize, energies })
            })
        };
        (0..images.images.len()).filter_map(arrival).unzip()
    }

    /// Gains of images in each response that they come in, as ratios of energies, `[image][octave]`: the means.
    fn gains(&self, images: &ImageSources, ears: &Ears, most: &[f64]) -> Vec<Vec<f64>> {
        let of_response = |response: usize| {
            let (numbers, arrivals) = self.arrivals(images, response, ears);
            (numbers, self.grains(response, ears).gains(&arrivals, most, ears.rate))
        };
        let found: Vec<_> = (0..self.responses.len()).into_par_iter().map(of_response).collect();
        means(images.images.len(), most.len(), &found)
    }

    /// Gains of images as [`Self::gains`] has them, and filters of what each response loses with them.
    ///
    /// What is left of a response holds some of what its images explain: they are played with the energy that it loses.
    fn lifted(&self, images: &ImageSources, ears: &Ears, most: &[f64]) -> (Vec<Vec<f64>>, Vec<[Vec<f32>; 2]>) {
        let of_response = |response: usize| {
            let (numbers, arrivals) = self.arrivals(images, response, ears);
            let grains = self.grains(response, ears);
            let gains = grains.gains(&arrivals, most, ears.rate);
            let mut moved = vec![[0.0; 2]; most.len()];
            let lost = [0, 1].map(|ear| grains.lifted(&arrivals, &gains, ear, &mut moved));
            ((numbers, gains), (lost, moved))
        };
        let found: Vec<_> = (0..self.responses.len()).into_par_iter().map(of_response).collect();
        let (gains, lifted): (Vec<_>, Vec<_>) = found.into_iter().unzip();
        let (lost, moved): (Vec<_>, Vec<_>) = lifted.into_iter().unzip();
        let mut means = means(images.images.len(), most.len(), &gains);
        for octave in 0..most.len() {
            let [lost, played] = [0, 1].map(|which| moved.iter().map(|moved| moved[octave][which]).sum::<f64>());
            let share = if played > lost { lost / played } else { 1.0 };
            means.iter_mut().for_each(|gains| gains[octave] *= share);
        }
        (means, lost)
    }
}

/// Means over responses of gains of images, `[image][octave]`, each of the responses that an image comes in; of a response,
/// numbers of the images and their gains, `[octave][image]`.
fn means(images: usize, octaves: usize, found: &[(Vec<usize>, Vec<Vec<f64>>)]) -> Vec<Vec<f64>> {
    let mut sums = vec![vec![0.0; octaves]; images];
    let mut counts = vec![0_u32; images];
    for (numbers, gains) in found {
        for (place, image) in numbers.iter().enumerate() {
            counts[*image] += 1;
            sums[*image].iter_mut().zip(gains).for_each(|(sum, gains)| *sum += gains[place]);
        }
    }
    let mean = |(sums, count): (Vec<f64>, u32)| sums.into_iter().map(|sum| sum / f64::from(count.max(1))).collect();
    sums.into_iter().zip(counts).map(mean).collect()
}

/// The images that are worth playing, the strongest first.
fn worth_playing(images: &ImageSources, gains: &[Vec<f64>], layout: &Layout) -> Option<Vec<usize>> {
    let near = |image: usize| -> f64 {
        let of_pose = |pose| f64::from(images.seen_from_head(image, pose, layout.emitter).length_squared().max(1e-6)).recip();
        layout.poses.iter().map(of_pose).sum()
    };
    let energies: Vec<f64> = gains.iter().enumerate().map(|(i, octaves)| near(i) * octaves.iter().sum::<f64>()).collect();
    let whole: f64 = energies.iter().sum();
    let mut kept: Vec<usize> = (0..gains.len()).filter(|i| energies[*i] > LEAST_SHARE * whole).collect();
    kept.sort_by(|a, b| energies[*b].total_cmp(&energies[*a]));
    kept.truncate(MOST_IMAGES);
    (!kept.is_empty()).then_some(kept)
}
