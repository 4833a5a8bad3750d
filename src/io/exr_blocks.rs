//! The samples of an EXR part, block by block: only those of the channels that are wanted are kept.

use super::exr_chroma::Sampling;
use super::raster::Refusal;
use exr::block::UncompressedBlock;
use exr::block::chunk::Chunk;
use exr::block::reader::Reader;
use exr::meta::MetaData;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header;
use exr::prelude::{IntegerBounds, Vec2};
use half::f16;
use half::slice::HalfFloatSliceExt;
use rayon::prelude::*;
use std::io::Cursor;

type Result<T> = std::result::Result<T, Refusal>;

/// Decoded bytes that are in hand at a time, in blocks, beside what is kept of them.
const IN_HAND: usize = 16 << 20;

/// How samples of several channels lie in memory.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Order {
    /// All of a pixel side by side.
    Interleaved,
    /// One channel behind the other.
    Planar,
}

/// The part of a file that is read, and what of it.
pub(super) struct Job<'a> {
    /// The whole file.
    pub(super) bytes: &'a [u8],
    pub(super) meta: &'a MetaData,
    pub(super) part: usize,
    /// Channels by their place in the part, each once.
    pub(super) picked: &'a [usize],
    /// The pixels that come out: what the part has of them, zeros elsewhere.
    pub(super) window: IntegerBounds,
    pub(super) order: Order,
    /// Channels with fewer samples than pixels.
    pub(super) sampling: Option<&'a Sampling>,
}

impl Job<'_> {
    pub(super) fn header(&self) -> &Header {
        &self.meta.headers[self.part]
    }

    /// The samples, halves and whole numbers as floats.
    pub(super) fn read(&self) -> Result<Vec<f32>> {
        let mut out = Out::new(self);
        let chunks = Reader::read_from_buffered(Cursor::new(self.bytes), false)?;
        let largest = Vec2(0, 0);
        let mut chunks = chunks.filter_chunks(false, |_, _, block| {
            block.layer == self.part && block.level == largest
        })?;
        let block_bytes = self.header().max_block_byte_size().max(1);
        let at_once = (IN_HAND / block_bytes).max(rayon::current_num_threads());
        loop {
            let batch = chunks
                .by_ref()
                .take(at_once)
                .collect::<exr::error::Result<Vec<Chunk>>>()?;
            if batch.is_empty() {
                self.sampling
                    .into_iter()
                    .for_each(|sampling| out.blend(sampling));
                return Ok(out.samples);
            }
            let blocks = batch
                .into_par_iter()
                .map(|chunk| self.decoded(chunk))
                .collect::<Result<Vec<_>>>()?;
            blocks.iter().for_each(|lines| lines.put(&mut out));
        }
    }

    fn decoded(&self, chunk: Chunk) -> Result<Block<'_>> {
        if let Some(sampling) = self.sampling {
            return Ok(Block {
                header: self.header(),
                data: Data::Lines(sampling.lines(self, chunk)?),
            });
        }
        let block = UncompressedBlock::decompress_chunk(chunk, self.meta, false)?;
        // The table of blocks may lie.
        if block.index.layer != self.part || block.index.level != Vec2(0, 0) {
            return Err("damaged EXR: a block of another part".into());
        }
        Ok(Block {
            header: self.header(),
            data: Data::Block(block),
        })
    }
}

/// A run of samples of one channel: where it begins in the part, and the numbers.
pub(super) struct Line {
    pub(super) channel: usize,
    pub(super) x: usize,
    pub(super) y: usize,
    pub(super) samples: Vec<f32>,
}

/// What came out of a piece of the file.
struct Block<'a> {
    header: &'a Header,
    data: Data,
}

enum Data {
    Block(UncompressedBlock),
    Lines(Vec<Line>),
}

impl Block<'_> {
    fn put(&self, out: &mut Out<'_>) {
        match &self.data {
            Data::Lines(lines) => lines
                .iter()
                .for_each(|l| out.put(l.channel, l.x, l.y, &l.samples)),
            Data::Block(block) => {
                let mut floats = Vec::new();
                for line in block.lines(&self.header.channels) {
                    let (at, channel) = (line.location.position, line.location.channel);
                    to_floats(
                        line.value,
                        self.header.channels.list[channel].sample_type,
                        &mut floats,
                    );
                    out.put(channel, at.x(), at.y(), &floats);
                }
            }
        }
    }
}

