//! HEIF, which phones write as HEIC: reads size and colours from its boxes. libheif decodes the
//! pixels.
//!
//! # Method
//! ISO/IEC 14496-12 (boxes) and 23008-12 (item properties): `meta` names the primary item (`pitm`),
//! and `iprp` its properties (`ipco`), each by its number (`ipma`).

use super::profile::ColorDescription;

/// The colour profile or the code points of the primary picture.
pub(crate) fn color_description(bytes: &[u8]) -> Option<ColorDescription> {
    let own = primary_properties(bytes)?;
    let mut colors = own.iter().filter_map(color_of);
    let first = colors.next()?;
    // A profile is more specific than code points.
    let profile = colors.find(|color| matches!(color, ColorDescription::Icc(_)));
    Some(profile.unwrap_or(first))
}

/// Width and height of the primary picture in the orientation given by the file; none if it is cropped.
///
/// libheif 1.15 always rotates the pixels, but the size only if the file lists the rotation after
/// the size.
#[cfg(feature = "oiio")]
pub(crate) fn upright_size(bytes: &[u8]) -> Option<[i64; 2]> {
    let own = primary_properties(bytes)?;
    let content = |kind: &[u8; 4]| Some(own.iter().find(|p| p.kind == *kind)?.content);
    let mut size = full_box(content(b"ispe")?)?.1;
    let [width, height] = [number(&mut size, 4)?, number(&mut size, 4)?].map(i64::from);
    let quarter_turns = content(b"irot").and_then(|irot| irot.first()).unwrap_or(&0);
    let upright = match quarter_turns % 2 {
        0 => [width, height],
        _ => [height, width],
    };
    content(b"clap").is_none().then_some(upright)
}

/// The properties of the primary picture.
fn primary_properties(bytes: &[u8]) -> Option<Vec<HeifBox<'_>>> {
    let meta = full_box(child(bytes, b"meta")?)?.1;
    let primary = primary_item(child(meta, b"pitm")?)?;
    let properties = child(meta, b"iprp")?;
    let numbers = property_numbers(child(properties, b"ipma")?, primary)?;
    let all = boxes(child(properties, b"ipco")?).enumerate();
    let own = all.filter(|(at, _)| numbers.contains(&(at + 1)));
    Some(own.map(|(_, property)| property).collect())
}

/// A box without its header.
struct HeifBox<'a> {
    kind: [u8; 4],
    content: &'a [u8],
}

/// The boxes in some bytes; stops at a box that does not fit.
fn boxes(mut bytes: &[u8]) -> impl Iterator<Item = HeifBox<'_>> {
    std::iter::from_fn(move || {
        let first;
        (first, bytes) = split_box(bytes)?;
        Some(first)
    })
}

/// The first box and the bytes after it.
fn split_box(bytes: &[u8]) -> Option<(HeifBox<'_>, &[u8])> {
    let (size, rest) = bytes.split_first_chunk()?;
    let (&kind, rest) = rest.split_first_chunk()?;
    let (size, rest) = match u32::from_be_bytes(*size) {
        0 => (bytes.len(), rest),
        1 => {
            let (size, rest) = rest.split_first_chunk()?;
            (usize::try_from(u64::from_be_bytes(*size)).ok()?, rest)
        }
        size => (size as usize, rest),
    };
    let header = bytes.len() - rest.len();
    let (content, rest) = rest.split_at_checked(size.checked_sub(header)?)?;
    Some((HeifBox { kind, content }, rest))
}

/// The content of the first box of a type.
fn child<'a>(bytes: &'a [u8], kind: &[u8; 4]) -> Option<&'a [u8]> {
    let found = boxes(bytes).find(|b| b.kind == *kind)?;
    Some(found.content)
}

/// Version and flags at the start of a box, and the rest.
fn full_box(content: &[u8]) -> Option<(FullBox, &[u8])> {
    let (&[version, .., flags], rest) = content.split_first_chunk::<4>()?;
    Some((FullBox { version, flags }, rest))
}

struct FullBox {
    version: u8,
    /// The lowest eight bits.
    flags: u8,
}

fn primary_item(pitm: &[u8]) -> Option<u32> {
    let (head, mut rest) = full_box(pitm)?;
    number(&mut rest, if head.version == 0 { 2 } else { 4 })
}

