//! `promenade render`: a WAV file through a scene, block by block, aligned in time with its input.

use crate::args::RenderArgs;
use crate::{clip, path, progress, scene};
use anyhow::{Context, Result, anyhow, bail};
use promenade_baker::evaluate::Playing;
use promenade_baker::wav::{self, Wav, WavReader, WavWriter};
use promenade_baker::{FileError, resample};
use promenade_core::{BlockParams, CameraPath, LiveParams, Playback, Pose, Renderer, Scene, Spatializer, Tier};
use promenade_paths::ImportOptions;
use std::sync::Arc;
use std::time::Instant;

/// Channels and frames of an input.
#[derive(Clone, Copy)]
struct Shape {
    channels: usize,
    frames: usize,
}

/// Appends up to so many samples to each channel.
type Read<'a> = dyn FnMut(usize, &mut [Vec<f32>]) -> Result<(), FileError> + 'a;
/// Takes the next samples of both ears.
type Write<'a> = dyn FnMut([&[f32]; 2]) -> Result<(), FileError> + 'a;

/// What is rendered, and through what.
struct Job<'a> {
    args: &'a RenderArgs,
    scene: &'a Arc<Scene>,
    walk: &'a Walk,
    /// Linear.
    gain: f32,
}

impl Job<'_> {
    /// Renders block by block; the output is aligned with the input.
    fn stream(&self, tier: Tier, rate: f64, shape: Shape, read: &mut Read<'_>, write: &mut Write<'_>) -> Result<()> {
        let name = self.args.input.display();
        let renderer = Renderer::for_tier(self.scene, rate, tier).with_context(|| format!("{name}: cannot be rendered"))?;
        let mut spatializer = Spatializer::new(rate);
        spatializer.install(Box::new(renderer));
        let live = LiveParams { rate_hz: self.args.decode_rate, wait: true };
        let params = BlockParams { tier, live, mix: self.args.mix, gain: self.gain, bypass: false };
        let block = self.args.block as usize;
        let sounding = shape.frames + spatializer.tail_samples();
        let bar = progress::of_sound(sounding as f64 / rate);
        // The output is late by the latency: that much is rendered after the end and dropped at the start.
        let mut late = spatializer.latency_samples();
        let whole = sounding + late;
        let mut input = vec![Vec::with_capacity(block); shape.channels];
        let mut output = [vec![0.0_f32; block], vec![0.0_f32; block]];
        for position in (0..whole).step_by(block) {
            let count = block.min(whole - position);
            input.iter_mut().for_each(Vec::clear);
            read(count, &mut input)?;
            input.iter_mut().for_each(|channel| channel.resize(count, 0.0));
            let channels: Vec<&[f32]> = input.iter().map(Vec::as_slice).collect();
            let [left, right] = &mut output;
            let pose_at = |sample: usize| self.walk.pose_at((position + sample) as f64 / rate);
            spatializer.process(&channels, [&mut left[..count], &mut right[..count]], &params, pose_at);
            let skip = late.min(count);
            late -= skip;
            write([&left[skip..count], &right[skip..count]])?;
            bar.at(position as f64 / rate);
        }
        Ok(())
    }

    fn at_the_scenes_rate(&self, tier: Tier) -> Result<[Vec<f32>; 2]> {
        let Wav { sample_rate_hz, channels } = wav::read(&self.args.input)?;
        let scene_rate = self.scene.grid().sample_rate_hz;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked when the scene was read")]
        let scene_hz = scene_rate.round() as u32;
        let source = resample::signal(&channels, sample_rate_hz, scene_hz)?;
        let shape = Shape { channels: source.len(), frames: source.first().map_or(0, Vec::len) };
        let mut at = 0;
        let mut read = |count: usize, input: &mut [Vec<f32>]| {
            let end = shape.frames.min(at + count);
            input.iter_mut().zip(&source).for_each(|(to, from)| to.extend_from_slice(&from[at..end]));
            at = end;
            Ok(())
        };
        let mut ears = vec![Vec::new(), Vec::new()];
        let mut write = |block: [&[f32]; 2]| {
            ears.iter_mut().zip(block).for_each(|(to, from)| to.extend_from_slice(from));
            Ok(())
        };
        self.stream(tier, scene_rate, shape, &mut read, &mut write)?;
        two_ears(resample::signal(&ears, scene_hz, sample_rate_hz)?)
    }

    /// The published model, clip by clip, with the dry sound mixed in as for a stream.
    fn clip(&self) -> Result<[Vec<f32>; 2]> {
        let Wav { sample_rate_hz, channels } = wav::read(&self.args.input)?;
        let frames = channels.first().map_or(0, Vec::len);
        let mono: Vec<f32> = (0..frames).map(|i| channels.iter().map(|c| c[i]).sum::<f32>() / channels.len() as f32).collect();
        let mut ears = clip::render(self.scene, &mono, sample_rate_hz, |seconds| self.walk.pose_at(seconds))
            .with_context(|| format!("{}: cannot be rendered clip by clip", self.args.scene.display()))?;
        let mix = self.args.mix;
        for (ear, dry) in ears.iter_mut().zip([channels.first(), channels.last()]) {
            for (wet, dry) in ear.iter_mut().zip(dry.into_iter().flatten()) {
                *wet = self.gain * (mix * *wet + (1.0 - mix) * dry);
            }
        }
        Ok(ears)
    }
}

