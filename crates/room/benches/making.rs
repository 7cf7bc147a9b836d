//! Processor time of making a drawn room's scene and what plays it, on one core.

#![expect(clippy::unwrap_used, reason = "a bench may panic")]

use cpu_time::ThreadTime;
use promenade_acoustics::{Air, Materials, Shoebox};
use promenade_core::glam::Vec3;
use promenade_core::{Carriers, Renderer, Scene};
use promenade_room::{SceneHead, SceneOptions, ShoeboxRoom};
use std::sync::Arc;

const RUNS: u32 = 10;

fn main() {
    let began = ThreadTime::now();
    let bytes = include_bytes!("../../../presets/library/dry-studio.promenade");
    let head = SceneHead::of_scene(&Scene::from_bytes(bytes).unwrap()).unwrap();
    println!("the head, once: {:.1} ms", 1e3 * began.elapsed().as_secs_f64());
    let table = Materials::default();
    for (name, size, materials) in [
        (
            "living room",
            [6.0, 4.6, 2.7],
            ["plasterboard", "plasterboard", "curtains_cotton_0.5", "plasterboard", "carpet_thin", "plasterboard"],
        ),
        ("closet of tiles", [1.0, 1.0, 2.0], ["ceramic_tiles"; 6]),
        ("hall of plaster", [30.0, 20.0, 12.0], ["rough_lime_wash"; 6]),
        ("hangar of concrete", [200.0, 120.0, 40.0], ["rough_concrete"; 6]),
    ] {
        let walls = Shoebox { size, materials: materials.map(|name| table.material(name).unwrap()) };
        let emitter = 0.3 * Vec3::from_array(size.map(|length| length as f32));
        let room = ShoeboxRoom { walls, corner: Vec3::ZERO, emitter };
        let options = SceneOptions {
            images: 60,
            air: Air::default(),
            waves_hz: None,
            layer_m: None,
            gain_db: 0.0,
            seed: 1,
            title: name.to_owned(),
            recipe: String::new(),
        };
        let mut ms = [0.0; 3];
        for _ in 0..RUNS {
            let mut began = ThreadTime::now();
            let mut lap = |sum: &mut f64| {
                *sum += 1e3 * began.elapsed().as_secs_f64() / f64::from(RUNS);
                began = ThreadTime::now();
            };
            let scene = Arc::new(room.scene(&head, &options).unwrap());
            lap(&mut ms[0]);
            let carriers = Arc::new(Carriers::new(&scene, 48_000.0));
            lap(&mut ms[1]);
            let renderer = Renderer::new(scene, (48_000.0, carriers)).unwrap();
            lap(&mut ms[2]);
            drop(renderer);
        }
        let [scene, carriers, renderer] = ms;
        let whole: f64 = ms.iter().sum();
        println!("{name}: scene {scene:.1} ms, carriers {carriers:.1} ms, renderer {renderer:.1} ms, together {whole:.1} ms");
    }
}
