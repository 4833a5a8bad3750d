//! EXR channels with fewer samples than pixels: colour of half the size beside luminance (`Y`, `RY`, `BY`).
//!
//! # Method
//! OpenEXR's technical introduction, "Luminance/Chroma Images": `RY = (R - Y) / Y`, `BY = (B - Y) / Y`, and `Y` is the sum
//! of the colours by the weights of their primaries. Samples of colour lie on the first of the pixels they stand for;
//! between them it is interpolated in a straight line, where OpenEXR has a longer filter.

use super::exr_blocks::{Job, Line, to_floats};
use super::raster::Refusal;
use crate::color::{RgbSpace, xyz_from_rgb};
use exr::block::chunk::{Chunk, CompressedBlock};
use exr::meta::header::Header;
use exr::prelude::{IntegerBounds, Vec2};

/// Names of luminance and the two differences.
pub(super) const LUMINANCE_CHROMA: [&str; 3] = ["Y", "RY", "BY"];
/// Pixels for a sample, along each axis, at the most.
const COARSEST: u32 = 4;
/// Start of the first attribute: behind the magic number and the version.
const HEADER: usize = 8;

/// Pixels for a sample of each channel, along x and y.
pub(super) struct Sampling(Vec<[usize; 2]>);

impl Sampling {
    /// The sampling of a file's first part, and the file as if it had a sample for each pixel, which the decoder can take
    /// in. None for a file that has one, or that is not what it should be.
    pub(super) fn of(file: &[u8]) -> Option<(Self, Vec<u8>)> {
        let places = sampling_places(file)?;
        let number = |at: usize| Some(u32::from_le_bytes(*file.get(at..)?.first_chunk()?));
        let pairs = places
            .iter()
            .map(|&at| Some([number(at)?, number(at + 4)?]))
            .collect::<Option<Vec<_>>>()?;
        let known = pairs.iter().flatten().all(|&n| (1..=COARSEST).contains(&n));
        if !known || pairs.iter().flatten().all(|&n| n == 1) {
            return None;
        }
        let mut even = file.to_vec();
        for at in places {
            even[at..at + 8].copy_from_slice(&[1, 0, 0, 0, 1, 0, 0, 0]);
        }
        Some((
            Self(
                pairs
                    .into_iter()
                    .map(|pair| pair.map(|n| n as usize))
                    .collect(),
            ),
            even,
        ))
    }

    /// Whether the part is one that is read: rows, with a window that every sampling divides.
    pub(super) fn check(&self, header: &Header) -> Result<(), Refusal> {
        let (at, size) = (header.own_attributes.layer_position, header.layer_size);
        let divides = |[x, y]: &[usize; 2]| {
            let parts = |at: i32, n: usize| at.rem_euclid(n as i32) == 0;
            parts(at.x(), *x) && parts(at.y(), *y) && size.x() % x == 0 && size.y() % y == 0
        };
        match header.blocks {
            exr::meta::BlockDescription::ScanLines if self.0.iter().all(divides) => Ok(()),
            _ => Err("damaged EXR: sampling of channels that does not divide the picture".into()),
        }
    }

    /// Rows of pixels for a sample of a channel.
    pub(super) fn rows(&self, channel: usize) -> usize {
        self.0[channel][1]
    }

    /// The samples of a block of rows, enlarged along x; rows that lie between samples repeat those before them.
    pub(super) fn lines(&self, job: &Job<'_>, chunk: Chunk) -> Result<Vec<Line>, Refusal> {
        let header = job.header();
        let CompressedBlock::ScanLine(block) = chunk.compressed_block else {
            return Err("damaged EXR: a block of another kind".into());
        };
        let top =
            i64::from(block.y_coordinate) - i64::from(header.own_attributes.layer_position.y());
        let (width, height) = (header.layer_size.x(), header.layer_size.y());
        let most = header.compression.scan_lines_per_block();
        let top = usize::try_from(top)
            .ok()
            .filter(|y| *y < height && y % most == 0);
        let top = top.ok_or("damaged EXR: a block outside the picture")?;
        let rows = top..(top + most).min(height);
        // Bytes of each line that there is, in the order of the file.
        let present = |y: usize| (0..self.0.len()).filter(move |&c| y.is_multiple_of(self.0[c][1]));
        let lines = rows.clone().flat_map(|y| present(y).map(move |c| (c, y)));
        let bytes = |c: usize| {
            width / self.0[c][0] * header.channels.list[c].sample_type.bytes_per_sample()
        };
        let total: usize = lines.clone().map(|(c, _)| bytes(c)).sum();
        let mut told = header.clone();
        told.channels.bytes_per_pixel = total / (width * rows.len());
        if told.channels.bytes_per_pixel * width * rows.len() != total {
            return Err(Refusal::Unsupported(
                "unsupported EXR: channels of this sampling".into(),
            ));
        }
        for (channel, &[x, y]) in told.channels.list.iter_mut().zip(&self.0) {
            channel.sampling = Vec2(x, y);
        }
        let section = IntegerBounds::new(Vec2(0, top as i32), Vec2(width, rows.len()));
        let pixels = block.compressed_pixels_le;
        let data = header
            .compression
            .decompress_image_section_from_le(&told, pixels, section, false)?;
        let mut rest = &data[..];
        let mut out = Vec::new();
        for (c, y) in lines {
            let (line, behind) = rest
                .split_at_checked(bytes(c))
                .ok_or("damaged EXR: a block that is too short")?;
            rest = behind;
            let mut samples = Vec::new();
            to_floats(line, header.channels.list[c].sample_type, &mut samples);
            let samples = enlarged(&samples, self.0[c][0]);
            out.extend((y..(y + self.0[c][1]).min(height)).map(|y| Line {
                channel: c,
                x: 0,
                y,
                samples: samples.clone(),
            }));
        }
        Ok(out)
    }
}

/// `n` values for each, in a straight line to the next; the last goes on.
fn enlarged(samples: &[f32], n: usize) -> Vec<f32> {
    let next = samples.iter().skip(1).chain(samples.last());
    let between = |(&a, &b): (&f32, &f32)| (0..n).map(move |i| a + (b - a) * (i as f32 / n as f32));
    samples.iter().zip(next).flat_map(between).collect()
}

/// Where the pairs of numbers lie that say how the channels of the first part are sampled.
fn sampling_places(file: &[u8]) -> Option<Vec<usize>> {
    let text_end = |at: usize| Some(at + file.get(at..)?.iter().position(|&b| b == 0)?);
    let mut at = HEADER;
    while *file.get(at)? != 0 {
        let kind = text_end(at)? + 1;
        let size = text_end(kind)? + 1;
        let length = u32::from_le_bytes(*file.get(size..)?.first_chunk()?);
        let value = size + 4;
        if &file[at..kind] == b"channels\0" && &file[kind..size] == b"chlist\0" {
            return places_in_list(file, value);
        }
        at = value.checked_add(usize::try_from(length).ok()?)?;
    }
    None
}

/// Each channel: a name, the kind of its samples, a flag, three bytes that mean nothing, and the sampling.
fn places_in_list(file: &[u8], mut at: usize) -> Option<Vec<usize>> {
    const BEFORE: usize = 4 + 1 + 3;
    let mut places = Vec::new();
    while *file.get(at)? != 0 {
        let behind_name = at + file[at..].iter().position(|&b| b == 0)? + 1;
        places.push(behind_name + BEFORE);
        at = behind_name + BEFORE + 8;
    }
    Some(places)
}

/// Turns luminance and differences, the first three of `n` interleaved channels, into red, green and blue of a space.
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
