//! AV-Cloud's render head hop by hop, against whole clips.

use assert_no_alloc::assert_no_alloc;
use promenade_core::StftGrid;
use promenade_core::glam::{Mat3, Vec3};
use promenade_core::network::{CloudKind, CloudModel, CloudParts, Listener, Masks, Tensor};
use promenade_core::published::{
    ClipRenderer, ConvMode, FrameMasks, Projection, PublishedError, PublishedOptions, PublishedStream, StreamTaps, TapProjector,
};
use promenade_testing::clouds;
use promenade_testing::clouds::{Sizes, model};
use promenade_testing::{Noise, noise};

/// A hop that does not divide the transform, as in the published grid.
const GRID: StftGrid = StftGrid { sample_rate_hz: 22_050.0, n_fft: 64, hop: 15 };
const SIZES: Sizes = Sizes { anchors: 8, bands: 33, frames: 40, width: 32, hyper: 4 };
const LISTENER: Listener = Listener { centre: Vec3::new(0.4, -0.3, 1.2), camera_to_world: Mat3::IDENTITY };
/// No gate to speak of.
const OPEN: f32 = f32::INFINITY;
/// Frames that convolution layers look ahead.
const AHEAD: usize = 5;

fn change(model: &CloudModel, change: impl FnOnce(&mut CloudParts)) -> CloudModel {
    let mut parts = model.parts().clone();
    change(&mut parts);
    CloudModel::new(parts).unwrap()
}

/// Masks that let sound through.
fn masks(model: &CloudModel) -> Masks {
    let mut masks = Masks::new(&model.sizes());
    let mut noise = Noise::new(60);
    masks.mixture.iter_mut().for_each(|m| *m = 0.6 + 0.3 * noise.value());
    masks.difference.iter_mut().for_each(|d| *d = 0.7 * noise.value());
    masks.embedding.iter_mut().for_each(|e| *e = 1.5 * noise.value());
    masks
}

fn taps(model: &CloudModel, projection: Projection, causal_hops: usize) -> StreamTaps {
    let mut projector = TapProjector::new(model, projection, causal_hops).unwrap();
    let mut taps = projector.taps();
    projector.project(&LISTENER, &masks(model), &mut taps);
    taps
}

/// Output of a stream, and the magnitudes of both ears after each hop.
fn play(
    stream: &mut PublishedStream,
    input: &[f32],
    masks: &Masks,
    taps: Option<&StreamTaps>,
) -> ([Vec<f32>; 2], Vec<[Vec<f32>; 2]>) {
    let frame = FrameMasks { mixture: &masks.mixture, difference: &masks.difference, taps };
    let (mut out, mut magnitudes) = ([Vec::new(), Vec::new()], Vec::new());
    let (mut left, mut right) = (vec![0.0; GRID.hop], vec![0.0; GRID.hop]);
    for hop in input.chunks_exact(GRID.hop) {
        stream.hop(hop, frame, [&mut left, &mut right]);
        out[0].extend_from_slice(&left);
        out[1].extend_from_slice(&right);
        magnitudes.push([0, 1].map(|ear| stream.magnitudes(ear).to_vec()));
    }
    (out, magnitudes)
}

fn options(conv: ConvMode, taps: Option<&StreamTaps>, max_gain: f32) -> PublishedOptions {
    let (lookahead_hops, causal_hops) = taps.map_or((0, 1), |t| (t.lookahead_hops(), t.causal_hops()));
    PublishedOptions { conv, lookahead_hops, causal_hops, max_gain }
}

fn signal(samples: usize) -> Vec<f32> {
    Noise::new(3).take(samples).map(|v| 0.3 * v).collect()
}

/// Zeros to put before a signal so that a stream's frames are a clip's, and the stream's number of a clip's first frame.
fn alignment() -> (usize, usize) {
    let half = GRID.n_fft / 2;
    let frames = half.div_ceil(GRID.hop);
    (frames * GRID.hop - half, frames - 1)
}

