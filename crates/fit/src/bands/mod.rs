//! Numbers over frequency: octaves of a response, the bands of a fit, and estimates with their errors.

mod estimate;
mod octaves;
mod spaced;

pub use estimate::Estimate;
pub(crate) use estimate::{logistic, logit};
pub use octaves::FITTED_HZ;
pub(crate) use octaves::{
    LEAD_S, binned, db, energy, measures, octave_decays, octave_energies_db, octaves_at, share, split, without_noise,
};
pub use spaced::{BANDS, Bands, PerBand};
