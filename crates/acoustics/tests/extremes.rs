//! Rooms that nobody builds have no answers that are not numbers.

use crate::common::{LISTENERS, SOURCE, bumpy, shoebox};
use promenade_acoustics::{Image, ImageOptions, Images, Material, Mesh, Reflected, Room, Triangle};

fn few() -> ImageOptions {
    ImageOptions { order: 4, beams: 512, ..ImageOptions::default() }
}

fn wood() -> Vec<Material> {
    vec![Material::even("wood", 0.1, 0.2)]
}

fn sound(room: &Room, source: [f64; 3], listener: [f64; 3], options: &ImageOptions) -> Vec<Image> {
    let seen = Images::new(room, source, options).unwrap().seen_from(room, listener, Reflected::Specular).unwrap();
    for image in &seen {
        assert!(
            image.position.iter().all(|c| c.is_finite()) && image.gains.iter().all(|g| (0.0..=1.0).contains(g)),
            "{image:?}"
        );
    }
    seen
}

fn room() -> (Mesh, Room) {
    let walls = shoebox(0.2, 0.1);
    let mesh = walls.mesh().unwrap();
    let room = Room::new(&mesh, &walls.materials).unwrap();
    (mesh, room)
}

#[test]
fn places_on_each_other_and_on_walls() {
    let (_, room) = room();
    assert_eq!(sound(&room, SOURCE, SOURCE, &few())[0].position, SOURCE);
    for place in [[0.0, 2.0, 1.0], [7.0, 5.0, 1.0], [0.0, 0.0, 0.0], [3.0, 2.0, 3.0]] {
        assert!(!sound(&room, SOURCE, place, &few()).is_empty());
        sound(&room, place, SOURCE, &few());
        sound(&room, place, place, &few());
    }
    assert_eq!(sound(&room, SOURCE, LISTENERS[0], &ImageOptions { order: 0, ..few() }).len(), 1);
    // Outside nothing is heard that is inside, and the other way round.
    assert!(sound(&room, SOURCE, [9.0, 2.0, 1.0], &few()).is_empty());
}

#[test]
fn open_and_broken_meshes() {
    let (mut mesh, whole) = room();
    let materials = whole.materials().to_vec();
    let before = sound(&whole, SOURCE, LISTENERS[0], &few());
    // Duplicates and triangles without an area change nothing.
    let first = mesh.triangles[0];
    mesh.triangles.push(first);
    let [a, b, c] = first.corners;
    mesh.triangles.push(Triangle { corners: [c, b, a], group: 1 });
    mesh.triangles.push(Triangle { corners: [a, a, b], group: 0 });
    mesh.triangles.push(Triangle { corners: [b, b, b], group: 0 });
    let after = sound(&Room::new(&mesh, &materials).unwrap(), SOURCE, LISTENERS[0], &few());
    assert_eq!(before.len(), after.len());
    // Without its ceiling a room has fewer images.
    mesh.triangles.retain(|t| t.group != 5);
    let open = sound(&Room::new(&mesh, &materials).unwrap(), SOURCE, LISTENERS[0], &few());
    assert!(open.len() < before.len() * 2 / 3 && open.len() > 5, "{}", open.len());
    // One triangle alone: direct sound and one reflection.
    let vertices = vec![[-5.0, -5.0, 0.0], [5.0, -5.0, 0.0], [0.0, 9.0, 0.0]];
    let one = Mesh { vertices, triangles: vec![Triangle { corners: [0, 1, 2], group: 0 }], groups: vec!["floor".into()] };
    let one = Room::new(&one, &wood()).unwrap();
    let seen = sound(&one, [0.0, 0.0, 1.0], [1.0, 0.0, 2.0], &few());
    assert_eq!(seen.iter().map(|i| i.order).collect::<Vec<_>>(), [0, 1]);
    assert_eq!(sound(&one, [0.0, 0.0, 1.0], [1.0, 0.0, -2.0], &few()).len(), 0, "the floor is between them");
}

#[test]
fn a_million_triangles() {
    let mesh = bumpy([7.0, 5.0, 3.0], 289, 0.05);
    assert!(mesh.triangles.len() > 1_000_000);
    let room = Room::new(&mesh, &wood()).unwrap();
    let seen = sound(&room, SOURCE, LISTENERS[0], &ImageOptions { order: 2, beams: 256, exact_order: 0 });
    assert!(!seen.is_empty());
}

#[test]
fn what_is_no_room_is_refused() {
    let (mesh, whole) = room();
    let refused = |mesh: &Mesh, materials: &[Material], says: &str| {
        let error = Room::new(mesh, materials).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    };
    let with = |absorption, scattering| vec![Material::even("felt", absorption, scattering); 6];
    refused(&mesh, &with(1.5, 0.0), "absorption of felt: expected 0 to 1, found 1.5");
    refused(&mesh, &with(-0.1, 0.0), "absorption of felt");
    refused(&mesh, &with(f32::NAN, 0.0), "absorption of felt");
    refused(&mesh, &with(0.1, 1.01), "scattering of felt: expected 0 to 1, found 1.01");
    refused(&mesh, &with(0.1, 0.1)[..2], "materials: expected one for each of 6 groups, found 2");
    refused(&Mesh { triangles: Vec::new(), ..mesh.clone() }, &with(0.1, 0.1), "triangles with an area, found 0");
    let mut bad = mesh.clone();
    bad.vertices[3][1] = f64::INFINITY;
    refused(&bad, &with(0.1, 0.1), "vertex 3");
    let mut bad = mesh.clone();
    bad.triangles[7].corners[0] = 8;
    refused(&bad, &with(0.1, 0.1), "triangle 7: expected corners among 8 vertices");
    for source in [[f64::NAN; 3], [0.0, f64::INFINITY, 0.0]] {
        assert!(Images::new(&whole, source, &few()).is_err());
        assert!(Images::new(&whole, SOURCE, &few()).unwrap().seen_from(&whole, source, Reflected::Whole).is_err());
    }
    assert!(Images::new(&whole, SOURCE, &ImageOptions { order: 51, ..few() }).is_err());
    assert!(Images::new(&whole, SOURCE, &ImageOptions { beams: 0, ..few() }).is_err());
    assert!(shoebox(0.1, 0.1).images([8.0, 1.0, 1.0], 2, Reflected::Whole).is_err());
    assert!(shoebox(1.1, 0.1).images(SOURCE, 2, Reflected::Whole).is_err());
}
