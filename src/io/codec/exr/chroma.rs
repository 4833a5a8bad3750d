//! EXR channels with fewer samples than pixels: luminance with subsampled chroma (`Y`, `RY`, `BY`).
//!
//! # Method
//! OpenEXR's technical introduction, "Luminance/Chroma Images": `RY = (R - Y) / Y`, `BY = (B - Y) /
//! Y`, and `Y` is the sum of the colours weighted by the luminance of their primaries. Chroma
//! samples are located at the first of the pixels that they cover; between them chroma is
//! interpolated linearly, where OpenEXR uses a longer filter.

use super::attributes::{FIRST_ATTRIBUTE, RawAttribute, end_of_text};
use super::samples::{SampleLine, to_floats};
use crate::color::{RgbSpace, xyz_from_rgb};
use crate::io::codec::refusal::Refusal;
use exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock};
use exr::meta::header::Header;
use exr::prelude::{Compression, IntegerBounds, Vec2};
use std::ops::Range;

/// Names of luminance and the two chroma channels.
pub(super) const LUMINANCE_CHROMA: [&str; 3] = ["Y", "RY", "BY"];
/// Maximum number of pixels per sample, along each axis.
const MAX_SAMPLING: u32 = 4;
/// The sampling of a channel with one sample per pixel, as bytes.
const FULL_SAMPLING: [u8; 8] = [1, 0, 0, 0, 1, 0, 0, 0];
/// Bytes between the name of a channel and its sampling: the sample type, a flag, and three
/// reserved bytes.
const BEFORE_SAMPLING: usize = 4 + 1 + 3;

/// Pixels per sample of each channel, along x and y.
pub(super) struct Sampling(Vec<[usize; 2]>);

impl Sampling {
    /// The sampling of a file's first part, and the file modified to declare one sample per pixel,
    /// which the decoder accepts. None for a file that already has one per pixel, or is malformed.
    pub(super) fn find(file: &[u8]) -> Option<(Self, Vec<u8>)> {
        let offsets = sampling_offsets(file)?;
        let pairs = offsets
            .iter()
            .map(|&at| Some([read_sampling(file, at)?, read_sampling(file, at + 4)?]));
        let pairs: Vec<[usize; 2]> = pairs.collect::<Option<_>>()?;
        if pairs.iter().flatten().all(|&n| n == 1) {
            return None;
        }
        let mut even = file.to_vec();
        for at in offsets {
            even[at..at + FULL_SAMPLING.len()].copy_from_slice(&FULL_SAMPLING);
        }
        Some((Self(pairs), even))
    }

    /// Checks that the part is supported: scan lines, with a window divisible by every sampling.
    pub(super) fn check(&self, header: &Header) -> Result<(), Refusal> {
        let divides = self.0.iter().all(|&pair| divides(pair, header));
        match header.blocks {
            exr::meta::BlockDescription::ScanLines if divides => Ok(()),
            _ => Err("damaged EXR: channel subsampling that does not divide the picture".into()),
        }
    }

    /// Rows of pixels per sample of a channel.
    pub(super) fn rows(&self, channel: usize) -> usize {
        self.0[channel][1]
    }

    /// The samples of a block of rows, enlarged along x; rows between stored samples repeat the one
    /// before them.
    pub(super) fn decode_lines(
        &self,
        header: &Header,
        chunk: Chunk,
    ) -> Result<Vec<SampleLine>, Refusal> {
        let CompressedBlock::ScanLine(block) = chunk.compressed_block else {
            return Err("damaged EXR: a block of another kind".into());
        };
        let rows = block_rows(header, &block)?;
        let lines = self.stored_lines(header, rows.clone());
        let bytes = lines.iter().map(|line| line.bytes).sum();
        let data = self.decompress(header, block, rows, bytes)?;
        self.split_lines(header, &lines, &data)
    }

