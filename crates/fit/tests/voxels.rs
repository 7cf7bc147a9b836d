//! Surfaces in voxels, and what pictures predict of those that no sound has met.
//!
//! The truth is a box whose walls are of two materials in squares, each at the very place where a way is mirrored, made by
//! unfolding straight lines: nothing of it is the product's.

use promenade_acoustics::Air;
use promenade_core::glam::{DMat3, DQuat, DVec3};
use promenade_core::network::Placement;
use promenade_fit::{
    BANDS, Clock, FlatRoom, FullFit, FullOptions, MaterialsBeside, Measurement, Measurements, Pictures, Place, Random, Raster,
    View, Voxels, Walls, full_fit, full_mesh,
};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::signal;
use promenade_paths::colmap::{Image, lenses};
use std::f64::consts::TAU;

const RATE: f64 = 16_000.0;
const SIZE: [f64; 3] = [5.2, 3.9, 2.7];
const SOURCE: [f64; 3] = [1.1, 1.3, 1.3];
const SQUARE_M: f64 = 1.3;
const ORDER: i32 = 6;

/// Whether the soft material is at a place: squares on all walls, whose number is odd.
fn is_soft(at: [f64; 3]) -> bool {
    let square = |a: usize| (at[a].clamp(1e-6, SIZE[a] - 1e-6) / SQUARE_M).floor() as i64;
    (square(0) + square(1) + square(2)) % 2 != 0
}

fn absorption(soft: bool, hz: f64) -> f64 {
    let at = ((hz / 100.0).ln() / 80f64.ln()).clamp(0.0, 1.0);
    if soft { 0.35 + 0.4 * at } else { 0.06 + 0.06 * at }
}

/// What a microphone hears: for each image the straight line to it, folded back into the box wherever it leaves it.
fn response(microphone: [f64; 3]) -> Vec<f32> {
    let length = 2048;
    let mut sum = vec![Complex64::default(); length / 2 + 1];
    let image = |a: usize, n: i32| f64::from(n) * SIZE[a] + if n % 2 == 0 { SOURCE[a] } else { SIZE[a] - SOURCE[a] };
    let all = -ORDER..=ORDER;
    for (i, j, k) in all.clone().flat_map(|i| all.clone().flat_map(move |j| (-ORDER..=ORDER).map(move |k| (i, j, k)))) {
        let n = [i, j, k];
        if n.iter().map(|n| n.abs()).sum::<i32>() > ORDER {
            continue;
        }
        let to: [f64; 3] = std::array::from_fn(|a| image(a, n[a]) - microphone[a]);
        let far = to.iter().map(|v| v * v).sum::<f64>().sqrt();
        let mut soft = [0, 0];
        for a in 0..3 {
            for crossed in 0..n[a].abs() {
                let plane = if n[a] > 0 { f64::from(crossed + 1) } else { -f64::from(crossed) } * SIZE[a];
                let share = (plane - microphone[a]) / to[a];
                let folded: [f64; 3] = std::array::from_fn(|c| {
                    let v = (microphone[c] + share * to[c]).rem_euclid(2.0 * SIZE[c]);
                    if v > SIZE[c] { 2.0 * SIZE[c] - v } else { v }
                });
                soft[usize::from(is_soft(folded))] += 1;
            }
        }
        for (bin, slot) in sum.iter_mut().enumerate() {
            let hz = bin as f64 * RATE / length as f64;
            let left = (1.0 - absorption(false, hz)).powi(soft[0]) * (1.0 - absorption(true, hz)).powi(soft[1]);
            let edge = ((7900.0 - hz) / 500.0).clamp(0.0, 1.0) * (hz / 60.0).powi(2) / (1.0 + (hz / 60.0).powi(2));
            let air = (-Air::default().db_per_m(hz) * far * std::f64::consts::LN_10 / 20.0).exp();
            *slot += Complex64::from_polar(edge * air * left.sqrt() / far, -TAU * hz * (far / 343.0 + 0.002));
        }
    }
    signal(sum, length).into_iter().take(1100).map(|v| v as f32).collect()
}

/// Microphones in one half of the room alone.
fn measured() -> Measurements {
    let mut random = Random::new(4, 0);
    let all = (0..9)
        .map(|i| {
            let half = [SIZE[0] / 2.0, SIZE[1], SIZE[2]];
            let at: [f64; 3] = half.map(|length| 0.4 + (length - 0.8) * random.uniform());
            let place = |at_m| Place { at_m, sd_m: 0.0, facing: None };
            Measurement {
                name: format!("{i}"),
                source: place(SOURCE),
                microphone: place(at),
                clock: Clock::Known,
                samples: response(at),
            }
        })
        .collect();
    Measurements { title: "squares".to_owned(), sample_rate_hz: RATE as u32, all, notes: Vec::new(), air: Air::default() }
}

