//! Live decoding behind the stream.

use assert_no_alloc::assert_no_alloc;
use promenade_core::decode::CloudDecoder;
use promenade_core::glam::Vec3;
use promenade_core::network::CloudKind;
use promenade_core::published::{ConvMode, FrameMasks, Projection, PublishedStream};
use promenade_core::{
    AnchorCloud, Bands, BlockParams, DecodeWorker, Decoded, LiveParams, Pose, Renderer, RendererConfig, Scene, SceneParts,
    Spatializer, StftGrid, TailModel,
};
use promenade_testing::golden;
use promenade_testing::noise;
use promenade_testing::scenes::{live_renderer, render};
use std::sync::Arc;

const RATE: f64 = 22_050.0;

fn scene(kind: CloudKind, conv: ConvMode, projection: Projection) -> Arc<Scene> {
    let bands = Bands::for_rate(RATE);
    let tail = TailModel { seed: 3, t60_s: vec![0.1; bands.count()], coherence: vec![0.0; bands.count()], by_phase: false };
    let parts = SceneParts {
        taps: 16,
        cloud: Some(AnchorCloud { model: golden::slice(kind).model, conv, projection, emitter: None }),
        top_hz: 10_000.0,
        bounds: (Vec3::splat(-1.0), Vec3::ONE),
        ..SceneParts::new(StftGrid { sample_rate_hz: RATE, n_fft: 512, hop: 127 }, bands, tail)
    };
    Arc::new(Scene::new(parts).unwrap())
}

fn spatializer(scene: &Arc<Scene>, rate: f64) -> Spatializer {
    let mut s = Spatializer::new(rate);
    s.install(Box::new(live_renderer(scene, rate)));
    s
}

fn params() -> BlockParams {
    BlockParams { live: LiveParams { rate_hz: 40.0, wait: true }, ..BlockParams::default() }
}

fn walk(i: usize) -> Pose {
    let t = i as f32 / RATE as f32;
    Pose::from_ypr(Vec3::new(0.3 * t, 0.1, 0.0), t, 0.0, 0.0)
}

#[test]
fn a_scene_with_a_cloud_survives_the_file() {
    for kind in CloudKind::PUBLISHED {
        let scene = scene(kind, ConvMode::LookAhead, Projection::Row(38));
        let bytes = scene.to_bytes().unwrap();
        assert!(Scene::from_bytes(&bytes).unwrap() == *scene);
        assert!(bytes == scene.to_bytes().unwrap(), "the same scene makes the same file");
    }
}

#[test]
fn blocks_of_any_size_sound_alike_and_twice_the_same() {
    let input = noise(1, 22_050);
    for conv in [ConvMode::Off, ConvMode::LookAhead] {
        let scene = scene(CloudKind::SimpleSh, conv, Projection::Diagonal);
        let run = |sizes: &[usize]| render(&mut spatializer(&scene, RATE), &input, sizes, &params(), walk);
        let whole = run(&[512]);
        assert!(whole.iter().flatten().all(|v| v.is_finite()) && whole[0].iter().any(|v| v.abs() > 1e-3));
        assert!(whole == run(&[512]), "{conv:?} differs from itself");
        for (a, b) in whole.iter().flatten().zip(run(&[1, 700, 64]).iter().flatten()) {
            assert!((a - b).abs() < 1e-5, "{conv:?}");
        }
    }
}

#[test]
fn a_click_comes_when_the_latency_says() {
    for conv in [ConvMode::LookAhead, ConvMode::Causal, ConvMode::Off] {
        let scene = scene(CloudKind::SimpleSh, conv, Projection::Diagonal);
        let mut s = spatializer(&scene, RATE);
        let (at, latency) = (4_000, s.latency_samples());
        let mut input = vec![0.0; 12_000];
        input[at] = 1.0;
        let out = render(&mut s, &input, &[256], &params(), |_| Pose::IDENTITY);
        let peak = (0..out[0].len()).max_by(|a, b| out[0][*a].abs().total_cmp(&out[0][*b].abs())).unwrap();
        // The network's biases spread a click over a window.
        assert!(peak.abs_diff(at + latency) < 300, "{conv:?}: {peak} for {}", at + latency);
    }
}

