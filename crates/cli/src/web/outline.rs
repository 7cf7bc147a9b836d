//! Edges of a room's mesh, to be drawn.

use anyhow::{Context, Result};
use promenade_acoustics::Mesh;
use promenade_baker::file;
use std::collections::BTreeSet;
use std::path::Path;

const MOST_BYTES: u64 = 1 << 24;
/// More edges than this are no outline, but a tangle.
const MOST_EDGES: usize = 20_000;

/// Edges of an OBJ file's faces, each once, as x, y, z of both ends; `None` for a mesh too fine to draw.
pub(crate) fn of(path: &Path) -> Result<Option<Vec<[f32; 6]>>> {
    let bytes = file::read(path, MOST_BYTES).with_context(|| format!("{}: cannot be read", path.display()))?;
    // As `simulate` takes it.
    let lies = Mesh::load(path).is_ok_and(|mut mesh| mesh.stand_up(path, None));
    let stand = |[x, y, z, u, v, w]: [f32; 6]| if lies { [x, -z, y, u, -w, v] } else { [x, y, z, u, v, w] };
    Ok(edges(&String::from_utf8_lossy(&bytes)).map(|edges| edges.into_iter().map(stand).collect()))
}

fn edges(text: &str) -> Option<Vec<[f32; 6]>> {
    let mut corners: Vec<[f32; 3]> = Vec::new();
    let mut edges = BTreeSet::new();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let numbers: Vec<f32> = words.map_while(|w| w.parse().ok()).collect();
                corners.push(*numbers.first_chunk::<3>()?);
            }
            Some("f") => {
                let face: Vec<usize> = words.map_while(|word| corner(word, corners.len())).collect();
                let next = face.iter().cycle().skip(1);
                edges.extend(face.iter().zip(next).filter(|(a, b)| a != b).map(|(a, b)| (*a.min(b), *a.max(b))));
            }
            _ => {}
        }
    }
    if edges.len() > MOST_EDGES {
        return None;
    }
    let ends = |(a, b): &(usize, usize)| {
        let ([x, y, z], [u, v, w]) = (*corners.get(*a)?, *corners.get(*b)?);
        Some([x, y, z, u, v, w])
    };
    edges.iter().map(ends).collect()
}

/// The number of a corner from a face's word, from 1 on or from the last one backwards.
fn corner(word: &str, count: usize) -> Option<usize> {
    let number: isize = word.split('/').next()?.parse().ok()?;
    if number < 0 { count.checked_add_signed(number) } else { usize::try_from(number).ok()?.checked_sub(1) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_of_two_faces_is_there_once() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 2\nf 1 2 3\nf 1/1 3//2 -1\n";
        let edges = edges(text).unwrap();
        assert_eq!(edges.len(), 5);
        assert_eq!(edges[0], [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
        assert!(super::edges("v 0 0\n").is_none() && super::edges("v 0 0 0\nf 1 9 1\n").is_none());
    }
}
