//! What the names of images say: their order, a frame's number, a time of day.

use std::cmp::Ordering;

/// Orders names as people do, numbers in them by their value: `a2` before `a10`.
pub(super) fn natural(a: &str, b: &str) -> Ordering {
    let (mut x, mut y) = (a, b);
    loop {
        let (number_x, number_y) = (digits(x), digits(y));
        if !number_x.is_empty() && !number_y.is_empty() {
            let (short_x, short_y) = (number_x.trim_start_matches('0'), number_y.trim_start_matches('0'));
            let order = short_x.len().cmp(&short_y.len()).then_with(|| short_x.cmp(short_y));
            if order.is_ne() {
                return order;
            }
            (x, y) = (&x[number_x.len()..], &y[number_y.len()..]);
            continue;
        }
        let (mut rest_x, mut rest_y) = (x.chars(), y.chars());
        match (rest_x.next(), rest_y.next()) {
            // Names that differ only in leading zeros have an order too.
            (None, None) => return a.cmp(b),
            (first, second) if first != second => return first.cmp(&second),
            _ => (x, y) = (rest_x.as_str(), rest_y.as_str()),
        }
    }
}

/// The digits that a text begins with.
fn digits(text: &str) -> &str {
    &text[..text.bytes().take_while(u8::is_ascii_digit).count()]
}

/// A name without folders and ending.
fn stem(name: &str) -> &str {
    let file = name.rsplit(['/', '\\']).next().unwrap_or(name);
    file.rsplit_once('.').map_or(file, |(stem, _)| stem)
}

/// The last number of a file's name.
pub(super) fn frame_number(name: &str) -> Option<u64> {
    let stem = stem(name);
    let end = stem.rfind(|c: char| c.is_ascii_digit())? + 1;
    let start =
        stem[..end].rfind(|c: char| !c.is_ascii_digit()).map_or(0, |i| i + stem[i..].chars().next().map_or(1, char::len_utf8));
    stem[start..end].parse().ok()
}

/// The time that cameras and telephones put into names, `20240212_003919` or `20240212-003919123`, in seconds from a day long
/// ago.
pub(super) fn time_of_day_s(name: &str) -> Option<f64> {
    let stem = stem(name);
    let runs: Vec<&str> = stem.split(|c: char| !c.is_ascii_digit()).filter(|r| !r.is_empty()).collect();
    let parted = |pair: &[&str]| (pair[0].len() == 8).then(|| stamp(pair[0], pair[1])).flatten();
    let joined = |run: &&str| (run.len() == 14 && run.is_ascii()).then(|| stamp(&run[..8], &run[8..])).flatten();
    runs.windows(2).find_map(parted).or_else(|| runs.iter().find_map(joined))
}

/// Seconds of a date of 8 digits and a time of 6, or of 9 with milliseconds.
fn stamp(date: &str, time: &str) -> Option<f64> {
    let number = |text: &str, from: usize, to: usize| text.get(from..to)?.parse::<u32>().ok();
    let (year, month, day) = (number(date, 0, 4)?, number(date, 4, 6)?, number(date, 6, 8)?);
    let (hour, minute, second) = (number(time, 0, 2)?, number(time, 2, 4)?, number(time, 4, 6)?);
    let millisecond = match time.len() {
        6 => 0,
        9 => number(time, 6, 9)?,
        _ => return None,
    };
    let plausible = (1970..2200).contains(&year)
        && (1..=12).contains(&month)
        && (1..=31).contains(&day)
        && hour < 24
        && minute < 60
        && second < 61;
    let leap = |year: u32| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let leap_days = (1970..year).map(|y| u32::from(leap(y))).sum::<u32>() + u32::from(month > 2 && leap(year));
    let months: u32 = [31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30].iter().take(month as usize - usize::from(month > 0)).sum();
    let days = 365 * (year.checked_sub(1970)?) + leap_days + months + day;
    let seconds = f64::from(days) * 86_400.0 + f64::from(hour * 3600 + minute * 60 + second);
    plausible.then(|| seconds + f64::from(millisecond) * 1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_count_by_their_value() {
        let mut names = ["b1", "a10.jpg", "a2.jpg", "a02.jpg", "a2b", "a", "a10000000000000000000000.jpg", "é1", "1/9", "1/10"];
        names.sort_by(|a, b| natural(a, b));
        assert_eq!(
            names,
            ["1/9", "1/10", "a", "a02.jpg", "a2.jpg", "a2b", "a10.jpg", "a10000000000000000000000.jpg", "b1", "é1"]
        );
    }

    #[test]
    fn the_last_number_is_the_frames() {
        for (name, number) in [
            ("frame_00012.png", Some(12)),
            ("cam1/7.jpg", Some(7)),
            ("100_7100.JPG", Some(7100)),
            ("v2/abc.jpg", None),
            ("12é34é.jpg", Some(34)),
            ("99999999999999999999999.jpg", None),
        ] {
            assert_eq!(frame_number(name), number, "{name}");
        }
    }

    #[test]
    fn times_of_day_are_seconds_apart() {
        let apart = |a: &str, b: &str| time_of_day_s(b).unwrap() - time_of_day_s(a).unwrap();
        assert_eq!(apart("20240212_003958.jpg", "20240212_004001.jpg"), 3.0);
        assert_eq!(apart("IMG_20231231_235959.jpg", "IMG_20240101_000001.jpg"), 2.0);
        assert_eq!(apart("20240228-120000.jpg", "20240301-120000.jpg"), 2.0 * 86_400.0, "2024 is a leap year");
        assert_eq!(apart("20230228-120000.jpg", "20230301-120000.jpg"), 86_400.0);
        assert!((apart("PXL_20240212_003919250.MP.jpg", "PXL_20240212_003919750.MP.jpg") - 0.5).abs() < 1e-6);
        assert_eq!(apart("a/20240212003919(1).jpg", "a/20240212003920(1).jpg"), 1.0);
        for name in
            ["20241312_003919.jpg", "20240012_003919.jpg", "20240212_253919.jpg", "00010101_000000.jpg", "12345678_12.jpg", "x"]
        {
            assert_eq!(time_of_day_s(name), None, "{name}");
        }
    }
}
