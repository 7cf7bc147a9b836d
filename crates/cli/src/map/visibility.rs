//! How visibly pictures differ from another, pixel by pixel.

use super::exr;
use crate::args::VisibilityArgs;
use crate::{picture, plot, report};
use anyhow::{Context, Result};
use butteraugli::{ButteraugliParams, Img, ImgVec, RGB, butteraugli_linear};
use promenade_baker::{FileError, atomic};
use std::path::Path;

/// Slope of the psychometric function (Daly, "The visible differences predictor", 1993).
const SLOPE: f32 = 3.5;
/// What three in four see counts as visible.
const VISIBLE: f32 = 0.75;

pub(super) fn run(args: &VisibilityArgs) -> Result<()> {
    let reference = read(&args.reference)?;
    if let Some(folder) = &args.output {
        std::fs::create_dir_all(folder).map_err(FileError::write(folder))?;
    }
    let mut rows =
        vec![["picture", "three in four see, %", "mean probability", "distance, 3-norm"].map(str::to_owned).to_vec()];
    let options = ButteraugliParams::new().with_compute_diffmap(true);
    for path in &args.pictures {
        let found = butteraugli_linear(reference.as_ref(), read(path)?.as_ref(), &options)
            .with_context(|| format!("{} beside {}", path.display(), args.reference.display()))?;
        let seen: Vec<f32> = found.diffmap.iter().flat_map(|map| map.pixels()).map(probability).collect();
        let count = seen.len() as f32;
        let share = 100.0 * seen.iter().filter(|p| **p > VISIBLE).count() as f32 / count;
        let mean = seen.iter().sum::<f32>() / count;
        let name = path.file_stem().map_or_else(|| report::file_name(path), |stem| stem.to_string_lossy().into_owned());
        rows.push(vec![name.clone(), format!("{share:.1}"), format!("{mean:.3}"), format!("{:.2}", found.pnorm_3)]);
        if let Some(folder) = &args.output {
            let size = [reference.width(), reference.height()];
            atomic::write(&folder.join(format!("{name}.png")), &plot::picture_png(size, &seen, Some([0.0, 1.0]))?)?;
            exr::write(&folder.join(format!("{name}.exr")), size, vec![("probability", seen)])?;
        }
    }
    report::print(&report::table(&rows, false))
}

fn read(path: &Path) -> Result<ImgVec<RGB<f32>>> {
    let [red, green, blue] = picture::light(&picture::read(path)?);
    let pixels = red.of.iter().zip(&green.of).zip(&blue.of).map(|((r, g), b)| RGB::new(*r, *g, *b));
    Ok(Img::new(pixels.collect(), red.width, red.height))
}

/// The share of people who see a difference; half of them see a distance of 1, which butteraugli calls just noticeable.
fn probability(distance: f32) -> f32 {
    1.0 - 0.5_f32.powf(distance.max(0.0).powf(SLOPE))
}
