use super::*;

pub(crate) fn parameter(id: u32, name: &str) -> Parameter {
    Parameter {
        id,
        name: name.to_owned(),
        unit: String::new(),
        default: 0.0,
        default_text: String::new(),
        steps: 0,
        automatable: true,
        module: String::new(),
        periodic: false,
        least: -60.0,
        greatest: 12.0,
    }
}

#[test]
fn found_by_name_and_then_by_number() {
    let all = [parameter(7, "Gain"), parameter(8, "7"), parameter(9, "Band"), parameter(10, "Band")];
    let id = |wanted| find(&all, wanted, "Plugin").map(|p| p.id);
    assert_eq!((id("Gain").unwrap(), id("7").unwrap(), id("10").unwrap()), (7, 8, 10));
    let said = |wanted| id(wanted).unwrap_err().to_string();
    assert!(said("gain").contains("did you mean \"Gain\"?"), "{}", said("gain"));
    assert!(said("Band").contains("by number 9 and 10"), "{}", said("Band"));
    assert!(said("11").contains("4 parameters"), "{}", said("11"));
}

#[test]
fn values_go_there_and_back() {
    let gain = parameter(1, "Gain");
    assert_eq!((gain.plain(0.5), gain.normalized(-24.0)), (-24.0, 0.5));
    assert_eq!(Parameter { greatest: -60.0, ..gain.clone() }.normalized(5.0), 0.0);
    let mode = Parameter { least: 0.0, greatest: 3.0, steps: 3, ..gain };
    assert_eq!(mode.plain(0.4), 1.0);
}

#[test]
fn units_follow_numbers() {
    assert_eq!(["0.00 deg", "-inf dB", "440Hz", "Standard", "1,5", "0.0 %"].map(unit_of), ["deg", "", "Hz", "", "", "%"]);
}
