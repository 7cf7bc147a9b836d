//! Conventions of SOFA files (AES69-2022) that real sets use: read, or refused by their name.

use hdf5_pure::{AttrValue, FileBuilder};
use promenade_baker::ambisonic::AmbisonicResponses;
use promenade_baker::{LoadOptions, Responses};
use std::path::Path;

fn text(t: &str) -> AttrValue {
    AttrValue::AsciiString(t.to_owned())
}

/// A file of one source 2 m to the left. The sample `[m][r]..` of `Data.IR` is its own number, in the order of the file.
struct Sofa<'a> {
    convention: &'a str,
    data_type: &'a str,
    shape: &'a [u64],
    /// y of each receiver.
    receivers: &'a [f64],
    receiver_type: &'a str,
    /// Sizes that the file states beside `Data.IR`.
    dimensions: &'a [(&'a str, u64)],
}

impl Sofa<'_> {
    fn write(&self, path: &Path) {
        let mut file = FileBuilder::new();
        for (name, value) in [("SOFAConventions", self.convention), ("DataType", self.data_type), ("Title", "small")] {
            file.set_attr(name, text(value));
        }
        let receivers: Vec<f64> = self.receivers.iter().flat_map(|y| [0.0, *y, 0.0]).collect();
        file.create_dataset("ReceiverPosition")
            .with_f64_data(&receivers)
            .with_shape(&[self.receivers.len() as u64, 3, 1])
            .set_attr("Type", text(self.receiver_type));
        for (name, values) in [("ListenerPosition", [0.0; 3]), ("SourcePosition", [0.0, 2.0, 0.0])] {
            file.create_dataset(name).with_f64_data(&values).with_shape(&[1, 3]).set_attr("Type", text("cartesian"));
        }
        let emitters = if self.shape.len() < 4 { 1_u32 } else { 2 };
        let emitter_positions: Vec<f64> = (0..emitters).flat_map(|e| [f64::from(e), 0.0, 0.0]).collect();
        file.create_dataset("EmitterPosition")
            .with_f64_data(&emitter_positions)
            .with_shape(&[u64::from(emitters), 3, 1])
            .set_attr("Type", text("cartesian"));
        file.create_dataset("Data.SamplingRate").with_f64_data(&[48_000.0]).with_shape(&[1]);
        let count = self.shape.iter().product::<u64>();
        let ir: Vec<f64> = (1..=count).map(|i| i as f64).collect();
        file.create_dataset("Data.IR").with_f64_data(&ir).with_shape(self.shape);
        for (name, size) in self.dimensions {
            file.create_dataset(name).with_f64_data(&vec![0.0; *size as usize]).with_shape(&[*size]);
        }
        file.write(path).unwrap();
    }
}

const EARS: &[f64] = &[0.09, -0.09];
const SRIR: Sofa<'static> = Sofa {
    convention: "SingleRoomSRIR",
    data_type: "FIR",
    shape: &[1, 2, 5],
    receivers: EARS,
    receiver_type: "cartesian",
    dimensions: &[],
};

fn load(sofa: &Sofa<'_>, source: Option<usize>) -> Result<Responses, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("set.sofa");
    sofa.write(&path);
    // The samples that count up are no ears.
    Responses::load(&path, &LoadOptions { source, ..LoadOptions::default() }).map_err(|e| e.to_string())
}

