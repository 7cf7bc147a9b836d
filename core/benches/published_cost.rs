//! Cost of AV-Cloud's render head: convolution layers, stream and whole clips.
//!
//! `cargo bench --bench published_cost -p promenade-core`. Unit: milliseconds of processor time of the one thread, median over
//! runs, at the published sizes (256 anchors, 257 bands, 174 frames, 22.05 kHz). Input: white noise; weights that look random.
#![allow(missing_docs, clippy::print_stdout, reason = "a program that prints a table")]

use cpu_time::ThreadTime;
use promenade_core::decode::InlineWorker;
use promenade_core::glam::{Mat3, Vec3};
use promenade_core::network::{CloudKind, Listener, Masks, Network};
use promenade_core::published::{
    ClipRenderer, ConvMode, FrameMasks, Projection, PublishedOptions, PublishedStream, TapProjector,
};
use promenade_core::{AnchorCloud, Bands, LiveParams, Pose, Renderer, RendererConfig, Scene, SceneParts, StftGrid, TailModel};
use promenade_testing::clouds::{PUBLISHED, Sizes, model};
use promenade_testing::{Noise, noise};
use pulp::Arch;
use std::hint::black_box;
use std::sync::Arc;

const GRID: StftGrid = StftGrid { sample_rate_hz: 22_050.0, n_fft: 512, hop: 127 };
const LISTENER: Listener = Listener { centre: Vec3::new(0.3, -0.2, 1.1), camera_to_world: Mat3::IDENTITY };

