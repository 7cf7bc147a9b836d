//! Files that are cut short or damaged: an error or a path, never a panic.

use crate::common::cart;
use promenade_paths::{ImportOptions, alone, read};
use promenade_testing::Rng;

const JSON: &str = r#"[{"t": 0, "position": [0, 1.5, -2], "ypr": [30, 0, 0]},
  {"t": 1.25, "position": [1, 1.5, -2], "quat": [1, 0, 0, 0]}, {"t": 2, "position": [1, 1, 1e-3], "ypr": [0, 0, 5]}]"#;
const CSV: &str =
    "# a walk\nt;x;y;z;yaw;pitch;roll;\"fov\"\n0;0;1.5;-2;30;0;0;1\n\n1.25;1;1.5;-2;0;0;0;1\n2;1;1;1e-3;0;0;5;1\n";
const IMAGES: &str = "# Image list\n# Number of images: 3\n1 1 0 0 0 0.5 -1 2 1 20240212_003919.jpg\n1.5 2.5 -1 3 4 7\n\
    2 0.9848078 0 0.1736482 0 0.5 -1 2.5 1 20240212_003921.jpg\n\n3 0.9659258 0 0.2588190 0 0 -1 3 1 20240212_003923.jpg\n1 2 \
    -1\n";

const TRANSFORMS: &str = r#"{"fl_x": 500, "frames": [
    {"file_path": "1.png", "transform_matrix": [[1,0,0,1],[0,0,-1,2],[0,1,0,3],[0,0,0,1]]},
  {"file_path": "2.png", "transform_matrix": [[1,0,0,1.5],[0,0,-1,2],[0,1,0,3],[0,0,0,1]]}]}"#;

fn binary_images() -> Vec<u8> {
    let mut bytes = 2_u64.to_le_bytes().to_vec();
    for id in 0..2_u32 {
        bytes.extend(id.to_le_bytes());
        bytes.extend([1.0, 0.0, 0.0, 0.0, f64::from(id), 1.0, 2.0].iter().flat_map(|v: &f64| v.to_le_bytes()));
        bytes.extend(1_u32.to_le_bytes());
        bytes.extend(format!("frame{id}.png\0").as_bytes());
        bytes.extend(1_u64.to_le_bytes());
        bytes.extend([7; 24]);
    }
    bytes
}

/// The forms, by a name with the ending and one without.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("p.json", JSON.into()),
        ("p.csv", CSV.into()),
        ("images.txt", IMAGES.into()),
        ("images.bin", binary_images()),
        ("transforms.json", TRANSFORMS.into()),
        ("p.glb", cart().glb()),
        ("p.gltf", cart().embedded()),
    ]
}

/// Reads it under its own name and under one that tells nothing; how many were paths.
fn survives(name: &str, bytes: &[u8]) -> usize {
    let gltf = name.starts_with("p.gl");
    // Few samples, so that a duration that damage makes long costs no time.
    let options = ImportOptions { fps: gltf.then_some(2.0), ..ImportOptions::default() };
    let by_name = read(name, bytes, &options, &mut alone);
    let by_content = read("p", bytes, &ImportOptions { fps: None, ..options }, &mut alone);
    for imported in [&by_name, &by_content].into_iter().flatten() {
        assert!(imported.path.keyframes().iter().all(|k| k.t_s.is_finite() && k.pose.is_valid()), "{name}");
    }
    usize::from(by_name.is_ok()) + usize::from(by_content.is_ok())
}

#[test]
fn whole_files_are_read() {
    for (name, bytes) in files() {
        assert_eq!(survives(name, &bytes), 2, "{name}");
    }
}

#[test]
fn files_cut_at_every_byte() {
    for (name, bytes) in files() {
        let read: usize = (0..bytes.len()).map(|end| survives(name, &bytes[..end])).sum();
        match name {
            // Rows and images may end anywhere, and the rest is a path; of the other forms a part is none.
            "p.csv" | "images.txt" => assert!(read > 0, "{name}"),
            _ => assert_eq!(read, 0, "{name}"),
        }
    }
}

#[test]
fn files_with_a_flipped_bit_in_every_byte() {
    for (name, bytes) in files() {
        let mut rng = Rng::with_seed(2);
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1 << rng.u8(..8);
            survives(name, &damaged);
        }
    }
}

#[test]
fn files_with_wrong_bytes_and_lost_parts() {
    for (name, bytes) in files() {
        let mut rng = Rng::with_seed(1);
        for _ in 0..1000 {
            let mut damaged = bytes.clone();
            for _ in 0..1 + rng.usize(..8) {
                let at = rng.usize(..damaged.len());
                match rng.usize(..3) {
                    0 => damaged[at] = rng.u8(..),
                    // What does most damage: ends of ranges.
                    1 => damaged[at] = [0, 0xff, 0x7f, 0x80, b'9', b'-', b'e', b'"'][rng.usize(..8)],
                    _ => {
                        let end = (at + 1 + rng.usize(..16)).min(damaged.len());
                        damaged.drain(at..end);
                        damaged.push(0);
                    }
                }
            }
            survives(name, &damaged);
        }
    }
}
