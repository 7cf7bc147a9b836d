//! `promenade study`: a page that asks listeners, the server that takes their answers, and what they say.

mod report;

use crate::args::{Study, StudyArgs, StudyServeArgs, StudySiteArgs};
use crate::report as output;
use crate::web::engine;
use anyhow::{Context, Result, bail};
use promenade_study::{Server, Study as Asked, write_site};

pub(crate) fn run(args: &StudyArgs) -> Result<()> {
    match (&args.what, &args.site) {
        (Some(Study::Report(args)), _) => report::run(args),
        (Some(Study::Serve(args)), _) => serve(args),
        (None, Some(args)) => site(args),
        _ => bail!("expected a study, `serve` or `report`"),
    }
}

fn site(args: &StudySiteArgs) -> Result<()> {
    let study = Asked::read(&args.study)?;
    let engine = study.is_live().then(|| engine::read(args.engine.as_deref())).transpose()?;
    let made = write_site(&study, &args.study, &args.output, engine.as_deref())?;
    output::notes(&made.notes);
    let (name, folder) = (&study.study, args.output.display());
    output::print(&format!("{folder}: {name}, {} parts, {} files of sound and scenes\n", study.parts.len(), made.stimuli))?;
    let take = if study.post { "it takes answers" } else { "answers are saved by the page" };
    output::note(format_args!("show it with: promenade study serve {folder} --answers {name}.csv ({take})"));
    Ok(())
}

fn serve(args: &StudyServeArgs) -> Result<()> {
    let server = Server::new(args.listen, &args.host, &args.site, &args.answers)?;
    let address = server.address().context("the server has no address")?;
    output::print(&format!("http://{address}/\n"))?;
    server.run();
    Ok(())
}
