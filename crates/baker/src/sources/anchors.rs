//! Anchors of a place: a few points that stand for its surfaces, each with the colours seen around it.
//!
//! The construction is that of the published code of Chen and Shlizerman, "AV-Cloud", NeurIPS 2024: points are merged in
//! voxels, the voxels are clustered, and the colours of the voxels nearest to each cluster's centre are its features.

mod box_points;
mod k_means;
mod store;
mod voxels;

pub use box_points::{WALL_COLOURS, box_points};

use crate::BakeError;
use crate::sources::reconstruction::Point;
use k_means::k_means;
use promenade_core::glam::Vec3;
use promenade_core::network::{HARMONIC, Placement};
use voxels::Voxel;

/// Anchors that a set may have.
pub const MAX_ANCHORS: usize = 65_536;
/// Neighbours that an anchor may have.
pub const MAX_NEIGHBOURS: usize = 1024;

/// Anchors with their features, and where their world lies in the scene. Made of a reconstruction and kept in a file, which
/// training and `import` read.
#[derive(Clone, Debug, PartialEq)]
pub struct AnchorSet {
    /// Where the cloud's world lies in the scene's.
    pub placement: Placement,
    /// Positions in the cloud's world, its units.
    pub positions: Vec<Vec3>,
    /// `[anchor][neighbour][red, green, blue]`, the nearest neighbour first: `(colour - 0.5) / HARMONIC` of colours in 0 to 1.
    pub features: Vec<f32>,
    /// Neighbours of each anchor.
    pub neighbours: usize,
}

/// How anchors are made of points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnchorOptions {
    /// Anchors, 1 to [`MAX_ANCHORS`]; published: 256.
    pub count: usize,
    /// Voxels whose colours are the features of an anchor, 1 to [`MAX_NEIGHBOURS`]; published: 50.
    pub neighbours: usize,
    /// Edge of a voxel in metres of the scene, above 0; published: 0.25, but of the cloud's units.
    pub voxel_m: f32,
    /// Seed of the clustering.
    pub seed: u64,
}

impl Default for AnchorOptions {
    fn default() -> Self {
        Self { count: 256, neighbours: 50, voxel_m: 0.25, seed: 1 }
    }
}

/// Figures of how a set was made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnchorReport {
    /// Points that went in.
    pub points: usize,
    /// Voxels with a point in them.
    pub voxels: usize,
    /// Rounds of the clustering.
    pub iterations: usize,
    /// Root mean square distance of the voxels to their anchors, metres.
    pub spread_m: f32,
    /// Smallest and largest coordinates of the voxels in the scene's world, metres.
    pub extent_m: (Vec3, Vec3),
}

impl AnchorSet {
    /// Makes anchors of the points of a cloud.
    ///
    /// Points are merged in voxels, `round(position / edge) * edge` with ties to even, of the mean colour of their points;
    /// k-means ([`AnchorOptions::count`] clusters, k-means++ start) clusters the voxels without weights. The same points and
    /// seed give the same anchors. Among voxels at one distance from an anchor the first by x, y, z is the nearer.
    ///
    /// # Errors
    /// An option out of range, a point that is not finite, or fewer voxels than anchors or neighbours are asked for.
    pub fn from_points(
        points: &[Point],
        placement: Placement,
        options: &AnchorOptions,
    ) -> Result<(Self, AnchorReport), BakeError> {
        options.check()?;
        let voxels = voxels::merge(points, options.voxel_m * placement.units_per_metre)?;
        let needed = options.count.max(options.neighbours);
        if voxels.len() < needed {
            let found = format!("{} of {} points", voxels.len(), points.len());
            let expected = format!(
                "at least {needed} for {} anchors of {} neighbours (a smaller voxel or fewer anchors?)",
                options.count, options.neighbours
            );
            return Err(BakeError::argument("voxels with points in them", expected, found));
        }
        let places: Vec<Vec3> = voxels.iter().map(|v| v.position).collect();
        let clusters = k_means(&places, options.count, options.seed);
        let features = features(&clusters.centres, &voxels, options.neighbours);
        let in_scene = places.iter().map(|p| placement.to_scene(*p));
        let extent_m = in_scene.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let report = AnchorReport {
            points: points.len(),
            voxels: voxels.len(),
            iterations: clusters.iterations,
            spread_m: (clusters.inertia / voxels.len() as f64).sqrt() as f32 / placement.units_per_metre,
            extent_m,
        };
        Ok((Self { placement, positions: clusters.centres, features, neighbours: options.neighbours }, report))
    }

