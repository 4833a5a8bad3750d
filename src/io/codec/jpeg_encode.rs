//! JPEG files as cameras write them at their best: baseline, a sample of each channel for each
//! pixel.
//!
//! # Method
//! ISO/IEC 10918-1 with the quantisation and Huffman tables of its annex K, the former scaled by
//! quality as the Independent JPEG Group does. The cosine transform is that of Arai, Agui and
//! Nakajima (1988), whose last factors are part of the quantisation. It works in single precision
//! without fused operations, so that every processor writes the same bytes.

use std::f32::consts::{FRAC_1_SQRT_2, SQRT_2};

// Markers of ISO/IEC 10918-1, table B.1.
const SOI: u8 = 0xd8;
const EOI: u8 = 0xd9;
const APP0: u8 = 0xe0;
const DQT: u8 = 0xdb;
const SOF0: u8 = 0xc0;
const DHT: u8 = 0xc4;
const SOS: u8 = 0xda;

/// Samples along a side of a block.
const SIDE: usize = 8;
/// Samples of a block.
const BLOCK: usize = SIDE * SIDE;
/// JFIF 1.2, no unit of length, square pixels, no thumbnail.
const JFIF: [u8; 14] = *b"JFIF\0\x01\x02\0\0\x01\0\x01\0\0";

/// Quantisation of brightness and of colour at quality 50, row by row (tables K.1 and K.2).
const QUANTA: [[u8; BLOCK]; 2] = [
    [
        16, 11, 10, 16, 24, 40, 51, 61, 12, 12, 14, 19, 26, 58, 60, 55, 14, 13, 16, 24, 40, 57, 69,
        56, 14, 17, 22, 29, 51, 87, 80, 62, 18, 22, 37, 56, 68, 109, 103, 77, 24, 35, 55, 64, 81,
        104, 113, 92, 49, 64, 78, 87, 103, 121, 120, 101, 72, 92, 95, 98, 112, 100, 103, 99,
    ],
    [
        17, 18, 24, 47, 99, 99, 99, 99, 18, 21, 26, 66, 99, 99, 99, 99, 24, 26, 56, 99, 99, 99, 99,
        99, 47, 66, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99,
        99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99,
    ],
];

/// A Huffman table: how many codes there are of each length from 1, and what they stand for.
struct HuffmanSpec {
    counts: [u8; 16],
    symbols: &'static [u8],
}

/// Tables K.3 to K.6: constant terms of brightness and of colour, then the other terms of each.
const HUFFMAN: [HuffmanSpec; 4] = [
    HuffmanSpec {
        counts: [0, 1, 5, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0],
        symbols: &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11],
    },
    HuffmanSpec {
        counts: [0, 3, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0],
        symbols: &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11],
    },
    HuffmanSpec {
        counts: [0, 2, 1, 3, 3, 2, 4, 3, 5, 5, 4, 4, 0, 0, 1, 0x7d],
        symbols: b"\x01\x02\x03\x00\x04\x11\x05\x12\x21\x31\x41\x06\x13\x51\x61\x07\x22\x71\x14\x32\x81\x91\xa1\x08\
            \x23\x42\xb1\xc1\x15\x52\xd1\xf0\x24\x33\x62\x72\x82\x09\x0a\x16\x17\x18\x19\x1a\x25\x26\x27\x28\x29\x2a\
            \x34\x35\x36\x37\x38\x39\x3a\x43\x44\x45\x46\x47\x48\x49\x4a\x53\x54\x55\x56\x57\x58\x59\x5a\x63\x64\x65\
            \x66\x67\x68\x69\x6a\x73\x74\x75\x76\x77\x78\x79\x7a\x83\x84\x85\x86\x87\x88\x89\x8a\x92\x93\x94\x95\x96\
            \x97\x98\x99\x9a\xa2\xa3\xa4\xa5\xa6\xa7\xa8\xa9\xaa\xb2\xb3\xb4\xb5\xb6\xb7\xb8\xb9\xba\xc2\xc3\xc4\xc5\
            \xc6\xc7\xc8\xc9\xca\xd2\xd3\xd4\xd5\xd6\xd7\xd8\xd9\xda\xe1\xe2\xe3\xe4\xe5\xe6\xe7\xe8\xe9\xea\xf1\xf2\
            \xf3\xf4\xf5\xf6\xf7\xf8\xf9\xfa",
    },
    HuffmanSpec {
        counts: [0, 2, 1, 2, 4, 4, 3, 4, 7, 5, 4, 4, 0, 1, 2, 0x77],
        symbols: b"\x00\x01\x02\x03\x11\x04\x05\x21\x31\x06\x12\x41\x51\x07\x61\x71\x13\x22\x32\x81\x08\x14\x42\x91\
            \xa1\xb1\xc1\x09\x23\x33\x52\xf0\x15\x62\x72\xd1\x0a\x16\x24\x34\xe1\x25\xf1\x17\x18\x19\x1a\x26\x27\x28\
            \x29\x2a\x35\x36\x37\x38\x39\x3a\x43\x44\x45\x46\x47\x48\x49\x4a\x53\x54\x55\x56\x57\x58\x59\x5a\x63\x64\
            \x65\x66\x67\x68\x69\x6a\x73\x74\x75\x76\x77\x78\x79\x7a\x82\x83\x84\x85\x86\x87\x88\x89\x8a\x92\x93\x94\
            \x95\x96\x97\x98\x99\x9a\xa2\xa3\xa4\xa5\xa6\xa7\xa8\xa9\xaa\xb2\xb3\xb4\xb5\xb6\xb7\xb8\xb9\xba\xc2\xc3\
            \xc4\xc5\xc6\xc7\xc8\xc9\xca\xd2\xd3\xd4\xd5\xd6\xd7\xd8\xd9\xda\xe2\xe3\xe4\xe5\xe6\xe7\xe8\xe9\xea\xf2\
            \xf3\xf4\xf5\xf6\xf7\xf8\xf9\xfa",
    },
];

