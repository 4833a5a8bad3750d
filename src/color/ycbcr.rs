//! Luma and colour differences of video.

/// A way to write encoded R'G'B' as luma and two colour differences.
///
/// Takes and gives display-encoded values, not light. Luma is 0 to 1 and the differences are -1/2
/// to 1/2 in [`CodeRange::Full`]; in [`CodeRange::Video`] all three are code values over the
/// largest code. Nothing is clipped.
///
/// ```
/// use petcomp::color::{CodeRange, Ycbcr};
/// let [y, cb, cr] = Ycbcr::BT709.encode([1.0, 1.0, 1.0], CodeRange::Video { bits: 8 });
/// assert!((y * 255.0 - 235.0).abs() < 1e-4 && (cb * 255.0 - 128.0).abs() < 1e-4 && cb == cr);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ycbcr {
    /// Weight of red in luma.
    pub red: f64,
    /// Weight of blue in luma; green has the rest.
    pub blue: f64,
}

/// Which codes carry the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CodeRange {
    /// All of them: JPEG.
    Full,
    /// Luma from 16 to 235 and differences from 16 to 240, times 2^(bits - 8): television.
    Video {
        /// Bits of a code, 8 or more.
        bits: u32,
    },
}

impl Ycbcr {
    /// Standard definition television and JPEG (ITU-R BT.601-7).
    pub const BT601: Self = Self {
        red: 0.299,
        blue: 0.114,
    };
    /// High definition television (ITU-R BT.709-6).
    pub const BT709: Self = Self {
        red: 0.2126,
        blue: 0.0722,
    };
    /// Ultra high definition television, not constant luminance (ITU-R BT.2020-2).
    pub const BT2020: Self = Self {
        red: 0.2627,
        blue: 0.0593,
    };

    /// Y', Cb, Cr of encoded R'G'B'.
    pub fn encode(self, rgb: [f32; 3], range: CodeRange) -> [f32; 3] {
        let [r, g, b] = rgb.map(f64::from);
        let y = self.red * r + self.green() * g + self.blue * b;
        let cb = 0.5 * (b - y) / (1.0 - self.blue);
        let cr = 0.5 * (r - y) / (1.0 - self.red);
        let [luma, chroma] = range.scales();
        [luma.code(y), chroma.code(cb), chroma.code(cr)].map(|v| v as f32)
    }

    /// Encoded R'G'B' of Y', Cb, Cr.
    pub fn decode(self, ycbcr: [f32; 3], range: CodeRange) -> [f32; 3] {
        let [y, cb, cr] = ycbcr.map(f64::from);
        let [luma, chroma] = range.scales();
        let y = luma.signal(y);
        let b = y + 2.0 * (1.0 - self.blue) * chroma.signal(cb);
        let r = y + 2.0 * (1.0 - self.red) * chroma.signal(cr);
        let g = (y - self.red * r - self.blue * b) / self.green();
        [r, g, b].map(|v| v as f32)
    }

    fn green(self) -> f64 {
        1.0 - self.red - self.blue
    }
}

/// A signal's zero and unit as fractions of the largest code.
#[derive(Clone, Copy)]
struct CodeScale {
    zero: f64,
    unit: f64,
}

impl CodeScale {
    fn new(zero: f64, unit: f64) -> Self {
        Self { zero, unit }
    }

    fn code(self, signal: f64) -> f64 {
        self.zero + self.unit * signal
    }

    fn signal(self, code: f64) -> f64 {
        (code - self.zero) / self.unit
    }
}

impl CodeRange {
    /// Of luma and of the differences.
    fn scales(self) -> [CodeScale; 2] {
        match self {
            Self::Full => [CodeScale::new(0.0, 1.0); 2],
            Self::Video { bits } => {
                let max = libm::exp2(bits.into()) - 1.0;
                let step = libm::exp2(f64::from(bits) - 8.0) / max;
                [
                    CodeScale::new(16.0 * step, 219.0 * step),
                    CodeScale::new(128.0 * step, 224.0 * step),
                ]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KINDS: [Ycbcr; 3] = [Ycbcr::BT601, Ycbcr::BT709, Ycbcr::BT2020];
    const RANGES: [CodeRange; 3] = [
        CodeRange::Full,
        CodeRange::Video { bits: 8 },
        CodeRange::Video { bits: 10 },
    ];

    #[test]
    fn decoding_undoes_encoding() {
        for kind in KINDS {
            for range in RANGES {
                for rgb in [[0.0, 0.5, 1.0], [0.9, 0.1, 0.3], [1.5, -0.2, 0.0]] {
                    let back = kind.decode(kind.encode(rgb, range), range);
                    assert!(
                        back.iter().zip(rgb).all(|(a, b)| (a - b).abs() < 1e-6),
                        "{kind:?} {range:?} {back:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn greys_have_no_colour_difference() {
        for kind in KINDS {
            let [y, cb, cr] = kind.encode([0.25; 3], CodeRange::Full);
            assert!((y - 0.25).abs() < 1e-7 && cb.abs() < 1e-7 && cr.abs() < 1e-7);
        }
    }

    #[test]
    fn primaries_reach_the_ends_of_the_differences() {
        for kind in KINDS {
            assert!((kind.encode([0.0, 0.0, 1.0], CodeRange::Full)[1] - 0.5).abs() < 1e-7);
            assert!((kind.encode([0.0, 1.0, 1.0], CodeRange::Full)[2] + 0.5).abs() < 1e-7);
        }
    }
}
