//! The bass by waves, beside the modes of a box.

use crate::common::{L_SOURCE, l_room};
use promenade_acoustics::{LowField, LowPlaces, LowResponse, Material, Room, Shoebox, WaveOptions, waves};
use promenade_fourier::{forward, signal};

const SPEED_M_S: f64 = 343.0;

fn box_of(absorption: f32) -> Shoebox {
    Shoebox { size: [3.0, 4.0, 2.5], materials: std::array::from_fn(|_| Material::even("wall", absorption, 0.0)) }
}

/// Energy by bin of the pressure from 20 to 200 Hz, and the bins' distance, Hz.
fn spectrum(response: &LowResponse, rate_hz: f64) -> (Vec<f64>, f64) {
    let n = 1 << 15;
    let plan = forward(n);
    let mut padded = plan.make_input_vec();
    padded[..response.pressure.len()].copy_from_slice(&response.pressure);
    let mut bins = plan.make_output_vec();
    plan.process(&mut padded, &mut bins).unwrap();
    (bins.iter().map(|x| f64::from(x.norm_sqr())).collect(), rate_hz / n as f64)
}

fn thirds_db(energies: &[f64], step_hz: f64) -> Vec<f64> {
    (13..=23)
        .map(|n| {
            let centre = 10.0_f64.powf(f64::from(n) / 10.0);
            let [low, high] = [-1.0, 1.0].map(|side: f64| (centre * 10.0_f64.powf(0.05 * side) / step_hz) as usize);
            10.0 * (energies[low..high].iter().sum::<f64>()).log10()
        })
        .collect()
}

/// Correlation of levels by frequency from 20 to 200 Hz.
fn correlation(a: &[f64], b: &[f64], step_hz: f64) -> f64 {
    let range = (20.0 / step_hz) as usize..(200.0 / step_hz) as usize;
    let of = |e: &[f64]| -> Vec<f64> {
        let all: Vec<f64> = e[range.clone()].iter().map(|e| e.log10()).collect();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        all.iter().map(|v| v - mean).collect()
    };
    let (a, b) = (of(a), of(b));
    let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
    dot(&a, &b) / (dot(&a, &a) * dot(&b, &b)).sqrt()
}

/// T20 of what a crossover at 200 Hz leaves of a response, seconds.
fn t20_s(response: &LowResponse, rate_hz: f64) -> f64 {
    let n = 1 << 13;
    let mut bins = promenade_fourier::spectrum(response.pressure.iter().copied(), n);
    for (k, bin) in bins.iter_mut().enumerate() {
        *bin *= (1.0 + (k as f64 * rate_hz / n as f64 / 200.0).powi(4)).recip() as f32;
    }
    let mut left = 0.0;
    let mut levels: Vec<f64> = signal(bins, n)[..response.pressure.len()]
        .iter()
        .rev()
        .map(|x| {
            left += f64::from(*x).powi(2);
            10.0 * left.log10()
        })
        .collect();
    levels.reverse();
    let at = |db: f64| levels.iter().position(|level| *level < levels[0] + db).unwrap() as f64 / rate_hz;
    3.0 * (at(-25.0) - at(-5.0))
}

/// A box by the sum over its modes and by waves, at four places, and the seconds that waves took.
fn both(absorption: f32) -> (LowField, LowField, f64) {
    let shoebox = box_of(absorption);
    let source = [0.6, 0.9, 1.1];
    let axes = [vec![2.2, 1.0], vec![3.1], vec![1.4, 1.9]];
    let (length_s, top_hz) = (2.0, 400.0);
    let low = LowPlaces { axes: axes.clone(), top_hz, length_s, speed_m_s: SPEED_M_S };
    let modal = shoebox.low_field(source, &low).unwrap();
    let places: Vec<[f64; 3]> = axes[2].iter().flat_map(|z| axes[0].iter().map(|x| [*x, axes[1][0], *z])).collect();
    let mesh = shoebox.mesh().unwrap();
    let room = Room::new(&mesh, &shoebox.materials).unwrap();
    let options = WaveOptions { top_hz, length_s, speed_m_s: SPEED_M_S, cells_a_wave: 0.0 };
    let start = std::time::Instant::now();
    let field = waves(&room, source, &places, &options, |_| ()).unwrap();
    (modal, field, start.elapsed().as_secs_f64())
}

