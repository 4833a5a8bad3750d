//! Cryptomatte: soft mattes of all objects in a few channels.

use crate::composite::part::{pixels_of, plain_part};
use crate::deep::DeepImage;
use crate::io::exr::{ChannelSamples, Part};
use crate::pixel::ObjectId;
use crate::render::Cryptomatte;
use std::collections::BTreeSet;

/// Name of the part and of its channels.
const NAME: &str = "CryptoObject";

/// Identifier and visible coverage of up to six objects in each pixel, the most visible first, with
/// the manifest of their names: a part that programs with Cryptomatte support read as it is.
///
/// An object's coverage is the share of the pixel that it hides of what is behind it, seen through
/// what is in front. Everything follows [`Cryptomatte`].
pub fn cryptomatte(deep: &DeepImage, name: impl Fn(ObjectId) -> String) -> Part {
    let samples = pixels_of(deep).flat_map(|(x, y)| deep.at(x, y));
    let objects: BTreeSet<ObjectId> = samples.map(|s| s.object).collect();
    let names: Vec<_> = objects.into_iter().map(|id| (id, name(id))).collect();
    let found = Cryptomatte::new(deep, NAME, &names);
    let channels = found.channels.into_iter();
    let channels = channels.map(|(name, plane)| (name, ChannelSamples::Float(plane)));
    Part {
        metadata: found.metadata,
        ..plain_part(NAME, channels.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deep::DeepSample;
    use crate::image::Image;
    use crate::pixel::LinearRgb;

    #[test]
    fn every_object_is_in_the_part_by_its_name() {
        let sample = |id, visible| DeepSample {
            object: ObjectId(id),
            visible,
            ..DeepSample::default()
        };
        let lists = [vec![sample(1, 0.25), sample(2, 0.5)], vec![]];
        let deep = DeepImage::from_pixels(Image::filled(2, 1, LinearRgb::WHITE), lists);
        let part = cryptomatte(&deep, |id| format!("bottle {}", id.0));
        let (name, first) = &part.channels[1];
        assert_eq!(
            (part.name.as_str(), name.as_str()),
            (NAME, "CryptoObject00.G")
        );
        assert!(matches!(first, ChannelSamples::Float(v) if *v == [0.5, 0.0]));
        let mut texts = part.metadata.iter();
        let (_, manifest) = texts.find(|(key, _)| key.ends_with("/manifest")).unwrap();
        for bottle in ["bottle 1", "bottle 2"] {
            assert!(manifest.contains(&format!("\"{bottle}\":\"")), "{manifest}");
        }
    }
}
