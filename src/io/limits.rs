//! Limits on what a file may demand before a single pixel is decoded.
//!
//! A damaged or hostile header of 60 bytes can demand 245 GB, and a failed allocation aborts the
//! process: so sizes are checked first, with arithmetic that cannot overflow.

use crate::error::{Error, Result};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::OnceLock;

/// Limits on what a picture file may demand; a file that exceeds them is rejected before its pixels
/// are decoded.
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
    /// Decoded bytes for each byte of the file, checked above 64 MiB of decoded bytes. Default:
    /// 10,000.
    pub ratio: u64,
    /// Bytes of the file itself. Default: 1 GiB.
    pub file_bytes: u64,
    /// Bytes of text, profiles and other data that is not pixels. Default: 64 MiB.
    pub metadata_bytes: u64,
    /// Parts of a multi-part EXR. Default: 1,024.
    pub parts: u64,
    /// Wall-clock seconds for a file in the OpenImageIO worker, plus one for each 10 million
    /// pixels; at most 86,400. Default: 10.
    pub seconds: u64,
    /// Bytes of a document (TOML, JSON, YAML, CSV): recipes, labels, manifests. Ground truth and
    /// detections in COCO JSON are data and subject to `file_bytes`. Default: 16 MiB.
    pub document_bytes: u64,
    /// Nesting depth of a document, at most 80. Default: 64.
    pub document_depth: u64,
    /// Share of the machine's memory that a picture may need, at 12 bytes per pixel and channel,
    /// percent. Default: 50.
    pub memory_percent: u64,
}

/// A day: longer than anyone waits for a picture.
const MAX_SECONDS: u64 = 86_400;
/// Levels that the TOML and JSON readers support.
const MAX_DOCUMENT_DEPTH: u64 = 80;
/// Maximum value of the other limits: sums of a few such numbers cannot overflow.
const MAX_LIMIT: u64 = 1 << 53;
/// Maximum percentage of the memory: all of it, and more.
const MAX_MEMORY_PERCENT: u64 = 10_000;

/// Maximum number of bytes that a pixel uses per channel: three floats.
const BYTES_PER_SAMPLE: u64 = 12;

/// Below this many decoded bytes no ratio is suspicious: a plain white picture compresses very
/// well.
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
            seconds: 10,
            document_bytes: 16 << 20,
            document_depth: 64,
            memory_percent: 50,
        }
    }
}

/// The meaning of `K`, `M` and `G` after a number.
const SUFFIXES: [(char, u64); 3] = [('K', 1 << 10), ('M', 1 << 20), ('G', 1 << 30)];

/// A new value for one limit: `side=65536`, `decoded_bytes=4G`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LimitOverride {
    name: String,
    value: u64,
}

impl FromStr for LimitOverride {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let (name, number) = text
            .split_once('=')
            .ok_or_else(|| Error::value(text, "no value, expected NAME=NUMBER"))?;
        let value = parse_with_suffix(number).ok_or_else(|| {
            let what = format!("{number:?}, expected a number such as 65536 or 4G");
            Error::value(name, what)
        })?;
        let name = name.into();
        let limit = Self { name, value };
        Limits::default().with(&limit)?;
        Ok(limit)
    }
}

/// `3K` is 3072.
fn parse_with_suffix(number: &str) -> Option<u64> {
    let unit = SUFFIXES
        .iter()
        .find(|(suffix, _)| number.ends_with(*suffix));
    let (digits, factor) = unit.map_or((number, 1), |&(suffix, factor)| {
        (number.trim_end_matches(suffix), factor)
    });
    let value: u64 = digits.parse().ok()?;
    value.checked_mul(factor)
}

impl Limits {
    /// These limits with a new value for one of them.
    ///
    /// # Errors
    /// [`Error::Value`] for an unknown limit, and for an invalid value.
    pub fn with(mut self, limit: &LimitOverride) -> Result<Self> {
        let LimitOverride { name, value } = limit;
        let mut named = self.named();
        let Some((_, place, most)) = named.iter_mut().find(|(known, ..)| known == name) else {
            return Err(unknown_limit(name, named.map(|(name, ..)| name)));
        };
        if *value > *most {
            let what = format!("{value}, expected at most {most}");
            return Err(Error::value(name, what));
        }
        **place = *value;
        Ok(self)
    }

