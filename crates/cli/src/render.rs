//! `promenade render`: a WAV file through a scene, aligned in time with its input.

mod ambix;
mod voices;

use crate::args::{OutputFormat, RenderArgs};
use crate::{path, progress, report, scene};
use anyhow::{Context, Result, ensure};
use promenade_baker::cloud_scene::with_emitter;
use promenade_baker::player::{Mix, Player, Source};
use promenade_baker::wav::WavWriter;
use promenade_baker::{read_head, read_headphones};
use promenade_core::head::channels;
use promenade_core::{CameraPath, Playback, Pose};
use promenade_paths::ImportOptions;
use std::sync::Arc;
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
    let ambix = args.format == OutputFormat::Ambix;
    if ambix {
        ambix::check(args)?;
    }
    let mut scene = scene::read(&args.scene)?;
    if let Some(file) = &args.head {
        let head = read_head(file)?;
        report::notes(head.notes());
        scene = Arc::new(scene.with_head(&head).with_context(|| args.scene.display().to_string())?);
    }
    if let Some(position) = args.emitter {
        let moved = with_emitter(&scene, position)?;
        let why = "--emitter: expected a scene that was trained with several emitters, found one that holds for its own";
        scene = Arc::new(moved.with_context(|| format!("{}: {why}", args.scene.display()))?);
    }
    let walk = match &args.path {
        Some(file) => {
            let imported = path::read(file, &ImportOptions::default())?;
            report::notes(&imported.notes);
            Walk::Along(imported.path, Playback { speed: args.speed, looping: args.looping })
        }
        None => Walk::Still(args.pose.unwrap_or_else(|| scene.start_pose())),
    };
    let source = Source::open(&args.input, None)?;
    let (rate_hz, frames) = (source.sample_rate_hz(), source.frames());
    let rate = f64::from(rate_hz);
    let spread = args.sound.stereo_spread.unwrap_or(0.0);
    ensure!(
        spread == 0.0 || source.channels() == 2,
        "{}: --stereo-spread expects 2 channels, found {}",
        args.input.display(),
        source.channels()
    );
    let player = Player::at_latency(&scene, rate, args.tier, args.latency);
    let player = player.with_context(|| args.scene.display().to_string())?;
    let player = player.with_decode_rate(args.decode_rate).with_trim(args.sound.trim())?;
    let player = player.with_voices(voices::open(args, &scene, rate_hz)?).with_context(|| args.scene.display().to_string())?;
    let mut player = player.with_stereo_spread(spread).with_context(|| args.scene.display().to_string())?;
    if let Some(file) = &args.headphones {
        player = player.with_headphones(&read_headphones(file)?);
    }
    // Opened first: an output that cannot be written is known at once.
    let outputs = if ambix { channels(args.order.into()) as u16 } else { 2 };
    let mut writer = WavWriter::create(&args.output, rate_hz, outputs, args.bits)?;
    let bar = progress::of_sound(frames as f64 / rate + player.tail_s());
    if ambix {
        ambix::play(&scene, args, &walk, &mut writer, |played| bar.at(played as f64 / rate))?;
    } else {
        let mut played = 0;
        let mut write = |ears: [&[f32]; 2]| {
            played += ears[0].len();
            bar.at(played as f64 / rate);
            writer.write(&ears)
        };
        let mix = Mix::new(args.mix, args.gain);
        let mix = if args.sound.wet_solo { mix.without_dry() } else { mix };
        player.play(source, mix, args.block as usize, &mut |seconds| walk.pose_at(seconds), &mut write)?;
    }
    drop(bar);
    let written = writer.finish()?;
    progress::done(&args.output, written.frames, rate, began);
    if written.clipped > 0 {
        report::note(format_args!(
            "{} samples were above full scale and were limited; lower --gain or write --bits 32f",
            written.clipped
        ));
    }
    Ok(())
}
