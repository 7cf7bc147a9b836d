use super::*;
use crate::Response;
use crate::sources::simulation::heads::{RATE, set, transparent, two_sided};
use crate::sources::simulation::{Part, SPEED_OF_SOUND_M_S};
use promenade_acoustics::{Air, Image, Material, Octaves, Reflected};
use promenade_fourier::num_complex::Complex32;
use promenade_metrics::{DecayRange, decay_time_s, ild_db, itd_s};
use std::f32::consts::PI;

const SIZE: Vec3 = Vec3::new(7.0, 5.0, 3.0);
const EMITTER: Vec3 = Vec3::new(3.1, 2.3, 1.9);

/// Walls of these absorptions that scatter the same share in all octaves.
fn walls(absorption: [Octaves; 6], scattering: f32) -> Shoebox {
    let material = |absorption| Material { absorption, ..Material::even("wall", 0.0, scattering) };
    Shoebox { size: SIZE.as_dvec3().to_array(), materials: absorption.map(material) }
}

fn even(absorption: f32, scattering: f32) -> Shoebox {
    walls([[absorption; 7]; 6], scattering)
}

/// Without air.
fn options(order: u32, length_s: f32) -> MeshOptions {
    MeshOptions {
        order,
        beams: 0,
        rays: 6000,
        t30_within: None,
        length_s: Some(length_s),
        air: None,
        waves_hz: Some(0.0),
        seed: 1,
        part: Part::WHOLE,
    }
}

fn simulate(room: &Shoebox, emitter: Vec3, hrtf: &Hrtf, poses: &[Pose], options: &MeshOptions) -> Vec<Response> {
    simulate_box(room, emitter, hrtf, poses, options, |_| ()).unwrap_or_else(|e| panic!("{e}")).responses.responses
}

fn images(room: &Shoebox, order: u32) -> Vec<Image> {
    room.images(EMITTER.as_dvec3().to_array(), order, Reflected::Specular).unwrap()
}

fn way(image: &Image, listener: Vec3) -> f32 {
    Vec3::from_array(image.position.map(|c| c as f32)).distance(listener)
}

fn at(x: f32, y: f32, z: f32) -> Pose {
    Pose { position: Vec3::new(x, y, z), ..Pose::IDENTITY }
}

fn energy(samples: &[f32]) -> f64 {
    samples.iter().map(|v| f64::from(*v).powi(2)).sum()
}

/// Of the spectrum at a frequency.
fn power(samples: &[f32], hz: f64) -> f64 {
    let w = 2.0 * std::f64::consts::PI * hz / f64::from(RATE);
    let sum = |f: fn(f64) -> f64| samples.iter().enumerate().map(|(i, v)| f64::from(*v) * f(w * i as f64)).sum::<f64>();
    sum(f64::cos).powi(2) + sum(f64::sin).powi(2)
}

/// Without what lies near half the sample rate.
fn smooth(samples: &[f32]) -> Vec<f32> {
    samples.windows(5).map(|w| (w[0] + w[4]) / 16.0 + (w[1] + w[3]) / 4.0 + w[2] * 0.375).collect()
}

#[test]
fn the_direct_sound_comes_after_its_way_at_its_level() {
    let dead = even(1.0, 0.0);
    for pose in [at(1.0, 1.0, 1.0), at(3.1, 2.3, 0.9), at(6.9, 4.9, 2.9)] {
        let distance = pose.position.distance(EMITTER);
        let response = &simulate(&dead, EMITTER, &transparent(), &[pose], &options(6, 0.5))[0];
        assert_eq!(response.left, response.right);
        let level = 10.0 * power(&response.left, 1000.0).log10() + 20.0 * f64::from(distance).log10();
        assert!(level.abs() < 0.02, "{level} dB at {distance} m");
        // The centre of a pulse's energy is where the pulse is.
        let centre = response.left.iter().enumerate().map(|(i, v)| i as f64 * f64::from(*v).powi(2)).sum::<f64>();
        let arrival = centre / energy(&response.left);
        let expected = f64::from(distance / SPEED_OF_SOUND_M_S) * f64::from(RATE);
        assert!((arrival - expected).abs() < 0.05, "{arrival} for {expected}");
    }
}

