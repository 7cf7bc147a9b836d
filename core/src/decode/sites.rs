//! The measurements around a pose, and how much of each is heard there.

use crate::number::single;
use crate::scene::Site;
use crate::transfer::{MOST_SHARES, Shares};
use glam::Vec3;
use std::cmp::Ordering;
use std::ops::Range;

/// Measurements that are looked at: the nearest, ...
const NEAREST: usize = 16;
/// ... and in the nearest places the nearest directions of each.
const PLACES: usize = 8;
const PER_PLACE: usize = 4;
const CANDIDATES: usize = NEAREST + PLACES * PER_PLACE;
/// Coordinates of a measurement as seen from a pose: three of position, two of direction.
const COORDINATES: usize = 5;
/// What it costs not to be in the mean of the measurements that are mixed, over what their distances cost.
const CENTRED: f64 = 10.0;
/// A cost of uneven shares that keeps them from depending on rounding where measurements lie regularly.
const EVEN: f64 = 1e-3;
/// Measurements that are as far from a pose are taken to be apart by this share of their squared distance at least.
const APART: f64 = 0.01;
/// Measurements of one place are this close, metres.
const SAME_PLACE_M: f32 = 1e-3;
/// Shares below this grow with their square, ...
const STANDS_STILL: f64 = 0.25;
/// ... and begin here: smaller ones are not worth their work.
const SMALLEST: f32 = 0.005;

/// Where responses were measured, as a pose is looked up in.
///
/// Distances are angles between directions, radians, and metres between positions: one counts as much as the other. Directions
/// are compared by azimuth and elevation, in which a ring at one height is straight however far above or below it a pose is:
/// its shares stay those of the ring, until straight above or below no azimuth is nearer than another.
#[derive(Clone, Debug)]
pub(crate) struct Sites {
    /// By place.
    sites: Vec<Site>,
    places: Vec<(Vec3, Range<usize>)>,
}

/// A measurement as seen from a pose.
#[derive(Clone, Copy, Debug, Default)]
struct Candidate {
    site: usize,
    /// Squared distance.
    cost: f64,
    at: [f64; COORDINATES],
}

