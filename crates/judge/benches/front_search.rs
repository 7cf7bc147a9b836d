//! How long the search for a scene's front takes, what it chooses, and how far that is off where the search has not looked.
//!
//!     cargo bench -p promenade-judge --features rayon --bench front_search -- SCENE...
//!
//! For each scene: seconds by the clock and of the processor; then for each limit the share of the operations, the error that
//! the front says, and that at 40 other poses and on three other ways, over the limit, four times. `--within JND` asks for one
//! limit alone, `--json FOLDER` writes what `tests/python/trade_picture.py` draws.
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs, reason = "a program for the command line")]

use cpu_time::ProcessTime;
use promenade_core::{Audible, FrontPoint, Scene};
use promenade_judge::trade::{OTHER_SEED, STANDARD_JNDS, elsewhere, front, largest};
use std::sync::Arc;
use std::time::Instant;

const OTHER_POSES: usize = 40;
const SEEDS: [u64; 4] = [OTHER_SEED, 11, 12, 13];

fn main() {
    let mut limits = STANDARD_JNDS.to_vec();
    let mut args = std::env::args().skip(1).filter(|arg| arg != "--bench");
    let (mut files, mut json) = (Vec::new(), None);
    while let Some(arg) = args.next() {
        if arg == "--within" {
            limits = vec![args.next().unwrap().parse().unwrap()];
        } else if arg == "--json" {
            json = args.next();
        } else {
            files.push(arg);
        }
    }
    println!("scene: seconds, of the processor; limit: operations %, JND by measure, elsewhere over limit");
    let (mut kept, mut cases) = (0, 0);
    for file in files {
        let scene = Arc::new(Scene::from_bytes(&std::fs::read(&file).unwrap()).unwrap());
        let (began, processor) = (Instant::now(), ProcessTime::now());
        let points = front(&scene, &limits, &|| true).unwrap();
        let (took, processor) = (began.elapsed().as_secs_f64(), processor.elapsed().as_secs_f64());
        let name = std::path::Path::new(&file).file_stem().unwrap().display();
        println!("{name}: {took:.1} s, {processor:.1} s");
        let settings: Vec<_> = points.iter().map(|point| point.setting).collect();
        let others = |seed| -> Vec<Audible> {
            let errors = elsewhere(&scene, &settings, OTHER_POSES, seed).unwrap();
            errors.iter().map(|errors| largest(errors)).collect()
        };
        let others = SEEDS.map(others);
        for limit in &limits {
            let chosen = *FrontPoint::within(&points, *limit).unwrap();
            let place = points.iter().position(|point| *point == chosen).unwrap();
            let error = chosen.error;
            print!("  {limit}: {:.1} %, {:.2} by {}", 100.0 * chosen.cost, error.jnds, error.measure.name());
            for other in others.each_ref().map(|others| others[place]) {
                let over = other.jnds / limit;
                kept += u32::from(over <= 1.15);
                cases += 1;
                print!(", {:.2} by {} ({over:.2})", other.jnds, other.measure.name());
            }
            println!(" {:?}", chosen.setting);
        }
        if let Some(folder) = &json {
            let error = |error: &Audible| format!("{{\"jnd\": {}, \"measure\": \"{}\"}}", error.jnds, error.measure.name());
            let row = |(p, other): (&FrontPoint, &Audible)| {
                format!("{{\"operations\": {}, \"error\": {}, \"elsewhere\": {}}}", p.cost, error(&p.error), error(other))
            };
            let rows: Vec<String> = points.iter().zip(&others[0]).map(row).collect();
            let text = format!("{{\"front\": [{}]}}\n", rows.join(", "));
            std::fs::write(std::path::Path::new(folder).join(format!("{name}.json")), text).unwrap();
        }
    }
    println!("{kept} of {cases} within 1.15 of the limit elsewhere");
}
