//! Probe.
use promenade_baker::anchors::AnchorSet;
use promenade_baker::capture::{Capture, Split};
use promenade_trainer::{TrainSettings, Trainer};
use std::time::Instant;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let capture = Capture::load(args[1].as_ref()).unwrap();
    let anchors = AnchorSet::load(args[2].as_ref()).unwrap();
    let settings: TrainSettings = args
        .get(3)
        .map_or_else(TrainSettings::default, |p| serde_json::from_str(&std::fs::read_to_string(p).unwrap()).unwrap());
    let steps = settings.steps;
    let every = settings.look_every;
    let mut t = Trainer::new(&capture, &anchors, settings, burn::tensor::Device::flex(), 2).unwrap();
    let from = Instant::now();
    let (mut sum, mut n) = (0.0, 0);
    for i in 0..steps {
        let r = t.step();
        sum += r.loss;
        n += 1;
        if (i + 1) % every == 0 || i == 0 {
            let s = from.elapsed().as_secs_f64();
            println!(
                "step {} loss {:.4} norm {:.3} {:.3} s/step; test {:?} train {:?}",
                r.step,
                sum / n as f64,
                r.gradient_norm,
                s / (i + 1) as f64,
                t.look(Split::Test),
                if i == 0 { None } else { Some(t.look(Split::Train)) }
            );
            (sum, n) = (0.0, 0);
        }
    }
}
