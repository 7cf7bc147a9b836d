//! A live decoder baked down to a table.
//!
//! Nodes lie where masks change: along each axis the interval with the largest error of interpolation for its cost is halved
//! until the wanted error or the size is reached. Levels over frequency are kept as few coefficients of common shapes.

mod basis;
mod refine;

use crate::bake::field::basis::levels_db;
use crate::bake::field::refine::{Coordinates, Lines, Span};
use crate::error::BakeError;
use promenade_core::decode::CloudDecoder;
use promenade_core::glam::Vec3;
use promenade_core::{Facing, Field, FieldGrid, LowRank, Pose, Rows, Scene, TransferFunction, TransferShape};
use rayon::prelude::*;
use std::f32::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

pub(super) use crate::bake::field::basis::Shapes;

/// Poses that the common shapes are found from.
const SHAPE_POSES: usize = 500;
/// Poses that the finished field is judged at.
const JUDGED_POSES: usize = 1000;
/// Masks below this level are not judged, dB.
pub const JUDGED_ABOVE_DB: f32 = -40.0;
/// Share of the wanted error that leaving out shapes may cost.
const SHAPES_SHARE: f64 = 0.4;
/// Start of the note on a field in a scene's provenance.
const NOTE: &str = "field of ";
/// Nodes that are decoded between two reports of progress.
const BATCH: usize = 512;

/// Choices of a field bake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldOptions {
    /// Corners of the box of listener positions, metres.
    pub bounds: (Vec3, Vec3),
    /// Lowest and highest pitch, radians.
    pub pitch: (f32, f32),
    /// Lowest and highest roll, radians; a whole turn closes.
    pub roll: (f32, f32),
    /// Root mean square error of levels at which the nodes are dense enough, dB.
    pub error_db: f32,
    /// The largest table, bytes.
    pub max_bytes: usize,
    /// Seed of the poses that are tried.
    pub seed: u64,
}

impl FieldOptions {
    /// Every orientation within bounds, in at most 16 MB.
    #[must_use]
    pub fn within(bounds: (Vec3, Vec3)) -> Self {
        Self { bounds, pitch: (-FRAC_PI_2, FRAC_PI_2), roll: (-PI, PI), error_db: 0.1, max_bytes: 16_000_000, seed: 1 }
    }

    fn spans(&self) -> [Span; 6] {
        let (low, high) = self.bounds;
        let line = |low: f32, high: f32| Span { low, high, circle: false };
        let whole_roll = self.roll.1 - self.roll.0 > 1.99 * PI;
        [
            line(low.x, high.x),
            line(low.y, high.y),
            line(low.z, high.z),
            Span { low: -PI, high: PI, circle: true },
            line(self.pitch.0, self.pitch.1),
            Span { low: self.roll.0, high: self.roll.1, circle: whole_roll },
        ]
    }
}

/// Errors of levels, dB, over both ears and all frequencies where the decoder's mask is above [`JUDGED_ABOVE_DB`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldErrors {
    /// Median of magnitudes.
    pub median_db: f32,
    /// 95th percentile.
    pub p95_db: f32,
    /// 99th percentile.
    pub p99_db: f32,
    /// Share of masks that are above the level.
    pub judged: f32,
}

/// Size and errors of a baked field.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldReport {
    /// Nodes along x, y, z, yaw, pitch and roll.
    pub nodes: [usize; 6],
    /// Shapes of levels and of time filters.
    pub ranks: [usize; 2],
    /// Bytes of the table.
    pub bytes: usize,
    /// Errors at random poses.
    pub errors: FieldErrors,
}

