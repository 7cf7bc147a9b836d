//! A mesh that `simulate` has made is fitted to what a microphone heard in it, and heard with a head elsewhere. Long figures:
//! `cargo test -p promenade --test all -- --ignored --nocapture fit_heard`

use crate::common::succeeds;
use promenade_baker::sound;
use promenade_baker::wav::{self, Format};
use promenade_baker::{LoadOptions, Response, Responses};
use promenade_metrics::{DecayRange, c50_db, decay_time_s, ild_db, itd_s, octave_of, onset};
use promenade_testing::Noise;
use std::fs;
use std::path::Path;

/// Debian's package libmysofa1.
const HEAD: &str = "/usr/share/libmysofa/MIT_KEMAR_normal_pinna.sofa";
const RATE: u32 = 48_000;
const SOURCE: [f32; 3] = [1.3, 1.2, 1.4];
/// A room like an L with walls of different materials: absorption in seven octaves from 125 Hz, and scattering.
const CORNERS: [[f64; 2]; 6] = [[0.0, 0.0], [6.1, 0.0], [6.1, 3.1], [3.4, 3.1], [3.4, 4.9], [0.0, 4.9]];
const HEIGHT_M: f64 = 2.8;
const MATERIALS: [(&str, [f64; 7]); 8] = [
    ("w0", [0.1, 0.12, 0.15, 0.2, 0.25, 0.3, 0.3]),
    ("w1", [0.3, 0.35, 0.45, 0.55, 0.6, 0.6, 0.6]),
    ("w2", [0.15, 0.12, 0.1, 0.1, 0.12, 0.15, 0.2]),
    ("w3", [0.2, 0.2, 0.25, 0.25, 0.3, 0.3, 0.35]),
    ("w4", [0.12, 0.2, 0.35, 0.5, 0.55, 0.5, 0.5]),
    ("w5", [0.1, 0.1, 0.12, 0.15, 0.15, 0.2, 0.2]),
    ("floor", [0.05, 0.08, 0.15, 0.25, 0.35, 0.45, 0.5]),
    ("ceiling", [0.25, 0.35, 0.5, 0.6, 0.6, 0.55, 0.5]),
];
const SCATTERING: [f64; 7] = [0.1, 0.12, 0.15, 0.2, 0.25, 0.3, 0.3];
const OCTAVES_HZ: [f64; 6] = [125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0];

fn join(values: &[f64]) -> String {
    values.iter().map(|v| format!("{v}")).collect::<Vec<_>>().join("/")
}

fn mesh() -> String {
    let mut text = String::new();
    for z in [0.0, HEIGHT_M] {
        CORNERS.iter().for_each(|[x, y]| text += &format!("v {x} {y} {z}\n"));
    }
    for w in 0..6 {
        let next = (w + 1) % 6;
        text += &format!("usemtl w{w}\nf {} {} {} {}\n", w + 1, w + 7, next + 7, next + 1);
    }
    text + "usemtl floor\nf 1 2 3 4\nf 1 4 5 6\nusemtl ceiling\nf 10 9 8 7\nf 12 11 10 7\n"
}

/// A microphone: a head whose ears hear all directions alike.
fn microphone(folder: &Path) -> String {
    fs::create_dir(folder).unwrap();
    let mut click = vec![0.0_f32; 256];
    click[64] = 1.0;
    wav::write(&folder.join("omni.wav"), RATE, &[&click, &click], Format::Float32).unwrap();
    let mut all = Vec::new();
    for elevation in (-90_i32..=90).step_by(15) {
        let step = if elevation.abs() == 90 { 360 } else { 15 };
        for azimuth in (-165..=180).step_by(step) {
            all.push(serde_json::json!({ "file": "omni.wav", "azimuth_deg": azimuth, "elevation_deg": elevation }));
        }
    }
    let manifest =
        serde_json::json!({ "title": "microphone", "credit": "-", "licence": "CC0", "distance_m": 1.0, "responses": all });
    fs::write(folder.join("responses.json"), manifest.to_string()).unwrap();
    folder.to_str().unwrap().to_owned()
}

struct Truth {
    folder: tempfile::TempDir,
    rules: String,
}

