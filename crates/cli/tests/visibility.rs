//! Selective rendering, whole: a picture of a room is rendered here, samples are shared out by `promenade map mix` at one cost,
//! the room is rendered with each, `map visibility` compares them with a reference, and `map composite` blends two of them.
//!
//! With PROMENADE_PICTURES=WIDTH,SAMPLES,FOLDER a larger picture is rendered and everything is left in the folder.

use crate::common::{fails, succeeds};
use promenade_baker::wav::{self, Format};
use promenade_core::glam::Vec3;
use promenade_testing::Noise;
use std::f32::consts::{PI, TAU};
use std::path::{Path, PathBuf};

/// The camera stands here and looks along x; its picture is 90 degrees wide.
const EYE: Vec3 = Vec3::new(0.4, 2.0, 1.5);
/// The lamp in the ceiling: the least corner and the size of it, and its radiance.
const LAMP: [[f32; 2]; 2] = [[2.2, 1.6], [0.8, 0.8]];
const LAMP_HEIGHT: f32 = 2.99;
const LAMP_RADIANCE: f32 = 9.0;
/// Bounces of light after the first surface.
const BOUNCES: usize = 2;

/// An axis-aligned box and the share of red, green and blue that it reflects.
struct Block {
    low: Vec3,
    high: Vec3,
    colour: Vec3,
}

struct Hit {
    at: Vec3,
    normal: Vec3,
    colour: Vec3,
    lamp: bool,
}

struct World {
    /// The first is the room, seen from inside.
    blocks: Vec<Block>,
}

impl World {
    fn new() -> Self {
        let block = |low: [f32; 3], high: [f32; 3], colour: [f32; 3]| Block {
            low: low.into(),
            high: high.into(),
            colour: colour.into(),
        };
        // A table, a red chest that draws the eye at the left, and a loudspeaker at the right.
        let mut blocks = vec![
            block([0.0, 0.0, 0.0], [5.0, 4.0, 3.0], [0.7, 0.68, 0.62]),
            block([2.6, 1.4, 0.0], [3.6, 2.6, 0.7], [0.45, 0.3, 0.2]),
            block([3.4, 3.2, 0.0], [4.2, 3.8, 0.9], [0.85, 0.08, 0.06]),
            block([4.3, 0.5, 0.0], [4.7, 1.0, 1.3], [0.1, 0.1, 0.12]),
        ];
        for i in 0..6_u8 {
            let z = 0.7 + 0.22 * f32::from(i);
            blocks.push(block([4.85, 1.5, z], [4.98, 2.7, z + 0.1], [0.2, 0.35, 0.5]));
        }
        Self { blocks }
    }

    /// As a mesh, its walls looking inwards.
    fn obj(&self) -> String {
        let mut text = String::new();
        for (number, block) in self.blocks.iter().enumerate() {
            for corner in 0..8 {
                let pick = |axis: usize| if corner >> axis & 1 == 0 { block.low[axis] } else { block.high[axis] };
                text += &format!("v {} {} {}\n", pick(0), pick(1), pick(2));
            }
            for face in [[1, 3, 7, 5], [2, 6, 8, 4], [1, 5, 6, 2], [3, 4, 8, 7], [1, 2, 4, 3], [5, 7, 8, 6]] {
                let mut face = face.map(|corner| corner + 8 * number);
                if number > 0 {
                    face.reverse();
                }
                text += &format!("f {} {} {} {}\n", face[0], face[1], face[2], face[3]);
            }
        }
        text
    }

    /// What a ray meets first.
    fn hit(&self, from: Vec3, along: Vec3) -> Hit {
        let inverse = along.recip();
        let mut nearest = (f32::INFINITY, 0, 1.0);
        for (number, block) in self.blocks.iter().enumerate() {
            let (a, b) = ((block.low - from) * inverse, (block.high - from) * inverse);
            let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
            let (at, sign) = if number == 0 { (leave, -1.0) } else { (enter, 1.0) };
            if (number == 0 || enter < leave) && at > 1e-4 && at < nearest.0 {
                nearest = (at, number, sign);
            }
        }
        let (distance, number, sign) = nearest;
        let (at, block) = (from + along * distance, &self.blocks[number]);
        let middle = (block.low + block.high) / 2.0;
        let side = (at - middle) / (block.high - block.low) * 2.0;
        let axis = side.abs().max_position();
        let mut normal = Vec3::ZERO;
        normal[axis] = sign * side[axis].signum();
        let within = |axis: usize| (LAMP[0][axis]..LAMP[0][axis] + LAMP[1][axis]).contains(&at[axis]);
        let lamp = number == 0 && normal.z < 0.0 && within(0) && within(1);
        Hit { at: at + normal * 1e-3, normal, colour: block.colour, lamp }
    }