/// So many zeros and no end yet.
const SIXTEEN_ZEROS: u8 = 0xf0;
/// Nothing but zeros up to the end of the block.
const END_OF_BLOCK: u8 = 0;

/// A file of 8-bit codes of one or three channels, of a quality from 1 to 100.
///
/// # Errors
/// Sides that a JPEG cannot have.
pub(super) fn encode(
    (width, height): (usize, usize),
    codes: &[u8],
    quality: u8,
) -> Result<Vec<u8>, String> {
    let sides = [height, width].map(|side| u16::try_from(side).ok().filter(|&side| side > 0));
    let [Some(rows), Some(columns)] = sides else {
        return Err(format!(
            "{width} x {height} pixels, expected sides of 1 to 65535 in a JPEG"
        ));
    };
    let channels = codes.len() / (width * height);
    let quanta = QUANTA.map(|table| scaled_quanta(&table, quality));
    let mut file = header([rows, columns], channels, &quanta);
    let mut scan = Scan::new(width, channels, &quanta);
    for strip in codes.chunks(SIDE * width * channels) {
        scan.encode_strip(strip);
    }
    file.extend(scan.bits.finish());
    file.extend([0xff, EOI]);
    Ok(file)
}

/// Quality 50 is the table itself, 100 is all ones.
fn scaled_quanta(table: &[u8; BLOCK], quality: u8) -> [u8; BLOCK] {
    let quality = u32::from(quality.clamp(1, 100));
    let percent = if quality < 50 {
        5000 / quality
    } else {
        200 - 2 * quality
    };
    table.map(|q| ((u32::from(q) * percent + 50) / 100).clamp(1, 255) as u8)
}

/// Positions in a block, row by row, in the order of their frequencies: diagonal by diagonal, to
/// and fro.
fn zigzag() -> [usize; BLOCK] {
    let mut order: [usize; BLOCK] = std::array::from_fn(|i| i);
    order.sort_by_key(|i| {
        let (row, column) = (i / SIDE, i % SIDE);
        let diagonal = row + column;
        (diagonal, if diagonal % 2 == 0 { column } else { row })
    });
    order
}

/// Everything in front of the coded samples.
fn header(size: [u16; 2], channels: usize, quanta: &[[u8; BLOCK]; 2]) -> Vec<u8> {
    let mut file = vec![0xff, SOI];
    add_segment(&mut file, APP0, &JFIF);
    let kinds = channels.min(2);
    for (kind, table) in quanta.iter().take(kinds).enumerate() {
        let entries = zigzag().map(|i| table[i]);
        add_segment(
            &mut file,
            DQT,
            &[&[kind as u8], entries.as_slice()].concat(),
        );
    }
    add_segment(&mut file, SOF0, &frame_of(size, channels));
    add_huffman_tables(&mut file, kinds);
    add_segment(&mut file, SOS, &scan_of(channels));
    file
}

