//! Images of a box against its modes.

use glam::{DVec2, DVec3};
use promenade_acoustics::{Material, Reflected, SPEED_OF_SOUND_M_S, Shoebox};
use std::f64::consts::{PI, TAU};

/// With rigid walls and damping in the medium, the sum over images is the sum over modes (Kuttruff, "Room Acoustics", section
/// 3.2), here above Schroeder's frequency, where modes overlap.
#[test]
fn images_of_a_box_have_the_energy_of_its_modes() {
    let (size, source, listener) = ([3.1, 2.6, 2.2], [0.9, 0.7, 1.5], [2.2, 1.9, 0.8]);
    let t60_s = 0.25;
    let damping = 3.0 * std::f64::consts::LN_10 / t60_s;
    let walls = Shoebox { size, materials: [(); 6].map(|()| Material::even("rigid", 0.0, 0.0)) };
    let images = walls.images(source, 50, Reflected::Whole).unwrap();
    let ways: Vec<f64> = images.iter().map(|i| DVec3::from(i.position).distance(listener.into())).collect();
    let modes = modes(size, source, listener, 2500.0);
    let volume: f64 = size.iter().product();
    let (mut of_images, mut of_modes) = (0.0, 0.0);
    let schroeder_hz = 2000.0 * (t60_s / volume).sqrt();
    for step in 0..40 {
        let hz = 1.2 * schroeder_hz + 10.0 * f64::from(step);
        let k = DVec2::new(TAU * hz, -damping) / SPEED_OF_SOUND_M_S;
        let wave = |way: &f64| (k.y * way).exp() / way * DVec2::from_angle(-k.x * way);
        of_images += ways.iter().map(wave).sum::<DVec2>().length_squared();
        let squared = DVec2::new(k.x * k.x - k.y * k.y, 2.0 * k.x * k.y);
        let mode = |(own, shape): &(f64, f64)| {
            // One over a complex number.
            let away = DVec2::new(own - squared.x, -squared.y);
            shape * DVec2::new(away.x, -away.y) / away.length_squared()
        };
        of_modes += (4.0 * PI / volume * modes.iter().map(mode).sum::<DVec2>()).length_squared();
    }
    let ratio = of_images / of_modes;
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
}

/// Squares of the wave numbers of a rigid box up to a frequency, with what a mode is worth between two places.
fn modes(size: [f64; 3], source: [f64; 3], listener: [f64; 3], up_to_hz: f64) -> Vec<(f64, f64)> {
    let largest = TAU * up_to_hz / SPEED_OF_SOUND_M_S;
    let axis = |a: usize| {
        (0..).map(move |n| (f64::from(n) * PI / size[a], if n == 0 { 1.0 } else { 2.0 })).take_while(move |(k, _)| *k < largest)
    };
    let worth = move |a: usize, k: f64, e: f64| e * (k * source[a]).cos() * (k * listener[a]).cos();
    let all = axis(0).flat_map(|x| axis(1).flat_map(move |y| axis(2).map(move |z| [x, y, z])));
    let one = |m: [(f64, f64); 3]| {
        let square: f64 = m.iter().map(|(k, _)| k * k).sum();
        (square, m.iter().enumerate().map(|(a, (k, e))| worth(a, *k, *e)).product::<f64>())
    };
    all.map(one).filter(|(square, _)| *square < largest * largest).collect()
}
