//! Pages of remote controls.

/// Knobs on a page.
pub const KNOBS: usize = 8;

/// A page of remote controls as a plugin declares it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RemotePage {
    /// The section that it belongs to.
    pub section: String,
    /// Its name.
    pub name: String,
    /// The numbers of the parameters on its knobs.
    pub parameters: [Option<u32>; KNOBS],
}
