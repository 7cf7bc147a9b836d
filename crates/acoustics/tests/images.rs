//! Images that beams find are those of the exact methods.

use crate::common::{L_LISTENERS, L_SOURCE, LISTENERS, SOURCE, l_room, seen, shoebox};
use glam::DVec3;
use promenade_acoustics::{Directivity, Image, ImageOptions, Images, Material, Reflected, Room, SPEED_OF_SOUND_M_S, Source};

fn room(mesh: &promenade_acoustics::Mesh, absorption: f32) -> Room {
    let materials: Vec<Material> = mesh.groups.iter().map(|g| Material::even(g, absorption, 0.0)).collect();
    Room::new(mesh, &materials).unwrap()
}

fn energy<'a>(images: impl IntoIterator<Item = &'a Image>, listener: [f64; 3]) -> f64 {
    let one = |i: &Image| f64::from(i.gains[3]).powi(2) / distance(i.position, listener).powi(2);
    images.into_iter().map(one).sum()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    DVec3::from_array(a).distance(b.into())
}

fn db(ratio: f64) -> f64 {
    10.0 * ratio.log10()
}

#[test]
fn the_direct_path_is_the_line_between() {
    let mesh = shoebox(1.0, 0.0).mesh().unwrap();
    for metres in [0.1, 1.0, 7.3, 100.0] {
        let mut large = mesh.clone();
        large.vertices.iter_mut().flatten().for_each(|c| *c *= 50.0);
        let (source, listener) = ([20.0, 30.0, 40.0], [20.0 + 0.6 * metres, 30.0, 40.0 + 0.8 * metres]);
        let room = room(&large, 1.0);
        let images = Images::new(&room, source, &ImageOptions { order: 0, beams: 1, exact_order: 0 }).unwrap();
        let seen = images.seen_from(&room, listener, Reflected::Whole).unwrap();
        assert_eq!((seen.len(), seen[0].order, seen[0].gains), (1, 0, [1.0; 7]));
        let late = (distance(seen[0].position, listener) - metres) / SPEED_OF_SOUND_M_S;
        assert!(late.abs() < 1e-6, "{late} s at {metres} m");
        assert!(db(energy(&seen, listener) * metres * metres).abs() < 0.01);
    }
}

#[test]
fn images_have_what_the_source_sends_their_way() {
    let room = room(&shoebox(0.0, 0.0).mesh().unwrap(), 0.3);
    let directivity = Directivity::first_order(0.5).turned(0.7, -0.4);
    let source = Source { position: SOURCE, directivity: directivity.clone() };
    let [all, same] = [source, SOURCE.into()].map(|source: Source| {
        let images = Images::new(&room, source, &ImageOptions { order: 2, ..ImageOptions::default() }).unwrap();
        images.seen_from(&room, LISTENERS[0], Reflected::Whole).unwrap()
    });
    assert_eq!(all.len(), same.len());
    for (image, omni) in all.iter().zip(&same) {
        // The way to the listener, mirrored at every wall that it meets: walls of a box turn round one coordinate each.
        let mut way = DVec3::from_array(LISTENERS[0]) - DVec3::from_array(image.position);
        for face in &image.faces {
            way[*face as usize / 4] *= -1.0;
        }
        let sent = directivity.towards(way.to_array());
        assert!(
            (image.directivity[3] - sent[3]).abs() < 1e-5,
            "order {}: {} of {}",
            image.order,
            image.directivity[3],
            sent[3]
        );
        assert!((image.gains[3] - sent[3] * omni.gains[3]).abs() < 1e-5 && omni.directivity == [1.0; 7]);
    }
    assert!(all.iter().any(|i| i.directivity[3] < 0.3) && all.iter().any(|i| i.directivity[3] > 0.8));
}

#[test]
fn beams_find_every_image_of_a_box_once() {
    let exact = shoebox(0.3, 0.0).images(SOURCE, 6, Reflected::Whole).unwrap();
    assert_eq!(exact.len(), 377);
    let room = room(&shoebox(0.0, 0.0).mesh().unwrap(), 0.3);
    // None of them without a beam.
    let images = Images::new(&room, SOURCE, &ImageOptions { exact_order: 0, ..ImageOptions::default() }).unwrap();
    for listener in LISTENERS {
        let seen = images.seen_from(&room, listener, Reflected::Whole).unwrap();
        for image in &seen {
            let same = exact.iter().filter(|e| distance(e.position, image.position) < 1e-6).count();
            assert_eq!(same, 1, "{image:?} is one of the box");
            assert_eq!(image.faces.len() as u32, image.order);
        }
        let missed = exact.iter().filter(|e| !seen.iter().any(|s| distance(s.position, e.position) < 3.43e-4)).count();
        let twice = seen.len() + missed - exact.len();
        assert_eq!((missed, twice), (0, 0), "of {} from {listener:?}", exact.len());
        let level = db(energy(&seen, listener) / energy(&exact, listener));
        assert!(level.abs() < 0.05, "{level} dB");
        for image in &seen {
            let same = exact.iter().find(|e| distance(e.position, image.position) < 1e-6).unwrap();
            assert!((image.gains[0] / same.gains[0] - 1.0).abs() < 1e-5);
        }
    }
}

