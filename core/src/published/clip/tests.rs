use super::*;
use crate::published::conv::ConvWeights;
use crate::published::conv::tests::random_weights;
use crate::simd::tests::arches;
use promenade_testing::noise_at;

/// All that is learnt: mixture, difference, mix, then weights and biases of the three layers.
type Inputs = Vec<Vec<f64>>;

/// What a clip is rendered with.
#[derive(Clone)]
struct Learnt {
    mixture: Vec<f32>,
    difference: Vec<f32>,
    mix: Vec<f32>,
    conv: ConvWeights,
}

fn random(count: usize, seed: u64, scale: f32) -> Vec<f32> {
    (0..count).map(|i| scale * noise_at(seed, i)).collect()
}

/// A head, a clip whose first frames are silent, and what it is rendered with.
fn clip(grid: StftGrid, frames: usize, arch: Arch) -> (PublishedClip, ClipSource, Learnt) {
    let mut head = PublishedClip::new(grid, frames, arch).unwrap();
    // A sound for which no rectified value lies so near to 0 that single precision decides on its sign.
    let mut mono = random(*head.clip_samples().end(), 61, 0.3);
    mono[..grid.n_fft / 2 + 2].fill(0.0);
    let mut source = head.source();
    head.analyse(&mono, &mut source).unwrap();
    let at = Learnt {
        mixture: random(grid.bins(), 22, 1.0),
        difference: random(grid.bins(), 23, 0.9),
        mix: random(frames * grid.bins(), 24, 1.0),
        conv: random_weights(),
    };
    (head, source, at)
}

fn rendered(head: &mut PublishedClip, source: &ClipSource, at: &Learnt, (conv, arch): (bool, Arch)) -> [Vec<f32>; 2] {
    let mut out = [vec![0.0; head.out_samples()], vec![0.0; head.out_samples()]];
    let [left, right] = &mut out;
    let (frames, bins) = (head.frames(), at.mixture.len());
    let [mut masked, mut mix] = [Frames::new(frames, bins), Frames::new(frames, bins)];
    for frame in 0..frames {
        let product = source.frame(frame).iter().zip(&at.mixture).map(|(x, m)| x * m);
        masked.row_mut(frame).iter_mut().zip(product).for_each(|(to, x)| *to = x);
        mix.row_mut(frame).copy_from_slice(&at.mix[frame * bins..][..bins]);
    }
    let mut layers = ConvLayers::from_weights(&at.conv, bins, arch);
    let masks = (&at.mixture[..], &at.difference[..]);
    head.render(source, [&masked, &mix], masks, conv.then_some(&mut layers), [left, right]).unwrap();
    out
}

fn inputs(from: &Learnt) -> Inputs {
    let layers = from.conv.layers.iter().flat_map(|l| [&l.weight[..], &l.bias]);
    let all = [&from.mixture[..], &from.difference, &from.mix].into_iter().chain(layers);
    all.map(|v| v.iter().map(|x| f64::from(*x)).collect()).collect()
}

fn layer(x: &[Vec<f64>], weight: &[f64], bias: &[f64], (size, frames, bins): (usize, usize, usize)) -> Vec<Vec<f64>> {
    let mut out: Vec<Vec<f64>> = bias.iter().map(|b| vec![*b; frames * bins]).collect();
    for (i, w) in weight.iter().enumerate() {
        let (kt, kf) = (i % size, i / size % size);
        let (c, o) = (i / (size * size) % x.len(), i / (size * size * x.len()));
        for t in 0..frames {
            let Some(s) = (t + kt).checked_sub(size / 2).filter(|s| *s < frames) else { continue };
            for f in 0..bins {
                let Some(g) = (f + kf).checked_sub(size / 2).filter(|g| *g < bins) else { continue };
                out[o][t * bins + f] += w * x[c][s * bins + g];
            }
        }
    }
    out
}

fn relu(x: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    x.into_iter().map(|v| v.into_iter().map(|x| x.max(0.0)).collect()).collect()
}

