use super::*;
use crate::simd::tests::arches;
use promenade_testing::noise_at;

/// A channel by time and bin.
type Image = Vec<Vec<f32>>;

/// Weights that look random and let what they are given through.
pub(crate) fn random_weights() -> ConvWeights {
    let layer = |[outputs, inputs, size]: [usize; 3], scale: f32, seed: u64| ConvLayerWeights {
        weight: (0..outputs * inputs * size * size).map(|i| scale * noise_at(seed, i)).collect(),
        bias: (0..outputs).map(|i| 0.2 * noise_at(seed + 1, i)).collect(),
    };
    ConvWeights { layers: [layer([16, 4, 7], 0.07, 1), layer([16, 16, 3], 0.1, 3), layer([1, 16, 3], 0.1, 5)] }
}

fn naive(x: &[Image], ConvLayerWeights { weight, bias }: &ConvLayerWeights, size: usize, relu: bool) -> Vec<Image> {
    let (frames, bins) = (x[0].len(), x[0][0].len());
    let half = size / 2;
    let at = |c: usize, t: usize, f: usize| {
        let inside = (half..frames + half).contains(&t) && (half..bins + half).contains(&f);
        if inside { x[c][t - half][f - half] } else { 0.0 }
    };
    let sum = |o: usize, t: usize, f: usize| {
        let mut sum = f64::from(bias[o]);
        for c in 0..x.len() {
            for kf in 0..size {
                for kt in 0..size {
                    let w = weight[((o * x.len() + c) * size + kf) * size + kt];
                    sum += f64::from(w) * f64::from(at(c, t + kt, f + kf));
                }
            }
        }
        if relu { sum.max(0.0) as f32 } else { sum as f32 }
    };
    (0..bias.len()).map(|o| (0..frames).map(|t| (0..bins).map(|f| sum(o, t, f)).collect()).collect()).collect()
}

#[test]
fn frame_by_frame_equals_the_three_layers_over_a_whole_clip() {
    let weights = random_weights();
    for (bins, frames) in [(53, 13), (8, 1), (33, 4), (257, 2)] {
        let plane =
            |seed| -> Image { (0..frames).map(|t| (0..bins).map(|f| noise_at(seed, t * bins + f)).collect()).collect() };
        let planes = [plane(11), plane(12), plane(13), plane(14)];
        let [mix, masked, mixture, difference] = &planes;
        let wanted = [-1.0, 1.0].map(|sign| {
            let map = |f: &dyn Fn(usize, usize) -> f32| -> Image {
                (0..frames).map(|t| (0..bins).map(|b| f(t, b)).collect()).collect()
            };
            let base = map(&|t, f| (1.0 + sign * difference[t][f]) * masked[t][f]);
            let signed = map(&|t, f| sign * difference[t][f]);
            let x = [mix.clone(), base, mixture.clone(), signed];
            let hidden = naive(&x, &weights.layers[0], 7, true);
            let hidden = naive(&hidden, &weights.layers[1], 3, true);
            naive(&hidden, &weights.layers[2], 3, false).remove(0)
        });
        for arch in arches() {
            let mut layers = ConvLayers::from_weights(&weights, bins, arch);
            // A second clip after the first finds nothing of it.
            for clip in 0..2 {
                for p in 0..frames + CONV_DELAY {
                    let at = |i: usize| &planes[i][p][..];
                    let inside = layers.push((p < frames).then(|| Planes {
                        mix: at(0),
                        masked: at(1),
                        mixture: at(2),
                        difference: at(3),
                    }));
                    assert_eq!(inside, p >= CONV_DELAY);
                    for ear in (0..2).filter(|_| inside) {
                        for (a, b) in layers.ear(ear).iter().zip(&wanted[ear][p - CONV_DELAY]) {
                            assert!((a - b).abs() < 1e-5, "{arch:?}, clip {clip}, frame {p}: {a} for {b}");
                        }
                    }
                }
                layers.reset();
            }
        }
    }
}
