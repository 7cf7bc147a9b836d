//! Frames of two pictures that are blended at each moment's weight of a sound, as a study's page blends them.

use crate::args::CompositeArgs;
use crate::{picture, plot, report};
use anyhow::{Result, bail};
use promenade_baker::{FileError, atomic};
use promenade_metrics::picture_weights;
use promenade_study::sound_saliency;

/// Most frames: ten minutes of sound, 60 a second.
const MOST_FRAMES: usize = 36_000;

pub(super) fn run(args: &CompositeArgs) -> Result<()> {
    let [first, second] = [&args.first, &args.second].map(|path| picture::read(path));
    let ([first, second], path) = ([picture::light(&first?), picture::light(&second?)], args.second.display());
    let [size, found] = [&first, &second].map(|of| [of[0].width, of[0].height]);
    if size != found {
        bail!("{path}: expected {} x {} pixels as the first, found {} x {}", size[0], size[1], found[0], found[1]);
    }
    let (trace, seconds) = sound_saliency(&args.sound)?;
    let frames = (seconds * args.fps).ceil() as usize;
    if frames > MOST_FRAMES {
        bail!("{}: expected sound for at most {MOST_FRAMES} pictures, found {frames}", args.sound.display());
    }
    let weights = picture_weights(&trace, args.fps, frames);
    std::fs::create_dir_all(&args.output).map_err(FileError::write(&args.output))?;
    let digits = frames.to_string().len().max(4);
    let bar = report::Bar::new("blending", 1.0);
    for (frame, weight) in weights.iter().enumerate() {
        let blend = |a: f32, b: f32| picture::shown(a + (b - a) * *weight as f32);
        let of = |channel: usize| first[channel].of.iter().zip(&second[channel].of).map(move |(a, b)| blend(*a, *b));
        let pixels = of(0).zip(of(1)).zip(of(2)).flat_map(|((r, g), b)| [r, g, b].map(|v| (255.0 * v).round() as u8));
        let bytes = plot::png([size[0].try_into()?, size[1].try_into()?], &pixels.collect::<Vec<_>>())?;
        atomic::write(&args.output.join(format!("{:0digits$}.png", frame + 1)), &bytes)?;
        bar.at((frame + 1) as f64 / frames as f64);
    }
    drop(bar);
    let [low, high] = [f64::min, f64::max].map(|of| weights.iter().copied().fold(weights[0], of));
    report::print(&format!("{frames} pictures, weight of the second {low:.2} to {high:.2}\n"))
}
