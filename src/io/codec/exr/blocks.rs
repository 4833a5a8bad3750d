//! The samples of an EXR part, block by block: only those of the channels that are wanted are kept.

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

/// Decoded bytes that are in memory at a time, in blocks, beside what is kept of them.
const BATCH_BYTES: usize = 16 << 20;

/// How samples of several channels lie in memory.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum SampleOrder {
    /// All of a pixel side by side.
    Interleaved,
    /// One channel behind the other.
    Planar,
}

/// The part of a file that is read, and what of it.
pub(super) struct PartReader<'a> {
    /// The whole file.
    pub(super) bytes: &'a [u8],
    pub(super) meta: &'a MetaData,
    pub(super) part: usize,
    /// Indices of channels in the part, each once.
    pub(super) picked: &'a [usize],
    /// The pixels that come out: what the part has of them, zeros elsewhere.
    pub(super) window: IntegerBounds,
    pub(super) order: SampleOrder,
    /// Channels with fewer samples than pixels.
    pub(super) sampling: Option<&'a Sampling>,
}

impl PartReader<'_> {
    fn header(&self) -> &Header {
        &self.meta.headers[self.part]
    }

    /// The samples, halves and integers as floats.
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

    /// Blocks that are decoded at a time.
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
        // The table of blocks may lie.
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

/// What came out of a piece of the file.
enum DecodedBlock {
    Pixels(UncompressedBlock),
    Lines(Vec<SampleLine>),
}

/// The pixels that come out.
struct SampleBuffer<'a> {
    picked: &'a [usize],
    width: usize,
    height: usize,
    /// Column and row of the part's first pixel.
    left: i64,
    top: i64,
    /// Rows of the part.
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

    /// All samples, those between rows made from them.
    fn finish(mut self, sampling: Option<&Sampling>) -> Vec<f32> {
        if let Some(sampling) = sampling {
            self.interpolate_rows(sampling);
        }
        self.samples
    }

    /// A run of samples of a channel, cut to the window.
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

    /// Samples of a channel from a pixel of the window on.
    fn put_run(&mut self, slot: usize, [x, y]: [usize; 2], samples: &[f32]) {
        let (at, step) = self.row_offset(slot, y);
        let out = self.samples[at + x * step..].iter_mut().step_by(step);
        out.zip(samples).for_each(|(to, &from)| *to = from);
    }

    /// Where the samples of a row begin, and how far apart they are.
    fn row_offset(&self, slot: usize, row: usize) -> (usize, usize) {
        let n = self.picked.len();
        match self.order {
            SampleOrder::Planar => ((slot * self.height + row) * self.width, 1),
            SampleOrder::Interleaved => (row * self.width * n + slot, n),
        }
    }

    /// Rows that lie between samples, interpolated linearly from one to the next; the last is
    /// repeated.
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

    /// Makes the row in the middle of three.
    fn interpolate_row(&mut self, slot: usize, rows: [usize; 3]) {
        let share = (rows[1] - rows[0]) as f32 / (rows[2] - rows[0]) as f32;
        let [(before, step), (row, _), (next, _)] = rows.map(|row| self.row_offset(slot, row));
        for x in (0..self.width).map(|x| x * step) {
            let (a, b) = (self.samples[before + x], self.samples[next + x]);
            self.samples[row + x] = a + (b - a) * share;
        }
    }
}
