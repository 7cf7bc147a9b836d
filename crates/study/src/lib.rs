//! Listening studies: what is asked, the page that asks it, the server that takes answers, and what the answers say.
//!
//! [`read`] takes answers as the page writes them, or preference tables as papers print them. [`Paired`], [`Abx`] and
//! [`Ratings`] are the figures of one kind of trial each.

#![forbid(unsafe_code)]

mod abx;
mod agreement;
mod answers;
mod bradley_terry;
mod definition;
pub mod http;
mod intake;
mod loudness;
mod page;
mod paired;
mod preferences;
mod range;
mod ratings;
mod server;
mod site;
mod tables;

pub use abx::{Abx, abx};
pub use agreement::{Agreement, consistency};
pub use answers::{Answer, Answers, HEADER, Method, Trial};
pub use bradley_terry::{Strength, Strengths};
pub use definition::{Item, Part, Study};
pub use paired::{Paired, PairedItem, paired};
pub use preferences::Preferences;
pub use range::{LeastDifference, groups};
pub use ratings::{RatedCondition, Ratings, ratings};
pub use server::Server;
pub use site::{Made, write_site};
pub use tables::{Material, read};
