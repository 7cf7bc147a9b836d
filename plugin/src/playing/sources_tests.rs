//! Further sources as they are prepared, and what is said where they cannot be heard.

use crate::library::cache;
use crate::parameter::Parameter;
use crate::playing::loader::{Loader, Prepared};
use crate::playing::output::Output;
use crate::project::params::PromenadeParams;
use std::sync::Arc;

/// How many further sources are played next.
fn further(loader: &Loader) -> usize {
    let Some(Prepared::Scene(pairs)) = loader.scenes.pop() else { panic!("nothing is prepared") };
    pairs.first().unwrap().renderer().voices() - 1
}

#[test]
fn every_latency_has_all_sources() {
    let _alone = cache::alone();
    let params = Arc::new(PromenadeParams::default().with_further(3));
    let loader = Loader::new(Arc::clone(&params));
    loader.activate(48_000.0, Output::Binaural);
    assert_eq!((further(&loader), loader.exchange.sources_report.text()), (3, String::new()));
    let choose = |latency| {
        params.remote.set(Parameter::Latency, latency, params.hosted(Parameter::Latency));
        loader.refresh();
        (further(&loader), loader.exchange.sources_report.text())
    };
    for latency in [2.0, 1.0, 0.0] {
        assert_eq!(choose(latency), (3, String::new()));
    }
}
