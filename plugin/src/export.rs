//! The entry points that hosts look up in the library.

mod clap;
mod vst3;
