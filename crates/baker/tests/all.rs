//! The integration tests of this package in one program: what they share is compiled and linked once.

mod capture_layouts;
mod captures;
mod checkpoint;
mod cloud_player;
mod conditions;
mod conventions;
mod evaluation;
mod factory_scenes;
mod field;
mod listener;
mod manifests;
mod reflections;
mod responses;
mod sofa;