impl Truth {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("truth.obj"), mesh()).unwrap();
        let rules = MATERIALS.map(|(name, a)| format!("{name}={}:{}", join(&a), join(&SCATTERING))).join(",");
        Self { folder, rules }
    }

    fn text(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().unwrap().to_owned()
    }

    /// What a head hears at places, in some directions each. Images of a higher order than fits have, and other seeds.
    fn heard(&self, head: &str, name: &str, at: &[[f64; 3]], turns: &str, seed: &str) -> Vec<Response> {
        let at: Vec<String> = at.iter().map(|[x, y, z]| format!("{x},{y},{z}")).collect();
        let places: Vec<&str> = at.iter().flat_map(|a| ["--at", a]).collect();
        let source = SOURCE.map(|c| c.to_string()).join(",");
        let (room, out) = (self.text("truth.obj"), self.text(name));
        let of = ["simulate", &room, "--source", &source, "--materials", &self.rules, "--head", head, "--waves", "0"];
        let how = ["--order", "12", "--beams", "32768", "--rays", "131072", "--length", "0.9", "--turns", turns];
        succeeds(&[&of[..], &how, &["--seed", seed, "-o", &out], &places].concat());
        Responses::load(Path::new(&out), &LoadOptions::default()).unwrap().responses
    }

    /// Measurements by a microphone: places off by a standard deviation, band noise and a clock's offset for each.
    fn measured(&self, name: &str, at: &[[f64; 3]], sd_m: f64, noise_db: f64) -> String {
        let head = microphone(&self.folder.path().join(format!("{name}.head")));
        let folder = self.folder.path().join(name);
        fs::create_dir(&folder).unwrap();
        let heard = self.heard(&head, &format!("{name}.heard"), at, "1", "71");
        let mut random = Noise::new(5);
        // A sum of twelve has the deviation of one.
        let mut normal = || (0..12).map(|_| random.value()).sum::<f32>() * 0.5;
        let mut entries = Vec::new();
        for (i, (one, at)) in heard.iter().zip(at).enumerate() {
            let loudest = one.left.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
            let noise = loudest * 10f64.powf(noise_db / 20.0) as f32;
            let late = (0.006 * f64::from(RATE) * f64::from(normal()).abs().min(3.0)) as usize;
            let samples: Vec<f32> =
                vec![0.0; late].into_iter().chain(one.left.iter().copied()).map(|v| v + noise * normal()).collect();
            wav::write(&folder.join(format!("{i}.wav")), RATE, &[&samples], Format::Float32).unwrap();
            let stated = at.map(|c| c + sd_m * f64::from(normal()));
            entries.push(serde_json::json!({
                "file": format!("{i}.wav"), "clock": "free", "source": { "at": SOURCE, "sd_m": 0 },
                "microphone": { "at": stated, "sd_m": sd_m },
            }));
        }
        let text = serde_json::json!({ "title": "L", "responses": entries }).to_string();
        fs::write(folder.join("measurements.json"), text).unwrap();
        folder.to_str().unwrap().to_owned()
    }

    /// Prints how far what a fit has written is from what is true.
    fn judge(&self, fitted: &str, at: &[[f64; 3]]) {
        let text = fs::read_to_string(self.text(&format!("{fitted}.report.json"))).unwrap();
        let report: serde_json::Value = serde_json::from_str(&text).unwrap();
        let numbers =
            |v: &serde_json::Value| -> Vec<f64> { v.as_array().unwrap().iter().map(|n| n.as_f64().unwrap()).collect() };
        let hz = numbers(&report["bands_hz"]);
        let of_truth = |a: &[f64; 7], hz: f64| {
            let at = (hz / 125.0).log2().clamp(0.0, 6.0);
            let (i, f) = ((at as usize).min(5), at - (at as usize).min(5) as f64);
            a[i] * (1.0 - f) + a[i + 1] * f
        };
        let mut off: [Vec<f64>; 2] = Default::default();
        for surface in report["surfaces"].as_array().unwrap() {
            let name = surface["name"].as_str().unwrap();
            let (_, truth) = MATERIALS.iter().find(|(n, _)| name == *n).unwrap();
            let mut row = String::new();
            for (band, hz) in surface["absorption"].as_array().unwrap().iter().zip(&hz) {
                let (value, told) = (band["value"].as_f64().unwrap(), of_truth(truth, *hz));
                row += &format!(" {value:.2}/{told:.2}");
                if (120.0..7000.0).contains(hz) {
                    off[usize::from(band["determined"].as_bool().unwrap())].push((value - told).abs());
                }
            }
            println!("  {name}:{row}");
        }
        let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len().max(1) as f64;
        println!(
            "|d absorption| {:.3} in {} numbers that are determined, {:.3} in {} others",
            mean(&off[1]),
            off[1].len(),
            mean(&off[0]),
            off[0].len()
        );
        let scattering =
            report["scattering"].as_array().unwrap().iter().zip(&hz).filter(|(_, hz)| (120.0..7000.0).contains(*hz));
        let apart: Vec<f64> =
            scattering.map(|(s, hz)| (s["value"].as_f64().unwrap() - of_truth(&SCATTERING, *hz)).abs()).collect();
        let mut places: Vec<f64> = report["places"]
            .as_array()
            .unwrap()
            .iter()
            .zip(at)
            .map(|(p, at)| numbers(&p["microphone_m"]).iter().zip(at).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt())
            .collect();
        places.sort_by(f64::total_cmp);
        println!(
            "|d scattering| {:.3}; places off {:.1} cm in the median, {:.1} at most; waves {}; left {:.3}",
            mean(&apart),
            100.0 * places[places.len() / 2],
            100.0 * places[places.len() - 1],
            report["waves"],
            report["left"].as_f64().unwrap()
        );
    }
}