#[test]
fn the_published_head_is_played_as_a_stream() {
    for (conv, projection) in [(ConvMode::LookAhead, Projection::Row(36)), (ConvMode::Causal, Projection::Diagonal)] {
        let scene = scene(CloudKind::Full, conv, projection);
        let input = noise(5, 127 * 80);
        let mut s = spatializer(&scene, RATE);
        // Before that, nothing that came in is due yet.
        let due = s.latency_samples();
        let heard = render(&mut s, &input, &[300], &params(), |_| Pose::IDENTITY);

        let cloud = scene.cloud().unwrap();
        let mut decoder = CloudDecoder::new(&scene).unwrap();
        let mut decoded = decoder.blank();
        decoder.decode(&Pose::IDENTITY, &mut decoded);
        let frame = decoded.published.unwrap();
        let mut stream = PublishedStream::new(&cloud.model, *scene.grid(), cloud.stream_options(16)).unwrap();
        let mut hop = [vec![0.0; 127], vec![0.0; 127]];
        for (number, x) in input.chunks(127).take(79).enumerate() {
            let masks = FrameMasks { mixture: &frame.mixture, difference: &frame.difference, taps: frame.taps.as_ref() };
            let [left, right] = &mut hop;
            stream.hop(x, masks, [left, right]);
            // The renderer collects a hop before it renders it.
            let start = (number + 1) * 127;
            for (heard, wanted) in heard.iter().zip(&hop) {
                for (i, w) in wanted.iter().enumerate().filter(|(i, _)| start + i >= due) {
                    let h = heard[start + i];
                    assert!((h - w).abs() < 1e-6, "{conv:?}, hop {number}: {h} for {w}");
                }
            }
        }
    }
}

/// A sound between its samples, by a windowed sinc function.
fn between(sound: &[f32], at: f64) -> f64 {
    const REACH: usize = 150;
    let first = at.floor() as usize - REACH;
    let weight = |i: usize| {
        let x = std::f64::consts::PI * (at - i as f64);
        let window = (0.5 * x / (REACH + 1) as f64).cos().powi(2);
        if x.abs() < 1e-9 { 1.0 } else { window * x.sin() / x }
    };
    (first..=first + 2 * REACH + 1).map(|i| f64::from(sound[i]) * weight(i)).sum()
}

#[test]
fn the_published_head_sounds_at_every_rate_as_at_the_models() {
    // A second of noise below 0.7 of the model's band, which the slowest host still has: its bins are whole numbers of hertz.
    let count = RATE as usize;
    let mut spectrum = promenade_fourier::spectrum(noise(9, count), count);
    spectrum.truncate((0.35 * RATE) as usize);
    let at_rate = |rate: f64| -> Vec<f32> {
        let gain = (rate / RATE) as f32;
        promenade_fourier::signal(spectrum.clone(), rate as usize).into_iter().map(|x: f32| gain * x).collect()
    };
    for (kind, conv) in CloudKind::PUBLISHED.into_iter().zip([ConvMode::LookAhead, ConvMode::Causal, ConvMode::LookAhead]) {
        let scene = scene(kind, conv, Projection::Diagonal);
        let heard = |rate: f64| {
            let mut s = spatializer(&scene, rate);
            let out = render(&mut s, &at_rate(rate), &[512], &params(), |_| Pose::IDENTITY);
            (out, s.latency_samples())
        };
        let (own, own_latency) = heard(RATE);
        let peak = own.iter().flatten().fold(0.0_f32, |a, x| a.max(x.abs()));
        for rate in [16_000.0, 44_100.0, 48_000.0, 96_000.0] {
            let (out, latency) = heard(rate);
            assert!((latency as f64) < 0.2 * rate, "{latency} samples at {rate}");
            let mut worst = 0.0_f64;
            // From where nothing is heard of the beginning any more.
            for i in (0.4 * rate) as usize..(0.75 * rate) as usize {
                let time = i as f64 / rate;
                for (out, own) in out.iter().zip(&own) {
                    let wanted = between(own, time * RATE + own_latency as f64);
                    worst = worst.max((f64::from(out[i + latency]) - wanted).abs() / f64::from(peak));
                }
            }
            println!("{kind:?} {conv:?} at {rate} Hz: {latency} samples late, error over peak {worst:.2e}");
            let most = if rate < RATE { 1e-3 } else { 1e-5 };
            assert!(worst < most, "{kind:?} at {rate}: {worst}");
        }
    }
}

#[test]
fn what_the_model_has_no_band_for_does_not_alias_into_it() {
    let scene = scene(CloudKind::Full, ConvMode::LookAhead, Projection::Diagonal);
    for hz in [12_500.0, 15_000.0, 20_000.0] {
        let tone: Vec<f32> = (0..48_000).map(|i| (std::f64::consts::TAU * hz * f64::from(i) / 48_000.0).sin() as f32).collect();
        let mut s = spatializer(&scene, 48_000.0);
        let out = render(&mut s, &tone, &[512], &params(), |_| Pose::IDENTITY);
        // The tone begins and ends at once, which is heard in every band.
        let loudest = out.iter().flat_map(|ear| &ear[20_000..46_000]).fold(0.0_f32, |a, x| a.max(x.abs()));
        println!("{hz} Hz: {:.1} dB", 20.0 * loudest.log10());
        assert!(20.0 * loudest.log10() < -90.0, "{hz} Hz");
    }
}