/// Two channels as left and right ear.
pub(crate) fn two_ears(channels: Vec<Vec<f32>>) -> Result<[Vec<f32>; 2]> {
    channels.try_into().map_err(|_| anyhow!("expected two channels"))
}

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
    let wanted = args.tier.unwrap_or(Playing::Stream(scene.played_tier(Tier::Standard)));
    if let Playing::Stream(tier) = wanted
        && !scene.has_tier(tier)
    {
        bail!("{}: expected a scene with the tier {}, found none such in it", args.scene.display(), tier.name());
    }
    let walk = match (&args.path, args.pose) {
        (Some(file), _) => {
            let imported = path::read(file, &ImportOptions::default())?;
            path::remark(&imported);
            Walk::Along(imported.path, Playback { speed: args.speed, looping: args.looping })
        }
        (None, Some(pose)) => Walk::Still(pose),
        (None, None) => Walk::Still(scene.start_pose()),
    };
    let mut reader = WavReader::open(&args.input)?;
    if reader.channels() > 2 {
        bail!("{}: expected 1 or 2 channels, found {}", args.input.display(), reader.channels());
    }
    let rate_hz = reader.sample_rate_hz();
    let gain = 10.0_f32.powf(args.gain / 20.0);
    let job = Job { args, scene: &scene, walk: &walk, gain };
    // Opened first: an output that cannot be written is known at once.
    let mut writer = WavWriter::create(&args.output, rate_hz, 2, args.bits)?;
    match wanted {
        Playing::Stream(tier) if tier < Tier::Reference || f64::from(rate_hz) == scene.grid().sample_rate_hz => {
            let shape = Shape { channels: usize::from(reader.channels()), frames: reader.frames() as usize };
            let mut read = |count: usize, input: &mut [Vec<f32>]| reader.read(count, input).map(drop);
            let mut write = |ears: [&[f32]; 2]| writer.write(&ears);
            job.stream(tier, f64::from(rate_hz), shape, &mut read, &mut write)?;
        }
        Playing::Stream(tier) => {
            // The convolution layers know only their own grid: the sound is converted there and back.
            let [left, right] = job.at_the_scenes_rate(tier)?;
            writer.write(&[&left, &right])?;
        }
        Playing::Clip => {
            let [left, right] = job.clip()?;
            writer.write(&[&left, &right])?;
        }
    }
    let written = writer.finish()?;
    let rate = f64::from(rate_hz);
    let (sound, took) = (written.frames as f64 / rate, began.elapsed().as_secs_f64());
    eprintln!("{}: {sound:.2} s of sound in {took:.2} s, {:.0} times real time", args.output.display(), sound / took.max(1e-9));
    if written.clipped > 0 {
        eprintln!("note: {} samples were above full scale and were limited; lower --gain or write --bits 32f", written.clipped);
    }
    Ok(())
}
