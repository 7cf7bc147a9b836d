//! `promenade inspect`: what a scene file holds.

use crate::args::InspectArgs;
use crate::{report, scene};
use anyhow::Result;
use promenade_baker::trade::STANDARD_JNDS;
use promenade_core::glam::Vec3;
use promenade_core::network::CloudKind;
use promenade_core::published::Projection;
use promenade_core::{AnchorCloud, Audible, Facing, Field, FrontPoint, MeasuredRoom, Pose, Scene};
use serde_json::json;
use std::path::PathBuf;
use std::sync::Arc;

pub(crate) fn run(args: &InspectArgs) -> Result<()> {
    let [file] = &args.scenes[..] else { return list(args) };
    let scene = scene::read(file)?;
    report::json_or(&args.json, &as_json(&scene), || as_text(&scene))
}

/// A line for each scene, with how far up its data go: what was measured at 16 kHz has no more treble than that.
fn list(args: &InspectArgs) -> Result<()> {
    let scenes = args.scenes.iter().map(|file| Ok(scene::read(file)?)).collect::<Result<Vec<_>>>()?;
    let all = scenes.iter().map(|scene| as_json(scene)).collect::<Vec<_>>();
    let head = ["file", "data at", "known to", "decay", "title"].map(str::to_owned).to_vec();
    let row = |(file, scene): (&PathBuf, &Arc<Scene>)| {
        vec![
            report::file_name(file),
            format!("{} kHz", scene.grid().sample_rate_hz / 1e3),
            format!("{:.1} kHz", scene.top_hz() / 1e3),
            format!("{:.2} s", scene.tail().longest_t60_s()),
            scene.title().to_owned(),
        ]
    };
    let rows = std::iter::once(head).chain(args.scenes.iter().zip(&scenes).map(row)).collect::<Vec<_>>();
    report::json_or(&args.json, &json!(all), || report::table(&rows, false))
}

fn ypr_deg(pose: &Pose) -> [f32; 3] {
    let (yaw, pitch, roll) = pose.ypr();
    [yaw, pitch, roll].map(f32::to_degrees)
}

fn cloud_json(cloud: &AnchorCloud) -> serde_json::Value {
    let (sizes, parts) = (cloud.model.sizes(), cloud.model.parts());
    json!({
        "kind": parts.kind.name(),
        "anchors": sizes.anchors,
        "bands": sizes.bands,
        "width": sizes.width,
        "layers": sizes.layers,
        "heads": parts.heads,
        "frames": sizes.frames,
        "hyper_network": sizes.hyper > 0,
        "conv": cloud.conv.name(),
        "projection": projection(cloud.projection),
        "convention": parts.convention.name(),
        "max_norm": parts.max_norm,
        "metres_per_unit": parts.placement.units_per_metre.recip(),
        "memory_bytes": cloud.model.memory_bytes(),
    })
}

fn cloud_text(cloud: &AnchorCloud) -> String {
    let (sizes, parts) = (cloud.model.sizes(), cloud.model.parts());
    let filter = match (parts.kind, sizes.frames, sizes.hyper) {
        (CloudKind::Taps, ..) if sizes.tap_shapes > 0 => {
            return format!(
                "taps, {} anchors, {} bands, width {}, {} layers, {} tap shapes of {} hops",
                sizes.anchors, sizes.bands, sizes.width, sizes.layers, sizes.tap_shapes, sizes.tap_hops
            );
        }
        (_, 0, _) => "no time filter".to_owned(),
        (CloudKind::Full, t, 0) => format!("one time filter over {t} frames"),
        (_, t, _) => format!("time filters over {t} frames"),
    };
    format!(
        "{}, {} anchors, {} bands, width {}, {filter}, conv {}, taps {}",
        parts.kind.name(),
        sizes.anchors,
        sizes.bands,
        sizes.width,
        cloud.conv.name(),
        projection(cloud.projection)
    )
}

/// As the option of the import writes it.
pub(crate) fn projection(projection: Projection) -> String {
    match projection {
        Projection::Diagonal => "diagonal".to_owned(),
        Projection::Row(row) => format!("row={row}"),
    }
}

fn responses_text(measured: &MeasuredRoom, scene: &Scene) -> String {
    let seconds = scene.grid().hop_s() * measured.low_hops as f64;
    format!("{}, each {seconds:.2} s long", measured.count(scene.bands()))
}

