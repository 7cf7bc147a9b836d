//! The map in the editor beside that of `promenade map` of the mesh that the scene was made of.

use promenade_acoustics::{Air, ImageOptions, Images, Materials, Measures, Mesh, RayOptions, Reflected, Room, late_field};
use promenade_core::Scene;
use promenade_plugin::answers::room_map::Mapped;
use promenade_plugin::answers::settled::Question;
use std::path::Path;
use std::sync::Arc;

/// As the command has them.
const RAYS: usize = 65_536;
const LENGTH_S: f64 = 2.0;
const BIN_S: f64 = 0.004;

/// Level, T20 and C50 of a mesh at places, as the command measures them.
fn traced(mesh: &Path, source: [f64; 3], places: &[[f64; 3]]) -> Vec<[Option<f64>; 3]> {
    let mesh = Mesh::load(mesh).unwrap();
    let materials = Materials::default().assign(&mesh.groups, &[]).unwrap();
    let room = Room::new(&mesh, &materials).unwrap();
    let images = Images::new(&room, source, &ImageOptions { order: 3, beams: 8192, ..ImageOptions::default() }).unwrap();
    let air = Some(Air::default());
    let rays = RayOptions {
        rays: RAYS,
        length_s: LENGTH_S,
        air,
        seed: 1,
        bin_s: BIN_S,
        images: Some(&images),
        ..RayOptions::default()
    };
    let late = late_field(&room, source, places, &rays, |_| ()).unwrap();
    let measures = |(at, echogram): (&[f64; 3], _)| {
        let seen = images.seen_from(&room, *at, Reflected::Specular).unwrap();
        let Measures { level_db, t20_s, c50_db, .. } = Measures::new(*at, &seen, echogram, air);
        [level_db, t20_s, c50_db]
    };
    places.iter().zip(&late.echograms).map(measures).collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Decibels count as shares of the range over the plan, times as shares of themselves.
#[test]
fn the_map_in_the_editor_is_that_of_the_mesh() {
    let presets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets");
    for (scene, mesh, source) in [
        ("scenes/loft.promenade", "scenes/loft.obj", [1.5, 0.0, 0.0]),
        ("library/club.promenade", "library/club.obj", [14.0, 5.5, 1.8]),
    ] {
        let loaded = Arc::new(Scene::from_bytes(&std::fs::read(presets.join(scene)).unwrap()).unwrap());
        let began = std::time::Instant::now();
        let mapped = Mapped { scene: Arc::downgrade(&loaded), trim: Default::default() };
        let map = mapped.answer(&|| true).unwrap().unwrap();
        println!("{scene}: {} places in {:.1} s", map.places.len(), began.elapsed().as_secs_f64());
        // A place of every seven, for the rays take longer.
        let some: Vec<_> = map.places.iter().step_by(7).collect();
        let places: Vec<_> = some.iter().map(|(place, _)| place.as_dvec3().to_array()).collect();
        let wanted = traced(&presets.join(mesh), source, &places);
        for (measure, (name, most)) in [("level", 0.05), ("T20", 0.05), ("C50", 0.06)].into_iter().enumerate() {
            let both: Vec<_> = some
                .iter()
                .zip(&wanted)
                .filter_map(|((_, found), wanted)| Some((f64::from(found[measure]?), wanted[measure]?)))
                .collect();
            assert!(both.len() * 10 > some.len() * 9, "{scene}: {name} is known at {} of {} places", both.len(), some.len());
            let (low, high) = both.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), (_, w)| (a.min(*w), b.max(*w)));
            let scale = |wanted: f64| if name == "T20" { wanted } else { high - low };
            let off = median(both.iter().map(|(found, wanted)| ((found - wanted) / scale(*wanted)).abs()).collect());
            let bias = median(both.iter().map(|(found, wanted)| (found - wanted) / scale(*wanted)).collect());
            println!(
                "{scene}: {name} {:.1} % off, {:+.1} % on the whole, from {low:.2} to {high:.2}",
                100.0 * off,
                100.0 * bias
            );
            assert!(off < most, "{scene}: {name} is {:.1} % off", 100.0 * off);
        }
    }
}
