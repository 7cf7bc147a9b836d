//! Heads that were measured at several distances.

/// Distances within this ratio are one.
const SAME: f32 = 1.05;

/// Which responses are of the farthest distance, and which that is in words, where a head was measured all around at several.
/// Mixed together they would be of none: near a head levels change with the distance.
#[must_use]
pub fn farthest(distances_m: &[f32]) -> Option<(Vec<bool>, String)> {
    let mut sorted = distances_m.to_vec();
    sorted.sort_by(f32::total_cmp);
    let starts: Vec<usize> = (1..sorted.len()).filter(|i| sorted[*i] > SAME * sorted[i - 1]).collect();
    let from = *starts.last()?;
    let (count, farthest) = (starts.len() + 1, sorted.len() - from);
    // Loudspeakers here and there are one set.
    if 2 * count * farthest < sorted.len() {
        return None;
    }
    let note = format!("at {:.2} m, the farthest of {count} distances", sorted[from]);
    Some((distances_m.iter().map(|d| *d >= sorted[from]).collect(), note))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spheres_are_told_from_loudspeakers_here_and_there() {
        let spheres: Vec<f32> = [0.2, 0.5, 1.0].into_iter().flat_map(|r| [r, 1.01 * r, 0.99 * r]).collect();
        let (kept, note) = farthest(&spheres).unwrap();
        assert_eq!(kept, [false, false, false, false, false, false, true, true, true]);
        assert!(note.contains("at 0.99 m, the farthest of 3 distances"), "{note}");
        assert!(farthest(&[1.5; 9]).is_none() && farthest(&[]).is_none());
        assert!(farthest(&[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 2.0]).is_none());
    }
}
