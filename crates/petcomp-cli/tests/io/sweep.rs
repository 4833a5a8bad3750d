//! Valid files with something taken away or changed: a picture as it was, or a line that says what
//! is wrong.

use crate::make::Folder;
use crate::promptness::quickly;
use crate::valid;
use petcomp::io::{self, Fallback, Limits, ReadOptions};
use petcomp::{Coverage, Depth, Image, PremulRgba};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

/// Cuts are this many bytes apart.
const STEP: usize = 37;

#[derive(PartialEq)]
enum Picture {
    Color(Image<PremulRgba>),
    Coverage(Image<Coverage>),
    Depth(Image<Depth>),
}

/// The picture in whichever kind of pixel it has.
fn read(path: &Path, options: &ReadOptions) -> Result<Picture, String> {
    let color = io::read_with(path, options).map(Picture::Color);
    let coverage = |_| io::read_with(path, options).map(Picture::Coverage);
    color
        .or_else(coverage)
        .or_else(|_| io::read_with(path, options).map(Picture::Depth))
        .map_err(|e| e.to_string())
}

#[test]
fn a_cut_file_is_refused_or_loses_nothing() {
    let folder = Folder::new();
    let (mut cuts, mut refused, mut slowest) = (0, 0, Duration::ZERO);
    let files = valid::all();
    assert_eq!(files.len(), 20);
    for (name, bytes) in files {
        let whole = read(&folder.with(name, &bytes), &ReadOptions::default()).unwrap();
        for length in (0..bytes.len()).step_by(STEP).chain([bytes.len() - 1]) {
            let path = folder.with(name, &bytes[..length]);
            let (outcome, time) = quickly(name, || read(&path, &ReadOptions::default()));
            match outcome {
                Ok(cut) => assert!(
                    cut == whole,
                    "{name}, {length} of {} bytes: another picture",
                    bytes.len()
                ),
                Err(e) => {
                    assert!(
                        !e.contains('\n') && !e.contains("gave up"),
                        "{name}, {length} bytes: {e}"
                    );
                    refused += 1;
                }
            }
            slowest = slowest.max(time);
            let _ = io::read_header(&path);
            cuts += 1;
        }
    }
    println!(
        "{cuts} cut files: {refused} refused, {} whole without their end; slowest {slowest:?}",
        cuts - refused
    );
    assert!(
        refused * 10 > cuts * 9,
        "only {refused} of {cuts} cuts were noticed"
    );
}

/// Knuth's MMIX constants.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn below(&mut self, bound: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % bound
    }

    /// One to four bytes changed, most of them to values that are awkward.
    pub(crate) fn damage(&mut self, whole: &[u8]) -> Vec<u8> {
        let mut bytes = whole.to_vec();
        for _ in 0..=self.below(4) {
            // Half of the changes hit the first bytes, where headers are.
            let reach = if self.below(2) == 0 {
                bytes.len()
            } else {
                bytes.len().min(400)
            };
            let at = self.below(reach);
            bytes[at] = [0, 255, 127, 128, self.below(256) as u8][self.below(5)];
        }
        bytes
    }
}

/// Reads so many damaged files and returns what became of them; panics where one was not met as it
/// should be.
fn damaged_files(count: usize, seed: u64) {
    let folder = Folder::new();
    let mut random = Random(seed);
    let files = valid::all();
    let quick = ReadOptions {
        limits: Limits {
            seconds: 5,
            ..Default::default()
        },
        ..Default::default()
    };
    let alone = ReadOptions {
        fallback: Fallback::Nothing,
        ..Default::default()
    };
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let mut slowest = (Duration::ZERO, String::new());
    for i in 0..count {
        let (name, whole) = &files[i % files.len()];
        let path = folder.with(name, &random.damage(whole));
        // Every seventh is shown to OpenImageIO where our decoders do not know it: its confinement
        // makes that slower.
        let options = if i % 7 == 0 { &quick } else { &alone };
        let numbered = format!("{name} ({i})");
        let (outcome, time) = quickly(&numbered, || read(&path, options));
        slowest = slowest.max((time, numbered));
        let kind = match &outcome {
            Ok(_) => "read",
            Err(e) if e.contains("died") => "worker died",
            Err(e) if e.contains("took longer than") => "worker hung",
            Err(e) if e.contains("gave up") => panic!("{name} ({i}): a decoder panicked"),
            Err(e) => {
                assert!(!e.contains('\n') && e.len() < 500, "{e:?}");
                "refused"
            }
        };
        *counts.entry(kind).or_default() += 1;
        let header = io::read_header(&path)
            .err()
            .map(|e| e.to_string())
            .unwrap_or_default();
        assert!(!header.contains("gave up"), "{name} ({i}): {header}");
    }
    println!("{count} damaged files: {counts:?}; slowest {slowest:?}");
}

#[test]
fn changed_bytes_give_a_picture_or_a_line() {
    damaged_files(5_000, 1);
}

/// `make soak`.
#[test]
#[ignore = "takes minutes"]
fn soak() {
    damaged_files(100_000, 2);
}
