//! Checkpoints of AV-Cloud as `export_avcloud.py` writes them, whole and damaged, through the public interface.
//!
//! The small ones in `checkpoint/` are made by `make_fixtures.py`; the published layout at full width is read from the folder
//! that `PROMENADE_GOLDEN` names, or from `../shared/golden` beside the checkout, where it is at hand.

use promenade_baker::BakeError;
use promenade_baker::checkpoint::{Imported, import};
use promenade_core::network::{CloudKind, PoseConvention, Tensor};
use safetensors::{Dtype, SafeTensors, serialize, tensor::TensorView};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/checkpoint").join(name)
}

fn small(name: &str) -> Imported {
    import(&fixture(name), Some(&fixture("anchors.safetensors")), None).unwrap_or_else(|e| panic!("{name}: {}", text(&e)))
}

/// An error with all its causes.
fn text(error: &BakeError) -> String {
    let mut text = error.to_string();
    let mut cause = std::error::Error::source(error);
    while let Some(c) = cause {
        text += &format!(": {c}");
        cause = c.source();
    }
    text
}

#[track_caller]
fn refused(checkpoint: &Path, anchors: Option<&Path>, says: &[&str]) {
    let found = text(&import(checkpoint, anchors, None).expect_err("taken"));
    for part in says {
        assert!(found.contains(part), "\"{part}\" is not in: {found}");
    }
}

/// The value that make_fixtures.py puts everywhere.
fn value(name: &str, j: usize) -> f32 {
    ((7 * j + name.len()) % 61) as f32 / 64.0 - 30.0 / 64.0
}

fn check_small(name: &str, imported: &Imported, kind: CloudKind) {
    let parts = imported.model.parts();
    assert_eq!(parts.kind, kind, "{name}");
    assert_eq!(
        (parts.anchors.len(), parts.frequencies.centres_hz()),
        (4, &[0.0, 1000.0, 2000.0, 3000.0, 4000.0][..]),
        "{name}"
    );
    for (key, tensor) in parts.weights.iter().filter(|(k, _)| *k != "post_process.kernel") {
        for (j, v) in tensor.values.iter().enumerate() {
            assert_eq!(*v, value(key, j), "{name}: {key}[{j}]");
        }
    }
    for (i, a) in parts.anchors.iter().enumerate() {
        assert_eq!(a.to_array(), [0, 1, 2].map(|axis| value("anchor_xyz", 3 * i + axis)), "{name}: anchor {i}");
    }
    for (j, v) in parts.features.iter().enumerate() {
        assert_eq!(*v, value("rgb_features", j), "{name}: feature {j}");
    }
}

/// A copy of a safetensors file with its arrays changed, or left out, and with this metadata.
fn changed<'a>(
    bytes: &'a [u8],
    to: &Path,
    metadata: Option<HashMap<String, String>>,
    change: impl Fn(&str, TensorView<'a>) -> Option<(String, TensorView<'a>)>,
) {
    let file = SafeTensors::deserialize(bytes).unwrap();
    let views: HashMap<_, _> = file.tensors().into_iter().filter_map(|(name, view)| change(&name, view)).collect();
    std::fs::write(to, serialize(views, metadata).unwrap()).unwrap();
}

#[test]
fn every_layout_gives_the_same_model() {
    let simple = small("simple_sh.safetensors");
    check_small("simple_sh.safetensors", &simple, CloudKind::SimpleSh);
    assert_eq!((simple.grid.sample_rate_hz, simple.grid.n_fft, simple.grid.hop), (8000.0, 8, 2));
    let other = small("formats.safetensors");
    assert_eq!(other.model, simple.model);
    assert!(other.notes.iter().any(|n| n.contains("not of 32-bit floats")));
    assert!(!simple.notes.iter().any(|n| n.contains("not of 32-bit floats")));
    // Training on several devices.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("module.safetensors");
    let bytes = std::fs::read(fixture("simple_sh.safetensors")).unwrap();
    let metadata = SafeTensors::read_metadata(&bytes).unwrap().1.metadata().clone();
    changed(&bytes, &path, metadata, |name, view| Some((format!("module.{name}"), view)));
    assert_eq!(import(&path, Some(&fixture("anchors.safetensors")), None).unwrap().model, simple.model);
}

