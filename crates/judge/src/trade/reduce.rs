//! Scenes that hold less.

use super::{Less, Nodes};
use promenade_core::{
    Axis, Basis, Emission, Facing, Field, FieldGrid, ImageSources, LowRank, Rows, Scene, SceneParts, TransferShape, TurningRoom,
};

/// Shares of the taps and of the images that are kept.
const KEPT: [f64; 3] = [0.25, 0.5, 0.75];
/// The most by which the late part rises when it begins earlier, dB.
const MOST_RISE_DB: f32 = 60.0;

/// All that can be left out of a scene, a quarter, half and three quarters of the taps and images and half of each kind of
/// node, as far as it has them; with the scenes that are left.
pub(super) fn all(scene: &Scene) -> Vec<(Less, Scene)> {
    let parts = scene.parts();
    let count = |share: f64, all: usize| (share * all as f64).round() as usize;
    let taps = KEPT.into_iter().map(|share| count(share, parts.taps)).filter(|taps| *taps > 0).map(Less::Taps);
    let all_images = parts.images.as_ref().map_or(0, |images| images.images.len());
    let images = [0.0].into_iter().chain(KEPT).map(|share| Less::Images(count(share, all_images)));
    let nodes = Nodes::ALL.into_iter().map(Less::Half);
    // What does not fit together any more is not a setting.
    taps.chain(images).chain(nodes).filter_map(|less| Some((less, reduced(scene, less)?))).collect()
}

/// What is kept, in words.
pub(super) fn words(less: Less, of: &Scene) -> String {
    let parts = of.parts();
    match less {
        Less::Taps(taps) => format!("{taps} of {} taps", parts.taps),
        Less::Images(count) => format!("{count} of {} images", parts.images.as_ref().map_or(0, |all| all.images.len())),
        Less::Half(nodes) => format!("half of the {}", nodes.name()),
    }
}

/// A scene that keeps less of what it holds; `None` where there is nothing to leave out.
#[must_use]
pub fn reduced(scene: &Scene, less: Less) -> Option<Scene> {
    let parts = scene.parts();
    let kept = match less {
        Less::Taps(taps) => (taps > 0 && taps < parts.taps).then(|| with_taps(parts, taps))??,
        Less::Images(count) => {
            let images = parts.images.as_ref().filter(|all| count < all.images.len())?;
            let images = (count > 0).then(|| fewer_images(images, count));
            // What no image plays any more is the responses' own again.
            let mut measured = parts.measured.clone();
            measured.iter_mut().filter(|_| count == 0).for_each(|measured| measured.lifted = None);
            SceneParts { images, measured, ..parts.clone() }
        }
        Less::Half(nodes) => {
            let thin = |field: &Field| thinned(field, nodes);
            let (field, room) = (parts.field.as_ref().and_then(thin), parts.room.as_ref().and_then(thin));
            if field.is_none() && room.is_none() {
                return None;
            }
            let (field, room) = (field.or_else(|| parts.field.clone()), room.or_else(|| parts.room.clone()));
            SceneParts { field, room, ..parts.clone() }
        }
    };
    Scene::new(kept).ok()
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
        Field::new(field.grid().clone(), shape, rows)
    };
    let field = parts.field.as_ref().map(cut);
    let room = parts.room.as_ref().map(cut);
    // A table that could not be cut is no scene.
    let (field, room) = (field.map_or(Some(None), |f| f.map(Some))?, room.map_or(Some(None), |f| f.map(Some))?);
    let measured = parts.measured.as_ref().map(|m| m.with_taps(taps, &parts.bands, &parts.grid, &rise));
    Some(SceneParts { taps, field, room, measured, ..parts.clone() })
}

fn fewer_images(images: &ImageSources, count: usize) -> ImageSources {
    let seen = images.seen.chunks_exact(images.images.len()).flat_map(|place| &place[..count]).copied().collect();
    let turning = images.turning.clone().map(|room| TurningRoom { mirrors: room.mirrors[..count].to_vec(), ..room });
    let turns = |of: Emission| Emission { turns: of.turns[..count].to_vec(), ..of };
    let emission = images.emission.clone().map(turns);
    ImageSources { images: images.images[..count].to_vec(), seen, turning, emission, ..images.clone() }
}

/// Every second node along the axes of a kind; `None` where there are no nodes to spare.
fn thinned(field: &Field, kind: Nodes) -> Option<Field> {
    let half = |axis: &Axis, of: Nodes| -> (Axis, Vec<usize>) {
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
    let [x, y, z] = field.grid().position.each_ref().map(|axis| half(axis, Nodes::Places));
    let (facing, directions) = match &field.grid().facing {
        Facing::Emitter { position, elevation, azimuth } => {
            let (elevation, e) = half(elevation, Nodes::Elevations);
            let (azimuth, a) = half(azimuth, Nodes::Directions);
            (Facing::Emitter { position: *position, elevation, azimuth }, vec![e, a])
        }
        Facing::Head { yaw, pitch, roll } => {
            let ((yaw, a), (pitch, b), (roll, c)) =
                (half(yaw, Nodes::Directions), half(pitch, Nodes::Elevations), half(roll, Nodes::Elevations));
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
    Field::new(grid, field.shape(), rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_testing::scenes::{room, room_with_images};

    #[test]
    fn what_is_left_out_is_named_and_the_rest_stays() {
        let scene = room_with_images(16_000.0, 0.5, 0.05, 8);
        let found = all(&scene);
        let names: Vec<String> = found.iter().map(|(less, _)| words(*less, &scene)).collect();
        for name in
            ["6 of 24 taps", "18 of 24 taps", "0 of 8 images", "4 of 8 images", "half of the directions", "half of the places"]
        {
            assert!(names.iter().any(|found| found == name), "{name} in {names:?}");
        }
        let get = |name: &str| &found[names.iter().position(|found| found == name).unwrap()].1;
        for nothing in [Less::Taps(24), Less::Taps(0), Less::Images(8)] {
            assert!(reduced(&scene, nothing).is_none(), "{nothing:?}");
        }
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