/// The head by its definition, in double precision.
fn naive(grid: StftGrid, frames: usize, source: &ClipSource, of: &Inputs, conv: bool) -> [Vec<f64>; 2] {
    let (bins, n, hop) = (grid.bins(), grid.n_fft, grid.hop);
    let sizes = |size| (size, frames, bins);
    [-1.0, 1.0].map(|sign| {
        let each = |f: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..frames * bins).map(f).collect() };
        let base = each(&|i| (1.0 + sign * of[1][i % bins]) * of[0][i % bins] * f64::from(source.magnitudes[i]));
        let mut added = of[2].clone();
        if conv {
            let x = [added, base.clone(), each(&|i| of[0][i % bins]), each(&|i| sign * of[1][i % bins])];
            let hidden = relu(layer(&x, &of[3], &of[4], sizes(7)));
            let hidden = relu(layer(&hidden, &of[5], &of[6], sizes(3)));
            added = layer(&hidden, &of[7], &of[8], sizes(3)).remove(0);
        }
        let window = |j: usize| 0.5 - 0.5 * (std::f64::consts::TAU * j as f64 / n as f64).cos();
        let (mut sums, mut squares) = (vec![0.0; frames * hop + n], vec![0.0; frames * hop + n]);
        for t in 0..frames {
            for j in 0..n {
                let mut y = 0.0;
                for k in 0..bins {
                    let x = source.spectra[t * bins + k];
                    let phase = if x.norm_sqr() == 0.0 { 0.0 } else { f64::from(x.im).atan2(f64::from(x.re)) };
                    let turned = phase + std::f64::consts::TAU * (k * j % n) as f64 / n as f64;
                    let both = if k == 0 || k == n / 2 { 1.0 } else { 2.0 };
                    y += both * (added[t * bins + k] + base[t * bins + k]).max(0.0) * turned.cos() / n as f64;
                }
                sums[t * hop + j] += window(j) * y;
                squares[t * hop + j] += window(j) * window(j);
            }
        }
        (n / 2..n / 2 + (frames - 1) * hop).map(|i| sums[i] / squares[i]).collect()
    })
}

fn grid(n_fft: usize, hop: usize) -> StftGrid {
    StftGrid { sample_rate_hz: 8000.0, n_fft, hop }
}

/// Few and many frames, hops that do not divide a frame, every width of the last tile.
const CLIPS: [(usize, usize, usize); 6] = [(64, 15, 9), (32, 7, 23), (16, 8, 3), (30, 11, 8), (150, 71, 4), (160, 77, 4)];

#[test]
fn renders_by_the_definition() {
    for (n_fft, hop, frames) in CLIPS {
        for arch in arches() {
            let (mut head, source, at) = clip(grid(n_fft, hop), frames, arch);
            for conv in [true, false] {
                let want = naive(grid(n_fft, hop), frames, &source, &inputs(&at), conv);
                for (a, b) in rendered(&mut head, &source, &at, (conv, arch)).concat().iter().zip(want.concat()) {
                    assert!((f64::from(*a) - b).abs() < 1e-5, "{arch:?} {n_fft}, conv {conv}: {a} for {b}");
                }
            }
        }
    }
}

#[test]
fn a_clip_that_does_not_fit_is_refused() {
    let (mut head, mut source, _) = clip(grid(64, 15), 9, Arch::Scalar);
    assert_eq!(head.out_samples(), 120);
    assert!(matches!(
        PublishedClip::new(grid(64, 15), 3, Arch::Scalar),
        Err(PublishedError::Short { samples: 30, expected: 32, .. })
    ));
    assert!(matches!(PublishedClip::new(grid(64, 15), 0, Arch::Scalar), Err(PublishedError::Short { .. })));
    for (mono, fits) in [(119, false), (120, true), (134, true), (135, false)] {
        assert_eq!(head.analyse(&vec![0.1; mono], &mut source).is_ok(), fits, "{mono}");
    }
}
