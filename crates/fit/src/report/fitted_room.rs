//! A fitted room, whichever fit it is of.

use super::absorption::Curve;
use crate::error::FitError;
use crate::fits::FullFit;
use crate::measurements::Measurements;
use crate::prediction::RoomModel;
use crate::room::Form;
use promenade_acoustics::Octaves;
use std::collections::BTreeMap;

/// Names of the files beside a report.
#[derive(Clone, Copy, Debug)]
pub struct PictureNames<'a> {
    /// Absorption over frequency.
    pub absorption: &'a str,
    /// The plan that was found over the stated one, which a quick fit does not have.
    pub plan: &'a str,
    /// Decays by octave.
    pub decays: &'a str,
}

/// A room that was fitted: what it says of itself, how it is changed, and what it predicts.
pub trait FittedRoom: RoomModel {
    /// The full fit, if it is one.
    fn full(&self) -> Option<&FullFit>;

    /// The room's form as it was found.
    fn form(&self) -> Form;

    /// Names of the surfaces.
    fn surfaces(&self) -> Vec<String>;

    /// Gives a surface another absorption, by octave from 125 Hz.
    fn set_absorption(&mut self, surface: usize, absorption: &Octaves);

    /// Absorption by surface over frequency.
    fn curves(&self) -> Vec<Curve>;

    /// What these data do not tell, in words.
    fn doubts(&self) -> Vec<String>;

    /// The room as a text in the format OBJ, metres, a group for each material.
    ///
    /// # Errors
    /// A box without a volume.
    fn obj(&self) -> Result<String, FitError>;

    /// Materials of the groups of [`Self::obj`] as `simulate` understands them.
    fn materials(&self) -> BTreeMap<String, String>;

    /// Estimates, what is left, and what is not determined, as Markdown.
    fn markdown(&self, set: &Measurements, pictures: &PictureNames<'_>) -> String;

    /// The numbers of [`Self::markdown`], and all others, as JSON.
    fn json(&self, set: &Measurements) -> serde_json::Value;
}
