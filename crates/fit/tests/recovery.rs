//! Rooms of which everything is known are found from what is heard in them.
//!
//! The long figures: `cargo test -p promenade-fit --test recovery -- --ignored --nocapture figures`.

mod truth;

use promenade_fit::{Bands, FlatRoom, Form, FullFit, FullOptions, Measurements, Walls, full_fit, octave_t20_s, search_box};
use std::time::Instant;
use truth::{PANEL, RATE, Truth, absorption};

const SIZE: [f64; 3] = [6.1, 4.7, 2.9];
const SOURCE: [f64; 3] = [1.3, 1.9, 1.4];

/// Bands that an early window of 50 ms supports.
fn inside() -> Vec<usize> {
    let bands = Bands::new(RATE);
    (0..bands.centres_hz.len()).filter(|b| (120.0..7000.0).contains(&bands.centres_hz[*b])).collect()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
    sum / count
}

/// Mean distance of absorptions from the truth.
fn absorption_off(fit: &FullFit) -> f64 {
    let hz = fit.bands.centres_hz;
    mean(
        (0..6)
            .flat_map(|w| inside().into_iter().map(move |b| (w, b)))
            .map(|(w, b)| (fit.surfaces[w].absorption[b].value - absorption(w, hz[b])).abs()),
    )
}

fn scattering_off(fit: &FullFit, truth: &Truth) -> f64 {
    mean(inside().into_iter().map(|b| (fit.scattering[b].value - truth.scattering(fit.bands.centres_hz[b])).abs()))
}

/// Median and greatest distance of microphones from the truth, centimetres.
fn places_off_cm(fit: &FullFit, microphones: &[[f64; 3]]) -> (f64, f64) {
    let off = |(f, m): (&promenade_fit::Found, &[f64; 3])| -> f64 {
        100.0 * f.microphone_m.iter().zip(m).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    };
    let mut all: Vec<f64> = fit.places.iter().zip(microphones).map(off).collect();
    all.sort_by(f64::total_cmp);
    (all[all.len() / 2], all[all.len() - 1])
}

fn say(name: &str, fit: &FullFit, truth: &Truth, microphones: &[[f64; 3]], began: Instant) {
    let (median, most) = places_off_cm(fit, microphones);
    println!(
        "{name}: |d absorption| {:.4}, |d scattering| {:.3}, places {median:.2} cm (most {most:.2}), left {:.3}, {:.1} s",
        absorption_off(fit),
        scattering_off(fit, truth),
        fit.left,
        began.elapsed().as_secs_f64()
    );
    let moved: Vec<String> = fit
        .walls
        .iter()
        .map(|w| format!("{:+.4} ± {:.4} ({:.1} {})", w.moved_m, w.error_m, w.scanned.stands_out, w.scanned.found))
        .collect();
    println!("  walls {moved:?}");
    if let Form::Box(walls) = &fit.room.form {
        println!("  lengths {:.4?}, from {:.4?}", walls.size_m(), walls.low_m);
    }
    let hz = fit.bands.centres_hz;
    let row = |w: usize| -> Vec<String> {
        (0..16)
            .map(|b| {
                format!(
                    "{:.2}/{:.2}~{:.2}",
                    fit.surfaces[w].absorption[b].value,
                    absorption(w, hz[b]),
                    fit.surfaces[w].absorption[b].error
                )
            })
            .collect()
    };
    (0..6).for_each(|w| println!("  {}", row(w).join(" ")));
    let s: Vec<String> = (0..16).map(|b| format!("{:.2}/{:.2}", fit.scattering[b].value, truth.scattering(hz[b]))).collect();
    println!("  scattering {}", s.join(" "));
}

fn fitted(size: [f64; 3], set: &Measurements, options: &FullOptions) -> FullFit {
    let room = FlatRoom::of_box(Walls::of_size(size).unwrap()).unwrap();
    full_fit(&room, set, options, &mut |_| ()).unwrap()
}

#[test]
fn places_clocks_and_walls_of_a_room_of_mirrors_are_found_and_a_fit_comes_to_the_same_bits() {
    let truth = Truth { scattered: false, length_s: 0.1, order: 7, ..Truth::new([4.6, 3.7, 2.6], [1.2, 1.5, 1.3]) };
    let microphones = truth.microphones(7);
    let set = truth.measured(&microphones, 0.02, 0.003);
    let options = FullOptions { order: 6, window_s: 0.025, geometry: false, source: false, ..FullOptions::default() };
    let room = FlatRoom::of_box(Walls::of_size(truth.size).unwrap()).unwrap();
    let fit = full_fit(&room, &set, &options, &mut |share| assert!((0.0..1.0).contains(&share))).unwrap();
    let (median, most) = places_off_cm(&fit, &microphones);
    let bands: Vec<usize> = (0..16).filter(|b| (800.0..6000.0).contains(&fit.bands.centres_hz[*b])).collect();
    let hz = fit.bands.centres_hz;
    let off = mean(
        (0..6)
            .flat_map(|w| bands.iter().map(move |b| (w, *b)))
            .map(|(w, b)| (fit.surfaces[w].absorption[b].value - absorption(w, hz[b])).abs()),
    );
    assert!(median < 0.3 && most < 1.0, "{median} {most} cm");
    assert!(off < 0.05, "{off}");
    let held = full_fit(&room, &set, &FullOptions { places: false, ..options }, &mut |_| ()).unwrap();
    assert!(held.left > 2.0 * fit.left, "{} {}", held.left, fit.left);
    let again = full_fit(&room, &set, &options, &mut |_| ()).unwrap();
    assert_eq!(again.surfaces, fit.surfaces);
}

