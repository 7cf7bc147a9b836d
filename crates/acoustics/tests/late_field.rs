//! The energy of rays, against theory.

use crate::common::{LISTENERS, SOURCE, bumpy, l_room, shoebox};
use glam::DVec3;
use promenade_acoustics::{
    BANDS, Directivity, ImageOptions, Images, LateField, Material, Measures, ParticleOptions, RayOptions, Reflected, Room,
    SPEED_OF_SOUND_M_S, Shoebox, Source, late_field,
};

/// Rays bring all but the direct sound, through no air.
fn alone(rays: usize, length_s: f64) -> RayOptions<'static> {
    RayOptions { rays, length_s, images: None, air: None, bin_s: 0.002, ..RayOptions::default() }
}

fn room(absorption: f32, scattering: f32) -> Room {
    let walls = shoebox(absorption, scattering);
    Room::new(&walls.mesh().unwrap(), &walls.materials).unwrap()
}

fn traced(room: &Room, listeners: &[[f64; 3]], options: &RayOptions<'_>) -> LateField {
    late_field(room, SOURCE, listeners, options, |_| ()).unwrap()
}

#[test]
fn walls_that_absorb_nothing_keep_all_energy() {
    for scattering in [0.0, 0.5, 1.0] {
        let field = traced(&room(0.0, scattering), &[], &alone(2000, 1.0));
        for band in 0..BANDS {
            assert!((field.remaining[band] - 1.0).abs() < 1e-4, "{field:?}");
            assert!(field.absorbed[band] == 0.0 && field.escaped[band] == 0.0, "{field:?}");
        }
        // 4 V / S.
        assert!((field.mean_free_path_m / (4.0 * 105.0 / 142.0) - 1.0).abs() < 0.03, "{} m", field.mean_free_path_m);
    }
    let field = traced(&room(1.0, 0.5), &LISTENERS, &alone(2000, 1.0));
    assert!(field.absorbed.iter().all(|a| (a - 1.0).abs() < 1e-6));
    assert!(field.echograms.iter().all(|e| e.energy(3) == 0.0), "the direct sound is an image's");
}

#[test]
fn a_cardioid_sends_a_third_of_the_energy_into_the_room() {
    let room = room(0.1, 0.5);
    let cardioid = Source { position: SOURCE, directivity: Directivity::first_order(0.5).turned(1.0, 0.3) };
    let of = |source: &Source| late_field(&room, source, &LISTENERS, &alone(16_384, 1.0), |_| ()).unwrap();
    let (directive, omni) = (of(&cardioid), of(&SOURCE.into()));
    let energy = |field: &LateField| -> f64 {
        // Once the sound has met some walls it has forgotten where it was sent.
        field.echograms.iter().flat_map(|e| &e.bins[100..]).map(|bin| f64::from(bin.energy[3])).sum()
    };
    let db = 10.0 * (energy(&directive) / energy(&omni)).log10();
    assert!((db + 10.0 * 3.0_f64.log10()).abs() < 0.2, "{db} dB");
    let shares = |field: &LateField| f64::from(field.absorbed[3] + field.escaped[3] + field.remaining[3]);
    assert!((shares(&directive) - 1.0).abs() < 1e-4 && (shares(&omni) - 1.0).abs() < 1e-4);
}

