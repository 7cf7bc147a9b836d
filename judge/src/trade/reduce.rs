//! Scenes that hold less.

use promenade_core::{
    Axis, Basis, Facing, Field, FieldGrid, ImageSources, LowRank, NodeShares, Rows, Scene, SceneParts, TransferShape,
};

/// Shares of the taps and of the images that are kept.
const KEPT: [f64; 3] = [0.25, 0.5, 0.75];
/// The most by which the late part rises when it begins earlier, dB.
const MOST_RISE_DB: f32 = 60.0;

/// A scene with fewer taps, fewer images, and half of the nodes along each axis, as far as it has them; what each keeps.
pub(super) fn all(scene: &Scene) -> Vec<(String, Scene)> {
    let parts = scene.parts();
    let mut out = Vec::new();
    let mut keep = |what: String, parts: Option<SceneParts>| {
        // What does not fit together any more is not a setting.
        out.extend(parts.and_then(|parts| Scene::new(parts).ok()).map(|scene| (what, scene)));
    };
    for share in KEPT {
        let taps = (share * parts.taps as f64).round() as usize;
        if taps > 0 && taps < parts.taps {
            keep(format!("{taps} of {} taps", parts.taps), with_taps(parts, taps));
        }
    }
    if let Some(images) = &parts.images {
        let all = images.images.len();
        for share in [0.0].into_iter().chain(KEPT) {
            let count = (share * all as f64).round() as usize;
            if count < all {
                let images = (count > 0).then(|| fewer_images(images, count));
                keep(format!("{count} of {all} images"), Some(SceneParts { images, ..parts.clone() }));
            }
        }
    }
    for axis in ["directions", "elevations", "places"] {
        let thin = |field: &Field| thinned(field, axis);
        let (field, room) = (parts.field.as_ref().and_then(thin), parts.room.as_ref().and_then(thin));
        if field.is_some() || room.is_some() {
            let (field, room) = (field.or_else(|| parts.field.clone()), room.or_else(|| parts.room.clone()));
            keep(format!("half of the {axis}"), Some(SceneParts { field, room, ..parts.clone() }));
        }
    }
    out
}

/// The first taps only; the late part begins where they end, as much louder as it has decayed until its old beginning.
fn with_taps(parts: &SceneParts, taps: usize) -> Option<SceneParts> {
    let hops = (parts.taps - taps) as f32 * parts.grid.hop_s() as f32;
    let rise_db = |t60: &f32| (60.0 * hops / t60.max(1e-3)).min(MOST_RISE_DB);
    let ear: Vec<f32> = parts.tail.t60_s.iter().map(|t60| 10.0_f32.powf(rise_db(t60) / 20.0)).collect();
    let rise = [&ear[..], &ear[..]].concat();
    let cut = |field: &Field| {
        let old = field.shape();
        if old.taps != parts.taps {
            return Some(field.clone());
        }
        let shape = TransferShape { taps, ..old };
        let row = |row: &[f32], head: usize| -> Vec<f32> {
            let late = &row[row.len() - rise.len()..];
            let late = late.iter().zip(&rise).map(|(gain, rise)| gain * rise);
            row[..head + taps * rise.len()].iter().copied().chain(late).collect()
        };
        let rows = match field.rows() {
            Rows::Whole(rows) => Rows::Whole(rows.chunks_exact(old.row_len()).flat_map(|r| row(r, old.direct_len())).collect()),
            Rows::LowRank(low) => {
                let shapes = low.taps.shapes.chunks_exact(low.taps.mean.len()).flat_map(|shape| row(shape, 0)).collect();
                Rows::LowRank(LowRank { taps: Basis { mean: row(&low.taps.mean, 0), shapes }, ..low.clone() })
            }
        };
        let cut = Field::new(field.grid().clone(), shape, rows)?;
        field.shares().cloned().map_or(Some(cut.clone()), |shares| cut.with_shares(shares))
    };
    let field = parts.field.as_ref().map(cut);
    let room = parts.room.as_ref().map(cut);
    // A table that could not be cut is no scene.
    let (field, room) = (field.map_or(Some(None), |f| f.map(Some))?, room.map_or(Some(None), |f| f.map(Some))?);
    Some(SceneParts { taps, field, room, ..parts.clone() })
}

fn fewer_images(images: &ImageSources, count: usize) -> ImageSources {
    let seen = images.seen.chunks_exact(images.images.len()).flat_map(|place| &place[..count]).copied().collect();
    ImageSources { images: images.images[..count].to_vec(), seen, ..images.clone() }
}

