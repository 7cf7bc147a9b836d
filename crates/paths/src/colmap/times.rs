//! When the images of a model were taken.

use super::{Image, cameras, names};
use crate::PathFileError;

/// Images a second where nothing says it: slow enough for photographs, and slower than most films are cut into images.
const IMAGES_PER_SECOND: f64 = 1.0;

/// Seconds of images in the order of their names, the first at 0.
///
/// The names' times of day, else the numbers in their names over the rate, else their order over the rate.
pub(crate) fn of(file: &str, images: &[Image], fps: Option<f64>, notes: &mut Vec<String>) -> Result<Vec<f64>, PathFileError> {
    let rate = fps.unwrap_or(IMAGES_PER_SECOND);
    let assumed = if fps.is_none() { ", assumed; the option fps says otherwise" } else { "" };
    if fps.is_none()
        && images.len() > 1
        && let Some(times) = images.iter().map(|i| names::time_of_day_s(&i.name)).collect::<Option<Vec<f64>>>()
        && rises(&times)
    {
        notes.push("times are the times of day in the images' names".to_owned());
        return Ok(times.iter().map(|t| t - times[0]).collect());
    }
    let numbers = images.iter().map(|i| names::frame_number(&i.name)).collect::<Option<Vec<u64>>>();
    if let Some(numbers) = &numbers {
        if rises(numbers) {
            notes.push(format!("times are the numbers in the images' names, {rate} a second{assumed}"));
            return Ok(numbers.iter().map(|n| (n - numbers[0]) as f64 / rate).collect());
        }
        several_cameras(file, images, numbers)?;
    }
    notes.push(format!("times are the order of the images' names, {rate} a second{assumed}"));
    Ok((0..images.len()).map(|index| index as f64 / rate).collect())
}

fn rises<T: PartialOrd>(values: &[T]) -> bool {
    values.windows(2).all(|pair| pair[0] < pair[1])
}

/// Two images of one number by two cameras are one moment, not two places of a walk.
fn several_cameras(file: &str, images: &[Image], numbers: &[u64]) -> Result<(), PathFileError> {
    let mut order: Vec<usize> = (0..images.len()).collect();
    order.sort_by_key(|i| numbers[*i]);
    let same = |pair: &&[usize]| numbers[pair[0]] == numbers[pair[1]] && images[pair[0]].camera != images[pair[1]].camera;
    let Some(pair) = order.windows(2).find(same) else { return Ok(()) };
    let (one, other) = (&images[pair[0]].name, &images[pair[1]].name);
    let expected = "the images of one camera, which the option camera chooses";
    let found = format!("the number of {one} again; {}", cameras(images));
    Err(PathFileError::entry(file, format!("image {other}"), expected, found))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec3};

    fn times(names: &[&str], fps: Option<f64>) -> (Vec<f64>, String) {
        let image = |name: &&str| Image {
            id: 0,
            name: (*name).to_owned(),
            camera: 1,
            rotation: DQuat::IDENTITY,
            translation: DVec3::ZERO,
        };
        let images: Vec<Image> = names.iter().map(image).collect();
        let mut notes = Vec::new();
        (of("images.txt", &images, fps, &mut notes).unwrap(), notes.join("; "))
    }

    #[test]
    fn names_tell_the_time() {
        let day = ["20240212_003958.jpg", "20240212_004001.jpg"];
        assert_eq!(times(&day, None), (vec![0.0, 3.0], "times are the times of day in the images' names".to_owned()));
        assert_eq!(times(&day, Some(2.0)).0, [0.0, 21.5], "a rate that is given goes before");
        let frames = ["f_010.png", "f_020.png", "f_040.png"];
        let (at, note) = times(&frames, None);
        assert_eq!(at, [0.0, 10.0, 30.0]);
        assert!(note.contains("numbers in the images' names, 1 a second, assumed"), "{note}");
        assert_eq!(
            times(&frames, Some(10.0)),
            (vec![0.0, 1.0, 3.0], "times are the numbers in the images' names, 10 a second".to_owned())
        );
    }

    #[test]
    fn order_tells_it_where_names_do_not() {
        for names in [["a/2.jpg", "b/1.jpg"], ["one.jpg", "two.jpg"], ["a/1.jpg", "b/1.jpg"]] {
            let (at, note) = times(&names, Some(4.0));
            assert_eq!(at, [0.0, 0.25]);
            assert_eq!(note, "times are the order of the images' names, 4 a second");
        }
        assert_eq!(times(&["20240212_003958.jpg"], None).0, [0.0]);
    }
}
