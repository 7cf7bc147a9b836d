//! The head that stands in for one that is not known.

use promenade_core::Head;
use std::sync::LazyLock;

/// KEMAR with its normal pinnae (Gardner and Martin 1994) as [`Head::to_bytes`] writes it.
const BYTES: &[u8] = include_bytes!("../../data/kemar.head");

/// KEMAR.
pub(crate) fn model_head() -> &'static Head {
    static HEAD: LazyLock<Head> = LazyLock::new(|| Head::from_bytes(BYTES).expect("the head that is built in"));
    &HEAD
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_ears_are_a_heads() {
        let ears = model_head().ears(promenade_core::glam::Vec3::Y);
        assert!((-800e-6..-600e-6).contains(&ears.itd_s()), "{}", ears.itd_s());
    }
}