/// Places of a lattice in the room, off its walls and 0.7 m off the source.
fn lattice(spacing_m: f64) -> Vec<[f64; 3]> {
    let count = |length: f64| (length / spacing_m).ceil() as usize;
    let all = (0..count(6.1)).flat_map(|i| (0..count(4.9)).map(move |j| (i, j)));
    all.map(|(i, j)| [0.55 + spacing_m * i as f64, 0.5 + spacing_m * j as f64, 1.5])
        .filter(|[x, y, _]| *x < 5.7 && *y < 4.5 && (*x < 3.0 || *y < 2.7))
        .filter(|[x, y, _]| (x - f64::from(SOURCE[0])).hypot(y - f64::from(SOURCE[1])) > 0.7)
        .collect()
}

/// Microphones at different heights.
fn lifted(at: &[[f64; 3]]) -> Vec<[f64; 3]> {
    at.iter().enumerate().map(|(i, [x, y, _])| [*x, *y, 1.0 + 0.35 * (i * 7 % 5) as f64 * 0.8]).collect()
}

#[test]
#[ignore = "long: figures"]
fn figures_through_simulate() {
    let truth = Truth::new();
    let at = lifted(&lattice(1.1));
    println!("{} places", at.len());
    for (name, sd_m, noise_db) in [("clean", 0.0, -150.0), ("noisy", 0.01, -50.0)] {
        let set = truth.measured(name, &at, sd_m, noise_db);
        let (room, out) = (truth.text("truth.obj"), truth.text(&format!("fit_{name}.obj")));
        let (_, said) = succeeds(&["fit", &room, &set, "-o", &out, "--hold", "walls,source"]);
        println!("{name}: {}", said.lines().last().unwrap_or_default());
        truth.judge(&format!("fit_{name}"), &at);
    }
}

/// T20 in per cent, C50 and level in dB, all by octave, ITD in microseconds and ILD in dB: means of distances.
fn apart(found: &[[Vec<f32>; 2]], truth: &[[Vec<f32>; 2]]) -> [f64; 5] {
    let rate = f64::from(RATE);
    let (mut sums, mut counts) = ([0.0_f64; 5], [0.0_f64; 5]);
    let mut add = |which: usize, off: f64| {
        sums[which] += off.abs();
        counts[which] += 1.0;
    };
    // From the direct sound on: scenes have delays of their own.
    let cut = |ear: &[Vec<f32>; 2]| -> [Vec<f32>; 2] {
        let first = onset(&ear[0]).unwrap_or(0).min(onset(&ear[1]).unwrap_or(0)).saturating_sub(48);
        [0, 1].map(|e| ear[e][first..].iter().copied().chain(std::iter::repeat(0.0)).take(40_000).collect())
    };
    for (found, truth) in found.iter().zip(truth) {
        let (found, truth) = (cut(found), cut(truth));
        for hz in OCTAVES_HZ {
            for ear in 0..2 {
                let [f, t] = [&found, &truth].map(|x| octave_of(&x[ear], rate, hz));
                let energy = |x: &[f32]| x.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
                add(2, 10.0 * (energy(&f) / energy(&t)).log10());
                if let (Ok(a), Ok(b)) = (c50_db(&f, rate), c50_db(&t, rate)) {
                    add(1, a - b);
                }
                let t20 = |x: &[f32]| decay_time_s(x, rate, DecayRange::T20);
                if let (Ok(a), Ok(b)) = (t20(&f), t20(&t)) {
                    add(0, 100.0 * (a / b - 1.0));
                }
            }
        }
        let of = |x: &[Vec<f32>; 2]| (itd_s(&x[0], &x[1], rate), ild_db(&x[0], &x[1]));
        if let ((Ok(a), Ok(b)), (Ok(c), Ok(d))) = (of(&found), of(&truth)) {
            add(3, 1e6 * (a - c));
            add(4, b - d);
        }
    }
    std::array::from_fn(|i| sums[i] / counts[i].max(1.0))
}

