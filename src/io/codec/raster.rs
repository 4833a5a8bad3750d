//! Decoded samples as a file stores them.

use super::orient::Orientation;
use bytemuck::{Pod, zeroed_vec};
#[cfg(feature = "oiio")]
use bytemuck::{cast_slice, cast_slice_mut};
use half::f16;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Samples of a picture, channels interleaved, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Samples {
    U8(Vec<u8>),
    U16(Vec<u16>),
    F16(Vec<f16>),
    F32(Vec<f32>),
}

/// How a sample is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum SampleKind {
    U8,
    U16,
    F16,
    F32,
}

#[cfg(feature = "oiio")]
impl SampleKind {
    pub(crate) fn bytes(self) -> u32 {
        match self {
            Self::U8 => 1,
            Self::U16 | Self::F16 => 2,
            Self::F32 => 4,
        }
    }
}

impl Samples {
    /// `count` zeros.
    pub(crate) fn zeroed(kind: SampleKind, count: usize) -> Self {
        match kind {
            SampleKind::U8 => Self::U8(zeroed_vec(count)),
            SampleKind::U16 => Self::U16(zeroed_vec(count)),
            SampleKind::F16 => Self::F16(zeroed_vec(count)),
            SampleKind::F32 => Self::F32(zeroed_vec(count)),
        }
    }

    pub(crate) fn kind(&self) -> SampleKind {
        match self {
            Self::U8(_) => SampleKind::U8,
            Self::U16(_) => SampleKind::U16,
            Self::F16(_) => SampleKind::F16,
            Self::F32(_) => SampleKind::F32,
        }
    }

    /// The bytes of all samples, in native order.
    #[cfg(feature = "oiio")]
    pub(crate) fn bytes(&self) -> &[u8] {
        match self {
            Self::U8(v) => v,
            Self::U16(v) => cast_slice(v),
            Self::F16(v) => cast_slice(v),
            Self::F32(v) => cast_slice(v),
        }
    }

    /// Like [`bytes`](Self::bytes), mutable.
    #[cfg(feature = "oiio")]
    pub(crate) fn bytes_mut(&mut self) -> &mut [u8] {
        match self {
            Self::U8(v) => v,
            Self::U16(v) => cast_slice_mut(v),
            Self::F16(v) => cast_slice_mut(v),
            Self::F32(v) => cast_slice_mut(v),
        }
    }

    pub(crate) fn are_float(&self) -> bool {
        matches!(self, Self::F16(_) | Self::F32(_))
    }

    /// The samples of one of `count` channels.
    fn one_channel(&self, count: usize, channel: usize) -> Self {
        match self {
            Self::U8(v) => Self::U8(one_channel(v, count, channel)),
            Self::U16(v) => Self::U16(one_channel(v, count, channel)),
            Self::F16(v) => Self::F16(one_channel(v, count, channel)),
            Self::F32(v) => Self::F32(one_channel(v, count, channel)),
        }
    }

    /// The samples of the upright picture, `n` per pixel, where `stored` is the stored size.
    fn turned(&self, by: Orientation, n: usize, stored: (usize, usize)) -> Self {
        match self {
            Self::U8(v) => Self::U8(by.apply(v, n, stored)),
            Self::U16(v) => Self::U16(by.apply(v, n, stored)),
            Self::F16(v) => Self::F16(by.apply(v, n, stored)),
            Self::F32(v) => Self::F32(by.apply(v, n, stored)),
        }
    }

    /// Drops the last samples and releases their memory.
    pub(crate) fn shorten(&mut self, count: usize) {
        match self {
            Self::U8(v) => shorten(v, count),
            Self::U16(v) => shorten(v, count),
            Self::F16(v) => shorten(v, count),
            Self::F32(v) => shorten(v, count),
        }
    }
}

fn shorten<T>(samples: &mut Vec<T>, count: usize) {
    samples.truncate(count);
    samples.shrink_to_fit();
}

/// The output of a decoder.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Raster {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Names of the interleaved channels: `R G B A`, `Y`, `Z`, ...
    pub(crate) names: Vec<String>,
    pub(crate) samples: Samples,
    /// Whether colour samples are sRGB display values.
    pub(crate) display_encoded: bool,
    /// Whether colour samples are already multiplied by alpha.
    pub(crate) premultiplied: bool,
}

impl Raster {
    /// A picture of display-encoded codes; alpha is straight.
    pub(crate) fn display_codes(
        (width, height): (usize, usize),
        names: Vec<String>,
        samples: Samples,
    ) -> Self {
        Self {
            width,
            height,
            names,
            samples,
            display_encoded: true,
            premultiplied: false,
        }
    }

    /// Number of samples in a row.
    pub(crate) fn row_samples(&self) -> usize {
        self.width * self.names.len()
    }

    /// The picture reduced to one of its channels.
    pub(crate) fn narrowed(self, channel: usize) -> Self {
        let count = self.names.len();
        if count == 1 {
            return self;
        }
        Self {
            names: vec![self.names[channel].clone()],
            samples: self.samples.one_channel(count, channel),
            ..self
        }
    }

    /// The picture rotated upright.
    pub(crate) fn upright(self, orientation: Orientation) -> Self {
        if !orientation.turns() {
            return self;
        }
        let stored = (self.width, self.height);
        let (width, height) = orientation.size(stored);
        Self {
            width,
            height,
            samples: self.samples.turned(orientation, self.names.len(), stored),
            ..self
        }
    }

    /// Number of samples that are infinite or NaN.
    pub(crate) fn count_not_finite(&self) -> usize {
        match &self.samples {
            Samples::F16(v) => v.par_iter().filter(|x| !x.is_finite()).count(),
            Samples::F32(v) => v.par_iter().filter(|x| !x.is_finite()).count(),
            Samples::U8(_) | Samples::U16(_) => 0,
        }
    }
}

fn one_channel<T: Pod>(samples: &[T], count: usize, channel: usize) -> Vec<T> {
    samples.chunks_exact(count).map(|px| px[channel]).collect()
}

/// Channel names for a picture of `count` unnamed channels.
pub(crate) fn default_names(count: usize) -> Option<Vec<String>> {
    let names: &[&str] = match count {
        1 => &["Y"],
        2 => &["Y", "A"],
        3 => &["R", "G", "B"],
        4 => &["R", "G", "B", "A"],
        _ => return None,
    };
    Some(names.iter().map(|&n| n.into()).collect())
}

/// The part of `0..shown` covered by `length` samples from `start` on.
pub(crate) fn overlap(start: i64, length: usize, shown: usize) -> std::ops::Range<usize> {
    let last = shown as i64;
    let end = start + length as i64;
    start.clamp(0, last) as usize..end.clamp(0, last) as usize
}
