//! The samples of an EXR part, read block by block; only those of the wanted channels are kept.

use super::chroma::Sampling;
use super::samples::{SampleLine, to_floats};
use crate::io::codec::raster::overlap;
use crate::io::codec::refusal::Refusal;
use exr::block::UncompressedBlock;
use exr::block::chunk::Chunk;
use exr::block::reader::Reader;
use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::{IntegerBounds, Vec2};
use rayon::prelude::*;
use std::io::Cursor;

/// Decoded bytes in memory at a time, in blocks, in addition to the samples that are kept.
const BATCH_BYTES: usize = 16 << 20;

/// Memory order of the samples of several channels.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum SampleOrder {
    /// All channels of a pixel together.
    Interleaved,
    /// One channel after the other.
    Planar,
}

/// The part of a file to read, and the region and channels.
pub(super) struct PartReader<'a> {
    /// The whole file.
    pub(super) bytes: &'a [u8],
    pub(super) meta: &'a MetaData,
    pub(super) part: usize,
    /// Indices of the part's channels, without duplicates.
    pub(super) picked: &'a [usize],
    /// The window to return: the part's pixels inside it, zeros elsewhere.
    pub(super) window: IntegerBounds,
    pub(super) order: SampleOrder,
    /// Channels with fewer samples than pixels.
    pub(super) sampling: Option<&'a Sampling>,
}

impl PartReader<'_> {
    fn header(&self) -> &Header {
        &self.meta.headers[self.part]
    }

    /// Reads the samples; halves and integers become floats.
    pub(super) fn read(&self) -> Result<Vec<f32>, Refusal> {
        let mut out = SampleBuffer::new(self);
        let largest = Vec2(0, 0);
        let mut chunks = Reader::read_from_buffered(Cursor::new(self.bytes), false)?
            .filter_chunks(false, |_, _, block| {
                block.layer == self.part && block.level == largest
            })?;
        loop {
            let batch = chunks.by_ref().take(self.batch_blocks());
            let batch = batch.collect::<exr::error::Result<Vec<Chunk>>>()?;
            if batch.is_empty() {
                break;
            }
            for block in self.decode_batch(batch)? {
                out.put_block(self.header(), block);
            }
        }
        Ok(out.finish(self.sampling))
    }

    /// Blocks decoded at a time.
    fn batch_blocks(&self) -> usize {
        let block_bytes = self.header().max_block_byte_size().max(1);
        (BATCH_BYTES / block_bytes).max(rayon::current_num_threads())
    }

    fn decode_batch(&self, batch: Vec<Chunk>) -> Result<Vec<DecodedBlock>, Refusal> {
        batch
            .into_par_iter()
            .map(|chunk| self.decode_chunk(chunk))
            .collect()
    }

    fn decode_chunk(&self, chunk: Chunk) -> Result<DecodedBlock, Refusal> {
        if let Some(sampling) = self.sampling {
            let lines = sampling.decode_lines(self.header(), chunk)?;
            return Ok(DecodedBlock::Lines(lines));
        }
        let block = UncompressedBlock::decompress_chunk(chunk, self.meta, false)?;
        // The table of blocks may be wrong.
        if block.index.layer != self.part || block.index.level != Vec2(0, 0) {
            return Err("damaged EXR: a block of another part".into());
        }
        Ok(DecodedBlock::Pixels(block))
    }
}

/// Columns and rows from one pixel to another.
pub(super) fn offset(to: Vec2<i32>, from: Vec2<i32>) -> [i64; 2] {
    [(to.x(), from.x()), (to.y(), from.y())].map(|(to, from)| i64::from(to) - i64::from(from))
}

/// The decoded content of a block.
enum DecodedBlock {
    Pixels(UncompressedBlock),
    Lines(Vec<SampleLine>),
}

/// The pixels to return.
struct SampleBuffer<'a> {
    picked: &'a [usize],
    width: usize,
    height: usize,
    /// Column and row of the part's first pixel.
    left: i64,
    top: i64,
    /// Number of rows of the part.
    rows: usize,
    order: SampleOrder,
    samples: Vec<f32>,
}

