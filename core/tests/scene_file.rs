//! Scene files, whole and damaged.

use promenade_core::glam::{Mat3, Vec3};
use promenade_core::head::HEAD_BANDS;
use promenade_core::{
    Axis, Bands, Emission, Facing, Field, FieldGrid, Lifted, MeasuredHead, MeasuredRoom, Pose, Provenance, Rows, Scene,
    SceneCard, SceneError, SceneParts, Site, StftGrid, TailModel, TransferShape,
};
use promenade_testing::noise;
use promenade_testing::scenes::{room, room_with_images};
use safetensors::tensor::{Dtype, TensorView};

/// A scene of a few kilobytes.
fn small() -> SceneParts {
    let grid = StftGrid { sample_rate_hz: 8_000.0, n_fft: 32, hop: 8 };
    let bands = Bands::new(vec![0.0, 1_000.0, 4_000.0]).unwrap();
    let shape = TransferShape { bins: grid.bins(), bands: 3, taps: 4 };
    let nodes = FieldGrid {
        position: [Axis::single(0.0), Axis::single(0.0), Axis::single(0.0)],
        facing: Facing::Emitter { position: Vec3::X, elevation: Axis::single(0.0), azimuth: Axis::circle(0.0, 2) },
    };
    let direct = TransferShape { taps: 0, ..shape };
    let rows = vec![0.25; nodes.nodes() * direct.row_len()];
    let measured = MeasuredRoom {
        sites: vec![
            Site { direction: Vec3::X, position: Vec3::ZERO, response: 1 },
            Site { direction: Vec3::Y, position: Vec3::ONE, response: 0 },
            Site { direction: Vec3::NEG_X, position: Vec3::ZERO, response: 1 },
        ],
        samples: noise(3, 2 * 2 * 5 * grid.hop),
        low: noise(4, 2 * 2 * MeasuredRoom::low_len(6, &grid, 5)),
        low_step: 5,
        low_hops: 6,
        late: vec![0.1; 2 * shape.tap_len()],
        late_before: vec![0.5; 2 * shape.tap_len()],
        gains: vec![1.0; shape.tap_len()],
        lifted: None,
    };
    SceneParts {
        provenance: Provenance { title: "Small \"room\"".into(), notes: vec!["a note".into()], ..Provenance::default() },
        taps: 4,
        measured: Some(measured),
        measured_head: Some(MeasuredHead {
            name: "A head".into(),
            around_db: std::array::from_fn(|band| band as f32),
            diffuse_db: [[0.5; HEAD_BANDS], [-0.5; HEAD_BANDS]],
        }),
        field: Field::new(nodes, direct, Rows::Whole(rows)),
        bounds: (Vec3::ZERO, Vec3::ONE),
        top_hz: 3_500.0,
        start_pose: Pose::from_ypr(Vec3::ONE, 1.0, 0.5, -0.25),
        ..SceneParts::new(
            grid,
            bands,
            TailModel { seed: u64::MAX, t60_s: vec![0.5; 3], coherence: vec![-0.5; 3], by_phase: true },
        )
    }
}

/// A scene of image sources whose time filters have a table of their own.
fn with_images() -> Scene {
    let parts = room_with_images(16_000.0, 0.5, 0.1, 5).parts().clone();
    let nodes = parts.field.as_ref().unwrap().grid().clone();
    let direct = TransferShape { taps: 0, ..parts.shape() };
    let field = Field::new(nodes.clone(), direct, Rows::Whole(vec![0.25; nodes.nodes() * direct.row_len()]));
    let shape = TransferShape { bins: 0, ..parts.shape() };
    let [x, y, z, yaw, pitch, roll] = [(); 6].map(|()| Axis::single(0.0));
    let nodes = FieldGrid { position: [x, y, z], facing: Facing::Head { yaw, pitch, roll } };
    let room = Field::new(nodes, shape, Rows::Whole(vec![0.5; shape.row_len()]));
    Scene::new(SceneParts { field, room, ..parts }).unwrap()
}

/// An emitter that sends a level in two directions, to so many images.
fn emission(images: usize, level: f32) -> Emission {
    Emission {
        elevation: Axis::single(0.0),
        azimuth: Axis::circle(0.0, 2),
        levels: vec![[level; 7], [-1.0; 7]],
        turns: vec![Mat3::IDENTITY; images],
    }
}