#[test]
#[ignore = "long: figures"]
fn figures_of_what_is_heard() {
    let truth = Truth::new();
    let all = lattice(0.6);
    // A third of the places is fitted to, and every fourth of a row of a lattice of four times the spacing is baked.
    let (known, others): (Vec<(usize, [f64; 3])>, Vec<_>) = all.iter().copied().enumerate().partition(|(i, _)| i % 3 == 1);
    let [known, others] = [known, others].map(|some| some.into_iter().map(|(_, at)| at).collect::<Vec<_>>());
    let (known, coarse) = (lifted(&known), lattice(2.4));
    println!("{} places, {} known, {} judged, {} baked", all.len(), known.len(), others.len(), coarse.len());
    let heard = |responses: Vec<Response>| -> Vec<[Vec<f32>; 2]> { responses.into_iter().map(|r| [r.left, r.right]).collect() };
    let judged = heard(truth.heard(HEAD, "judged", &others, "1", "72"));
    let again = heard(truth.heard(HEAD, "again", &others, "1", "73"));
    truth.heard(HEAD, "coarse", &coarse, "24", "74");
    let baked = truth.text("coarse.promenade");
    succeeds(&["bake", "responses", &truth.text("coarse"), "-o", &baked]);
    let set = truth.measured("known", &known, 0.0, -150.0);
    let (room, fitted) = (truth.text("truth.obj"), truth.text("fitted.promenade"));
    succeeds(&["fit", &room, &set, "-o", &fitted, "--head", HEAD, "--hold", "walls,source"]);
    truth.judge("fitted", &known);
    let source = SOURCE.map(|c| c.to_string()).join(",");
    let (own, of_truth) = (truth.text("fitted.obj"), truth.text("truth.promenade"));
    let of = ["simulate", &room, "--source", &source, "--materials", &truth.rules, "--head", HEAD, "--waves", "0"];
    succeeds(&[&of[..], &["-o", &of_truth]].concat());
    // The fitted room as `simulate` has it.
    let at: Vec<String> = others.iter().map(|[x, y, z]| format!("{x},{y},{z}")).collect();
    let places: Vec<&str> = at.iter().flat_map(|a| ["--at", a]).collect();
    let simulated = truth.text("simulated");
    let of = ["simulate", &own, "--source", &source, "--head", HEAD, "--waves", "0", "--turns", "1", "--length", "0.9"];
    succeeds(&[&of[..], &["-o", &simulated], &places].concat());
    let simulated = heard(Responses::load(Path::new(&simulated), &LoadOptions::default()).unwrap().responses);

    let (click, out) = (truth.text("click.wav"), truth.text("out.wav"));
    let mut samples = vec![0.0_f32; 24_000];
    samples[12_000] = 1.0;
    wav::write(Path::new(&click), RATE, &[&samples], Format::Float32).unwrap();
    let rendered = |scene: &str| -> Vec<[Vec<f32>; 2]> {
        let one = |at: &String| {
            succeeds(&["render", scene, &click, &out, "--bits", "32f", "--pose", &format!("{at},0,0,0")]);
            let wet = sound::read(Path::new(&out)).unwrap();
            [wet.channels[0].clone(), wet.channels[1].clone()]
        };
        at.iter().map(one).collect()
    };
    let scenes = [&fitted, &baked, &of_truth].map(|scene| rendered(scene));
    println!("| | octave T20 % | octave C50 dB | octave level dB | ITD us | ILD dB |");
    let rows = [
        ("fitted scene", &scenes[0]),
        ("fitted room, simulated", &simulated),
        ("scene baked at four times the spacing", &scenes[1]),
        ("scene of the true room", &scenes[2]),
        ("the true room by another seed", &again),
    ];
    for (name, found) in rows {
        let [t20, c50, level, itd, ild] = apart(found, &judged);
        println!("| {name} | {t20:.1} | {c50:.2} | {level:.2} | {itd:.0} | {ild:.2} |");
    }
}