/// What a camera in the room sees, soft squares dark and hard ones light, with grain.
fn view(at: DVec3, along: DVec3, random: &mut Random) -> View {
    const WIDE: usize = 96;
    let right = along.cross(DVec3::Z).normalize();
    let down = along.cross(right);
    let rotation = DQuat::from_mat3(&DMat3::from_cols(right, down, along).transpose());
    let text = format!("1 PINHOLE {WIDE} {WIDE} 48 48 48 48");
    let lens = lenses("cameras.txt", text.as_bytes()).unwrap()[&1];
    let mut values = Vec::new();
    for pixel in 0..WIDE * WIDE {
        let [x, y] = [pixel % WIDE, pixel / WIDE].map(|v| (v as f64 + 0.5 - 48.0) / 48.0);
        let way = along + x * right + y * down;
        let reach = (0..3).map(|a| ((if way[a] > 0.0 { SIZE[a] } else { 0.0 }) - at[a]) / way[a]).fold(f64::INFINITY, f64::min);
        let met = (at + reach * way).to_array();
        let soft = is_soft(met);
        let grain = 0.06 * random.normal();
        let colour = if soft { [0.35, 0.12, 0.1] } else { [0.8, 0.78, 0.72] };
        values.push(colour.map(|c: f64| (c + grain).clamp(0.0, 1.0) as f32));
    }
    let camera = Image { id: 0, name: String::new(), camera: 1, rotation, translation: -(rotation * at) };
    View { camera, lens, photo: Raster::new([WIDE, WIDE], values).unwrap() }
}

fn pictures() -> Pictures {
    let mut random = Random::new(9, 0);
    let ways = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::new(0.1, 0.0, 1.0), DVec3::new(0.1, 0.0, -1.0)];
    let views = [DVec3::new(1.6, 1.9, 1.4), DVec3::new(3.7, 2.1, 1.3)]
        .into_iter()
        .flat_map(|at| ways.map(|way| (at, way.normalize())))
        .map(|(at, way)| view(at, way, &mut random))
        .collect();
    Pictures { views, points: Vec::new(), placement: Placement::IDENTITY }
}

/// Mean distance from the truth over patches, bands from 300 Hz to 6 kHz: those that `of` names.
fn off(fit: &FullFit, of: impl Fn(usize) -> bool) -> f64 {
    let found = fit.voxels.as_ref().unwrap();
    let bands: Vec<usize> = (0..BANDS).filter(|b| (300.0..6000.0).contains(&fit.bands.centres_hz[*b])).collect();
    let (mut sum, mut count) = (0.0, 0.0);
    for (p, patch) in found.voxels.patches.iter().enumerate().filter(|(p, _)| of(*p)) {
        for b in &bands {
            sum += (found.absorption[p][*b].value - absorption(is_soft(patch.centre_m), fit.bands.centres_hz[*b])).abs();
            count += 1.0;
        }
    }
    sum / count
}

#[test]
fn surfaces_that_no_sound_has_met_are_guessed_from_those_that_look_alike() {
    let set = measured();
    let options =
        FullOptions { order: 4, window_s: 0.025, geometry: false, places: false, source: false, ..FullOptions::default() };
    let room = FlatRoom::of_box(Walls::of_size(SIZE).unwrap()).unwrap();
    let whole = full_fit(&room, &set, &options, &mut |_| ()).unwrap();
    let fitted = |pictures: Option<Pictures>| {
        let mut features = |room: &FlatRoom, voxels: &Voxels| match &pictures {
            Some(pictures) => pictures.features(room, voxels),
            None => Ok(vec![None; voxels.patches.len()]),
        };
        let mut shares = Vec::new();
        let fit = whole.in_voxels(&set, 0.44, 1, &mut features, &mut |share| shares.push(share)).unwrap();
        assert!(shares.is_sorted() && shares.iter().all(|s| (0.0..=1.0).contains(s)));
        fit
    };
    let [blind, seeing] = [None, Some(pictures())].map(fitted);
    let own = blind.voxels.as_ref().unwrap();
    let touched = |p: usize| own.is_touched(p);
    let count = (0..own.absorption.len()).filter(|p| touched(*p)).count();
    let [told, without, with] = [off(&blind, touched), off(&blind, |p| !touched(p)), off(&seeing, |p| !touched(p))];
    println!(
        "{} patches, {count} touched: off by {told:.3}; others {without:.3}, with pictures {with:.3}",
        own.absorption.len()
    );
    let met = off(&seeing, touched);
    println!("met and shown: {met:.3}; left {:.3} of {:.3}", seeing.left, whole.left);
    assert!((20..own.absorption.len() / 2).contains(&count), "{count} of {}", own.absorption.len());
    assert!(without > 0.17, "what no sound has met is not known without pictures: {without}");
    assert!(with < 0.13 && with < 0.65 * without, "{with} {without}");
    assert!(met <= told, "pictures do not pull at what sound tells: {met} {told}");
    assert!(seeing.left < 0.9 * whole.left);
    // Written for other commands: patches in groups of their surface.
    let mesh = full_mesh(&seeing).unwrap();
    let beside = MaterialsBeside::of(&seeing, &set, "test").unwrap();
    assert!(mesh.groups.iter().all(|group| beside.materials.contains_key(group)), "{:?}", mesh.groups);
    assert!(mesh.groups.contains(&"x0.1".to_owned()) && mesh.groups.len() <= 6 * 8, "{:?}", mesh.groups);
    let mut changed = seeing;
    changed.set_absorption(0, &[0.5; 7]);
    let again = changed.voxels.as_ref().unwrap();
    let is_changed = |p: usize| again.absorption[p][8].value == 0.5;
    assert!((0..again.absorption.len()).all(|p| is_changed(p) == (again.voxels.patches[p].surface == 0)));
}