#[test]
fn walls_of_a_box_leave_their_own_shares() {
    let mut walls = shoebox(0.0, 0.5);
    for (i, m) in walls.materials.iter_mut().enumerate() {
        m.absorption = std::array::from_fn(|band| 0.1 * (i + 1) as f32 + 0.01 * band as f32);
    }
    let room = Room::new(&walls.mesh().unwrap(), &walls.materials).unwrap();
    let images = Images::new(&room, SOURCE, &ImageOptions { order: 3, ..ImageOptions::default() }).unwrap();
    for share in [Reflected::Whole, Reflected::Specular] {
        let exact = walls.images(SOURCE, 3, share).unwrap();
        for image in images.seen_from(&room, LISTENERS[1], share).unwrap() {
            let same = exact.iter().find(|e| distance(e.position, image.position) < 1e-6).unwrap();
            for (a, b) in image.gains.iter().zip(same.gains) {
                assert!((a - b).abs() < 1e-6, "{image:?} {same:?}");
            }
        }
    }
    let specular = walls.images(SOURCE, 1, Reflected::Specular).unwrap();
    let floor = specular.iter().find(|i| i.position[2] < 0.0).unwrap();
    assert!((floor.gains[2] - (0.48_f32 * 0.5).sqrt()).abs() < 1e-6 && floor.faces == [4]);
}

#[test]
fn corners_hide_and_show_what_they_should() {
    let mesh = l_room();
    let room = room(&mesh, 0.2);
    let images = Images::new(&room, L_SOURCE, &ImageOptions::default()).unwrap();
    for listener in L_LISTENERS {
        let exact = seen(&mesh, L_SOURCE, listener, 6);
        assert!(exact.len() > 100, "{}", exact.len());
        let found = images.seen_from(&room, listener, Reflected::Whole).unwrap();
        let is = |i: &Image, e: &(u32, DVec3)| i.order == e.0 && e.1.distance(i.position.into()) < 1e-6;
        let wrong: Vec<&Image> = found.iter().filter(|i| !exact.iter().any(|e| is(i, e))).collect();
        assert!(wrong.is_empty(), "{} of {} from {listener:?}: {wrong:?}", wrong.len(), found.len());
        let missed: Vec<_> = exact.iter().filter(|e| !found.iter().any(|i| is(i, e))).collect();
        let recall = 1.0 - missed.len() as f64 / exact.len() as f64;
        assert_eq!(found.len(), exact.len() - missed.len(), "none twice");
        let lost = missed.iter().map(|m| 0.8_f64.powi(m.0.cast_signed()) / m.1.distance_squared(listener.into())).sum::<f64>();
        let level = db(lost / energy(&found, listener));
        println!("L-room: {} images, recall {:.2} %, missed energy {level:.1} dB", exact.len(), 100.0 * recall);
        assert!(recall >= 0.99 && level <= -20.0, "recall {recall}, {level} dB");
    }
}

#[test]
fn source_and_listener_may_change_places() {
    let mesh = l_room();
    let room = room(&mesh, 0.2);
    for listener in L_LISTENERS {
        let options = ImageOptions { order: 4, beams: 32_768, exact_order: 2 };
        let ways = |from: [f64; 3], to: [f64; 3]| {
            let images = Images::new(&room, from, &options).unwrap();
            let mut ways: Vec<(f64, f32)> = images
                .seen_from(&room, to, Reflected::Whole)
                .unwrap()
                .iter()
                .map(|i| (distance(i.position, to), i.gains[2]))
                .collect();
            ways.sort_by(|a, b| a.0.total_cmp(&b.0));
            ways
        };
        let (there, back) = (ways(L_SOURCE, listener), ways(listener, L_SOURCE));
        assert_eq!(there.len(), back.len());
        for (a, b) in there.iter().zip(&back) {
            assert!((a.0 - b.0).abs() < 1e-6 * SPEED_OF_SOUND_M_S && (a.1 / b.1 - 1.0).abs() < 1e-4, "{a:?} {b:?}");
        }
    }
}

#[test]
fn full_absorption_leaves_the_direct_sound_alone() {
    let room = room(&shoebox(0.0, 0.0).mesh().unwrap(), 1.0);
    let seen = Images::new(&room, SOURCE, &ImageOptions::default()).unwrap();
    let seen = seen.seen_from(&room, LISTENERS[0], Reflected::Whole).unwrap();
    assert!((energy(&seen, LISTENERS[0]) * distance(SOURCE, LISTENERS[0]).powi(2) - 1.0).abs() < 1e-12);
}

#[test]
fn walls_that_are_nearly_square_hide_no_image() {
    // Corners as a file rounds them: images in walls in either order lie some micrometres apart.
    let exact = shoebox(0.1, 0.0).mesh().unwrap();
    for by in [1e-6, 3e-6, 1e-5, 1e-4] {
        let mut mesh = exact.clone();
        for (number, vertex) in mesh.vertices.iter_mut().enumerate() {
            for (axis, c) in vertex.iter_mut().enumerate() {
                *c += by * f64::from(((number * 7 + axis * 5) % 3) as u32 as f32 - 1.0);
            }
        }
        let room = Room::new(&mesh, &vec![Material::even("wall", 0.1, 0.0); mesh.groups.len()]).unwrap();
        let images = Images::new(&room, SOURCE, &ImageOptions { order: 3, ..ImageOptions::default() }).unwrap();
        for listener in LISTENERS {
            let seen = images.seen_from(&room, listener, Reflected::Whole).unwrap();
            let energy: f64 = seen.iter().map(|i| 1.0 / DVec3::from(i.position).distance_squared(listener.into())).sum();
            let box_images = shoebox(0.1, 0.0).images(SOURCE, 3, Reflected::Whole).unwrap();
            let whole: f64 = box_images.iter().map(|i| 1.0 / DVec3::from(i.position).distance_squared(listener.into())).sum();
            assert!((10.0 * (energy / whole).log10()).abs() < 0.1, "{by}: {} images of {}", seen.len(), box_images.len());
        }
    }
}