/// Eight bits, height and width, and each channel with its table of quanta.
fn frame_of(size: [u16; 2], channels: usize) -> Vec<u8> {
    let mut frame = vec![8];
    frame.extend(size.map(u16::to_be_bytes).as_flattened());
    frame.push(channels as u8);
    frame.extend((0..channels).flat_map(|c| [c as u8 + 1, 0x11, kind_of(c) as u8]));
    frame
}

/// Each channel with its Huffman tables, and all terms of a block at once.
fn scan_of(channels: usize) -> Vec<u8> {
    let mut scan = vec![channels as u8];
    scan.extend((0..channels).flat_map(|c| [c as u8 + 1, 0x11 * kind_of(c) as u8]));
    scan.extend([0, BLOCK as u8 - 1, 0]);
    scan
}

fn add_huffman_tables(file: &mut Vec<u8>, kinds: usize) {
    for (number, table) in HUFFMAN.iter().enumerate().filter(|(n, _)| n % 2 < kinds) {
        // The class of terms in the upper half, the kind of channel in the lower one.
        let place = [(number as u8 / 2) << 4 | number as u8 % 2];
        let segment = [&place, table.counts.as_slice(), table.symbols].concat();
        add_segment(file, DHT, &segment);
    }
}

/// Brightness or colour.
fn kind_of(channel: usize) -> usize {
    channel.min(1)
}

fn add_segment(file: &mut Vec<u8>, marker: u8, data: &[u8]) {
    file.extend([0xff, marker]);
    file.extend((data.len() as u16 + 2).to_be_bytes());
    file.extend(data);
}

/// The codes of a table: bits and their number for each symbol.
struct HuffmanCodes([(u32, u32); 256]);

impl HuffmanCodes {
    /// Codes of each length count up from where those of the length before ended.
    fn new(spec: &HuffmanSpec) -> Self {
        let mut codes = [(0, 0); 256];
        let mut symbols = spec.symbols.iter();
        let mut code = 0;
        for (count, length) in spec.counts.iter().zip(1..) {
            for &symbol in symbols.by_ref().take((*count).into()) {
                codes[usize::from(symbol)] = (code, length);
                code += 1;
            }
            code <<= 1;
        }
        Self(codes)
    }

    /// A symbol and the bits of a number behind it.
    #[inline(always)]
    fn with_bits(&self, symbol: u8, bits: u32, count: u32) -> (u32, u32) {
        let (code, length) = self.0[usize::from(symbol)];
        (code << count | bits, length + count)
    }
}

/// The coded samples, strip by strip.
struct Scan {
    width: usize,
    channels: usize,
    factors: [Lanes8; 2],
    order: [u8; BLOCK],
    codes: [HuffmanCodes; 4],
    /// The constant term of each channel's block before.
    last: [i32; 3],
    /// A strip of eight rows of each channel, whole blocks.
    planes: [Vec<f32>; 3],
    bits: BitWriter,
}

impl Scan {
    fn new(width: usize, channels: usize, quanta: &[[u8; BLOCK]; 2]) -> Self {
        let room = width.next_multiple_of(SIDE) * SIDE;
        Self {
            width,
            channels,
            factors: quanta.map(|table| quantising_factors(&table)),
            // What the transform leaves is the block with rows and columns swapped.
            order: zigzag().map(|i| (i % SIDE * SIDE + i / SIDE) as u8),
            codes: HUFFMAN.map(|spec| HuffmanCodes::new(&spec)),
            last: [0; 3],
            planes: std::array::from_fn(|c| vec![0.0; if c < channels { room } else { 0 }]),
            bits: BitWriter::default(),
        }
    }

    /// Codes up to eight rows; the last one stands for those that are missing.
    fn encode_strip(&mut self, codes: &[u8]) {
        let rows = codes.chunks_exact(self.width * self.channels);
        let stride = self.planes[0].len() / SIDE;
        let missing = std::iter::repeat_n(rows.clone().last(), SIDE).flatten();
        for (y, row) in rows.clone().chain(missing).take(SIDE).enumerate() {
            self.fill_row(row, y * stride);
        }
        for x in (0..stride).step_by(SIDE) {
            for channel in 0..self.channels {
                self.encode_block(channel, x, stride);
            }
        }
    }

