//! Cryptomatte: soft mattes of all objects in a few channels.

use crate::composite::part::{float_part, pixels_of};
use crate::deep::{DeepImage, DeepSample};
use crate::io::exr::Part;
use crate::pixel::ObjectId;
use crate::render::{attribute_name, hex_id, id_of_name};
use std::collections::BTreeMap;

/// Objects kept per pixel, those that are seen most; two in each group of four channels.
const RANKS_PER_PIXEL: usize = 6;

/// What the part and its channels are called.
const NAME: &str = "CryptoObject";

const CHANNELS: [&str; 2 * RANKS_PER_PIXEL] = [
    "CryptoObject00.R",
    "CryptoObject00.G",
    "CryptoObject00.B",
    "CryptoObject00.A",
    "CryptoObject01.R",
    "CryptoObject01.G",
    "CryptoObject01.B",
    "CryptoObject01.A",
    "CryptoObject02.R",
    "CryptoObject02.G",
    "CryptoObject02.B",
    "CryptoObject02.A",
];

/// Identifier and visible coverage of up to six objects of each pixel, the most visible first, with
/// the manifest of their names: a part that programs that know Cryptomatte read as it is.
///
/// An object's coverage is the share of the pixel that it hides of what is behind it, seen through
/// what lies in front.
///
/// # Method
/// [Cryptomatte specification] 1.2: channels `CryptoObject00.R` (identifier), `.G` (coverage),
/// `.B`, `.A` and so on; identifiers are MurmurHash3 (32 bits, seed 0) of the name, their exponent
/// kept away from those of infinity, NaN and denormal numbers.
///
/// [Cryptomatte specification]: https://github.com/Psyop/Cryptomatte
pub fn cryptomatte(deep: &DeepImage, name: impl Fn(ObjectId) -> String) -> Part {
    let ranks = pixels_of(deep).map(|(x, y)| ranked_objects(deep.at(x, y), &name));
    let mut part = float_part(NAME, CHANNELS, ranks);
    let samples = pixels_of(deep).flat_map(|(x, y)| deep.at(x, y));
    let objects: BTreeMap<ObjectId, String> = samples.map(|s| (s.object, name(s.object))).collect();
    part.metadata = part_metadata(objects.values());
    part
}

/// Identifier and coverage, in turn; zeros where there are fewer objects.
fn ranked_objects(
    samples: &[DeepSample],
    name: impl Fn(ObjectId) -> String,
) -> [f32; 2 * RANKS_PER_PIXEL] {
    let mut out = [0.0; 2 * RANKS_PER_PIXEL];
    for (pair, (id, coverage)) in out.chunks_exact_mut(2).zip(most_visible_first(samples)) {
        pair.copy_from_slice(&[id_of_name(&name(id)), coverage]);
    }
    out
}

fn most_visible_first(samples: &[DeepSample]) -> Vec<(ObjectId, f32)> {
    let mut seen = BTreeMap::<ObjectId, f32>::new();
    for s in samples.iter().filter(|s| s.visible > 0.0) {
        *seen.entry(s.object).or_default() += s.visible;
    }
    let mut seen: Vec<_> = seen.into_iter().collect();
    // A stable sort: equally visible objects stay in the order of their ids.
    seen.sort_by(|a, b| b.1.total_cmp(&a.1));
    seen
}

/// The attributes that the specification requires, under the first seven digits of the part's own
/// hash.
fn part_metadata<'a>(names: impl Iterator<Item = &'a String>) -> Vec<(String, String)> {
    let manifest: BTreeMap<&str, String> = names.map(|n| (n.as_str(), hex_id(n))).collect();
    let texts = [
        ("conversion", "uint32_to_float32".into()),
        ("hash", "MurmurHash3_32".into()),
        ("manifest", serde_json::json!(manifest).to_string()),
        ("name", NAME.into()),
    ];
    texts
        .map(|(field, text)| (attribute_name(NAME, field), text))
        .into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;
    use crate::io::exr::ChannelSamples;
    use crate::pixel::{Depth, LinearRgb};

    #[test]
    fn identifiers_are_ordinary_numbers() {
        assert!((0..20_000).all(|i| id_of_name(&format!("object.{i}")).is_normal()));
    }

    #[test]
    fn the_most_visible_objects_come_first_and_one_object_counts_once() {
        let sample = |id, visible| DeepSample {
            object: ObjectId(id),
            depth: Depth(1.0),
            light: LinearRgb::BLACK,
            alpha: visible,
            visible,
        };
        let lists = [
            vec![sample(1, 0.25), sample(2, 0.5), sample(1, 0.125)],
            vec![],
        ];
        let deep = DeepImage::from_pixels(Image::filled(2, 1, LinearRgb::WHITE), lists);
        let part = cryptomatte(&deep, |id| format!("bottle {}", id.0));
        let at = |c: usize| match &part.channels[c].1 {
            ChannelSamples::Float(v) => (v[0], v[1]),
            ChannelSamples::Integer(_) => panic!("integers"),
        };
        assert_eq!(at(0), (id_of_name("bottle 2"), 0.0));
        assert_eq!(
            (at(1), at(3), at(5)),
            ((0.5, 0.0), (0.375, 0.0), (0.0, 0.0))
        );
        let manifest = &part
            .metadata
            .iter()
            .find(|(key, _)| key.ends_with("/manifest"))
            .unwrap()
            .1;
        assert!(
            manifest.contains(&format!("\"bottle 1\":\"{}\"", hex_id("bottle 1"))),
            "{manifest}"
        );
    }
}