#[test]
fn reflections_have_the_energy_of_their_images() {
    let (listener, room) = (at(1.0, 3.5, 1.2), even(0.3, 0.0));
    // What is of a higher order, which rays bring, comes later.
    let response = &simulate(&room, EMITTER, &transparent(), &[listener], &options(5, 0.0235))[0];
    let mut silent = response.left.clone();
    for image in images(&room, 5) {
        let distance = way(&image, listener.position);
        let arrival = distance / SPEED_OF_SOUND_M_S * RATE as f32;
        let amplitude = image.gains[3] / distance;
        for (i, v) in silent.iter_mut().enumerate() {
            let t = PI * (i as f32 - arrival);
            *v -= amplitude * if t.abs() < 1e-3 { 1.0 } else { t.sin() / t };
        }
    }
    // Ripples of the images that arrive after the end are in one of both only.
    let left = 10.0 * (energy(&smooth(&silent[..500])) / energy(&smooth(&response.left[..500]))).log10();
    assert!(left < -70.0, "what the images do not explain: {left} dB");
}

/// Of a floor's reflection, all other walls being open, at a listener over it.
fn floor_power(absorption: Octaves, scattering: f32, air: Option<Air>, hz: f64) -> f64 {
    let mut room = even(1.0, 0.0);
    room.materials[4] = Material { absorption, ..Material::even("floor", 0.0, scattering) };
    let options = MeshOptions { air, ..options(6, 0.08) };
    let response = &simulate(&room, EMITTER, &transparent(), &[at(5.0, 2.3, 1.9)], &options)[0];
    let way = EMITTER.distance(Vec3::new(5.0, 2.3, -1.9));
    let start = (way / SPEED_OF_SOUND_M_S * RATE as f32) as usize - 20;
    power(&response.left[start..start + 60], hz) * f64::from(way).powi(2)
}

#[test]
fn walls_take_by_octave() {
    let absorption = [0.1, 0.1, 0.1, 0.5, 0.9, 0.9, 0.9];
    for (hz, left) in [(1000.0, 0.5), (4000.0, 0.1)] {
        let found = floor_power(absorption, 0.0, None, hz);
        assert!((10.0 * (found / left).log10()).abs() < 0.5, "{hz} Hz: {found} for {left}");
    }
}

#[test]
fn what_walls_scatter_is_no_reflection_and_is_not_lost() {
    // A mirror keeps a tenth of what it kept: the rest comes from all of the floor, some of it soon after.
    let [mirror, rough] = [0.0, 0.9].map(|scattering| floor_power([0.2; 7], scattering, None, 2000.0));
    let db = 10.0 * (rough / mirror).log10();
    assert!((-11.0..-4.0).contains(&db), "{db} dB of the reflection are left");
    let heard = |scattering: f32| {
        let poses = [at(1.0, 1.0, 1.0), at(5.5, 1.5, 1.2), at(2.0, 4.0, 1.7), at(6.2, 4.1, 0.8)];
        let options = MeshOptions { rays: 20_000, ..options(4, 0.4) };
        let found = simulate(&even(0.3, scattering), EMITTER, &transparent(), &poses, &options);
        found.iter().map(|r| energy(&r.left)).sum::<f64>()
    };
    let db = 10.0 * (heard(0.9) / heard(0.1)).log10();
    assert!(db.abs() < 1.0, "the whole room is {db} dB louder where it scatters");
}

#[test]
fn air_takes_high_tones() {
    let air = Air { humidity_percent: 10.0, ..Air::default() };
    let way = f64::from(EMITTER.distance(Vec3::new(5.0, 2.3, -1.9)));
    for hz in [2000.0, 8000.0] {
        let [without, with] = [None, Some(air)].map(|air| floor_power([0.1; 7], 0.0, air, hz));
        let (found, expected) = (10.0 * (with / without).log10(), -way * air.db_per_m(hz));
        assert!((found - expected).abs() < 0.05, "{hz} Hz: {found} dB of {expected}");
    }
}