impl Sites {
    pub(crate) fn new(sites: &[Site]) -> Self {
        let key = |s: &Site| s.position.to_array();
        let mut sites = sites.to_vec();
        sites.sort_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(Ordering::Equal));
        let mut places: Vec<(Vec3, Range<usize>)> = Vec::new();
        for (i, site) in sites.iter().enumerate() {
            match places.last_mut() {
                Some((at, range)) if at.distance(site.position) < SAME_PLACE_M => range.end = i + 1,
                _ => places.push((site.position, i..i + 1)),
            }
        }
        Self { sites, places }
    }

    /// Responses with their shares at a place from which the emitter is seen in a direction, where the direct sound has a gain.
    ///
    /// Shares `w` are the ones that make `10 |sum w x|^2 + sum w |x|^2` least, with `x` the measurements' places as seen from
    /// the pose: near ones, around it. They do not jump as the pose moves, and are 1 at a measurement.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn at(&self, direction: Vec3, position: Vec3, direct_gain: f32) -> Shares {
        let mut shares = Shares::none(direct_gain);
        let (mut found, count) = self.candidates(direction, position);
        let mut mix = Mix::of(&mut found[..count]);
        mix.solve();
        for (member, weight) in mix.members() {
            // They stand still at each measurement: neighbouring responses are unlike, and a corner in their mix would be heard
            // as a modulation while the listener turns.
            let share = single(weight * weight / (weight + STANDS_STILL));
            let above = (share - SMALLEST).max(0.0);
            if above > 0.0 {
                shares.add(self.sites[mix.found[member].site].response, above * above / share);
            }
        }
        shares.normalise();
        shares
    }

    /// The measurements that may be mixed at a pose, and how many they are.
    fn candidates(&self, direction: Vec3, position: Vec3) -> ([Candidate; CANDIDATES], usize) {
        let mut near = Nearest::<NEAREST>::default();
        for (i, site) in self.sites.iter().enumerate() {
            near.add(i, site.direction.distance_squared(direction) + site.position.distance_squared(position));
        }
        let mut all = [0; CANDIDATES];
        let mut count = 0;
        for (site, _) in near.entries() {
            all[count] = *site;
            count += 1;
        }
        if self.places.len() > 1 {
            let mut places = Nearest::<PLACES>::default();
            for (i, (at, _)) in self.places.iter().enumerate() {
                places.add(i, at.distance_squared(position));
            }
            for (place, _) in places.entries() {
                let mut of_place = Nearest::<PER_PLACE>::default();
                for site in self.places[*place].1.clone() {
                    of_place.add(site, self.sites[site].direction.distance_squared(direction));
                }
                for (site, _) in of_place.entries() {
                    if !all[..count].contains(site) {
                        all[count] = *site;
                        count += 1;
                    }
                }
            }
        }
        let elevation = elevation_of(direction);
        let mut found = [Candidate::default(); CANDIDATES];
        for (candidate, site) in found.iter_mut().zip(&all[..count]) {
            let Site { direction: seen, position: from, .. } = self.sites[*site];
            let beside = from - position;
            let (here, there) = (direction.truncate(), seen.truncate());
            let along = there.length() * here.perp_dot(there).atan2(here.dot(there));
            let at = [beside.x, beside.y, beside.z, along, elevation_of(seen) - elevation].map(f64::from);
            *candidate = Candidate { site: *site, cost: at.iter().map(|x| x * x).sum(), at };
        }
        (found, count)
    }

    /// Pairs of responses that may be heard together: each with those that were measured around it.
    pub(crate) fn pairs(&self) -> Vec<(u32, u32)> {
        let mut pairs = Vec::new();
        for site in &self.sites {
            let (found, count) = self.candidates(site.direction, site.position);
            for other in &found[..count] {
                let (a, b) = (site.response, self.sites[other.site].response);
                if a != b {
                    pairs.push((a.min(b), a.max(b)));
                }
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }
}

/// Elevation of a direction, radians.
fn elevation_of(direction: Vec3) -> f32 {
    direction.z.atan2(direction.truncate().length())
}

/// The `N` smallest of some numbers.
struct Nearest<const N: usize> {
    found: [(usize, f32); N],
    count: usize,
}

impl<const N: usize> Default for Nearest<N> {
    fn default() -> Self {
        Self { found: [(0, f32::INFINITY); N], count: 0 }
    }
}

impl<const N: usize> Nearest<N> {
    fn add(&mut self, index: usize, distance: f32) {
        if self.count == N && distance.partial_cmp(&self.found[N - 1].1) != Some(Ordering::Less) {
            return;
        }
        self.count = (self.count + 1).min(N);
        let mut at = self.count - 1;
        while at > 0 && self.found[at - 1].1 > distance {
            self.found[at] = self.found[at - 1];
            at -= 1;
        }
        self.found[at] = (index, distance);
    }

    fn entries(&self) -> &[(usize, f32)] {
        &self.found[..self.count]
    }
}

/// The most unknowns of a system of equations: a share each, and the multiplier of their sum.
const UNKNOWNS: usize = MOST_SHARES + 1;

/// A mix of candidates: the least of a quadratic form over shares that are not negative and sum to 1, by the method of active
/// sets (Nocedal and Wright 2006, section 16.5).
struct Mix<'a> {
    found: &'a mut [Candidate],
    members: [(usize, f64); MOST_SHARES],
    count: usize,
}

impl<'a> Mix<'a> {
    /// Begins with the nearest alone. Coordinates are scaled by the distance of those around it, so that dense measurements are
    /// mixed as sparse ones are, and those far from the pose as those around it.
    fn of(found: &'a mut [Candidate]) -> Self {
        let mut costs = Nearest::<{ COORDINATES }>::default();
        found.iter().enumerate().for_each(|(i, c)| costs.add(i, single(c.cost)));
        let nearest = costs.entries().first().map_or(0, |e| e.0);
        let [least, most] = [costs.entries().first(), costs.entries().last()].map(|e| e.map_or(1.0, |e| f64::from(e.1)));
        let scale = (most - least).max(APART * most).max(1e-9);
        for candidate in found.iter_mut() {
            candidate.cost /= scale;
            candidate.at.iter_mut().for_each(|x| *x /= scale.sqrt());
        }
        let mut members = [(0, 0.0); MOST_SHARES];
        members[0] = (nearest, 1.0);
        Self { count: found.len().min(1), found, members }
    }

    fn members(&self) -> impl Iterator<Item = (usize, f64)> + use<> {
        let members = self.members;
        members.into_iter().take(self.count)
    }

    fn solve(&mut self) {
        for _ in 0..4 * MOST_SHARES {
            if self.count == 0 || self.count == MOST_SHARES {
                return;
            }
            let Some(next) = self.most_wanted() else { return };
            self.members[self.count] = (next, 0.0);
            self.count += 1;
            self.settle();
            if !self.members().any(|(member, _)| member == next) {
                return;
            }
        }
    }

