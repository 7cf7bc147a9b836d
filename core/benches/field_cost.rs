//! Cost of one pose from a field over positions and head orientations, low rank, of the size that a 16 MB table has.
//!
//! `cargo bench --bench field_cost -p promenade-core`. Processor time of the thread, median of runs; random coefficients.

use cpu_time::ThreadTime;
use promenade_core::glam::Vec3;
use promenade_core::{Axis, Basis, Facing, Field, FieldGrid, LowRank, Pose, Rows, TransferShape};
use promenade_testing::Rng;
use std::f32::consts::PI;
use std::hint::black_box;

const RUNS: usize = 31;
const POSES: usize = 500;

fn main() {
    let shape = TransferShape { bins: 257, bands: 20, taps: 32 };
    let (levels, taps) = (23, 11);
    let position = [(4, 3.0), (9, 3.2), (4, 0.7)].map(|(n, span): (usize, f32)| Axis::uniform(0.0, span / (n - 1) as f32, n));
    let facing = Facing::Head {
        yaw: Axis::circle(-PI, 16),
        pitch: Axis::uniform(-1.0, 1.0 / 3.0, 7),
        roll: Axis::uniform(-0.6, 0.2, 7),
    };
    let grid = FieldGrid { position, facing };
    let mut rng = Rng::with_seed(1);
    let mut basis = |len: usize, rank: usize, mean: f32| Basis {
        mean: vec![mean; len],
        shapes: (0..rank * len).map(|_| 0.1 * rng.f32()).collect(),
    };
    let rows = LowRank {
        levels: basis(2 * shape.bins, levels, -10.0),
        taps: basis(shape.tap_len() * (shape.taps + 1), taps, 0.1),
        coefficients: (0..grid.nodes() * (levels + taps)).map(|i| (i % 17) as f32 / 17.0).collect(),
    };
    let (nodes, table) = (grid.nodes(), 4 * grid.nodes() * (levels + taps));
    let Some(field) = Field::new(grid, shape, Rows::LowRank(rows)) else { return };
    let poses: Vec<Pose> = (0..POSES)
        .map(|i| {
            let t = i as f32 / POSES as f32;
            Pose::from_ypr(
                Vec3::new(3.0 * t, 1.6 + 1.5 * (9.0 * t).sin(), 0.35),
                7.0 * t,
                0.9 * (20.0 * t).sin(),
                0.5 * (13.0 * t).cos(),
            )
        })
        .collect();
    let mut whole = Vec::new();
    for _ in 0..RUNS {
        let began = ThreadTime::now();
        for pose in &poses {
            black_box(field.decode(pose));
        }
        whole.push(1e6 * began.elapsed().as_secs_f64() / POSES as f64);
    }
    whole.sort_by(f64::total_cmp);
    println!(
        "{nodes} nodes, {:.1} MB, {levels} + {taps} shapes: {:.1} us a pose, masks and all taps",
        table as f64 / 1e6,
        whole[RUNS / 2]
    );
}