#[test]
fn rooms_decay_after_eyring_and_more_closely_after_kuttruff() {
    // The more a wall absorbs, the further Eyring's time is off, per cent.
    for (absorption, off) in [(0.05_f32, 1.5), (0.1, 3.0), (0.2, 5.0), (0.4, 9.0)] {
        let eyring = 24.0 * std::f64::consts::LN_10 / SPEED_OF_SOUND_M_S * 105.0 / (142.0 * -f64::from(1.0 - absorption).ln());
        let mut field = traced(&room(absorption, 0.5), &LISTENERS, &alone(4096, 1.2 * eyring));
        for (echogram, listener) in field.echograms.iter_mut().zip(&LISTENERS) {
            let distance = (0..3).map(|a| (SOURCE[a] - listener[a]).powi(2)).sum::<f64>().sqrt();
            echogram.add(distance / SPEED_OF_SOUND_M_S, &[1.0 / (distance * distance) as f32; BANDS], [1.0, 0.0, 0.0]);
        }
        let t30: Vec<f64> = field.echograms.iter().map(|e| e.t30_s(3).unwrap()).collect();
        let mean = t30.iter().sum::<f64>() / t30.len() as f64;
        // Kuttruff's correction of Eyring's decay for ways of different lengths ("Room Acoustics", equation 5.24 of the fifth
        // edition): at much absorption the long ways, on which less is absorbed a second, last longest.
        let kuttruff = eyring / (1.0 + 0.5 * field.path_variance * f64::from(1.0 - absorption).ln());
        let [to_eyring, to_kuttruff] = [eyring, kuttruff].map(|t| 100.0 * (mean / t - 1.0));
        println!("absorption {absorption}: T30 {to_eyring:+.1} % of Eyring's {eyring:.3} s, {to_kuttruff:+.1} % of Kuttruff's");
        assert!(to_kuttruff.abs() < 3.5, "{t30:?} for {kuttruff}");
        assert!((0.0..off).contains(&to_eyring) && to_kuttruff.abs() < to_eyring, "{t30:?} for {eyring}");
    }
}

#[test]
fn spheres_collect_the_energy_of_the_images() {
    // Of mirrors alone, the first 40 ms: order 12 is enough.
    let walls = shoebox(0.3, 0.0);
    let images = walls.images(SOURCE, 14, Reflected::Whole).unwrap();
    let field = traced(&room(0.3, 0.0), &LISTENERS, &alone(60_000, 0.04));
    for (listener, echogram) in LISTENERS.iter().zip(&field.echograms) {
        let far = |i: &[f64; 3]| (0..3).map(|a| (i[a] - listener[a]).powi(2)).sum::<f64>();
        let near = |d2: f64| d2.sqrt() < 0.04 * SPEED_OF_SOUND_M_S;
        let expected: f64 = images[1..]
            .iter()
            .map(|i| (far(&i.position), f64::from(i.gains[0]).powi(2)))
            .filter(|i| near(i.0))
            .map(|(d2, g2)| g2 / d2)
            .sum();
        let db = 10.0 * (echogram.energy(0) / expected).log10();
        assert!(db.abs() < 0.5, "{db} dB at {listener:?}");
    }
}

#[test]
fn images_and_rays_share_the_energy() {
    // Everything, from rays alone, and from images with the rays' rest.
    let (absorption, scattering) = (0.2, 0.3);
    let (walls, room) = (shoebox(absorption, scattering), room(absorption, scattering));
    let whole = traced(&room, &LISTENERS, &alone(30_000, 0.6));
    let found = Images::new(&room, SOURCE, &ImageOptions { order: 4, ..ImageOptions::default() }).unwrap();
    let options = RayOptions { images: Some(&found), ..alone(30_000, 0.6) };
    let rest = traced(&room, &LISTENERS, &options);
    let images = walls.images(SOURCE, 4, Reflected::Specular).unwrap();
    let (mut of_whole, mut of_both) = (0.0, 0.0);
    for ((listener, whole), rest) in LISTENERS.iter().zip(&whole.echograms).zip(&rest.echograms) {
        of_whole += whole.energy(2);
        let one = |i: &promenade_acoustics::Image| {
            f64::from(i.gains[2]).powi(2) / (0..3).map(|a| (i.position[a] - listener[a]).powi(2)).sum::<f64>()
        };
        of_both += rest.energy(2) + images[1..].iter().map(one).sum::<f64>();
    }
    let db = 10.0 * (of_both / of_whole).log10();
    assert!(db.abs() < 0.2, "{db} dB");
}

#[test]
fn a_scan_has_the_energy_of_the_flat_room() {
    // As a scan has walls: 43,200 triangles, moved by up to 5 mm, and nearly as many planes.
    let flat = scanned(0.0, false, 6).0;
    for order in [0, 2, 6] {
        let worst = worst(&scanned(0.005, false, order).0, &flat);
        println!("order {order}: level off by {:.2} dB, C50 by {:.2} dB at most", worst[0], worst[1]);
        assert!(worst.iter().all(|off| off.abs() < 0.5), "order {order}: {worst:?}");
    }
}