    /// Rejects a picture in memory with a size that no file may have; the text states what was
    /// expected.
    ///
    /// # Errors
    /// For an empty picture, and one that exceeds the limits on sides or pixels.
    #[doc(hidden)]
    pub fn check_size(&self, [width, height]: [usize; 2]) -> std::result::Result<(), String> {
        let (side, pixels) = (self.side, self.pixels);
        let count = (width as u64).saturating_mul(height as u64);
        if count > 0 && width.max(height) as u64 <= side && count <= pixels {
            return Ok(());
        }
        Err(format!(
            "{width} x {height} pixels, expected at least 1 x 1 and at most {side} a side and {pixels} in total"
        ))
    }

    /// Every limit with its name and its maximum.
    fn named(&mut self) -> [(&'static str, &mut u64, u64); 12] {
        [
            ("side", &mut self.side, MAX_LIMIT),
            ("pixels", &mut self.pixels, MAX_LIMIT),
            ("channels", &mut self.channels, MAX_LIMIT),
            ("decoded_bytes", &mut self.decoded_bytes, MAX_LIMIT),
            ("ratio", &mut self.ratio, MAX_LIMIT),
            ("file_bytes", &mut self.file_bytes, MAX_LIMIT),
            ("metadata_bytes", &mut self.metadata_bytes, MAX_LIMIT),
            ("parts", &mut self.parts, MAX_LIMIT),
            ("seconds", &mut self.seconds, MAX_SECONDS),
            ("document_bytes", &mut self.document_bytes, MAX_LIMIT),
            (
                "document_depth",
                &mut self.document_depth,
                MAX_DOCUMENT_DEPTH,
            ),
            (
                "memory_percent",
                &mut self.memory_percent,
                MAX_MEMORY_PERCENT,
            ),
        ]
    }
}

fn unknown_limit(name: &str, known: [&str; 12]) -> Error {
    let known = known.join(", ");
    let what = format!("no such limit, expected one of {known}");
    Error::value(name, what)
}

/// What the header of a file demands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Demand {
    pub(super) width: u64,
    pub(super) height: u64,
    pub(super) channels: u64,
    pub(super) bytes_per_pixel: u64,
    pub(super) file_bytes: u64,
}

impl Demand {
    /// The demand of a picture whose channels are all stored alike.
    pub(super) fn new(
        [width, height]: [impl Into<u64>; 2],
        channels: impl Into<u64>,
        bytes_per_sample: impl Into<u64>,
        file_bytes: u64,
    ) -> Self {
        let channels = channels.into();
        Self {
            width: width.into(),
            height: height.into(),
            channels,
            bytes_per_pixel: channels * bytes_per_sample.into(),
            file_bytes,
        }
    }
    fn is_empty(&self) -> bool {
        self.width == 0 || self.height == 0 || self.channels == 0
    }
}

impl Limits {
    /// Rejects a demand that is invalid, too large or exceeds the memory; the text names the limit.
    pub(super) fn check(&self, demand: Demand) -> std::result::Result<(), String> {
        affordable(self.check_bounds(demand)?)
    }

    /// Like [`check`](Self::check), but without checking the memory. Returns the decoded bytes.
    pub(super) fn check_bounds(&self, demand: Demand) -> std::result::Result<u64, String> {
        let (width, height, channels) = (demand.width, demand.height, demand.channels);
        if demand.is_empty() {
            return Err(format!(
                "{width} x {height} pixels with {channels} channels, expected at least 1 of each"
            ));
        }
        at_most(width.max(height), self.side, "pixels along a side", "side")?;
        let pixels = width.checked_mul(height).ok_or("size overflows")?;
        at_most(pixels, self.pixels, "pixels", "pixels")?;
        at_most(channels, self.channels, "channels", "channels")?;
        let bytes = pixels.checked_mul(demand.bytes_per_pixel);
        let bytes = bytes.ok_or("size overflows")?;
        at_most(bytes, self.decoded_bytes, "decoded bytes", "decoded_bytes")?;
        self.check_ratio(bytes, demand.file_bytes)?;
        Ok(bytes)
    }

    fn check_ratio(&self, bytes: u64, file_bytes: u64) -> std::result::Result<(), String> {
        if bytes <= RATIO_FREE_BYTES {
            return Ok(());
        }
        let what = "decoded bytes per byte of the file";
        at_most(bytes / file_bytes.max(1), self.ratio, what, "ratio")
    }

