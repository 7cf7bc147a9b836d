//! Measured responses as a scene holds them: without what its direct sound plays where each was measured.

use crate::bake::between::{Banded, Between, Gains, between};
use crate::bake::direct::WHOLE_S;
use crate::bake::kriging::Site;
use crate::bake::layout::Layout;
use crate::bake::room::{ResponseParts, Room};
use crate::signal::spectrum::at;
use crate::sources::responses::Response;
use half::f16;
use promenade_core::glam::Vec3;
use promenade_core::{Field, Lifted, MeasuredRoom, Pose, StftGrid};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::signal;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Taps before which the late part is not heard yet: the hops of its noise.
const LATE_BEFORE: usize = 8;
/// Energies between neighbours are met over so long in each band, and in some bands together, seconds; ...
const WINDOWS_S: [f64; 2] = [0.005, 0.001];
/// ... and in the bass that goes on after the taps.
const LOW_WINDOW_S: f64 = 0.04;
/// Places closer than this are one, metres.
const SAME_PLACE_M: f32 = 1e-3;

/// What a scene holds of one response.
struct Held {
    /// By ear, as long as the taps: without what the direct sound's filter plays.
    rest: [Vec<f32>; 2],
    low: [Vec<f32>; 2],
    lost: Option<[Vec<f32>; 2]>,
    late: Vec<f32>,
    distance: f32,
}

/// The responses, each times `gain`, and those between neighbours; of each what image sources play in its place, `lost`, from
/// its first hop on. `sites` are those of the layout and after them the mirror images of `origins`.
pub(crate) fn carried(
    measured: &[&Response],
    heard: &[ResponseParts],
    layout: &Layout,
    (sites, origins): (&[Site], &[usize]),
    (field, grid): (&Field, &StftGrid),
    (room, lost): (&Room, Option<&[[Vec<f32>; 2]]>),
    gain: f32,
) -> MeasuredRoom {
    let (taps, bands) = (room.shape.taps, room.bands.count());
    let low_step = MeasuredRoom::step_of(grid);
    let len = (taps + 1) * grid.hop;
    let mut held: Vec<Held> = (0..measured.len())
        .into_par_iter()
        .map(|response| {
            let start = heard[response].direct.arrival - grid.lead() as i64;
            let ears = [&measured[response].left, &measured[response].right];
            let whole = ears.map(|samples| -> Vec<f32> {
                (0..room.low_hops * grid.hop).map(|i| gain * at(samples, start + i as i64) as f32).collect()
            });
            let low = whole.each_ref().map(|whole| MeasuredRoom::bass_of(whole, low_step, grid, room.low_hops));
            let mut rest = whole.map(|ear| sized(&ear, len));
            for (rest, played) in rest.iter_mut().zip(played(field, &layout.poses[response], grid, len)) {
                // What the filter has after its hop is taken off there.
                rest.iter_mut().zip(played).for_each(|(x, played)| *x -= played);
            }
            let lost = lost.map(|lost| lost[response].each_ref().map(|ear| sized(ear, len)));
            let late = heard[response].late.iter().map(|g| gain * *g as f32).collect();
            Held { rest, low, lost, late, distance: layout.distances[response] }
        })
        .collect();
    let site = |site: &Site, response: usize| promenade_core::Site {
        direction: site.direction,
        position: site.position,
        response: response as u32,
    };
    let mut all: Vec<_> = sites.iter().zip(origins).map(|(s, origin)| site(s, *origin)).collect();
    let between = between(sites, origins);
    let mut pairs: Vec<[usize; 2]> = between.iter().map(|between| between.of).collect();
    pairs.sort_unstable();
    pairs.dedup();
    for Between { of, site: place } in &between {
        all.extend(pairs.binary_search(of).ok().map(|pair| site(place, measured.len() + pair)));
    }
    let made: Vec<Held> = pairs.par_iter().map(|pair| halfway(pair.map(|i| &held[i]), grid)).collect();
    held.extend(made);
    for Held { rest, lost, distance, .. } in &mut held {
        let first = rest.iter_mut().chain(lost.iter_mut().flatten()).flat_map(|ear| &mut ear[..grid.hop]);
        first.for_each(|x| *x *= *distance);
    }
    let first = taps.saturating_sub(LATE_BEFORE);
    let before = |tap: usize| room.late_unit.iter().flat_map(move |ear| ear[tap + 1].iter().map(|energy| *energy as f32));
    MeasuredRoom {
        sites: all,
        samples: halved(held.iter().flat_map(|held| &held.rest).flatten().copied().collect()),
        low: halved(held.iter().flat_map(|held| &held.low).flatten().copied().collect()),
        low_step,
        low_hops: room.low_hops,
        late: held.iter().flat_map(|held| &held.late).copied().collect(),
        late_before: (first..taps).flat_map(before).collect(),
        gains: vec![1.0; 2 * bands],
        lifted: lost.map(|lost| lifted(lost, &held, layout, taps, grid)),
    }
}

