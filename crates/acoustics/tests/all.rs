//! The integration tests of this package in one program: what they share is compiled and linked once.

mod common;
mod curved;
mod diffraction;
mod extremes;
mod images;
mod late_field;
mod measured_echoes;
mod mesh;
mod modes;
mod particles;
mod upright;
mod waves;
