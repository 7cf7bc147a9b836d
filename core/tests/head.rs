//! A head from measurements, as bytes, and in the place of the one that a scene was measured with.

use promenade_core::glam::Vec3;
use promenade_core::head::{
    HEAD_BANDS, HeadDirection, Incidence, MAX_HEAD_BYTES, MAX_HEAD_DIRECTIONS, ambisonic_filters, harmonics, head_band_hz,
    lattice,
};
use promenade_core::random::Random;
use promenade_core::{
    Axis, Facing, Field, FieldGrid, Head, HeadError, MeasuredHead, NoHeadError, Pose, Rows, Scene, SceneParts, TransferShape,
};
use promenade_fourier::num_complex::Complex32;
use promenade_fourier::signal;
use promenade_metrics::{ild_db, itd_s};
use promenade_testing::heads::{direction, sphere};
use promenade_testing::scenes;

const RADIUS_M: f32 = 0.0875;

fn at(azimuth_deg: f32, elevation_deg: f32) -> Vec3 {
    let (azimuth, elevation) = (azimuth_deg.to_radians(), elevation_deg.to_radians());
    Vec3::new(azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin())
}

fn ring(azimuths: impl IntoIterator<Item = i16>) -> Vec<HeadDirection> {
    azimuths.into_iter().map(|deg| direction(at(deg.into(), 0.0), RADIUS_M)).collect()
}

fn head(measured: Vec<HeadDirection>) -> Result<Head, HeadError> {
    Head::new("Ring", "nobody", measured)
}

#[test]
fn bytes_are_the_same_head_and_no_damage_passes() {
    let sphere = sphere(RADIUS_M);
    let bytes = sphere.to_bytes();
    assert!(bytes.len() < MAX_HEAD_BYTES, "{}", bytes.len());
    let again = Head::from_bytes(&bytes).unwrap();
    assert_eq!(again, sphere);
    assert_eq!(again.to_bytes(), bytes);
    for length in (0..bytes.len()).step_by(997).chain([bytes.len() - 1]) {
        assert!(Head::from_bytes(&bytes[..length]).is_err(), "{length} bytes");
    }
    for place in (0..bytes.len()).step_by(503) {
        let mut damaged = bytes.clone();
        damaged[place] ^= 0x10;
        let error = Head::from_bytes(&damaged).unwrap_err().to_string();
        assert!(error.contains("expected the bytes of one, found"), "{place}: {error}");
    }
}

#[test]
fn levels_are_equalised_and_delays_about_the_middle() {
    let mut measured: Vec<HeadDirection> = (0..500).map(|i| direction(lattice(i, 500), RADIUS_M)).collect();
    for m in &mut measured {
        // A loudspeaker that is 9 dB too loud and 3 ms away.
        m.levels_db.iter_mut().flatten().for_each(|level| *level += 9.0);
        m.delays_s.iter_mut().for_each(|delay| *delay += 0.003);
    }
    let moved = Head::new("Sphere", "nobody", measured).unwrap();
    let sphere = sphere(RADIUS_M);
    let (a, b) = (moved.ears(at(50.0, 20.0)), sphere.ears(at(50.0, 20.0)));
    assert!(a.delays_s.iter().zip(b.delays_s).all(|(a, b)| (a - b).abs() < 2e-7), "{a:?}");
    assert!(a.levels_db.iter().flatten().zip(b.levels_db.iter().flatten()).all(|(a, b)| (a - b).abs() < 0.3));
    let all = moved.around_db((0..300).map(|i| (lattice(i, 300), 1.0)));
    assert!(all.iter().all(|level| level.abs() < 0.3), "{all:?}");
}

#[test]
fn one_side_is_mirrored_and_a_ring_is_heard_above_by_its_lateral_angle() {
    let half = head(ring((0..=180).step_by(5))).unwrap();
    assert!(half.notes().iter().any(|n| n.contains("mirror image")), "{:?}", half.notes());
    let whole = head(ring((-175..=180).step_by(5))).unwrap();
    for (azimuth, elevation) in [(-60.0, 0.0), (40.0, 0.0), (90.0, 45.0)] {
        let (a, b) = (half.ears(at(azimuth, elevation)), whole.ears(at(azimuth, elevation)));
        assert!((a.itd_s() - b.itd_s()).abs() < 1e-6, "{azimuth} {elevation}: {} {}", a.itd_s(), b.itd_s());
    }
    let (above, beside) = (whole.ears(at(90.0, 45.0)), whole.ears(at(45.0, 0.0)));
    assert!((above.itd_s() - beside.itd_s()).abs() < 2e-6);
}

