//! What a file may ask for before a single pixel is decoded.
//!
//! A damaged or hostile header of 60 bytes can ask for 245 GB, and an allocation that fails aborts the process: so sizes
//! are checked first, in arithmetic that cannot wrap.

/// Bounds on what a picture file may ask for; a file beyond them is refused before its pixels are touched.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Pixels along one side. Default: 32,768.
    pub side: u64,
    /// Pixels in all. Default: 128 Mi.
    pub pixels: u64,
    /// Channels of one picture. Default: 64.
    pub channels: u64,
    /// Bytes of the decoded samples. Default: 1 GiB.
    pub decoded_bytes: u64,
    /// Decoded bytes for each byte of the file, looked at above 64 MiB of decoded bytes. Default: 10,000.
    pub ratio: u64,
    /// Bytes of the file itself. Default: 1 GiB.
    pub file_bytes: u64,
    /// Bytes of text, profiles and other data that is not pixels. Default: 64 MiB.
    pub metadata_bytes: u64,
    /// Parts of a multi-part EXR. Default: 1,024.
    pub parts: u64,
}

/// Below this many decoded bytes no ratio is suspicious: a plain white picture compresses very well.
const RATIO_FREE_BYTES: u64 = 64 << 20;

impl Default for Limits {
    fn default() -> Self {
        Self {
            side: 32_768,
            pixels: 128 << 20,
            channels: 64,
            decoded_bytes: 1 << 30,
            ratio: 10_000,
            file_bytes: 1 << 30,
            metadata_bytes: 64 << 20,
            parts: 1_024,
        }
    }
}

/// What the header of a file asks for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Demand {
    pub(super) width: u64,
    pub(super) height: u64,
    pub(super) channels: u64,
    pub(super) bytes_per_pixel: u64,
    pub(super) file_bytes: u64,
}

impl Limits {
    /// Refuses what cannot be right or is too much; the text names the limit.
    pub(super) fn check(&self, d: Demand) -> Result<(), String> {
        let Demand { width, height, .. } = d;
        if width == 0 || height == 0 || d.channels == 0 {
            return Err(format!("{width} x {height} pixels with {} channels, expected at least 1 of each", d.channels));
        }
        at_most(width.max(height), self.side, "pixels along a side", "side")?;
        let pixels = width.checked_mul(height).ok_or("size overflows")?;
        at_most(pixels, self.pixels, "pixels", "pixels")?;
        at_most(d.channels, self.channels, "channels", "channels")?;
        let bytes = pixels.checked_mul(d.bytes_per_pixel).ok_or("size overflows")?;
        at_most(bytes, self.decoded_bytes, "decoded bytes", "decoded_bytes")?;
        if bytes > RATIO_FREE_BYTES {
            at_most(bytes / d.file_bytes.max(1), self.ratio, "decoded bytes for each byte of the file", "ratio")?;
        }
        Ok(())
    }
}

/// One limit: `what` is counted, `name` is the field to raise.
pub(super) fn at_most(count: u64, limit: u64, what: &str, name: &str) -> Result<(), String> {
    if count <= limit { Ok(()) } else { Err(format!("{count} {what}, over the limit of {limit} (Limits::{name})")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn demand(width: u64, height: u64) -> Demand {
        Demand { width, height, channels: 4, bytes_per_pixel: 16, file_bytes: 1_000 }
    }

    #[test]
    fn an_ordinary_photo_passes() {
        assert!(Limits::default().check(Demand { file_bytes: 6 << 20, ..demand(6000, 4000) }).is_ok());
    }

    #[test]
    fn a_bomb_is_refused_by_name() {
        let e = Limits::default().check(demand(32_000, 32_000)).unwrap_err();
        assert!(e.contains("Limits::pixels"), "{e}");
        let e = Limits::default().check(demand(5_000, 5_000)).unwrap_err();
        assert!(e.contains("Limits::ratio"), "{e}");
    }

    #[test]
    fn sizes_that_overflow_are_refused() {
        let all = Limits { side: u64::MAX, pixels: u64::MAX, ..Default::default() };
        assert!(all.check(demand(u64::MAX, u64::MAX)).is_err());
        assert!(all.check(demand(u64::MAX / 8, 1)).is_err());
    }

    #[test]
    fn an_empty_picture_is_refused() {
        assert!(Limits::default().check(demand(0, 4)).is_err());
    }
}
