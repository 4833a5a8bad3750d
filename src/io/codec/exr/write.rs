//! Single-part EXR files.

use super::attributes::{FIRST_ATTRIBUTE, add_texts, sort_attributes, utf8_text};
use crate::io::header::Canvas;
use exr::prelude::Compression as Method;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, IntegerBounds, Layer, LayerAttributes,
    SmallVec, Vec2, WritableImage,
};
use std::io::Cursor;

/// Compression of an EXR; all kinds are lossless.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// Uncompressed.
    None,
    /// Deflate over 16 rows: small for rendered pictures.
    #[default]
    Zip,
    /// Wavelets: faster and smaller for grainy photos.
    Piz,
}

impl Compression {
    fn method(self) -> Method {
        match self {
            Self::None => Method::Uncompressed,
            Self::Zip => Method::ZIP16,
            Self::Piz => Method::PIZ,
        }
    }
}

/// A complete file; the same input gives the same bytes.
pub(crate) fn encode(
    size: (usize, usize),
    canvas: Canvas,
    planes: Vec<(&str, FlatSamples)>,
    compression: Compression,
    metadata: &[(String, String)],
) -> Result<Vec<u8>, String> {
    let mut attributes = LayerAttributes::default();
    let channels = channel_list(size, planes)?;
    add_texts(&mut attributes, metadata);
    let encoding = Encoding {
        compression: compression.method(),
        ..Encoding::SMALL_LOSSLESS
    };
    let mut layer = Layer::new(Vec2(size.0, size.1), attributes, encoding, channels);
    layer.attributes.layer_position = Vec2(canvas.at[0], canvas.at[1]);
    let mut image = Image::from_layer(layer);
    image.attributes.pixel_aspect = canvas.pixel_aspect;
    if let Some(([x, y], [width, height])) = canvas.display {
        let window = IntegerBounds::new(Vec2(x, y), Vec2(width, height));
        image.attributes.display_window = window;
    }
    let mut out = Cursor::new(Vec::new());
    image
        .write()
        .to_buffered(&mut out)
        .map_err(|e| e.to_string())?;
    let mut bytes = out.into_inner();
    sort_attributes(&mut bytes, FIRST_ATTRIBUTE).ok_or("header of an unknown kind")?;
    Ok(bytes)
}

/// Channels by name; fails unless there is one sample per pixel.
pub(super) fn channel_list<'a>(
    (width, height): (usize, usize),
    planes: impl IntoIterator<Item = (&'a str, FlatSamples)>,
) -> Result<AnyChannels<FlatSamples>, String> {
    let mut list = SmallVec::new();
    for (name, samples) in planes {
        let count = samples.len();
        if count != width * height {
            return Err(format!(
                "channel {name}: {count} samples, expected {width} x {height}"
            ));
        }
        list.push(AnyChannel::new(utf8_text(name), samples));
    }
    Ok(AnyChannels::sort(list))
}