/// A constant kernel that only depends on the lag, reaches back `lags` frames, and a bias that does not depend on the frame.
fn shift_invariant(lags: usize) -> CloudModel {
    let model = model(CloudKind::Full, Sizes { hyper: 0, ..SIZES });
    let frames = SIZES.frames;
    change(&model, |p| {
        let taps = noise(40, 3 * lags);
        let kernel = (0..3 * frames * frames).map(|flat| {
            let (i, s, t) = (flat / frames / frames, flat / frames % frames, flat % frames);
            if (s..s + lags).contains(&t) { 0.2 * taps[i * lags + t - s] } else { 0.0 }
        });
        let values = kernel.collect();
        p.weights.insert("post_process.kernel".to_owned(), Tensor { shape: vec![3 * frames, frames], values });
        for name in ["post_process.bias_model.2.weight", "post_process.bias_model.2.bias"] {
            let values = &mut p.weights.get_mut(name).unwrap().values;
            let row = values.len() / frames;
            (row..values.len()).for_each(|i| values[i] = values[i % row]);
        }
    })
}

#[test]
fn a_stream_that_looks_ahead_is_the_clip_inside_it() {
    const LAGS: usize = 6;
    let with_conv = shift_invariant(LAGS);
    let without = change(&with_conv, |p| p.weights.retain(|name, _| !name.starts_with("out.")));
    for (model, delay) in [(&with_conv, AHEAD), (&without, 0)] {
        let (masks, taps) = (masks(model), taps(model, Projection::Diagonal, LAGS));
        let mut clip = ClipRenderer::new(model, GRID).unwrap();
        let mut wanted = [vec![0.0; clip.out_samples()], vec![0.0; clip.out_samples()]];
        let input = signal(*clip.clip_samples().end());
        let [left, right] = &mut wanted;
        clip.render(&input, &masks, &LISTENER, [left, right]).unwrap();

        let mut stream = PublishedStream::new(model, GRID, options(ConvMode::LookAhead, Some(&taps), OPEN)).unwrap();
        assert_eq!(stream.latency_samples(), GRID.n_fft + delay * GRID.hop);
        let (lead, _) = alignment();
        let mut padded = vec![0.0; lead];
        padded.extend(&input);
        padded.resize(padded.len() + 20 * GRID.hop, 0.0);
        let (out, _) = play(&mut stream, &padded, &masks, Some(&taps));
        let lag = lead + stream.latency_samples() - GRID.hop;
        // Three frames at either end hold reflected samples; taps and convolution layers hand them on.
        let inside = (3 + LAGS + AHEAD) * GRID.hop + GRID.n_fft..clip.out_samples() - (3 + AHEAD) * GRID.hop - GRID.n_fft;
        assert!(inside.len() > 5 * GRID.hop);
        let peak = wanted[0].iter().fold(0.0_f32, |p, v| p.max(v.abs()));
        assert!(peak > 0.05, "{peak}");
        for (out, wanted) in out.iter().zip(&wanted) {
            for i in inside.clone() {
                assert!((out[i + lag] - wanted[i]).abs() < 1e-4, "{i}: {} for {}", out[i + lag], wanted[i]);
            }
        }
    }
}

