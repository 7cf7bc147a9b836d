use super::*;
use crate::published::clip::tests::{CLIPS, Inputs, clip, grid, inputs, naive, random, rendered};
use crate::simd::tests::arches;

const NAMES: [&str; 9] = ["mixture", "difference", "mix", "out.0", "out.0 bias", "out.2", "out.2 bias", "out.4", "out.4 bias"];

#[test]
fn the_adjoint_is_the_derivative() {
    for (n_fft, hop, frames) in CLIPS {
        let grid = grid(n_fft, hop);
        let (head, source, at) = clip(grid, frames, Arch::Scalar);
        let by_samples = [31, 32].map(|seed| random(head.out_samples(), seed, 1.0));
        let weighed = |of: &Inputs, conv| -> f64 {
            let out = naive(grid, frames, &source, of, conv).concat();
            out.iter().zip(by_samples.concat()).map(|(o, w)| o * f64::from(w)).sum()
        };
        for conv in [true, false] {
            let at_f64 = inputs(at.input(true));
            // Along two random directions in each tensor.
            let mut slopes = Vec::new();
            for (tensor, seed) in (0..if conv { 9 } else { 3 }).flat_map(|t| [(t, 41), (t, 42)]) {
                let direction = random(at_f64[tensor].len(), seed, 1.0);
                // Steps so small that no rectifier changes sides between them.
                let ends = [1e-8, -1e-8].map(|step| {
                    let mut moved = at_f64.clone();
                    moved[tensor].iter_mut().zip(&direction).for_each(|(x, d)| *x += step * f64::from(*d));
                    weighed(&moved, conv)
                });
                slopes.push((tensor, direction, (ends[0] - ends[1]) / 2e-8));
            }
            for arch in arches() {
                let mut head = PublishedClip::with_arch(grid, frames, arch).unwrap();
                let mut adjoint = PublishedAdjoint::with_arch(&head, arch);
                let mut by = adjoint.gradient();
                // Nothing of an earlier clip is left, and derivatives add up.
                for clips in 1..3 {
                    adjoint.add(&mut head, &source, at.input(conv), by_samples.each_ref().map(|b| &b[..]), &mut by).unwrap();
                    let found = inputs(by.as_input());
                    for (tensor, direction, slope) in &slopes {
                        let (by, slope) = (&found[*tensor], f64::from(clips) * slope);
                        let along: f64 = by.iter().zip(direction).map(|(b, d)| b * f64::from(*d)).sum();
                        let size = by.iter().map(|b| b * b).sum::<f64>().sqrt();
                        let what = NAMES[*tensor];
                        assert!(size > 0.0, "{what}");
                        assert!(
                            (along - slope).abs() < 1e-4 * size,
                            "{arch:?} {n_fft} {what}, conv {conv}: {along} for {slope}"
                        );
                    }
                    assert!(conv || found[3..].iter().flatten().all(|b| *b == 0.0));
                }
            }
        }
    }
}

#[test]
fn without_layers_the_adjoint_is_the_transpose() {
    // So loud a time filter that nothing is rectified: the output is its affine function.
    for arch in arches() {
        let (mut head, source, mut at) = clip(grid(64, 15), 9, arch);
        let direction = random(at.mix.len(), 51, 1.0);
        at.mix.fill(1e3);
        let resting = rendered(&mut head, &source, at.input(false)).concat();
        at.mix.iter_mut().zip(&direction).for_each(|(x, d)| *x += 100.0 * d);
        let moved = rendered(&mut head, &source, at.input(false)).concat();
        let by_samples = [52, 53].map(|seed| random(head.out_samples(), seed, 1.0));
        let mut adjoint = PublishedAdjoint::with_arch(&head, arch);
        let mut by = adjoint.gradient();
        adjoint.add(&mut head, &source, at.input(false), by_samples.each_ref().map(|b| &b[..]), &mut by).unwrap();
        let difference = moved.iter().zip(&resting).map(|(a, b)| f64::from(a - b) / 100.0);
        let ahead: f64 = difference.zip(by_samples.concat()).map(|(o, w)| o * f64::from(w)).sum();
        let back: f64 = by.mix.iter().zip(&direction).map(|(b, d)| f64::from(b * d)).sum();
        assert!((ahead - back).abs() < 1e-4 * ahead.abs(), "{arch:?}: {ahead} and {back}");
    }
}

#[test]
fn an_adjoint_that_does_not_fit_is_refused() {
    let (mut head, source, at) = clip(grid(64, 15), 9, Arch::Scalar);
    let mut adjoint = PublishedAdjoint::new(&head);
    let (mut by, sound) = (adjoint.gradient(), vec![0.1; head.out_samples()]);
    let other = PublishedClip::new(grid(64, 15), 10).unwrap();
    let mut other_adjoint = PublishedAdjoint::new(&other);
    let mut refused = |adjoint: &mut PublishedAdjoint, source: &ClipSource, by: &mut PublishedGradient, right: usize| {
        adjoint.add(&mut head, source, at.input(true), [&sound, &sound[..right]], by).map_err(|e| e.to_string())
    };
    assert_eq!(refused(&mut adjoint, &source, &mut by, sound.len()), Ok(()));
    assert!(refused(&mut adjoint, &source, &mut by, sound.len() - 1).unwrap_err().contains("right output"));
    assert!(refused(&mut adjoint, &other.source(), &mut by, sound.len()).unwrap_err().contains("source"));
    assert!(refused(&mut other_adjoint, &source, &mut by, sound.len()).unwrap_err().contains("frames of the adjoint"));
    let mut other = other_adjoint.gradient();
    assert!(refused(&mut adjoint, &source, &mut other, sound.len()).unwrap_err().contains("time filter"));
}

#[test]
fn head_and_adjoint_can_move_to_another_thread() {
    fn moves<T: Send>(_: &T) {}
    let (head, source, _) = clip(grid(64, 15), 9, Arch::Scalar);
    let adjoint = PublishedAdjoint::new(&head);
    moves(&head);
    moves(&source);
    moves(&adjoint);
    let mut by = adjoint.gradient();
    by.mixture.fill(1.0);
    by.clear();
    assert_eq!(by, adjoint.gradient());
}
