//! EXR files of half floats, zip-compressed with matches of one value only.
//!
//! Photographs repeat nothing but what is empty: a search for other matches takes most of the time of deflate, and what
//! it finds are chance matches that cost more than they save. Here deflate looks for runs of one value, and codes the
//! rest by how often each value is: half the time, and files that are no larger. Any program reads them as ZIP. The
//! crate `exr` offers no choice of deflate's strategy; `docs/design.md` has the figures.

use super::attributes::{FIRST_ATTRIBUTE, add_texts, latin_text, sort_attributes};
use exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock};
use exr::block::writer::ChunksWriter;
use exr::meta::BlockDescription;
use exr::meta::attribute::{ChannelDescription, LineOrder, SampleType};
use exr::meta::header::Header;
use exr::prelude::{Compression, LayerAttributes, SmallVec, Text, Vec2, f16};
use miniz_oxide::deflate::core::{
    CompressorOxide, TDEFLFlush, TDEFLStatus, compress, create_comp_flags_from_zip_params,
};
use rayon::prelude::*;
use std::io::Cursor;

/// Rows of a block, by the format.
const BLOCK_ROWS: usize = 16;
/// Effort of deflate; 4 is what other encoders use.
const DEFLATE_LEVEL: i32 = 4;
/// Bits of the window, negative where there is no zlib header; ours has one.
const WINDOW_BITS: i32 = 15;
/// `Z_RLE` of zlib: matches at distance 1 alone.
const RUNS_STRATEGY: i32 = 3;

/// A whole file; the same input gives the same bytes at any thread count.
///
/// Every channel has `width * height` samples, row by row from the top.
pub(crate) fn encode_runs(
    (width, height): (usize, usize),
    mut channels: Vec<(&str, Vec<f16>)>,
    metadata: &[(String, String)],
) -> Result<Vec<u8>, String> {
    channels.sort_by_key(|(name, _)| *name);
    check_lengths((width, height), &channels)?;
    let header = half_header((width, height), &channels, metadata)?;
    let first_rows: Vec<usize> = (0..height).step_by(BLOCK_ROWS).collect();
    let chunks = first_rows
        .par_iter()
        .map(|&y| {
            let rows = y..(y + BLOCK_ROWS).min(height);
            scan_line_chunk(y, deflated(&block_samples(&channels, width, rows)))
        })
        .collect();
    let mut bytes = written(header, chunks)?;
    sort_attributes(&mut bytes, FIRST_ATTRIBUTE).ok_or("header of an unknown kind")?;
    Ok(bytes)
}

fn check_lengths(
    (width, height): (usize, usize),
    channels: &[(&str, Vec<f16>)],
) -> Result<(), String> {
    for (name, samples) in channels {
        if samples.len() != width * height {
            let count = samples.len();
            return Err(format!(
                "channel {name}: {count} samples, expected {width} x {height}"
            ));
        }
    }
    Ok(())
}

fn half_header(
    size: (usize, usize),
    planes: &[(&str, Vec<f16>)],
    metadata: &[(String, String)],
) -> Result<Header, String> {
    let mut channels = SmallVec::<[ChannelDescription; 5]>::new();
    for (name, _) in planes {
        channels.push(ChannelDescription::named(
            latin_text(name)?,
            SampleType::F16,
        ));
    }
    let mut attributes = LayerAttributes::default();
    add_texts(&mut attributes, metadata)?;
    let header =
        Header::new(Text::default(), Vec2(size.0, size.1), channels).with_attributes(attributes);
    Ok(header.with_encoding(
        Compression::ZIP16,
        BlockDescription::ScanLines,
        LineOrder::Increasing,
    ))
}

fn scan_line_chunk(first_row: usize, compressed_pixels_le: Vec<u8>) -> Chunk {
    Chunk {
        layer_index: 0,
        compressed_block: CompressedBlock::ScanLine(CompressedScanLineBlock {
            y_coordinate: first_row as i32,
            compressed_pixels_le,
        }),
    }
}

fn written(header: Header, chunks: Vec<Chunk>) -> Result<Vec<u8>, String> {
    let mut out = Cursor::new(Vec::new());
    let headers = SmallVec::from_elem(header, 1);
    exr::block::write(&mut out, headers, true, |_, writer| {
        for (i, chunk) in chunks.into_iter().enumerate() {
            writer.write_chunk(i, chunk)?;
        }
        Ok(())
    })
    .map_err(|e| e.to_string())?;
    Ok(out.into_inner())
}

