//! `promenade fit ROOM --t20`: a box whose walls are given the reverberation times of a measured one.

use crate::args::{FitArgs, T20};
use crate::fit::walls;
use crate::report;
use crate::simulate::described;
use anyhow::{Result, bail};
use promenade_acoustics::{BANDS, Material, Materials, OCTAVES_HZ, Shoebox};
use promenade_audio::atomic;
use promenade_baker::read_measured;
use promenade_fit::{MaterialsBeside, WALLS, box_obj};
use promenade_room::{Some7, factored, match_t20, measured_t20_s, t20_s};
use std::path::Path;

/// What walls are made of that nothing is said of.
const UNSAID: &str = "0.1";
/// The source's place where none is given, as shares of the lengths.
const SOURCE: [f64; 3] = [0.31, 0.42, 0.45];

pub(crate) fn run(args: &FitArgs, t20: &T20) -> Result<()> {
    let [room] = &args.of[..] else { bail!("expected a room alone with --t20: length, width and height in metres, X,Y,Z") };
    let walls = walls(room)?;
    let output = args.output.as_deref();
    if let Some(output) = output.filter(|o| o.extension().is_none_or(|e| e != "obj")) {
        bail!("{}: expected a file ending in .obj, of which `promenade simulate` makes scenes", output.display());
    }
    let wanted = match t20 {
        T20::Typed(times) => *times,
        T20::File(path) => measured(path)?,
    };
    let groups = WALLS.map(str::to_owned);
    let rules = [&args.materials[..], &[("*".to_owned(), UNSAID.to_owned())]].concat();
    let table = Materials::default();
    let Ok(materials) = <[Material; 6]>::try_from(table.assign(&groups, &rules)?) else { bail!("expected six walls") };
    let named = Shoebox { size: walls.size_m(), materials };
    let size = named.size;
    let source = args.emitter.map_or(std::array::from_fn(|a| SOURCE[a] * size[a]), |e| e.as_dvec3().to_array());
    let air = args.set.air.air();
    let before = t20_s(&named, air, source, args.seed)?;
    let matched = match_t20(&named, air, source, &wanted, args.seed)?;
    let times = |name: &str, times: &Some7| line(name, |b| times[b].map_or("-".to_owned(), |t| format!("{t:.3}")));
    let rows = [
        line("T20, s", |b| format!("{}", OCTAVES_HZ[b])),
        times("asked for", &wanted),
        times("of the materials", &before),
        times("fitted", &matched.t20_s),
        line("absorption exponents times", |b| format!("{:.3}", matched.factors[b])),
    ];
    report::markdown_or(&args.markdown, |markdown| report::table(&rows, markdown))?;
    for missed in &matched.missed {
        report::note(missed);
    }
    let Some(output) = output else { return Ok(()) };
    let made = format!("fit of materials to reverberation times, promenade {}", env!("CARGO_PKG_VERSION"));
    let fitted =
        WALLS.iter().zip(&named.materials).map(|(name, m)| ((*name).to_owned(), described(&factored(m, &matched.factors))));
    let beside = MaterialsBeside { made, materials: fitted.collect(), source: None };
    let files = [
        (output.to_owned(), box_obj(&walls)),
        (output.with_extension("materials.json"), serde_json::to_string_pretty(&beside)? + "\n"),
    ];
    for (path, text) in &files {
        atomic::write(path, text.as_bytes())?;
        report::line(path.display());
    }
    Ok(())
}

fn line(name: &str, of: impl Fn(usize) -> String) -> Vec<String> {
    std::iter::once(name.to_owned()).chain((0..BANDS).map(of)).collect()
}

fn measured(path: &Path) -> Result<Some7> {
    let (channels, rate_hz) = read_measured(path)?;
    let times = measured_t20_s(&channels, rate_hz);
    for (hz, _) in OCTAVES_HZ.iter().zip(times).filter(|(_, t)| t.is_none()) {
        report::note(format_args!("{}: no decay of 25 dB above the noise at {hz} Hz, which stays as it is", path.display()));
    }
    if times.iter().all(Option::is_none) {
        bail!("{}: expected a response that decays by 25 dB above its noise in an octave, found none", path.display());
    }
    Ok(times)
}