impl FieldReport {
    /// The report in one line, for the scene's provenance.
    #[must_use]
    pub fn note(&self) -> String {
        let ([x, y, z, yaw, pitch, roll], [levels, taps]) = (self.nodes, self.ranks);
        let FieldErrors { median_db, p95_db, p99_db, .. } = self.errors;
        format!(
            "{NOTE}{x} x {y} x {z} positions, {yaw} x {pitch} x {roll} directions (yaw, pitch, roll), {levels} + {taps} \
             shapes, {} kB; \
             its levels differ from the decoder's by {median_db:.2} dB in the median, {p95_db:.2} dB at 95 %, {p99_db:.2} dB \
             at 99 % \
             ({JUDGED_POSES} random poses, masks above {JUDGED_ABOVE_DB} dB)",
            self.bytes.div_ceil(1000)
        )
    }
}

/// Decodes one pose.
pub type Decode<'a> = Box<dyn FnMut(&Pose) -> TransferFunction + Send + 'a>;

/// Decoders of one scene, one for each core.
pub(crate) struct Decoders<'a>(Vec<Decode<'a>>);

impl Decoders<'_> {
    /// A value of each pose's transfer function, in order.
    pub(crate) fn map<T: Send>(&mut self, poses: &[Pose], value: impl Fn(&TransferFunction) -> T + Sync) -> Vec<T> {
        let share = poses.len().div_ceil(self.0.len()).max(1);
        let parts = self.0.par_iter_mut().zip(poses.par_chunks(share));
        parts.flat_map_iter(|(decode, part)| part.iter().map(|pose| value(&decode(pose)))).collect()
    }
}

/// Bakes a table of a scene's anchor cloud, into the scene in its place; its provenance notes
/// the table's size and errors. `progress` is given the share that is done, 0 to 1.
///
/// # Errors
/// A scene without an anchor cloud, and as [`bake_field`].
pub fn bake_cloud(scene: &Arc<Scene>, options: &FieldOptions, progress: impl Fn(f64)) -> Result<Scene, BakeError> {
    let decoder = || -> Option<Decode<'_>> {
        let mut decoder = CloudDecoder::new(scene)?;
        let mut decoded = decoder.blank();
        Some(Box::new(move |pose| {
            decoder.decode(pose, &mut decoded);
            decoded.transfer.clone()
        }))
    };
    if scene.cloud().is_none() {
        return Err(BakeError::argument("scene", "one with an anchor cloud", "a field only"));
    }
    let (field, report) = bake_field(scene.shape(), decoder, options, progress)?;
    let mut parts = scene.parts().clone();
    parts.provenance.notes.retain(|n| !n.starts_with(NOTE));
    parts.provenance.notes.push(report.note());
    (parts.bounds, parts.field) = (options.bounds, Some(field));
    Ok(Scene::new(parts)?)
}

