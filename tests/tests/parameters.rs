//! The parameters that hosts see are the documented ones.

use promenade_tests::{Host, host_id, in_both_formats};
use std::path::Path;

in_both_formats!(hosts_list_the_documented_parameters, hosts_take_everything_that_an_editor_sets, values_can_be_set_and_read,);

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

/// Ardour's VST3 host leaves out parameters that may not be automated: what an editor sets of them never comes back to the plugin.
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