    /// The stored lines in a block of rows, in file order.
    fn stored_lines(&self, header: &Header, rows: Range<usize>) -> Vec<StoredLine> {
        let mut lines = Vec::new();
        for y in rows {
            for (channel, &[x_step, y_step]) in self.0.iter().enumerate() {
                let kind = header.channels.list[channel].sample_type;
                if y.is_multiple_of(y_step) {
                    lines.push(StoredLine {
                        channel,
                        y,
                        bytes: header.layer_size.x() / x_step * kind.bytes_per_sample(),
                    });
                }
            }
        }
        lines
    }

    /// Decompresses a block; the decoder treats it as pixels with equally many bytes each.
    fn decompress(
        &self,
        header: &Header,
        block: CompressedScanLineBlock,
        rows: Range<usize>,
        bytes: usize,
    ) -> Result<Vec<u8>, Refusal> {
        let width = header.layer_size.x();
        let pixels = width * rows.len();
        if !bytes.is_multiple_of(pixels) {
            return Err(Refusal::Unsupported(
                "unsupported EXR: this channel subsampling".into(),
            ));
        }
        let declared = self.declared(header, bytes / pixels);
        let section = IntegerBounds::new(Vec2(0, rows.start as i32), Vec2(width, rows.len()));
        let data = block.compressed_pixels_le;
        let compression = header.compression;
        // A block that does not compress is stored uncompressed.
        if data.len() != bytes {
            check_decodable(compression)?;
        }
        Ok(compression.decompress_image_section_from_le(&declared, data, section, false)?)
    }

    /// A header with the samplings and this number of bytes per pixel.
    fn declared(&self, header: &Header, bytes_per_pixel: usize) -> Header {
        let mut declared = header.clone();
        declared.channels.bytes_per_pixel = bytes_per_pixel;
        for (channel, &[x, y]) in declared.channels.list.iter_mut().zip(&self.0) {
            channel.sampling = Vec2(x, y);
        }
        declared
    }

    /// Splits the bytes of a block into lines, each repeated for the rows that it covers.
    fn split_lines(
        &self,
        header: &Header,
        lines: &[StoredLine],
        mut data: &[u8],
    ) -> Result<Vec<SampleLine>, Refusal> {
        let mut out = Vec::new();
        for line in lines {
            let bytes;
            (bytes, data) = data
                .split_at_checked(line.bytes)
                .ok_or("damaged EXR: a block that is too short")?;
            out.extend(self.repeated_line(header, line, bytes));
        }
        Ok(out)
    }

    /// A stored line, enlarged, once for each row that it covers.
    fn repeated_line(
        &self,
        header: &Header,
        &StoredLine { channel, y, .. }: &StoredLine,
        bytes: &[u8],
    ) -> impl Iterator<Item = SampleLine> + use<> {
        let [x_step, y_step] = self.0[channel];
        let mut samples = Vec::new();
        let kind = header.channels.list[channel].sample_type;
        to_floats(bytes, kind, &mut samples);
        let samples = enlarged(&samples, x_step);
        let rows = y..(y + y_step).min(header.layer_size.y());
        rows.map(move |y| SampleLine {
            channel,
            y,
            samples: samples.clone(),
        })
    }
}

/// Rejects B44, whose decoder panics on channels with fewer samples than pixels.
fn check_decodable(compression: Compression) -> Result<(), Refusal> {
    let name = match compression {
        Compression::B44 => "B44",
        Compression::B44A => "B44A",
        _ => return Ok(()),
    };
    let what = format!(
        "unsupported EXR: subsampled channels compressed by {name}; save it as RGB or with ZIP compression"
    );
    Err(Refusal::Unsupported(what))
}

/// A line of samples in a block.
struct StoredLine {
    channel: usize,
    y: usize,
    bytes: usize,
}

/// Whether a sampling divides the position and size of a part.
fn divides([x, y]: [usize; 2], header: &Header) -> bool {
    let (at, size) = (header.own_attributes.layer_position, header.layer_size);
    at.x().rem_euclid(x as i32) == 0
        && at.y().rem_euclid(y as i32) == 0
        && size.x() % x == 0
        && size.y() % y == 0
}

