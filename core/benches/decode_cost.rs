//! Cost of the anchor-cloud decoders, beside the matrix products of the same decode in libraries, in one run.
//!
//! `cargo bench --bench decode_cost -p promenade-core`. Unit: processor milliseconds of the one thread per decode, median over
//! rounds; a round takes every case once. `-- --json` prints one JSON object per case instead; `-- --serve NAME` decodes that
//! case once per line of its input and answers with seconds, for a caller that takes turns with another program. Random
//! weights.
#![allow(missing_docs, clippy::print_stdout, reason = "a program that prints a table")]

#[path = "../tests/oracle.rs"]
mod oracle;

use cpu_time::ThreadTime;
use oracle::Case;
use promenade_core::glam::{Mat3, Vec3};
use promenade_core::network::{CloudKind, Listener, Masks, Network};
use promenade_testing::Noise;
use pulp::Arch;
use std::hint::black_box;
use std::io::{BufRead, Write};

const ROUNDS: usize = 41;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let mut contestants = contestants();
    if let Some(at) = arguments.iter().position(|a| a == "--serve") {
        let name = arguments.get(at + 1).map_or("", String::as_str);
        let Some((_, run)) = contestants.iter_mut().find(|(n, _)| n == name) else { panic!("no case '{name}'") };
        run();
        for line in std::io::stdin().lock().lines() {
            line.unwrap();
            println!("{}", seconds(run));
            std::io::stdout().flush().unwrap();
        }
        return;
    }
    let mut times = vec![Vec::with_capacity(ROUNDS); contestants.len()];
    for _ in 0..ROUNDS {
        for ((_, run), times) in contestants.iter_mut().zip(&mut times) {
            // Once to fill the caches.
            run();
            times.push(1e3 * seconds(run));
        }
    }
    let json = arguments.iter().any(|a| a == "--json");
    if !json {
        println!("| case | ms median | ms least |\n|---|---|---|");
    }
    for ((name, _), times) in contestants.iter().zip(&mut times) {
        times.sort_by(f64::total_cmp);
        let (median, least) = (times[ROUNDS / 2], times[0]);
        if json {
            println!("{{\"case\": \"{name}\", \"median_ms\": {median:.4}, \"least_ms\": {least:.4}}}");
        } else {
            println!("| {name} | {median:.3} | {least:.3} |");
        }
    }
}

fn seconds(run: &mut Run) -> f64 {
    let start = ThreadTime::now();
    run();
    start.elapsed().as_secs_f64()
}

type Run = Box<dyn FnMut()>;

fn contestants() -> Vec<(String, Run)> {
    let full = Case { anchors: 256, bands: 257, width: 128, heads: 4, layers: 3, kind: CloudKind::Full, physical: false };
    let mut all = vec![
        ("full".to_owned(), decoder(&full, Arch::new())),
        ("full, F 64".to_owned(), decoder(&Case { bands: 64, ..full }, Arch::new())),
        ("full, F 64, N 128".to_owned(), decoder(&Case { bands: 64, anchors: 128, ..full }, Arch::new())),
        ("linear".to_owned(), decoder(&Case { kind: CloudKind::SimpleSh, ..full }, Arch::new())),
    ];
    #[cfg(target_arch = "x86_64")]
    if let Some(v3) = pulp::x86::V3::try_new() {
        all.push(("full, V3".to_owned(), decoder(&full, Arch::V3(v3))));
        all.push(("full, F 64, V3".to_owned(), decoder(&Case { bands: 64, ..full }, Arch::V3(v3))));
        all.push(("linear, V3".to_owned(), decoder(&Case { kind: CloudKind::SimpleSh, ..full }, Arch::V3(v3))));
    }
    all.push(("full, products only, gemm".to_owned(), products(&full, gemm)));
    all.push(("full, products only, matrixmultiply".to_owned(), products(&full, matrixmultiply)));
    all
}

fn decoder(case: &Case, arch: Arch) -> Run {
    let model = case.model();
    let mut decoder = Network::with_arch(&model, arch);
    let mut masks = Masks::new(&model.sizes());
    let mut step = 0.0;
    Box::new(move || {
        step += 0.01;
        let listener = Listener { centre: Vec3::new(1.0, step, 0.5), camera_to_world: Mat3::from_rotation_z(step) };
        decoder.decode(black_box(&listener), &mut masks);
        black_box(&masks);
    })
}

/// `c = a b`, all row by row; b given `[n][k]` if transposed.
struct Problem {
    m: usize,
    k: usize,
    n: usize,
    transposed: bool,
    a: Vec<f32>,
    b: Vec<f32>,
    c: Vec<f32>,
}

/// Matrix products of one folded decode: nothing of the rest, neither softmax nor normalisation.
fn products(case: &Case, multiply: fn(&mut Problem)) -> Run {
    let (f, n, c, d) = (case.bands, case.anchors, case.width, case.width / case.heads);
    let mut sizes = vec![(n, 3 * 21, c, true)];
    for layer in 0..case.layers {
        // Keys and values; a product for each head; output and feed-forward.
        sizes.push((n, c, 2 * c, true));
        let mut attend = |keys: usize| {
            for _ in 0..case.heads {
                sizes.push((f, d, keys, true));
                sizes.push((f, keys, d, false));
            }
            sizes.push((f, c, c, true));
        };
        attend(n);
        if layer > 0 {
            attend(f);
            sizes.push((f, c, 3 * c, true));
            sizes.push((f, c, c, true));
        }
        sizes.push((f, c, 4 * c, true));
        sizes.push((f, 4 * c, c, true));
    }
    let mut noise = Noise::new(3);
    let mut numbers = |count: usize| -> Vec<f32> { noise.by_ref().take(count).collect() };
    let mut problems: Vec<Problem> = sizes
        .into_iter()
        .map(|(m, k, n, transposed)| Problem { m, k, n, transposed, a: numbers(m * k), b: numbers(k * n), c: vec![0.0; m * n] })
        .collect();
    Box::new(move || {
        for problem in &mut problems {
            multiply(problem);
            black_box(&problem.c);
        }
    })
}

fn strides(p: &Problem) -> [isize; 2] {
    (if p.transposed { [1, p.k] } else { [p.n, 1] }).map(|s| s as isize)
}

#[allow(unsafe_code, reason = "the library takes pointers")]
fn gemm(p: &mut Problem) {
    let [row, col] = strides(p);
    let (k, n) = (p.k as isize, p.n as isize);
    // SAFETY: the three buffers hold `m k`, `k n` and `m n` numbers, which is what sizes and strides say.
    unsafe {
        gemm::gemm(
            p.m,
            p.n,
            p.k,
            p.c.as_mut_ptr(),
            1,
            n,
            false,
            p.a.as_ptr(),
            1,
            k,
            p.b.as_ptr(),
            col,
            row,
            0.0,
            1.0,
            false,
            false,
            false,
            gemm::Parallelism::None,
        );
    }
}

#[allow(unsafe_code, reason = "the library takes pointers")]
fn matrixmultiply(p: &mut Problem) {
    let [row, col] = strides(p);
    let (k, n) = (p.k as isize, p.n as isize);
    // SAFETY: as above.
    unsafe {
        matrixmultiply::sgemm(p.m, p.k, p.n, 1.0, p.a.as_ptr(), k, 1, p.b.as_ptr(), row, col, 0.0, p.c.as_mut_ptr(), n, 1);
    }
}
