//! Names by patterns.

/// Whether a name is of the form of a pattern: `*` stands for any letters, `any` for one of them, if the pattern's language
/// has such a sign. The time grows as the product of both lengths at most.
#[must_use]
pub fn fits(pattern: &str, name: &str, any: Option<char>) -> bool {
    let (pattern, name): (Vec<char>, Vec<char>) = (pattern.chars().collect(), name.chars().collect());
    let (mut at, mut letter) = (0, 0);
    // The last `*`, and the letter after what it stands for: more or fewer letters for one before it would change nothing.
    let mut last = None;
    while letter < name.len() {
        match pattern.get(at) {
            Some('*') => {
                last = Some((at, letter));
                at += 1;
            }
            Some(one) if Some(*one) == any || *one == name[letter] => {
                at += 1;
                letter += 1;
            }
            _ => {
                let Some((star, after)) = last else { return false };
                last = Some((star, after + 1));
                (at, letter) = (star + 1, after + 1);
            }
        }
    }
    pattern[at..].iter().all(|rest| *rest == '*')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_stand_for_any_letters() {
        for (pattern, name, fit) in [
            ("", "", true),
            ("*", "", true),
            ("wall", "wall", true),
            ("wall", "walls", false),
            ("*wall*", "north wall.001", true),
            ("a*b*c", "abxbc", true),
            ("a*b*c", "acb", false),
            ("*ä*", "wände", true),
            ("***", "x", true),
            ("*a", "b", false),
            ("?x", "ax", false),
        ] {
            assert_eq!(fits(pattern, name, None), fit, "{pattern} {name}");
        }
        assert!(fits("?x", "ax", Some('?')) && !fits("?x", "x", Some('?')) && fits("*?", "ab", Some('?')));
    }

    #[test]
    fn many_stars_take_no_power_of_time() {
        // As a power of the number of stars this would not end.
        let (pattern, name) = ("*a".repeat(60) + "b", "a".repeat(4000));
        assert!(!fits(&pattern, &name, None));
    }
}
