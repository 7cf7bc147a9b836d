//! Measured responses as a scene holds them: without what its direct sound plays where each was measured.

use crate::bake::kriging::Site;
use crate::bake::layout::Layout;
use crate::bake::room::{ResponseParts, Room};
use crate::signal::spectrum::at;
use crate::sources::responses::Response;
use half::f16;
use promenade_core::glam::Vec3;
use promenade_core::{Field, Lifted, MeasuredRoom, StftGrid, TransferFunction};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::signal;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Taps before which the late part is not heard yet: the hops of its noise.
const LATE_BEFORE: usize = 8;
/// Places closer than this are one, metres.
const SAME_PLACE_M: f32 = 1e-3;

/// The responses, each times `gain`, and of each what image sources play in its place, `lost`, from its first hop on; `sites`
/// are those of the layout and after them the mirror images of `origins`.
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
    let pieces: Vec<[Vec<f32>; 2]> = (0..2 * measured.len())
        .into_par_iter()
        .map(|i| {
            let (response, ear) = (i / 2, i % 2);
            let samples = if ear == 0 { &measured[response].left } else { &measured[response].right };
            let start = heard[response].direct.arrival - grid.lead() as i64;
            let whole = (0..room.low_hops * grid.hop).map(|i| gain * at(samples, start + i as i64) as f32);
            let mut whole: Vec<f32> = whole.collect();
            let low = MeasuredRoom::bass_of(&whole, low_step, grid, room.low_hops);
            whole.resize((taps + 1) * grid.hop, 0.0);
            let played = played(&field.decode(&layout.poses[response]), ear, grid);
            let distance = layout.distances[response];
            // What the filter has after its hop is taken off there.
            let sounds = grid.lead() + grid.n_fft / 2;
            for (i, x) in whole.iter_mut().enumerate().take(sounds) {
                *x -= played[(i + grid.n_fft - grid.lead()) % grid.n_fft];
            }
            whole[..grid.hop].iter_mut().for_each(|x| *x *= distance);
            [whole, low].map(halved)
        })
        .collect();
    let first = taps.saturating_sub(LATE_BEFORE);
    let before = |tap: usize| room.late_unit.iter().flat_map(move |ear| ear[tap + 1].iter().map(|energy| *energy as f32));
    MeasuredRoom {
        sites: sites
            .iter()
            .zip(origins)
            .map(|(site, origin)| promenade_core::Site {
                direction: site.direction,
                position: site.position,
                response: *origin as u32,
            })
            .collect(),
        samples: pieces.iter().flat_map(|[whole, _]| whole).copied().collect(),
        low: pieces.iter().flat_map(|[_, low]| low).copied().collect(),
        low_step,
        low_hops: room.low_hops,
        late: heard.iter().flat_map(|heard| heard.late.iter().map(|g| gain * *g as f32)).collect(),
        late_before: (first..taps).flat_map(before).collect(),
        gains: vec![1.0; 2 * bands],
        lifted: lost.map(|lost| lifted(lost, layout, taps, grid)),
    }
}

/// What responses lose away from their places, `[response][ear][sample]`, cut to whole hops.
fn lifted(lost: &[[Vec<f32>; 2]], layout: &Layout, taps: usize, grid: &StftGrid) -> Lifted {
    let longest = lost.iter().flatten().map(Vec::len).max().unwrap_or(0);
    let hops = longest.div_ceil(grid.hop).clamp(1, taps + 1);
    let samples = lost.iter().zip(&layout.distances).flat_map(|(ears, distance)| {
        ears.iter().flat_map(move |ear| {
            let at = |i: usize| ear.get(i).unwrap_or(&0.0) * if i < grid.hop { *distance } else { 1.0 };
            (0..hops * grid.hop).map(at)
        })
    });
    let mut places: Vec<Vec3> = Vec::new();
    for pose in &layout.poses {
        if !places.iter().any(|place| place.distance(pose.position) < SAME_PLACE_M) {
            places.push(pose.position);
        }
    }
    Lifted { places, samples: halved(samples.collect()) }
}

/// Samples of the direct sound's filter of one ear, those before its time at the end.
fn played(direct: &TransferFunction, ear: usize, grid: &StftGrid) -> Vec<f32> {
    let side = if ear == 0 { -1.0 } else { 1.0 };
    let bin = |k: usize| {
        let gain = f64::from((1.0 + side * direct.difference[k]) * direct.mixture[k]);
        let turn = f64::from(direct.phase[ear * grid.bins() + k]);
        Complex64::from_polar(gain, turn + f64::from(side) * 0.5 * TAU * grid.bin_hz(k) * f64::from(direct.delay_s))
    };
    signal((0..grid.bins()).map(bin).collect(), grid.n_fft).into_iter().map(|x| x as f32).collect()
}

/// As half floats keep them.
pub(crate) fn halved(values: Vec<f32>) -> Vec<f32> {
    values.into_iter().map(|v| f16::from_f32(v).to_f32()).collect()
}