#[test]
fn every_decoder_has_its_weights() {
    check_small("sh.safetensors", &small("sh.safetensors"), CloudKind::Sh);
    check_small("full.safetensors", &small("full.safetensors"), CloudKind::Full);
    let folder = tempfile::tempdir().unwrap();
    let path = with_metadata(folder.path(), "full.safetensors", "kind", "sh");
    refused(&path, Some(&fixture("anchors.safetensors")), &["'sh' has no place for post_process."]);
}

#[test]
fn a_network_that_learned_stays_and_a_dead_one_becomes_its_kernel() {
    let live = small("full.safetensors");
    assert_eq!((live.model.sizes().frames, live.model.sizes().hyper), (3, 2));
    assert_eq!(live.model.weights("post_process.weight_model.2.weight").len(), 27 * 2);

    let dead = import(&fixture("exported.safetensors"), None, None).unwrap();
    assert_eq!((dead.model.sizes().frames, dead.model.sizes().hyper), (3, 0));
    let kernel = &dead.model.parts().weights["post_process.kernel"];
    assert_eq!(kernel.shape, [9, 3]);
    assert_eq!(kernel.values, live.model.weights("post_process.weight_model.2.bias"));
    assert!(!dead.model.parts().weights.keys().any(|k| k.contains("weight_model")));
    // 2 x 8 and 2 of the first layer, 27 x 2 of the second.
    assert!(dead.notes.iter().any(|n| n.contains("72 of") && n.contains("do nothing")), "{:?}", dead.notes);
    assert!(!live.notes.iter().any(|n| n.contains("do nothing")));
}

#[test]
fn the_exporter_says_all_that_is_needed() {
    let exported = import(&fixture("exported.safetensors"), None, None).unwrap();
    check_small("exported.safetensors", &exported, CloudKind::Full);
    let parts = exported.model.parts();
    assert_eq!((parts.max_norm, parts.heads, parts.convention), (25.0, 1, PoseConvention::Published));
    assert_eq!((exported.grid.sample_rate_hz, exported.grid.n_fft, exported.grid.hop), (8000.0, 8, 2));
    let given = import(&fixture("exported.safetensors"), Some(&fixture("anchors.safetensors")), None).unwrap();
    assert!(given.notes.iter().any(|n| n.contains("not those beside the weights")), "{:?}", given.notes);
}

#[test]
fn what_is_missing_is_said() {
    refused(&fixture("simple_sh.safetensors"), None, &["simple_sh.safetensors: expected the scene's anchors", "neither"]);
    refused(&fixture("anchors.safetensors"), None, &["anchors.safetensors: metadata 'kind'", "found ''"]);
}

#[test]
fn anchors_come_in_several_forms() {
    let model = small("simple_sh.safetensors").model;
    let folder = tempfile::tempdir().unwrap();
    let named = folder.path().join("anchors.safetensors");
    write_anchors(&named, "anchor_xyz", "rgb_features", 4);
    let own = folder.path().join("own.safetensors");
    write_anchors(&own, "anchors.position", "anchors.features", 4);
    for path in [named, own, fixture("exported.safetensors")] {
        let other = import(&fixture("simple_sh.safetensors"), Some(&path), None).unwrap_or_else(|e| panic!("{}", text(&e)));
        assert_eq!(other.model, model, "{}", path.display());
    }
}