    /// Brightness and colour of a row of pixels; its last pixel stands for those that are missing.
    fn fill_row(&mut self, row: &[u8], start: usize) {
        let end = start + self.width;
        let [y, cb, cr] = &mut self.planes;
        if self.channels == 1 {
            for (y, &code) in y[start..end].iter_mut().zip(row) {
                *y = f32::from(code) - 128.0;
            }
        } else {
            let planes = [&mut y[start..end], &mut cb[start..end], &mut cr[start..end]];
            fill_colors(row, planes);
        }
        for plane in self.planes.iter_mut().take(self.channels) {
            let last = plane[end - 1];
            let stride = plane.len() / SIDE;
            plane[end..start + stride].fill(last);
        }
    }

    fn encode_block(&mut self, channel: usize, x: usize, stride: usize) {
        let kind = kind_of(channel);
        let mut terms = [0; BLOCK];
        transform(
            &self.planes[channel][x..],
            stride,
            &self.factors[kind],
            &mut terms,
        );
        let ordered: [i32; BLOCK] =
            std::array::from_fn(|k| terms[usize::from(self.order[k]) % BLOCK]);
        let step = ordered[0] - std::mem::replace(&mut self.last[channel], ordered[0]);
        let (bits, size) = magnitude(step);
        self.bits
            .put(self.codes[kind].with_bits(size as u8, bits, size));
        self.encode_terms(&ordered, kind);
    }

    /// The other terms: how many zeros are in front of each, and what it is.
    fn encode_terms(&mut self, terms: &[i32; BLOCK], kind: usize) {
        let codes = &self.codes[2 + kind];
        let end = 1 + terms.iter().rposition(|&term| term != 0).unwrap_or(0);
        let mut zeros = 0;
        for &term in &terms[1..end.max(1)] {
            if term == 0 {
                zeros += 1;
                continue;
            }
            while zeros >= 16 {
                self.bits.put(codes.with_bits(SIXTEEN_ZEROS, 0, 0));
                zeros -= 16;
            }
            let (bits, size) = magnitude(term);
            self.bits
                .put(codes.with_bits((zeros << 4) as u8 | size as u8, bits, size));
            zeros = 0;
        }
        if end < BLOCK {
            self.bits.put(codes.with_bits(END_OF_BLOCK, 0, 0));
        }
    }
}

/// The bits that tell a number among those of its size, and the size: how many bits they are.
#[inline(always)]
fn magnitude(term: i32) -> (u32, u32) {
    let size = u32::BITS - term.unsigned_abs().leading_zeros();
    let bits = if term < 0 { term - 1 } else { term };
    (bits as u32 & ((1 << size) - 1), size)
}

/// BT.601 as JFIF has it, all around 0.
#[multiversion::multiversion(targets("x86_64+avx2", "aarch64+neon"))]
fn fill_colors(row: &[u8], [y, cb, cr]: [&mut [f32]; 3]) {
    let colors = row.as_chunks::<3>().0;
    for (((y, cb), cr), color) in y.iter_mut().zip(cb).zip(cr).zip(colors) {
        let [r, g, b] = color.map(f32::from);
        let luma = 0.299 * r + 0.587 * g + 0.114 * b;
        *y = luma - 128.0;
        *cb = (b - luma) * 0.564_334_1;
        *cr = (r - luma) * 0.713_266_76;
    }
}

/// A block, as eight numbers of each of eight rows or columns.
type Lanes8 = [[f32; SIDE]; SIDE];

/// What terms are multiplied with to be quantised, rows and columns swapped: the last factors of
/// the transform over the quanta.
fn quantising_factors(quanta: &[u8; BLOCK]) -> Lanes8 {
    let scale = |k: usize| match k {
        0 => 1.0,
        _ => SQRT_2 * (k as f32 * std::f32::consts::PI / 16.0).cos(),
    };
    std::array::from_fn(|column| {
        std::array::from_fn(|row| {
            let quantum = f32::from(quanta[row * SIDE + column]);
            1.0 / (8.0 * scale(row) * scale(column) * quantum)
        })
    })
}

/// Quantised terms of a block that begins with these samples, rows and columns swapped.
#[multiversion::multiversion(targets("x86_64+avx2", "aarch64+neon"))]
fn transform(samples: &[f32], stride: usize, factors: &Lanes8, out: &mut [i32; BLOCK]) {
    let mut block = [[0.0; SIDE]; SIDE];
    for (row, samples) in block.iter_mut().zip(samples.chunks(stride)) {
        row.copy_from_slice(&samples[..SIDE]);
    }
    let columns = transposed(&cosine_terms(&block));
    let terms = cosine_terms(&columns);
    let (out, _) = out.as_chunks_mut::<SIDE>();
    for ((out, terms), factors) in out.iter_mut().zip(&terms).zip(factors) {
        for ((out, term), factor) in out.iter_mut().zip(terms).zip(factors) {
            *out = nearest_integer(term * factor);
        }
    }
}

