//! Multi-part EXR files: pictures of one size, each with its own channels.

use super::attributes::{FIRST_ATTRIBUTE, add_texts, sort_attributes, utf8_text};
use super::write::channel_list;
use exr::prelude::{
    AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, Vec2, WritableImage,
};
use std::io::Cursor;

/// A part of an EXR file.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Its name, which must be unique.
    pub name: String,
    /// Channels, in any order; each has one sample per pixel, row by row from the top.
    pub channels: Vec<(String, ChannelSamples)>,
    /// Text attributes to store with it, by name.
    pub metadata: Vec<(String, String)>,
}

/// Samples of one channel.
#[derive(Clone, Debug, PartialEq)]
pub enum ChannelSamples {
    /// 32-bit float.
    Float(Vec<f32>),
    /// Integers: identifiers, which must not be averaged.
    Integer(Vec<u32>),
}

impl ChannelSamples {
    fn to_flat(&self) -> FlatSamples {
        match self {
            Self::Float(samples) => FlatSamples::F32(samples.clone()),
            Self::Integer(samples) => FlatSamples::U32(samples.clone()),
        }
    }
}

/// A complete file with parts of one size (width, height), losslessly compressed; the same parts
/// give the same bytes.
pub(crate) fn encode_parts(size: (usize, usize), parts: &[Part]) -> Result<Vec<u8>, String> {
    check_parts(size, parts)?;
    let layers = parts.iter().map(|part| part_layer(size, part));
    let layers = layers.collect::<Result<Vec<_>, _>>()?;
    let window = IntegerBounds::from_dimensions(Vec2(size.0, size.1));
    let image = Image::from_layers(ImageAttributes::new(window), layers);
    let mut out = Cursor::new(Vec::new());
    let written = image.write().to_buffered(&mut out);
    written.map_err(|e| e.to_string())?;
    let mut bytes = out.into_inner();
    sort_headers(&mut bytes).ok_or("header of an unknown kind")?;
    Ok(bytes)
}

/// Checks that there is at least one part and one pixel, and that names are unique.
fn check_parts((width, height): (usize, usize), parts: &[Part]) -> Result<(), String> {
    if parts.is_empty() || width == 0 || height == 0 {
        return Err(format!(
            "{} parts of {width} x {height} pixels, expected at least one pixel",
            parts.len()
        ));
    }
    for (i, part) in parts.iter().enumerate() {
        if parts[..i].iter().any(|other| other.name == part.name) {
            return Err(format!("two parts are called \"{}\"", part.name));
        }
    }
    Ok(())
}

fn part_layer(
    size: (usize, usize),
    part: &Part,
) -> Result<Layer<AnyChannels<FlatSamples>>, String> {
    let planes = part.channels.iter();
    let planes = planes.map(|(name, samples)| (name.as_str(), samples.to_flat()));
    let channels = channel_list(size, planes).map_err(|e| format!("{}: {e}", part.name))?;
    let mut attributes = LayerAttributes::named(utf8_text(&part.name));
    add_texts(&mut attributes, &part.metadata);
    let (size, encoding) = (Vec2(size.0, size.1), Encoding::SMALL_LOSSLESS);
    Ok(Layer::new(size, attributes, encoding, channels))
}

/// The byte of the version field with the file type flags, and the multi-part flag.
const FLAGS_BYTE: usize = 5;
const SEVERAL_PARTS_FLAG: u8 = 0x10;

/// Sorts the attributes of every header by name. A header ends with a zero, and the list of headers
/// of a multi-part file with another one.
fn sort_headers(bytes: &mut [u8]) -> Option<()> {
    let mut at = FIRST_ATTRIBUTE;
    while *bytes.get(at)? != 0 {
        at = sort_attributes(bytes, at)? + 1;
        if bytes[FLAGS_BYTE] & SEVERAL_PARTS_FLAG == 0 {
            break;
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{ReadChannels, ReadLayers};

    fn parts() -> Vec<Part> {
        let notes = |n: usize| {
            (0..n)
                .map(|i| (format!("note {i}"), format!("{i}")))
                .collect()
        };
        vec![
            Part {
                name: "beauty".into(),
                channels: ["R", "G", "B"]
                    .map(|c| (c.to_string(), ChannelSamples::Float(vec![0.5, 2.0])))
                    .to_vec(),
                metadata: notes(9),
            },
            Part {
                name: "id".into(),
                channels: vec![("id".into(), ChannelSamples::Integer(vec![7, u32::MAX]))],
                metadata: notes(7),
            },
        ]
    }

    #[test]
    fn parts_come_back_and_the_bytes_are_the_same_every_time() {
        let bytes = encode_parts((2, 1), &parts()).unwrap();
        (0..5).for_each(|_| assert_eq!(encode_parts((2, 1), &parts()).unwrap(), bytes));
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .from_buffered(Cursor::new(&bytes))
            .unwrap();
        assert_eq!(image.layer_data.len(), 2);
        let id = &image.layer_data[1];
        assert_eq!(id.attributes.layer_name.as_ref().unwrap().to_string(), "id");
        assert_eq!(
            id.channel_data.list[0].sample_data,
            FlatSamples::U32(vec![7, u32::MAX])
        );
        assert_eq!(id.attributes.other.len(), 7);
    }

    #[test]
    fn one_part_alone_is_a_plain_file_that_our_reader_takes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        crate::io::exr::write_parts(&path, (2, 1), &parts()[..1]).unwrap();
        assert_eq!(
            crate::io::read::<crate::LinearRgb>(&path).unwrap()[(1, 0)],
            crate::LinearRgb::grey(2.0)
        );
        crate::io::exr::write_parts(&path, (2, 1), &parts()).unwrap();
        assert_eq!(
            crate::io::read::<crate::LinearRgb>(&path).unwrap()[(0, 0)],
            crate::LinearRgb::grey(0.5)
        );
    }

    #[test]
    fn parts_that_cannot_be_are_refused() {
        let refused = |size, parts: &[Part]| encode_parts(size, parts).unwrap_err();
        assert!(refused((3, 1), &parts()).contains("beauty: channel R: 2 samples, expected 3 x 1"));
        assert!(refused((2, 1), &[parts()[0].clone(), parts()[0].clone()]).contains("two parts"));
        assert!(refused((2, 1), &[]).contains("0 parts"));
    }
}
