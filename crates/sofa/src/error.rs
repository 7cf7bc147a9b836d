//! What can go wrong with a SOFA file.

/// Why a SOFA file cannot be read or makes no head.
pub type SofaError = promenade_fault::Fault;