    /// Light that comes from a direction; the lamp itself is seen by the camera alone, and by others through samples of it.
    fn light(&self, mut from: Vec3, mut along: Vec3, random: &mut impl FnMut() -> f32) -> Vec3 {
        let (mut sum, mut gain) = (Vec3::ZERO, Vec3::ONE);
        for bounce in 0..=BOUNCES {
            let hit = self.hit(from, along);
            if hit.lamp {
                return if bounce == 0 { Vec3::splat(LAMP_RADIANCE) } else { sum };
            }
            gain *= hit.colour;
            let lamp = Vec3::new(LAMP[0][0] + LAMP[1][0] * random(), LAMP[0][1] + LAMP[1][1] * random(), LAMP_HEIGHT);
            let way = lamp - hit.at;
            let (square, towards) = (way.length_squared(), way.normalize());
            let cosines = hit.normal.dot(towards).max(0.0) * towards.z.max(0.0);
            if cosines > 0.0 && self.hit(hit.at, towards).at.distance(hit.at) > way.length() - 0.05 {
                sum += gain * (LAMP_RADIANCE * LAMP[1][0] * LAMP[1][1] * cosines / square / PI);
            }
            // A cosine about the normal.
            let (turn, up) = (TAU * random(), 2.0 * random() - 1.0);
            let flat = (1.0 - up * up).max(0.0).sqrt();
            along = (hit.normal + Vec3::new(flat * turn.cos(), flat * turn.sin(), up)).normalize_or(hit.normal);
            from = hit.at;
        }
        sum
    }

    /// A picture with so many samples in each pixel, as 8 bits of sRGB.
    fn render(&self, [width, height]: [u32; 2], samples: impl Fn(usize) -> u32, seed: u32) -> Vec<u8> {
        let mut state = seed;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let mut pixels = Vec::new();
        for pixel in 0..width * height {
            let count = samples(pixel as usize).max(1);
            let mut sum = Vec3::ZERO;
            for _ in 0..count {
                let x = (pixel % width) as f32 + random();
                let y = (pixel / width) as f32 + random();
                let half = width as f32 / 2.0;
                let along = Vec3::new(half, half - x, height as f32 / 2.0 - y).normalize();
                sum += self.light(EYE, along, &mut random);
            }
            let light = (sum / count as f32).clamp(Vec3::ZERO, Vec3::ONE).to_array();
            pixels.extend(light.map(|v| {
                let shown = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
                (255.0 * shown).round() as u8
            }));
        }
        pixels
    }
}

