//! Where a picture draws the eye: Itti, Koch and Niebur, "A model of saliency-based visual attention for rapid scene analysis",
//! IEEE Trans. Pattern Analysis and Machine Intelligence 20, 1998.

use super::plane::Plane;
use std::f32::consts::PI;

/// Levels of the pyramids: each half as large as the one before.
const LEVELS: usize = 9;
/// Centres, and how many levels their surrounds lie above them.
const CENTRES: [usize; 3] = [2, 3, 4];
const SURROUNDS: [usize; 2] = [3, 4];
/// The level of the maps that are summed.
const MAP: usize = 4;
/// Period and standard deviation of the Gabor filters, pixels of each level, and the filters' reach (the figures of Walther and
/// Koch, Neural Networks 19, 2006).
const PERIOD: f32 = 7.0;
const DEVIATION: f32 = 7.0 / 3.0;
const REACH: i32 = 7;

/// Saliency of each pixel, 0 to 1, of a picture's red, green and blue as they are shown (not linear), 0 to 1 each.
///
/// The largest is 1; a picture in which nothing stands out has 0 everywhere.
///
/// # Panics
/// The three are of different sizes.
#[must_use]
pub fn picture_saliency([red, green, blue]: [&Plane; 3]) -> Plane {
    let size = [red.width, red.height];
    assert!([green, blue].iter().all(|plane| [plane.width, plane.height] == size), "one size");
    let intensity = Plane { of: sum3(red, green, blue, |r, g, b| (r + g + b) / 3.0), ..red.clone() };
    let floor = intensity.most() / 10.0;
    // Hues are of no account where it is dark.
    let hue = |plane: &Plane| plane.with(&intensity, |v, i| if i > floor { v / i } else { 0.0 });
    let [r, g, b] = [red, green, blue].map(hue);
    let positive = |of: fn(f32, f32, f32) -> f32| Plane { of: sum3(&r, &g, &b, |r, g, b| of(r, g, b).max(0.0)), ..r.clone() };
    let opponents = [
        (positive(|r, g, b| r - (g + b) / 2.0), positive(|r, g, b| g - (r + b) / 2.0)),
        (positive(|r, g, b| b - (r + g) / 2.0), positive(|r, g, b| (r + g) / 2.0 - (r - g).abs() / 2.0 - b)),
    ];
    let intensities = pyramid(intensity);
    let map_size = [intensities[MAP].width, intensities[MAP].height];

    let of_intensity = normalised(&conspicuous(&intensities, map_size));
    let mut of_colour: Option<Plane> = None;
    for (one, other) in opponents {
        // Red minus green in the centre against green minus red around it, and so with blue and yellow: twice as strong where
        // the surround is the opposite.
        let difference = pyramid(one.with(&other, |a, b| a - b));
        add(&mut of_colour, conspicuous(&difference, map_size));
    }
    let mut of_orientation: Option<Plane> = None;
    for quarter in 0..4_u8 {
        let angle = f32::from(quarter) * PI / 4.0;
        let oriented: Vec<Plane> = intensities.iter().map(|level| gabor(level, angle)).collect();
        add(&mut of_orientation, normalised(&conspicuous(&oriented, map_size)));
    }
    let mut sum = of_intensity;
    for part in [of_colour, of_orientation].into_iter().flatten() {
        sum = sum.with(&normalised(&part), |a, b| a + b);
    }
    let most = sum.most();
    let whole = sum.resized(size);
    if most > 0.0 { whole.map(|v| (v / most).clamp(0.0, 1.0)) } else { whole }
}

fn sum3(a: &Plane, b: &Plane, c: &Plane, of: impl Fn(f32, f32, f32) -> f32) -> Vec<f32> {
    a.of.iter().zip(&b.of).zip(&c.of).map(|((a, b), c)| of(*a, *b, *c)).collect()
}

fn add(sum: &mut Option<Plane>, plane: Plane) {
    *sum = Some(match sum.take() {
        Some(sum) => sum.with(&plane, |a, b| a + b),
        None => plane,
    });
}

fn pyramid(first: Plane) -> Vec<Plane> {
    let mut levels = vec![first];
    while levels.len() < LEVELS {
        levels.push(levels[levels.len() - 1].halved());
    }
    levels
}

/// The sum of the normalised differences between centres and surrounds.
fn conspicuous(levels: &[Plane], size: [usize; 2]) -> Plane {
    let mut sum: Option<Plane> = None;
    for centre in CENTRES {
        for further in SURROUNDS {
            let middle = &levels[centre];
            let around = levels[centre + further].resized([middle.width, middle.height]);
            let difference = middle.with(&around, |a, b| (a - b).abs());
            add(&mut sum, normalised(&faded(difference)).resized(size));
        }
    }
    sum.unwrap_or_else(|| Plane { width: size[0], height: size[1], of: vec![0.0; size[0] * size[1]] })
}

/// Less near the edges, beyond which nothing is known: a ramp over a 20th of the longer side (as Walther and Koch).
fn faded(mut plane: Plane) -> Plane {
    let border = (plane.width.max(plane.height) + 10) / 20;
    let ramp = |at: usize, of: usize| ((at.min(of - 1 - at) + 1) as f32 / (border + 1) as f32).min(1.0);
    for (i, v) in plane.of.iter_mut().enumerate() {
        *v *= ramp(i % plane.width, plane.width) * ramp(i / plane.width, plane.height);
    }
    plane
}