/// Bakes a table of a decoder. `decoder` makes one for each core; `progress` is given the share that is done, 0 to 1.
///
/// # Errors
/// No decoder, bounds or ranges that are not finite or of the wrong order, or a size that no table fits in.
pub fn bake_field<'a>(
    shape: TransferShape,
    decoder: impl Fn() -> Option<Decode<'a>>,
    options: &FieldOptions,
    progress: impl Fn(f64),
) -> Result<(Field, FieldReport), BakeError> {
    let spans = options.spans();
    check(&spans, options)?;
    let decoders: Option<Vec<Decode<'a>>> = (0..rayon::current_num_threads()).map(|_| decoder()).collect();
    let mut decoders = Decoders(decoders.ok_or_else(|| BakeError::argument("decoder", "one for each core", "none"))?);
    let poses: Vec<Pose> = Coordinates::random(&spans, options.seed, SHAPE_POSES).iter().map(Coordinates::pose).collect();
    let rows = decoders.map(&poses, |tf| (levels_db(tf), [&tf.taps[..], &tf.late].concat()));
    let (levels, taps): (Vec<_>, Vec<_>) = rows.into_iter().unzip();
    let largest = taps.iter().flatten().fold(0.0_f32, |a, b| a.max(b.abs()));
    let levels = Shapes::of(&levels, SHAPES_SHARE * f64::from(options.error_db));
    let taps = Shapes::of(&taps, 0.003 * f64::from(largest));

    let ranks = [levels.rank(), taps.rank()];
    let node_bytes = 4 * (ranks[0] + ranks[1]);
    let basis_bytes = 4 * (levels.values() + taps.values());
    let most_nodes = options.max_bytes.saturating_sub(basis_bytes) / node_bytes;
    let mut lines = Lines::new(spans, options.seed);
    let axes = lines.refine(&mut decoders, &levels, f64::from(options.error_db), most_nodes).ok_or_else(|| {
        let found = format!("{} bytes, {node_bytes} for each node", options.max_bytes);
        BakeError::argument("size of the field", "room for the coarsest table", found)
    })?;
    let nodes = [0, 1, 2, 3, 4, 5].map(|a| axes[a].count());
    let [x, y, z, yaw, pitch, roll] = axes;
    let grid = FieldGrid { position: [x, y, z], facing: Facing::Head { yaw, pitch, roll } };

    let count = grid.nodes();
    let mut coefficients = Vec::with_capacity(count * (ranks[0] + ranks[1]));
    for from in (0..count).step_by(BATCH) {
        progress(from as f64 / count as f64);
        let poses: Vec<Pose> = (from..count.min(from + BATCH)).map(|i| grid.pose(i)).collect();
        for row in decoders.map(&poses, |tf| {
            [levels.coefficients(&levels_db(tf)), taps.coefficients(&[&tf.taps[..], &tf.late].concat())].concat()
        }) {
            coefficients.extend(row);
        }
    }
    let low_rank = LowRank { levels: levels.into_basis(), taps: taps.into_basis(), coefficients };
    let field = Field::new(grid, shape, Rows::LowRank(low_rank))
        .ok_or_else(|| BakeError::argument("decoder", "transfer functions of the scene's shape", "others"))?;
    let errors = errors(&field, &mut decoders, &spans, options.seed);
    let report = FieldReport { nodes, ranks, bytes: field.memory_bytes(), errors };
    Ok((field, report))
}

fn check(spans: &[Span; 6], options: &FieldOptions) -> Result<(), BakeError> {
    let axes = ["bounds in x", "bounds in y", "bounds in z", "yaw", "range of pitch", "range of roll"];
    for (Span { low, high, .. }, what) in spans.iter().zip(axes) {
        if !(low.is_finite() && high.is_finite() && low <= high) {
            return Err(BakeError::argument(what, "finite, the lower end first", format!("{low} to {high}")));
        }
    }
    if !(options.error_db.is_finite() && options.error_db > 0.0) {
        return Err(BakeError::argument("error of the field", "a number of decibels above 0", options.error_db));
    }
    Ok(())
}

/// Judges a field by its decoder at random poses that it was not made from.
fn errors(field: &Field, decoders: &mut Decoders<'_>, spans: &[Span; 6], seed: u64) -> FieldErrors {
    let judged = Coordinates::random(spans, seed.wrapping_add(0x5EED), JUDGED_POSES);
    let poses: Vec<Pose> = judged.iter().map(Coordinates::pose).collect();
    let wanted = decoders.map(&poses, levels_db);
    let mut errors = Vec::new();
    let mut all = 0_usize;
    for (pose, wanted) in poses.iter().zip(&wanted) {
        let found = levels_db(&field.decode(pose));
        all += found.len();
        errors.extend(found.iter().zip(wanted).filter(|(_, w)| **w > JUDGED_ABOVE_DB).map(|(f, w)| (f - w).abs()));
    }
    errors.sort_by(f32::total_cmp);
    let at = |share: f64| errors.get((share * (errors.len().saturating_sub(1)) as f64) as usize).copied().unwrap_or(0.0);
    FieldErrors { median_db: at(0.5), p95_db: at(0.95), p99_db: at(0.99), judged: errors.len() as f32 / all.max(1) as f32 }
}
