//! What an object was photographed on.

use crate::error::{Error, Result};
use crate::image::Image;
use crate::io;
use crate::pixel::LinearRgb;
use std::path::PathBuf;
use std::str::FromStr;

/// What is known of the screen: `auto`, a colour `R,G,B` (scene-linear) or a photo of the empty screen.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum ScreenSource {
    /// Nothing: it is fitted to each photo.
    #[default]
    Auto,
    /// One colour, evenly lit.
    Color(LinearRgb),
    /// A photo of it without the object.
    Photo(PathBuf),
}

impl ScreenSource {
    /// The colour, where it is told.
    pub(super) fn color(&self) -> Option<LinearRgb> {
        if let Self::Color(color) = self {
            Some(*color)
        } else {
            None
        }
    }

    /// The photo of the empty screen, where there is one.
    pub(super) fn empty(&self) -> Result<Option<Image<LinearRgb>>> {
        if let Self::Photo(path) = self {
            io::read(path).map(Some)
        } else {
            Ok(None)
        }
    }
}

impl FromStr for ScreenSource {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        let numbers: std::result::Result<Vec<f32>, _> =
            text.split(',').map(|n| n.trim().parse()).collect();
        match numbers {
            Err(_) if text.is_empty() => Err(Error::value(
                "screen",
                "empty, expected auto, R,G,B or a photo",
            )),
            Err(_) => Ok(Self::Photo(text.into())),
            Ok(numbers) => {
                let channels: std::result::Result<[f32; 3], _> = numbers.try_into();
                channels.map(|c| Self::Color(c.into())).map_err(|n| {
                    Error::value(
                        "screen",
                        format!("{} numbers, expected auto, R,G,B or a photo", n.len()),
                    )
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_screen_is_told_in_three_ways() {
        let of = |text: &str| ScreenSource::from_str(text);
        assert_eq!(of("auto").unwrap(), ScreenSource::Auto);
        assert_eq!(
            of("0.1, 0.5,0.2").unwrap(),
            ScreenSource::Color(LinearRgb::new(0.1, 0.5, 0.2))
        );
        assert_eq!(
            of("empty.png").unwrap(),
            ScreenSource::Photo("empty.png".into())
        );
        assert_eq!(
            of("1,2").unwrap_err().to_string(),
            "screen: 2 numbers, expected auto, R,G,B or a photo"
        );
        assert!(of("").is_err());
    }
}