    /// The candidate whose share lessens the form most as it grows.
    fn most_wanted(&self) -> Option<usize> {
        let mut mean = [0.0; COORDINATES];
        for (member, weight) in self.members() {
            mean.iter_mut().zip(&self.found[member].at).for_each(|(m, x)| *m += weight * x);
        }
        let slope = |i: usize| {
            let c = &self.found[i];
            2.0 * CENTRED * c.at.iter().zip(&mean).map(|(x, m)| x * m).sum::<f64>() + c.cost
        };
        let own: f64 = self.members().map(|(member, weight)| weight * (slope(member) + 2.0 * EVEN * weight)).sum();
        let others = (0..self.found.len()).filter(|i| self.members().all(|(member, _)| member != *i));
        let best = others.map(|i| (i, slope(i))).min_by(|a, b| a.1.total_cmp(&b.1))?;
        (best.1 < own - 1e-9).then_some(best.0)
    }

    /// Moves the members' shares to the least, and leaves out those that would have less than none on the way.
    fn settle(&mut self) {
        while self.count > 1 {
            let Some(wanted) = self.least() else { return };
            let mut step = 1.0;
            let mut leaves = None;
            for (i, (member, wanted)) in self.members[..self.count].iter().zip(&wanted).enumerate() {
                if *wanted <= 0.0 {
                    let until = member.1 / (member.1 - wanted).max(1e-300);
                    if until < step || leaves.is_none() {
                        (step, leaves) = (until.min(step), Some(i));
                    }
                }
            }
            for (member, wanted) in self.members[..self.count].iter_mut().zip(wanted) {
                member.1 += step * (wanted - member.1);
            }
            let Some(leaver) = leaves else { return };
            self.count -= 1;
            self.members[leaver] = self.members[self.count];
        }
        self.members[0].1 = 1.0;
    }

    /// Shares of the members at which the form is least, of either sign.
    fn least(&self) -> Option<[f64; MOST_SHARES]> {
        let n = self.count;
        let mut system = [[0.0; UNKNOWNS + 1]; UNKNOWNS];
        for (i, (a, _)) in self.members[..n].iter().enumerate() {
            let a = &self.found[*a];
            for (j, (b, _)) in self.members[..n].iter().enumerate() {
                let product: f64 = a.at.iter().zip(&self.found[*b].at).map(|(x, y)| x * y).sum();
                system[i][j] = 2.0 * CENTRED * product + if i == j { 2.0 * EVEN } else { 0.0 };
            }
            system[i][n] = 1.0;
            system[n][i] = 1.0;
            system[i][n + 1] = -a.cost;
        }
        system[n][n + 1] = 1.0;
        let solved = eliminate(&mut system, n + 1)?;
        let mut shares = [0.0; MOST_SHARES];
        shares[..n].copy_from_slice(&solved[..n]);
        Some(shares)
    }
}