#[test]
fn a_scan_that_is_flattened_is_the_flat_room() {
    let (flat, first) = scanned(0.0, false, 6);
    assert!(first.iter().all(|images| images.len() == 7), "the source and six walls");
    for bump in [0.001, 0.005, 0.020] {
        let (found, images) = scanned(bump, true, 6);
        let worst = worst(&found, &flat);
        println!("{bump} m: level off by {:.2} dB, C50 by {:.2} dB at most", worst[0], worst[1]);
        assert!(worst.iter().all(|off| off.abs() < 0.5), "{bump}: {worst:?}");
        for (found, wanted) in images.iter().zip(&first) {
            assert_eq!(found.len(), wanted.len(), "{bump}");
            for image in wanted {
                let near = found.iter().map(|other| other.distance(*image)).fold(f64::INFINITY, f64::min);
                // The walls' mean is half of the noise inside.
                assert!(near < 1.5 * bump + 1e-9, "{bump}: {near} m from {image}");
            }
        }
    }
}

/// A room whose walls are 43,200 triangles, moved by up to `bump` metres, perhaps flattened: what is measured in it, and the
/// places of the images up to first order.
fn scanned(bump: f64, flatten: bool, order: u32) -> (Vec<Measures>, Vec<Vec<DVec3>>) {
    let mut mesh = bumpy([7.0, 5.0, 3.0], 60, bump);
    if flatten {
        let done = mesh.flatten(None).unwrap();
        println!("{done}");
        assert_eq!(done.planes, 6);
    }
    let room = Room::new(&mesh, &[Material::even("wall", 0.2, 0.1)]).unwrap();
    let images = Images::new(&room, SOURCE, &ImageOptions { order, ..ImageOptions::default() }).unwrap();
    let options = RayOptions { images: Some(&images), bin_s: 0.004, ..alone(16_384, 0.5) };
    let late = traced(&room, &LISTENERS, &options);
    let seen = |at: &[f64; 3]| images.seen_from(&room, *at, Reflected::Specular).unwrap();
    let measures = LISTENERS.iter().zip(&late.echograms).map(|(at, echogram)| Measures::new(*at, &seen(at), echogram, None));
    let early = |at: &[f64; 3]| {
        let early = seen(at).into_iter().filter(|image| image.order <= 1);
        early.map(|image| DVec3::from(image.position)).collect()
    };
    (measures.collect(), LISTENERS.iter().map(early).collect())
}

/// How far level and C50 are off at the worst of all places, dB.
fn worst(found: &[Measures], wanted: &[Measures]) -> [f64; 2] {
    let mut worst = [0.0_f64; 2];
    for (found, wanted) in found.iter().zip(wanted) {
        let off = [found.level_db.unwrap() - wanted.level_db.unwrap(), found.c50_db.unwrap() - wanted.c50_db.unwrap()];
        worst.iter_mut().zip(off).for_each(|(worst, off)| *worst = if off.abs() > worst.abs() { off } else { *worst });
    }
    worst
}

#[test]
fn rays_know_what_walls_take_at_63_hz() {
    let mut walls = shoebox(0.1, 0.3);
    let options = RayOptions { air: None, ..alone(20_000, 0.6) };
    let traced = |walls: &Shoebox| {
        let room = Room::new(&walls.mesh().unwrap(), &walls.materials).unwrap();
        traced(&room, &LISTENERS, &options).echograms.remove(0)
    };
    let plain = traced(&walls);
    assert!(plain.bins.iter().all(|bin| bin.energy_63 == bin.energy[0]), "as at 125 Hz where nothing is stated");
    walls.materials.iter_mut().for_each(|m| m.absorption_63 = Some(0.4));
    let soft = traced(&walls);
    let fall = |energy: &dyn Fn(usize) -> f64| {
        let sum = |bins: std::ops::Range<usize>| bins.map(energy).sum::<f64>();
        (sum(10..30) / sum(60..80)).ln()
    };
    // Eyring: exponents of .105 and .511.
    let [low, next] = [fall(&|i| soft.bins[i].energy_63.into()), fall(&|i| soft.bins[i].energy[0].into())];
    assert!((low / next / (0.6_f64.ln() / 0.9_f64.ln()) - 1.0).abs() < 0.15, "{low} beside {next}");
    // Particles of a box as well.
    let particles = ParticleOptions { particles: 20_000, length_s: 0.4, bin_s: 0.004, cells: [1; 3], air: None, seed: 1 };
    let field = walls.late_field(SOURCE, &[], &particles).unwrap().remove(0);
    let [low, next] = [fall(&|i| field.bins[i].energy_63.into()), fall(&|i| field.bins[i].energy[0].into())];
    assert!((low / next / (0.6_f64.ln() / 0.9_f64.ln()) - 1.0).abs() < 0.15, "{low} beside {next} of particles");
}