/// By bits, which is vectorised on every processor: floats from 1.5 * 2^23 on are integers.
#[inline(always)]
fn nearest_integer(x: f32) -> i32 {
    const SHIFT: f32 = 12_582_912.0;
    (x + SHIFT).to_bits() as i32 - SHIFT.to_bits() as i32
}

#[inline(always)]
fn transposed(block: &Lanes8) -> Lanes8 {
    std::array::from_fn(|i| std::array::from_fn(|j| block[j][i]))
}

#[inline(always)]
fn add(a: [f32; SIDE], b: [f32; SIDE]) -> [f32; SIDE] {
    std::array::from_fn(|i| a[i] + b[i])
}

#[inline(always)]
fn sub(a: [f32; SIDE], b: [f32; SIDE]) -> [f32; SIDE] {
    std::array::from_fn(|i| a[i] - b[i])
}

#[inline(always)]
fn scale(a: [f32; SIDE], factor: f32) -> [f32; SIDE] {
    a.map(|v| v * factor)
}

/// The cosine transform down the rows of a block, in all columns at once, each term up to a factor.
#[inline(always)]
fn cosine_terms(rows: &Lanes8) -> Lanes8 {
    let [e0, e1, e2, e3] = even_terms(std::array::from_fn(|i| add(rows[i], rows[7 - i])));
    let [o0, o1, o2, o3] = odd_terms(std::array::from_fn(|i| sub(rows[i], rows[7 - i])));
    [e0, o0, e1, o1, e2, o2, e3, o3]
}

/// Every second term, from sums of rows that are as far from the middle.
#[inline(always)]
fn even_terms([a, b, c, d]: [[f32; SIDE]; 4]) -> [[f32; SIDE]; 4] {
    let [outer, inner] = [add(a, d), add(b, c)];
    let [p, q] = [sub(a, d), sub(b, c)];
    let middle = scale(add(p, q), FRAC_1_SQRT_2);
    [
        add(outer, inner),
        add(p, middle),
        sub(outer, inner),
        sub(p, middle),
    ]
}

/// The others, from differences.
#[inline(always)]
fn odd_terms([a, b, c, d]: [[f32; SIDE]; 4]) -> [[f32; SIDE]; 4] {
    // cos(3 pi / 8), and that taken from and added to cos(pi / 8).
    const C6: f32 = 0.382_683_43;
    const C2_MINUS_C6: f32 = 0.541_196_1;
    const C2_PLUS_C6: f32 = 1.306_563;
    let [p, q, r] = [add(d, c), add(c, b), add(b, a)];
    let turned = scale(sub(p, r), C6);
    let low = add(scale(p, C2_MINUS_C6), turned);
    let high = add(scale(r, C2_PLUS_C6), turned);
    let half = scale(q, FRAC_1_SQRT_2);
    let [plus, minus] = [add(a, half), sub(a, half)];
    [
        add(plus, high),
        sub(minus, low),
        add(minus, low),
        sub(plus, high),
    ]
}

/// Bits, first ones first, with a zero byte behind each byte of ones.
#[derive(Default)]
struct BitWriter {
    bytes: Vec<u8>,
    /// Bits that are no whole word yet, in the lowest places.
    pending: u64,
    count: u32,
}

impl BitWriter {
    /// Adds the lowest `count` bits of a number, at most 32.
    #[inline(always)]
    fn put(&mut self, (bits, count): (u32, u32)) {
        self.pending = self.pending << count | u64::from(bits);
        self.count += count;
        if self.count >= 32 {
            self.count -= 32;
            self.write((self.pending >> self.count) as u32);
        }
    }

    #[inline(always)]
    fn write(&mut self, word: u32) {
        let bytes = word.to_be_bytes();
        if bytes.contains(&0xff) {
            bytes.into_iter().for_each(|byte| self.write_byte(byte));
        } else {
            self.bytes.extend(bytes);
        }
    }

    fn write_byte(&mut self, byte: u8) {
        self.bytes.push(byte);
        if byte == 0xff {
            self.bytes.push(0);
        }
    }