/// Native bytes of samples as floats. Halves all at once: one by one takes five times as long.
pub(super) fn to_floats(bytes: &[u8], kind: SampleType, floats: &mut Vec<f32>) {
    match kind {
        SampleType::F16 => {
            let halves: Vec<f16> = bytemuck::pod_collect_to_vec(bytes);
            floats.resize(halves.len(), 0.0);
            halves.convert_to_f32_slice(floats);
        }
        SampleType::F32 => *floats = bytemuck::pod_collect_to_vec(bytes),
        SampleType::U32 => {
            let whole: Vec<u32> = bytemuck::pod_collect_to_vec(bytes);
            floats.clear();
            floats.extend(whole.into_iter().map(|v| v as f32));
        }
    }
}

/// The pixels that come out.
struct Out<'a> {
    picked: &'a [usize],
    width: usize,
    height: usize,
    /// Column and row of the part's first pixel.
    left: i64,
    top: i64,
    /// Rows of the part.
    rows: usize,
    order: Order,
    samples: Vec<f32>,
}

impl<'a> Out<'a> {
    fn new(job: &Job<'a>) -> Self {
        let (width, height) = (job.window.size.x(), job.window.size.y());
        let shift = |at: i32, origin: i32| i64::from(at) - i64::from(origin);
        let (at, window) = (
            job.header().own_attributes.layer_position,
            job.window.position,
        );
        let (left, top) = (shift(at.x(), window.x()), shift(at.y(), window.y()));
        let samples = bytemuck::zeroed_vec(width * height * job.picked.len());
        let rows = job.header().layer_size.y();
        Self {
            picked: job.picked,
            width,
            height,
            left,
            top,
            rows,
            order: job.order,
            samples,
        }
    }

    /// A run of samples of a channel, cut to the window.
    fn put(&mut self, channel: usize, x: usize, y: usize, samples: &[f32]) {
        let Some(slot) = self.picked.iter().position(|&c| c == channel) else {
            return;
        };
        let (x, y) = (x as i64 + self.left, y as i64 + self.top);
        let columns = super::exr::overlap(x, samples.len(), self.width);
        let rows = super::exr::overlap(y, 1, self.height);
        let Some(row) = rows.into_iter().next().filter(|_| !columns.is_empty()) else {
            return;
        };
        let samples = &samples[(columns.start as i64 - x) as usize..][..columns.len()];
        let (at, step) = self.place(slot, row);
        let to = self.samples[at + columns.start * step..]
            .iter_mut()
            .step_by(step);
        to.zip(samples).for_each(|(to, &from)| *to = from);
    }

    /// Where the samples of a row begin, and how far they are apart.
    fn place(&self, slot: usize, row: usize) -> (usize, usize) {
        let n = self.picked.len();
        match self.order {
            Order::Planar => ((slot * self.height + row) * self.width, 1),
            Order::Interleaved => (row * self.width * n + slot, n),
        }
    }

    /// Rows that lie between samples, in a straight line from one to the next; the last goes on.
    fn blend(&mut self, sampling: &Sampling) {
        let stored = super::exr::overlap(self.top, self.rows, self.height);
        for (slot, &channel) in self.picked.iter().enumerate() {
            let every = sampling.rows(channel);
            for row in stored.clone() {
                let behind = (row as i64 - self.top) as usize % every;
                let next = row - behind.min(row) + every;
                if behind > 0 && behind <= row && next < stored.end {
                    self.blend_row(slot, [row - behind, row, next]);
                }
            }
        }
    }

    /// Makes the row in the middle of three.
    fn blend_row(&mut self, slot: usize, rows: [usize; 3]) {
        let share = (rows[1] - rows[0]) as f32 / (rows[2] - rows[0]) as f32;
        let [(before, step), (row, _), (next, _)] = rows.map(|row| self.place(slot, row));
        for x in (0..self.width).map(|x| x * step) {
            let (a, b) = (self.samples[before + x], self.samples[next + x]);
            self.samples[row + x] = a + (b - a) * share;
        }
    }
}
