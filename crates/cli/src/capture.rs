//! `promenade capture`: captures made of responses, imported from data sets, checked, and their emitters located.

mod check;
mod emitter;

use crate::args::{CaptureCommand, ClipArgs, FromResponsesArgs, ImportCaptureArgs, LayoutArg, MixArgs};
use crate::report;
use anyhow::{Result, bail};
use promenade_baker::capture::{DrySound, FromResponses, ImportCapture, from_responses, import_rwavs, mean};
use promenade_baker::responses::{FolderOptions, load_folder};
use promenade_baker::{Capture, Responses, Split, sound};
use std::path::{Path, PathBuf};

pub(crate) fn run(command: &CaptureCommand) -> Result<()> {
    match command {
        CaptureCommand::FromResponses(args) => of_responses(args),
        CaptureCommand::Import(args) => import(args),
        CaptureCommand::Check(args) => check::run(args),
        CaptureCommand::Emitter(args) => emitter::run(args),
    }
}

fn of_responses(args: &FromResponsesArgs) -> Result<()> {
    write(&mixed(&args.set.load(None)?, &args.mix)?, &args.output)
}

fn import(args: &ImportCaptureArgs) -> Result<()> {
    let folder = report::file_name(&args.folder);
    let title = args.title.clone().unwrap_or(folder);
    let is_recording = args.layout == LayoutArg::Rwavs;
    if is_recording && !args.mix.clips.dry.is_empty() {
        bail!("--dry is for layouts of responses; recordings have their own dry sound");
    }
    let capture = if is_recording {
        let options = ImportCapture {
            title,
            credit: args.credit.clone(),
            licence: args.licence.clone(),
            sample_rate_hz: args.mix.rate,
            emitter: args.emitter,
            placement: args.placement.options(),
        };
        import_rwavs(&args.folder, &options)?
    } else {
        let options = FolderOptions {
            title,
            credit: args.credit.clone(),
            licence: args.licence.clone(),
            placement: args.placement.options(),
            emitter: args.emitter,
        };
        mixed(&load_folder(&args.folder, &options)?, &args.mix)?
    };
    write(&capture, &args.output)
}

fn mixed(responses: &Responses, args: &MixArgs) -> Result<Capture> {
    clips_of(responses, &args.clips, args.rate, args.seed)
}

/// A capture of responses and dry sound, at a sample rate or the responses' own.
pub(crate) fn clips_of(responses: &Responses, args: &ClipArgs, rate: Option<u32>, seed: u64) -> Result<Capture> {
    let one = |path: &PathBuf| -> Result<DrySound> {
        let sound = sound::read(path)?;
        let (name, samples) = (report::file_name(path), mean(&sound.channels));
        Ok(DrySound { name, sample_rate_hz: sound.sample_rate_hz, samples })
    };
    let dry = args.dry.iter().map(one).collect::<Result<Vec<_>>>()?;
    let options = FromResponses {
        sample_rate_hz: rate,
        clip_s: args.clip,
        clips: args.clips as usize,
        test_share: args.test_share,
        seed,
        ..FromResponses::default()
    };
    Ok(from_responses(responses, &dry, &options)?)
}

/// Writes a capture, and tells what is in it.
pub(crate) fn write(capture: &Capture, folder: &Path) -> Result<()> {
    report::notes(&capture.notes);
    capture.write(folder)?;
    let count = |split| capture.split(split).count();
    let (tracks, train, test) = (capture.tracks.len(), count(Split::Train), count(Split::Test));
    report::line(format_args!("{}: {tracks} tracks, {train} clips to learn from, {test} to judge by", folder.display()));
    Ok(())
}
