//! The anchor-cloud decoders against golden vectors, a plain decoder in double precision, and themselves.

use crate::oracle::{Case, Exact};
use assert_no_alloc::assert_no_alloc;
use promenade_core::glam::{Mat3, Vec3};
use promenade_core::network::{CloudKind, CloudModel, Listener, Masks, Network};
use promenade_testing::golden;
use promenade_testing::golden::Golden;
use pulp::Arch;

/// Largest differences that are let pass: mixture, difference, embedding, attention.
const BARS: [f32; 4] = [2e-5, 2e-5, 5e-5, 1e-5];

#[test]
fn golden_masks_embeddings_and_attention_come_out() {
    for kind in CloudKind::PUBLISHED {
        check_golden(kind, "slice", &golden::slice(kind));
    }
}

fn check_golden(kind: CloudKind, set: &str, golden: &Golden) {
    let sizes = golden.model.sizes();
    let mut worst = [0.0_f32; 4];
    for (pose, listener) in golden.listeners.iter().enumerate() {
        let (masks, attention) = decode(&golden.model, Arch::new(), listener);
        let exact = crate::oracle::decode(&golden.model, listener);
        worst[0] = worst[0].max(golden.worst("mag_mask", pose * sizes.bands, &masks.mixture));
        worst[1] = worst[1].max(golden.worst("diff", pose * sizes.bands, &masks.difference));
        // Only the first pose's embedding is among the vectors.
        if pose == 0 {
            let exact: Vec<f32> = exact.embedding.iter().map(|v| *v as f32).collect();
            let embedding = if masks.embedding.is_empty() { &exact } else { &masks.embedding };
            worst[2] = worst[2].max(golden.worst("hs", 0, embedding));
        }
        // The vectors have weights per band, of which the slice has too few to add up: the plain decoder stands between.
        let weights: Vec<f32> = exact.weights.iter().map(|v| *v as f32).collect();
        let from = pose * sizes.bands * sizes.anchors;
        worst[3] = worst[3].max(golden.worst("attn_weights", from, &weights));
        worst[3] = worst[3].max(furthest(&attention, &exact.attention));
    }
    println!("{} {set}: off by {worst:?} in mixture, difference, embedding, attention", kind.name());
    for (worst, bar) in worst.into_iter().zip(BARS) {
        assert!(worst <= bar, "{} {set}: {worst} above {bar}", kind.name());
    }
}

#[test]
fn any_size_agrees_with_the_plain_decoder() {
    let usual = Case { anchors: 40, bands: 33, width: 64, heads: 4, layers: 3, kind: CloudKind::Full, physical: false };
    let cases = [
        Case { anchors: 1, ..usual },
        Case { anchors: 33, bands: 257, width: 128, ..usual },
        Case { anchors: 5_000, bands: 20, ..usual },
        Case { bands: 64, heads: 8, ..usual },
        Case { bands: 2, layers: 1, ..usual },
        Case { bands: 100, width: 48, heads: 2, layers: 5, kind: CloudKind::Sh, physical: true, ..usual },
        // More bands than keys are held at a time.
        Case { bands: 700, width: 16, heads: 1, layers: 2, ..usual },
        Case { kind: CloudKind::SimpleSh, ..usual },
        Case { anchors: 1, bands: 2, kind: CloudKind::SimpleSh, ..usual },
        Case { anchors: 5_000, bands: 100, width: 128, kind: CloudKind::SimpleSh, physical: true, ..usual },
    ];
    for case in cases {
        let model = case.model();
        let exact = crate::oracle::decode(&model, &listener());
        for (name, arch) in instruction_sets() {
            let (masks, attention) = decode(&model, arch, &listener());
            let off = differences(&masks, &attention, &exact);
            println!("{name} {case:?}: off by {off:?}");
            for (off, bar) in off.into_iter().zip(BARS) {
                assert!(off <= bar, "{name} {case:?}: {off}");
            }
        }
    }
}

#[test]
fn instruction_sets_agree() {
    for kind in CloudKind::PUBLISHED {
        let golden = golden::slice(kind);
        for listener in &golden.listeners {
            let (scalar, attention) = decode(&golden.model, Arch::Scalar, listener);
            for (name, arch) in instruction_sets() {
                let (masks, weights) = decode(&golden.model, arch, listener);
                let pairs = [
                    (&masks.mixture, &scalar.mixture, 1e-5),
                    (&masks.difference, &scalar.difference, 1e-5),
                    // Features go up to 4.
                    (&masks.embedding, &scalar.embedding, 3e-5),
                    (&weights, &attention, 1e-5),
                ];
                for (one, other, bar) in pairs {
                    let off = one.iter().zip(other).fold(0.0_f32, |off, (a, b)| off.max((a - b).abs()));
                    assert!(off <= bar, "{} on {name}: {off}", kind.name());
                }
            }
        }
    }
}