/// The samples of some rows as a block has them: row by row, channel by channel.
fn block_samples(
    channels: &[(&str, Vec<f16>)],
    width: usize,
    rows: std::ops::Range<usize>,
) -> Vec<f16> {
    let mut block = Vec::with_capacity(rows.len() * width * channels.len());
    for y in rows {
        for (_, samples) in channels {
            block.extend_from_slice(&samples[y * width..][..width]);
        }
    }
    block
}

/// What EXR deflates: all low bytes before all high ones, each as its difference from the one before, plus 128.
fn predicted(samples: &[f16]) -> Vec<u8> {
    let [low, high] = [0, 1].map(|i| samples.iter().map(move |v| v.to_bits().to_le_bytes()[i]));
    let bytes: Vec<u8> = low.chain(high).collect();
    let differences = bytes
        .windows(2)
        .map(|pair| pair[1].wrapping_sub(pair[0]).wrapping_add(128));
    bytes
        .first()
        .copied()
        .into_iter()
        .chain(differences)
        .collect()
}

/// A block as the file has it: deflated, or as it is where that is not larger.
fn deflated(samples: &[f16]) -> Vec<u8> {
    let plain = predicted(samples);
    let flags = create_comp_flags_from_zip_params(DEFLATE_LEVEL, WINDOW_BITS, RUNS_STRATEGY);
    let mut deflate = CompressorOxide::new(flags);
    let mut out = vec![0; plain.len()];
    match compress(&mut deflate, &plain, &mut out, TDEFLFlush::Finish) {
        (TDEFLStatus::Done, _, length) if length < plain.len() => {
            out.truncate(length);
            out
        }
        _ => samples.iter().flat_map(|v| v.to_le_bytes()).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::codec::Wanted;
    use crate::io::codec::exr::{decode, encode, half_samples, to_halves};
    use crate::io::codec::raster::Samples;
    use crate::io::header::Window;
    use crate::io::limits::Limits;

    fn grain(count: usize) -> Vec<f32> {
        (0..count)
            .map(|i| {
                if i % 7 < 3 {
                    1.0
                } else {
                    ((i * 7919) % 1009) as f32 / 1009.0
                }
            })
            .collect()
    }

    fn decoded(bytes: &[u8]) -> (usize, usize, Samples) {
        let raster = decode(bytes, &Limits::default(), Wanted::Color, Window::Display).unwrap();
        (raster.width, raster.height, raster.samples)
    }

    #[test]
    fn the_file_differs_from_any_other_zip_in_its_blocks_alone() {
        let (size, values) = ((67, 41), grain(67 * 41));
        let names = ["R", "G", "B"];
        let notes = [("petcomp:note".to_string(), "text".to_string())];
        let ours = encode_runs(
            size,
            names.map(|name| (name, to_halves(&values))).into(),
            &notes,
        )
        .unwrap();
        let default = encode(
            size,
            names.map(|name| (name, half_samples(&values))).into(),
            crate::io::Compression::Zip,
            &notes,
        )
        .unwrap();
        assert_eq!(decoded(&ours), decoded(&default));
        let end = sort_attributes(&mut default.clone(), FIRST_ATTRIBUTE).unwrap();
        assert_eq!(
            String::from_utf8_lossy(&ours[..end]),
            String::from_utf8_lossy(&default[..end])
        );
    }

    #[test]
    fn what_does_not_shrink_is_kept_as_it_is() {
        let noise: Vec<f16> = (0..48_u64)
            .map(|i| f16::from_bits((i * i * 40_503 % 31_744) as u16))
            .collect();
        let bytes = encode_runs((48, 1), vec![("Y", noise.clone())], &[]).unwrap();
        let raw: Vec<u8> = noise.iter().flat_map(|v| v.to_le_bytes()).collect();
        assert!(bytes.ends_with(&raw));
    }

    #[test]
    fn a_channel_of_another_size_or_twice_is_refused() {
        assert!(
            encode_runs((2, 2), vec![("Y", vec![f16::ONE; 3])], &[])
                .unwrap_err()
                .contains("expected 2 x 2")
        );
        assert!(
            encode_runs(
                (1, 1),
                vec![("Y", vec![f16::ONE]), ("Y", vec![f16::ONE])],
                &[]
            )
            .is_err()
        );
        assert!(encode_runs((0, 0), vec![("Y", vec![])], &[]).is_err());
    }
}
