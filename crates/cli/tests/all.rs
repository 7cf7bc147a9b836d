//! The integration tests of this package in one program: what they share is compiled and linked once.

mod captures;
mod commands;
mod common;
mod fit;
mod fit_heard;
mod help;
mod host;
mod map_mix;
mod meshes;
mod paths;
mod pipes;
mod placement;
#[cfg(feature = "train")]
mod refine;
mod response;
mod simulate;
mod study;
mod surface;
mod t20;
mod trade;
#[cfg(feature = "train")]
mod train;
mod visibility;
mod web;