#[test]
fn a_row_of_the_matrix_is_that_frame_of_clips_shifted_along_the_stream() {
    const ROW: usize = 33;
    let constant = Sizes { hyper: 0, ..SIZES };
    for (kind, sizes) in
        [(CloudKind::Full, SIZES), (CloudKind::Full, constant), (CloudKind::Sh, SIZES), (CloudKind::SimpleSh, SIZES)]
    {
        let model = change(&model(kind, sizes), |p| p.weights.retain(|name, _| !name.starts_with("out.")));
        let (masks, taps) = (masks(&model), taps(&model, Projection::Row(ROW), ROW + 1));
        assert_eq!(taps.lookahead_hops(), SIZES.frames - 1 - ROW);
        let mut clip = ClipRenderer::new(&model, GRID).unwrap();
        let samples = clip.out_samples();
        // A sound with silence around it: nothing is reflected at the clips' ends.
        let burst = (ROW - 1) * GRID.hop..samples - GRID.n_fft / 2;
        let input: Vec<f32> =
            noise(5, 2 * samples).into_iter().enumerate().map(|(i, v)| if burst.contains(&i) { v } else { 0.0 }).collect();
        let (lead, first) = alignment();
        let mut padded = vec![0.0; lead];
        padded.extend(&input);
        let mut stream = PublishedStream::new(&model, GRID, options(ConvMode::Off, Some(&taps), OPEN)).unwrap();
        assert_eq!(stream.latency_samples(), GRID.n_fft + taps.lookahead_hops() * GRID.hop);
        let (_, magnitudes) = play(&mut stream, &padded, &masks, Some(&taps));
        let mut compared = 0;
        for shift in 0..8 {
            let mut out = [vec![0.0; samples], vec![0.0; samples]];
            let [left, right] = &mut out;
            clip.render(&input[shift * GRID.hop..][..samples], &masks, &LISTENER, [left, right]).unwrap();
            let frame = shift + ROW;
            let sounds = burst.start < frame * GRID.hop && frame * GRID.hop < burst.end;
            for ear in (0..2).filter(|_| sounds) {
                let found = &magnitudes[frame + first + taps.lookahead_hops()][ear];
                let wanted = clip.magnitudes(ear).nth(ROW).unwrap();
                for (f, (a, b)) in found.iter().zip(wanted).enumerate() {
                    assert!((a - b).abs() < 1e-4, "{} {shift} {ear} {f}: {a} for {b}", kind.name());
                    compared += usize::from(*b > 0.0);
                }
            }
        }
        assert!(compared > 50, "{compared}");
    }
}

#[test]
fn the_causal_stream_adds_late_convolution_to_the_undelayed_base() {
    let model = shift_invariant(4);
    let (masks, taps) = (masks(&model), taps(&model, Projection::Diagonal, 4));
    let input = signal(40 * GRID.hop);
    let magnitudes = |conv, taps: Option<&StreamTaps>| {
        let mut stream = PublishedStream::new(&model, GRID, options(conv, taps, OPEN)).unwrap();
        play(&mut stream, &input, &masks, taps).1
    };
    // Without taps nothing is added to the base.
    let base = magnitudes(ConvMode::Off, None);
    let ahead = magnitudes(ConvMode::LookAhead, Some(&taps));
    let causal = magnitudes(ConvMode::Causal, Some(&taps));
    let (mut compared, mut differ) = (0, false);
    for k in 2 * AHEAD..base.len() {
        for ear in 0..2 {
            for f in 0..SIZES.bands {
                // Where no ReLU has cut anything off, what the layers add can be told.
                let (delayed, now) = (base[k - AHEAD][ear][f], base[k][ear][f]);
                if ahead[k][ear][f] > 0.0 && delayed > 0.0 && now > 0.0 {
                    let want = (ahead[k][ear][f] - delayed + now).max(0.0);
                    assert!((causal[k][ear][f] - want).abs() < 1e-4, "{k} {ear} {f}");
                    compared += 1;
                    differ |= (causal[k][ear][f] - ahead[k][ear][f]).abs() > 0.01;
                }
            }
        }
    }
    assert!(compared > 100 && differ, "{compared}");
}

#[test]
fn layers_that_add_nothing_leave_a_delay_of_five_hops_between_the_modes() {
    let model = change(&shift_invariant(4), |p| {
        for name in ["out.4.weight", "out.4.bias"] {
            p.weights.get_mut(name).unwrap().values.fill(0.0);
        }
    });
    let (masks, taps) = (masks(&model), taps(&model, Projection::Diagonal, 4));
    let input = signal(40 * GRID.hop);
    let [causal, ahead] = [ConvMode::Causal, ConvMode::LookAhead].map(|conv| {
        let mut stream = PublishedStream::new(&model, GRID, options(conv, Some(&taps), OPEN)).unwrap();
        (play(&mut stream, &input, &masks, Some(&taps)).0, stream.latency_samples())
    });
    assert_eq!(ahead.1 - causal.1, AHEAD * GRID.hop);
    assert!(causal.0[0].iter().any(|v| v.abs() > 0.01));
    assert_eq!(causal.0[0][..35 * GRID.hop], ahead.0[0][AHEAD * GRID.hop..]);
}