#[test]
fn each_octave_is_scattered_by_its_own_share() {
    let mut walls = shoebox(0.2, 0.0);
    for m in &mut walls.materials {
        m.scattering = [0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9];
    }
    let room = Room::new(&walls.mesh().unwrap(), &walls.materials).unwrap();
    let found = Images::new(&room, SOURCE, &ImageOptions { order: 1, ..ImageOptions::default() }).unwrap();
    let options = RayOptions { images: Some(&found), ..alone(40_000, 0.05) };
    // What images of the first order lack is at the rays.
    let both = traced(&room, &LISTENERS, &options);
    let whole = traced(&room, &LISTENERS, &RayOptions { images: None, ..options });
    let images = walls.images(SOURCE, 1, Reflected::Specular).unwrap();
    for band in [0, 3, 6] {
        let (mut with_images, mut alone) = (0.0, 0.0);
        for (i, listener) in LISTENERS.iter().enumerate() {
            let d2 = |p: &[f64; 3]| (0..3).map(|a| (p[a] - listener[a]).powi(2)).sum::<f64>();
            let shared: f64 = images[1..].iter().map(|i| f64::from(i.gains[band]).powi(2) / d2(&i.position)).sum();
            with_images += both.echograms[i].energy(band) + shared;
            alone += whole.echograms[i].energy(band);
        }
        let db = 10.0 * (with_images / alone).log10();
        assert!(db.abs() < 0.3, "{db} dB in band {band}");
    }
}

#[test]
fn twice_the_rays_have_half_the_variance() {
    let room = room(0.2, 0.5);
    let variance = |rays: usize| {
        let energies: Vec<Vec<f64>> = (0..48)
            .map(|seed| {
                let options = RayOptions { seed: seed + 1000 * rays as u64, ..alone(rays, 0.4) };
                // Later than what only the lattice spreads.
                traced(&room, &LISTENERS, &options)
                    .echograms
                    .iter()
                    .map(|e| e.bins[20..].iter().map(|b| f64::from(b.energy[2])).sum())
                    .collect()
            })
            .collect();
        (0..LISTENERS.len())
            .map(|l| {
                let mean = energies.iter().map(|e| e[l]).sum::<f64>() / energies.len() as f64;
                energies.iter().map(|e| (e[l] / mean - 1.0).powi(2)).sum::<f64>() / (energies.len() - 1) as f64
            })
            .sum::<f64>()
    };
    let ratio = variance(500) / variance(1000);
    assert!((1.5..=2.5).contains(&ratio), "{ratio}");
}

#[test]
fn a_seed_is_the_same_on_any_number_of_threads() {
    let room = room(0.2, 0.4);
    let options = RayOptions { length_s: 0.2, ..alone(3000, 0.2) };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| traced(&room, &LISTENERS, &options))
    };
    let once = on(1);
    assert_eq!(once, on(3));
    assert_eq!(once, on(2));
    assert_ne!(once, traced(&room, &LISTENERS, &RayOptions { seed: 2, ..options }));
}