#[test]
fn the_same_listener_gives_the_same_bits() {
    for kind in CloudKind::PUBLISHED {
        let golden = golden::slice(kind);
        let mut decoder = Network::new(&golden.model);
        let (first, attention) = decode(&golden.model, Arch::new(), &golden.listeners[0]);
        let mut masks = Masks::new(&golden.model.sizes());
        decoder.decode(&golden.listeners[2], &mut masks);
        assert_ne!(masks, first, "another listener");
        decoder.decode(&golden.listeners[0], &mut masks);
        assert_eq!(masks, first);
        let mut again = vec![0.0; attention.len()];
        decoder.decode_with_attention(&golden.listeners[0], &mut masks, &mut again);
        assert!(masks == first && again == attention);
    }
}

#[test]
fn a_listener_anywhere_gets_numbers() {
    for kind in CloudKind::PUBLISHED {
        let golden = golden::slice(kind);
        let on_an_anchor = golden.model.parts().anchors[5];
        for centre in [on_an_anchor, Vec3::splat(1e6), Vec3::splat(-1e30), Vec3::new(f32::INFINITY, f32::NAN, 0.0)] {
            let listener = Listener { centre, camera_to_world: Mat3::IDENTITY };
            let (masks, attention) = decode(&golden.model, Arch::new(), &listener);
            for v in [&masks.mixture, &masks.difference, &masks.embedding, &attention].into_iter().flatten() {
                assert!(v.is_finite(), "{} at {centre}", kind.name());
            }
        }
    }
}

#[test]
fn decoding_never_allocates() {
    for kind in CloudKind::PUBLISHED {
        let golden = golden::slice(kind);
        let mut decoder = Network::new(&golden.model);
        let mut masks = Masks::new(&golden.model.sizes());
        let mut attention = vec![0.0; golden.model.sizes().anchors];
        assert_no_alloc(|| {
            decoder.decode(&golden.listeners[0], &mut masks);
            decoder.decode_with_attention(&golden.listeners[1], &mut masks, &mut attention);
        });
        assert!((attention.iter().sum::<f32>() - 1.0).abs() < 1e-5);
    }
}

fn decode(model: &CloudModel, arch: Arch, listener: &Listener) -> (Masks, Vec<f32>) {
    let sizes = model.sizes();
    let mut masks = Masks::new(&sizes);
    let mut attention = vec![f32::NAN; sizes.anchors];
    let mut decoder = Network::with_arch(model, arch);
    decoder.decode(listener, &mut masks);
    let plain = masks.clone();
    decoder.decode_with_attention(listener, &mut masks, &mut attention);
    assert_eq!(masks, plain, "whether attention is asked for or not");
    (masks, attention)
}

fn differences(masks: &Masks, attention: &[f32], exact: &Exact) -> [f32; 4] {
    let embedding = if masks.embedding.is_empty() { 0.0 } else { furthest(&masks.embedding, &exact.embedding) };
    let (mixture, difference) = (furthest(&masks.mixture, &exact.mixture), furthest(&masks.difference, &exact.difference));
    [mixture, difference, embedding, furthest(attention, &exact.attention)]
}

fn furthest(found: &[f32], exact: &[f64]) -> f32 {
    assert_eq!(found.len(), exact.len());
    found.iter().zip(exact).fold(0.0, |worst, (f, e)| worst.max((f64::from(*f) - e).abs() as f32))
}

fn listener() -> Listener {
    let turn = Mat3::from_axis_angle(Vec3::new(2.0, -1.0, 2.0) / 3.0, 0.8);
    Listener { centre: Vec3::new(1.3, -0.4, 2.2), camera_to_world: turn }
}

/// Instructions that this machine has; says which are not tested.
#[cfg(target_arch = "x86_64")]
fn instruction_sets() -> Vec<(&'static str, Arch)> {
    let v3 = pulp::x86::V3::try_new().map(Arch::V3);
    let v4 = pulp::x86::V4::try_new().map(Arch::V4);
    let mut sets = vec![("Scalar", Arch::Scalar)];
    for (name, arch) in [("V3", v3), ("V4", v4)] {
        match arch {
            Some(arch) => sets.push((name, arch)),
            None => println!("this machine has no {name}: not tested"),
        }
    }
    sets
}

#[cfg(not(target_arch = "x86_64"))]
fn instruction_sets() -> Vec<(&'static str, Arch)> {
    vec![("Scalar", Arch::Scalar), ("widest", Arch::new())]
}

mod needs_shared {
    use super::*;
    use promenade_testing::shared;

    #[test]
    #[ignore = "needs ../shared"]
    fn weights_follow_from_their_names() {
        let bytes = std::fs::read(shared("golden/weights_union.safetensors")).unwrap();
        let file = safetensors::SafeTensors::deserialize(&bytes).unwrap();
        for kind in CloudKind::PUBLISHED {
            for (name, tensor) in golden::weights(kind) {
                let stored = file.tensor(&name).unwrap();
                let found: Vec<f32> = stored.data().as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
                assert!(stored.shape() == tensor.shape && found == tensor.values, "{name}");
            }
        }
    }

    #[test]
    #[ignore = "needs ../shared"]
    fn golden_masks_embeddings_and_attention_of_the_whole_set_come_out() {
        for kind in CloudKind::PUBLISHED {
            check_golden(kind, "whole", &golden::whole(kind));
        }
    }
}