#[test]
fn what_is_no_head_is_refused_with_its_reason() {
    let wrong = |measured: Vec<HeadDirection>, clue: &str| {
        let error = head(measured).unwrap_err().to_string();
        assert!(error.contains(clue), "{error}");
    };
    wrong(Vec::new(), "directions: expected at least 12, found 0");
    wrong(
        ring((-90..=90).step_by(5)),
        "expected one within 45 degrees of every place around the head, found none within 50 degrees of azimuth 140",
    );
    let mut wide = ring((-175..=180).step_by(5));
    wide[3].delays_s = [0.003, 0.0];
    wrong(wide, "delays: expected less than 0.002 s between the ears");
    let mut broken = ring((-175..=180).step_by(5));
    broken[3].levels_db[1][7] = f32::NAN;
    wrong(broken, "finite numbers");
    let mut nowhere = ring((-175..=180).step_by(5));
    nowhere[3].direction = Vec3::ZERO;
    wrong(nowhere, "direction: expected one that is not zero");
}

#[test]
fn large_sets_are_thinned_out_evenly() {
    let measured = (0..3_000).map(|i| direction(lattice(i, 3_000), RADIUS_M)).collect();
    let thinned = head(measured).unwrap();
    assert_eq!(thinned.directions().len(), MAX_HEAD_DIRECTIONS);
    assert!(thinned.to_bytes().len() < MAX_HEAD_BYTES);
    let (found, wanted) = (thinned.ears(at(70.0, -30.0)).itd_s(), sphere(RADIUS_M).ears(at(70.0, -30.0)).itd_s());
    assert!((found - wanted).abs() < 10e-6, "{found} {wanted}");
}

#[test]
fn spectra_have_the_delay_and_the_levels_of_their_ears() {
    let sphere = sphere(RADIUS_M);
    for (azimuth, elevation) in [(0.0, 0.0), (35.0, 0.0), (90.0, 0.0), (-120.0, 30.0)] {
        let ears = sphere.ears(at(azimuth, elevation));
        for rate in [16_000.0, 48_000.0, 96_000.0] {
            let n_fft = 2_048;
            let time = ears.spectra(n_fft, rate).map(|spectrum| {
                let mut time = signal(spectrum, n_fft);
                time.rotate_right(256);
                time
            });
            let itd = itd_s(&time[0], &time[1], rate).unwrap();
            assert!(
                (itd - f64::from(ears.itd_s())).abs() < 6e-6,
                "{azimuth} {elevation} at {rate} Hz: {itd} for {}",
                ears.itd_s()
            );
            let broad = ild_db(&time[0], &time[1]).unwrap();
            assert!(azimuth == 0.0 || broad * f64::from(azimuth) > 0.0, "{azimuth}: {broad} dB");
        }
    }
}

fn parts() -> SceneParts {
    scenes::room(16_000.0, 0.4, 0.05).parts().clone()
}

/// Both ears' response of the direct sound at a pose.
fn direct(scene: &Scene, pose: &Pose) -> [Vec<f32>; 2] {
    let tf = scene.field().unwrap().decode(pose);
    let (grid, bins) = (scene.grid(), scene.shape().bins);
    [0, 1].map(|ear| {
        let sign = if ear == 0 { -1.0 } else { 1.0 };
        let spectrum = (0..bins).map(|k| {
            let delay = std::f64::consts::TAU * grid.bin_hz(k) * f64::from(tf.delay_s) * if ear == 0 { -0.5 } else { 0.5 };
            let gain = (1.0 + sign * tf.difference[k]) * tf.mixture[k];
            Complex32::from_polar(gain, tf.phase[ear * bins + k] + delay as f32)
        });
        let mut time = signal(spectrum.collect(), grid.n_fft);
        time.rotate_right(grid.n_fft / 4);
        time
    })
}