fn field_text(field: &Field) -> String {
    let counts: Vec<String> = field.grid().axes().iter().map(|a| a.count().to_string()).collect();
    let by = match field.grid().facing {
        Facing::Emitter { .. } => "z, y, x, emitter elevation and azimuth",
        Facing::Head { .. } => "z, y, x, yaw, pitch and roll",
    };
    format!("{} nodes along {by}, {} kB", counts.join(" x "), field.memory_bytes().div_ceil(1000))
}

fn as_json(scene: &Scene) -> serde_json::Value {
    let point_of = |p: &FrontPoint| json!({ "jnd": p.error.jnds, "measure": p.error.measure.name(), "operations": p.cost });
    let provenance = scene.provenance();
    let grid = scene.grid();
    let (low, high) = scene.bounds();
    let point = |v: Vec3| v.to_array();
    json!({
        "title": provenance.title,
        "credit": provenance.credit,
        "licence": provenance.licence,
        "recipe": provenance.recipe,
        "notes": provenance.notes,
        "sample_rate_hz": grid.sample_rate_hz,
        "n_fft": grid.n_fft,
        "hop": grid.hop,
        "bands": scene.bands().count(),
        "top_hz": scene.top_hz(),
        "longest_decay_s": scene.tail().longest_t60_s(),
        "emitter_m": scene.emitter().map(point),
        "start_pose": { "position_m": point(scene.start_pose().position), "ypr_deg": ypr_deg(&scene.start_pose()) },
        "bounds_m": [point(low), point(high)],
        "cloud": scene.cloud().map(cloud_json),
        "field": scene.field().map(|f| json!({
            "nodes": f.grid().axes().iter().map(|a| a.count()).collect::<Vec<_>>(),
            "memory_bytes": f.memory_bytes(),
        })),
        "anchors": scene.anchors().len(),
        "held_out": scene.held_out().iter().map(|h| h.name.as_str()).collect::<Vec<_>>(),
        "memory_bytes": scene.memory_bytes(),
        "front": scene.parts().front.iter().map(point_of).collect::<Vec<_>>(),
    })
}

fn as_text(scene: &Scene) -> String {
    let provenance = scene.provenance();
    let grid = scene.grid();
    let (low, high) = scene.bounds();
    let start = scene.start_pose();
    let point = |v: Vec3| format!("{:.2}, {:.2}, {:.2} m", v.x, v.y, v.z);
    let angles = ypr_deg(&start).map(|a| format!("{a:.1}")).join(", ");
    let window_ms = 1e3 * grid.n_fft as f64 / grid.sample_rate_hz;
    let rows = [
        ("title", provenance.title.clone()),
        ("credit", provenance.credit.clone()),
        ("licence", provenance.licence.clone()),
        ("made by", provenance.recipe.clone()),
        ("grid", format!("{} Hz, window {} ({window_ms:.1} ms), hop {}", grid.sample_rate_hz, grid.n_fft, grid.hop)),
        ("bands", format!("{}, known up to {:.0} Hz", scene.bands().count(), scene.top_hz())),
        ("longest decay", format!("{:.2} s", scene.tail().longest_t60_s())),
        ("emitter", scene.emitter().map_or("not known".to_owned(), point)),
        ("start pose", format!("{}; yaw, pitch, roll {angles} degrees", point(start.position))),
        ("bounds", format!("{} to {}", point(low), point(high))),
        ("cloud", scene.cloud().map_or("none".to_owned(), cloud_text)),
        ("field", scene.field().map_or("none".to_owned(), field_text)),
        (
            "images",
            scene.images().map_or("none".to_owned(), |i| format!("{}, seen from {} places", i.images.len(), i.place_count())),
        ),
        ("responses", scene.measured().map_or("none: noise carries the room".to_owned(), |m| responses_text(m, scene))),
        ("anchors", scene.anchors().len().to_string()),
        ("held out", scene.held_out().len().to_string()),
        ("memory", format!("{} kB", scene.memory_bytes().div_ceil(1000))),
    ];
    let costs = STANDARD_JNDS.iter().filter_map(|jnds| FrontPoint::within(&scene.parts().front, *jnds));
    let cost = |p: &FrontPoint| {
        let Audible { jnds, measure } = p.error;
        format!("{:.0} % of its cost for {jnds:.2} JND by {}", 100.0 * p.cost, measure.name())
    };
    let costs = costs.map(|point| ("accuracy", cost(point)));
    let notes = provenance.notes.iter().map(|note| ("note", note.clone()));
    report::properties(rows.into_iter().chain(costs).chain(notes))
}
