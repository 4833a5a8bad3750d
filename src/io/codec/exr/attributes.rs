//! Attributes of an EXR's headers, as bytes and as texts.

use exr::meta::attribute::AttributeValue;
use exr::prelude::{LayerAttributes, Text};

/// Start of the first attribute: behind the magic number and the version.
pub(super) const FIRST_ATTRIBUTE: usize = 8;

/// A text that an EXR can hold.
pub(super) fn latin_text(text: &str) -> Result<Text, String> {
    Text::new_or_none(text).ok_or_else(|| format!("{text:?} cannot stand in an EXR (not Latin-1)"))
}

/// Adds texts to a layer's own attributes.
pub(super) fn add_texts(
    attributes: &mut LayerAttributes,
    metadata: &[(String, String)],
) -> Result<(), String> {
    for (key, value) in metadata {
        let value = text_attribute(value)?;
        attributes.other.insert(latin_text(key)?, value);
    }
    Ok(())
}

fn text_attribute(text: &str) -> Result<AttributeValue, String> {
    latin_text(text).map(AttributeValue::Text)
}

/// An attribute among the bytes of a file: name, kind, length and value.
pub(super) struct RawAttribute<'a> {
    /// With the zero behind it.
    pub(super) name: &'a [u8],
    /// With the zero behind it.
    pub(super) kind: &'a [u8],
    /// Start of the value in the file.
    pub(super) value: usize,
    /// End of the value in the file, which may be shorter.
    pub(super) end: usize,
}

impl<'a> RawAttribute<'a> {
    /// The one that starts at a byte; none where the file ends before its value.
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

/// The byte behind the zero that ends a text.
pub(super) fn end_of_text(file: &[u8], at: usize) -> Option<usize> {
    Some(at + file.get(at..)?.iter().position(|&b| b == 0)? + 1)
}

/// Puts the attributes of the header that starts at `start` in the order of their names, as
/// OpenEXR's own library does: the `exr` crate keeps them in a hash map, whose order differs from
/// run to run. Returns where they end.
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