    /// Fails for a header that exceeds the metadata limit.
    pub(super) fn check_header_bytes(&self, bytes: u64) -> std::result::Result<(), String> {
        let what = "bytes without an end of the header";
        at_most(bytes, self.metadata_bytes, what, "metadata_bytes")
    }

    /// Rejects a picture that needs too much of the machine's memory; the text shows the
    /// calculation. If the system does not report its memory, nothing is rejected.
    pub(super) fn check_memory(
        &self,
        width: usize,
        height: usize,
        channels: usize,
    ) -> std::result::Result<(), String> {
        machine_bytes().map_or(Ok(()), |machine| {
            self.check_memory_of(machine, [width, height, channels].map(|n| n as u64))
        })
    }

    fn check_memory_of(
        &self,
        machine: u64,
        [width, height, channels]: [u64; 3],
    ) -> std::result::Result<(), String> {
        let need = saturating_product([width, height, channels, BYTES_PER_SAMPLE]);
        let percent = self.memory_percent;
        if u128::from(need) * 100 <= u128::from(machine) * u128::from(percent) {
            return Ok(());
        }
        let [need, machine] = [need, machine].map(|bytes| bytes >> 20);
        Err(format!(
            "{width} x {height} pixels x {channels} channels x {BYTES_PER_SAMPLE} bytes = {need} MiB of memory, over \
             {percent} % of this machine's {machine} MiB (Limits::memory_percent; --limit memory_percent=N)"
        ))
    }
}

/// A product of sizes, saturating at the largest number.
pub(super) fn saturating_product<const N: usize>(sizes: [u64; N]) -> u64 {
    sizes.into_iter().fold(1, u64::saturating_mul)
}

/// The memory of this machine, or of the control group that limits this process; none if the system
/// does not report it. Queried once.
pub(crate) fn machine_bytes() -> Option<u64> {
    static BYTES: OnceLock<Option<u64>> = OnceLock::new();
    *BYTES.get_or_init(usable_bytes)
}

/// How many pictures of this many bytes fit into half of a machine's memory, at least one;
/// unlimited if the memory is unknown.
pub(super) fn fitting_pictures(machine_bytes: Option<u64>, picture_bytes: u64) -> usize {
    let need = picture_bytes.max(1);
    let fitting = machine_bytes.map_or(u64::MAX, |bytes| bytes / 2 / need);
    usize::try_from(fitting.max(1)).unwrap_or(usize::MAX)
}

fn usable_bytes() -> Option<u64> {
    let installed = installed_bytes()?;
    Some(control_group_bytes().unwrap_or(u64::MAX).min(installed))
}

fn installed_bytes() -> Option<u64> {
    let total = line_after("MemTotal:", "/proc/meminfo")?;
    let kib: u64 = total.trim().strip_suffix(" kB")?.parse().ok()?;
    Some(kib << 10)
}

/// The lowest limit of this process's control group (cgroup v2) and those above it.
fn control_group_bytes() -> Option<u64> {
    own_control_group()?
        .ancestors()
        .filter_map(group_bytes)
        .min()
}

/// The rest of the first line in a file that begins with `start`.
fn line_after(start: &str, file: &str) -> Option<String> {
    let text = std::fs::read_to_string(file).ok()?;
    let rest = text.lines().find_map(|line| line.strip_prefix(start))?;
    Some(rest.into())
}

fn own_control_group() -> Option<PathBuf> {
    let own = line_after("0::/", "/proc/self/cgroup")?;
    Some(Path::new("/sys/fs/cgroup").join(own))
}

fn group_bytes(group: &Path) -> Option<u64> {
    let most = std::fs::read_to_string(group.join("memory.max")).ok()?;
    most.trim().parse().ok()
}

/// Checks one limit: `what` is counted, `name` is the field to raise.
pub(super) fn at_most(
    count: u64,
    limit: u64,
    what: &str,
    name: &str,
) -> std::result::Result<(), String> {
    if count <= limit {
        return Ok(());
    }
    Err(format!(
        "{count} {what}, over the limit of {limit} (Limits::{name}; --limit {name}=N)"
    ))
}

/// Rejects a demand for which the system has no memory, as far as it reports that: a failed
/// allocation ends the process.
pub(super) fn affordable(bytes: u64) -> std::result::Result<(), String> {
    if can_reserve(bytes) {
        return Ok(());
    }
    let mebibytes = bytes >> 20;
    Err(format!(
        "needs {mebibytes} MiB of memory, more than the system provides"
    ))
}

