//! Radiance RGBE: scene-linear, read only.

use super::orient::Orientation;
use super::profile::{convert_primaries, to_rec709};
use super::raster::{Raster, Samples, default_names};
use super::refusal::Refusal;
use crate::color::RgbSpace;
use crate::io::format::Format;
use crate::io::header::Header;
use crate::io::limits::{Demand, Limits};
use image::codecs::hdr::HdrDecoder;
use image::{ImageDecoder, ImageError};
use std::io::{BufRead, Cursor, Read};

/// The first line that the decoder accepts; other programs write `#?RGBE` instead.
const FIRST_LINE: &[u8] = b"#?RADIANCE\n";
/// Light in the primaries of the display, or in CIE XYZ.
const RGBE_LINE: &[u8] = b"FORMAT=32-bit_rle_rgbe\n";
const XYZE_LINE: &[u8] = b"FORMAT=32-bit_rle_xyze\n";
/// CIE XYZ as primaries of light, with an equal-energy white.
const XYZ_SPACE: RgbSpace = RgbSpace {
    primaries: [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]],
    white: [1.0 / 3.0; 2],
};
/// Maximum number of characters shown of a line that is not a valid size.
const LONGEST_SHOWN: usize = 40;

/// A file presented to the decoder as one with rows from the top and its own primaries, and its
/// actual orientation and primaries.
struct OpenedHdr<R: Read> {
    decoder: HdrDecoder<R>,
    orientation: Orientation,
    is_xyz: bool,
}

fn open(
    mut file: impl BufRead,
    file_bytes: u64,
    limits: &Limits,
) -> Result<OpenedHdr<impl Read>, Refusal> {
    let (mut head, is_xyz) = plain_head(&mut file)?;
    let ([width, height], orientation) = resolution(&read_line(&mut file)?)?;
    head.extend(format!("-Y {height} +X {width}\n").into_bytes());
    let decoder = HdrDecoder::new(Cursor::new(head).chain(file))?;
    let (width, height) = decoder.dimensions();
    limits.check(Demand {
        width: width.into(),
        height: height.into(),
        channels: 3,
        bytes_per_pixel: 12,
        file_bytes,
    })?;
    Ok(OpenedHdr {
        decoder,
        orientation,
        is_xyz,
    })
}

/// The lines up to the empty one in the form that the decoder accepts, and whether they declare CIE
/// XYZ.
fn plain_head(file: &mut impl BufRead) -> Result<(Vec<u8>, bool), Refusal> {
    read_line(file)?;
    let (mut head, mut is_xyz) = (FIRST_LINE.to_vec(), false);
    loop {
        let line = read_line(file)?;
        is_xyz |= line == XYZE_LINE;
        head.extend_from_slice(if line == XYZE_LINE { RGBE_LINE } else { &line });
        if line == b"\n" {
            return Ok((head, is_xyz));
        }
    }
}

fn read_line(file: &mut impl BufRead) -> Result<Vec<u8>, Refusal> {
    let mut line = Vec::new();
    match file
        .read_until(b'\n', &mut line)
        .map_err(ImageError::from)?
    {
        0 => Err("truncated HDR (no picture)".into()),
        _ => Ok(line),
    }
}

/// Length and number of the stored rows, and their orientation in the picture: the axis and
/// direction of the rows come first, those of the pixels in a row second; `-Y` goes down.
fn resolution(line: &[u8]) -> Result<([u32; 2], Orientation), Refusal> {
    let text = String::from_utf8_lossy(line);
    parsed_resolution(&text).ok_or_else(|| unknown_resolution(&text))
}

fn unknown_resolution(text: &str) -> Refusal {
    // A line without an end would put all of the pixels into the message.
    let shown: String = text.trim().chars().take(LONGEST_SHOWN).collect();
    Refusal::Broken(format!(
        "damaged HDR: size {shown:?}, expected \"-Y 480 +X 640\""
    ))
}

fn parsed_resolution(text: &str) -> Option<([u32; 2], Orientation)> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let [rows, height, columns, width] = words[..] else {
        return None;
    };
    let size = [width.parse().ok()?, height.parse().ok()?];
    Some((size, orientation_of(rows, columns)?))
}

/// The orientation of the picture by the axes and directions of rows and columns.
fn orientation_of(rows: &str, columns: &str) -> Option<Orientation> {
    let axes = [
        ("-Y", "+X"),
        ("-Y", "-X"),
        ("+Y", "-X"),
        ("+Y", "+X"),
        ("+X", "-Y"),
        ("-X", "-Y"),
        ("-X", "+Y"),
        ("+X", "+Y"),
    ];
    let number = (1..).zip(axes).find(|(_, known)| *known == (rows, columns));
    number.map(|(number, _)| Orientation(number))
}

