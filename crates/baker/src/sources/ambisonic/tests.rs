//! A box room encoded to Ambisonics and heard again, held against the same images heard directly.

use super::ears::Frame;
use super::*;
use crate::LoadOptions;
use promenade_core::head::harmonics;
use promenade_core::random::Random;
use promenade_metrics::{DecayRange, c50_db, decay_time_s, ild_db, itd_s};
use std::collections::HashMap;

const RATE_HZ: u32 = 16_000;

/// HRTFs of a ball of 8.75 cm without a face: Woodworth's delays (1938) and a far ear that is softer, more so at high
/// frequencies.
fn ball() -> Hrtf {
    let directions = (0..300).map(|i| promenade_core::head::lattice(i, 300));
    let ear = |direction: Vec3, side: f32| {
        let lateral = (side * direction.y).clamp(-1.0, 1.0);
        let angle = lateral.asin();
        let delay_s = 0.0875 / 343.0 * (if angle > 0.0 { -lateral } else { -angle });
        let mut samples = vec![0.0_f32; 128];
        let at = 32.0 + delay_s * RATE_HZ as f32;
        let pole = 0.35 * (1.0 - lateral);
        let mut state = 0.0;
        for (i, sample) in samples.iter_mut().enumerate() {
            let t = std::f32::consts::PI * (i as f32 - at);
            let sinc = if t.abs() < 1e-3 { 1.0 } else { t.sin() / t * (0.5 + 0.5 * (t / 33.0 / 1.0).cos()) };
            state = pole * state + (1.0 - pole) * if t.abs() < 33.0 * 3.1 { sinc } else { 0.0 };
            *sample = state * (1.0 + 0.4 * lateral);
        }
        samples
    };
    let responses = directions.map(|d| Response {
        listener: Pose::IDENTITY,
        source: d,
        left: ear(d, 1.0),
        right: ear(d, -1.0),
        name: String::new(),
    });
    let set = Responses { sample_rate_hz: f64::from(RATE_HZ), responses: responses.collect(), ..Responses::default() };
    Hrtf::new(&set, RATE_HZ).unwrap()
}

/// Sound that arrives: when, in samples, from where, and how loud.
type Arrival = (usize, Vec3, f32);

/// Images of a source in a box up to an order, as seen from a listener; walls take so much of the amplitude, and every image is
/// moved a little, as walls are not quite flat: in a perfect box many arrive at one moment.
fn images(size: Vec3, source: Vec3, listener: Vec3, reflection: f32, longest_s: f32, rate_hz: u32) -> Vec<Arrival> {
    let mut random = Random::new(7);
    let reach = |axis: usize| (longest_s * 343.0 / size[axis]).ceil() as i32 + 1;
    let mut arrivals = Vec::new();
    for x in -reach(0)..=reach(0) {
        for y in -reach(1)..=reach(1) {
            for z in -reach(2)..=reach(2) {
                let rooms = [x, y, z];
                let mut at = Vec3::ZERO;
                for (axis, n) in rooms.into_iter().enumerate() {
                    let inside = if n % 2 == 0 { source[axis] } else { size[axis] - source[axis] };
                    at[axis] = n as f32 * size[axis] + inside;
                }
                let walls: u32 = rooms.iter().map(|n| n.unsigned_abs()).sum();
                let moved = Vec3::new(random.uniform(), random.uniform(), random.uniform()) - 0.5;
                let to = at - listener + if walls > 0 { 0.2 * moved } else { Vec3::ZERO };
                let distance = to.length();
                let sample = (distance / 343.0 * rate_hz as f32).round() as usize;
                if distance < longest_s * 343.0 {
                    arrivals.push((sample, to / distance, reflection.powi(walls as i32) / distance));
                }
            }
        }
    }
    arrivals
}

fn encoded(arrivals: &[Arrival], order: usize, length: usize, from: Normalisation) -> Vec<Vec<f32>> {
    let mut all = vec![vec![0.0; length]; channels(order)];
    for (at, direction, gain) in arrivals {
        if from == Normalisation::Fuma {
            // Polynomials of the direction as they are published, in their own order.
            let Vec3 { x, y, z } = *direction;
            let first = [0.5_f32.sqrt(), x, y, z];
            let second = [1.5 * z * z - 0.5, 2.0 * x * z, 2.0 * y * z, x * x - y * y, 2.0 * x * y];
            let l = (135.0_f32 / 256.0).sqrt() * (5.0 * z * z - 1.0);
            let n = 27.0_f32.sqrt() / 2.0 * z;
            let cubic = [x * (x * x - 3.0 * y * y), y * (3.0 * x * x - y * y)];
            let third = [0.5 * z * (5.0 * z * z - 3.0), l * x, l * y, n * (x * x - y * y), 2.0 * n * x * y, cubic[0], cubic[1]];
            let values = first.into_iter().chain(second).chain(third);
            all.iter_mut().zip(values).for_each(|(samples, y)| samples[*at] += gain * y);
            continue;
        }
        for (channel, (samples, y)) in all.iter_mut().zip(harmonics(order, *direction)).enumerate() {
            let scale = if from == Normalisation::Sn3d { ((2 * degree(channel) + 1) as f32).sqrt() } else { 1.0 };
            samples[*at] += gain * y / scale;
        }
    }
    all
}