#[test]
fn the_room_decays_after_eyring() {
    // Where walls take half of what falls on them, sound is far from even in all directions, which the formula supposes.
    for (absorption, within) in [(0.15, 0.15), (0.3, 0.15), (0.5, 0.2)] {
        let room = even(absorption, 0.5);
        let eyring = room.eyring_t60_s(None)[3];
        let poses = [at(1.0, 1.0, 1.0), at(5.5, 1.5, 1.2), at(2.0, 4.0, 1.7)];
        for response in simulate(&room, EMITTER, &transparent(), &poses, &options(6, (1.2 * eyring) as f32)) {
            let t20 = decay_time_s(&response.left, f64::from(RATE), DecayRange::T20).unwrap();
            assert!(
                (t20 / eyring - 1.0).abs() < within,
                "{} s for {eyring} s, absorption {absorption}, {}",
                t20,
                response.name
            );
        }
    }
}

#[test]
fn late_energy_is_that_of_the_diffuse_field() {
    let (hrtf, room) = (two_sided(), even(0.2, 0.5));
    let poses: Vec<Pose> = (1..7).map(|i| at(i as f32, 1.0 + 0.4 * i as f32, 1.3)).collect();
    let late = (0.1 * RATE as f32) as usize;
    let decay = 6.0 * std::f64::consts::LN_10 / room.eyring_t60_s(None)[3];
    let density = 4.0 * std::f64::consts::PI * f64::from(SPEED_OF_SOUND_M_S) / room.volume_m3();
    let expected = density / decay * (-0.1 * decay).exp();
    let responses = simulate(&room, EMITTER, &hrtf, &poses, &options(6, 0.6));
    for ear in [|r: &Response| energy(&r.left[(0.1 * RATE as f32) as usize..]), |r: &Response| energy(&r.right[2400..])] {
        let mean = responses.iter().map(ear).sum::<f64>() / poses.len() as f64;
        assert!((10.0 * (mean / expected).log10()).abs() < 1.0, "{mean} for {expected}");
    }
    // At 1.5 kHz ears this far apart hear different noise, at 60 Hz the same.
    let coherence = [60.0, 1500.0].map(|hz| hrtf.coherence(hz));
    assert!(coherence[0] > 0.7 && coherence[1].abs() < 0.4, "{coherence:?}");
    let low: f64 = responses[0].left[late..].iter().zip(&responses[0].right[late..]).map(|(a, b)| f64::from(a * b)).sum();
    assert!(low.abs() < 0.3 * energy(&responses[0].left[late..]), "broad-band noise of both ears has little in common");
}

#[test]
fn the_near_ear_is_earlier_and_louder() {
    let hrtf = two_sided();
    // The emitter is to the left of one who looks along x from the right wall, and to the right of one who looks back.
    let back = Pose::from_ypr(Vec3::new(3.1, 1.0, 1.9), PI, 0.0, 0.0);
    let responses = simulate(&even(0.3, 0.1), EMITTER, &hrtf, &[at(3.1, 1.0, 1.9), back], &options(6, 0.05));
    for (response, side) in responses.iter().zip([1.0, -1.0]) {
        let itd = itd_s(&response.left, &response.right, f64::from(RATE)).unwrap();
        let ild = ild_db(&response.left, &response.right).unwrap();
        assert!((itd * side + 16.0 / 24e3).abs() < 4e-5, "{}: the left ear is {itd} s later", response.name);
        assert!(ild * side > 2.0, "{}: {ild} dB", response.name);
    }
}

#[test]
fn a_mirrored_room_swaps_the_ears() {
    let hrtf = two_sided();
    let mut absorption = [[0.2; 7]; 6];
    absorption[2] = [0.6; 7];
    let room = walls(absorption, 0.0);
    absorption.swap(2, 3);
    let mirrored = walls(absorption, 0.0);
    let flip = |p: Vec3| Vec3::new(p.x, SIZE.y - p.y, p.z);
    // Before the tail, whose noise is not mirrored.
    let options = options(8, 0.03);
    let here = Pose::from_ypr(Vec3::new(1.2, 3.4, 1.6), 0.7, 0.2, 0.1);
    let there = Pose::from_ypr(flip(here.position), -0.7, 0.2, -0.1);
    let one = &simulate(&room, EMITTER, &hrtf, &[here], &options)[0];
    let other = &simulate(&mirrored, flip(EMITTER), &hrtf, &[there], &options)[0];
    for (a, b) in [(&one.left, &other.right), (&one.right, &other.left)] {
        let difference: Vec<f32> = a.iter().zip(b).map(|(a, b)| a - b).collect();
        let left = 10.0 * (energy(&difference) / energy(a)).log10();
        assert!(left < -45.0, "{left} dB of difference");
    }
    assert!(10.0 * (energy(&one.left) / energy(&one.right)).log10().abs() > 0.1, "the ears hear different things");
}

