//! Changing single keyframes of a path.
//!
//! Each function leaves keyframes that are in order of time in order of time, or fails and leaves them as they were.
//! They are for an editor's thread.

use promenade_core::{CameraPath, Keyframe, MAX_KEYFRAMES, PathError, Pose};
use thiserror::Error;

/// The least time between two keyframes that [`set_time`] leaves, seconds.
pub const MIN_GAP_S: f64 = 1e-3;

/// Why an edit is not made.
#[derive(Debug, Error, PartialEq)]
pub enum EditError {
    /// There is no keyframe of this number.
    #[error("expected a keyframe from 0 to {last}, found {found}", last = count.wrapping_sub(1))]
    NoSuch {
        /// The number.
        found: usize,
        /// How many there are.
        count: usize,
    },
    /// There is a keyframe at this time already.
    #[error("there is a keyframe at {0} s already")]
    Occupied(f64),
    /// A time, factor or pose is out of range.
    #[error("expected {expected}, found {found}")]
    Value {
        /// What would have been right.
        expected: &'static str,
        /// What was given.
        found: String,
    },
    /// The keyframes make no path, or would make none.
    #[error(transparent)]
    Path(#[from] PathError),
}

/// Adds a keyframe at a time, with the pose that the path has there, so that its shape changes least; its number is returned.
///
/// Before the first keyframe and after the last it has their pose.
///
/// # Errors
/// Keyframes that make no path, a time that is not finite or is that of a keyframe, or [`MAX_KEYFRAMES`] of them.
pub fn insert(keyframes: &mut Vec<Keyframe>, t_s: f64) -> Result<usize, EditError> {
    finite_time(t_s)?;
    let pose = CameraPath::new(keyframes.clone())?.pose_at(t_s);
    let index = keyframes.partition_point(|k| k.t_s < t_s);
    if keyframes.get(index).is_some_and(|k| k.t_s <= t_s) {
        return Err(EditError::Occupied(t_s));
    }
    if keyframes.len() >= MAX_KEYFRAMES {
        return Err(PathError::TooLong { found: keyframes.len() + 1 }.into());
    }
    keyframes.insert(index, Keyframe { t_s, pose });
    Ok(index)
}

/// Gives a keyframe another pose.
///
/// # Errors
/// No such keyframe, or a pose that is not finite.
pub fn move_to(keyframes: &mut [Keyframe], index: usize, pose: Pose) -> Result<(), EditError> {
    let count = keyframes.len();
    let keyframe = keyframes.get_mut(index).ok_or(EditError::NoSuch { found: index, count })?;
    if !pose.is_valid() {
        return Err(EditError::Value { expected: "a finite pose", found: format!("{pose:?}") });
    }
    keyframe.pose = pose;
    Ok(())
}

/// Takes a keyframe out. The last one may go too, which leaves no path.
///
/// # Errors
/// No such keyframe.
pub fn delete(keyframes: &mut Vec<Keyframe>, index: usize) -> Result<Keyframe, EditError> {
    if index >= keyframes.len() {
        return Err(EditError::NoSuch { found: index, count: keyframes.len() });
    }
    Ok(keyframes.remove(index))
}

/// Gives a keyframe another time, as far as its neighbours let it: it stays [`MIN_GAP_S`] from them, or half way between them
/// where they are closer. The time that it has now is returned, seconds.
///
/// # Errors
/// No such keyframe, or a time that is not finite.
pub fn set_time(keyframes: &mut [Keyframe], index: usize, t_s: f64) -> Result<f64, EditError> {
    finite_time(t_s)?;
    if index >= keyframes.len() {
        return Err(EditError::NoSuch { found: index, count: keyframes.len() });
    }
    let before = index.checked_sub(1).map(|i| keyframes[i].t_s);
    let after = keyframes.get(index + 1).map(|k| k.t_s);
    let low = before.map_or(f64::NEG_INFINITY, |b| b + MIN_GAP_S);
    let high = after.map_or(f64::INFINITY, |a| a - MIN_GAP_S);
    let t_s = match before.zip(after) {
        // Where no number lies between them, rounding leaves the time of a neighbour: then it stays where it is.
        Some((b, a)) if low > high => Some(b + 0.5 * (a - b)).filter(|m| b < *m && *m < a).unwrap_or(keyframes[index].t_s),
        _ => t_s.max(low).min(high),
    };
    keyframes[index].t_s = t_s;
    Ok(t_s)
}

/// Turns the path round: the last pose comes first, in the same span of time.
///
/// # Errors
/// Keyframes that make no path.
pub fn reverse(keyframes: &mut Vec<Keyframe>) -> Result<(), EditError> {
    let (Some(first), Some(last)) = (keyframes.first(), keyframes.last()) else { return Ok(()) };
    let (first_s, last_s) = (first.t_s, last.t_s);
    let turned = keyframes.iter().rev().map(|k| Keyframe { t_s: first_s + (last_s - k.t_s), ..*k }).collect();
    replace(keyframes, turned)
}

fn replace(keyframes: &mut Vec<Keyframe>, with: Vec<Keyframe>) -> Result<(), EditError> {
    if !with.is_empty() {
        *keyframes = CameraPath::new(with)?.keyframes().to_vec();
    }
    Ok(())
}

fn finite_time(t_s: f64) -> Result<(), EditError> {
    if t_s.is_finite() { Ok(()) } else { Err(EditError::Value { expected: "a finite time", found: t_s.to_string() }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn walk() -> Vec<Keyframe> {
        let at = |t_s, x, y, yaw| Keyframe { t_s, pose: Pose::from_ypr(Vec3::new(x, y, 1.7), yaw, 0.0, 0.0) };
        vec![at(1.0, 0.0, 0.0, 0.0), at(2.0, 1.0, 0.5, 0.4), at(4.0, 3.0, 0.0, 0.2), at(5.0, 3.5, -1.0, -1.0)]
    }

    fn times(keyframes: &[Keyframe]) -> Vec<f64> {
        keyframes.iter().map(|k| k.t_s).collect()
    }

    #[test]
    fn an_inserted_keyframe_lies_on_the_path() {
        let before = CameraPath::new(walk()).unwrap();
        let mut keyframes = walk();
        assert_eq!(insert(&mut keyframes, 3.0), Ok(2));
        assert_eq!(keyframes[2].pose, before.pose_at(3.0));
        let after = CameraPath::new(keyframes).unwrap();
        for i in 0..400 {
            let t_s = 1.0 + 0.01 * f64::from(i);
            let off = before.pose_at(t_s).position.distance(after.pose_at(t_s).position);
            assert!(off < 0.06, "{off} m at {t_s} s, of a walk of 4 m");
        }
    }

    #[test]
    fn beyond_the_ends_the_ends_go_on() {
        let mut keyframes = walk();
        assert_eq!((insert(&mut keyframes, 0.0), insert(&mut keyframes, 9.0)), (Ok(0), Ok(5)));
        assert_eq!((keyframes[0].pose, keyframes[5].pose), (walk()[0].pose, walk()[3].pose));
        assert_eq!(insert(&mut keyframes, 2.0), Err(EditError::Occupied(2.0)));
        assert!(matches!(insert(&mut keyframes, f64::NAN), Err(EditError::Value { .. })));
        assert_eq!(insert(&mut Vec::new(), 0.0), Err(EditError::Path(PathError::Empty)));
        assert_eq!(keyframes.len(), 6);
    }

    #[test]
    fn keyframes_move_and_go() {
        let mut keyframes = walk();
        move_to(&mut keyframes, 1, Pose::IDENTITY).unwrap();
        assert_eq!((keyframes[1].t_s, keyframes[1].pose), (2.0, Pose::IDENTITY));
        let nowhere = Pose { position: Vec3::NAN, ..Pose::IDENTITY };
        assert!(matches!(move_to(&mut keyframes, 1, nowhere), Err(EditError::Value { .. })));
        assert_eq!(move_to(&mut keyframes, 4, Pose::IDENTITY), Err(EditError::NoSuch { found: 4, count: 4 }));
        assert_eq!(delete(&mut keyframes, 0).unwrap(), walk()[0]);
        assert_eq!(times(&keyframes), [2.0, 4.0, 5.0]);
        assert_eq!(delete(&mut keyframes, 3), Err(EditError::NoSuch { found: 3, count: 3 }));
    }

    #[test]
    fn times_stay_between_their_neighbours() {
        let mut keyframes = walk();
        assert_eq!(set_time(&mut keyframes, 1, 3.5), Ok(3.5));
        assert_eq!(set_time(&mut keyframes, 1, 77.0), Ok(4.0 - MIN_GAP_S));
        assert_eq!(set_time(&mut keyframes, 1, -77.0), Ok(1.0 + MIN_GAP_S));
        assert_eq!(set_time(&mut keyframes, 0, -77.0), Ok(-77.0));
        assert_eq!(set_time(&mut keyframes, 3, 77.0), Ok(77.0));
        assert!(set_time(&mut keyframes, 1, f64::INFINITY).is_err() && set_time(&mut keyframes, 4, 0.0).is_err());
        let mut close = walk();
        (close[0].t_s, close[1].t_s, close[2].t_s) = (1.0, 1.0002, 1.001);
        assert_eq!(set_time(&mut close, 1, 5.0), Ok(1.0005));
        let next = 1.0_f64.next_up();
        (close[1].t_s, close[2].t_s) = (next, next.next_up());
        assert_eq!(set_time(&mut close, 1, 5.0), Ok(next));
        assert!(CameraPath::new(close).is_ok());
    }

    #[test]
    fn paths_turn_round() {
        let mut turned = walk();
        reverse(&mut turned).unwrap();
        assert_eq!(times(&turned), [1.0, 2.0, 4.0, 5.0]);
        let (there, back) = (CameraPath::new(walk()).unwrap(), CameraPath::new(turned.clone()).unwrap());
        for i in 0..=40 {
            let t_s = 0.1 * f64::from(i);
            let (a, b) = (there.pose_at(1.0 + t_s), back.pose_at(5.0 - t_s));
            assert!(a.position.distance(b.position) < 1e-5 && a.orientation.angle_between(b.orientation) < 2e-3, "{t_s}");
        }
        reverse(&mut turned).unwrap();
        assert_eq!(turned, walk());
        assert_eq!(reverse(&mut Vec::new()), Ok(()));
    }
}