#[test]
fn emitters_come_after_the_samples_in_fir_e_and_before_them_in_fire() {
    let mimo = Sofa { convention: "SingleRoomMIMOSRIR", data_type: "FIR-E", shape: &[1, 2, 5, 2], ..SRIR };
    assert!(load(&mimo, None).unwrap_err().contains("one of its 2 emitters"), "one must be chosen");
    let set = load(&mimo, Some(1)).unwrap();
    assert_eq!(set.responses[0].left, [2.0, 4.0, 6.0, 8.0, 10.0]);
    assert_eq!(set.responses[0].right, [12.0, 14.0, 16.0, 18.0, 20.0]);
    assert_eq!(set.responses[0].source.to_array(), [1.0, 2.0, 0.0]);
    let speakers = Sofa { convention: "MultiSpeakerBRIR", data_type: "FIRE", shape: &[1, 2, 2, 5], ..SRIR };
    let set = load(&speakers, Some(1)).unwrap();
    assert_eq!(set.responses[0].left, [6.0, 7.0, 8.0, 9.0, 10.0]);
    let agreed = Sofa { dimensions: &[("N", 5), ("E", 2), ("R", 2)], ..mimo };
    assert!(load(&agreed, Some(0)).is_ok());
    let exchanged = Sofa { dimensions: &[("N", 2), ("E", 5), ("R", 2)], ..agreed };
    let error = load(&exchanged, Some(0)).unwrap_err();
    assert!(
        error.contains("set.sofa: Data.IR: expected the axes MRNE of FIR-E with E = 5") && error.contains("[1, 2, 5, 2]"),
        "{error}"
    );
}

#[test]
fn what_is_no_pair_of_ears_is_refused_by_its_convention() {
    assert_eq!(load(&SRIR, None).unwrap().responses[0].left, [1.0, 2.0, 3.0, 4.0, 5.0]);
    for (sofa, clue) in [
        (
            Sofa { convention: "SimpleFreeFieldHRSOS", data_type: "SOS", ..SRIR },
            "DataType: expected impulse responses, FIR, FIRE or FIR-E, found \"SOS\" (a file of the convention \
             SimpleFreeFieldHRSOS)",
        ),
        (
            Sofa { convention: "SimpleFreeFieldHRTF", data_type: "TF", ..SRIR },
            "found \"TF\" (a file of the convention SimpleFreeFieldHRTF)",
        ),
        (Sofa { convention: "SimpleHeadphoneIR", ..SRIR }, "found 2 (a file of the convention SimpleHeadphoneIR)"),
        (
            Sofa { shape: &[1, 7, 5], receivers: &[0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6], ..SRIR },
            "expected 2 receivers, the ears of a listener (promenade responses ambisonic makes them of Ambisonic ones), found \
             7",
        ),
        (Sofa { receivers: &[0.5, -0.5], ..SRIR }, "ReceiverPosition: expected 2 receivers at the ears, one on either side"),
        (
            Sofa { receivers: &[0.09, 0.05], ..SRIR },
            "within 0.2 m, found [0, 0.09, 0] and [0, 0.05, 0] (a file of the convention",
        ),
        (Sofa { shape: &[1, 2, 2, 5], ..SRIR }, "Data.IR: expected the 3 axes MRN of FIR, found [1, 2, 2, 5]"),
    ] {
        let error = load(&sofa, None).unwrap_err();
        assert!(error.contains("set.sofa: ") && error.contains(clue), "{error}");
    }
}

#[test]
fn capsules_are_no_ambisonic_channels() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("set.sofa");
    let ambisonic = |sofa: &Sofa<'_>| {
        sofa.write(&path);
        AmbisonicResponses::load(&path, &LoadOptions::default(), None, None).map_err(|e| e.to_string())
    };
    let capsules = Sofa { shape: &[1, 4, 5], receivers: &[0.1, 0.2, 0.3, 0.4], ..SRIR };
    let error = ambisonic(&capsules).unwrap_err();
    let says = "ReceiverPosition: expected Ambisonic channels, of the type spherical harmonics, found capsules in different \
        places \
                (a file of the convention SingleRoomSRIR)";
    assert!(error.contains(says), "{error}");
    for sofa in [Sofa { receiver_type: "spherical harmonics", ..capsules }, Sofa { receivers: &[0.0; 4], ..capsules }] {
        let set = ambisonic(&sofa).unwrap();
        assert_eq!(set.responses[0].channels[3], [16.0, 17.0, 18.0, 19.0, 20.0]);
        assert_eq!(set.responses[0].source.unwrap().to_array(), [0.0, 2.0, 0.0]);
    }
}