/// Every second node along the axes of a kind; `None` where there are no nodes to spare.
fn thinned(field: &Field, kind: &str) -> Option<Field> {
    let half = |axis: &Axis, of: &str| -> (Axis, Vec<usize>) {
        let count = axis.count();
        let all = || (axis.clone(), (0..count).collect());
        // Both ends stay, and a circle stays even.
        let spare =
            if axis.is_circle() { count.is_multiple_of(2) && count >= 4 } else { !count.is_multiple_of(2) && count >= 3 };
        if of != kind || !spare {
            return all();
        }
        let kept: Vec<usize> = (0..count).step_by(2).collect();
        let nodes = kept.iter().map(|i| axis.nodes()[*i]).collect();
        Axis::new(nodes, axis.is_circle()).map_or_else(all, |axis| (axis, kept))
    };
    let [x, y, z] = field.grid().position.each_ref().map(|axis| half(axis, "places"));
    let (facing, directions) = match &field.grid().facing {
        Facing::Emitter { position, elevation, azimuth } => {
            let (elevation, e) = half(elevation, "elevations");
            let (azimuth, a) = half(azimuth, "directions");
            (Facing::Emitter { position: *position, elevation, azimuth }, vec![e, a])
        }
        Facing::Head { yaw, pitch, roll } => {
            let ((yaw, a), (pitch, b), (roll, c)) =
                (half(yaw, "directions"), half(pitch, "elevations"), half(roll, "elevations"));
            (Facing::Head { yaw, pitch, roll }, vec![a, b, c])
        }
    };
    let grid = FieldGrid { position: [x.0, y.0, z.0], facing };
    if grid.nodes() == field.grid().nodes() {
        return None;
    }
    let axes: Vec<Vec<usize>> = [z.1, y.1, x.1].into_iter().chain(directions).collect();
    let counts: Vec<usize> = field.grid().axes().iter().map(|axis| axis.count()).collect();
    // Numbers of the nodes that stay, the last axis fastest.
    let nodes = axes.iter().zip(&counts).fold(vec![0], |nodes, (kept, count)| {
        nodes.iter().flat_map(|node| kept.iter().map(move |i| node * count + i)).collect::<Vec<usize>>()
    });
    let select =
        |values: &[f32], len: usize| -> Vec<f32> { nodes.iter().flat_map(|n| &values[n * len..][..len]).copied().collect() };
    let rows = match field.rows() {
        Rows::Whole(rows) => Rows::Whole(select(rows, field.shape().row_len())),
        Rows::LowRank(low) => {
            let coefficients = select(&low.coefficients, low.coefficients.len() / field.grid().nodes());
            Rows::LowRank(LowRank { coefficients, ..low.clone() })
        }
    };
    let thin = Field::new(grid, field.shape(), rows)?;
    let Some(shares) = field.shares() else { return Some(thin) };
    let per_node = shares.per_node();
    let responses = nodes.iter().flat_map(|n| &shares.responses()[n * per_node..][..per_node]).copied().collect();
    thin.with_shares(NodeShares::new(per_node, responses, select(shares.weights(), per_node))?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_testing::scenes::{room, room_with_images};

    #[test]
    fn what_is_left_out_is_named_and_the_rest_stays() {
        let scene = room_with_images(16_000.0, 0.5, 0.05, 8);
        let found = all(&scene);
        let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
        for name in
            ["6 of 24 taps", "18 of 24 taps", "0 of 8 images", "4 of 8 images", "half of the directions", "half of the places"]
        {
            assert!(names.contains(&name), "{name} in {names:?}");
        }
        let get = |name: &str| &found.iter().find(|(n, _)| n == name).unwrap().1;
        assert_eq!(get("4 of 8 images").images().unwrap().images, scene.images().unwrap().images[..4]);
        assert_eq!(get("0 of 8 images").images(), None);
        // A node that stays says what it said.
        let (field, thin) = (scene.field().unwrap(), get("half of the directions").field().unwrap());
        assert_eq!(2 * thin.grid().nodes(), field.grid().nodes());
        for node in [0, 7, thin.grid().nodes() - 1] {
            let pose = thin.grid().pose(node);
            let (a, b) = (thin.decode(&pose), field.decode(&pose));
            let worst = a.mixture.iter().zip(&b.mixture).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst < 1e-4, "{node}: {worst}");
        }
    }

    #[test]
    fn a_late_part_that_begins_earlier_has_the_level_that_decays_to_the_old_one() {
        let scene = room(16_000.0, 0.5, 0.05);
        let fewer = Scene::new(with_taps(scene.parts(), 12).unwrap()).unwrap();
        let pose = scene.start_pose();
        let (old, new) = (scene.field().unwrap().decode(&pose), fewer.field().unwrap().decode(&pose));
        let hops = 12.0 * scene.grid().hop_s() as f32;
        for ((old, new), t60) in old.late.iter().zip(&new.late).zip(scene.tail().t60_s.iter().cycle()) {
            let decayed = new * 10.0_f32.powf(-3.0 * hops / t60);
            assert!((decayed / old - 1.0).abs() < 1e-3, "{decayed} {old}");
        }
        assert_eq!(new.taps, old.taps[..new.taps.len()]);
    }
}
