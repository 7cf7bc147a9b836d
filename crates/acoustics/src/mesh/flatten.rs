//! Scans: facets that lie about a plane, but for noise, are put onto it.
//!
//! Planes are grown from where facets agree most (Besl and Jain 1988, with planes alone): each takes neighbours whose corners
//! lie within some millimetres and whose smoothed normals look its way, and is fitted anew. Planes that are nearly the same are
//! made one, so that a wall in pieces has one image. Corners then move to where the planes that they are on meet.

use super::Mesh;
use super::welded::Welded;
use glam::{DMat3, DVec3};
use promenade_metrics::statistics::median_high;
use std::fmt;

/// A mesh of more planes than this may be a scan.
const MANY_PLANES: usize = 500;
/// Noise below which a mesh is none, metres.
const LEAST_NOISE_M: f64 = 2e-4;
/// Corners are within this many times the noise of their plane, in metres no more than the second.
const WITHIN: f64 = 4.0;
const MOST_M: f64 = 0.08;
/// Rounds in which normals are smoothed, and the least cosine to a neighbour that counts.
const SMOOTHED: usize = 4;
const NEIGHBOUR: f64 = 0.5;
/// Least cosine of a smoothed normal to its plane's, and of a facet's own.
const ALONG: f64 = 0.9;
const OWN: f64 = 0.4;
/// Facets that a plane has at least, and its area in squares of what corners may be off.
const LEAST_FACETS: usize = 12;
const LEAST_AREA: f64 = 40.0;
/// Least cosine between planes that are made one, and between those whose line a corner is put onto.
const SAME: f64 = 0.9962;
const APART: f64 = 0.15;
/// Corners are moved by at most this many times what they may be off.
const MOVED: f64 = 3.0;
/// No plane.
const NONE: u32 = u32::MAX;

/// What [`Mesh::flatten`] has done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flattened {
    /// How far corners lay off the planes, root mean square, metres.
    pub noise_m: f64,
    /// How far corners were allowed to, metres.
    pub within_m: f64,
    /// Planes that were found.
    pub planes: usize,
    /// Facets that were put onto them, and all.
    pub facets: [usize; 2],
    /// Share of the area that they have.
    pub area_share: f64,
    /// How far corners were moved at most, metres.
    pub moved_m: f64,
}

impl fmt::Display for Flattened {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { noise_m, within_m, planes, facets: [facets, all], area_share, moved_m } = self;
        write!(
            f,
            "{facets} of {all} triangles, {:.0} % of the area, lie within {:.1} mm of {planes} planes and were put onto them: \
             {:.1} mm off in the root mean square, corners moved by {:.1} mm at most",
            100.0 * area_share,
            1000.0 * within_m,
            1000.0 * noise_m,
            1000.0 * moved_m
        )
    }
}

impl Mesh {
    /// Puts facets that lie about a plane onto it. Corners may be `within_m` off, metres; without it four times the noise of
    /// the mesh, which is how far corners lie off their neighbours' mean, and nothing is done to a mesh of few planes or
    /// without noise. Returns what was done, if anything.
    pub fn flatten(&mut self, within_m: Option<f64>) -> Option<Flattened> {
        let welded = Welded::new(self);
        let within_m = match within_m {
            Some(within_m) => within_m,
            None => {
                if welded.planes() <= MANY_PLANES {
                    return None;
                }
                let noise = welded.noise();
                (noise >= LEAST_NOISE_M).then_some((WITHIN * noise).min(MOST_M))?
            }
        };
        let mut growth = Growth::new(&welded, within_m);
        growth.grow();
        growth.unite();
        growth.fill();
        let done = growth.moved();
        if done.planes == 0 {
            return None;
        }
        for (triangle, corners) in self.triangles.iter_mut().zip(&welded.corners) {
            triangle.corners = *corners;
        }
        self.vertices = growth.places.iter().map(DVec3::to_array).collect();
        Some(done)
    }
}

impl Welded {
    /// Planes that differ by a tenth of a degree or a ten-thousandth of the mesh, up to one more than are many.
    fn planes(&self) -> usize {
        let size = self.places.iter().fold(0.0_f64, |most, place| most.max(place.length()));
        let mut found = std::collections::HashSet::new();
        for triangle in 0..self.corners.len() {
            let Some(normal) = self.area(triangle).try_normalize() else { continue };
            let offset = normal.dot(self.places[self.corners[triangle][0] as usize]) / size.max(f64::MIN_POSITIVE);
            let sign = if [normal.x, normal.y, normal.z].iter().find(|c| c.abs() > 0.01).is_some_and(|c| *c < 0.0) {
                -1.0
            } else {
                1.0
            };
            let cell = |v: f64, step: f64| (sign * v / step + 0.371).floor() as i64;
            found.insert([cell(normal.x, 2e-3), cell(normal.y, 2e-3), cell(normal.z, 2e-3), cell(offset, 1e-4)]);
            if found.len() > MANY_PLANES {
                break;
            }
        }
        found.len()
    }