/// The same arrivals heard each by itself; late ones from directions rounded to 3 degrees.
fn heard(arrivals: &[Arrival], hrtf: &Hrtf, head: Quat, length: usize) -> [Vec<f32>; 2] {
    let frame = Frame::of(hrtf);
    let mut ears = [vec![0.0; length + frame.length], vec![0.0; length + frame.length]];
    let mut rounded: HashMap<[i32; 2], [Vec<f32>; 2]> = HashMap::new();
    let late = (0.04 * f64::from(hrtf.sample_rate_hz())) as usize;
    for (at, direction, gain) in arrivals {
        let seen = head.inverse() * *direction;
        let steps = [seen.y.atan2(seen.x), seen.z.asin()].map(|angle| (angle.to_degrees() / 3.0).round() as i32);
        let exact = (*at < late).then(|| frame.heard(hrtf, seen));
        let impulses = exact.as_ref().unwrap_or_else(|| rounded.entry(steps).or_insert_with(|| frame.heard(hrtf, seen)));
        for (ear, impulse) in ears.iter_mut().zip(impulses) {
            ear[*at..].iter_mut().zip(impulse).for_each(|(e, i)| *e += gain * i);
        }
    }
    ears.map(|mut ear| {
        ear.truncate(length + frame.lead);
        ear
    })
}

fn set(channels: Vec<Vec<f32>>, source: Option<Vec3>, normalisation: Normalisation, rate_hz: u32) -> AmbisonicResponses {
    let listener = Pose { position: LISTENER, orientation: Quat::IDENTITY };
    let response = AmbisonicResponse { listener, source, distance_m: None, channels, name: "hall".to_owned() };
    AmbisonicResponses {
        sample_rate_hz: f64::from(rate_hz),
        normalisation,
        responses: vec![response],
        path: "hall.json".into(),
        ..AmbisonicResponses::default()
    }
}

const SIZE: Vec3 = Vec3::new(6.0, 4.5, 3.0);
const SOURCE: Vec3 = Vec3::new(4.4, 3.1, 1.4);
const LISTENER: Vec3 = Vec3::new(2.1, 1.7, 1.5);

/// Differences of binaural responses from the images', for each head: ITD in microseconds, ILD and C50 in dB, T20 in percent,
/// third-octaves of the whole response and of its first 80 ms in dB.
fn differences(order: usize, hrtf: &Hrtf, yaws: usize, reflection: f32, longest_s: f32) -> Vec<[f64; 6]> {
    let rate_hz = hrtf.sample_rate_hz();
    let arrivals = images(SIZE, SOURCE, LISTENER, reflection, longest_s, rate_hz);
    let length = (longest_s * rate_hz as f32) as usize + 1;
    let channels = encoded(&arrivals, order, length, Normalisation::Sn3d);
    let set = set(channels, Some(SOURCE), Normalisation::Sn3d, rate_hz).binaural(hrtf, yaws, |_| {}).unwrap();
    let of = |response: &Response| {
        let [left, right] = heard(&arrivals, hrtf, response.listener.orientation, length);
        let rate = set.sample_rate_hz;
        let figures = |left: &[f32], right: &[f32]| {
            let mean = |f: &dyn Fn(&[f32]) -> f64| 0.5 * (f(left) + f(right));
            [
                1e6 * itd_s(left, right, rate).unwrap(),
                ild_db(left, right).unwrap(),
                mean(&|x| c50_db(x, rate).unwrap()),
                mean(&|x| 100.0 * decay_time_s(x, rate, DecayRange::T20).unwrap().ln()),
            ]
        };
        let (found, expected) = (figures(&response.left, &response.right), figures(&left, &right));
        let [third, early] = [usize::MAX, (0.08 * rate) as usize]
            .map(|end| thirds([&response.left, &response.right], [&left, &right], rate, end));
        let four: [f64; 4] = std::array::from_fn(|i| found[i] - expected[i]);
        [four[0], four[1], four[2], four[3], third, early]
    };
    set.responses.iter().map(of).collect()
}