#[test]
fn the_direct_sound_takes_the_heads_delay_and_levels() {
    let scene = Scene::new(parts()).unwrap();
    let wide = sphere(0.105);
    let heard = scene.with_head(&wide).unwrap();
    // Nodes of the field, of which one lies at a turn of 10 degrees.
    for azimuth in [-170.0_f32, -90.0, -40.0, 0.0, 10.0, 60.0, 130.0] {
        let pose = Pose::from_ypr(Vec3::ZERO, -azimuth.to_radians(), 0.0, 0.0);
        let ears = wide.ears(at(azimuth, 0.0));
        let [left, right] = direct(&heard, &pose);
        let itd = itd_s(&left, &right, 16_000.0).unwrap();
        assert!((itd - f64::from(ears.itd_s())).abs() < 8e-6, "{azimuth}: {itd} s for {}", ears.itd_s());
        let tf = heard.field().unwrap().decode(&pose);
        let k = 60;
        let found = 20.0 * ((1.0 - tf.difference[k]) / (1.0 + tf.difference[k])).log10();
        let hz = heard.grid().bin_hz(k);
        let level = |ear: usize| promenade_core::head::at_hz(&ears.levels_db[ear], hz);
        assert!((found - (level(0) - level(1))).abs() < 0.2, "{azimuth}: {found} dB at {hz} Hz");
    }
    assert_eq!(heard.shape(), scene.shape());
    assert_eq!(heard.parts().anchors, scene.parts().anchors);
}

#[test]
fn another_head_does_not_ring_before_the_direct_sound() {
    // An emitter's all-pass, and phases that no two directions and ears have in common, all of them wrapped.
    let mut parts = parts();
    let field = parts.field.take().unwrap();
    let (shape, Rows::Whole(own)) = (field.shape(), field.rows()) else { panic!("whole rows") };
    let (bins, mut rows, mut random) = (shape.bins, own.clone(), Random::new(4));
    for row in rows.chunks_exact_mut(shape.row_len()) {
        for (i, phase) in row[2 * bins..4 * bins].iter_mut().enumerate() {
            let hz = parts.grid.bin_hz(i % bins) as f32;
            let turned = *phase - 2.0 * (hz / 1_500.0).atan() + 0.5 * random.normal();
            *phase = turned.sin().atan2(turned.cos());
        }
    }
    let with_head = |rows: Vec<f32>| {
        let field = Field::new(field.grid().clone(), shape, Rows::Whole(rows));
        Scene::new(SceneParts { field, ..parts.clone() }).unwrap().with_head(&sphere(RADIUS_M)).unwrap()
    };
    let [clean, turned] = [own.clone(), rows].map(with_head);
    // Energy more than a millisecond before an ear's onset over its first 2.5 ms, dB.
    let early_db = |ear: &Vec<f32>| {
        let peak = ear.iter().fold(0.0_f32, |peak, v| peak.max(v.abs()));
        let onset = ear.iter().position(|v| v.abs() > 0.1 * peak).unwrap();
        let energy = |part: &[f32]| part.iter().map(|v| v * v).sum::<f32>();
        10.0 * (energy(&ear[..onset - 16]) / energy(&ear[onset..onset + 40])).log10()
    };
    for azimuth in [-90.0_f32, -40.0, 0.0, 60.0, 180.0] {
        let pose = Pose::from_ypr(Vec3::ZERO, -azimuth.to_radians(), 0.0, 0.0);
        for (turned, clean) in direct(&turned, &pose).iter().zip(&direct(&clean, &pose)) {
            let (found, least) = (early_db(turned), early_db(clean));
            assert!(found < least.max(-40.0) + 3.0, "{azimuth}: {found:.1} dB, {least:.1} dB without those phases");
        }
    }
}

#[test]
fn the_room_takes_the_ratio_of_the_heads_in_a_diffuse_field() {
    let louder_left = |db: f32| {
        let mut measured: Vec<HeadDirection> = (0..500).map(|i| direction(lattice(i, 500), RADIUS_M)).collect();
        measured.iter_mut().for_each(|m| m.levels_db[0].iter_mut().for_each(|level| *level += db));
        Head::new("Uneven", "nobody", measured).unwrap()
    };
    let mut parts = parts();
    let field = parts.field.clone().unwrap();
    parts.measured_head = Some(MeasuredHead::of(&louder_left(2.0), field.grid(), |d| d));
    let scene = Scene::new(parts).unwrap();
    let ratio_db = |head: &Head| {
        let taps = |scene: &Scene| scene.field().unwrap().decode(&Pose::IDENTITY);
        let (old, new, bands) = (taps(&scene), taps(&scene.with_head(head).unwrap()), scene.shape().bands);
        [0, 1].map(|ear| {
            [
                20.0 * (new.taps[ear * bands + 5] / old.taps[ear * bands + 5]).log10(),
                20.0 * (new.late[ear * bands + 5] / old.late[ear * bands + 5]).log10(),
            ]
        })
    };
    for [tap, late] in ratio_db(&louder_left(2.0)) {
        assert!(tap.abs() < 0.3 && late.abs() < 0.3, "the measured head changes nothing: {tap} {late} dB");
    }
    let [[left, _], [right, _]] = ratio_db(&louder_left(6.0));
    assert!((left - right - 4.0).abs() < 0.5, "{left} {right} dB");
}

