//! What particles in a box find, against what is known of it.

#![expect(clippy::unwrap_used, reason = "a test helper may panic")]

use promenade_acoustics::{
    Air, BoxImage, Echogram, Material, ParticleOptions, Reflected, SPEED_OF_SOUND_M_S, Shoebox, box_images,
};

const SIZE: [f64; 3] = [7.0, 5.0, 3.0];
const SOURCE: [f64; 3] = [3.1, 2.3, 1.9];
const DIRECT: [BoxImage; 1] = [BoxImage { rooms: [0; 3] }];

fn walls(absorption: f32, scattering: f32) -> Shoebox {
    Shoebox { size: SIZE, materials: std::array::from_fn(|_| Material::even("wall", absorption, scattering)) }
}

fn options(length_s: f64) -> ParticleOptions {
    ParticleOptions { particles: 4096, length_s, bin_s: 0.0025, cells: [3, 2, 1], air: None, seed: 1 }
}

fn mean(echograms: &[Echogram]) -> Vec<f64> {
    let energy = |i: usize| echograms.iter().map(|e| f64::from(e.bins[i].energy[3])).sum::<f64>() / echograms.len() as f64;
    (0..echograms[0].bins.len()).map(energy).collect()
}

#[test]
fn walls_that_absorb_nothing_keep_all_energy_evenly() {
    let found = walls(0.0, 0.3).late_field(SOURCE, &DIRECT, &options(0.5)).unwrap();
    let volume: f64 = SIZE.iter().product();
    let density = 4.0 * std::f64::consts::PI * SPEED_OF_SOUND_M_S * 0.0025 / volume;
    let late: Vec<f64> = mean(&found).split_off(40);
    assert!(late.iter().all(|e| (e / density - 1.0).abs() < 1e-3), "{late:?}");
    for echogram in &found {
        let here = echogram.bins[100..].iter().map(|b| f64::from(b.energy[3])).sum::<f64>() / 100.0;
        assert!((here / density - 1.0).abs() < 0.05, "a cell has {here} of {density}");
    }
}

#[test]
fn what_images_play_is_not_counted_and_all_else_is() {
    // Hardly anything is scattered: what is left is images of higher orders.
    let (walls, images) = (walls(0.3, 0.05), box_images(3));
    let [all, rest] = [&DIRECT[..], &images].map(|played| walls.late_field(SOURCE, played, &options(0.4)).unwrap());
    let total = |e: &[Echogram]| mean(e).iter().sum::<f64>();
    // The mean of the images over the box, by places that fill it.
    let exact = walls.images(SOURCE, 3, Reflected::Specular).unwrap();
    let steps = 24;
    let mut held = 0.0;
    for i in 0..steps * steps * steps {
        let at: [f64; 3] = std::array::from_fn(|a| ((i / steps_power(steps, a) % steps) as f64 + 0.5) / steps as f64 * SIZE[a]);
        for image in exact.iter().filter(|image| image.order > 0) {
            let way2: f64 = at.iter().zip(image.position).map(|(a, b)| (a - b).powi(2)).sum();
            held += f64::from(image.gains[3]).powi(2) / way2 / steps.pow(3) as f64;
        }
    }
    let found = total(&all) - total(&rest);
    assert!((found / held - 1.0).abs() < 0.02, "images have {held}, particles left out {found}");
    let first = mean(&rest).iter().position(|e| *e > 0.0).unwrap();
    let first_all = mean(&all).iter().position(|e| *e > 0.0).unwrap();
    assert!(first >= first_all, "{first} {first_all}");
}

fn steps_power(steps: usize, axis: usize) -> usize {
    steps.pow(u32::try_from(axis).unwrap())
}

#[test]
fn rooms_that_scatter_decay_after_eyring() {
    for (absorption, within) in [(0.05, 0.03), (0.1, 0.03), (0.2, 0.06), (0.4, 0.1)] {
        let walls = walls(absorption, 0.5);
        let eyring = walls.eyring_t60_s(None)[3];
        let found = walls.late_field(SOURCE, &DIRECT, &options(0.8 * eyring)).unwrap();
        let t30 = found.iter().map(|e| e.t30_s(3).unwrap()).sum::<f64>() / found.len() as f64;
        println!("absorption {absorption}: {t30:.3} s, Eyring {eyring:.3} s: {:+.1} %", 100.0 * (t30 / eyring - 1.0));
        assert!((t30 / eyring - 1.0).abs() < within, "{absorption}: {t30} s of {eyring}");
    }
}

#[test]
fn what_cannot_be_is_refused() {
    let error = |walls: &Shoebox, source, options: &ParticleOptions| {
        walls.late_field(source, &DIRECT, options).unwrap_err().to_string()
    };
    let good = walls(0.1, 0.1);
    assert!(error(&Shoebox { size: [f64::NAN, 1.0, 1.0], ..good.clone() }, SOURCE, &options(0.1)).contains("size of the box"));
    assert!(error(&good, [8.0, 1.0, 1.0], &options(0.1)).contains("inside the box"));
    assert!(error(&good, SOURCE, &options(f64::NAN)).contains("length of echograms"));
    assert!(error(&good, SOURCE, &ParticleOptions { particles: 0, ..options(0.1) }).contains("particles"));
    // A source in a corner, walls that take all, air.
    let dead = walls(1.0, 0.5).late_field([0.0; 3], &DIRECT, &ParticleOptions { air: Some(Air::default()), ..options(0.1) });
    assert!(mean(&dead.unwrap()).iter().all(|e| *e == 0.0));
}
