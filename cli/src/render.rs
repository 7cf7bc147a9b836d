//! `promenade render`: a WAV file through a scene, block by block, aligned in time with its input.

use crate::args::RenderArgs;
use crate::{progress, scene};
use anyhow::{Context, Result, bail};
use promenade_baker::path_file;
use promenade_baker::wav::{WavReader, WavWriter};
use promenade_core::{BlockParams, CameraPath, LiveParams, Playback, Pose, Renderer, Spatializer};
use std::time::Instant;

/// Where the listener is over time.
enum Walk {
    Still(Pose),
    Along(CameraPath, Playback),
}

impl Walk {
    fn pose_at(&self, seconds: f64) -> Pose {
        match self {
            Self::Still(pose) => *pose,
            Self::Along(path, playback) => path.pose_after(seconds, *playback),
        }
    }
}

pub(crate) fn run(args: &RenderArgs) -> Result<()> {
    let began = Instant::now();
    let scene = scene::read(&args.scene)?;
    if !scene.has_tier(args.tier) {
        bail!("{}: expected a scene with the tier {}, found none such in it", args.scene.display(), args.tier.name());
    }
    let walk = match (&args.path, args.pose) {
        (Some(path), _) => Walk::Along(path_file::read(path)?, Playback { speed: args.speed, looping: args.looping }),
        (None, Some(pose)) => Walk::Still(pose),
        (None, None) => Walk::Still(scene.start_pose()),
    };
    let mut reader = WavReader::open(&args.input)?;
    if reader.channels() > 2 {
        bail!("{}: expected 1 or 2 channels, found {}", args.input.display(), reader.channels());
    }
    let rate = f64::from(reader.sample_rate_hz());
    let mut spatializer = Spatializer::new(rate);
    let renderer = Renderer::new(scene, rate).with_context(|| format!("{}: cannot be rendered", args.input.display()))?;
    spatializer.install(Box::new(renderer));
    let mut writer = WavWriter::create(&args.output, reader.sample_rate_hz(), 2, args.bits)?;

    let live = LiveParams { rate_hz: args.decode_rate, wait: true };
    let gain = 10.0_f32.powf(args.gain / 20.0);
    let params = BlockParams { tier: args.tier, live, mix: args.mix, gain, bypass: false };
    let block = args.block as usize;
    let sounding = u64::from(reader.frames()) + spatializer.tail_samples() as u64;
    let bar = progress::of_sound(sounding as f64 / rate);
    // The output is late by the latency: that much is rendered after the end and dropped at the start.
    let mut late = spatializer.latency_samples();
    let whole = sounding + late as u64;
    let mut input = vec![Vec::with_capacity(block); usize::from(reader.channels())];
    let mut output = [vec![0.0_f32; block], vec![0.0_f32; block]];
    let mut position = 0_u64;
    while position < whole {
        let count = usize::try_from(whole - position).unwrap_or(block).min(block);
        input.iter_mut().for_each(Vec::clear);
        reader.read(count, &mut input)?;
        input.iter_mut().for_each(|channel| channel.resize(count, 0.0));
        let channels: Vec<&[f32]> = input.iter().map(Vec::as_slice).collect();
        let [left, right] = &mut output;
        let pose_at = |sample: usize| walk.pose_at((position + sample as u64) as f64 / rate);
        spatializer.process(&channels, [&mut left[..count], &mut right[..count]], &params, pose_at);
        let skip = late.min(count);
        late -= skip;
        writer.write(&[&left[skip..count], &right[skip..count]])?;
        position += count as u64;
        bar.at(position as f64 / rate);
    }
    let written = writer.finish()?;
    drop(bar);
    let (sound, took) = (written.frames as f64 / rate, began.elapsed().as_secs_f64());
    eprintln!("{}: {sound:.2} s of sound in {took:.2} s, {:.0} times real time", args.output.display(), sound / took.max(1e-9));
    if written.clipped > 0 {
        eprintln!("note: {} samples were above full scale and were limited; lower --gain or write --bits 32f", written.clipped);
    }
    Ok(())
}
