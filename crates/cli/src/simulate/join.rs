//! `promenade join`: the parts of a simulation as one set of responses.

use crate::args::JoinArgs;
use crate::report;
use anyhow::Result;
use promenade_baker::simulation;

pub(crate) fn run(args: &JoinArgs) -> Result<()> {
    let count = simulation::join(&args.parts, &args.output)?;
    report::line(format_args!("{}: {count} responses of {} parts", args.output.display(), args.parts.len()));
    Ok(())
}
