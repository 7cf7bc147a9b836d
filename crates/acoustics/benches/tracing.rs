//! Cost of rays and images.
//!
//! `cargo bench --bench tracing -p promenade-acoustics`. Processor time of one thread, the best of some runs, but for the last
//! line, which is the time on all cores.

#[path = "../tests/common/mod.rs"]
mod common;

use common::{L_LISTENERS, L_SOURCE, LISTENERS, SOURCE, bumpy, l_room, shoebox};
use cpu_time::ThreadTime;
use promenade_acoustics::{ImageOptions, Images, Material, Mesh, RayOptions, Reflected, Room, late_field};
use std::hint::black_box;
use std::time::Instant;

const RUNS: usize = 9;

fn room(mesh: &Mesh) -> Room {
    Room::new(mesh, &vec![Material::even("wall", 0.2, 0.3); mesh.groups.len()]).expect("a room of a test")
}

/// Seconds of this thread.
fn best(mut run: impl FnMut()) -> f64 {
    let time = |_| {
        let began = ThreadTime::now();
        run();
        began.elapsed().as_secs_f64()
    };
    (0..RUNS).map(time).fold(f64::INFINITY, f64::min)
}

fn main() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    one.install(|| {
        for steps in [1, 16, 32, 98] {
            let mesh = bumpy([7.0, 5.0, 3.0], steps, 0.05);
            let room = room(&mesh);
            let options = RayOptions { rays: 4096, length_s: 0.2, ..RayOptions::default() };
            let mut casts = 0;
            let s = best(|| casts = late_field(&room, SOURCE, &[], &options, |_| ()).expect("rays").casts);
            println!("{:>7} triangles: {:.2} Mray/s", mesh.triangles.len(), 1e-6 * casts as f64 / s);
        }
        let l_room = room(&l_room());
        for (name, room, source, listener) in [
            ("L-room", &l_room, L_SOURCE, L_LISTENERS[0]),
            ("box", &room(&shoebox(0.2, 0.3).mesh().expect("a box")), SOURCE, LISTENERS[0]),
        ] {
            let (mut count, mut seen) = (0, 0);
            let s = best(|| {
                let images = Images::new(room, source, &ImageOptions::default()).expect("images");
                seen = images.seen_from(room, listener, Reflected::Whole).expect("a listener").len();
                count = images.count();
            });
            println!("{name}, order 6, 8192 beams: {:.1} ms for {seen} of {count} images", 1e3 * s);
            let images = Images::new(room, source, &ImageOptions::default()).expect("images");
            let s = best(|| drop(black_box(images.seen_from(room, listener, Reflected::Whole))));
            println!("    of that each further listener: {:.2} ms", 1e3 * s);
        }
        let walls = shoebox(0.2, 0.3);
        let s = best(|| drop(black_box(walls.images(SOURCE, 6, Reflected::Whole))));
        println!("box, order 6, without beams: {:.3} ms", 1e3 * s);
        let options = RayOptions { rays: 8192, ..RayOptions::default() };
        let room = room(&shoebox(0.2, 0.3).mesh().expect("a box"));
        let s = best(|| drop(black_box(late_field(&room, SOURCE, &LISTENERS, &options, |_| ()))));
        println!("box, 8192 rays of 7 octaves, 1 s, 5 listeners: {:.0} ms", 1e3 * s);
    });
    let room = room(&l_room());
    let place = |i: usize| [0.5 + 2.0 * (i % 25) as f64 / 25.0, 0.5 + 5.0 * (i / 25) as f64 / 20.0, 1.5];
    let listeners: Vec<[f64; 3]> = (0..500).map(place).collect();
    let began = Instant::now();
    let images = Images::new(&room, L_SOURCE, &ImageOptions::default()).expect("images");
    let seen =
        listeners.iter().map(|l| images.seen_from(&room, *l, Reflected::Specular).map_or(0, |seen| seen.len())).sum::<usize>();
    let options = RayOptions { rays: 65_536, ..RayOptions::default() };
    black_box(late_field(&room, L_SOURCE, &listeners, &options, |_| ()).expect("rays"));
    println!("500 places, 7 octaves, order 6, 65536 rays of 1 s: {:.1} s, {seen} images", began.elapsed().as_secs_f64());
}
