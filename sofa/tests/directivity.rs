//! How much sources send in each direction, from files.

use hdf5_pure::{AttrValue, FileBuilder};
use promenade_core::glam::Vec3;
use promenade_sofa::{Directions, read_directivity};

/// A source that looks along y and sends `1 + cos` of the angle to that at 1 kHz, half of it at 2 kHz; twice in the file.
fn read(convention: &str, receivers: u64, view: [f64; 3]) -> Result<Directions, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("talker.sofa");
    let mut file = FileBuilder::new();
    let text = |t: &str| AttrValue::AsciiString(t.to_owned());
    for (name, value) in [("SOFAConventions", convention), ("DataType", "TF")] {
        file.set_attr(name, text(value));
    }
    file.create_dataset("N").with_f64_data(&[1000.0, 2000.0]).with_shape(&[2]);
    let around: Vec<[f64; 3]> = (0..12).map(|i| [30.0 * f64::from(i), 0.0, 2.0]).collect();
    let positions = file.create_dataset("ReceiverPosition");
    positions
        .with_f64_data(around[..receivers as usize].as_flattened())
        .with_shape(&[receivers, 3, 1])
        .set_attr("Type", text("spherical"));
    for (name, at) in [("ListenerPosition", [0.0; 3]), ("SourcePosition", [0.0; 3]), ("SourceView", view)] {
        file.create_dataset(name).with_f64_data(&at).with_shape(&[1, 3]).set_attr("Type", text("cartesian"));
    }
    let sent = |azimuth: f64| 1.0 + (azimuth - 90.0).to_radians().cos();
    let values: Vec<f64> = (0..2).flat_map(|_| around.iter().flat_map(|at| [sent(at[0]), 0.5 * sent(at[0])])).collect();
    for name in ["Data.Real", "Data.Imag"] {
        file.create_dataset(name).with_f64_data(&values).with_shape(&[2, 12, 2]);
    }
    file.write(&path).unwrap();
    read_directivity(&path).map_err(|error| error.to_string())
}

#[test]
fn directions_are_those_that_the_source_sees() {
    let found = read("FreeFieldDirectivityTF", 12, [0.0, 1.0, 0.0]).unwrap();
    assert_eq!(found.frequencies_hz, [1000.0, 2000.0]);
    for (at, energies) in &found.directions {
        let sent = f64::from(1.0 + at.normalize().dot(Vec3::X));
        assert!((energies[0] - 2.0 * sent * sent).abs() < 1e-4 && (energies[1] - 0.5 * sent * sent).abs() < 1e-4, "{at}");
    }
}

#[test]
fn what_is_no_directivity_is_refused_by_name() {
    for (convention, receivers, view, clue) in [
        ("SimpleFreeFieldHRTF", 12, [0.0, 1.0, 0.0], "SimpleFreeFieldHRTF"),
        ("FreeFieldDirectivityTF", 6, [0.0, 1.0, 0.0], "ReceiverPosition"),
        ("FreeFieldDirectivityTF", 12, [0.0, 0.0, 1.0], "SourceUp"),
    ] {
        let said = read(convention, receivers, view).unwrap_err();
        assert!(said.contains(clue) && said.contains("talker.sofa"), "{said}");
    }
}
