//! `promenade study`: what answers to a listening study say.

mod report;

use crate::args::{Study, StudyArgs};
use anyhow::Result;

pub(crate) fn run(args: &StudyArgs) -> Result<()> {
    match &args.what {
        Study::Report(args) => report::run(args),
    }
}
