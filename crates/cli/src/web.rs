//! `promenade web`: scenes and dry sounds as a page that plays them, in a folder or served on this machine.

pub(crate) mod engine;
mod outline;
mod server;
mod site;
mod splats;

use crate::args::WebArgs;
use crate::report;
use anyhow::{Result, ensure};
use promenade_core::network::Placement;
use promenade_paths::PlacementOptions;
use site::Site;
use std::path::PathBuf;

pub(crate) fn run(args: &WebArgs) -> Result<()> {
    // An option with several files takes what follows it: what is a scene is told by its ending.
    let is_scene = |file: &&PathBuf| file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("promenade"));
    let lists = [&args.dry, &args.path, &args.head, &args.headphones, &args.splats];
    let all: Vec<&PathBuf> = args.scenes.iter().chain(lists.iter().flat_map(|list| list.iter().filter(is_scene))).collect();
    let [dry, path, head, headphones, splats] =
        lists.map(|list| list.iter().filter(|file| !is_scene(file)).collect::<Vec<_>>());
    let (scenes, given) = (all.len(), splats.len());
    ensure!(given <= scenes, "--splats: expected at most one file a scene, {scenes}, found {given}");
    let (sounds, credits, paths) = (dry.len(), args.credit.len(), path.len());
    ensure!(credits <= sounds, "--credit: expected at most one text a dry sound, {sounds}, found {credits}");
    ensure!(scenes == 1 || paths <= scenes, "--path: expected at most one file a scene, {scenes}, found {paths}");
    let options = args.placement.options();
    ensure!(
        given > 0 || options == PlacementOptions::default(),
        "--up, --metres-per-unit, --origin: expected --splats, found none"
    );
    let placement = options.over(&Placement::IDENTITY, &[])?;
    let engine = engine::read(args.engine.as_deref())?;
    let mut site = Site::new(engine);
    for (number, file) in all.into_iter().enumerate() {
        let splats = splats.get(number).map(|file| site.add_splats(file, &placement)).transpose()?;
        site.add_scene(file, splats)?;
    }
    for (number, file) in dry.iter().enumerate() {
        site.add_sound(file, args.credit.get(number).map(String::as_str))?;
    }
    for (number, file) in path.iter().enumerate() {
        site.add_path(file, if scenes == 1 { 0 } else { number })?;
    }
    head.iter().try_for_each(|file| site.add_head(file))?;
    headphones.iter().try_for_each(|file| site.add_headphones(file))?;
    let site = site.finish(args.title.as_deref());
    if let Some(folder) = &args.output {
        ensure!(!folder.is_file(), "{}: expected a folder to write, found a file", folder.display());
        site.write(folder)?;
        report::line(format_args!("{}: {} files, {:.1} MB", folder.display(), site.files().len(), site.bytes() as f64 / 1e6));
    }
    match args.serve {
        Some(port) => server::serve(&site, port),
        None => Ok(()),
    }
}