fn write_png(path: &Path, [width, height]: [u32; 2], pixels: &[u8]) {
    let mut encoder = png::Encoder::new(std::fs::File::create(path).unwrap(), width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().unwrap().write_image_data(pixels).unwrap();
}

fn read_png(path: &Path) -> Vec<u8> {
    let mut reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    bytes
}

fn samples(path: &Path) -> Vec<u32> {
    let file = exr::prelude::read_first_flat_layer_from_file(path).unwrap();
    let channel = file.layer_data.channel_data.list.iter().find(|c| c.name.to_string() == "samples").unwrap();
    channel.sample_data.values_as_f32().map(|n| n as u32).collect()
}

/// Rows of a table by their name: the numbers in them.
fn rows(said: &str) -> Vec<(String, Vec<f64>)> {
    let row = |line: &str| {
        let mut words = line.split_whitespace();
        (words.next().unwrap().to_owned(), words.filter_map(|word| word.parse().ok()).collect())
    };
    said.lines().skip(1).filter(|line| !line.is_empty()).map(row).collect()
}

#[test]
fn renderings_of_one_cost_differ_visibly_and_blend_by_the_sound() {
    let told = std::env::var("PROMENADE_PICTURES").ok();
    let told: Option<Vec<&str>> = told.as_ref().map(|told| told.split(',').collect());
    let kept = tempfile::tempdir().unwrap();
    let (width, mean, folder) = match &told {
        Some(told) => (told[0].parse().unwrap(), told[1].parse().unwrap(), PathBuf::from(told[2])),
        None => (72_u32, 20_u32, kept.path().to_owned()),
    };
    let size = [width, width * 3 / 4];
    let at = |name: &str| folder.join(name);
    let text = |name: &str| at(name).to_string_lossy().into_owned();
    let world = World::new();
    std::fs::write(at("room.obj"), world.obj()).unwrap();
    write_png(&at("reference.png"), size, &world.render(size, |_| 16 * mean, 1));
    // Silence, then a burst from the loudspeaker.
    let mut mix = vec![0.0; 3 * 16_000];
    for (sample, noise) in mix[24_000..32_000].iter_mut().zip(Noise::new(1).take(8000)) {
        *sample = 0.3 * noise;
    }
    wav::write(&at("mix.wav"), 16_000, &[&mix], Format::Int16).unwrap();

    let (room, picture, sound, maps) = (text("room.obj"), text("reference.png"), text("mix.wav"), text("maps"));
    let cost = mean.to_string();
    let least = (mean / 4).to_string();
    let mut line = vec!["map", "mix", &room, &picture, "--emitter", "4.25,0.75,1.2", "--materials", "*=0.5:0.3"];
    line.extend(["--sound", &sound, "--camera", "0.4,2,1.5,0,0,0", "--fps", "2", "--samples", &cost, "--least", &least]);
    line.extend(["--rays", "60000", "--length", "0.3", "-o", &maps]);
    line.extend(["--strategy", "uniform", "--strategy", "image", "--strategy", "sound", "--strategy", "mix"]);
    succeeds(&line);

    // The composite of the picture by the eye and that by the ear needs no map of its own.
    let strategies = ["uniform", "image", "sound"];
    for strategy in strategies {
        let counts = samples(&at(&format!("maps/{strategy}-0001.exr")));
        let spent = counts.iter().sum::<u32>() as f32 / counts.len() as f32;
        assert!((spent / mean as f32 - 1.0).abs() < 0.01, "{strategy}: {spent} samples per pixel");
        write_png(&at(&format!("{strategy}.png")), size, &world.render(size, |i| counts[i], 7));
    }
    let (image, by_sound, frames) = (text("image.png"), text("sound.png"), text("frames"));
    let said = succeeds(&["map", "composite", &image, &by_sound, "--sound", &sound, "--fps", "4", "-o", &frames]).0;
    assert!(said.starts_with("12 pictures"), "{said}");
    // Frames are the first picture in silence, the second where the sound begins, and between them by the weights of
    // `map saliency`, in linear light.
    let json = text("weights.json");
    succeeds(&["map", "saliency", &sound, "--fps", "4", "-o", &json]);
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    let weights: Vec<f64> = json["frames"].as_array().unwrap().iter().map(|f| f["saliency"].as_f64().unwrap()).collect();
    assert!(weights[0] < 0.01 && weights[6] > 0.9, "{weights:?}");
    let linear = |v: u8| {
        let v = f64::from(v) / 255.0;
        if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    };
    let (a, b) = (read_png(&at("image.png")), read_png(&at("sound.png")));
    for (frame, weight) in weights.iter().enumerate() {
        let blended = read_png(&at(&format!("frames/{:04}.png", frame + 1)));
        let off = blended.iter().zip(a.iter().zip(&b)).map(|(found, (a, b))| {
            let wanted = (1.0 - weight) * linear(*a) + weight * linear(*b);
            // Half a step of eight bits is at most this much light.
            (linear(*found) - wanted).abs()
        });
        assert!(off.fold(0.0, f64::max) < 0.006, "frame {frame}");
    }
    std::fs::copy(at("frames/0007.png"), at("mix.png")).unwrap();

    // One reference and four renderings; and the reference beside itself.
    let visible = text("visible");
    let pictures = ["reference", "uniform", "image", "sound", "mix"].map(|name| text(&format!("{name}.png")));
    let mut line = vec!["map", "visibility", &picture];
    line.extend(pictures.iter().map(String::as_str));
    line.extend(["-o", &visible]);
    let said = succeeds(&line).0;
    if told.is_some() {
        println!("{said}");
    }
    let found = rows(&said);
    assert_eq!(found.len(), 5, "{said}");
    assert_eq!(found[0].1, [0.0; 3], "{said}");
    assert!(found[1..].iter().all(|(_, numbers)| (1.0..=100.0).contains(&numbers[0])), "{said}");
    // Less is seen where a strategy takes samples to: where the ear has more than the eye, and the other way round.
    let seen = |name: &str| -> Vec<f32> {
        let file = exr::prelude::read_first_flat_layer_from_file(at(&format!("visible/{name}.exr"))).unwrap();
        file.layer_data.channel_data.list[0].sample_data.values_as_f32().collect()
    };
    let counts = ["image", "sound"].map(|strategy| samples(&at(&format!("maps/{strategy}-0001.exr"))));
    let found = ["image", "sound"].map(seen);
    assert!(found.iter().flatten().all(|p| (0.0..=1.0).contains(p)));
    for (more, less) in [(0, 1), (1, 0)] {
        let there = (0..counts[0].len()).filter(|i| f64::from(counts[more][*i]) > 1.3 * f64::from(counts[less][*i]));
        let difference: Vec<f32> = there.map(|i| found[less][i] - found[more][i]).collect();
        let mean = difference.iter().sum::<f32>() / difference.len() as f32;
        assert!(difference.len() > 100 && mean > 0.01, "{mean} over {} pixels", difference.len());
    }
    // Two renderings of one cost differ from each other.
    let uniform = text("uniform.png");
    let said = succeeds(&["map", "visibility", &uniform, &by_sound]).0;
    assert!(rows(&said)[0].1[0] > 1.0, "{said}");

    write_png(&at("small.png"), [16, 16], &[0; 768]);
    let small = text("small.png");
    let said = fails(&["map", "visibility", &picture, &small]);
    assert!(said.contains("small.png beside") && said.contains("16x16"), "{said}");
    let said = fails(&["map", "composite", &picture, &small, "--sound", &sound, "-o", &frames]);
    assert!(said.contains("small.png: expected") && said.contains("found 16 x 16"), "{said}");
}
