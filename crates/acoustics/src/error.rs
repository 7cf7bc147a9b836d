//! What can be wrong with a room.

/// Why a room cannot be made or traced.
pub type AcousticsError = promenade_fault::Fault;

/// A place that is three finite numbers.
pub(crate) fn place(what: &str, at: [f64; 3]) -> Result<glam::DVec3, AcousticsError> {
    let place = glam::DVec3::from_array(at);
    if place.is_finite() {
        return Ok(place);
    }
    Err(AcousticsError::argument(what, "three finite coordinates in metres", place))
}