/// How far one signal is off another, as a share of it.
fn off(wanted: &[f32], found: &[f32]) -> f32 {
    let error: f32 = wanted.iter().zip(found).map(|(a, b)| (a - b).powi(2)).sum();
    (error / wanted.iter().map(|a| a * a).sum::<f32>()).sqrt()
}

#[test]
fn a_box_by_waves_has_the_modes_of_the_box() {
    for absorption in [0.05, 0.15, 0.4] {
        let (modal, found, seconds) = both(absorption);
        let rate = modal.rate_hz;
        for (modal, found) in modal.places.iter().zip(&found.places) {
            let ((a, step), (b, _)) = (spectrum(modal, rate), spectrum(found, rate));
            let thirds: Vec<f64> = thirds_db(&a, step).iter().zip(thirds_db(&b, step)).map(|(a, b)| b - a).collect();
            let rms = (thirds.iter().map(|d| d * d).sum::<f64>() / thirds.len() as f64).sqrt();
            let decay = t20_s(found, rate) / t20_s(modal, rate) - 1.0;
            let r = correlation(&a, &b, step);
            println!(
                "{absorption}: {rms:.2} dB rms, r {r:.4}, decay {:+.1} % of {:.2} s, off {:.3} {:.3}, {seconds:.2} s",
                100.0 * decay,
                t20_s(modal, rate),
                off(&modal.pressure, &found.pressure),
                off(&modal.gradient[1], &found.gradient[1])
            );
            assert!(rms < 1.0 && decay.abs() < 0.05 && r > 0.98, "{absorption}: {thirds:.1?}");
        }
    }
}

/// The source's image in a corner, and the sum over modes near the source: what both are in free space is known.
#[test]
fn near_the_source_of_a_deaf_box_there_is_free_space() {
    let shoebox = Shoebox { size: [9.0, 8.0, 7.0], materials: std::array::from_fn(|_| Material::even("deaf", 0.95, 0.0)) };
    let source = [4.6, 4.1, 3.4];
    let axes = [vec![5.0], vec![4.3], vec![3.4]];
    let low = LowPlaces { axes, top_hz: 250.0, length_s: 0.5, speed_m_s: SPEED_M_S };
    let mut modal = shoebox.low_field(source, &low).unwrap();
    let mesh = shoebox.mesh().unwrap();
    let room = Room::new(&mesh, &shoebox.materials).unwrap();
    let options = WaveOptions { top_hz: 250.0, length_s: 0.5, speed_m_s: SPEED_M_S, cells_a_wave: 0.0 };
    let mut found = waves(&room, source, &[[5.0, 4.3, 3.4]], &options, |_| ()).unwrap();
    let energy = |field: &LowField| field.places[0].pressure.iter().map(|x| x * x).sum::<f32>();
    for field in [&mut modal, &mut found] {
        let before = energy(field);
        field.add_direct(-1.0, source, &[[5.0, 4.3, 3.4]], SPEED_M_S);
        let left = 10.0 * (energy(field) / before).log10();
        assert!(left < -17.0, "{left} dB");
    }
}