#[test]
fn masks_alone_are_gains_after_the_stated_latency() {
    let model = change(&model(CloudKind::SimpleSh, SIZES), |p| p.weights.retain(|name, _| !name.starts_with("out.")));
    let masks = Masks { mixture: vec![0.5; SIZES.bands], difference: vec![0.25; SIZES.bands], embedding: Vec::new() };
    let mut stream = PublishedStream::new(&model, GRID, options(ConvMode::LookAhead, None, 2.0)).unwrap();
    assert_eq!(stream.latency_samples(), GRID.n_fft);
    let input = signal(60 * GRID.hop);
    let (out, _) = play(&mut stream, &input, &masks, None);
    // What a call gives out would sound a hop later.
    let lag = stream.latency_samples() - GRID.hop;
    for (out, gain) in out.iter().zip([0.375, 0.625]) {
        assert!(out[..lag].iter().all(|y| y.abs() < 1e-6));
        for (y, x) in out[lag..].iter().zip(&input) {
            assert!((y - gain * x).abs() < 1e-6);
        }
    }
}

#[test]
fn silence_gives_silence_and_no_bin_exceeds_the_gate() {
    let model = model(CloudKind::Full, SIZES);
    let (masks, taps) = (masks(&model), taps(&model, Projection::Row(36), 20));
    for conv in [ConvMode::Off, ConvMode::Causal, ConvMode::LookAhead] {
        let mut stream = PublishedStream::new(&model, GRID, options(conv, Some(&taps), 4.0)).unwrap();
        let silent = vec![0.0; 60 * GRID.hop];
        for quiet in [silent.clone(), vec![1e-39; 60 * GRID.hop]] {
            let (out, _) = play(&mut stream, &quiet, &masks, Some(&taps));
            assert!(out.iter().flatten().all(|v| *v == 0.0));
        }
        let (loud, magnitudes) = play(&mut stream, &signal(60 * GRID.hop), &masks, Some(&taps));
        assert!(loud.iter().flatten().any(|v| v.abs() > 0.01));
        // Noise of 0.3 in a window of that length has a magnitude of at most 0.3 times the window's sum.
        let most = 4.0 * 0.3 * GRID.n_fft as f32 / 2.0;
        assert!(magnitudes.iter().flatten().flatten().all(|m| *m <= most));
        let (out, _) = play(&mut stream, &silent, &masks, Some(&taps));
        // The last frame with sound in it reaches a transform's length beyond it.
        let end = stream.latency_samples() + GRID.n_fft;
        assert!(out.iter().all(|o| o[end..].iter().all(|v| *v == 0.0)));
    }
    // Shut, nothing comes through at all.
    let mut stream = PublishedStream::new(&model, GRID, options(ConvMode::Causal, Some(&taps), 0.0)).unwrap();
    let (out, _) = play(&mut stream, &signal(30 * GRID.hop), &masks, Some(&taps));
    assert!(out.iter().flatten().all(|v| *v == 0.0));
}

#[test]
fn a_stream_gets_over_samples_that_are_no_numbers() {
    let model = model(CloudKind::SimpleSh, SIZES);
    let (masks, taps) = (masks(&model), taps(&model, Projection::Diagonal, 8));
    let mut stream = PublishedStream::new(&model, GRID, options(ConvMode::Causal, Some(&taps), 4.0)).unwrap();
    let mut input = signal(60 * GRID.hop);
    for (i, bad) in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e38, 1e-42].into_iter().enumerate() {
        input[200 + 7 * i] = bad;
    }
    let (out, _) = play(&mut stream, &input, &masks, Some(&taps));
    assert!(out.iter().flatten().all(|v| v.abs() < 100.0));
}

#[test]
fn a_stream_that_is_reset_is_a_new_one() {
    let model = model(CloudKind::Sh, SIZES);
    let (masks, taps) = (masks(&model), taps(&model, Projection::Row(30), 12));
    let input = signal(50 * GRID.hop);
    for conv in [ConvMode::Off, ConvMode::Causal, ConvMode::LookAhead] {
        let make = || PublishedStream::new(&model, GRID, options(conv, Some(&taps), 4.0)).unwrap();
        let (fresh, _) = play(&mut make(), &input, &masks, Some(&taps));
        let mut stream = make();
        play(&mut stream, &signal(33 * GRID.hop), &masks, Some(&taps));
        stream.reset();
        assert_eq!(play(&mut stream, &input, &masks, Some(&taps)).0, fresh);
    }
}