pub(crate) fn header(
    file: impl BufRead,
    file_bytes: u64,
    limits: &Limits,
) -> Result<Header, Refusal> {
    let file = open(file.take(limits.metadata_bytes), file_bytes, limits)?;
    let (width, height) = file.decoder.dimensions();
    let (width, height) = file.orientation.size((width as usize, height as usize));
    Ok(Header {
        format: Format::Hdr,
        width,
        height,
        channels: default_names(3).unwrap_or_default(),
        bits: 32,
        metadata: file.decoder.metadata().custom_attributes,
        ..Header::default()
    })
}

pub(crate) fn decode(bytes: &[u8], limits: &Limits) -> Result<Raster, Refusal> {
    check_head_length(bytes, limits)?;
    let file = open(Cursor::new(bytes), bytes.len() as u64, limits)?;
    let (orientation, is_xyz) = (file.orientation, file.is_xyz);
    let (width, height) = file.decoder.dimensions();
    let (width, height) = (width as usize, height as usize);
    limits.check_memory(width, height, 3)?;
    let mut light = vec![0_f32; width * height * 3];
    file.decoder
        .read_image(bytemuck::cast_slice_mut(&mut light))?;
    if is_xyz && let Some(matrix) = to_rec709(&XYZ_SPACE)? {
        convert_primaries(&mut light, 3, &matrix);
    }
    Ok(light_raster((width, height), light).upright(orientation))
}

fn light_raster((width, height): (usize, usize), light: Vec<f32>) -> Raster {
    Raster {
        width,
        height,
        names: default_names(3).unwrap_or_default(),
        samples: Samples::F32(light),
        display_encoded: false,
        premultiplied: false,
    }
}

/// Checks that the header ends within the limit: all of its lines are kept, whatever their number
/// and length.
fn check_head_length(bytes: &[u8], limits: &Limits) -> Result<(), String> {
    let start = &bytes[..bytes.len().min(limits.metadata_bytes as usize + 1)];
    match start.windows(2).any(|pair| pair == b"\n\n") {
        true => Ok(()),
        false => limits.check_header_bytes(start.len() as u64),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two rows of three pixels as they are stored, exponents such that 128 is 1.
    fn read(format: &str, size: &str) -> Raster {
        let pixels = (0..6_u8).flat_map(|i| [128 + i, 128, 128, 129]);
        let head = format!("#?RGBE\nFORMAT=32-bit_rle_{format}\n\n{size}\n");
        decode(
            &head
                .into_bytes()
                .into_iter()
                .chain(pixels)
                .collect::<Vec<_>>(),
            &Limits::default(),
        )
        .unwrap()
    }

    fn reds(raster: &Raster) -> Vec<i32> {
        let Samples::F32(v) = &raster.samples else {
            panic!("not floats")
        };
        v.iter()
            .step_by(3)
            .map(|v| (v * 128.0 - 128.0).round() as i32)
            .collect()
    }

    #[test]
    fn a_size_without_an_end_is_shown_in_part() {
        let file = [b"#?RGBE\n\n-Y 30 +X 40".as_slice(), &[1; 4_000], b"\n"].concat();
        let Err(Refusal::Broken(what)) = decode(&file, &Limits::default()) else {
            panic!("read")
        };
        assert!(
            what.starts_with("damaged HDR: size \"-Y 30 +X 40") && what.len() < 300,
            "{what}"
        );
    }

    #[test]
    fn rows_may_go_any_way() {
        for (size, shape, expected) in [
            ("-Y 2 +X 3", (3, 2), [0, 1, 2, 3, 4, 5]),
            ("-Y 2 -X 3", (3, 2), [2, 1, 0, 5, 4, 3]),
            ("+Y 2 -X 3", (3, 2), [5, 4, 3, 2, 1, 0]),
            ("+Y 2 +X 3", (3, 2), [3, 4, 5, 0, 1, 2]),
            ("+X 2 -Y 3", (2, 3), [0, 3, 1, 4, 2, 5]),
            ("-X 2 -Y 3", (2, 3), [3, 0, 4, 1, 5, 2]),
            ("-X 2 +Y 3", (2, 3), [5, 2, 4, 1, 3, 0]),
            ("+X 2 +Y 3", (2, 3), [2, 5, 1, 4, 0, 3]),
        ] {
            let raster = read("rgbe", size);
            assert_eq!(
                ((raster.width, raster.height), reds(&raster)),
                (shape, expected.to_vec()),
                "{size}"
            );
        }
        assert!(resolution(b"-Y 2 -Y 3").is_err() && resolution(b"-Y 2 +X").is_err());
    }

    #[test]
    fn xyz_of_equal_energy_is_white() {
        let Samples::F32(v) = read("xyze", "-Y 2 +X 3").samples else {
            panic!("not floats")
        };
        assert!(
            v[..3].iter().all(|v| (v - 1.0).abs() < 1e-5),
            "{:?}",
            &v[..3]
        );
    }
}
