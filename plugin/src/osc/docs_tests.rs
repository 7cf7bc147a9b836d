//! `docs/osc.md`, `docs/parameters.md` and `docs/head-tracking.md` say what the code does.

use super::address::KEYWORDS;
use crate::export::clap::parameter_id;
use crate::parameter::{Parameter, choices::Variants, row::Row};
use crate::project::{osc_config::OscConfig, params::PromenadeParams};
use crate::tracker::reading::{Argument, FARTHEST_M, Unit};
use crate::tracker::{axes::AxisMap, custom::CustomArguments, format::TrackerFormat};

fn document(name: &str) -> String {
    std::fs::read_to_string(format!("{}/../docs/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

/// Fails with all lines that a document should have.
fn check(name: &str, lines: &[String]) {
    let text = document(name);
    let missing = lines.iter().filter(|line| !text.lines().any(|found| found == *line)).collect::<Vec<_>>();
    assert!(missing.is_empty(), "docs/{name} lacks {missing:#?}; it should have\n{}", lines.join("\n"));
}

/// What each of the tracker's three values is, positive: one of a pair per axis of the head.
fn along(map: AxisMap, pairs: [[&str; 2]; 3]) -> String {
    let of = |value: u8| {
        let axis = map.order.iter().position(|from| *from == value).expect("every value is used");
        pairs[axis][usize::from(map.invert[axis])]
    };
    [of(0), of(1), of(2)].join(", ")
}

const AXES: [[&str; 2]; 3] = [["forward", "backward"], ["left", "right"], ["up", "down"]];
const TURNS: [[&str; 2]; 3] = [["yaw left", "yaw right"], ["pitch up", "pitch down"], ["roll right", "roll left"]];

fn described(argument: Argument) -> String {
    let unit = |unit| match unit {
        Unit::Degrees => "degrees",
        Unit::Radians => "radians",
        Unit::Turns => "0 to 1, 0.5 ahead",
    };
    match argument {
        Argument::Skip(count) => format!("{count} values that do not count"),
        Argument::Word => "a word".to_owned(),
        Argument::Position(map) => format!("{}; metres", along(map, AXES)),
        Argument::Quaternion(map) => format!("w, {}", along(map, AXES)),
        Argument::QuaternionLast(map) => format!("{}, w", along(map, AXES)),
        Argument::RotationVector(map) => format!("{}, w or nothing", along(map, AXES)),
        Argument::Angles(of, map) => format!("{}; {}", along(map, TURNS), unit(of)),
        Argument::Angle(of, axis, inverted) => {
            format!("{}; {}", TURNS[usize::from(axis)][usize::from(inverted)], unit(of))
        }
    }
}

#[test]
fn the_addresses_of_all_formats_are_documented() {
    let mut lines = Vec::new();
    for format in TrackerFormat::ALL {
        for form in format.forms() {
            let arguments = form.arguments.iter().map(|argument| described(*argument)).collect::<Vec<_>>().join("; ");
            lines.push(format!("| {} | {} | `{}` | {arguments} |", format.title(), format.port(), form.address));
        }
    }
    for arguments in CustomArguments::ALL {
        let what = arguments.arguments().iter().map(|argument| described(*argument)).collect::<Vec<_>>().join("; ");
        lines.push(format!("| {} | {what} |", arguments.title()));
    }
    check("osc.md", &lines);
}

#[test]
fn the_addresses_of_all_parameters_are_documented() {
    let text = document("parameters.md");
    let params = PromenadeParams::default();
    let rows = Parameter::ALL.map(|parameter| {
        let (Row { id, name, default, .. }, (least, most)) = (parameter.row(), parameter.limits());
        let scale = if parameter.is_share() { 100.0 } else { 1.0 };
        let values = match parameter.variants() {
            Some(Variants { ids, names, .. }) => {
                ids.iter().zip(names).map(|(id, name)| format!("`{id}` {name}")).collect::<Vec<_>>().join(", ")
            }
            None if parameter.is_switch() => "Off, On".to_owned(),
            None => format!("{} to {} {}", least * scale, most * scale, parameter.unit()).trim_end().to_owned(),
        };
        let default = params.of(parameter).text(parameter.normalized(*default));
        format!("| `{id}` | {} | {name} | {values} | {default} | yes | ", parameter_id(parameter))
    });
    let missing = rows.iter().filter(|row| !text.lines().any(|line| line.starts_with(*row))).collect::<Vec<_>>();
    assert!(missing.is_empty(), "docs/parameters.md lacks {missing:#?}, each with what it does behind it");
}

#[test]
fn our_own_addresses_and_limits_are_documented() {
    let text = document("osc.md");
    for keyword in KEYWORDS {
        assert!(text.contains(&format!("| `/promenade/{keyword}")), "{keyword}");
    }
    for words in [
        format!("port {}", OscConfig::default().port),
        format!("port {}", OscConfig::default().out.port),
        format!("{FARTHEST_M} m"),
    ] {
        assert!(text.contains(&words), "{words}");
    }
}

#[test]
fn every_format_has_a_way_to_set_it_up() {
    let text = document("head-tracking.md");
    for format in TrackerFormat::ALL {
        assert!(text.contains(&format!("**{}**", format.title())), "{}", format.title());
    }
}