#[test]
fn what_leaves_is_counted_and_a_corridor_has_a_direction() {
    let mut mesh = shoebox(0.0, 0.0).mesh().unwrap();
    mesh.triangles.retain(|t| t.group != 5);
    let walls = shoebox(0.1, 0.3);
    let field = traced(&Room::new(&mesh, &walls.materials).unwrap(), &LISTENERS, &alone(4000, 1.0));
    assert!(field.escaped[0] > 0.4 && (field.escaped[0] + field.absorbed[0] + field.remaining[0] - 1.0).abs() < 1e-3);
    // One end of a corridor hears the other.
    let corridor = promenade_acoustics::Shoebox {
        size: [30.0, 1.5, 2.5],
        materials: std::array::from_fn(|i| Material::even("wall", if i < 2 { 0.9 } else { 0.05 }, 0.2)),
    };
    let room = Room::new(&corridor.mesh().unwrap(), &corridor.materials).unwrap();
    let field = late_field(&room, [1.0, 0.7, 1.2], &[[28.0, 0.8, 1.3]], &alone(20_000, 0.3), |_| ()).unwrap();
    let sum = |f: &dyn Fn(&promenade_acoustics::Bin) -> f32| field.echograms[0].bins.iter().map(f).sum::<f32>();
    let (energy, x, y) = (sum(&|b| b.energy[3]), sum(&|b| b.from[0][3]), sum(&|b| b.from[1][3]));
    assert!(x < -0.3 * energy && y.abs() < 0.1 * energy, "{energy} from {x}, {y}");
}

#[test]
fn air_takes_high_octaves() {
    let room = room(0.1, 0.5);
    let options = RayOptions { length_s: 1.0, ..alone(4000, 1.0) };
    let dry = traced(&room, &LISTENERS[..1], &options);
    let damp = traced(&room, &LISTENERS[..1], &RayOptions { air: Some(promenade_acoustics::Air::default()), ..options });
    let [without, with] = [&dry, &damp].map(|f| f.echograms[0].t30_s(6).unwrap());
    // Decays add: 24 ln 10 / (c T) by walls, and the air's.
    let decay = 6.0 * std::f64::consts::LN_10;
    let added = (decay / with - decay / without) / SPEED_OF_SOUND_M_S;
    let expected = f64::from(promenade_acoustics::Air::default().decay_per_m()[6]);
    assert!((added / expected - 1.0).abs() < 0.1, "{added} for {expected} per metre");
    assert!(damp.echograms[0].t30_s(0).unwrap() > 1.5 * with);
}

#[test]
fn extremes_are_numbers() {
    let room = room(0.1, 0.5);
    let finite = |field: &LateField| {
        for bin in field.echograms.iter().flat_map(|e| &e.bins) {
            assert!(bin.energy.iter().chain(bin.from.as_flattened()).all(|v| v.is_finite()), "{bin:?}");
        }
    };
    let places = [SOURCE, [0.0, 0.0, 0.0], [3.0, 2.0, 0.0], [50.0, 0.0, 0.0]];
    finite(&late_field(&room, SOURCE, &places, &alone(500, 0.2), |_| ()).unwrap());
    finite(&late_field(&room, [0.0, 2.0, 1.0], &places, &alone(500, 0.2), |_| ()).unwrap());
    let materials = [Material::even("wall", 0.3, 0.0)];
    let field =
        late_field(&Room::new(&l_room(), &materials).unwrap(), [9.0, 9.0, 9.0], &places, &alone(500, 0.1), |_| ()).unwrap();
    finite(&field);
    assert!(field.escaped[0] > 0.5);
    for bad in [
        RayOptions { rays: 0, ..alone(1, 1.0) },
        RayOptions { bin_s: 0.0, ..alone(1, 1.0) },
        RayOptions { bin_s: 1e-9, ..alone(1, 1.0) },
        RayOptions { length_s: f64::NAN, ..alone(1, 1.0) },
        RayOptions { radius_m: Some(0.0), ..alone(1, 1.0) },
    ] {
        assert!(late_field(&room, SOURCE, &places, &bad, |_| ()).is_err(), "{bad:?}");
    }
    assert!(late_field(&room, [f64::NAN; 3], &places, &alone(1, 1.0), |_| ()).is_err());
    assert!(late_field(&room, SOURCE, &[[f64::INFINITY; 3]], &alone(1, 1.0), |_| ()).is_err());
}