/// The first bytes of a safetensors file are a length, which may be those of a pickle (0x80) or an archive ("PK").
#[test]
fn a_length_is_not_taken_for_another_form() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("anchors.safetensors");
    write_anchors(&path, "anchor_xyz", "rgb_features", 4);
    let bytes = std::fs::read(&path).unwrap();
    let (header, data) = bytes[8..].split_at(usize::from(bytes[0]));
    for start in [[0x80, 0x02], *b"PK"] {
        let len = usize::from(u16::from_le_bytes(start));
        let padded = [header, &vec![b' '; len - header.len()]].concat();
        std::fs::write(&path, [&(len as u64).to_le_bytes(), &padded[..], data].concat()).unwrap();
        let imported = import(&fixture("simple_sh.safetensors"), Some(&path), None).unwrap_or_else(|e| panic!("{}", text(&e)));
        assert_eq!(imported.model, small("simple_sh.safetensors").model);
    }
}

#[test]
fn wrong_anchors_are_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("five.safetensors");
    write_anchors(&path, "anchor_xyz", "rgb_features", 5);
    refused(
        &fixture("simple_sh.safetensors"),
        Some(&path),
        &["five.safetensors: anchors: expected 4", "_audio_features_f", "found 5"],
    );
    let path = folder.path().join("colours.safetensors");
    write_arrays(&path, &[("anchor_xyz", &[4, 3], &[0.0; 12]), ("rgb_features", &[4, 3], &[0.0; 12])]);
    let says = ["colours.safetensors: features of an anchor: expected 6", "simple_sh.safetensors", "found 3"];
    refused(&fixture("simple_sh.safetensors"), Some(&path), &says);
    let path = folder.path().join("infinite.safetensors");
    write_arrays(&path, &[("anchor_xyz", &[4, 3], &[f32::NAN; 12]), ("rgb_features", &[4, 6], &[0.0; 24])]);
    refused(&fixture("simple_sh.safetensors"), Some(&path), &["infinite.safetensors", "'anchor_xyz'", "found NaN at 0"]);
    write_arrays(&path, &[("anchor_xyz", &[4, 3], &[0.0; 12]), ("rgb_features", &[4, 6], &[f32::INFINITY; 24])]);
    refused(&fixture("simple_sh.safetensors"), Some(&path), &["infinite.safetensors", "'rgb_features'", "found inf at 0"]);
    let path = folder.path().join("unknown.safetensors");
    write_anchors(&path, "points", "colours", 4);
    refused(&fixture("simple_sh.safetensors"), Some(&path), &["'anchor_xyz'", "'colours', 'points'"]);
    let path = folder.path().join("half.safetensors");
    write_anchors(&path, "anchor_xyz", "colours", 4);
    refused(&fixture("simple_sh.safetensors"), Some(&path), &["'anchor_xyz' only"]);
    let path = folder.path().join("swapped.safetensors");
    write_anchors(&path, "rgb_features", "anchor_xyz", 4);
    refused(&fixture("simple_sh.safetensors"), Some(&path), &["(anchors, 3)", "[4, 6]"]);
    let path = folder.path().join("anchors.pkl");
    std::fs::write(&path, b"\x80\x04\x95").unwrap();
    refused(&fixture("simple_sh.safetensors"), Some(&path), &["anchors.pkl", "pickle", "export_avcloud.py"]);
    refused(&fixture("simple_sh.safetensors"), Some(&fixture("full.safetensors")), &["'_audio_features_f'"]);
    refused(&fixture("simple_sh.safetensors"), Some(&fixture("absent.safetensors")), &["absent.safetensors"]);
}

#[test]
fn colours_in_place_of_harmonics_are_doubted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("colours.safetensors");
    let doubts = |scale: f32, offset: f32| {
        let features: Vec<f32> = (0..4 * 6).map(|j| offset + scale * value("rgb_features", j)).collect();
        write_arrays(&path, &[("anchor_xyz", &[4, 3], &[0.0; 12]), ("rgb_features", &[4, 6], &features)]);
        import(&fixture("simple_sh.safetensors"), Some(&path), None).unwrap().notes
    };
    assert!(doubts(10.0, 0.0).iter().any(|n| n.contains("features lie beyond")));
    assert!(doubts(0.5, 0.5).iter().any(|n| n.contains("all features lie in 0 to 1")));
    assert!(!doubts(1.0, 0.0).iter().any(|n| n.contains("features")));
}

