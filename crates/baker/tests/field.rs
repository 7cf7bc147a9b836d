//! A decoder baked down to a table.

use promenade_baker::field::{Decode, FieldOptions, bake_field};
use promenade_core::glam::Vec3;
use promenade_core::{Pose, TransferFunction, TransferShape};

const SHAPE: TransferShape = TransferShape { bins: 33, bands: 4, taps: 3 };

/// A smooth head before a source at the origin, whose level falls with distance.
fn smooth(pose: &Pose) -> TransferFunction {
    let mut tf = SHAPE.silent();
    let seen = pose.to_head(Vec3::ZERO);
    let (distance, side) = (seen.length(), seen.y / seen.length());
    for k in 0..SHAPE.bins {
        let f = k as f32 / SHAPE.bins as f32;
        tf.mixture[k] = (1.0 + 0.3 * f * seen.z) / distance;
        tf.difference[k] = -0.7 * f * side;
    }
    for (i, tap) in tf.taps.iter_mut().enumerate() {
        *tap = 0.2 * 0.9_f32.powi(i as i32) * (1.0 + 0.1 * side);
    }
    tf
}

fn options() -> FieldOptions {
    let bounds = (Vec3::new(1.0, -0.5, 0.2), Vec3::new(2.0, 0.5, 0.2));
    FieldOptions { pitch: (-0.5, 0.5), roll: (-0.3, 0.3), ..FieldOptions::within(bounds) }
}

#[test]
fn a_smooth_decoder_is_met_within_the_error_asked_for() {
    for error_db in [0.5, 0.1] {
        let options = FieldOptions { error_db, ..options() };
        let (field, report) = bake_field(SHAPE, || -> Option<Decode> { Some(Box::new(smooth)) }, &options, |_| ()).unwrap();
        assert!(report.errors.median_db < error_db && report.errors.p99_db < 4.0 * error_db, "{report:?}");
        assert_eq!(report.nodes[2], 1, "one height, one node");
        let pose = Pose::from_ypr(Vec3::new(1.3, 0.1, 0.2), 2.0, 0.2, -0.1);
        let (found, wanted) = (field.decode(&pose), smooth(&pose));
        for (f, w) in found.taps.iter().zip(&wanted.taps) {
            assert!((f - w).abs() < 0.01, "{f} for {w}");
        }
    }
}

#[test]
fn the_size_is_kept_and_the_error_tells() {
    let bake = |max_bytes| {
        let options = FieldOptions { error_db: 0.001, max_bytes, ..options() };
        bake_field(SHAPE, || -> Option<Decode> { Some(Box::new(smooth)) }, &options, |_| ()).map(|(_, report)| report)
    };
    let (small, large) = (bake(150_000).unwrap(), bake(600_000).unwrap());
    assert!(small.bytes <= 150_000 && large.bytes <= 600_000 && large.bytes > small.bytes, "{small:?} {large:?}");
    assert!(large.errors.median_db < small.errors.median_db, "{small:?} {large:?}");
    assert!(bake(2_000).unwrap_err().to_string().contains("size of the field"));
}

#[test]
fn nodes_gather_where_masks_change() {
    // All change lies within a tenth of a metre.
    let step = |pose: &Pose| {
        let mut tf = SHAPE.silent();
        tf.mixture.fill(1.0 + 0.5 * ((pose.position.x - 1.7) / 0.03).tanh());
        tf
    };
    let (field, report) = bake_field(SHAPE, || -> Option<Decode> { Some(Box::new(step)) }, &options(), |_| ()).unwrap();
    let x = field.grid().position[0].nodes();
    let near = x.iter().filter(|x| (**x - 1.7).abs() < 0.15).count();
    assert!(near * 2 > x.len() && x.len() > 8, "{x:?}");
    assert!(report.errors.p99_db < 1.0, "{report:?}");
    assert_eq!(report.nodes[1], 4, "nothing changes along y");
}

#[test]
fn wrong_ranges_are_named() {
    let wrong = FieldOptions { pitch: (0.5, -0.5), ..options() };
    let error = bake_field(SHAPE, || -> Option<Decode> { Some(Box::new(smooth)) }, &wrong, |_| ()).unwrap_err();
    assert!(error.to_string().contains("pitch") && error.to_string().contains("0.5 to -0.5"), "{error}");
}
