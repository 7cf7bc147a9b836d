//! Surfaces in pieces, and the pictures that tell of those that no sound has met.

use crate::args::{FitArgs, Per, PictureArgs};
use crate::{picture, report};
use anyhow::{Context, Result, bail};
use promenade_baker::reconstruction::{PointOptions, Reconstruction};
use promenade_core::network::Placement;
use promenade_fit::{BANDS, FitError, FlatRoom, FullFit, Measurements, Pictures, Raster, View, Voxels, similarity};
use promenade_paths::colmap::Lens;
use std::path::{Component, Path};

/// Edge of voxels unless told, metres.
const EDGE_M: f64 = 0.25;
/// Photographs at most, and pixels along the longer side of what is kept of each.
const MOST_PHOTOS: usize = 256;
const MOST_SIDE: usize = 640;
/// How much the shape of a photograph may differ from its lens's.
const SHAPE: f64 = 0.01;
/// A share of cameras within the room below which it is doubted that these are its pictures.
const INSIDE: f64 = 0.5;

/// What makes a build that reads networks.
#[cfg(not(feature = "onnx"))]
const WITH_NETWORKS: &str = "cargo build --release -p promenade --features onnx";

/// What pieces are made, and what is known of their looks.
pub(super) struct Pieces {
    edge_m: f64,
    pictures: Option<Pictures>,
}

impl Pieces {
    /// None where whole surfaces are asked for.
    pub(super) fn of(args: &FitArgs) -> Result<Option<Self>> {
        if args.per != Per::Voxels {
            let of_voxels = [("--voxel", args.voxel.is_some()), ("--pictures", args.looks.pictures.is_some())];
            if let Some((name, _)) = of_voxels.into_iter().find(|(_, given)| *given) {
                bail!("{name}: expected --per voxels with it");
            }
            return Ok(None);
        }
        let pictures = args.looks.pictures.as_ref().map(|folder| pictures(folder, &args.looks)).transpose()?;
        Ok(Some(Self { edge_m: args.voxel.unwrap_or(EDGE_M), pictures }))
    }

    /// Refuses what would fail after minutes, and doubts pictures that were taken elsewhere.
    pub(super) fn check(&self, room: &FlatRoom) -> Result<()> {
        Voxels::new(room, self.edge_m).context("--voxel")?;
        let Some(pictures) = &self.pictures else { return Ok(()) };
        let [low, high] = room.mesh()?.bounds();
        let inside = |view: &&View| {
            let at = pictures.placement.to_scene(view.camera.centre().as_vec3()).as_dvec3().to_array();
            (0..3).all(|a| (low[a]..=high[a]).contains(&at[a]))
        };
        let (inside, all) = (pictures.views.iter().filter(inside).count(), pictures.views.len());
        if (inside as f64) < INSIDE * all as f64 {
            report::note(format_args!(
                "{inside} of {all} photographs were taken within the room: the reconstruction may lie elsewhere; --landmark \
                 says where places of it are"
            ));
        }
        Ok(())
    }

    /// A fit of whole surfaces, in pieces.
    pub(super) fn fit(
        &self,
        whole: &FullFit,
        set: &Measurements,
        seed: u64,
        each: &mut dyn FnMut(f64),
    ) -> Result<FullFit, FitError> {
        let mut looks = |room: &FlatRoom, voxels: &Voxels| match &self.pictures {
            Some(pictures) => pictures.looks(room, voxels),
            None => Ok(vec![None; voxels.patches.len()]),
        };
        whole.in_voxels(set, self.edge_m, seed, &mut looks, each)
    }
}

/// What is said of pieces once they are fitted.
pub(super) fn say(fit: &FullFit) {
    let Some(own) = &fit.voxels else { return };
    let count = own.absorption.len();
    let touched = (0..count).filter(|p| own.is_touched(*p)).count();
    report::line(format_args!("sound tells of {touched} of {count} pieces"));
    if own.shown > 0 {
        let guessed = own.guessed.iter().filter(|g| **g).count();
        match &own.off {
            Some(off) => {
                let mean = off.iter().sum::<f64>() / BANDS as f64;
                report::line(format_args!(
                    "pictures show {}: {guessed} were guessed by their looks, off by {mean:.2} where sound tells",
                    own.shown
                ));
            }
            None => report::note("pictures show too few pieces that sound tells of to learn from"),
        }
    }
}

