//! `promenade host`: a WAV file through a plugin, as a host renders it.

mod tracks;

use crate::args::HostArgs;
use crate::report;
use anyhow::{Context, Result};
use promenade_baker::wav::{Format, WavWriter};
use promenade_baker::{atomic, file};
use promenade_host::{AutomationFile, Bounce, Bundle, Instance, MAX_AUTOMATION_BYTES, PluginInfo, Preset, RemotePage, Setup};
use promenade_player::Source;
use std::path::Path;
use std::time::Instant;
use tracks::Tracks;

/// Sample rate at which a plugin is listed, hertz.
const USUAL_RATE: u32 = 48_000;

pub(crate) fn run(args: &HostArgs) -> Result<()> {
    for path in args.state.iter().chain(&args.automation).chain(&args.tracks) {
        file::check(path).with_context(|| format!("{}: cannot be read", path.display()))?;
    }
    let bundle = Bundle::load(&args.bundle)?;
    match (&args.input, args.output.as_ref().or(args.named.as_ref())) {
        (Some(input), Some(output)) => render(args, &bundle, input, output),
        _ if args.presets => list_presets(args, &bundle),
        _ => list(args, &bundle),
    }
}

/// The plugin that is meant.
fn chosen<'a>(args: &HostArgs, bundle: &'a Bundle) -> Result<&'a PluginInfo> {
    Ok(match &args.plugin {
        Some(wanted) => bundle.find(wanted)?,
        None => &bundle.plugins()[0],
    })
}

/// Opens the plugin, with its state and values as they are to be at the start.
fn opened(args: &HostArgs, bundle: &Bundle, rate_hz: u32, inputs: usize) -> Result<Instance> {
    let plugin = chosen(args, bundle)?;
    let setup = Setup {
        rate: f64::from(rate_hz),
        block: args.block as usize,
        inputs,
        further: args.tracks.len(),
        outputs: args.outputs.into(),
        // Bounces are of all of a scene.
        offline: !args.realtime && args.within.is_none(),
        ..Setup::default()
    };
    let mut instance = bundle.open_plugin(plugin, setup).with_context(|| format!("{}", args.bundle.display()))?;
    if let Some(state) = &args.state {
        instance.load_file(state).with_context(|| format!("{}", state.display()))?;
    }
    if let Some(name) = &args.preset {
        instance.load_preset(&bundle.preset(plugin, name)?).with_context(|| format!("preset {name:?}"))?;
    }
    let within = args.within.as_ref().map(|jnds| ("Accuracy".to_owned(), format!("{jnds} JND")));
    for (name, value) in args.settings.iter().chain(&within) {
        let id = instance.parameter(name)?.id;
        let normalized = instance.from_text(id, value)?;
        instance.set_at(id, normalized, 0)?;
    }
    instance.settle()?;
    Ok(instance)
}

fn list(args: &HostArgs, bundle: &Bundle) -> Result<()> {
    let rate_hz = args.rate.unwrap_or(USUAL_RATE);
    // Some plugins have no stereo input.
    let mut instance = opened(args, bundle, rate_hz, 2).or_else(|_| opened(args, bundle, rate_hz, 1))?;
    let (output, further) = (instance.main_output(), instance.further_inputs());
    let latency = instance.latency()?;
    let info = instance.info();
    let version = if info.version.is_empty() { "without a version" } else { &info.version };
    let vendor = if info.vendor.is_empty() { "nobody named" } else { &info.vendor };
    let latency_ms = 1e3 * latency as f64 / f64::from(rate_hz);
    let mut text = format!("{} {version} ({}), by {vendor}\nid {}\n", info.name, bundle.format(), info.id);
    text += &format!("output of {} channels: {output}\n", args.outputs);
    match further {
        0 => {}
        1 => text += "an input after the main one, for --track\n",
        _ => text += &format!("{further} inputs after the main one, for --track\n"),
    }
    text += &format!("latency {latency} samples at {rate_hz} Hz, {latency_ms:.2} ms\n");
    for other in bundle.plugins().iter().filter(|other| *other != info) {
        text += &format!("also in it: {} ({})\n", other.name, other.id);
    }
    let head = ["parameter", "number", "default", "now", "steps", "automatable", "module"].map(str::to_owned).to_vec();
    let mut rows = vec![head];
    for parameter in instance.parameters().to_vec() {
        let now = instance.value(parameter.id).and_then(|value| instance.text(parameter.id, value));
        let steps = if parameter.steps == 0 { "-".to_owned() } else { parameter.steps.to_string() };
        let automatable = if parameter.automatable { "yes" } else { "no" };
        let (id, now) = (parameter.id.to_string(), now.unwrap_or_default());
        rows.push(vec![parameter.name, id, parameter.default_text, now, steps, automatable.to_owned(), parameter.module]);
    }
    text.push('\n');
    text += &report::table(&rows, false);
    for RemotePage { section, name, parameters } in instance.remote_pages() {
        let named = |id: u32| instance.parameters().iter().find(|p| p.id == id).map_or("?", |p| p.name.as_str());
        let knobs = parameters.map(|knob| knob.map_or("-", named)).join(", ");
        text += &format!("\npage {section} / {name}: {knobs}\n");
    }
    report::print(&text)
}

