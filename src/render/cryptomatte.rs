//! Cryptomatte: the objects in each pixel and their visible coverage, in float channels.

use crate::deep::{DeepImage, DeepSample};
use crate::pixel::ObjectId;
use std::collections::HashMap;

/// Sets of four channels, two ranks each: the usual six ranks.
const CHANNEL_SETS: usize = 3;

/// Channels of a set: id and coverage of one rank, then of the next.
const SET_CHANNELS: [&str; 4] = ["R", "G", "B", "A"];

/// Characters of the layer's key in its attributes.
const KEY_DIGITS: usize = 7;

/// The channels and attributes of one layer.
///
/// # Method
/// [Friedman and Jones, "Cryptomatte Specification" 1.2.0 (2019)][specification]: an object's id is
/// the MurmurHash3 of its name, converted to a float that is neither a NaN nor subnormal; a pixel's
/// objects are ranked by coverage, two ranks per set of four channels; text attributes name the
/// layer, the hash and the objects. Readers need the exact floats: neither half floats nor lossy
/// compression.
///
/// [specification]: https://github.com/Psyop/Cryptomatte
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cryptomatte {
    /// Names and samples, row by row: `CryptoObject00.R`, ...
    pub channels: Vec<(String, Vec<f32>)>,
    /// Names and values of text attributes: `cryptomatte/3ae39a5/name`, ...
    pub metadata: Vec<(String, String)>,
}

impl Cryptomatte {
    /// The layer of the objects in a picture; `names` maps ids to names, and objects without one
    /// are left out.
    ///
    /// Coverage is the visible part of an object. If more than six objects share a pixel, those
    /// with the least coverage are left out.
    pub fn new(deep: &DeepImage, layer: &str, names: &[(ObjectId, String)]) -> Self {
        let ids = names
            .iter()
            .map(|(object, name)| (*object, id_of_name(name)));
        let planes = rank_planes(deep, &ids.collect()).into_iter().enumerate();
        Self {
            channels: planes
                .map(|(i, plane)| (channel_name(layer, i), plane))
                .collect(),
            metadata: layer_metadata(layer, names),
        }
    }
}

/// Samples of each channel, row by row: id and coverage of each rank in turn.
fn rank_planes(deep: &DeepImage, ids: &HashMap<ObjectId, f32>) -> Vec<Vec<f32>> {
    let count = CHANNEL_SETS * SET_CHANNELS.len();
    let mut planes = vec![Vec::with_capacity(deep.width() * deep.height()); count];
    let mut ranks = Vec::new();
    for y in 0..deep.height() {
        for x in 0..deep.width() {
            rank_objects(deep.at(x, y), ids, &mut ranks);
            ranks.resize(count / 2, (0.0, 0.0));
            for (pair, &(id, coverage)) in planes.chunks_exact_mut(2).zip(&ranks) {
                pair[0].push(id);
                pair[1].push(coverage);
            }
        }
    }
    planes
}

/// Ids and visible coverage of a pixel's objects, each once, the most visible first.
fn rank_objects(samples: &[DeepSample], ids: &HashMap<ObjectId, f32>, ranks: &mut Vec<(f32, f32)>) {
    ranks.clear();
    for s in samples.iter().filter(|s| s.visible > 0.0) {
        let Some(&id) = ids.get(&s.object) else {
            continue;
        };
        match ranks.iter_mut().find(|(ranked, _)| *ranked == id) {
            Some((_, coverage)) => *coverage += s.visible,
            None => ranks.push((id, s.visible)),
        }
    }
    // By id for equal coverage, so that nothing depends on depth.
    ranks.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.total_cmp(&b.0)));
}

fn channel_name(layer: &str, i: usize) -> String {
    let (set, channel) = (i / SET_CHANNELS.len(), SET_CHANNELS[i % SET_CHANNELS.len()]);
    format!("{layer}{set:02}.{channel}")
}

fn layer_metadata(layer: &str, names: &[(ObjectId, String)]) -> Vec<(String, String)> {
    let texts = [
        ("name", layer.to_owned()),
        ("hash", "MurmurHash3_32".to_owned()),
        ("conversion", "uint32_to_float32".to_owned()),
        ("manifest", manifest_text(names)),
    ];
    texts
        .map(|(what, text)| (attribute_name(layer, what), text))
        .into()
}

/// Ids by name, as JSON.
fn manifest_text(names: &[(ObjectId, String)]) -> String {
    let ids = names
        .iter()
        .map(|(_, name)| (name.clone(), hex_id(name).into()));
    serde_json::Value::Object(ids.collect()).to_string()
}

/// Name of a layer's attribute, which contains the layer's key.
fn attribute_name(layer: &str, what: &str) -> String {
    let hash = format!("{:08x}", murmur3(layer.as_bytes()));
    format!("cryptomatte/{}/{what}", &hash[..KEY_DIGITS])
}

/// The id of a name as in the manifest.
fn hex_id(name: &str) -> String {
    format!("{:08x}", id_of_name(name).to_bits())
}