#[test]
fn the_emitters_level_is_that_of_the_measured_head_where_it_is_known() {
    // A field of one sphere, a head that is 6 dB brighter from ahead on.
    let mut parts = parts();
    let field = parts.field.clone().unwrap();
    let mut known = MeasuredHead::of(&sphere(RADIUS_M), field.grid(), |d| d);
    known.around_db.iter_mut().for_each(|level| *level += 6.0);
    let level = |parts: SceneParts| {
        let scene = Scene::new(parts).unwrap().with_head(&sphere(RADIUS_M)).unwrap();
        scene.field().unwrap().decode(&Pose::IDENTITY).mixture[100]
    };
    let unknown = level(parts.clone());
    parts.measured_head = Some(known);
    let ratio_db = 20.0 * (level(parts) / unknown).log10();
    assert!((ratio_db + 6.0).abs() < 0.3, "{ratio_db} dB");
}

#[test]
fn direct_sound_and_room_in_tables_of_their_own_take_the_new_head() {
    let mut parts = parts();
    let whole = parts.field.take().unwrap();
    let (shape, Rows::Whole(rows)) = (whole.shape(), whole.rows()) else { panic!("whole rows") };
    let without = TransferShape { taps: 0, ..shape };
    let direct_rows =
        rows.chunks_exact(shape.row_len()).flat_map(|row| [&row[..shape.direct_len()], &vec![0.0; shape.tap_len()]].concat());
    parts.field = Field::new(whole.grid().clone(), without, Rows::Whole(direct_rows.collect()));
    let [yaw, pitch, roll] = [(); 3].map(|()| Axis::single(0.0));
    let nodes = FieldGrid { position: [(); 3].map(|()| Axis::single(0.0)), facing: Facing::Head { yaw, pitch, roll } };
    let row = [&[0.0], &rows[shape.direct_len()..shape.row_len()]].concat();
    parts.room = Field::new(nodes, TransferShape { bins: 0, ..shape }, Rows::Whole(row));
    let even = Head::new("Even", "nobody", (0..500).map(|i| direction(lattice(i, 500), RADIUS_M)).collect()).unwrap();
    parts.measured_head = Some(MeasuredHead::of(&even, whole.grid(), |d| d));
    let scene = Scene::new(parts).unwrap();
    let mut louder: Vec<HeadDirection> = (0..500).map(|i| direction(lattice(i, 500), 0.105)).collect();
    louder.iter_mut().for_each(|m| m.levels_db[0].iter_mut().for_each(|level| *level += 4.0));
    let louder = Head::new("Uneven", "nobody", louder).unwrap();
    let heard = scene.with_head(&louder).unwrap();
    let pose = Pose::from_ypr(Vec3::ZERO, -60.0_f32.to_radians(), 0.0, 0.0);
    let [left, right] = direct(&heard, &pose);
    let itd = itd_s(&left, &right, 16_000.0).unwrap();
    assert!((itd - f64::from(louder.ears(at(60.0, 0.0)).itd_s())).abs() < 8e-6, "{itd} s");
    let late = |scene: &Scene| scene.parts().room.as_ref().unwrap().decode(&pose).late;
    let db = |ear: usize| 20.0 * (late(&heard)[ear * shape.bands + 5] / late(&scene)[ear * shape.bands + 5]).log10();
    assert!((db(0) - db(1) - 4.0).abs() < 0.5, "{} {} dB", db(0), db(1));
    assert!(Scene::new(heard.parts().clone()).is_ok());
}

#[test]
fn bands_rise_and_scenes_without_directions_say_so() {
    assert!((1..HEAD_BANDS).all(|band| head_band_hz(band) > head_band_hz(band - 1)));
    assert!((54.0..57.0).contains(&head_band_hz(0)) && (19_000.0..20_000.0).contains(&head_band_hz(HEAD_BANDS - 1)));
    let mut parts = scenes::room_with_cloud(16_000.0, 0.4, 0.05).parts().clone();
    assert!(Scene::new(parts.clone()).unwrap().with_head(&sphere(RADIUS_M)).is_ok());
    parts.field = None;
    assert_eq!(Scene::new(parts).unwrap().with_head(&sphere(RADIUS_M)), Err(NoHeadError::NoField));
}