fn list_presets(args: &HostArgs, bundle: &Bundle) -> Result<()> {
    let plugin = chosen(args, bundle)?;
    let (presets, wrong) = bundle.presets(plugin)?;
    let mut text = format!("{} ({}): {} presets\n", plugin.name, bundle.format(), presets.len());
    let mut shown = None;
    for Preset { name, folder, features, description, .. } in presets {
        if shown.as_ref() != Some(&folder) {
            text += &format!("\n{folder}\n");
            shown = Some(folder);
        }
        let features = if features.is_empty() { String::new() } else { format!(" ({})", features.join(", ")) };
        let description = if description.is_empty() { String::new() } else { format!(": {description}") };
        text += &format!("  {name}{features}{description}\n");
    }
    report::print(&text)?;
    for words in wrong {
        report::note(format_args!("{words}"));
    }
    Ok(())
}

fn render(args: &HostArgs, bundle: &Bundle, input: &Path, output: &Path) -> Result<()> {
    let began = Instant::now();
    let main = Source::open(input, args.rate)?;
    let rate_hz = main.sample_rate_hz();
    let rate = f64::from(rate_hz);
    let mut instance = opened(args, bundle, rate_hz, main.channels())?;
    let mut tracks = Tracks::open(main, &args.tracks)?;
    let lanes = match &args.automation {
        Some(path) => {
            let bytes =
                file::read(path, MAX_AUTOMATION_BYTES).with_context(|| format!("{}: cannot be read", path.display()))?;
            AutomationFile::read(path, &bytes)?.lanes(&mut instance)?
        }
        None => Vec::new(),
    };
    if let Some(path) = &args.save_state {
        atomic::write(path, &instance.save()?)?;
    }
    let mut writer = WavWriter::create(output, rate_hz, args.outputs, Format::Float32)?;
    let tail = (args.tail * rate).round() as usize;
    let mut bounce = Bounce::new(&mut instance, &lanes)?;
    let whole = tracks.frames() + tail + bounce.latency();
    let bar = report::Bar::new("rendering", whole as f64 / rate);
    let block = args.block as usize;
    let mut wet = vec![Vec::with_capacity(block); args.outputs.into()];
    for position in (0..whole).step_by(block) {
        let dry = tracks.next(block.min(whole - position))?;
        wet.iter_mut().for_each(Vec::clear);
        bounce.play(&dry, &mut wet)?;
        writer.write(&wet.iter().map(Vec::as_slice).collect::<Vec<_>>())?;
        bar.at(position as f64 / rate);
    }
    let latency = bounce.latency();
    let changed = bounce.finish()?;
    let written = writer.finish()?;
    drop(bar);
    report::done(output, written.frames, rate, began);
    if let Some(now) = changed {
        report::note(format_args!(
            "the plugin's latency changed from {latency} to {now} samples; the output after that is late or early by the \
             difference"
        ));
    }
    Ok(())
}
