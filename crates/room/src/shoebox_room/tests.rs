use super::*;
use promenade_acoustics::{Air, Image, Material, SPEED_OF_SOUND_M_S};
use promenade_core::{ImageSource, Rows};

fn head() -> SceneHead {
    let bytes = include_bytes!("../../../../presets/library/dry-studio.promenade");
    SceneHead::of_scene(&Scene::from_bytes(bytes).unwrap()).unwrap()
}

fn room(absorption: f32, scattering: f32) -> ShoeboxRoom {
    let materials = std::array::from_fn(|_| Material::even("wall", absorption, scattering));
    ShoeboxRoom {
        walls: Shoebox { size: [7.0, 5.0, 3.0], materials },
        corner: Vec3::new(-2.0, -1.0, -1.2),
        emitter: Vec3::new(1.1, 1.3, 0.7),
    }
}

fn options() -> SceneOptions {
    SceneOptions {
        images: 60,
        air: Air::default(),
        waves_hz: Some(0.0),
        layer_m: None,
        gain_db: 0.0,
        seed: 1,
        title: "Room".to_owned(),
        recipe: String::new(),
    }
}

#[test]
fn a_scene_has_the_images_of_its_box() {
    let room = room(0.2, 0.1);
    let scene = room.scene(&head(), &options()).unwrap();
    let images = scene.images().unwrap();
    let source = (room.emitter - room.corner).as_dvec3();
    let corner = room.corner.as_dvec3();
    let exact = room.walls.images(source.to_array(), 6, Reflected::Specular).unwrap();
    let middle = |gains: &[f32; 7]| gains[3];
    // One gain for all images, but for what the third order leaves of the head's levels.
    let (head, (_, places)) = (head(), cells(room.walls.size, room.corner));
    let levels = |image: &ImageSource| {
        let sines = places.at.iter().map(|at| (image.position.as_dvec3() - *at).normalize().z);
        head.image_gains(sines.sum::<f64>() / places.at.len() as f64)
    };
    let mut gain = None;
    let mut first = 0;
    for image in &images.images {
        let near = |e: &&Image| (DVec3::from(e.position) + corner).distance(image.position.as_dvec3());
        let of = exact.iter().min_by(|a, b| near(a).total_cmp(&near(b))).unwrap();
        let late_s = near(&of) / SPEED_OF_SOUND_M_S;
        assert!(late_s < 1e-6, "{late_s} s beside an image");
        let levels = levels(image);
        let gain = *gain.get_or_insert(middle(&image.gains) / (middle(&levels) * middle(&of.gains)));
        for ((found, exact), level) in image.gains.iter().zip(of.gains).zip(levels) {
            assert!((20.0 * (found / (gain * level * exact)).log10()).abs() < 0.01);
            assert!((20.0 * level.log10()).abs() < 3.0, "{level}");
        }
        first += usize::from(of.order == 1);
    }
    assert_eq!((images.images.len(), first), (60, 6));
    assert!(images.seen.iter().all(|s| *s == 1.0));
    assert_eq!(scene.emitter(), Some(room.emitter));
}

#[test]
fn the_head_of_any_scene_is_brought_to_one_level() {
    let head = head();
    let scene = room(0.2, 0.1).scene(&head, &options()).unwrap();
    // A scene whose gain is known: that of its direct sound is that of its images.
    let again = SceneHead::of_scene(&scene).unwrap();
    let direct = |r: &SceneHead| r.direct(Vec3::ZERO, 1.0).unwrap();
    let (Rows::Whole(a), Rows::Whole(b)) = (direct(&head).rows().clone(), direct(&again).rows().clone()) else { panic!() };
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-3 * a.abs().max(0.01)));
    // Over all directions a head that is equalised for a diffuse field has a gain of 1; those far below are missing here.
    let bin = (700.0 / head.grid.bin_hz(1)).round() as usize;
    let row = head.shape.row_len();
    let rows = a.chunks_exact(row).enumerate();
    let (mut sum, mut weight) = (0.0, 0.0);
    for (node, row) in rows {
        let z = head.nodes.node(node).1.z;
        let level = (1.0 - z * z).max(0.0).sqrt();
        sum += level * row[bin].powi(2) * (1.0 + row[head.shape.bins + bin].powi(2));
        weight += level;
    }
    let db = 10.0 * (sum / weight).log10();
    assert!(db.abs() < 1.0, "{db} dB");
}

#[test]
fn sound_of_the_late_field_has_the_heads_level_where_it_comes_from() {
    let head = head();
    let mut echogram = Echogram { bin_s: 0.0025, bins: vec![promenade_acoustics::Bin::default(); 40] };
    let energy = [1.0; 7];
    echogram.add(0.011, &energy, [0.0, 0.0, 1.0]);
    echogram.add(0.031, &energy, [0.6, 0.8, 0.0]);
    echogram.add(0.051, &energy, [0.0; 3]);
    let late = LateEnergies::of(&echogram, 0.0, &head);
    let heard = &late.energies;
    let hop = |time_s: f64| (time_s / head.grid.hop_s() + 0.25) as usize;
    let sum = |time_s: f64, band: usize| heard[hop(time_s)..=hop(time_s) + 1].iter().map(|e| e[band]).sum::<f64>();
    let mut apart = 0.0_f64;
    let [above, level]: [Vec<f64>; 2] = [1.0, 0.0].map(|sine| head.heard_from(sine).collect());
    for band in 0..head.bands.count() {
        let found = [0.010, 0.030, 0.050].map(|time_s| sum(time_s, band));
        for (found, want) in found.iter().zip([above[band], level[band], 1.0]) {
            assert!((found / want - 1.0).abs() < 1e-6, "band {band}: {found}, {want}");
        }
        apart = apart.max((above[band] / level[band] - 1.0).abs());
    }
    assert!(apart > 0.1, "{apart}");
    // An image that is not played is the same energy in one hop.
    let mut one = late.clone();
    one.add(0.031, DVec3::X, (2.0, &[2.0; 7]), &head, |_| 1.0);
    let (here, there) = (&one.energies[hop(0.031)], &heard[hop(0.031)]);
    assert!(here.iter().zip(there).zip(&level).all(|((one, all), level)| ((one - all) / (2.0 * level) - 1.0).abs() < 1e-9));
    assert_eq!(one.vectors[hop(0.031)].energy - late.vectors[hop(0.031)].energy, 14.0);
}