/// The operator N: 0 to 1, times the square of what the largest is above the mean of the other local maxima. Few peaks stand
/// out, many do not.
fn normalised(plane: &Plane) -> Plane {
    let (width, height) = (plane.width, plane.height);
    let low = plane.of.iter().copied().fold(f32::INFINITY, f32::min);
    let span = plane.of.iter().copied().fold(f32::NEG_INFINITY, f32::max) - low;
    // Differences of rounding are none.
    if span <= 1e-6 {
        return plane.map(|_| 0.0);
    }
    let scaled = plane.map(|v| (v - low) / span);
    let (mut sum, mut count) = (0.0, 0);
    for y in 0..height {
        for x in 0..width {
            let at = |x: usize, y: usize| scaled.of[y * width + x];
            let value = at(x, y);
            let mut peak = value > 0.0 && value < 1.0;
            for other_y in y.saturating_sub(1)..(y + 2).min(height) {
                for other_x in x.saturating_sub(1)..(x + 2).min(width) {
                    peak &= at(other_x, other_y) <= value;
                }
            }
            if peak {
                sum += value;
                count += 1;
            }
        }
    }
    let mean = if count > 0 { sum / count as f32 } else { 0.0 };
    scaled.map(|v| v * (1.0 - mean).powi(2))
}

/// How strong a wave across this direction is: the absolute values of an even and an odd Gabor filter's answers, summed. Both
/// are products of filters along rows and columns.
fn gabor(plane: &Plane, angle: f32) -> Plane {
    let (sin, cos) = (2.0 * PI / PERIOD * angle.sin(), 2.0 * PI / PERIOD * angle.cos());
    let at = |of: &dyn Fn(f32) -> f32| -> Vec<f32> {
        (-REACH..=REACH).map(|i| (-0.5 * (i as f32 / DEVIATION).powi(2)).exp() * of(i as f32)).collect()
    };
    let (plain, total) = {
        let plain = at(&|_| 1.0);
        let total: f32 = plain.iter().sum();
        (plain, total)
    };
    let waves = |turn: f32| [at(&|i| (turn * i).cos()), at(&|i| (turn * i).sin())];
    let ([cos_along, sin_along], [cos_down, sin_down]) = (waves(cos), waves(sin));
    let product = |along: &[f32], down: &[f32]| plane.filtered(along, down).map(|v| v / (total * total));
    // What an even light makes of the even filter is taken off it.
    let share = |weights: &[f32]| weights.iter().sum::<f32>() / total;
    let even_share = share(&cos_along) * share(&cos_down) - share(&sin_along) * share(&sin_down);
    let even = product(&cos_along, &cos_down)
        .with(&product(&sin_along, &sin_down), |a, b| a - b)
        .with(&product(&plain, &plain), |a, b| a - even_share * b);
    let odd = product(&sin_along, &cos_down).with(&product(&cos_along, &sin_down), |a, b| a + b);
    even.with(&odd, |a, b| a.abs() + b.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [256, 192];

    fn picture(of: impl Fn(usize, usize) -> [f32; 3]) -> Plane {
        let planes = [0, 1, 2].map(|channel| {
            let pixels = (0..SIZE[0] * SIZE[1]).map(|i| of(i % SIZE[0], i / SIZE[0])[channel]).collect();
            Plane::new(SIZE, pixels).unwrap()
        });
        picture_saliency([&planes[0], &planes[1], &planes[2]])
    }

    fn peak(map: &Plane) -> [usize; 2] {
        let best = (0..map.of.len()).max_by(|a, b| map.of[*a].total_cmp(&map.of[*b])).unwrap();
        [best % map.width, best / map.width]
    }

    fn near(found: [usize; 2], expected: [usize; 2]) -> bool {
        found.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 24)
    }

    #[test]
    fn nothing_stands_out_of_an_even_picture() {
        assert!(picture(|_, _| [0.4, 0.5, 0.3]).of.iter().all(|v| *v == 0.0));
    }

    /// Patches on a lattice of 32 pixels.
    fn patch(x: usize, y: usize) -> Option<[usize; 2]> {
        let inside = |v: usize| (10..22).contains(&(v % 32));
        (inside(x) && inside(y)).then_some([x / 32, y / 32])
    }

    #[test]
    fn the_one_that_differs_stands_out() {
        // One bright spot among dim ones; one red among green of the same intensity.
        let bright = picture(|x, y| match patch(x, y) {
            Some([5, 1]) => [0.9; 3],
            Some(_) => [0.4; 3],
            None => [0.2; 3],
        });
        assert!(near(peak(&bright), [176, 48]), "{:?}", peak(&bright));
        let red = picture(|x, y| match patch(x, y) {
            Some([2, 4]) => [0.8, 0.1, 0.1],
            Some(_) => [0.1, 0.8, 0.1],
            None => [1.0 / 3.0; 3],
        });
        assert!(near(peak(&red), [80, 144]), "{:?}", peak(&red));
    }

    #[test]
    fn stripes_across_the_others_stand_out() {
        let map = picture(|x, y| {
            let across = (128..192).contains(&x) && (64..128).contains(&y);
            let along = if across { y } else { x };
            [0.5 + 0.4 * (2.0 * PI * along as f32 / 32.0).sin(); 3]
        });
        let [x, y] = peak(&map);
        assert!((128..192).contains(&x) && (64..128).contains(&y), "{x} {y}");
    }

    #[test]
    fn small_pictures_have_maps_too() {
        let plane = Plane::new([3, 1], vec![0.0, 1.0, 0.0]).unwrap();
        let map = picture_saliency([&plane, &plane, &plane]);
        assert_eq!(map.of.len(), 3);
        assert!(map.of.iter().all(|v| (0.0..=1.0).contains(v)));
    }
}