#[test]
fn what_is_no_checkpoint_is_refused() {
    let anchors = fixture("anchors.safetensors");
    let anchors = Some(anchors.as_path());
    let folder = tempfile::tempdir().unwrap();
    let made = |name: &str, arrays: &[(&str, &[usize], &[f32])]| {
        let path = folder.path().join(name);
        write_arrays(&path, arrays);
        path
    };
    let other = made("other.safetensors", &[("conv.weight", &[3], &[1.0; 3])]);
    refused(&other, anchors, &["metadata 'kind': expected full, sh or simple-sh"]);
    refused(&made("empty.safetensors", &[]), anchors, &["expected weights, found none"]);
    let integers = [0; 4];
    let integer = TensorView::new(Dtype::I32, vec![1], &integers).unwrap();
    let path = folder.path().join("integer.safetensors");
    std::fs::write(&path, serialize([("freq_weights", integer)], None).unwrap()).unwrap();
    refused(&path, anchors, &["'freq_weights'", "floats", "I32"]);
    let archive = folder.path().join("100.pth");
    std::fs::write(&archive, b"PK\x03\x04").unwrap();
    refused(&archive, anchors, &["100.pth", "found a file of PyTorch", "export_avcloud.py converts it"]);
    refused(&fixture("make_fixtures.py"), anchors, &["something else"]);
    refused(&fixture(""), anchors, &["a folder"]);
    refused(&fixture("absent.safetensors"), anchors, &["absent.safetensors", "cannot be read"]);

    let nothing = folder.path().join("nothing.safetensors");
    std::fs::write(&nothing, []).unwrap();
    refused(&nothing, anchors, &["an empty file"]);
    // A hole in the disk, so that nothing is written.
    let huge = folder.path().join("huge.safetensors");
    std::fs::File::create(&huge).unwrap().set_len((1 << 30) + 1).unwrap();
    refused(&huge, anchors, &["1073741825 bytes"]);
    refused(&nothing.join("below"), anchors, &["cannot be read"]);
}

#[test]
fn frequencies_of_16_bits_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("halves.safetensors");
    let bytes = std::fs::read(fixture("exported.safetensors")).unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    for name in ["vec_embedder.freqs", "freq_embedder.freqs"] {
        for kind in [Dtype::F16, Dtype::BF16] {
            let halves = vec![0; 2 * file.tensor(name).unwrap().shape().iter().product::<usize>()];
            let copy = |n: &str, view: TensorView<'_>| {
                TensorView::new(kind, view.shape().to_vec(), &halves).map(|v| (n.to_owned(), v))
            };
            let views: HashMap<_, _> =
                file.iter().map(|(n, view)| if n == name { copy(n, view).unwrap() } else { (n.to_owned(), view) }).collect();
            let (_, header) = SafeTensors::read_metadata(&bytes).unwrap();
            std::fs::write(&path, serialize(views, header.metadata().clone()).unwrap()).unwrap();
            refused(&path, None, &[&format!("weights '{name}'"), "32 or 64 bits", "found 16 bits"]);
        }
    }
}

/// A copy of a fixture with another value in its metadata.
fn with_metadata(folder: &Path, name: &str, key: &str, value: &str) -> PathBuf {
    let bytes = std::fs::read(fixture(name)).unwrap();
    let (_, header) = SafeTensors::read_metadata(&bytes).unwrap();
    let mut metadata = header.metadata().clone().unwrap();
    metadata.insert(key.to_owned(), value.to_owned());
    let path = folder.join(name);
    let tensors = SafeTensors::deserialize(&bytes).unwrap().tensors();
    std::fs::write(&path, serialize(tensors, Some(metadata)).unwrap()).unwrap();
    path
}