impl<'a> SampleBuffer<'a> {
    fn new(reader: &PartReader<'a>) -> Self {
        let header = reader.header();
        let (width, height) = (reader.window.size.x(), reader.window.size.y());
        let at = header.own_attributes.layer_position;
        let [left, top] = offset(at, reader.window.position);
        Self {
            picked: reader.picked,
            width,
            height,
            left,
            top,
            rows: header.layer_size.y(),
            order: reader.order,
            samples: bytemuck::zeroed_vec(width * height * reader.picked.len()),
        }
    }

    fn put_block(&mut self, header: &Header, block: DecodedBlock) {
        match block {
            DecodedBlock::Lines(lines) => {
                for line in lines {
                    self.put(line.channel, [0, line.y], &line.samples);
                }
            }
            DecodedBlock::Pixels(block) => self.put_pixels(header, &block),
        }
    }

    fn put_pixels(&mut self, header: &Header, block: &UncompressedBlock) {
        let mut floats = Vec::new();
        for line in block.lines(&header.channels) {
            let (at, channel) = (line.location.position, line.location.channel);
            let kind = header.channels.list[channel].sample_type;
            to_floats(line.value, kind, &mut floats);
            self.put(channel, [at.x(), at.y()], &floats);
        }
    }

    /// All samples; rows between stored samples are interpolated.
    fn finish(mut self, sampling: Option<&Sampling>) -> Vec<f32> {
        if let Some(sampling) = sampling {
            self.interpolate_rows(sampling);
        }
        self.samples
    }

    /// Stores a run of samples of a channel, clipped to the window.
    fn put(&mut self, channel: usize, [x, y]: [usize; 2], samples: &[f32]) {
        let Some(slot) = self.picked.iter().position(|&c| c == channel) else {
            return;
        };
        let (x, y) = (x as i64 + self.left, y as i64 + self.top);
        let columns = overlap(x, samples.len(), self.width);
        let rows = overlap(y, 1, self.height);
        if !rows.is_empty() && !columns.is_empty() {
            let samples = &samples[(columns.start as i64 - x) as usize..][..columns.len()];
            self.put_run(slot, [columns.start, rows.start], samples);
        }
    }

    /// Stores samples of a channel, starting at a pixel of the window.
    fn put_run(&mut self, slot: usize, [x, y]: [usize; 2], samples: &[f32]) {
        let (at, step) = self.row_offset(slot, y);
        let out = self.samples[at + x * step..].iter_mut().step_by(step);
        out.zip(samples).for_each(|(to, &from)| *to = from);
    }

    /// Start and stride of the samples of a row.
    fn row_offset(&self, slot: usize, row: usize) -> (usize, usize) {
        let n = self.picked.len();
        match self.order {
            SampleOrder::Planar => ((slot * self.height + row) * self.width, 1),
            SampleOrder::Interleaved => (row * self.width * n + slot, n),
        }
    }

    /// Linearly interpolates the rows between stored samples; the last stored row is repeated.
    fn interpolate_rows(&mut self, sampling: &Sampling) {
        let stored = overlap(self.top, self.rows, self.height);
        for (slot, &channel) in self.picked.iter().enumerate() {
            let every = sampling.rows(channel);
            for row in stored.clone() {
                let behind = (row as i64 - self.top) as usize % every;
                let next = row - behind.min(row) + every;
                if behind > 0 && behind <= row && next < stored.end {
                    self.interpolate_row(slot, [row - behind, row, next]);
                }
            }
        }
    }

    /// Interpolates the middle one of three rows.
    fn interpolate_row(&mut self, slot: usize, rows: [usize; 3]) {
        let share = (rows[1] - rows[0]) as f32 / (rows[2] - rows[0]) as f32;
        let [(before, step), (row, _), (next, _)] = rows.map(|row| self.row_offset(slot, row));
        for x in (0..self.width).map(|x| x * step) {
            let (a, b) = (self.samples[before + x], self.samples[next + x]);
            self.samples[row + x] = a + (b - a) * share;
        }
    }
}
