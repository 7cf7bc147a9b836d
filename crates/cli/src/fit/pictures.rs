//! Pictures of a room: photographs and the points of their reconstruction.

use crate::args::PictureArgs;
use crate::{picture, report};
use anyhow::{Context, Result, bail};
use promenade_baker::reconstruction::{PointOptions, Reconstruction};
use promenade_core::network::Placement;
use promenade_fit::{Pictures, Raster, View, similarity};
use promenade_paths::colmap::Lens;
use std::path::{Component, Path};

/// Photographs at most, and pixels along the longer side of what is kept of each.
const MOST_PHOTOS: usize = 256;
const MOST_SIDE: usize = 640;
/// How much the shape of a photograph may differ from its lens's.
const SHAPE: f64 = 0.01;

pub(super) fn load(folder: &Path, args: &PictureArgs) -> Result<Pictures> {
    let what = || folder.display().to_string();
    let mut notes = Vec::new();
    let place = Reconstruction::load(folder, &PointOptions::default())?;
    let placement = placement(&place, args, &mut notes).with_context(what)?;
    let points = place.points.iter().map(|p| (p.position, p.colour)).collect();
    let views = match &args.photos {
        Some(photos) => views(&place, folder, photos, &mut notes)?,
        None => Vec::new(),
    };
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
        views.push(View { camera: (*camera).clone(), lens, photo: photo(path, &lens)? });
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
    let values = (0..size[0] * size[1]).map(|i| planes.each_ref().map(|plane| plane.of[i])).collect();
    let kept = size.map(|side| (side * MOST_SIDE.min(longer) / longer).max(1));
    Ok(Raster::new(size, values)?.resized(kept))
}