/// Root mean square over third-octaves from 100 Hz to 12.5 kHz and both ears of level differences up to a sample, dB.
fn thirds(found: [&[f32]; 2], expected: [&[f32]; 2], rate_hz: f64, end: usize) -> f64 {
    let length = (2 * found[0].len()).next_power_of_two();
    let energies = |ear: &[f32]| -> Vec<f64> {
        let bins = spectrum(ear[..end.min(ear.len())].iter().copied(), length);
        let centre = |third: i32| 1000.0 * 2.0_f64.powf(f64::from(third) / 3.0);
        let bands = (-10..=11).filter(|t| centre(*t) < 0.4 * rate_hz);
        let edge = |hz: f64| (hz / rate_hz * length as f64) as usize;
        bands
            .map(|t| bins[edge(centre(t) * 0.891)..edge(centre(t) * 1.122)].iter().map(|b| f64::from(b.norm_sqr())).sum())
            .collect()
    };
    let squares: Vec<f64> = (0..2)
        .flat_map(|e| {
            let (f, x) = (energies(found[e]), energies(expected[e]));
            f.into_iter().zip(x).map(|(f, x)| (10.0 * (f / x).log10()).powi(2)).collect::<Vec<_>>()
        })
        .collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

fn worst(differences: &[[f64; 6]]) -> [f64; 6] {
    std::array::from_fn(|i| differences.iter().map(|d| d[i].abs()).fold(0.0, f64::max))
}

#[test]
fn a_box_is_heard_as_its_images_are() {
    let hrtf = ball();
    for (order, limits) in [(1, [45.0, 1.0, 0.4, 2.2, 0.8, 0.8]), (3, [25.0, 1.0, 0.4, 2.2, 0.8, 0.8])] {
        let found = worst(&differences(order, &hrtf, 4, 0.6, 0.15));
        eprintln!("order {order}: {found:.2?}");
        assert!(found.iter().zip(limits).all(|(f, limit)| *f <= limit), "order {order}: {found:?}");
    }
}

mod needs_shared {
    use super::*;
    use promenade_testing::shared;

    #[test]
    #[ignore = "needs ../shared"]
    fn a_box_is_heard_with_a_measured_head_as_its_images_are() {
        let head = Responses::load(&shared("data/hrtf_kemar/MIT_KEMAR_normal_pinna.sofa"), &LoadOptions::default()).unwrap();
        let hrtf = Hrtf::new(&head, 44_100).unwrap();
        for (order, limits) in [(1, [100.0, 1.3, 0.6, 4.0, 1.4, 1.4]), (3, [30.0, 1.3, 0.7, 4.0, 1.3, 1.3])] {
            let found = worst(&differences(order, &hrtf, 8, 0.7, 0.45));
            eprintln!("order {order}: {found:.2?}");
            assert!(found.iter().zip(limits).all(|(f, limit)| *f <= limit), "order {order}: {found:.2?}");
        }
    }
}

#[test]
fn sources_are_found_by_their_direct_sound_and_wrong_ones_refused() {
    let hrtf = ball();
    let arrivals = vec![(100, Vec3::new(0.6, 0.8, 0.0), 0.5)];
    for from in [Normalisation::Sn3d, Normalisation::N3d, Normalisation::Fuma] {
        let mut one = set(encoded(&arrivals, 2, 400, from), None, from, RATE_HZ);
        one.responses[0].distance_m = Some(2.0);
        let binaural = one.binaural(&hrtf, 4, |_| {}).unwrap();
        let [ahead, left, ..] = &binaural.responses[..] else { panic!("four heads") };
        assert!(ahead.source.distance(LISTENER + Vec3::new(1.2, 1.6, 0.0)) < 0.01, "{}", ahead.source);
        assert_eq!((&ahead.name[..], &left.name[..]), ("hall-yaw-0", "hall-yaw-90"));
        // A source on the left is to the right of a head that looks to the left.
        assert!(
            itd_s(&ahead.left, &ahead.right, 16e3).unwrap() < -1e-4 && itd_s(&left.left, &left.right, 16e3).unwrap() > 1e-4
        );
        let error = |set: &AmbisonicResponses| set.binaural(&hrtf, 4, |_| {}).unwrap_err().to_string();
        for (other, name, _) in Normalisation::ALL.into_iter().filter(|(other, ..)| *other != from) {
            one.normalisation = other;
            let own = Normalisation::ALL.iter().find(|n| n.0 == from).unwrap().1;
            let said = error(&one);
            assert!(said.contains(&format!("dB, as with `--normalisation {own}`")), "{own} as {name}: {said}");
        }
        one.normalisation = from;
        one.responses[0].source = Some(LISTENER + Vec3::new(0.6, -0.8, 0.0));
        let said = error(&one);
        assert!(
            said.contains("hall.json: hall: expected a direct sound from within 30 degrees") && said.contains("106 degrees"),
            "{said}"
        );
        (one.responses[0].source, one.responses[0].distance_m) = (None, None);
        assert!(error(&one).contains("expected a source, or a distance to it above 0, found neither"), "{}", error(&one));
        one.responses[0].channels.truncate(7);
        assert!(error(&one).contains("hall: expected 4, 9") && error(&one).contains("found 7 channels"), "{}", error(&one));
        one.responses[0].channels = vec![vec![0.0; 400]; 4];
        assert!(error(&one).contains("expected a direct sound in its first channel, found silence"), "{}", error(&one));
    }
}

#[test]
fn channels_of_furse_and_malham_are_those_of_ambix_to_the_third_order() {
    let direction = Vec3::new(0.48, -0.64, 0.6);
    let ambix = encoded(&[(0, direction, 1.0)], 3, 1, Normalisation::N3d);
    let fuma = encoded(&[(0, direction, 1.0)], 3, 1, Normalisation::Fuma);
    for (channel, expected) in ambix.iter().enumerate() {
        let (at, gain) = Normalisation::Fuma.stored(channel);
        assert!((gain * fuma[at][0] - expected[0]).abs() < 1e-5, "{channel}: {} for {}", gain * fuma[at][0], expected[0]);
    }
}