#[test]
fn taps_between_two_places_are_between_their_taps() {
    for kind in CloudKind::PUBLISHED {
        let model = model(kind, SIZES);
        let mut projector = TapProjector::new(&model, Projection::Diagonal, 6).unwrap();
        let [mut from, mut to, mut between] = std::array::from_fn(|_| projector.taps());
        let mut masks = masks(&model);
        projector.project(&LISTENER, &masks, &mut from);
        masks.embedding.iter_mut().for_each(|e| *e = 0.5 - *e);
        projector.project(&Listener { centre: -LISTENER.centre, ..LISTENER }, &masks, &mut to);
        between.blend(&from, &to, 0.25);
        let added = |taps: &StreamTaps| {
            let mut stream = PublishedStream::new(&model, GRID, options(ConvMode::Off, Some(taps), OPEN)).unwrap();
            let masks = Masks { mixture: vec![1.0; SIZES.bands], difference: vec![0.0; SIZES.bands], embedding: Vec::new() };
            play(&mut stream, &signal(30 * GRID.hop), &masks, Some(taps)).1.remove(20)[0].clone()
        };
        let [from, to, between] = [&from, &to, &between].map(added);
        let mut furthest = 0.0_f32;
        for ((a, b), found) in from.iter().zip(&to).zip(&between) {
            // Where the ReLU has cut nothing off.
            if *a > 0.0 && *b > 0.0 {
                let want = a + 0.25 * (b - a);
                assert!((found - want).abs() < 1e-5, "{} {found} for {want}", kind.name());
                furthest = furthest.max((b - a).abs());
            }
        }
        assert!(furthest > 0.002, "{furthest}");
    }
}

#[test]
fn neither_hops_nor_taps_nor_clips_allocate() {
    for kind in CloudKind::PUBLISHED {
        let model = model(kind, SIZES);
        let masks = masks(&model);
        for projection in [Projection::Diagonal, Projection::Row(35)] {
            let mut projector = TapProjector::new(&model, projection, 9).unwrap();
            let [mut taps, silent, mut glide] = std::array::from_fn(|_| projector.taps());
            let mut stream = PublishedStream::new(&model, GRID, options(ConvMode::Causal, Some(&taps), 4.0)).unwrap();
            let input = signal(GRID.hop);
            let mut out = [vec![0.0; GRID.hop], vec![0.0; GRID.hop]];
            assert_no_alloc(|| {
                projector.project(&LISTENER, &masks, &mut taps);
                for i in 0..30_u8 {
                    glide.blend(&silent, &taps, f32::from(i) / 30.0);
                    let frame = FrameMasks { mixture: &masks.mixture, difference: &masks.difference, taps: Some(&glide) };
                    let [left, right] = &mut out;
                    stream.hop(&input, frame, [left, right]);
                }
                stream.reset();
            });
        }
        let mut clip = ClipRenderer::new(&model, GRID).unwrap();
        let input = signal(clip.out_samples());
        let mut out = [vec![0.0; clip.out_samples()], vec![0.0; clip.out_samples()]];
        assert_no_alloc(|| {
            let [left, right] = &mut out;
            assert!(clip.render(&input, &masks, &LISTENER, [left, right]).is_ok());
        });
    }
}

#[test]
fn a_model_for_streams_has_neither_convolution_layers_nor_clips() {
    let mut parts = clouds::parts(CloudKind::Taps, SIZES);
    let refused = CloudModel::new(parts.clone()).unwrap_err().to_string();
    assert!(refused.contains("'taps' has no place for out.0.bias"), "{refused}");
    parts.weights.retain(|name, _| !name.starts_with("out."));
    let model = CloudModel::new(parts).unwrap();
    assert_eq!(ClipRenderer::new(&model, GRID).err(), Some(PublishedError::Streamed));
}