/// Median milliseconds of a run.
fn median_ms(runs: usize, mut work: impl FnMut()) -> f64 {
    work();
    let mut times: Vec<f64> = (0..runs)
        .map(|_| {
            let start = ThreadTime::now();
            work();
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[runs / 2]
}

/// Instruction sets to compare: the machine's widest, and AVX2 if that is not it.
fn arches() -> Vec<(&'static str, Arch)> {
    let mut all = vec![("widest", Arch::new())];
    #[cfg(target_arch = "x86_64")]
    if let Some(v3) = pulp::x86::V3::try_new() {
        all.push(("AVX2", Arch::V3(v3)));
    }
    all
}

fn main() {
    let input: Vec<f32> = Noise::new(1).take(22_050).map(|v| 0.3 * v).collect();
    stream(&input);
    println!("| clip of 1 s | instructions | decode | render | of it without convolution | both |");
    println!("|---|---|---|---|---|---|");
    let kinds = [
        ("simple-sh", CloudKind::SimpleSh, PUBLISHED),
        ("sh", CloudKind::Sh, PUBLISHED),
        ("full, constant kernel", CloudKind::Full, Sizes { hyper: 0, ..PUBLISHED }),
        ("full, live kernel", CloudKind::Full, PUBLISHED),
    ];
    for (name, kind, sizes) in kinds {
        clip(name, kind, sizes, &input);
    }
    at_hosts();
}

/// The published head with a listener who stands still, at the model's rate and at hosts'.
fn at_hosts() {
    println!("| published head for 1 s, at | latency ms | cost |");
    println!("|---|---|---|");
    let bands = Bands::for_rate(GRID.sample_rate_hz);
    let tail = TailModel { seed: 3, t60_s: vec![0.1; bands.count()], coherence: vec![0.0; bands.count()], by_phase: false };
    let model = model(CloudKind::SimpleSh, PUBLISHED);
    let cloud = AnchorCloud { model, conv: ConvMode::LookAhead, projection: Projection::Diagonal, emitter: None };
    let parts = SceneParts { taps: 32, cloud: Some(cloud), top_hz: 10_000.0, ..SceneParts::new(GRID, bands, tail) };
    let scene = Arc::new(Scene::new(parts).unwrap());
    let live = LiveParams { wait: true, ..LiveParams::default() };
    for rate in [22_050, 44_100, 48_000, 96_000_u32] {
        let mut renderer = Renderer::new(
            Arc::clone(&scene),
            RendererConfig { workers: InlineWorker::several(&scene, 1), ..f64::from(rate).into() },
        )
        .unwrap();
        let input = noise(7, rate as usize);
        let mut out = [vec![0.0; input.len()], vec![0.0; input.len()]];
        let cost = median_ms(21, || {
            let [left, right] = &mut out;
            renderer.process(&[input[..].into()], [left, right], live, &mut |_| Pose::IDENTITY);
            black_box(&out);
        });
        let latency_ms = 1e3 * renderer.latency_samples() as f64 / f64::from(rate);
        println!("| {rate} Hz | {latency_ms:.1} | {cost:.1} |");
    }
}

fn clip(name: &str, kind: CloudKind, sizes: Sizes, input: &[f32]) {
    let model = model(kind, sizes);
    let mut dry = model.parts().clone();
    dry.weights.retain(|name, _| !name.starts_with("out."));
    let dry = promenade_core::network::CloudModel::new(dry).unwrap();
    for (instructions, arch) in arches() {
        let mut decoder = Network::with_arch(&model, arch);
        let mut masks = Masks::new(&model.sizes());
        let decode = median_ms(41, || decoder.decode(&LISTENER, &mut masks));
        let render = |model| {
            let mut renderer = ClipRenderer::with_arch(model, GRID, arch).unwrap();
            let mut out = [vec![0.0; renderer.out_samples()], vec![0.0; renderer.out_samples()]];
            median_ms(41, || {
                let [left, right] = &mut out;
                renderer.render(input, &masks, &LISTENER, [left, right]).unwrap();
                black_box(&out);
            })
        };
        let (whole, without) = (render(&model), render(&dry));
        println!("| {name} | {instructions} | {decode:.2} | {whole:.2} | {without:.2} | {:.2} |", decode + whole);
    }
}

fn stream(input: &[f32]) {
    let live = model(CloudKind::Full, PUBLISHED);
    let harmonic = model(CloudKind::SimpleSh, PUBLISHED);
    println!("| per hop | instructions | taps for a pose | hop without convolution | hop with it | convolution, both ears |");
    println!("|---|---|---|---|---|---|");
    for (name, model, projection) in [
        ("simple-sh, 32 lags", &harmonic, Projection::Diagonal),
        ("full, 32 lags", &live, Projection::Diagonal),
        ("full, row 165 of 174", &live, Projection::Row(165)),
    ] {
        let masks = {
            let mut masks = Masks::new(&model.sizes());
            Network::new(model).decode(&LISTENER, &mut masks);
            masks
        };
        let causal_hops = if projection == Projection::Diagonal { 32 } else { 166 };
        let lookahead_hops = projection.lookahead_hops(PUBLISHED.frames);
        let mut projector = TapProjector::new(model, projection, causal_hops).unwrap();
        let mut taps = projector.taps();
        let project = median_ms(201, || projector.project(&LISTENER, &masks, &mut taps));
        let frame = FrameMasks { mixture: &masks.mixture, difference: &masks.difference, taps: Some(&taps) };
        for (instructions, arch) in arches() {
            let cost = |conv| {
                let options = PublishedOptions { conv, lookahead_hops, causal_hops, ..PublishedOptions::default() };
                let mut stream = PublishedStream::with_arch(model, GRID, options, arch).unwrap();
                let mut out = [vec![0.0; GRID.hop], vec![0.0; GRID.hop]];
                let hops = input.len() / GRID.hop;
                median_ms(41, || {
                    for hop in input.chunks_exact(GRID.hop) {
                        let [left, right] = &mut out;
                        stream.hop(hop, frame, [left, right]);
                    }
                    black_box(&out);
                }) / hops as f64
            };
            let (without, with) = (cost(ConvMode::Off), cost(ConvMode::Causal));
            println!("| {name} | {instructions} | {project:.4} | {without:.4} | {with:.4} | {:.4} |", with - without);
        }
    }
}