/// Solves the first `n` equations, whose right sides follow the `n` coefficients, by Gaussian elimination with pivoting.
fn eliminate(system: &mut [[f64; UNKNOWNS + 1]; UNKNOWNS], n: usize) -> Option<[f64; UNKNOWNS]> {
    for column in 0..n {
        let pivot = (column..n).max_by(|a, b| system[*a][column].abs().total_cmp(&system[*b][column].abs()))?;
        if system[pivot][column].abs() < 1e-12 {
            return None;
        }
        system.swap(column, pivot);
        let row = system[column];
        for other in system[column + 1..n].iter_mut() {
            let factor = other[column] / row[column];
            other.iter_mut().zip(&row).take(n + 1).skip(column).for_each(|(o, r)| *o -= factor * r);
        }
    }
    let mut out = [0.0; UNKNOWNS];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| system[i][j] * out[j]).sum();
        out[i] = (system[i][n] - known) / system[i][i];
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::f32::consts::TAU;

    fn towards(azimuth_deg: f32, elevation_deg: f32) -> Vec3 {
        let (a, e) = (azimuth_deg.to_radians(), elevation_deg.to_radians());
        Vec3::new(e.cos() * a.cos(), e.cos() * a.sin(), e.sin())
    }

    fn ring(step_deg: f32) -> Sites {
        let sites: Vec<Site> = (0..(360.0 / step_deg) as u32).map(|i| site(step_deg * i as f32, Vec3::ZERO, i)).collect();
        Sites::new(&sites)
    }

    /// The largest change of a share.
    fn change(before: &Shares, now: &Shares) -> f32 {
        let of = |shares: &Shares, response| shares.entries().iter().find(|e| e.0 == response).map_or(0.0, |e| e.1);
        let responses = before.entries().iter().chain(now.entries()).map(|e| e.0);
        responses.map(|response| (of(before, response) - of(now, response)).abs()).fold(0.0, f32::max)
    }

    fn site(azimuth_deg: f32, position: Vec3, response: u32) -> Site {
        Site { direction: towards(azimuth_deg, 0.0), position, response }
    }

    fn shares(sites: &Sites, azimuth_deg: f32, position: Vec3) -> Vec<(u32, f32)> {
        let mut found = sites.at(towards(azimuth_deg, 0.0), position, 1.0).entries().to_vec();
        found.sort_by_key(|e| e.0);
        found
    }

    /// Poses of any place and direction in a room of 5 x 4 m.
    fn walk(count: u32) -> Vec<Site> {
        let mut random = Random::new(5);
        let place = |i| {
            let position = Vec3::new(5.0 * random.uniform(), 4.0 * random.uniform(), 1.5);
            site(360.0 * random.uniform(), position, i)
        };
        (0..count).map(place).collect()
    }

    #[test]
    fn a_measurement_is_heard_alone_where_it_was_made() {
        let walk = walk(200);
        let sites = Sites::new(&walk);
        for s in &walk {
            assert_eq!(sites.at(s.direction, s.position, 1.0).entries(), [(s.response, 1.0)]);
        }
    }

    #[test]
    fn between_two_of_a_ring_both_are_heard_and_no_others() {
        for step in [2.5, 10.0, 45.0, 90.0] {
            let found = shares(&ring(step), 1.5 * step, Vec3::ZERO);
            assert_eq!(found.len(), 2, "every {step} degrees: {found:?}");
            for (response, share) in found {
                assert!((1..3).contains(&response) && (share - 0.5).abs() < 1e-3, "{step}: {response} {share}");
            }
        }
    }

    #[test]
    fn above_and_below_a_ring_its_shares_stay() {
        for step in [2.5, 10.0, 45.0] {
            let sites = ring(step);
            for azimuth in [0.0, 0.25 * step, 0.5 * step, 93.0, 201.0] {
                let beside = sites.at(towards(azimuth, 0.0), Vec3::ZERO, 1.0);
                for (elevation, height) in [(10.0, 0.0), (-24.0, -0.7), (30.0, 0.7), (-45.0, 0.0), (60.0, 0.0)] {
                    let found = sites.at(towards(azimuth, elevation), Vec3::new(0.0, 0.0, height), 1.0);
                    assert!(change(&beside, &found) < 0.02, "every {step}, {azimuth} {elevation}: {:?}", found.entries());
                }
            }
        }
    }

    #[test]
    fn shares_do_not_jump_as_the_head_nods_and_tilts() {
        for step in [10.0, 45.0] {
            let sites = ring(step);
            let at = |t: f32| sites.at(towards(40.0 * t, 80.0 * (TAU * t).sin()), Vec3::ZERO, 1.0);
            let mut before = at(0.0);
            for i in 1..10_000 {
                let now = at(i as f32 * 1e-4);
                let jump = change(&before, &now);
                assert!(jump < 2e-3, "every {step}, {i}: {jump}");
                before = now;
            }
        }
    }

    #[test]
    fn between_two_places_the_directions_of_both_are_heard() {
        let places = [Vec3::ZERO, Vec3::X];
        let rings: Vec<Site> = (0..144).map(|i| site(5.0 * (i / 2) as f32, places[i as usize % 2], i)).collect();
        let sites = Sites::new(&rings);
        for (along, least) in [(0.2, 0.05), (0.5, 0.3), (0.8, 0.05)] {
            let found = shares(&sites, 22.0, Vec3::new(along, 0.0, 0.0));
            let of = |place: u32| found.iter().filter(|e| e.0 % 2 == place).map(|e| e.1).sum::<f32>();
            assert!(of(0) > least && of(1) > least, "{along}: {found:?}");
            assert!(found.iter().all(|e| e.0 / 2 == 4 || e.0 / 2 == 5), "{along}: {found:?}");
        }
    }

    #[test]
    fn shares_do_not_jump_on_the_way() {
        let sites = Sites::new(&walk(200));
        let at = |t: f32| sites.at(towards(90.0 * t, 0.0), Vec3::new(0.5 + t, 0.7 + 0.7 * t, 1.5), 1.0);
        let mut before = at(0.0);
        let mut largest = 0.0_f32;
        for i in 1..20_000 {
            let now = at(i as f32 * 2e-4);
            largest = largest.max(change(&before, &now));
            before = now;
        }
        // A millimetre on.
        assert!(largest < 0.02, "{largest}");
    }

    #[test]
    fn far_away_the_nearest_places_go_on() {
        let sites = Sites::new(&walk(50));
        let found = sites.at(towards(10.0, 0.0), Vec3::new(40.0, -30.0, 1.5), 1.0);
        assert!((found.entries().iter().map(|e| e.1).sum::<f32>() - 1.0).abs() < 1e-5);
        let not = sites.at(Vec3::NAN, Vec3::NAN, 1.0);
        assert!(not.entries().iter().all(|e| e.0 < 50));
    }
}