    /// All of it, the last byte filled up with ones.
    fn finish(mut self) -> Vec<u8> {
        let filled = self.count.next_multiple_of(8);
        let missing = filled - self.count;
        let rest = self.pending << missing | ((1 << missing) - 1);
        for shift in (0..filled).step_by(8).rev() {
            self.write_byte((rest >> shift) as u8);
        }
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::jpeg::{JpegDecoder, JpegEncoder};
    use image::{ExtendedColorType, ImageDecoder};
    use std::io::Cursor;

    fn picture(width: usize, height: usize, channels: usize) -> Vec<u8> {
        let mut noise = 1_u64;
        let mut next = || {
            noise = noise
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (noise >> 59) as usize
        };
        (0..width * height)
            .flat_map(|i| {
                let (x, y) = (i % width, i / width);
                let channel = [2 * x + y, x * y / 40, 255 - y.min(255)];
                [0, 1, 2].map(|c| ((channel[c] + next()) % 256) as u8)
            })
            .enumerate()
            .filter(|(i, _)| i % 3 < channels)
            .map(|(_, code)| code)
            .collect()
    }

    fn decoded(file: &[u8]) -> Vec<u8> {
        let decoder = JpegDecoder::new(Cursor::new(file)).unwrap();
        let mut codes = vec![0; decoder.total_bytes() as usize];
        decoder.read_image(&mut codes).unwrap();
        codes
    }

    fn rms(a: &[u8], b: &[u8]) -> f64 {
        assert_eq!(a.len(), b.len());
        let squares = a
            .iter()
            .zip(b)
            .map(|(&a, &b)| f64::from(a.abs_diff(b)).powi(2));
        (squares.sum::<f64>() / a.len() as f64).sqrt()
    }

    /// The other encoder rounds its samples and its sums to integers.
    #[test]
    fn files_are_as_good_and_as_small_as_those_of_another_encoder() {
        for (channels, color) in [(1, ExtendedColorType::L8), (3, ExtendedColorType::Rgb8)] {
            for (width, height, quality) in [(64, 48, 95), (67, 41, 75), (1, 9, 30), (40, 8, 100)] {
                let codes = picture(width, height, channels);
                let ours = encode((width, height), &codes, quality).unwrap();
                let mut other = Vec::new();
                let sides = [width, height].map(|side| side as u32);
                JpegEncoder::new_with_quality(&mut other, quality)
                    .encode(&codes, sides[0], sides[1], color)
                    .unwrap();
                let errors = [&ours, &other].map(|file| rms(&decoded(file), &codes));
                assert!(
                    errors[0] < errors[1] * 1.01 + 0.1,
                    "{width} {quality}: {errors:?}"
                );
                assert!(
                    ours.len() < other.len() + other.len() / 50 + 20,
                    "{width} {quality}"
                );
            }
        }
    }

    #[test]
    fn the_order_of_terms_is_the_standards() {
        assert_eq!(zigzag()[..10], [0, 1, 8, 16, 9, 2, 3, 10, 17, 24]);
        assert_eq!(zigzag()[60..], [47, 55, 62, 63]);
    }

    #[test]
    fn the_terms_are_cosines_sums() {
        let samples: Vec<f32> = (0..BLOCK).map(|i| ((i * i) % 61) as f32 - 30.0).collect();
        let mut terms = [0; BLOCK];
        transform(&samples, SIDE, &quantising_factors(&[1; BLOCK]), &mut terms);
        let cosine = |x: usize, u: usize| {
            ((2 * x + 1) as f64 * u as f64 * std::f64::consts::PI / 16.0).cos()
        };
        for (u, v) in (0..BLOCK).map(|i| (i % SIDE, i / SIDE)) {
            let sum: f64 = (0..BLOCK)
                .map(|i| f64::from(samples[i]) * cosine(i % SIDE, u) * cosine(i / SIDE, v))
                .sum();
            let weight = |k: usize| if k == 0 { 0.5_f64.sqrt() } else { 1.0 };
            let expected = 0.25 * weight(u) * weight(v) * sum;
            let term = f64::from(terms[u * SIDE + v]);
            assert!(
                (term - expected).abs() < 0.501,
                "{u} {v}: {term} {expected}"
            );
        }
    }

    #[test]
    fn sides_that_a_jpeg_cannot_have_are_refused() {
        let message = encode((65_536, 1), &[0; 65_536], 90).unwrap_err();
        assert!(
            message.starts_with("65536 x 1 pixels, expected"),
            "{message}"
        );
    }
}
