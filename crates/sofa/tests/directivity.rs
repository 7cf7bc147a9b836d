//! How much sources send in each direction, from files.

use promenade_core::glam::Vec3;
use promenade_sofa::{Directions, read_directivity};
use promenade_testing::heads::write_directivity;

fn read(convention: &str, sizes: [u64; 2], view: [f64; 3]) -> Result<Directions, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("talker.sofa");
    write_directivity(&path, convention, sizes, view);
    read_directivity(&path).map_err(|error| error.to_string())
}

#[test]
fn directions_are_those_that_the_source_sees() {
    let found = read("FreeFieldDirectivityTF", [2, 12], [0.0, 1.0, 0.0]).unwrap();
    assert_eq!(found.frequencies_hz, [1000.0, 2000.0]);
    for (at, energies) in &found.directions {
        let sent = f64::from(1.0 + at.normalize().dot(Vec3::X));
        assert!((energies[0] - 2.0 * sent * sent).abs() < 1e-4 && (energies[1] - 0.5 * sent * sent).abs() < 1e-4, "{at}");
    }
}

#[test]
fn what_is_no_directivity_is_refused_by_name() {
    for (convention, sizes, view, clue) in [
        ("SimpleFreeFieldHRTF", [2, 12], [0.0, 1.0, 0.0], "SimpleFreeFieldHRTF"),
        ("FreeFieldDirectivityTF", [0, 12], [0.0, 1.0, 0.0], "Data.Real"),
        ("FreeFieldDirectivityTF", [2, 6], [0.0, 1.0, 0.0], "ReceiverPosition"),
        ("FreeFieldDirectivityTF", [2, 12], [0.0, 0.0, 1.0], "SourceUp"),
    ] {
        let said = read(convention, sizes, view).unwrap_err();
        assert!(said.contains(clue) && said.contains("talker.sofa"), "{said}");
    }
}