#[test]
fn the_seed_is_the_noise_and_nothing_else() {
    let (room, options) = (even(0.3, 0.0), options(6, 0.2));
    let poses = [at(1.0, 1.0, 1.0), at(1.0, 1.0, 1.0)];
    let hrtf = transparent();
    let once = simulate(&room, EMITTER, &hrtf, &poses, &options);
    assert_eq!(once, simulate(&room, EMITTER, &hrtf, &poses, &options));
    let again = simulate(&room, EMITTER, &hrtf, &poses, &MeshOptions { seed: 2, ..options });
    assert_eq!(once[0].left[..700], again[0].left[..700], "images have no noise");
    assert_ne!(once[0].left, again[0].left);
    assert_ne!(once[0].left, once[1].left, "each pose has its own");
}

#[test]
fn a_turn_of_the_head_has_no_steps() {
    let hrtf = two_sided();
    let near = |azimuth: f32| {
        let near = hrtf.near(Vec3::new(azimuth.cos(), azimuth.sin(), 0.3).normalize());
        let mut spectrum = vec![Complex32::default(); hrtf.bins.n_fft / 2 + 1];
        near.spectrum(0, &mut spectrum);
        (near.delay(0), spectrum[100].norm())
    };
    for step in 0..3600 {
        let azimuth = step as f32 * PI / 1800.0;
        let ((delay, level), (next_delay, next_level)) = (near(azimuth), near(azimuth + PI / 1800.0));
        let step = (next_delay - delay, next_level / level);
        assert!(step.0.abs() < 0.2 && (step.1 - 1.0).abs() < 0.02, "{step:?} at {azimuth}");
        // Measured directions lie some nine degrees apart: 1.25 samples.
        assert!((delay + 8.0 * azimuth.sin() / 1.09_f32.sqrt()).abs() < 1.25, "{delay} samples at {azimuth}");
    }
}

#[test]
fn what_cannot_be_is_an_error() {
    let hrtf = transparent();
    let (room, good) = (even(0.3, 0.1), options(6, 0.1));
    let inside = [at(1.0, 1.0, 1.0)];
    let refused = |room: &Shoebox, emitter, poses: &[Pose], options: &MeshOptions, says: &str| {
        let error = simulate_box(room, emitter, &hrtf, poses, options, |_| ()).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    };
    let outside = [at(1.0, 1.0, 1.0), at(1.0, -0.1, 1.0)];
    let beyond = "listener: expected inside the room, between 0,0,0 and [7, 5, 3], found pose 1 at";
    refused(&room, EMITTER, &outside, &good, beyond);
    refused(&room, EMITTER, &[at(f32::NAN, 1.0, 1.0)], &good, "pose 0");
    refused(&room, EMITTER, &[at(3.1, 2.3, 1.95)], &good, "at least 0.1 m from the emitter");
    refused(&room, Vec3::new(8.0, 1.0, 1.0), &inside, &good, "emitter: expected inside the room");
    refused(&even(1.1, 0.1), EMITTER, &inside, &good, "absorption of wall: expected 0 to 1, found 1.1");
    refused(&Shoebox { size: [0.1, 5.0, 3.0], ..room.clone() }, EMITTER, &inside, &good, "size of the room");
    refused(&room, EMITTER, &inside, &MeshOptions { order: 99, ..good }, "order of images: expected at most 50");
    refused(&room, EMITTER, &inside, &MeshOptions { length_s: Some(0.0), ..good }, "length of the responses");
    let silent = set(&[Vec3::X], |_| [vec![0.0; 8], vec![0.0; 8]]);
    assert!(Hrtf::new(&silent, RATE).unwrap_err().to_string().contains("responses with sound, found silence"));
    assert!(Hrtf::new(&set(&[], |_| [Vec::new(), Vec::new()]), RATE).is_err());
    assert!(Hrtf::new(&set(&[Vec3::ZERO], |_| [vec![1.0], vec![1.0]]), RATE).is_err());
}
