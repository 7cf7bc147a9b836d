//! `promenade responses`: sets of responses described and made, before anything is baked.

use crate::args::{AmbisonicArgs, ManifestArgs, NormalisationArg, ResponsesCommand};
use crate::{hrtf, report};
use anyhow::Result;
use promenade_baker::ambisonic::{AmbisonicResponses, Normalisation};
use promenade_baker::responses::{Describe, describe};

pub(crate) fn run(command: &ResponsesCommand) -> Result<()> {
    match command {
        ResponsesCommand::Manifest(args) => manifest(args),
        ResponsesCommand::Ambisonic(args) => ambisonic(args),
    }
}

fn manifest(args: &ManifestArgs) -> Result<()> {
    let options = Describe { title: args.title.clone(), distance_m: args.distance, source: args.emitter };
    let set = describe(&args.folder, &options)?;
    report::notes(&set.notes);
    let (count, rate) = (set.responses.len(), set.sample_rate_hz);
    report::line(format_args!("{}: {count} responses at {rate} Hz", args.folder.join("responses.json").display()));
    Ok(())
}

fn ambisonic(args: &AmbisonicArgs) -> Result<()> {
    let normalisation = args.normalisation.map(|normalisation| match normalisation {
        NormalisationArg::Sn3d => Normalisation::Sn3d,
        NormalisationArg::N3d => Normalisation::N3d,
        NormalisationArg::Fuma => Normalisation::Fuma,
    });
    let set = AmbisonicResponses::load(&args.set.path, &args.set.options(None), normalisation, args.distance)?;
    let head = hrtf::read(&args.head)?;
    // A rate that is no whole number is refused when the responses are written, and before that by the HRTF's own.
    let hrtf = hrtf::at(&head, set.sample_rate_hz as u32, &args.head)?;
    let bar = report::Bar::new("rendering", set.responses.len() as f64);
    let mut binaural = set.binaural(&hrtf, args.yaws, |done| bar.at(done as f64))?;
    drop(bar);
    binaural.notes.push(format!("heard with the head {} of {} directions", head.title, hrtf.directions()));
    report::notes(&binaural.notes);
    binaural.save(&args.output)?;
    report::line(format_args!(
        "{}: {} responses of {} places at {} Hz",
        args.output.display(),
        binaural.responses.len(),
        set.responses.len(),
        binaural.sample_rate_hz
    ));
    Ok(())
}