    /// How far vertices lie off the mean of those around them, along their normals: the median, as the deviation that noise has
    /// which is spread normally, metres.
    fn noise(&self) -> f64 {
        let mut sums = vec![(DVec3::ZERO, DVec3::ZERO, 0_u32); self.places.len()];
        for (triangle, corners) in self.corners.iter().enumerate() {
            let area = self.area(triangle);
            for k in 0..3 {
                let (place, normal, count) = &mut sums[corners[k] as usize];
                *place += self.places[corners[(k + 1) % 3] as usize] + self.places[corners[(k + 2) % 3] as usize];
                *normal += area;
                *count += 2;
            }
        }
        let off = |(own, (sum, normal, count)): (&DVec3, &(DVec3, DVec3, u32))| {
            (*count >= 6).then(|| (*own - *sum / f64::from(*count)).dot(normal.normalize_or_zero()).abs())
        };
        // The median of the absolute value is .6745 deviations, and the mean of six adds a sixth to the variance.
        let median = median_high(self.places.iter().zip(&sums).filter_map(off));
        median.map_or(0.0, |median| median / 0.6745 / (7.0_f64 / 6.0).sqrt())
    }
}

/// Sums over corners, weighted with areas, which a plane is fitted to.
#[derive(Clone, Copy)]
struct Moments {
    area: f64,
    first: DVec3,
    second: DMat3,
    normal: DVec3,
}

impl Moments {
    const NONE: Self = Self { area: 0.0, first: DVec3::ZERO, second: DMat3::ZERO, normal: DVec3::ZERO };

    fn add(&mut self, places: [DVec3; 3], area: DVec3) {
        let weight = area.length() / 3.0;
        for place in places {
            self.area += weight;
            self.first += weight * place;
            self.second += DMat3::from_cols(weight * place.x * place, weight * place.y * place, weight * place.z * place);
        }
        self.normal += if self.normal.dot(area) < 0.0 { -area } else { area };
    }

    fn with(mut self, other: &Self) -> Self {
        self.area += other.area;
        self.first += other.first;
        self.second += other.second;
        self.normal += if self.normal.dot(other.normal) < 0.0 { -other.normal } else { other.normal };
        self
    }

    /// The plane that the corners lie about: its normal and a point on it.
    fn plane(&self) -> (DVec3, DVec3) {
        let middle = self.first / self.area;
        let spread =
            self.second * (1.0 / self.area) - DMat3::from_cols(middle.x * middle, middle.y * middle, middle.z * middle);
        let trace = spread.x_axis.x + spread.y_axis.y + spread.z_axis.z;
        let inverse = (spread + DMat3::from_diagonal(DVec3::splat(1e-9 * trace.max(f64::MIN_POSITIVE)))).inverse();
        let mut normal = self.normal.normalize_or(DVec3::Z);
        for _ in 0..30 {
            let next = (inverse * normal).try_normalize().filter(|n| n.is_finite());
            let Some(next) = next else { break };
            normal = next;
        }
        (normal, middle)
    }
}

struct Growth<'a> {
    welded: &'a Welded,
    within_m: f64,
    /// Where vertices are, about the middle of the mesh, and in the end where they are moved to.
    places: Vec<DVec3>,
    middle: DVec3,
    /// By triangle: normal times area, smoothed normal.
    areas: Vec<DVec3>,
    smooth: Vec<DVec3>,
    /// By triangle, the plane that it is on.
    of: Vec<u32>,
    planes: Vec<Moments>,
}

impl<'a> Growth<'a> {
    fn new(welded: &'a Welded, within_m: f64) -> Self {
        let count = welded.places.len().max(1) as f64;
        let middle = welded.places.iter().sum::<DVec3>() / count;
        let areas: Vec<DVec3> = (0..welded.corners.len()).map(|t| welded.area(t)).collect();
        let mut smooth: Vec<DVec3> = areas.iter().map(|area| area.normalize_or_zero()).collect();
        for _ in 0..SMOOTHED {
            let sum = |t: usize| {
                let own = smooth[t];
                let others = welded.beside[t].iter().map(|other| *other as usize);
                let sum = others.fold(own * areas[t].length(), |sum, other| {
                    let along = own.dot(smooth[other]);
                    if along.abs() > NEIGHBOUR { sum + along.signum() * areas[other].length() * smooth[other] } else { sum }
                });
                sum.normalize_or(own)
            };
            smooth = (0..areas.len()).map(sum).collect();
        }
        let places = welded.places.iter().map(|place| *place - middle).collect();
        Self { welded, within_m, places, middle, of: vec![NONE; areas.len()], areas, smooth, planes: Vec::new() }
    }

    fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.welded.corners[triangle].map(|v| self.places[v as usize])
    }

    /// Whether a facet is of a plane.
    fn fits(&self, triangle: usize, (normal, point): (DVec3, DVec3)) -> bool {
        let own = self.areas[triangle];
        let off = self.corners(triangle).map(|corner| normal.dot(corner - point));
        self.smooth[triangle].dot(normal).abs() > ALONG
            && own.dot(normal).abs() >= OWN * own.length()
            && off.iter().all(|off| off.abs() < self.within_m)
    }

    fn grow(&mut self) {
        // How well each facet agrees with those around it; where all do, a wall is.
        let agreement = |t: usize| {
            let others = self.welded.beside[t].iter().map(|other| self.smooth[t].dot(self.smooth[*other as usize]).abs());
            others.fold(1.0, f64::min) + 1e-3 * (self.areas[t].length() / self.within_m.powi(2)).min(1.0)
        };
        let mut order: Vec<(f64, usize)> = (0..self.areas.len()).map(|t| (agreement(t), t)).collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut tried = vec![false; self.areas.len()];
        for (_, seed) in order {
            if self.of[seed] != NONE || tried[seed] || self.smooth[seed] == DVec3::ZERO {
                continue;
            }
            let found = self.region(seed);
            let moments = self.moments(&found);
            let enough = found.len() >= LEAST_FACETS && moments.area > LEAST_AREA * self.within_m.powi(2);
            if enough {
                let number = self.planes.len() as u32;
                found.iter().for_each(|t| self.of[*t] = number);
                self.planes.push(moments);
            } else {
                found.iter().for_each(|t| tried[*t] = true);
            }
            tried[seed] = true;
        }
    }

    fn moments(&self, triangles: &[usize]) -> Moments {
        let mut sum = Moments::NONE;
        triangles.iter().for_each(|t| sum.add(self.corners(*t), self.areas[*t]));
        sum
    }

    /// The facets about a seed's plane, which is fitted anew as they become more.
    fn region(&self, seed: usize) -> Vec<usize> {
        let near = self.ring(seed);
        let first = self.moments(&near);
        let mut plane = (self.smooth[seed], first.first / first.area.max(f64::MIN_POSITIVE));
        let mut region = Vec::new();
        for _ in 0..3 {
            region = self.flood(seed, &mut plane);
            if region.len() < LEAST_FACETS {
                break;
            }
        }
        region
    }

    fn ring(&self, seed: usize) -> Vec<usize> {
        let mut ring = vec![seed];
        for _ in 0..3 {
            let more: Vec<usize> =
                ring.iter().flat_map(|t| self.welded.beside[*t].iter().map(|other| *other as usize)).collect();
            ring.extend(more);
            ring.sort_unstable();
            ring.dedup();
        }
        ring.retain(|t| self.smooth[*t].dot(self.smooth[seed]).abs() > ALONG);
        ring
    }

    fn flood(&self, seed: usize, plane: &mut (DVec3, DVec3)) -> Vec<usize> {
        let mut taken = rustc_hash::FxHashSet::default();
        taken.insert(seed);
        let mut region = vec![seed];
        let mut sum = Moments::NONE;
        sum.add(self.corners(seed), self.areas[seed]);
        let (mut at, mut fitted) = (0, 3 * LEAST_FACETS);
        while let Some(triangle) = region.get(at).copied() {
            for other in self.welded.beside[triangle].iter().map(|other| *other as usize) {
                if self.of[other] == NONE && !taken.contains(&other) && self.fits(other, *plane) {
                    taken.insert(other);
                    region.push(other);
                    sum.add(self.corners(other), self.areas[other]);
                }
            }
            at += 1;
            if region.len() >= fitted {
                *plane = sum.plane();
                fitted *= 2;
            }
        }
        if region.len() >= LEAST_FACETS {
            *plane = sum.plane();
        }
        region
    }

    /// Makes planes one that are nearly the same, the largest first.
    fn unite(&mut self) {
        let mut order: Vec<usize> = (0..self.planes.len()).collect();
        order.sort_by(|a, b| self.planes[*b].area.total_cmp(&self.planes[*a].area));
        let mut kept: Vec<Moments> = Vec::new();
        let mut numbers = vec![NONE; self.planes.len()];
        for plane in order {
            let own = self.planes[plane];
            let (normal, middle) = own.plane();
            let same = kept.iter().position(|other| {
                let (along, point) = other.plane();
                normal.dot(along).abs() > SAME
                    && along.dot(middle - point).abs() < 0.5 * self.within_m
                    && normal.dot(point - middle).abs() < self.within_m
            });
            let number = same.unwrap_or_else(|| {
                kept.push(Moments::NONE);
                kept.len() - 1
            });
            kept[number] = kept[number].with(&own);
            numbers[plane] = number as u32;
        }
        self.of.iter_mut().filter(|of| **of != NONE).for_each(|of| *of = numbers[*of as usize]);
        self.planes = kept;
    }

    /// Facets that stick out of a plane all around them belong to it.
    fn fill(&mut self) {
        for _ in 0..3 {
            for t in 0..self.of.len() {
                let beside = &self.welded.beside[t];
                let around = beside.first().map_or(NONE, |first| self.of[*first as usize]);
                if self.of[t] == NONE
                    && around != NONE
                    && beside.len() >= 2
                    && beside.iter().all(|b| self.of[*b as usize] == around)
                {
                    let (normal, point) = self.planes[around as usize].plane();
                    if self.corners(t).iter().all(|c| normal.dot(*c - point).abs() < 2.0 * self.within_m) {
                        self.of[t] = around;
                    }
                }
            }
        }
    }

    /// The planes with those parallel and square that noise has turned, the largest first: the images in walls that are nearly
    /// so lie nearly where one would.
    fn squared(&self) -> Vec<(DVec3, DVec3)> {
        let mut planes: Vec<(DVec3, DVec3)> = Vec::new();
        for plane in &self.planes {
            let (found, point) = plane.plane();
            // A plane may turn so far that its ends move by a part of what corners may be off.
            let least = (0.25 * self.within_m / plane.area.sqrt()).min(0.1);
            let along = planes.iter().map(|other| other.0).find(|other| other.cross(found).length() < least);
            let normal = along.unwrap_or_else(|| {
                let square = planes.iter().map(|other| other.0).filter(|other| other.dot(found).abs() < least);
                square.fold(found, |normal, other| (normal - normal.dot(other) * other).normalize())
            });
            let near = normal.cross(found).length() < 2.0 * least;
            planes.push((if near { normal } else { found }, point));
        }
        planes
    }

    /// Moves vertices to where their planes meet, the largest first.
    fn moved(&mut self) -> Flattened {
        let planes = self.squared();
        let mut on: Vec<Vec<u32>> = vec![Vec::new(); self.places.len()];
        let (mut facets, mut area, mut whole) = (0, 0.0, 0.0);
        for (t, corners) in self.welded.corners.iter().enumerate() {
            whole += self.areas[t].length();
            if self.of[t] == NONE {
                continue;
            }
            facets += 1;
            area += self.areas[t].length();
            for corner in corners {
                let on = &mut on[*corner as usize];
                if !on.contains(&self.of[t]) {
                    on.push(self.of[t]);
                }
            }
        }
        let (mut squares, mut count, mut most) = (0.0, 0_u32, 0.0_f64);
        for (place, on) in self.places.iter_mut().zip(&mut on) {
            // Planes are in the order of their areas.
            on.sort_unstable();
            let start = *place;
            let mut used: Vec<DVec3> = Vec::new();
            for (number, plane) in on.iter().map(|number| planes[*number as usize]).enumerate() {
                let (normal, point) = plane;
                let off = normal.dot(start - point);
                if number == 0 {
                    squares += off * off;
                    count += 1;
                }
                // Along what the planes before leave free.
                let free = used.iter().fold(normal, |free, used| free - free.dot(*used) * *used);
                if free.length() < APART {
                    continue;
                }
                let free = free.normalize();
                let step = normal.dot(*place - point) / normal.dot(free);
                if (*place - step * free).distance(start) < MOVED * self.within_m {
                    *place -= step * free;
                    used.push(free);
                }
            }
            most = most.max(place.distance(start));
        }
        self.places.iter_mut().for_each(|place| *place += self.middle);
        Flattened {
            noise_m: (squares / f64::from(count.max(1))).sqrt(),
            within_m: self.within_m,
            planes: self.planes.len(),
            facets: [facets, self.of.len()],
            area_share: if whole > 0.0 { area / whole } else { 0.0 },
            moved_m: most,
        }
    }
}
