//! `promenade path`: camera paths of every form, converted or in figures.

use crate::args::PathArgs;
use crate::report;
use anyhow::{Context, Result, bail};
use promenade_baker::atomic;
use promenade_baker::file::is_standard;
use promenade_core::glam::Vec3;
use promenade_paths::{CameraPath, Imported, Summary, WriteFormat, simplify, write};

pub(crate) use promenade_player::command::read_path as read;

pub(crate) fn run(args: &PathArgs) -> Result<()> {
    let output = match &args.output {
        Some(output) if is_standard(output) => Some((output, WriteFormat::Json)),
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
