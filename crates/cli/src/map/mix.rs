//! What a renderer of pictures may spend on each pixel, by eye and ear.

use super::camera::View;
use super::exr;
use crate::args::{MixMapArgs, Strategy};
use crate::{picture, plot, report, simulate};
use anyhow::{Context, Result, bail};
use promenade_acoustics::Intensity;
use promenade_baker::{FileError, atomic};
use promenade_metrics::{Plane, SampleBudget, fused, loudness_of_pixels, picture_saliency, picture_weights};
use promenade_study::sound_saliency;
use std::path::Path;

/// Most pixels of all pictures together.
const MOST_PIXELS: f64 = 1e10;
/// How far costs may be off before it is said.
const LEEWAY: f64 = 0.01;

/// What a strategy cost.
struct Spent {
    strategy: Strategy,
    least: [u32; 2],
    most: [u32; 2],
    samples: f64,
    pixels: f64,
}

pub(super) fn run(args: &MixMapArgs) -> Result<()> {
    let mut strategies = args.strategy.clone();
    strategies.sort_by_key(|s| *s as u8);
    strategies.dedup();
    let still = args.pictures.len() == 1;
    let first = picture::read(&args.pictures[0])?;
    let size = [first[0].width, first[0].height];
    let weights = weights_of_sound(args, size)?;
    let frames = weights.len();
    let sounds = heard(args, size)?;
    std::fs::create_dir_all(&args.output).map_err(FileError::write(&args.output))?;
    let mut spent: Vec<Spent> = strategies.iter().map(|strategy| Spent::none(*strategy)).collect();
    let mut seen = picture_saliency(first.each_ref());
    let digits = frames.to_string().len().max(4);
    let bar = report::Bar::new("sharing out samples", 1.0);
    for (frame, weight) in weights.iter().enumerate() {
        if frame > 0 && !still {
            seen = seen_in(&args.pictures[frame], size)?;
        }
        for spent in &mut spent {
            let map = match spent.strategy {
                Strategy::Uniform => fused(&seen, &seen, 0.0),
                Strategy::Image => seen.clone(),
                Strategy::Sound => sounds.clone(),
                Strategy::Mix => fused(&sounds, &seen, *weight),
            };
            let even = spent.strategy == Strategy::Uniform;
            let least = if even { args.samples } else { args.least.unwrap_or(args.samples / 2) };
            let budget = SampleBudget::of_pixels(&map, args.samples, least)?;
            let samples = budget.spent_on_pixels(&map);
            // Nobody needs the same picture again for each moment.
            let moves = spent.strategy == Strategy::Mix || !(still || even);
            if moves || frame == 0 {
                let name = format!("{}-{:0digits$}", spent.name(), frame + 1);
                write(&args.output.join(&name), size, &map, &samples, *weight)?;
            }
            spent.count(budget, &samples);
        }
        bar.at((frame + 1) as f64 / frames as f64);
    }
    drop(bar);
    let low = weights.iter().copied().fold(1.0, f64::min);
    let high = weights.iter().copied().fold(0.0, f64::max);
    for spent in spent.iter().filter(|s| (s.mean() / f64::from(args.samples) - 1.0).abs() > LEEWAY) {
        let (mean, wanted) = (spent.mean(), args.samples);
        report::note(format_args!("{}: {mean:.3} samples per pixel, since no whole numbers make {wanted}", spent.name()));
    }
    let mut rows = vec![["strategy", "least", "most", "samples per pixel"].map(str::to_owned).to_vec()];
    rows.extend(spent.iter().map(Spent::row));
    report::print(&format!("{}{frames} pictures, weight of the sound {low:.2} to {high:.2}\n", report::table(&rows, false)))
}

/// How much the sound weighs against each picture.
fn weights_of_sound(args: &MixMapArgs, size: [usize; 2]) -> Result<Vec<f64>> {
    let (trace, seconds) = sound_saliency(&args.sound)?;
    let in_sound = (seconds * args.fps).ceil().max(1.0) as usize;
    let pictures = args.pictures.len();
    if pictures > in_sound {
        let path = args.sound.display();
        bail!("{path}: expected sound for {pictures} pictures at {} a second, found {seconds:.2} s", args.fps);
    }
    let frames = if pictures == 1 { in_sound } else { pictures };
    if (frames * size[0] * size[1]) as f64 > MOST_PIXELS {
        bail!("expected at most {MOST_PIXELS:.0} pixels of all pictures together, found {frames} of {} x {}", size[0], size[1]);
    }
    Ok(picture_weights(&trace, args.fps, frames))
}

/// How salient each pixel of a further picture is.
fn seen_in(path: &Path, [width, height]: [usize; 2]) -> Result<Plane> {
    let next = picture::read(path)?;
    let found = [next[0].width, next[0].height];
    if found != [width, height] {
        bail!("{}: expected {width} x {height} pixels as the first, found {} x {}", path.display(), found[0], found[1]);
    }
    Ok(picture_saliency(next.each_ref()))
}

/// How loud each pixel is.
fn heard(args: &MixMapArgs, size: [usize; 2]) -> Result<Plane> {
    let (_, room, _) = simulate::room(&args.room)?;
    let intensity = Intensity::new(&room, simulate::source(&args.room)?, &args.trace.options(args.rays))?;
    let view = View::new(&intensity, &args.camera, size, args.fov)?;
    if !view.level_db.iter().any(|level| level.is_finite()) {
        bail!("--camera: no sound falls on anything that it sees");
    }
    let levels = Plane::new(size, view.level_db).context("a level for each pixel")?;
    Ok(loudness_of_pixels(&levels))
}

fn write(path: &Path, size: [usize; 2], map: &Plane, samples: &[u32], weight: f64) -> Result<()> {
    let numbers: Vec<f32> = samples.iter().map(|n| *n as f32).collect();
    let weights = vec![weight as f32; numbers.len()];
    atomic::write(&path.with_extension("png"), &plot::picture_png(size, &numbers, None)?)?;
    exr::write(
        &path.with_extension("exr"),
        size,
        vec![("samples", numbers), ("saliency", map.of.clone()), ("sound_weight", weights)],
    )
}

impl Spent {
    fn none(strategy: Strategy) -> Self {
        Self { strategy, least: [u32::MAX, 0], most: [u32::MAX, 0], samples: 0.0, pixels: 0.0 }
    }

    fn name(&self) -> &'static str {
        match self.strategy {
            Strategy::Uniform => "uniform",
            Strategy::Image => "image",
            Strategy::Sound => "sound",
            Strategy::Mix => "mix",
        }
    }

    fn count(&mut self, budget: SampleBudget, samples: &[u32]) {
        for (range, value) in [(&mut self.least, budget.least()), (&mut self.most, budget.most())] {
            *range = [range[0].min(value), range[1].max(value)];
        }
        self.samples += samples.iter().map(|n| f64::from(*n)).sum::<f64>();
        self.pixels += samples.len() as f64;
    }

    fn mean(&self) -> f64 {
        self.samples / self.pixels
    }

    fn row(&self) -> Vec<String> {
        let range = |[low, high]: [u32; 2]| if low == high { low.to_string() } else { format!("{low} to {high}") };
        vec![self.name().to_owned(), range(self.least), range(self.most), format!("{:.3}", self.mean())]
    }
}
