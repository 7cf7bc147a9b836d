//! `promenade measure`: a scene against what was held out of it, or one response.

mod held_out;
mod response;

use crate::args::MeasureArgs;
use anyhow::Result;

pub(crate) fn run(args: &MeasureArgs) -> Result<()> {
    match (&args.scene, &args.response) {
        (Some(scene), None) => held_out::run(scene, args),
        (_, Some(file)) => response::run(file, args),
        (None, None) => anyhow::bail!("expected a scene or --response, found neither"),
    }
}