#[test]
fn image_sources_that_do_not_fit_are_refused_by_name() {
    type Spoil = fn(&mut SceneParts);
    let images = |spoil: fn(&mut promenade_core::ImageSources)| {
        let mut parts = with_images().parts().clone();
        spoil(parts.images.as_mut().unwrap());
        Scene::new(parts).unwrap_err().to_string()
    };
    let scene = |spoil: Spoil| {
        let mut parts = with_images().parts().clone();
        spoil(&mut parts);
        Scene::new(parts).unwrap_err().to_string()
    };
    for (error, named) in [
        (images(|i| i.images.clear()), "number of images"),
        (images(|i| i.seen.truncate(7)), "seen of images"),
        (images(|i| i.direct.push(1.0)), "seen of the emitter"),
        (images(|i| i.images[1].position.x = f32::NAN), "position of an image"),
        (images(|i| i.images[1].position.x = 900.0), "distance of an image"),
        (images(|i| i.images[2].gains[3] = -1.0), "gain of an image"),
        (images(|i| i.images[2].gain_63 = -1.0), "gain of an image at 63 Hz"),
        (images(|i| i.air_db_per_m[0] = f32::INFINITY), "air absorption"),
        (images(|i| i.seen[3] = 1.5), "seen of an image"),
        (images(|i| i.emission = Some(emission(4, 0.0))), "number of turns"),
        (images(|i| i.emission = Some(emission(5, f32::NAN))), "what the emitter sends"),
        (images(|i| i.head.sample_rate_hz = 0.0), "rate of the head"),
        (images(|i| i.head.filters.clear()), "samples of the head"),
        (images(|i| i.head.filters.truncate(100)), "values of the head"),
        (images(|i| i.head.lead = 5_000), "lead of the head"),
        (images(|i| i.head.filters[0] = f32::NAN), "filters of the head"),
        (scene(|p| p.field = None), "field"),
        (scene(|p| p.room = p.field.clone()), "shape of the field"),
    ] {
        assert!(error.contains(named), "{named}: {error}");
    }
}

#[test]
fn what_is_written_is_read() {
    let mut directed = with_images().parts().clone();
    let images = directed.images.as_mut().unwrap();
    (images.emission, images.images[1].gain_63) = (Some(emission(5, 0.5)), 0.125);
    let directed = Scene::new(directed).unwrap();
    for scene in [Scene::new(small()).unwrap(), (*room(16_000.0, 0.5, 0.1)).clone(), with_images(), directed] {
        let bytes = scene.to_bytes().unwrap();
        assert!(Scene::from_bytes(&bytes).unwrap() == scene);
        assert!(bytes == scene.to_bytes().unwrap(), "the same scene makes the same file");
    }
}

#[test]
fn one_transfer_function_is_heard_at_every_pose() {
    let SceneParts { grid, bands, tail, top_hz, field, .. } = small();
    let mut transfer = TransferShape { taps: 4, ..field.unwrap().shape() }.silent();
    transfer.mixture.fill(0.5);
    transfer.taps.iter_mut().zip(noise(1, 24)).for_each(|(t, v)| *t = v.abs());
    let scene = Scene::of_transfer(&transfer, grid, bands.clone(), tail.clone(), top_hz).unwrap();
    for pose in [Pose::IDENTITY, Pose::from_ypr(Vec3::new(3.0, -2.0, 1.0), 2.0, 0.5, -0.3)] {
        assert_eq!(scene.field().unwrap().decode(&pose), transfer);
    }
    transfer.mixture.pop();
    assert!(Scene::of_transfer(&transfer, grid, bands, tail, top_hz).unwrap_err().to_string().contains("transfer function"));
}

#[test]
fn the_head_of_a_file_says_what_the_whole_does() {
    let presets = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/scenes");
    let files = ["iosr-room-a", "box"].map(|name| std::fs::read(presets.join(name).with_extension("promenade")).unwrap());
    for bytes in files.into_iter().chain([Scene::new(small()).unwrap().to_bytes().unwrap()]) {
        let scene = Scene::from_bytes(&bytes).unwrap();
        let head = SceneCard::head_len(&bytes[..8]).unwrap();
        assert!(head < bytes.len());
        let card = SceneCard::from_head(&bytes[..head]).unwrap();
        assert_eq!(&card.provenance, scene.provenance());
        assert_eq!(card.held_out, scene.held_out().len());
        for len in 0..head {
            assert!(SceneCard::from_head(&bytes[..len]).is_err(), "{len} of {head} bytes of the head");
        }
    }
    assert!(SceneCard::head_len(&u64::MAX.to_le_bytes()).is_err());
}

#[test]
fn a_file_cut_short_anywhere_is_an_error() {
    let bytes = Scene::new(small()).unwrap().to_bytes().unwrap();
    for len in 0..bytes.len() {
        assert!(Scene::from_bytes(&bytes[..len]).is_err(), "{len} of {} bytes", bytes.len());
    }
}

#[test]
fn a_bit_flipped_anywhere_is_an_error() {
    let bytes = Scene::new(small()).unwrap().to_bytes().unwrap();
    let mut silent = Vec::new();
    for at in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1 << (at % 8);
        if let Ok(scene) = Scene::from_bytes(&damaged) {
            // White space in the container's header carries nothing.
            if scene != Scene::new(small()).unwrap() {
                silent.push(at);
            }
        }
    }
    assert!(silent.is_empty(), "flips at {silent:?} went unnoticed");
}

