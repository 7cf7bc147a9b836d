//! The parameters that hosts see are the documented ones.

use promenade_tests::{Host, host_id, in_both_formats};
use std::path::Path;

in_both_formats!(
    hosts_list_the_documented_parameters,
    hosts_take_everything_that_an_editor_sets,
    values_can_be_set_and_read,
    the_parts_of_the_sound_have_levels,
);

/// A row of the table in `docs/parameters.md`.
struct Row {
    id: String,
    host_id: u32,
    name: String,
    default: String,
    automatable: bool,
}

fn documented() -> Vec<Row> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/parameters.md");
    let text = std::fs::read_to_string(path).unwrap();
    let cells =
        |line: &str| line.trim_matches('|').split('|').map(|c| c.trim().trim_matches('`').to_owned()).collect::<Vec<_>>();
    let rows = text.lines().filter(|line| line.starts_with("| `")).map(cells);
    rows.map(|c| Row {
        id: c[0].clone(),
        host_id: c[1].parse().unwrap(),
        name: c[2].clone(),
        default: c[4].clone(),
        automatable: c[5] == "yes",
    })
    .collect()
}

fn hosts_list_the_documented_parameters<H: Host>() {
    let knobs = H::open(Default::default()).knobs();
    let rows = documented();
    let listed = |knob: &promenade_tests::Knob| (knob.host_id, knob.name.clone(), knob.default.clone(), knob.automatable);
    let written = |row: &Row| (row.host_id, row.name.clone(), row.default.clone(), row.automatable);
    assert_eq!(knobs.iter().map(listed).collect::<Vec<_>>(), rows.iter().map(written).collect::<Vec<_>>());
    for row in rows {
        assert_eq!(host_id(&row.id), row.host_id, "{}", row.id);
    }
}

/// Ardour's VST3 host leaves out parameters that may not be automated: what an editor sets of them never comes back to the
/// plugin.
fn hosts_take_everything_that_an_editor_sets<H: Host>() {
    let knobs = H::open(Default::default()).knobs();
    let dropped = knobs.iter().filter(|knob| !knob.automatable).map(|knob| knob.name.as_str()).collect::<Vec<_>>();
    assert_eq!(dropped, ["Revision"], "the editor sets these");
}

fn values_can_be_set_and_read<H: Host>() {
    let mut host = H::open(Default::default());
    for row in documented() {
        // Every parameter has a value at either end.
        for value in [1.0, 0.0] {
            host.set(&row.id, value);
            host.process(&[&[0.0; 64], &[0.0; 64]]);
            assert!((host.value(&row.id) - value).abs() < 1e-6, "{} does not take {value}", row.id);
        }
    }
}

fn the_parts_of_the_sound_have_levels<H: Host>() {
    let noise = promenade_testing::noise(1, 9_600);
    let tone: Vec<f32> = (0..9_600_u16).map(|n| (f32::from(n) * 0.0079).sin()).collect();
    // Energy of the second half of a steady sound, with some levels at the ends of their ranges.
    let of = |input: &[f32], settings: &[(&str, f64)]| {
        let mut host = H::open(Default::default());
        settings.iter().for_each(|(id, value)| host.set(id, *value));
        let heard = input.chunks(480).map(|block| host.process(&[block, block])).skip(10);
        heard.flatten().flatten().map(|v| f64::from(v).powi(2)).sum::<f64>()
    };
    let energy = |settings: &[(&str, f64)]| of(&noise, settings);
    let (plain, silent) = (energy(&[]), energy(&[("direct", 0.0), ("early", 0.0), ("late", 0.0)]));
    assert!(plain > 1.0 && silent == 0.0, "{plain} {silent}");
    let louder = 10.0 * (energy(&[("direct", 1.0), ("early", 1.0), ("late", 1.0)]) / plain).log10();
    assert!((louder - 12.0).abs() < 0.1, "{louder} dB");
    let solo = energy(&[("mix", 0.5), ("wetsolo", 1.0), ("early", 0.0), ("late", 0.0)]);
    assert_eq!(solo, 0.0, "neither dry nor direct sound");
    // Three octaves below the corner.
    assert!(of(&tone, &[("lowcut", 1.0)]) < 0.001 * of(&tone, &[]));
}