#[test]
fn third_order_hears_plane_waves_in_the_bass_and_diffuse_fields_everywhere() {
    let (sphere, n_fft, rate) = (sphere(RADIUS_M), 256, 16_000.0);
    let filters = sphere.ambisonic(3, Incidence::Diffuse, n_fft, rate);
    assert_eq!((filters.len(), filters[0][0].len()), (16, n_fft / 2 + 1));
    let bin_of = |hz: f64| (hz * n_fft as f64 / rate).round() as usize;
    let (mut error, mut energy) = (0.0, 0.0);
    let mut diffuse = [[0.0_f32; 2]; 2];
    for direction in (0..200).map(|i| lattice(i, 200)) {
        let (waves, wanted) = (harmonics(3, direction), sphere.ears(direction).spectra(n_fft, rate));
        let heard = |ear: usize, bin: usize| -> Complex32 { filters.iter().zip(&waves).map(|(f, y)| f[ear][bin] * y).sum() };
        for (ear, wanted) in wanted.iter().enumerate() {
            let bin = bin_of(600.0);
            error += (heard(ear, bin) - wanted[bin]).norm_sqr();
            energy += wanted[bin].norm_sqr();
            for (sums, bin) in diffuse.iter_mut().zip([bin_of(600.0), bin_of(5_000.0)]) {
                sums[0] += heard(ear, bin).norm_sqr();
                sums[1] += wanted[bin].norm_sqr();
            }
        }
    }
    assert!(error < 0.02 * energy, "{:.1} dB", 10.0 * (error / energy).log10());
    for [heard, wanted] in diffuse {
        assert!((10.0 * (heard / wanted).log10()).abs() < 0.3, "{heard} {wanted}");
    }
}

#[test]
fn filters_for_horizontal_sound_keep_its_level() {
    // Ears that hear a narrow ring about their height twice as loud: finer than the third order has it.
    let heard = |d: Vec3| [0, 1].map(|_| vec![Complex32::from(if d.z.abs() < 0.15 { 2.0 } else { 1.0 }); 8]);
    let level = |incidence: Incidence| -> f32 {
        let filters = ambisonic_filters(3, incidence, 1000.0, heard);
        let ring = (0..36_u8).map(|i| glam::Quat::from_rotation_z(f32::from(i) * 0.174_532_9) * Vec3::X);
        let energy =
            |d: Vec3| -> f32 { filters.iter().zip(harmonics(3, d)).map(|(f, y)| f[0][6] * y).sum::<Complex32>().norm_sqr() };
        10.0 * (ring.map(energy).sum::<f32>() / (36.0 * 4.0)).log10()
    };
    let [diffuse, horizontal] = [Incidence::Diffuse, Incidence::Horizontal].map(level);
    assert!(diffuse < -2.0 && horizontal.abs() < 1.0, "{diffuse} dB, {horizontal} dB");
}

#[test]
fn image_sources_are_heard_with_the_new_head() {
    let mut parts = scenes::room_with_images(16_000.0, 0.4, 0.05, 8).parts().clone();
    let images = parts.images.as_mut().unwrap();
    images.head.lead = 24;
    let (own, length) = (images.clone(), images.head.len());
    let wide = sphere(0.105);
    let heard = Scene::new(parts).unwrap().with_head(&wide).unwrap();
    let found = heard.images().unwrap();
    assert_eq!((&found.images, &found.seen, found.head.len(), found.head.lead), (&own.images, &own.seen, length, 24));
    assert!(Scene::from_bytes(&heard.to_bytes().unwrap()).is_ok());
    for azimuth in [-60.0_f32, 30.0] {
        let waves = harmonics(3, at(azimuth, 0.0));
        let ears = [0, 1].map(|ear| -> Vec<f32> {
            let channel = |c: usize| &found.head.filters[(2 * c + ear) * length..][..length];
            (0..length).map(|i| waves.iter().enumerate().map(|(c, y)| y * channel(c)[i]).sum()).collect()
        });
        let itd = itd_s(&ears[0], &ears[1], 16_000.0).unwrap();
        // Third order resolves the ears up to 1.9 kHz.
        assert!((itd - f64::from(wide.ears(at(azimuth, 0.0)).itd_s())).abs() < 40e-6, "{azimuth}: {itd}");
    }
}
