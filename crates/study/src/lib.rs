//! Listening studies: what is asked, the page that asks it, the server that takes answers, and what the answers say.
//!
//! [`read`] takes answers as the page writes them, or preference tables as papers print them. [`Paired`], [`Abx`] and
//! [`Ratings`] are the figures of one kind of trial each.
//!
//! ```
//! use promenade_study::{paired, read};
//!
//! // Who preferred what to what, as Harvey et al. (2017) print it. Answers of the page are read by the same call.
//! let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/harvey.csv");
//! let said = read(&[file])?;
//! let report = paired(&said.tables, said.answers.list())?.ok_or("no comparisons")?;
//! for item in &report.items {
//!     println!("{}: {:?}", item.name, item.votes.scores());
//! }
//! assert_eq!(report.items[0].name, "lounge");
//! assert_eq!(report.items[0].votes.scores(), [24, 38, 43, 63]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]

mod abx;
mod agreement;
mod answers;
mod bradley_terry;
mod composite;
mod definition;
pub mod http;
mod intake;
mod loudness;
mod page;
mod paired;
mod persons;
mod place;
mod preferences;
mod range;
mod ratings;
mod server;
mod significance;
mod site;
mod tables;

pub use abx::{Abx, abx, abx_by_person};
pub use agreement::{Agreement, consistency};
pub use answers::{Answer, Answers, HEADER, Method, Role, Trial};
pub use bradley_terry::{Strength, Strengths};
pub use composite::sound_saliency;
pub use definition::{Item, Part, Question, Stimulus, Study};
pub use paired::{Paired, PairedItem, paired};
pub use persons::{Person, persons};
pub use preferences::Preferences;
pub use range::{LEVEL, LeastDifference, groups};
pub use ratings::{RatedCondition, Ratings, ratings};
pub use server::Server;
pub use significance::{Difference, Differences};
pub use site::{Made, write_site};
pub use tables::{Material, read};