fn can_reserve(bytes: u64) -> bool {
    usize::try_from(bytes).is_ok_and(|n| Vec::<u8>::new().try_reserve_exact(n).is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_memory_holds_so_many_pictures_and_one_at_least() {
        let (laptop, phone) = (16_u64 << 30, 12_000_000 * 140);
        assert_eq!(fitting_pictures(Some(laptop), phone), 5);
        assert_eq!(fitting_pictures(Some(laptop), 140_000_000_000), 1);
        assert!(fitting_pictures(Some(laptop), 14_000_000) > 500);
        assert_eq!(fitting_pictures(Some(laptop), 0), 8_usize << 30);
        assert_eq!(fitting_pictures(None, phone), usize::MAX);
    }

    fn demand(width: u64, height: u64) -> Demand {
        Demand {
            width,
            height,
            channels: 4,
            bytes_per_pixel: 16,
            file_bytes: 1_000,
        }
    }

    #[test]
    fn an_ordinary_photo_passes() {
        assert!(
            Limits::default()
                .check(Demand {
                    file_bytes: 6 << 20,
                    ..demand(6000, 4000)
                })
                .is_ok()
        );
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
        let all = Limits {
            side: u64::MAX,
            pixels: u64::MAX,
            ..Default::default()
        };
        assert!(all.check(demand(u64::MAX, u64::MAX)).is_err());
        assert!(all.check(demand(u64::MAX / 8, 1)).is_err());
    }

    #[test]
    fn every_limit_has_a_name() {
        let json = serde_json::to_value(Limits::default()).unwrap();
        for name in json.as_object().unwrap().keys() {
            let changed = Limits::default()
                .with(&format!("{name}=80").parse().unwrap())
                .unwrap();
            assert_eq!(serde_json::to_value(changed).unwrap()[name], 80);
            let most = format!("{name}={}", u64::MAX)
                .parse::<LimitOverride>()
                .unwrap_err()
                .to_string();
            assert!(
                most.starts_with(&format!("{name}: 18446744073709551615, expected at most ")),
                "{most}"
            );
        }
        assert_eq!(
            Limits::default()
                .with(&"side=3K".parse().unwrap())
                .unwrap()
                .side,
            3072
        );
        for bad in [
            "side",
            "side=x",
            "side=99999999999G",
            "sides=3",
            "side=-1",
            "side=G",
        ] {
            assert!(bad.parse::<LimitOverride>().is_err(), "{bad}");
        }
    }

    #[test]
    fn a_need_beyond_a_share_of_the_memory_is_refused_with_the_sum() {
        let gib = 1 << 30;
        let square = [11_585, 11_585, 3];
        assert!(Limits::default().check_memory_of(16 * gib, square).is_ok());
        assert_eq!(
            Limits::default()
                .check_memory_of(8 * gib, square)
                .unwrap_err(),
            "11585 x 11585 pixels x 3 channels x 12 bytes = 4607 MiB of memory, over 50 % of this machine's 8192 MiB \
             (Limits::memory_percent; --limit memory_percent=N)"
        );
        assert!(
            Limits {
                memory_percent: 60,
                ..Default::default()
            }
            .check_memory_of(8 * gib, square)
            .is_ok()
        );
        assert!(
            Limits::default()
                .check_memory_of(8 * gib, [u64::MAX, 2, 2])
                .is_err()
        );
    }

    #[test]
    fn more_than_there_is_is_not_attempted() {
        assert!(affordable(1 << 20).is_ok());
        assert!(
            affordable(u64::MAX)
                .unwrap_err()
                .contains("more than the system provides")
        );
    }

    #[test]
    fn bounds_are_checked_without_a_look_at_the_memory() {
        let wide = Limits {
            side: MAX_LIMIT,
            pixels: MAX_LIMIT,
            decoded_bytes: 1 << 54,
            ..Default::default()
        };
        let demand = Demand {
            file_bytes: 1 << 50,
            ..demand(1 << 25, 1 << 25)
        };
        assert_eq!(wide.check_bounds(demand), Ok(1 << 54));
        let e = wide.check(demand).unwrap_err();
        assert!(e.contains("more than the system provides"), "{e}");
    }

    #[test]
    fn an_empty_picture_is_refused() {
        assert!(Limits::default().check(demand(0, 4)).is_err());
    }
}