    /// What is odd about anchors for listeners at these places of the scene, metres, for the user: more than half of these lie
    /// farther than 1 m outside of the box around the anchors.
    #[must_use]
    pub fn apart_from(&self, places: &[Vec3]) -> Option<String> {
        let bounds = |all: &mut dyn Iterator<Item = Vec3>| {
            all.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
        };
        let (low, high) = bounds(&mut self.positions.iter().map(|p| self.placement.to_scene(*p)));
        let outside = |p: &&Vec3| p.cmplt(low - 1.0).any() || p.cmpgt(high + 1.0).any();
        let count = places.iter().filter(outside).count();
        let text = |p: Vec3| format!("{:.1}, {:.1}, {:.1}", p.x, p.y, p.z);
        (2 * count > places.len()).then(|| {
            let (from, to) = bounds(&mut places.iter().copied());
            format!(
                "{count} of {} poses lie outside of the anchors: these reach from {} to {} m, the poses from {} to {} m (of \
                 another place, or in another unit or axes?)",
                places.len(),
                text(low),
                text(high),
                text(from),
                text(to)
            )
        })
    }

    /// Checks what a file or another program states.
    fn check(&self) -> Result<(), (&'static str, String, String)> {
        let count = self.positions.len();
        if !(1..=MAX_ANCHORS).contains(&count) {
            return Err(("anchors", format!("1 to {MAX_ANCHORS}"), count.to_string()));
        }
        if !(1..=MAX_NEIGHBOURS).contains(&self.neighbours) || self.features.len() != 3 * self.neighbours * count {
            let expected = format!("red, green and blue of 1 to {MAX_NEIGHBOURS} neighbours for each of {count} anchors");
            return Err(("features", expected, self.features.len().to_string()));
        }
        if !self.positions.iter().all(|p| p.is_finite()) || !self.features.iter().all(|f| f.is_finite()) {
            return Err(("anchors", "finite numbers".to_owned(), "others".to_owned()));
        }
        if !self.placement.is_valid() {
            let expected = "a scale above 0, a unit quaternion and a finite origin";
            return Err(("placement", expected.to_owned(), format!("{:?}", self.placement)));
        }
        Ok(())
    }
}

impl AnchorOptions {
    fn check(&self) -> Result<(), BakeError> {
        let within = |what, value: usize, most: usize| {
            if (1..=most).contains(&value) { Ok(()) } else { Err(BakeError::argument(what, format!("1 to {most}"), value)) }
        };
        within("number of anchors", self.count, MAX_ANCHORS)?;
        within("number of neighbours", self.neighbours, MAX_NEIGHBOURS)?;
        if !(1e-4..=1e4).contains(&self.voxel_m) {
            return Err(BakeError::argument("edge of a voxel", "0.0001 to 10000", self.voxel_m));
        }
        Ok(())
    }
}

/// Harmonics of the colours of the voxels nearest to each anchor.
fn features(anchors: &[Vec3], voxels: &[Voxel], neighbours: usize) -> Vec<f32> {
    let mut far: Vec<(f32, u32)> = Vec::with_capacity(voxels.len());
    let mut features = Vec::with_capacity(3 * neighbours * anchors.len());
    for anchor in anchors {
        far.clear();
        far.extend(voxels.iter().zip(0_u32..).map(|(v, i)| (anchor.distance_squared(v.position), i)));
        let by_distance = |a: &(f32, u32), b: &(f32, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if neighbours < far.len() {
            far.select_nth_unstable_by(neighbours, by_distance);
        }
        far.truncate(neighbours);
        far.sort_unstable_by(by_distance);
        for (_, voxel) in &far {
            features.extend(voxels[*voxel as usize].colour.map(|c| (c - 0.5) / HARMONIC));
        }
    }
    features
}

#[cfg(test)]
mod tests;
