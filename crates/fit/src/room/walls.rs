//! A box that lies anywhere along the axes, and its images with what moves them.

use crate::error::FitError;
use promenade_acoustics::box_images;

/// Names of the walls, in the order of all numbers by wall.
pub const WALLS: [&str; 6] = ["x0", "x1", "y0", "y1", "floor", "ceiling"];

/// The sign along its axis that leads out of a box through a wall.
pub(crate) fn outwards(wall: usize) -> f64 {
    if wall.is_multiple_of(2) { -1.0 } else { 1.0 }
}

/// Where the walls of a box are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walls {
    /// The walls of least coordinates, metres.
    pub low_m: [f64; 3],
    /// The others.
    pub high_m: [f64; 3],
}

/// The path of an image in a box, as a microphone hears it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxPath {
    /// Its distance, metres.
    pub length_m: f64,
    /// Reflections by wall.
    pub hits: [u8; 6],
    /// Where the sound left the source, of unit length.
    pub departure: [f64; 3],
    /// How the distance grows with each coordinate of the source, the microphone and the six walls.
    pub by_source: [f64; 3],
    /// By the microphone.
    pub by_microphone: [f64; 3],
    /// By the wall.
    pub by_wall: [f64; 6],
}

impl BoxPath {
    /// Reflections.
    #[must_use]
    pub fn order(&self) -> u32 {
        self.hits.iter().map(|n| u32::from(*n)).sum()
    }
}

impl Walls {
    /// A box from the origin.
    ///
    /// # Errors
    /// A length that is not 0.5 to 200 m.
    pub fn of_size(size_m: [f64; 3]) -> Result<Self, FitError> {
        let walls = Self { low_m: [0.0; 3], high_m: size_m };
        walls.check()?;
        Ok(walls)
    }

    /// # Errors
    /// A length that is not 0.5 to 200 m.
    pub fn check(&self) -> Result<(), FitError> {
        if self.size_m().iter().all(|l| (0.5..=200.0).contains(l)) {
            return Ok(());
        }
        Err(FitError::argument("lengths of the room", "0.5 to 200 m each", format!("{:?}", self.size_m())))
    }

    /// Lengths, metres.
    #[must_use]
    pub fn size_m(&self) -> [f64; 3] {
        std::array::from_fn(|a| self.high_m[a] - self.low_m[a])
    }

    /// Cubic metres.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        self.size_m().iter().product()
    }

    /// Square metres of each wall.
    #[must_use]
    pub fn areas_m2(&self) -> [f64; 6] {
        let [x, y, z] = self.size_m();
        [y * z, y * z, x * z, x * z, x * y, x * y]
    }

    /// The wall at a number, as axis and whether it is the higher one.
    #[must_use]
    pub fn wall_m(&self, wall: usize) -> f64 {
        if wall.is_multiple_of(2) { self.low_m[wall / 2] } else { self.high_m[wall / 2] }
    }

    /// Puts a wall elsewhere.
    pub fn set_wall(&mut self, wall: usize, at_m: f64) {
        let side = if wall.is_multiple_of(2) { &mut self.low_m } else { &mut self.high_m };
        side[wall / 2] = at_m;
    }

    /// The direct sound and all images of at most `order` reflections and at most `reach_m` metres away.
    #[must_use]
    pub fn paths(&self, source_m: [f64; 3], microphone_m: [f64; 3], order: u32, reach_m: f64) -> Vec<BoxPath> {
        let size = self.size_m();
        box_images(order)
            .iter()
            .filter_map(|image| {
                let odd = image.rooms.map(|n| n % 2 != 0);
                let at = |a: usize| {
                    let from_low = source_m[a] - self.low_m[a];
                    let n = f64::from(image.rooms[a]);
                    self.low_m[a] + n * size[a] + if odd[a] { size[a] - from_low } else { from_low }
                };
                let way: [f64; 3] = std::array::from_fn(|a| at(a) - microphone_m[a]);
                let length_m = way.iter().map(|w| w * w).sum::<f64>().sqrt();
                if length_m > reach_m || length_m < 1e-6 {
                    return None;
                }
                let unit = way.map(|w| w / length_m);
                let side = odd.map(|o| if o { -1.0 } else { 1.0 });
                // The image's place moves with the source as it or as its mirror, and with the walls as often as they mirror
                // it.
                let by_wall = std::array::from_fn(|w| {
                    let a = w / 2;
                    let n = f64::from(image.rooms[a]);
                    let moved = match (w % 2 == 0, odd[a]) {
                        (true, false) => -n,
                        (true, true) => 1.0 - n,
                        (false, false) => n,
                        (false, true) => n + 1.0,
                    };
                    unit[a] * moved
                });
                Some(BoxPath {
                    length_m,
                    hits: image.hits().map(|n| n as u8),
                    departure: std::array::from_fn(|a| -side[a] * unit[a]),
                    by_source: std::array::from_fn(|a| side[a] * unit[a]),
                    by_microphone: unit.map(|u| -u),
                    by_wall,
                })
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Walls = Walls { low_m: [-0.2, 0.1, 0.0], high_m: [5.3, 4.2, 2.9] };

    #[test]
    fn paths_grow_as_their_derivatives_say() {
        let (source, microphone) = ([1.0, 2.0, 1.3], [3.5, 1.2, 1.6]);
        let before = BOX.paths(source, microphone, 4, 60.0);
        const STEP: f64 = 1e-6;
        let check = |after: Vec<BoxPath>, of: &dyn Fn(&BoxPath) -> f64| {
            for (a, b) in before.iter().zip(&after) {
                assert!(((b.length_m - a.length_m) / STEP - of(a)).abs() < 1e-5, "{a:?}");
            }
        };
        for a in 0..3 {
            let mut moved = source;
            moved[a] += STEP;
            check(BOX.paths(moved, microphone, 4, 60.0), &|p| p.by_source[a]);
            let mut moved = microphone;
            moved[a] += STEP;
            check(BOX.paths(source, moved, 4, 60.0), &|p| p.by_microphone[a]);
        }
        for w in 0..6 {
            let mut walls = BOX;
            walls.set_wall(w, BOX.wall_m(w) + STEP);
            check(walls.paths(source, microphone, 4, 60.0), &|p| p.by_wall[w]);
        }
    }

    #[test]
    fn the_floors_echo_leaves_downwards() {
        let paths = BOX.paths([1.0, 2.0, 1.0], [3.0, 2.0, 1.0], 1, 60.0);
        let floor = paths.iter().find(|p| p.hits == [0, 0, 0, 0, 1, 0]).unwrap();
        assert!((floor.length_m - 8f64.sqrt()).abs() < 1e-12 && floor.departure[2] < -0.7 && floor.departure[0] > 0.7);
        assert_eq!(paths.len(), 7);
    }
}
