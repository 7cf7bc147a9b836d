//! The integration tests of this package in one program: what they share is compiled and linked once.

mod adm;
mod colmap_models;
mod common;
mod damage;
mod gltf;
mod trajectories;