/// Numbers, starting at 1, of the properties of an item.
fn property_numbers(ipma: &[u8], item: u32) -> Option<Vec<usize>> {
    let (head, mut rest) = full_box(ipma)?;
    let id_bytes = if head.version == 0 { 2 } else { 4 };
    let number_bytes = if head.flags & 1 == 0 { 1 } else { 2 };
    // The highest bit marks a property as essential.
    let mask = (1 << (8 * number_bytes - 1)) - 1;
    let entries = number(&mut rest, 4)?;
    for _ in 0..entries {
        let id = number(&mut rest, id_bytes)?;
        let count = number(&mut rest, 1)?;
        let numbers: Option<Vec<usize>> = (0..count)
            .map(|_| Some((number(&mut rest, number_bytes)? & mask) as usize))
            .collect();
        if id == item {
            return numbers;
        }
    }
    None
}

/// Consumes a big-endian number of `count` bytes, at most 4.
fn number(bytes: &mut &[u8], count: usize) -> Option<u32> {
    let (taken, rest) = bytes.split_at_checked(count)?;
    *bytes = rest;
    Some(
        taken
            .iter()
            .fold(0, |sum, &byte| sum << 8 | u32::from(byte)),
    )
}

fn color_of(property: &HeifBox<'_>) -> Option<ColorDescription> {
    let (kind, rest) = property.content.split_first_chunk::<4>()?;
    match (&property.kind, kind) {
        (b"colr", b"prof" | b"rICC") => Some(ColorDescription::Icc(rest.to_vec())),
        (b"colr", b"nclx") => code_points(rest),
        _ => None,
    }
}

/// ITU-T H.273: 2 means unspecified.
const UNSPECIFIED: u8 = 2;

fn code_points(nclx: &[u8]) -> Option<ColorDescription> {
    let &[0, primaries, 0, transfer] = nclx.first_chunk()? else {
        return None;
    };
    let is_said = primaries != UNSPECIFIED && transfer != UNSPECIFIED;
    is_said.then_some(ColorDescription::CodePoints(primaries, transfer))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxed(kind: &[u8; 4], content: &[&[u8]]) -> Vec<u8> {
        let content = content.concat();
        let size = (content.len() as u32 + 8).to_be_bytes();
        [&size[..], kind, &content].concat()
    }

    /// Two pictures: the thumbnail, 1, is P3; the primary one, 2, has both kinds of colour
    /// description, and is rotated by a property listed before its size.
    fn file(version: u8, flags: u8) -> Vec<u8> {
        let id = |n: u8| {
            if version == 0 {
                vec![0, n]
            } else {
                vec![0, 0, 0, n]
            }
        };
        let property = |n: u8| {
            if flags == 0 {
                vec![0x80 | n]
            } else {
                vec![0x80, n]
            }
        };
        let properties = [
            boxed(b"colr", &[b"nclx", &[0, 12, 0, 13, 0, 6, 0x80]]),
            boxed(b"irot", &[&[3]]),
            boxed(b"colr", &[b"nclx", &[0, 1, 0, 13, 0, 6, 0x80]]),
            boxed(b"colr", &[b"prof", b"a profile"]),
            boxed(b"ispe", &[&[0; 4], &[0, 0, 1, 44], &[0, 0, 0, 32]]),
        ];
        let numbers = |item: u8, of: &[u8]| {
            let all = of.iter().flat_map(|&n| property(n));
            [id(item), vec![of.len() as u8], all.collect()].concat()
        };
        let head = [version, 0, 0, flags];
        let owners = [numbers(1, &[1]), numbers(2, &[2, 3, 4, 5])].concat();
        let ipma = boxed(b"ipma", &[&head, &[0, 0, 0, 2], &owners]);
        let iprp = boxed(b"iprp", &[&boxed(b"ipco", &[&properties.concat()]), &ipma]);
        let pitm = boxed(b"pitm", &[&[version, 0, 0, 0], &id(2)]);
        let meta = boxed(b"meta", &[&[0; 4], &pitm, &iprp]);
        [boxed(b"ftyp", &[b"heic"]), meta].concat()
    }

    #[test]
    fn the_primary_picture_s_own_profile_is_found() {
        let profile = ColorDescription::Icc(b"a profile".to_vec());
        for (version, flags) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let found = color_description(&file(version, flags));
            assert_eq!(found.as_ref(), Some(&profile), "{version} {flags}");
        }
    }

    #[cfg(feature = "oiio")]
    #[test]
    fn a_quarter_turn_exchanges_the_sides() {
        assert_eq!(upright_size(&file(0, 0)), Some([32, 300]));
    }

    #[test]
    fn every_cut_and_every_changed_byte_is_survived() {
        let whole = file(0, 0);
        for at in 0..whole.len() {
            color_description(&whole[..at]);
            let mut changed = whole.clone();
            changed[at] ^= 0xff;
            color_description(&changed);
        }
    }
}