fn pictures(folder: &Path, args: &PictureArgs) -> Result<Pictures> {
    let what = || folder.display().to_string();
    let mut notes = Vec::new();
    let place = Reconstruction::load(folder, &PointOptions::default())?;
    let placement = placement(&place, args, &mut notes).with_context(what)?;
    let points = place.points.iter().map(|p| (p.position, p.colour)).collect();
    let mut views = match &args.photos {
        Some(photos) => views(&place, folder, photos, &mut notes)?,
        None => Vec::new(),
    };
    if let Some(network) = &args.network {
        look(&mut views, network)?;
    }
    report::notes(&notes);
    Ok(Pictures { views, points, placement })
}

/// Where the reconstruction lies in the room.
fn placement(place: &Reconstruction, args: &PictureArgs, notes: &mut Vec<String>) -> Result<Placement> {
    if !args.landmark.is_empty() {
        let known = args.landmark.iter().map(|(at, room)| Ok([place.position(at)?.as_dvec3(), room.as_dvec3()]));
        let known: Vec<_> = known.collect::<Result<_>>()?;
        let (placement, left_m) = similarity(&known).context("--landmark")?;
        notes.push(format!(
            "a unit of the reconstruction is {:.4} m; its places are {left_m:.3} m from where --landmark has them",
            placement.units_per_metre.recip()
        ));
        return Ok(placement);
    }
    let mut options = args.options();
    if let Some(([from, to], metres)) = args.landmarks().map_err(|e| anyhow::anyhow!("--distance: {e}"))? {
        options.metres_per_unit = Some(place.metres_per_unit([&from, &to], metres)?);
    }
    Ok(place.place(&options, notes)?)
}

/// Gives each photograph what a network makes of it.
#[cfg(feature = "onnx")]
fn look(views: &mut [View], network: &Path) -> Result<()> {
    let network = promenade_fit::Network::load(network)?;
    for view in views {
        view.made = Some(network.of(&view.photo)?);
    }
    Ok(())
}

#[cfg(not(feature = "onnx"))]
fn look(_: &mut [View], network: &Path) -> Result<()> {
    bail!("{}: this build reads no networks; one that does is made by: {WITH_NETWORKS}", network.display())
}

/// The photographs that are there, evenly chosen among too many.
fn views(place: &Reconstruction, folder: &Path, photos: &Path, notes: &mut Vec<String>) -> Result<Vec<View>> {
    let lenses = Reconstruction::load_lenses(folder)?;
    let mut there = Vec::new();
    for camera in &place.cameras {
        let name = Path::new(&camera.name);
        if !name.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir)) {
            bail!("{}: expected names of images within a folder, found {:?}", folder.display(), camera.name);
        }
        let path = photos.join(name);
        if path.is_file() {
            there.push((camera, path));
        }
    }
    let (found, all) = (there.len(), place.cameras.len());
    if found == 0 {
        bail!("{}: expected photographs named as the {all} images of {}, found none", photos.display(), folder.display());
    }
    if found < all {
        notes.push(format!("{}: {found} of the model's {all} images are there", photos.display()));
    }
    if found > MOST_PHOTOS {
        notes.push(format!("{MOST_PHOTOS} of {found} photographs are taken"));
    }
    let count = found.min(MOST_PHOTOS);
    let mut views = Vec::with_capacity(count);
    for i in 0..count {
        let (camera, path) = &there[i * found / count];
        let lens = *lenses
            .get(&camera.camera)
            .with_context(|| format!("{}: expected a lens of camera {}, found none", folder.display(), camera.camera))?;
        views.push(View { camera: (*camera).clone(), lens, photo: photo(path, &lens)?, made: None });
    }
    Ok(views)
}

/// A photograph, made smaller.
fn photo(path: &Path, lens: &Lens) -> Result<Raster> {
    let planes = picture::read(path)?;
    let size = [planes[0].width, planes[0].height];
    let shape = |w: f64, h: f64| w / h;
    let (own, stated) = (shape(size[0] as f64, size[1] as f64), shape(lens.size[0].into(), lens.size[1].into()));
    if (own / stated - 1.0).abs() > SHAPE {
        let [w, h] = lens.size;
        bail!("{}: expected the shape of its lens, {w} x {h}, found {} x {}", path.display(), size[0], size[1]);
    }
    let longer = size[0].max(size[1]);
    let values = (0..size[0] * size[1]).flat_map(|i| planes.each_ref().map(|plane| plane.of[i])).collect();
    let kept = size.map(|side| (side * MOST_SIDE.min(longer) / longer).max(1));
    Ok(Raster::new(size, 3, values)?.resized(kept))
}