/// The rows of the part in a block.
fn block_rows(header: &Header, block: &CompressedScanLineBlock) -> Result<Range<usize>, Refusal> {
    let top = i64::from(block.y_coordinate) - i64::from(header.own_attributes.layer_position.y());
    let height = header.layer_size.y();
    let most = header.compression.scan_lines_per_block();
    match usize::try_from(top) {
        Ok(y) if y < height && y % most == 0 => Ok(y..(y + most).min(height)),
        _ => Err("damaged EXR: a block outside the picture".into()),
    }
}

/// `n` values per sample, linearly interpolated to the next one; the last is repeated.
fn enlarged(samples: &[f32], n: usize) -> Vec<f32> {
    let next = samples.iter().skip(1).chain(samples.last());
    samples
        .iter()
        .zip(next)
        .flat_map(|(&a, &b)| (0..n).map(move |i| a + (b - a) * (i as f32 / n as f32)))
        .collect()
}

/// Byte offsets of the samplings of the first part's channels.
fn sampling_offsets(file: &[u8]) -> Option<Vec<usize>> {
    let mut at = FIRST_ATTRIBUTE;
    while *file.get(at)? != 0 {
        let attribute = RawAttribute::read(file, at)?;
        if attribute.name == b"channels\0" && attribute.kind == b"chlist\0" {
            return offsets_in_list(file, attribute.value);
        }
        at = attribute.end;
    }
    None
}

/// The same within the channel list: each channel has a name, some bytes, and its sampling.
fn offsets_in_list(file: &[u8], mut at: usize) -> Option<Vec<usize>> {
    let mut offsets = Vec::new();
    while *file.get(at)? != 0 {
        let sampling = end_of_text(file, at)? + BEFORE_SAMPLING;
        offsets.push(sampling);
        at = sampling + FULL_SAMPLING.len();
    }
    Some(offsets)
}

/// Pixels per sample; none for an implausible number.
fn read_sampling(file: &[u8], at: usize) -> Option<usize> {
    let n = u32::from_le_bytes(*file.get(at..)?.first_chunk()?);
    (1..=MAX_SAMPLING).contains(&n).then_some(n as usize)
}

/// Converts luminance and chroma, the first three of `n` interleaved channels, to red, green and
/// blue of a colour space.
pub(super) fn to_rgb(samples: &mut [f32], n: usize, space: &RgbSpace) {
    let weights = xyz_from_rgb(space);
    let [wr, wg, wb] = [0, 1, 2].map(|c| weights[(1, c)] as f32);
    for px in samples.chunks_exact_mut(n) {
        let y = px[0];
        let (r, b) = ((px[1] + 1.0) * y, (px[2] + 1.0) * y);
        let g = (y - wr * r - wb * b) / wg;
        px[..3].copy_from_slice(&[r, g, b]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_is_what_luminance_and_differences_say() {
        let [r, g, b] = [0.2, 0.5, 0.9];
        let weights = xyz_from_rgb(&RgbSpace::REC709);
        let y = (weights[(1, 0)] * r + weights[(1, 1)] * g + weights[(1, 2)] * b) as f32;
        let mut px = [y, (r as f32 - y) / y, (b as f32 - y) / y, 0.25];
        to_rgb(&mut px, 4, &RgbSpace::REC709);
        for (v, expected) in px.iter().zip([r, g, b, 0.25]) {
            assert!((f64::from(*v) - expected).abs() < 1e-6, "{px:?}");
        }
    }

    #[test]
    fn samples_lie_on_the_first_of_their_pixels() {
        assert_eq!(enlarged(&[1.0, 3.0], 2), [1.0, 2.0, 3.0, 3.0]);
        assert_eq!(enlarged(&[1.0, 3.0], 1), [1.0, 3.0]);
        assert!(enlarged(&[], 2).is_empty());
    }
}
