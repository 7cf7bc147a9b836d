//! The tests of this package in one program beside its library, so that the transforms are compiled once.

mod minimum_phase;
mod whole;
