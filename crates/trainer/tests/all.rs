//! The benchmark's baselines, rooms and shares, in one program.

#[path = "../benches/rwavs_gen/baselines/mod.rs"]
mod baselines;
#[path = "../benches/rwavs_gen/house.rs"]
mod house;
#[path = "../benches/rwavs_gen/runs.rs"]
mod runs;

mod rwavs_gen;
