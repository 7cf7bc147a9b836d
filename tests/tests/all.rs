//! The integration tests of this package in one program: what they share is compiled and linked once.

mod ambisonics;
mod architecture;
mod automation;
mod blocks;
mod complaints;
mod conventions;
mod files;
mod headphones;
mod instances;
mod latency;
mod library;
mod live;
mod many;
mod migration;
mod moving;
mod osc;
mod other_latency;
mod parameters;
mod presets;
mod rates;
mod recipes;
mod scenes;
mod sleep;
mod source_paths;
mod state;
mod validator;
