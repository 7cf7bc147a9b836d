//! `promenade map mix`, from outside.

use crate::common::{fails, succeeds};
use promenade_baker::wav::{self, Format};
use promenade_testing::Noise;

#[test]
fn samples_are_shared_out_by_eye_and_ear_at_one_cost() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let (room, picture, sound, out) = (at("room.obj"), at("frame.png"), at("mix.wav"), at("maps"));
    let mut obj = String::new();
    for corner in 0..8 {
        let [x, y, z] = [5 * (corner & 1), 4 * (corner >> 1 & 1), 3 * (corner >> 2)];
        obj += &format!("v {x} {y} {z}\n");
    }
    for [a, b, c, d] in [[1, 3, 7, 5], [2, 6, 8, 4], [1, 5, 6, 2], [3, 4, 8, 7], [1, 2, 4, 3], [5, 7, 8, 6]] {
        obj += &format!("f {a} {b} {c} {d}\n");
    }
    std::fs::write(&room, obj).unwrap();
    // A bright spot at the left; the sound is at the right.
    let spot = |x: u32, y: u32| if (20..32).contains(&x) && (40..52).contains(&y) { 255 } else { 40 };
    let pixels: Vec<u8> = (0..128 * 96).map(|i| spot(i % 128, i / 128)).collect();
    let mut encoder = png::Encoder::new(std::fs::File::create(&picture).unwrap(), 128, 96);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
    // Silence, then noise for half a second.
    let mut mix = vec![0.0; 48_000];
    for (sample, noise) in mix[24_000..32_000].iter_mut().zip(Noise::new(1).take(8000)) {
        *sample = 0.3 * noise;
    }
    wav::write(std::path::Path::new(&sound), 16_000, &[&mix], Format::Int16).unwrap();
    let line = |more: &[&str]| {
        let of = [
            "map",
            "mix",
            &room,
            &picture,
            "--source",
            "4.5,0.8,1.5",
            "--materials",
            "*=0.3:0.3",
            "--sound",
            &sound,
            "--camera",
            "0.5,2,1.5,0,0,0",
            "--fps",
            "2",
            "--samples",
            "20",
            "--least",
            "5",
            "--rays",
            "20000",
            "--length",
            "0.5",
            "-o",
            &out,
        ];
        of.iter().chain(more).map(|s| (*s).to_owned()).collect::<Vec<String>>()
    };
    let all = ["--strategy", "uniform", "--strategy", "image", "--strategy", "sound", "--strategy", "mix"];
    let args = line(&all);
    let (said, _) = succeeds(&args.iter().map(String::as_str).collect::<Vec<_>>());
    let costs: Vec<f64> = said.lines().skip(1).take(4).map(|l| l.split_whitespace().last().unwrap().parse().unwrap()).collect();
    assert!(costs.len() == 4 && costs.iter().all(|cost| (cost / 20.0 - 1.0).abs() < 0.01), "{said}");
    let samples = |name: &str| -> Vec<f32> {
        let file = exr::prelude::read_first_flat_layer_from_file(format!("{out}/{name}.exr")).unwrap();
        let channel = file.layer_data.channel_data.list.iter().find(|c| c.name.to_string() == "samples").unwrap();
        channel.sample_data.values_as_f32().collect()
    };
    let mean = |of: &[f32], [x, y]: [usize; 2]| {
        let near = (0..12).flat_map(|j| (0..12).map(move |i| (x + i, y + j)));
        near.map(|(i, j)| of[j * 128 + i]).sum::<f32>() / 144.0
    };
    // The source is 1.2 m to the right and 4 m ahead: 19 pixels from the middle.
    let (spot, source) = ([20, 40], [77, 42]);
    let (image, sound_map) = (samples("image-0001"), samples("sound-0001"));
    assert!(mean(&image, spot) > 2.0 * mean(&image, source), "{} {}", mean(&image, spot), mean(&image, source));
    assert!(mean(&sound_map, source) > 1.2 * mean(&sound_map, spot), "{} {}", mean(&sound_map, source), mean(&sound_map, spot));
    // Frames at every half second: silent, then the sound.
    let (quiet, loud) = (samples("mix-0001"), samples("mix-0004"));
    assert!(mean(&quiet, spot) > mean(&loud, spot) && mean(&quiet, source) < mean(&loud, source));
    let pictures = line(&[&picture, &picture, &picture, &picture, &picture, &picture, &picture]);
    let said = fails(&pictures.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(said.contains("expected sound for 8 pictures"), "{said}");
}