/// Writes the small scene with its manifest changed by `edit` and a fresh checksum, as somebody else's software might.
fn with_manifest(edit: impl Fn(&str) -> String) -> Vec<u8> {
    let bytes = Scene::new(small()).unwrap().to_bytes().unwrap();
    let tensors = safetensors::SafeTensors::deserialize(&bytes).unwrap();
    let (_, header) = safetensors::SafeTensors::read_metadata(&bytes).unwrap();
    let manifest = edit(&header.metadata().as_ref().unwrap()["promenade"]);
    let mut views = tensors.tensors();
    views.retain(|(name, _)| name != "crc32");
    views.sort_by(|a, b| a.0.cmp(&b.0));
    let mut crc = crc32fast::Hasher::new();
    crc.update(manifest.as_bytes());
    for (name, view) in &views {
        crc.update(name.as_bytes());
        view.shape().iter().for_each(|s| crc.update(&(*s as u64).to_le_bytes()));
        crc.update(view.data());
    }
    let crc = crc.finalize().to_le_bytes();
    views.push(("crc32".into(), TensorView::new(Dtype::U32, vec![1], &crc).unwrap()));
    safetensors::serialize(views, Some([("promenade".to_owned(), manifest)].into())).unwrap()
}

#[test]
fn an_unchanged_manifest_passes_this_tests_own_writer() {
    assert!(Scene::from_bytes(&with_manifest(str::to_owned)).is_ok());
}

#[test]
fn another_version_is_named() {
    let bytes = with_manifest(|m| m.replace("\"version\":2", "\"version\":1"));
    assert!(matches!(Scene::from_bytes(&bytes), Err(SceneError::Version { found: 1 })));
}

#[test]
fn absurd_sizes_are_refused_before_anything_is_allocated() {
    for (from, to) in [
        ("\"n_fft\":32", "\"n_fft\":4294967296"),
        ("\"hop\":8", "\"hop\":0"),
        ("\"hop\":8", "\"hop\":31"),
        ("\"taps\":4", "\"taps\":1000000000"),
        ("\"nodes\":[0.0,", "\"nodes\":[7.0,"),
        ("\"nodes\":[0.0]", "\"nodes\":[]"),
        ("\"low_rank\":false", "\"low_rank\":true"),
        ("\"sample_rate_hz\":8000.0", "\"sample_rate_hz\":1e300"),
        ("\"sample_rate_hz\":8000.0", "\"sample_rate_hz\":-1.0"),
        ("\"top_hz\":3500.0", "\"top_hz\":0.0"),
        ("\"bounds\":[[0.0", "\"bounds\":[[9.0"),
        ("\"quat\":[", "\"quat\":[7"),
        ("\"title\":", "\"name\":"),
    ] {
        let edited = with_manifest(|m| {
            assert!(m.contains(from), "{from} in {m}");
            m.replacen(from, to, 1)
        });
        let error = Scene::from_bytes(&edited).unwrap_err().to_string();
        assert!(error.len() > 20, "{to}: {error}");
    }
}

#[test]
fn values_out_of_range_are_refused_by_name() {
    for bad in [f32::NAN, f32::INFINITY, 1e30] {
        let mut parts = small();
        let field = parts.field.unwrap();
        let Rows::Whole(mut rows) = field.rows().clone() else { panic!("made of whole rows") };
        rows[17] = bad;
        parts.field = Field::new(field.grid().clone(), field.shape(), Rows::Whole(rows));
        let error = Scene::new(parts).unwrap_err().to_string();
        assert!(error.contains("field") && error.contains("found"), "{error}");
    }
    let mut parts = small();
    parts.tail.t60_s[1] = 0.0;
    assert!(Scene::new(parts).unwrap_err().to_string().contains("reverberation time"));
    let mut parts = small();
    parts.tail.coherence.pop();
    assert!(Scene::new(parts).is_err());
    let mut parts = small();
    let lifted = Lifted { places: vec![Vec3::ZERO], samples: vec![0.0; 2 * 2 * 3 * parts.grid.hop] };
    parts.measured.as_mut().unwrap().lifted = Some(lifted);
    let error = |parts: &SceneParts| Scene::new(parts.clone()).unwrap_err().to_string();
    assert!(error(&parts).contains("image sources that play them"), "{}", error(&parts));
    parts.images = room_with_images(8_000.0, 0.5, 0.1, 5).parts().images.clone();
    let emitter = parts.field.as_ref().unwrap().emitter().unwrap();
    parts.images.as_mut().unwrap().images.iter_mut().for_each(|image| image.position = 2.0 * emitter);
    let written = Scene::new(parts.clone()).unwrap();
    assert_eq!(Scene::from_bytes(&written.to_bytes().unwrap()).unwrap(), written);
    parts.measured.as_mut().unwrap().lifted.as_mut().unwrap().samples.pop();
    assert!(error(&parts).contains("lifted reflections"), "{}", error(&parts));
}

#[test]
fn foreign_bytes_are_refused() {
    let noise: Vec<u8> = noise(9, 4_096).iter().map(|v| (v * 127.0) as i8 as u8).collect();
    let mut huge = u64::MAX.to_le_bytes().to_vec();
    huge.extend(b"{}");
    for bytes in [&b""[..], b"RIFF....WAVEfmt ", b"{}", &noise, &huge] {
        assert!(Scene::from_bytes(bytes).is_err());
    }
}
