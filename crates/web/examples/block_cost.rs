//! Processor time of a block of 128 samples at 48 kHz in the engine of pages, compiled for this machine: what
//! `tests/browser/figures.mjs` compares with the same in WebAssembly.
//!
//! `block_cost SCENE BLOCKS [ROWS]`: milliseconds a block; ROWS is a path as a site has it, JSON.

use cpu_time::ThreadTime;
use promenade_web::{Engine, LoadOptions};
use std::process::ExitCode;

const RATE_HZ: f64 = 48_000.0;
const BLOCK: usize = 128;
/// Blocks before it is measured.
const BEFORE: usize = 2_000;

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match cost(&args) {
        Ok(ms) => {
            println!("{ms:.5}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn cost(args: &[String]) -> Result<f64, String> {
    let [scene, blocks, rows @ ..] = args else { return Err("expected SCENE BLOCKS [ROWS]".to_owned()) };
    let read = |file: &str| std::fs::read(file).map_err(|e| format!("{file}: {e}"));
    let mut engine = Engine::new(RATE_HZ);
    engine.load(&read(scene)?, LoadOptions { inline: true, ..LoadOptions::default() })?;
    if let Some(file) = rows.first() {
        let rows: Vec<[f64; 8]> = serde_json::from_slice(&read(file)?).map_err(|e| format!("{file}: {e}"))?;
        engine.set_path(rows.as_flattened())?;
        engine.walk(0.0, 1.0, true, false);
    }
    let blocks: usize = blocks.parse().map_err(|_| format!("expected a number of blocks, found {blocks}"))?;
    let mut state = 1_u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        0.25 * ((f64::from(state) / f64::from(1_u32 << 31)) - 1.0) as f32
    };
    let input: Vec<f32> = std::iter::repeat_with(&mut noise).take(BLOCK * blocks.max(1)).collect();
    let mut play = |count: usize| {
        for block in input.chunks_exact(BLOCK).cycle().take(count) {
            engine.input(0)[..BLOCK].copy_from_slice(block);
            engine.process(1, 0, BLOCK);
        }
    };
    play(BEFORE);
    let began = ThreadTime::now();
    play(blocks);
    Ok(began.elapsed().as_secs_f64() * 1e3 / blocks as f64)
}
