//! Numbers in the buffers of a glTF file, with every bound checked.

use super::document::Document;
use crate::PathFileError;
use gltf::json::Accessor;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked;
use promenade_core::MAX_KEYFRAMES;

/// A component of its bytes; integers are shares of their largest value, as glTF 2.0 has it for animations.
fn value(component: ComponentType, bytes: &[u8]) -> f64 {
    match (component, bytes) {
        (ComponentType::F32, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
        (ComponentType::I16, &[a, b]) => (f64::from(i16::from_le_bytes([a, b])) / 32767.0).max(-1.0),
        (ComponentType::U16, &[a, b]) => f64::from(u16::from_le_bytes([a, b])) / 65535.0,
        (ComponentType::I8, &[a]) => (f64::from(i8::from_le_bytes([a])) / 127.0).max(-1.0),
        (ComponentType::U8, &[a]) => f64::from(a) / 255.0,
        _ => f64::NAN,
    }
}

/// The type of the components of an accessor of elements of N, one after the other and no more than a path has use for.
fn component<const N: usize>(
    document: &Document<'_, '_>,
    accessor: &Accessor,
    place: &str,
) -> Result<ComponentType, PathFileError> {
    let type_ = match N {
        1 => Type::Scalar,
        3 => Type::Vec3,
        _ => Type::Vec4,
    };
    if accessor.type_ != Checked::Valid(type_) {
        return Err(document.wrong(place.to_owned(), format!("elements of type {type_:?}"), format!("{:?}", accessor.type_)));
    }
    if accessor.sparse.is_some() {
        return Err(document.wrong(place.to_owned(), "elements one after the other", "sparse ones"));
    }
    // A spline has three elements a key.
    let most = 3 * MAX_KEYFRAMES as u64;
    if accessor.count.0 > most {
        return Err(document.wrong(place.to_owned(), format!("at most {most} elements"), accessor.count.0.to_string()));
    }
    match accessor.component_type {
        // Rotations alone may be integers.
        Checked::Valid(c) if c.0 == ComponentType::F32 || (N == 4 && c.0 != ComponentType::U32) => Ok(c.0),
        other => {
            let expected = "components of 32-bit floats, or integers for a rotation";
            Err(document.wrong(place.to_owned(), expected, format!("{other:?}")))
        }
    }
}

/// The elements of an accessor of scalars (N = 1), vectors (3) or quaternions (4), all finite.
pub(super) fn elements<const N: usize>(document: &mut Document<'_, '_>, index: usize) -> Result<Vec<[f64; N]>, PathFileError> {
    let place = format!("accessor {index}");
    let count_of = document.root.accessors.len();
    let Some(accessor) = document.root.accessors.get(index).cloned() else {
        return Err(document.wrong(place, format!("one of {count_of} accessors"), "none of this number"));
    };
    let component = component::<N>(document, &accessor, &place)?;
    let Some(view_index) = accessor.buffer_view else {
        return Err(document.wrong(place, "a buffer view", "none"));
    };
    let Some(view) = document.root.buffer_views.get(view_index.value()).cloned() else {
        return Err(document.wrong(place, "a buffer view of the file", format!("number {}", view_index.value())));
    };
    let size = (N * component.size()) as u64;
    let stride = view.byte_stride.map_or(size, |s| s.0 as u64);
    if stride < size {
        return Err(document.wrong(place, format!("elements at least {size} bytes apart"), stride.to_string()));
    }
    let count = accessor.count.0;
    let offset = accessor.byte_offset.map_or(0, |o| o.0);
    let (start, view_length) = (view.byte_offset.map_or(0, |o| o.0), view.byte_length.0);
    // Checked from here on: numbers of a damaged file are of any size.
    let span = if count == 0 { Some(0) } else { (count - 1).checked_mul(stride).and_then(|s| s.checked_add(size)) };
    let end = span.and_then(|s| s.checked_add(offset));
    let needs = end.filter(|end| *end <= view_length).and_then(|end| end.checked_add(start));
    let bytes = document.buffer(view.buffer.value())?;
    let held = bytes.len() as u64;
    let Some(bytes) = needs.filter(|n| *n <= held).and_then(|n| usize::try_from(n).ok()).map(|n| &bytes[..n]) else {
        let expected = format!("{count} elements inside its buffer view and buffer");
        return Err(document.wrong(place, expected, format!("a view of {view_length} bytes at {start} in a buffer of {held}")));
    };
    let mut elements = Vec::new();
    for number in 0..count {
        let mut element = [0.0; N];
        let from = usize::try_from(start + offset + number * stride).unwrap_or(usize::MAX);
        for (c, value) in element.iter_mut().enumerate() {
            let at = from.saturating_add(c * component.size());
            *value = self::value(component, bytes.get(at..at.saturating_add(component.size())).unwrap_or_default());
        }
        if !element.iter().all(|v| v.is_finite()) {
            return Err(document.wrong(place, "finite numbers", format!("{element:?} in element {number}")));
        }
        elements.push(element);
    }
    Ok(elements)
}
