//! The tests of this package in one program beside its library, so that the transforms are compiled once.

mod atomic;
mod file;
mod flac;
mod resample;
mod wav;
