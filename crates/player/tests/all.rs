//! The integration tests of this package in one program: what they share is compiled and linked once.

mod command;
mod common;
mod first_sound;
