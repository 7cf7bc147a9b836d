//! What a block costs at most, in instructions and, among many instances, in misses of the cache: the same on a busy machine as
//! on a quiet one.
//!
//! Counted by callgrind (valgrind), which gives the same numbers each time. Without it, or on a processor without AVX2, nothing
//! is counted, and the test says so.

use promenade_core::glam::Vec3;
use promenade_core::{BlockParams, Carriers, Renderer, RendererConfig, Spatializer, Voice};
use promenade_testing::noise;
use promenade_testing::scenes::{room, room_with_images, walk};
use std::process::Command;
use std::sync::Arc;
use std::{env, fs};

const RATE: f64 = 48_000.0;
/// As many blocks of 512 samples are played, by all instances together; the first do not count, since a scene begins in them.
const BLOCKS: usize = 60;
const WARM_UP: usize = 20;
/// What is played, and instructions of its median and worst block in the tests' profile on x86-64. To fill memory with zeros
/// counts as an instruction for each byte there.
const LIMITS: [(&str, u64, u64); 3] =
    [("standard", 742_048, 1_080_074), ("images", 1_958_961, 2_901_690), ("further", 5_220_492, 7_802_992)];
/// Further sources of the last of them, which is `standard` otherwise.
const FURTHER: usize = 15;
/// As many instances of the same room play in turn where misses are counted: three times what the cache holds.
const INSTANCES: usize = 4;
/// The caches of a core: 48 kB of data, and 1 MB.
const CACHES: [&str; 4] = ["--cache-sim=yes", "--I1=32768,8,64", "--D1=49152,12,64", "--LL=1048576,16,64"];
/// Of the larger one, misses of the median and worst block of an instance among these.
const MISSES: (u64, u64) = (8_109, 11_385);
/// A compiler's next version may take so much more.
const MARGIN: f64 = 1.10;

/// Callgrind counts from the beginning of this function to its end, each time anew.
#[inline(never)]
fn one_block(spatializer: &mut Spatializer, dry: &[f32], out: [&mut [f32]; 2], at: usize) {
    let walk = walk(RATE);
    let further: [_; FURTHER] = std::array::from_fn(|i| Voice::at(dry, Vec3::new((i as f32).cos(), (i as f32).sin(), 0.0)));
    spatializer.process(&[dry], &further, out, &BlockParams::default(), |i| walk(at + i));
}

#[test]
#[ignore = "run by the test below, in valgrind"]
fn plays() {
    let Ok(name) = env::var("PROMENADE_PLAYS") else { return };
    let scene = if name == "images" { room_with_images(RATE, 1.0, 0.05, 60) } else { room(RATE, 1.0, 0.05) };
    let further = if name == "further" { FURTHER } else { 0 };
    let count = if name == "instances" { INSTANCES } else { 1 };
    let carriers = Arc::new(Carriers::new(&scene, RATE));
    let mut spatializers: Vec<_> = (0..count)
        .map(|_| {
            let config = RendererConfig { voices: 1 + further, ..(RATE, Arc::clone(&carriers)).into() };
            let renderer = Renderer::new(Arc::clone(&scene), config).unwrap();
            let mut spatializer = Spatializer::new(RATE);
            spatializer.install(Box::new(renderer));
            spatializer
        })
        .collect();
    let dry = noise(1, 512);
    let (mut left, mut right) = (vec![0.0; 512], vec![0.0; 512]);
    for block in 0..BLOCKS / count {
        for spatializer in &mut spatializers {
            one_block(spatializer, &dry, [&mut left, &mut right], 512 * block);
        }
    }
}

/// Whether loops over bins run as they did when the limits were counted; valgrind runs nothing wider.
fn has_avx2() -> bool {
    #[cfg(target_arch = "x86_64")]
    return std::arch::is_x86_feature_detected!("avx2");
    #[cfg(not(target_arch = "x86_64"))]
    return false;
}

/// Median and worst of what valgrind counts in a block, by the numbers of its `totals` line.
fn counts(name: &str, options: &[&str], of: fn(&[u64]) -> u64) -> (u64, u64) {
    let folder = env::temp_dir().join(format!("promenade-instructions-{}-{name}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let program = env::current_exe().unwrap();
    let done = Command::new("valgrind")
        .args(["--tool=callgrind", "--zero-before=instructions::one_block", "--dump-after=instructions::one_block"])
        .args(options)
        .arg(format!("--callgrind-out-file={}", folder.join("block").display()))
        .arg(program)
        .args(["--exact", "plays", "--ignored", "--test-threads=1"])
        .env("PROMENADE_PLAYS", name)
        .env_remove("RTSAN_ENABLE")
        .output()
        .unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let count = |number: usize| {
        let text = fs::read_to_string(folder.join(format!("block.{number}"))).unwrap();
        let line = text.lines().find_map(|line| line.strip_prefix("totals: ")).expect("counts");
        of(&line.split_whitespace().map(|number| number.parse().unwrap()).collect::<Vec<u64>>())
    };
    let mut counts: Vec<u64> = (WARM_UP..BLOCKS).map(|block| count(1 + block)).collect();
    fs::remove_dir_all(folder).unwrap();
    counts.sort_unstable();
    (counts[counts.len() / 2], counts[counts.len() - 1])
}

/// Whether a count is more than it was.
fn is_more(found: u64, limit: u64) -> bool {
    found as f64 > limit as f64 * MARGIN
}

/// Whether anything can be counted here.
fn counts_here() -> bool {
    let here = has_avx2() && Command::new("valgrind").arg("--version").output().is_ok();
    if !here {
        eprintln!("SKIPPED: valgrind or AVX2 is not here, so nothing was counted");
    }
    here
}

#[test]
fn no_block_takes_more_instructions_than_it_did() {
    if !counts_here() {
        return;
    }
    let mut over = Vec::new();
    for (name, median, worst) in LIMITS {
        let found = counts(name, &[], |totals| totals[0]);
        println!("{name}: median {}, worst {}", found.0, found.1);
        if is_more(found.0, median) || is_more(found.1, worst) {
            over.push(format!("{name}: median {} and worst {} instructions, were {median} and {worst}", found.0, found.1));
        }
    }
    assert!(over.is_empty(), "{}", over.join("\n"));
}

#[test]
fn instances_in_turn_miss_the_cache_no_more_than_they_did() {
    if !counts_here() {
        return;
    }
    // Instructions, reads and writes; misses of all three in the first cache, and in the last.
    let found = counts("instances", &CACHES, |totals| totals[7] + totals[8]);
    println!("misses of one of {INSTANCES} instances: median {}, worst {}", found.0, found.1);
    let (median, worst) = MISSES;
    assert!(!is_more(found.0, median) && !is_more(found.1, worst), "{found:?} misses, were {MISSES:?}");
}