/// The id of a name: its hash as a float, with an exponent that avoids zero, subnormals, infinity
/// and NaN.
fn id_of_name(name: &str) -> f32 {
    const MANTISSA: u32 = (1 << 23) - 1;
    const SIGN: u32 = 1 << 31;
    let hash = murmur3(name.as_bytes());
    let exponent = (hash >> 23 & 0xff).clamp(1, 254);
    f32::from_bits(hash & (SIGN | MANTISSA) | exponent << 23)
}

/// MurmurHash3_x86_32 with seed 0, by Austin Appleby, who placed it in the public domain.
fn murmur3(bytes: &[u8]) -> u32 {
    let words = bytes.chunks_exact(4);
    let rest = words.remainder().iter().rev();
    let rest = rest.fold(0, |word, &byte| word << 8 | u32::from(byte));
    let hash = words.fold(0_u32, |hash, word| {
        let word = u32::from_le_bytes([word[0], word[1], word[2], word[3]]);
        (hash ^ mix_word(word))
            .rotate_left(13)
            .wrapping_mul(5)
            .wrapping_add(0xe654_6b64)
    });
    mix_hash(hash ^ mix_word(rest) ^ bytes.len() as u32)
}

/// Final mix, after which every bit of a hash depends on every other.
fn mix_hash(mut hash: u32) -> u32 {
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

fn mix_word(word: u32) -> u32 {
    word.wrapping_mul(0xcc9e_2d51)
        .rotate_left(15)
        .wrapping_mul(0x1b87_3593)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;
    use crate::pixel::LinearRgb;

    /// Values of the Python package mmh3 5, and published test vectors of MurmurHash3_x86_32.
    const HASHES: [(&str, u32); 9] = [
        ("", 0),
        ("test", 0xba6b_d213),
        ("Hello, world!", 0xc036_3e43),
        ("a", 0x3c25_69b2),
        ("ab", 0x9bbf_d75f),
        ("abc", 0xb3dd_93fa),
        ("CryptoObject", 0x3ae3_9a58),
        ("object001_cap_label", 0xe291_0778),
        ("grün", 0x2af5_80c6),
    ];

    #[test]
    fn hashes_are_those_of_murmur3() {
        for (text, hash) in HASHES {
            assert_eq!(murmur3(text.as_bytes()), hash, "{text}");
        }
    }

    #[test]
    fn ids_are_ordinary_numbers() {
        for i in 0..100_000 {
            assert!(id_of_name(&format!("object{i}")).is_normal());
        }
    }

    fn sample(id: u32, visible: f32) -> DeepSample {
        DeepSample {
            object: ObjectId(id),
            visible,
            alpha: 1.0,
            ..DeepSample::default()
        }
    }

    fn ranked<const N: usize>(
        samples: &[DeepSample],
        ids: [(ObjectId, f32); N],
    ) -> Vec<(f32, f32)> {
        let mut ranks = vec![(9.0, 9.0)];
        rank_objects(samples, &HashMap::from(ids), &mut ranks);
        ranks
    }

    #[test]
    fn equal_coverages_are_ranked_by_id_in_either_order_of_depth() {
        let ids = [1, 2].map(|id| (ObjectId(id), id_of_name(&format!("object{id}"))));
        let mut expected = ids.map(|(_, id)| (id, 0.25));
        expected.sort_by(|a, b| a.0.total_cmp(&b.0));
        for [front, back] in [[1, 2], [2, 1]] {
            let samples = [sample(front, 0.25), sample(back, 0.25)];
            assert_eq!(ranked(&samples, ids), expected);
        }
    }

    #[test]
    fn objects_of_one_name_share_a_rank() {
        let bottle = id_of_name("bottle");
        let ids = [1, 2].map(|id| (ObjectId(id), bottle));
        let samples = [sample(1, 0.25), sample(2, 0.5)];
        assert_eq!(ranked(&samples, ids), [(bottle, 0.75)]);
    }

    #[test]
    fn objects_are_ranked_by_what_is_seen_of_them() {
        let pixel = vec![
            sample(1, 0.25),
            sample(2, 0.5),
            sample(3, 0.0),
            sample(9, 0.1),
            // An object with two samples in the pixel counts once.
            sample(1, 0.125),
        ];
        let deep = DeepImage::from_pixels(Image::filled(1, 1, LinearRgb::WHITE), [pixel]);
        let names = [1, 2, 3].map(|id| (ObjectId(id), format!("object{id}")));
        let found = Cryptomatte::new(&deep, "CryptoObject", &names);
        let values: Vec<_> = found.channels.iter().map(|(_, plane)| plane[0]).collect();
        assert_eq!(
            values[..5],
            [
                id_of_name("object2"),
                0.5,
                id_of_name("object1"),
                0.375,
                0.0
            ]
        );
        let [name, manifest] = [0, 3].map(|i| found.metadata[i].1.as_str());
        assert_eq!(name, "CryptoObject");
        let expected = format!("\"object1\":\"{}\"", hex_id("object1"));
        assert!(manifest.contains(&expected), "{manifest}");
        assert_eq!(
            (found.channels.len(), found.channels[7].0.as_str()),
            (12, "CryptoObject01.A")
        );
    }
}