#[test]
fn a_box_of_which_nothing_is_stated_is_found() {
    for (scattered, seed) in [(false, 0.0), (true, 0.35)] {
        let size = [5.2 + seed, 4.1, 2.7];
        let truth = Truth { scattered, length_s: 0.3, order: 8, ..Truth::new(size, [1.2, 1.5, 1.3]) };
        let microphones = truth.microphones(8);
        let found = search_box(&truth.measured(&microphones, 0.01, 0.003)).unwrap();
        for (wall, at) in [0.0, size[0], 0.0, size[1], 0.0, size[2]].into_iter().enumerate() {
            assert!((found.walls.wall_m(wall) - at).abs() < 0.05, "{wall}: {found:?}");
        }
    }
}

#[test]
#[ignore = "long: figures"]
fn figures_of_a_box() {
    let only = std::env::var("FIGURES").unwrap_or_default();
    for (kind, truth) in [
        ("mirrors", Truth { scattered: false, length_s: 0.2, ..Truth::new(SIZE, SOURCE) }),
        ("scattering", Truth::new(SIZE, SOURCE)),
        ("noise", Truth { noise_db: -50.0, ..Truth::new(SIZE, SOURCE) }),
        ("facing", Truth { facing: Some([0.8, 0.6, 0.0]), ..Truth::new(SIZE, SOURCE) }),
    ] {
        let microphones = truth.microphones(12);
        let measured = |sd_m: f64, offset_s: f64| truth.measured(&microphones, sd_m, offset_s);
        let run = |name: &str, size: [f64; 3], set: &Measurements, options: &FullOptions| {
            println!("T20 {:.3?} s", octave_t20_s(set));
            let began = Instant::now();
            say(&format!("{kind}, {name}"), &fitted(size, set, options), &truth, &microphones, began);
        };
        let wanted = |name: &str| only.is_empty() || only.split(',').any(|o| o == format!("{kind}.{name}") || o == kind);
        let fixed = FullOptions { geometry: false, source: truth.facing.is_some(), ..FullOptions::default() };
        if wanted("exact") {
            run("exact places", SIZE, &measured(0.0, 0.0), &fixed);
        }
        if wanted("source") {
            run("exact places, source sought", SIZE, &measured(0.0, 0.0), &FullOptions { source: true, ..fixed });
        }
        if wanted("places") {
            let noisy = measured(0.03, 0.004);
            run("3 cm, free clocks", SIZE, &noisy, &fixed);
            run("3 cm, held places", SIZE, &noisy, &FullOptions { places: false, ..fixed });
        }
        if wanted("lengths") {
            let wrong = [SIZE[0] * 1.1, SIZE[1] * 1.08, SIZE[2] * 1.1];
            run("lengths 8 to 10 % wrong, 3 cm", wrong, &measured(0.03, 0.004), &FullOptions::default());
        }
    }
}

#[test]
#[ignore = "long: figures"]
fn figures_of_changed_walls() {
    let truth = Truth::new(SIZE, SOURCE);
    let microphones = truth.microphones(12);
    for (name, sd_m, offset_s, geometry) in
        [("exact places", 0.0, 0.0, false), ("3 cm, free clocks, lengths sought", 0.03, 0.004, true)]
    {
        let before = truth.measured(&microphones, sd_m, offset_s);
        let fit = fitted(SIZE, &before, &FullOptions { geometry, source: false, ..FullOptions::default() });
        let was = octave_t20_s(&before);
        println!("{name}: |d absorption| {:.3}", absorption_off(&fit));
        for walls in [&[0][..], &[3], &[5], &[1, 2], &[0, 4], &[2, 5]] {
            let panels = std::array::from_fn(|w| walls.contains(&w));
            let measured = octave_t20_s(&Truth { panels, ..Truth::new(SIZE, SOURCE) }.measured(&microphones, 0.0, 0.0));
            let mut changed = fit.clone();
            walls.iter().for_each(|w| changed.set_absorption(*w, &PANEL));
            let off = |t: &dyn Fn(usize) -> f64| -> String {
                let all: Vec<f64> = (1..7).map(|o| 100.0 * (t(o) / measured[o] - 1.0)).collect();
                let each = all.iter().map(|v| format!("{v:+.1}")).collect::<Vec<_>>().join(" ");
                format!("{:.1} % ({each})", mean(all.iter().map(|v| v.abs())))
            };
            println!("  panels on {walls:?}: {}; unchanged {}", off(&|o| changed.t20_s(o)), off(&|o| was[o]));
        }
    }
}