/// What is heard halfway between two responses.
fn halfway(pair: [&Held; 2], grid: &StftGrid) -> Held {
    let samples = |seconds: f64, rate_hz: f64| (seconds * rate_hz).round() as usize;
    let rate_hz = grid.sample_rate_hz;
    let (windows, from) = (WINDOWS_S.map(|s| samples(s, rate_hz)), grid.lead() + samples(WHOLE_S, rate_hz));
    let mut lost = pair[0].lost.is_some().then(Default::default);
    let split = |samples: &Vec<f32>| Banded::of(samples, rate_hz);
    let rests = [0, 1].map(|ear| pair.map(|held| split(&held.rest[ear])));
    let rest = [0, 1].map(|ear| {
        let gains = Gains::of(rests.each_ref().map(|pair| pair.each_ref()), ear, windows, from);
        if let (Some(lost), [Some(a), Some(b)]) = (&mut lost, pair.map(|held| &held.lost)) {
            let lost: &mut [Vec<f32>; 2] = lost;
            lost[ear] = gains.of_mix(&Banded::half_of([&split(&a[ear]), &split(&b[ear])]));
        }
        gains.of_mix(&Banded::half_of(rests[ear].each_ref()))
    });
    let low_hz = rate_hz / MeasuredRoom::step_of(grid) as f64;
    let lows = [0, 1].map(|ear| pair.map(|held| Banded::of(&held.low[ear], low_hz)));
    let low = [0, 1].map(|ear| {
        let gains = Gains::of(lows.each_ref().map(|pair| pair.each_ref()), ear, [samples(LOW_WINDOW_S, low_hz); 2], 0);
        gains.of_mix(&Banded::half_of(lows[ear].each_ref()))
    });
    let late = pair[0].late.iter().zip(&pair[1].late).map(|(a, b)| (0.5 * (a * a + b * b)).sqrt()).collect();
    Held { rest, low, lost, late, distance: 0.5 * (pair[0].distance + pair[1].distance) }
}

fn sized(samples: &[f32], len: usize) -> Vec<f32> {
    let mut sized = samples[..samples.len().min(len)].to_vec();
    sized.resize(len, 0.0);
    sized
}

/// What responses lose away from their places, `[response][ear][sample]`, cut to whole hops.
fn lifted(lost: &[[Vec<f32>; 2]], held: &[Held], layout: &Layout, taps: usize, grid: &StftGrid) -> Lifted {
    let longest = lost.iter().flatten().map(Vec::len).max().unwrap_or(0);
    let len = longest.div_ceil(grid.hop).clamp(1, taps + 1) * grid.hop;
    let ears = held.iter().flat_map(|held| &held.lost).flatten();
    let samples = ears.flat_map(|ear| &ear[..len]).copied();
    let mut places: Vec<Vec3> = Vec::new();
    for pose in &layout.poses {
        if !places.iter().any(|place| place.distance(pose.position) < SAME_PLACE_M) {
            places.push(pose.position);
        }
    }
    Lifted { places, samples: halved(samples.collect()) }
}

/// What the direct sound's filter plays at each ear at a pose, as many samples from its first hop on.
fn played(field: &Field, pose: &Pose, grid: &StftGrid, len: usize) -> [Vec<f32>; 2] {
    let direct = field.decode(pose);
    [-1.0, 1.0].map(|side: f32| {
        let phases = &direct.phase[if side < 0.0 { 0 } else { grid.bins() }..];
        let bin = |k: usize| {
            let gain = f64::from((1.0 + side * direct.difference[k]) * direct.mixture[k]);
            let delay = f64::from(side) * 0.5 * TAU * grid.bin_hz(k) * f64::from(direct.delay_s);
            Complex64::from_polar(gain, f64::from(phases[k]) + delay)
        };
        let filter = signal((0..grid.bins()).map(bin).collect(), grid.n_fft);
        // What comes before its time lies at the end.
        let sounds = (0..grid.lead() + grid.n_fft / 2).map(|i| filter[(i + grid.n_fft - grid.lead()) % grid.n_fft] as f32);
        sized(&sounds.collect::<Vec<f32>>(), len)
    })
}

/// As half floats keep them.
pub(crate) fn halved(values: Vec<f32>) -> Vec<f32> {
    values.into_iter().map(|v| f16::from_f32(v).to_f32()).collect()
}
