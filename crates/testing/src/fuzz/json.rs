//! Changes of JSON that leave it JSON.

use super::bytes::{REAL, WHOLE};
use fastrand::Rng;
use serde_json::{Value, json};

/// The text with one value changed; none if it is no JSON.
pub(super) fn changed(rng: &mut Rng, text: &[u8]) -> Option<Vec<u8>> {
    if !matches!(text.first(), Some(b'{' | b'[')) {
        return None;
    }
    let mut value = serde_json::from_slice(text).ok()?;
    change(rng, &mut value);
    serde_json::to_vec(&value).ok()
}

/// Changes one value in a value; texts that are JSON themselves are changed within.
pub(super) fn change(rng: &mut Rng, value: &mut Value) {
    let place = rng.usize(..count(value));
    at(value, &mut { place }, &mut |value| one(rng, value));
}

/// Values in a value, itself included.
fn count(value: &Value) -> usize {
    1 + match value {
        Value::Array(values) => values.iter().map(count).sum(),
        Value::Object(values) => values.values().map(count).sum(),
        _ => 0,
    }
}

/// Does something to the value of a number, counted in order.
fn at(value: &mut Value, place: &mut usize, act: &mut dyn FnMut(&mut Value)) -> bool {
    if *place == 0 {
        act(value);
        return true;
    }
    *place -= 1;
    match value {
        Value::Array(values) => values.iter_mut().any(|value| at(value, place, act)),
        Value::Object(values) => values.values_mut().any(|value| at(value, place, act)),
        _ => false,
    }
}

fn one(rng: &mut Rng, value: &mut Value) {
    match value {
        Value::Number(number) if rng.u8(0..8) > 0 => {
            let near = number.as_f64().unwrap_or(0.0);
            *value = match rng.u8(0..4) {
                0 => json!(WHOLE[rng.usize(..WHOLE.len())]),
                1 => json!(REAL[rng.usize(..REAL.len())]),
                2 => json!((near.round() as i64).saturating_add(rng.i64(-2..3))),
                _ => json!(near * [-1.0, 0.5, 2.0, 1.001, 1e6, 1e-6][rng.usize(..6)]),
            };
        }
        Value::String(text) if rng.u8(0..8) > 0 => {
            if let Some(inner) = changed(rng, text.as_bytes()).and_then(|bytes| String::from_utf8(bytes).ok()) {
                *text = inner;
            } else {
                *text = match rng.u8(0..5) {
                    0 => String::new(),
                    1 => text.repeat(1 + rng.usize(..100)),
                    2 => format!("../{text}\0"),
                    3 => text.chars().rev().collect(),
                    _ => text.chars().skip(1).collect(),
                };
            }
        }
        Value::Array(values) if !values.is_empty() && rng.u8(0..8) > 0 => {
            let place = rng.usize(..values.len());
            let one = values[place].clone();
            match rng.u8(0..6) {
                0 => drop(values.remove(place)),
                1 => values.insert(place, one),
                2 => values.extend(std::iter::repeat_n(one, 1 + rng.usize(..300))),
                3 => values.clear(),
                4 => values.reverse(),
                _ => values.truncate(place),
            }
        }
        Value::Object(values) if !values.is_empty() && rng.u8(0..8) > 0 => {
            let keys: Vec<String> = values.keys().cloned().collect();
            let [one, other] = [(); 2].map(|()| keys[rng.usize(..keys.len())].clone());
            let taken = values.get(&one).cloned().unwrap_or_default();
            match rng.u8(0..4) {
                0 => drop(values.remove(&one)),
                1 => drop(values.insert(other, taken)),
                2 => drop(values.insert(format!("{one}2"), taken)),
                _ => {
                    values.remove(&one);
                    values.insert(one.to_uppercase(), taken);
                }
            }
        }
        _ => {
            let old = value.take();
            *value = match rng.u8(0..7) {
                0 => Value::Null,
                1 => json!(true),
                2 => json!("text"),
                3 => json!([]),
                4 => json!({}),
                5 => json!(-1),
                _ => (0..1 + rng.usize(..60)).fold(old, |inner, _| json!([inner])),
            };
        }
    }
}
