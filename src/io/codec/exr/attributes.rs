//! Attributes of an EXR's headers, as bytes and as text.

use exr::meta::attribute::AttributeValue;
use exr::prelude::{LayerAttributes, Text};

/// Start of the first attribute: after the magic number and the version.
pub(super) const FIRST_ATTRIBUTE: usize = 8;

/// A text as expected by OpenEXR's own library: UTF-8, where the `exr` crate would write Latin-1.
pub(super) fn utf8_text(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}

/// Decodes a text of a file: as Latin-1 if it is not UTF-8.
pub(super) fn string_of(text: &Text) -> String {
    let utf8 = std::str::from_utf8(text.as_slice());
    utf8.map_or_else(|_| text.to_string(), str::to_owned)
}

/// Adds texts to a layer's own attributes.
pub(super) fn add_texts(attributes: &mut LayerAttributes, metadata: &[(String, String)]) {
    for (key, value) in metadata {
        let value = AttributeValue::Text(utf8_text(value));
        attributes.other.insert(utf8_text(key), value);
    }
}

/// An attribute in the bytes of a file: name, type, length and value.
pub(super) struct RawAttribute<'a> {
    /// With the terminating zero.
    pub(super) name: &'a [u8],
    /// With the terminating zero.
    pub(super) kind: &'a [u8],
    /// Start of the value in the file.
    pub(super) value: usize,
    /// End of the value, which may be beyond the end of the file.
    pub(super) end: usize,
}

impl<'a> RawAttribute<'a> {
    /// The attribute that starts at a byte; none if the file ends before its value.
    pub(super) fn read(file: &'a [u8], at: usize) -> Option<Self> {
        let kind = end_of_text(file, at)?;
        let length = end_of_text(file, kind)?;
        let bytes = u32::from_le_bytes(*file.get(length..)?.first_chunk()?);
        let value = length + 4;
        Some(Self {
            name: &file[at..kind],
            kind: &file[kind..length],
            value,
            end: value.checked_add(usize::try_from(bytes).ok()?)?,
        })
    }
}

/// The position after the zero that ends a text.
pub(super) fn end_of_text(file: &[u8], at: usize) -> Option<usize> {
    Some(at + file.get(at..)?.iter().position(|&b| b == 0)? + 1)
}

/// Sorts the attributes of the header that starts at `start` by name, as OpenEXR's own library
/// does: the `exr` crate keeps them in a hash map, whose order differs from run to run. Returns the
/// position after them.
pub(super) fn sort_attributes(file: &mut [u8], start: usize) -> Option<usize> {
    let mut attributes = Vec::new();
    let mut at = start;
    while *file.get(at)? != 0 {
        let end = RawAttribute::read(file, at)?.end;
        attributes.push(file.get(at..end)?.to_vec());
        at = end;
    }
    attributes.sort();
    file[start..at].copy_from_slice(&attributes.concat());
    Some(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_that_is_not_utf_8_is_latin_1() {
        for bytes in ["grün".as_bytes(), b"gr\xfcn"] {
            assert_eq!(string_of(&Text::from_slice_unchecked(bytes)), "grün");
        }
    }
}