#[test]
fn settings_that_do_not_fit_are_refused() {
    let anchors = fixture("anchors.safetensors");
    let folder = tempfile::tempdir().unwrap();
    for (key, value, says) in [
        ("n_fft", "512", "257 frequencies, as a transform of 512 samples has, found 5, as one of 8"),
        ("max_norm", "0", "max_norm"),
        ("max_norm", "NaN", "max_norm"),
        ("sample_rate", "inf", "sample rate"),
        ("n_fft", "7", "n_fft"),
        ("n_fft", "18446744073709551615", "n_fft"),
        ("hop", "0", "hop"),
        ("hop", "5", "hop"),
        ("heads", "0", "heads"),
        ("heads", "18446744073709551615", "heads"),
    ] {
        refused(&with_metadata(folder.path(), "simple_sh.safetensors", key, value), Some(&anchors), &[says]);
    }
    refused(&with_metadata(folder.path(), "sh.safetensors", "heads", "4"), Some(&anchors), &["4 heads"]);
}

#[test]
fn metadata_that_makes_no_sense_is_refused() {
    let bytes = std::fs::read(fixture("exported.safetensors")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("changed.safetensors");
    for (from, to, says) in [
        (r#""n_fft":"8""#, r#""n_fft":"x""#, "metadata 'n_fft'"),
        (r#""hop":"2""#, r#""hop":"9""#, "hop"),
        (r#""max_norm":"25.0""#, r#""max_norm":"-2.0""#, "max_norm"),
        (r#""kind":"full""#, r#""kind":"fool""#, "metadata 'kind'"),
        (r#""convention":"published""#, r#""convention":"punished!""#, "metadata 'convention'"),
    ] {
        assert_eq!(from.len(), to.len());
        let at = bytes.windows(from.len()).position(|w| w == from.as_bytes()).unwrap_or_else(|| panic!("{from} is not there"));
        let mut changed = bytes.clone();
        changed[at..at + to.len()].copy_from_slice(to.as_bytes());
        std::fs::write(&path, changed).unwrap();
        refused(&path, None, &[says]);
    }
}

/// Files cut short and with each byte changed: never a panic; and where a checkpoint is taken, its shapes are the right ones.
#[test]
fn damaged_files_are_refused_or_harmless() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged");
    let sound = small("simple_sh.safetensors").model;
    for name in ["simple_sh.safetensors", "exported.safetensors", "anchors.safetensors"] {
        let bytes = std::fs::read(fixture(name)).unwrap();
        let anchors = name.starts_with("anchors");
        let run = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            if anchors {
                import(&fixture("simple_sh.safetensors"), Some(&path), None)
            } else {
                import(&path, Some(&fixture("anchors.safetensors")), None)
            }
        };
        assert!(run(&bytes).is_ok(), "{name}");
        for len in (0..bytes.len()).step_by(61).chain(bytes.len().saturating_sub(40)..bytes.len()) {
            assert!(run(&bytes[..len]).is_err(), "{name} cut to {len} of {} bytes", bytes.len());
        }
        for at in (0..bytes.len()).step_by(37) {
            for flip in [0x01, 0xff] {
                let mut changed = bytes.clone();
                changed[at] ^= flip;
                if let Ok(taken) = run(&changed)
                    && name != "exported.safetensors"
                {
                    assert_eq!(taken.model.sizes(), sound.sizes(), "{name}: byte {at}");
                }
            }
        }
    }
}

#[test]
fn sizes_that_a_file_only_claims_take_no_memory() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("claims");
    let anchors = fixture("anchors.safetensors");
    // A safetensors header of a size that the file does not have.
    for (len, says) in
        [(u64::MAX, "something else"), (1 << 31, "no readable .safetensors"), (1 << 26, "no readable .safetensors")]
    {
        std::fs::write(&path, [len.to_le_bytes().as_slice(), b"{\"a\":0}"].concat()).unwrap();
        refused(&path, Some(&anchors), &[says]);
    }
}

fn floats(file: &SafeTensors<'_>, name: &str) -> Tensor {
    let view = file.tensor(name).unwrap_or_else(|e| panic!("'{name}': {e}"));
    assert_eq!(view.dtype(), Dtype::F32, "{name}");
    let values = view.data().as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    Tensor { shape: view.shape().to_vec(), values }
}

/// Anchors as make_fixtures.py has them, and more of the kind.
fn write_anchors(path: &Path, positions: &str, features: &str, count: usize) {
    let values = |name: &str, n: usize| (0..n).map(|j| value(name, j)).collect::<Vec<_>>();
    let (p, f) = (values("anchor_xyz", 3 * count), values("rgb_features", 6 * count));
    write_arrays(path, &[(positions, &[count, 3], &p), (features, &[count, 6], &f)]);
}

fn write_arrays(path: &Path, arrays: &[(&str, &[usize], &[f32])]) {
    let bytes: Vec<Vec<u8>> = arrays.iter().map(|(_, _, v)| v.iter().flat_map(|x| x.to_le_bytes()).collect()).collect();
    let views = arrays.iter().zip(&bytes).map(|((name, shape, _), b)| {
        let view = TensorView::new(Dtype::F32, shape.to_vec(), b).unwrap();
        ((*name).to_owned(), view)
    });
    std::fs::write(path, serialize(views.collect::<HashMap<_, _>>(), None).unwrap()).unwrap();
}

mod needs_shared {
    use super::*;
    use promenade_testing::shared;

    #[test]
    #[ignore = "needs ../shared"]
    fn published_checkpoints_become_their_models() {
        let folder = shared("golden");
        let bytes = std::fs::read(folder.join("weights_union.safetensors")).unwrap();
        let union = SafeTensors::deserialize(&bytes).unwrap();
        let folder_of_own = tempfile::tempdir().unwrap();
        let of_time = |name: &str| name.contains("time") || name == "_acoustic_features_t";
        let of_decoder = |name: &str| ["decoder.", "query_prj", "freq_embedder"].iter().any(|start| name.starts_with(start));
        for (stem, kind) in [("full", CloudKind::Full), ("sh", CloudKind::Sh), ("simple_sh", CloudKind::SimpleSh)] {
            let checkpoint = folder_of_own.path().join(format!("{stem}.safetensors"));
            let is_own = |name: &str| match kind {
                CloudKind::Full => !of_time(name) && name != "freq_weights",
                CloudKind::Sh => !name.starts_with("post_process.") && name != "freq_weights",
                _ => !name.starts_with("post_process.") && !of_decoder(name),
            };
            let numbers = [("max_norm", "25"), ("sample_rate", "22050"), ("n_fft", "512"), ("hop", "127"), ("heads", "4")];
            let metadata = numbers.into_iter().chain([("kind", kind.name()), ("convention", "published")]);
            let metadata = metadata.map(|(key, value)| (key.to_owned(), value.to_owned())).collect();
            changed(&bytes, &checkpoint, Some(metadata), |name, view| is_own(name).then(|| (name.to_owned(), view)));
            let golden = folder.join(format!("{stem}.golden.safetensors"));
            let imported = import(&checkpoint, Some(&golden), None).unwrap_or_else(|e| panic!("{}", text(&e)));
            let parts = imported.model.parts();
            assert_eq!((parts.kind, parts.heads, parts.anchors.len(), imported.model.sizes().frames), (kind, 4, 32, 40));
            assert_eq!((imported.grid.sample_rate_hz, imported.grid.n_fft, imported.grid.hop), (22_050.0, 512, 127));
            assert!(!imported.notes.iter().any(|n| n.contains("features")), "{:?}", imported.notes);
            let expected: BTreeMap<_, _> = parts.weights.keys().map(|k| (k.clone(), floats(&union, k))).collect();
            assert_eq!(parts.weights, expected, "{stem}");
            // The first layer of the golden network is not zero.
            assert_eq!(imported.model.sizes().hyper, if kind == CloudKind::Full { 32 } else { 0 });
        }
    }
}
