//! `promenade capture`: captures made of responses, imported from a data set, checked, and their emitters located.

mod check;
mod emitter;

use crate::args::{CaptureCommand, ClipArgs, ImportCaptureArgs, LayoutArg};
use crate::report;
use anyhow::Result;
use promenade_baker::capture::{DrySound, FromResponses, ImportCapture, from_responses, import_rwavs, mean};
use promenade_baker::{Capture, Responses, Split, sound};
use std::path::{Path, PathBuf};

pub(crate) fn run(command: &CaptureCommand) -> Result<()> {
    match command {
        CaptureCommand::FromResponses(args) => {
            write(&clips_of(&args.set.load(None)?, &args.clips, args.rate, args.seed)?, &args.output)
        }
        CaptureCommand::Import(args) => import(args),
        CaptureCommand::Check(args) => check::run(args),
        CaptureCommand::Emitter(args) => emitter::run(args),
    }
}

fn import(args: &ImportCaptureArgs) -> Result<()> {
    let options = ImportCapture {
        title: args.title.clone().unwrap_or_else(|| report::file_name(&args.folder)),
        credit: args.credit.clone(),
        licence: args.licence.clone(),
        sample_rate_hz: args.rate,
        emitter: args.emitter,
        placement: args.placement.options(),
    };
    let capture = match args.layout {
        LayoutArg::Rwavs => import_rwavs(&args.folder, &options)?,
    };
    write(&capture, &args.output)
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