/// Walls that lie anywhere between cells, and a wall askew: the box turned in its cells has the same sound.
#[test]
fn a_box_askew_sounds_as_it_does_upright() {
    let shoebox = box_of(0.15);
    let (source, place) = ([0.6, 0.9, 1.1], [2.2, 3.1, 1.4]);
    let mut mesh = shoebox.mesh().unwrap();
    let options = WaveOptions { top_hz: 400.0, length_s: 1.0, speed_m_s: SPEED_M_S, cells_a_wave: 0.0 };
    let upright = waves(&Room::new(&mesh, &shoebox.materials).unwrap(), source, &[place], &options, |_| ()).unwrap();
    let (sine, cosine) = 0.5_f64.sin_cos();
    let turn = |[x, y, z]: [f64; 3]| [cosine * x - sine * y, sine * x + cosine * y, z];
    mesh.vertices.iter_mut().for_each(|v| *v = turn(*v));
    let askew = Room::new(&mesh, &shoebox.materials).unwrap();
    let askew = waves(&askew, turn(source), &[turn(place)], &options, |_| ()).unwrap();
    let rate = upright.rate_hz;
    let (a, b) = (&upright.places[0], &askew.places[0]);
    let decay = t20_s(b, rate) / t20_s(a, rate) - 1.0;
    let ((sa, step), (sb, _)) = (spectrum(a, rate), spectrum(b, rate));
    let thirds: Vec<f64> = thirds_db(&sa, step).iter().zip(thirds_db(&sb, step)).map(|(a, b)| b - a).collect();
    println!("askew: {thirds:.1?} dB, decay {:+.1} %, r {:.3}", 100.0 * decay, correlation(&sa, &sb, step));
    // A third in which the place lies near a node of its one mode is another everywhere.
    let mut off: Vec<f64> = thirds.iter().map(|d| d.abs()).collect();
    off.sort_by(f64::total_cmp);
    assert!(off[off.len() / 2] < 1.0 && decay.abs() < 0.06, "{thirds:.1?}");
}

/// Over a floor without walls there is the source and its image, and hardly anything comes back from where the floor ends.
#[test]
fn over_a_floor_there_is_the_source_and_its_image() {
    let shoebox = Shoebox { size: [9.0, 8.0, 3.0], materials: std::array::from_fn(|_| Material::even("floor", 0.02, 0.0)) };
    let (source, place) = ([4.6, 4.1, 0.5], [5.2, 3.6, 0.7]);
    let mut mesh = shoebox.mesh().unwrap();
    mesh.triangles.retain(|t| t.group == 4);
    let options = WaveOptions { top_hz: 250.0, length_s: 0.4, speed_m_s: SPEED_M_S, cells_a_wave: 0.0 };
    let mut found = waves(&Room::new(&mesh, &shoebox.materials).unwrap(), source, &[place], &options, |_| ()).unwrap();
    let energy = |field: &LowField| field.places[0].pressure.iter().map(|x| x * x).sum::<f32>();
    let before = energy(&found);
    found.add_direct(-1.0, source, &[place], SPEED_M_S);
    let reflected = energy(&found);
    found.add_direct(-1.0, [source[0], source[1], -source[2]], &[place], SPEED_M_S);
    let db = |energy: f32| 10.0 * (energy / before).log10();
    println!("without the source {:.1} dB, without its image {:.1} dB", db(reflected), db(energy(&found)));
    assert!(db(reflected) > -9.0 && db(energy(&found)) < -9.0);
}

#[test]
fn an_l_shaped_room_is_that_of_cells_of_a_quarter() {
    let room = Room::new(&l_room(), &[Material::even("wall", 0.15, 0.0)]).unwrap();
    // The last is round the corner.
    let places = [[2.1, 2.2, 1.4], [0.9, 1.1, 1.7], [5.1, 1.4, 1.6]];
    let of = |cells_a_wave: f64| {
        let options = WaveOptions { top_hz: 200.0, length_s: 1.2, speed_m_s: SPEED_M_S, cells_a_wave };
        waves(&room, L_SOURCE, &places, &options, |_| ()).unwrap()
    };
    let (coarse, fine) = (of(0.0), of(24.0));
    for (found, wanted) in coarse.places.iter().zip(&fine.places) {
        let ((a, step), (b, _)) = (spectrum(wanted, fine.rate_hz), spectrum(found, coarse.rate_hz));
        let thirds: Vec<f64> = thirds_db(&a, step).iter().zip(thirds_db(&b, step)).map(|(a, b)| b - a).collect();
        let rms = (thirds.iter().map(|d| d * d).sum::<f64>() / thirds.len() as f64).sqrt();
        let (decay, r) = (t20_s(found, coarse.rate_hz) / t20_s(wanted, fine.rate_hz) - 1.0, correlation(&a, &b, step));
        println!("L-room: {rms:.2} dB rms, r {r:.4}, decay {:+.1} %, {thirds:.1?}", 100.0 * decay);
        assert!(rms < 1.0 && decay.abs() < 0.05 && r > 0.95, "{thirds:.1?}");
    }
}
