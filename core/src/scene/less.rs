//! Scenes that hold less.

use super::{Emission, ImageSource, ImageSources, Scene, SceneParts, Setting, TurningRoom};
use crate::number::single;
use crate::{Basis, Field, LowRank, NEAREST_M, Rows, TransferShape};
use glam::Vec3;

/// The most by which the late part rises when it begins earlier, dB.
const MOST_RISE_DB: f32 = 60.0;

impl Scene {
    /// The scene that holds what a setting plays of this one; `None` where its time filters cannot be shortened so.
    ///
    /// # Real-time
    /// Not real-time safe: allocates; a lower order takes a good part of a second.
    #[must_use]
    pub fn with_setting(&self, setting: Setting) -> Option<Self> {
        let Setting { taps, images: count, order, refresh, waves, decodes } = setting.of(self);
        let mut parts = if taps < self.parts().taps { with_taps(self.parts(), taps)? } else { self.parts().clone() };
        if let Some(images) = parts.images.as_mut().filter(|all| count < all.images.len()) {
            *images = first_images(images, count, parts.start_pose.position);
        }
        if let Some(images) = parts.images.as_mut().filter(|images| order < images.head.order()) {
            images.head = images.head.in_order(order);
        }
        if !waves {
            parts.bass = None;
        }
        if decodes == 0 {
            (parts.cloud, parts.decodes) = (None, usize::MAX);
        } else {
            parts.decodes = decodes;
        }
        (parts.refresh, parts.front) = (refresh, Vec::new());
        Self::new(parts).ok()
    }
}

/// The first taps only; the late part begins where they end, as much louder as it has decayed until its old beginning.
fn with_taps(parts: &SceneParts, taps: usize) -> Option<SceneParts> {
    let hops = (parts.taps - taps) as f32 * single(parts.grid.hop_s());
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

/// The first images only. Each of the others leaves its energy at a place to that of them whose sound is heard there at nearly
/// the same time.
fn first_images(images: &ImageSources, count: usize, at: Vec3) -> ImageSources {
    let seen = images.seen.chunks_exact(images.images.len()).flat_map(|place| &place[..count]).copied().collect();
    let turning = images.turning.clone().map(|room| TurningRoom { mirrors: room.mirrors[..count].to_vec(), ..room });
    let turns = |of: Emission| Emission { turns: of.turns[..count].to_vec(), ..of };
    let emission = images.emission.clone().map(turns);
    let distance = |image: &ImageSource| image.position.distance(at).max(NEAREST_M);
    let seen_of = |i: usize| images.seen.iter().skip(i).step_by(images.images.len()).sum::<f32>().max(1e-3);
    let (kept, rest) = images.images.split_at(count);
    let mut first = kept.to_vec();
    for (i, image) in rest.iter().enumerate() {
        let apart = |kept: &ImageSource| (distance(kept) - distance(image)).abs();
        let Some((nearest, _)) = kept.iter().enumerate().min_by(|a, b| apart(a.1).total_cmp(&apart(b.1))) else { continue };
        let share = (distance(&kept[nearest]) / distance(image)).powi(2) * (seen_of(count + i) / seen_of(nearest)).min(1.0);
        let add = |own: &mut f32, of: f32| *own = (*own * *own + share * of * of).sqrt();
        first[nearest].gains.iter_mut().zip(image.gains).for_each(|(own, of)| add(own, of));
        add(&mut first[nearest].gain_63, image.gain_63);
    }
    ImageSources { images: first, seen, turning, emission, ..images.clone() }
}