#[test]
fn the_late_part_decays_after_eyring() {
    let head = head();
    let band = head.bands.centres_hz().iter().position(|hz| *hz > 950.0).unwrap();
    for absorption in [0.05, 0.1, 0.2, 0.4] {
        let room = room(absorption, 0.5);
        let t60 = f64::from(room.scene(&head, &options()).unwrap().tail().t60_s[band]);
        let eyring = room.walls.eyring_t60_s(Some(Air::default()))[3];
        println!("absorption {absorption}: {t60:.3} s, Eyring {eyring:.3} s: {:+.1} %", 100.0 * (t60 / eyring - 1.0));
        assert!((t60 / eyring - 1.0).abs() < 0.1, "{absorption}: {t60} s, Eyring {eyring} s");
    }
}

#[test]
fn extreme_rooms_make_scenes_and_impossible_ones_errors() {
    let head = head();
    let with = |size: [f64; 3], absorption: f32, emitter: Vec3| {
        let mut room = room(absorption, 0.1);
        (room.walls.size, room.corner, room.emitter) = (size, Vec3::ZERO, emitter);
        room.scene(&head, &options())
    };
    for (size, absorption) in
        [([0.5; 3], 0.1), ([1.0, 1.0, 2.0], 0.0), ([200.0; 3], 0.02), ([200.0, 0.5, 200.0], 0.0), ([6.0, 5.0, 3.0], 1.0)]
    {
        let emitter = Vec3::from_array(size.map(|s| 0.3 * s as f32));
        let scene = with(size, absorption, emitter).unwrap();
        let bytes = scene.to_bytes().unwrap();
        assert!(Scene::from_bytes(&bytes).is_ok(), "{size:?}");
        assert!(scene.playable_at(48_000.0).is_ok());
        let at = scene.start_pose().position;
        assert!(at.cmpgt(Vec3::ZERO).all() && (0..3).all(|a| f64::from(at[a]) < size[a]), "{at}");
    }
    for wrong in [0.0, -3.0, 0.49, 1e9, f64::NAN, f64::INFINITY] {
        let error = with([5.0, wrong, 3.0], 0.1, Vec3::ONE).unwrap_err().to_string();
        assert!(error.starts_with("size of the room: expected three lengths of 0.5 to 200 m, found"), "{error}");
    }
    for wrong in [Vec3::new(9.0, 1.0, 1.0), Vec3::ZERO, Vec3::splat(f32::NAN), Vec3::splat(1e30)] {
        let error = with([5.0, 4.0, 3.0], 0.1, wrong).unwrap_err().to_string();
        assert!(error.starts_with("emitter: expected inside the room"), "{error}");
    }
    let error = with([5.0, 4.0, 3.0], 1.5, Vec3::ONE).unwrap_err().to_string();
    assert!(error.contains("absorption of wall: expected 0 to 1, found 1.5"), "{error}");
    assert!(ShoeboxRoom { corner: Vec3::splat(f32::NAN), ..room(0.1, 0.1) }.scene(&head, &options()).is_err());
}

#[test]
fn the_late_sound_comes_from_the_hard_wall() {
    // All walls but the left one, y at its greatest, absorb; scattered, so that images have little of it.
    let mut room = room(0.7, 0.9);
    room.walls.materials[3] = Material::even("hard", 0.02, 0.9);
    let head = head();
    let late = room.surfaces(&head, &options()).unwrap().late;
    let shape = TransferShape { bins: 0, bands: head.bands.count(), taps: 12 };
    let rows = vec![vec![1.0; shape.tap_len() * (shape.taps + 1)]; late.len()];
    let (yaw, turned) = Modelled { head: &head }.turned(rows, &late, shape);
    assert_eq!((yaw.count(), turned.len()), (6, late.len()));
    // Mean energy from about 1 kHz on at an ear of a head that is turned so.
    let heard = |turn: usize, ear: usize| -> f32 {
        let of_tap =
            |tap: &[f32]| tap[ear * shape.bands..][shape.bands / 2..shape.bands - 4].iter().map(|g| g * g).sum::<f32>();
        turned.iter().map(|place| place[turn].chunks_exact(shape.tap_len()).skip(3).map(of_tap).sum::<f32>()).sum()
    };
    let db = |ears: [f32; 2]| 10.0 * (ears[0] / ears[1]).log10();
    let [behind, ahead] = [0, 3].map(|turn| db([heard(turn, 0), heard(turn, 1)]));
    assert!(yaw.nodes()[3].abs() < 1e-5 && ahead > 0.5 && behind < -0.5, "{ahead} and {behind} dB");
    let whole = db([0, 1].map(|ear| (0..6).map(|turn| heard(turn, ear)).sum()));
    assert!(whole.abs() < 0.3, "{whole} dB over all turns");
}
