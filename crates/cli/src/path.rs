//! `promenade path`: camera paths of every form, converted or in figures; and how all commands read them.

use crate::args::PathArgs;
use crate::report;
use anyhow::{Context, Result, bail};
use promenade_baker::{atomic, file};
use promenade_core::glam::Vec3;
use promenade_paths::{CameraPath, ImportOptions, Imported, MAX_FILE_BYTES, Summary, WriteFormat, simplify, write};
use std::path::{Path, PathBuf};

/// Where a folder keeps the images of a COLMAP model, of which COLMAP itself prefers the binary form, or the cameras of a NeRF
/// tool.
const IN_FOLDER: [&str; 7] = [
    "images.bin",
    "images.txt",
    "sparse/0/images.bin",
    "sparse/0/images.txt",
    "sparse/images.bin",
    "sparse/images.txt",
    "transforms.json",
];

/// Reads a camera path of any form.
pub(crate) fn read(path: &Path, options: &ImportOptions) -> Result<Imported> {
    let file = if path.is_dir() { images_in(path)? } else { path.to_path_buf() };
    let name = file.display().to_string();
    let bytes = file::open(&file).and_then(|mut file| promenade_paths::bytes_of(&mut file));
    let bytes = bytes.with_context(|| format!("{name}: cannot be read"))?;
    let folder = file.parent().unwrap_or(Path::new(""));
    let mut beside = |uri: &str| file::read(&folder.join(uri), MAX_FILE_BYTES);
    Ok(promenade_paths::read(&name, &bytes, options, &mut beside)?)
}

fn images_in(folder: &Path) -> Result<PathBuf> {
    let found = IN_FOLDER.iter().map(|name| folder.join(name)).find(|file| file.is_file());
    found.with_context(|| {
        let names = format!("{} or sparse/0/images.bin", IN_FOLDER[..2].join(", "));
        format!(
            "{}: expected a COLMAP model, a folder with {names}, or a transforms.json, found none of them",
            folder.display()
        )
    })
}

pub(crate) fn run(args: &PathArgs) -> Result<()> {
    let output = match &args.output {
        Some(output) => Some((output, WriteFormat::of(&output.display().to_string())?)),
        None => None,
    };
    let imported = read(&args.input, &args.options())?;
    let found = imported.path.keyframes().len();
    let path = match args.simplify {
        None => imported.path.clone(),
        Some((metres, radians)) => {
            let few = simplify(imported.path.keyframes(), metres, radians).and_then(CameraPath::new);
            few.with_context(|| format!("{}: cannot be simplified", args.input.display()))?
        }
    };
    let Some((output, format)) = output else {
        return report::print(&figures(&imported, &path));
    };
    if output.is_dir() {
        bail!("{}: expected the name of a file to write, found a folder", output.display());
    }
    atomic::write(output, write(&path, format).as_bytes())?;
    report::notes(&imported.notes);
    let of = if args.simplify.is_some() { format!(" of {found}") } else { String::new() };
    report::line(format_args!("{}: {}{of} keyframes, {:.2} s", output.display(), path.keyframes().len(), path.duration_s()));
    Ok(())
}

/// The path in figures, aligned like those of a scene.
fn figures(imported: &Imported, path: &CameraPath) -> String {
    let s = Summary::of(path);
    // Rounded first, so that what is nearly 0 gets no sign.
    let point = |v: Vec3| v.to_array().map(|c| format!("{:.2}", (100.0 * c).round() / 100.0 + 0.0)).join(", ");
    let at = |t_s: f64| format!("at {t_s:.2} s");
    let found = imported.path.keyframes().len();
    let keyframes = if s.keyframes == found { found.to_string() } else { format!("{} of {found}", s.keyframes) };
    let rows = [
        ("form", imported.format.name().to_owned()),
        ("keyframes", keyframes),
        ("duration", format!("{:.2} s, from {:.2} s", s.duration_s, s.start_s)),
        ("length", format!("{:.2} m", s.length_m)),
        ("bounds", format!("{} to {} m", point(s.low), point(s.high))),
        ("fastest", format!("{:.2} m/s {}", s.fastest_m_s.0, at(s.fastest_m_s.1))),
        ("fastest turn", format!("{:.0} degrees/s {}", s.fastest_rad_s.0.to_degrees(), at(s.fastest_rad_s.1))),
    ];
    let notes = imported.notes.iter().map(|note| ("note", note.clone()));
    report::properties(rows.into_iter().chain(notes))
}
