//! How one world lies in another, by places that are known in both (Umeyama 1991).

use crate::error::FitError;
use nalgebra::Matrix3;
use promenade_core::glam::{DMat3, DQuat, DVec3};
use promenade_core::network::Placement;

/// Places at least.
const LEAST_PLACES: usize = 3;
/// Spread across the line that comes nearest to all places over that along it, below which they lie on it and say nothing of
/// the turn about it.
const LEAST_SPREAD: f64 = 0.02;

/// The placement of a foreign world that takes places nearest to where they are in the room, by least squares of their
/// distances: of each the foreign one, its units, and the room's, metres. With it the root of the mean square of what is left,
/// metres.
///
/// # Errors
/// Fewer than three places, ones that lie on a line in either world, or that are not finite.
pub fn similarity(places: &[[DVec3; 2]]) -> Result<(Placement, f64), FitError> {
    let wrong = |found: String| FitError::argument("places known in both worlds", "three or more, not on a line", found);
    if places.len() < LEAST_PLACES || !places.iter().flatten().all(|p| p.is_finite()) {
        return Err(wrong(format!("{} of them", places.len())));
    }
    let count = places.len() as f64;
    let mean = |side: usize| places.iter().map(|p| p[side]).sum::<DVec3>() / count;
    let middles = [mean(0), mean(1)];
    let off = |p: &[DVec3; 2], side: usize| p[side] - middles[side];
    let product = |a: usize, b: usize| {
        places.iter().fold(Matrix3::<f64>::zeros(), |sum, p| {
            let (a, b) = (off(p, a).to_array(), off(p, b).to_array());
            sum + Matrix3::from_fn(|r, c| a[r] * b[c] / count)
        })
    };
    for side in [0, 1] {
        let mut spread: Vec<f64> = product(side, side).symmetric_eigenvalues().iter().map(|v| v.max(0.0).sqrt()).collect();
        spread.sort_by(f64::total_cmp);
        if spread[2] <= 0.0 || spread[1] < LEAST_SPREAD * spread[2] {
            return Err(wrong(format!("{} that lie on a line or in one place", places.len())));
        }
    }
    let svd = product(1, 0).svd(true, true);
    let (Some(u), Some(v)) = (svd.u, svd.v_t) else { return Err(wrong("ones that have no turn".to_owned())) };
    // A turn, not a mirror: the weakest direction gives way. Singular values come in falling order.
    let mut sign = [1.0, 1.0, (u * v).determinant().signum()];
    let weakest = (0..3).min_by(|a, b| svd.singular_values[*a].total_cmp(&svd.singular_values[*b])).unwrap_or(2);
    sign.swap(2, weakest);
    let turn = u * Matrix3::from_diagonal(&sign.into()) * v;
    let power: f64 = places.iter().map(|p| off(p, 0).length_squared()).sum::<f64>() / count;
    let scale = (0..3).map(|i| sign[i] * svd.singular_values[i]).sum::<f64>() / power;
    let turn = DQuat::from_mat3(&DMat3::from_cols_array_2d(&std::array::from_fn(|c| std::array::from_fn(|r| turn[(r, c)]))));
    let origin = middles[0] - turn.inverse() * middles[1] / scale;
    let left = places.iter().map(|[foreign, room]| (scale * (turn * (*foreign - origin))).distance_squared(*room)).sum::<f64>();
    let placement = Placement {
        units_per_metre: DVec3::splat(scale.recip()).as_vec3().x,
        rotation: turn.inverse().as_quat().normalize(),
        origin: origin.as_vec3(),
    };
    if !placement.is_valid() {
        return Err(wrong(format!("ones between which a metre is {} units", scale.recip())));
    }
    Ok((placement, (left / count).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_places_say_how_a_world_lies_in_a_room() {
        let turn = DQuat::from_euler(promenade_core::glam::EulerRot::ZYX, 0.7, -1.2, 2.1);
        let foreign = [DVec3::new(1.0, 2.0, -3.0), DVec3::new(-2.0, 0.5, 4.0), DVec3::new(0.0, 3.0, 0.2), DVec3::splat(1.7)];
        let room = |f: DVec3| 0.4 * (turn * f) + DVec3::new(5.0, 1.0, 2.0);
        for count in [3, 4] {
            let places: Vec<[DVec3; 2]> = foreign[..count].iter().map(|f| [*f, room(*f)]).collect();
            let (found, left) = similarity(&places).unwrap();
            assert!(left < 1e-9 && (found.units_per_metre - 2.5).abs() < 1e-5, "{left} {found:?}");
            for f in foreign {
                assert!((found.to_scene(f.as_vec3()).as_dvec3() - room(f)).length() < 1e-5, "{found:?}");
                assert!((found.to_foreign(room(f).as_vec3()).as_dvec3() - f).length() < 1e-5, "{found:?}");
            }
        }
        let mut off: Vec<[DVec3; 2]> = foreign.iter().map(|f| [*f, room(*f)]).collect();
        off[1][1].z += 0.1;
        let (_, left) = similarity(&off).unwrap();
        assert!((0.01..0.1).contains(&left), "{left}");
    }

    #[test]
    fn places_that_leave_a_turn_open_are_refused() {
        let on_line: Vec<[DVec3; 2]> = (0..4).map(|i| [DVec3::splat(f64::from(i)), DVec3::X * f64::from(i)]).collect();
        for wrong in [&on_line[..], &on_line[..2], &[[DVec3::ONE; 2]; 3], &[[DVec3::NAN; 2]; 3]] {
            assert!(similarity(wrong).unwrap_err().to_string().contains("not on a line"));
        }
    }
}