#[test]
fn layers_that_cannot_be_converted_are_left_out() {
    let [off, cloud] = [ConvMode::Off, ConvMode::Causal].map(|conv| scene(CloudKind::Sh, conv, Projection::Diagonal));
    let latency = |scene: &Arc<Scene>, rate| live_renderer(scene, rate).latency_samples();
    assert!(latency(&off, RATE) < latency(&cloud, RATE) && latency(&off, 48_000.0) < latency(&cloud, 48_000.0));
    assert_eq!(latency(&off, 47_999.0), latency(&cloud, 47_999.0), "no whole number of samples in a block");
}

#[test]
fn silence_stays_silent() {
    for conv in [ConvMode::Off, ConvMode::LookAhead] {
        let scene = scene(CloudKind::Full, conv, Projection::Diagonal);
        let out = render(&mut spatializer(&scene, RATE), &vec![0.0; 8_000], &[480], &params(), walk);
        assert!(out.iter().flatten().all(|v| *v == 0.0), "{conv:?}");
    }
}

/// Answers after some hops, as a thread would.
struct Slow {
    decoder: CloudDecoder,
    answer: Decoded,
    due: Option<(usize, Pose)>,
    delay: usize,
}

impl DecodeWorker for Slow {
    fn blank(&self) -> Decoded {
        self.decoder.blank()
    }

    fn request(&mut self, pose: &Pose, wait: bool) {
        self.due = Some((if wait { 0 } else { self.delay }, *pose));
    }

    fn take(&mut self) -> Option<&Decoded> {
        let (left, pose) = self.due?;
        if left > 0 {
            self.due = Some((left - 1, pose));
            return None;
        }
        self.due = None;
        self.decoder.decode(&pose, &mut self.answer);
        Some(&self.answer)
    }
}

#[test]
fn an_answer_that_comes_late_is_heard_without_allocation() {
    [RATE, 48_000.0].into_iter().for_each(late_answers_are_heard);
}

fn late_answers_are_heard(rate: f64) {
    let scene = scene(CloudKind::SimpleSh, ConvMode::LookAhead, Projection::Diagonal);
    let decoder = CloudDecoder::new(&scene).unwrap();
    let slow = Slow { answer: decoder.blank(), decoder, due: None, delay: 3 };
    let mut s = Spatializer::new(rate);
    let config = RendererConfig { workers: vec![Box::new(slow)], ..rate.into() };
    s.install(Box::new(Renderer::new(Arc::clone(&scene), config).unwrap()));
    let tone: Vec<f32> = (0..33_075).map(|i| 0.5 * (std::f32::consts::TAU * 1000.0 * i as f32 / RATE as f32).sin()).collect();
    let mut out = [vec![0.0; tone.len()], vec![0.0; tone.len()]];
    let live = LiveParams { rate_hz: 40.0, wait: false };
    for (block, x) in tone.chunks(441).enumerate() {
        let params = BlockParams { live, ..BlockParams::default() };
        let at = block * 441;
        let [l, r] = &mut out;
        let out = [&mut l[at..at + x.len()], &mut r[at..at + x.len()]];
        assert_no_alloc(|| s.process(&[x], &[], out, &params, |i| walk(at + i)));
    }
    assert!(out.iter().flatten().all(|v| v.is_finite()) && out[0][20_000..].iter().any(|v| v.abs() > 1e-3));
}

#[test]
fn the_attention_of_the_anchors_adds_up() {
    for kind in CloudKind::PUBLISHED {
        let scene = scene(kind, ConvMode::Off, Projection::Diagonal);
        let mut decoder = CloudDecoder::new(&scene).unwrap();
        let (mut plain, mut watched) = (decoder.blank(), decoder.blank());
        let mut attention = vec![0.0; scene.cloud().unwrap().model.sizes().anchors];
        decoder.decode(&walk(5_000), &mut plain);
        decoder.decode_with_attention(&walk(5_000), &mut attention, &mut watched);
        assert!((attention.iter().sum::<f32>() - 1.0).abs() < 1e-4 && attention.iter().all(|a| *a >= 0.0), "{kind:?}");
        assert!(plain.transfer == watched.transfer, "{kind:?}: watching changes what is heard");
    }
}
