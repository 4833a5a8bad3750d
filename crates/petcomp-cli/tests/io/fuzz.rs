//! The doors of `fuzz/` without a fuzzer: seeds with bytes changed, cut, doubled and swapped, on
//! the stable compiler.

use crate::promptness::quickly;
use crate::sweep::Random;
use crate::valid;
use petcomp::fuzzing;
use std::time::{Duration, Instant};

const LABEL: &str = r#"{"format": "plane-label", "version": 1, "image": {"file": "a.jpg", "width": 640, "height": 480},
    "surface": {"id": "tray", "width_m": 0.6, "height_m": 0.4, "corners_px": [[100, 100], [500, 110], [510, 400], [90, 390]]},
    "camera": {"focal_px": 800.0}, "points": [], "_remark": null}"#;
const RECIPE: &str = "assets = \"a\"\n[scene]\nobjects = [4, 12]\nscale = [0.9, 1.1]\n[split]\nval_percent = 20\n[labels.yolo]\n";
const JOURNAL: &str = r#"{"k":0,"part":"train","classes":[[3,2]],"knotted":0,"retries":0,"files":[{"path":"images/train/000000.jpg","bytes":1,"crc32":2}]}
"#;
const DATA_YAML: &str = "# a\npath: set\ntrain: images/train\nval: images/val\nnc: 2\nnames:\n  0: \"cap\"\n  1: none\n";
const YOLO: &str = "0 0.5 0.5 0.2 0.4\n1 0.1 0.1 0.3 0.1 0.3 0.3\n===\n0 0.5 0.51 0.2 0.4 0.9\n1 0.2 0.2 0.2 0.2 0.31\n";
const COCO: &str = r#"{"images": [{"id": 3, "file_name": "a/b.png", "width": 640, "height": 480}],
    "categories": [{"id": 10, "name": "cap"}, {"id": 20, "name": "none"}],
    "annotations": [{"image_id": 3, "category_id": 20, "bbox": [1, 2, 30, 4.5], "area": 6.5, "iscrowd": 1},
    {"image_id": 3, "category_id": 10, "bbox": [100, 20, 30, 40]}]}
===
[{"image_id": 3, "category_id": 10, "bbox": [101, 20, 30, 40], "score": 0.9},
 {"image_id": 3, "category_id": 20, "bbox": [1, 2, 30, 5], "score": 1e-3}]"#;
const ANSWER: &str = "{\"picture\":{\"width\":2,\"height\":2,\"names\":[\"R\",\"G\",\"B\"],\"sample\":\"u8\",\"display_encoded\":true}}\nabcdefghijkl";

type Door = (&'static str, fn(&[u8]) -> bool, Vec<Vec<u8>>);

fn doors() -> Vec<Door> {
    let text = |text: &str| vec![text.as_bytes().to_vec()];
    let pictures = valid::all()
        .into_iter()
        .map(|(_, bytes)| bytes[..bytes.len().min(2_000)].to_vec())
        .collect();
    vec![
        ("label", fuzzing::label, text(LABEL)),
        ("recipe", fuzzing::recipe, text(RECIPE)),
        ("journal", fuzzing::journal, text(JOURNAL)),
        ("worker", fuzzing::worker, text(ANSWER)),
        ("header", fuzzing::header, pictures),
        ("data_yaml", fuzzing::data_yaml, text(DATA_YAML)),
        ("yolo_labels", fuzzing::yolo_labels, text(YOLO)),
        ("coco", fuzzing::coco, text(COCO)),
    ]
}

/// Words that mean something to one of the readers.
const WORDS: [&[u8]; 14] = [
    b"-",
    b"1e308",
    b"99999999999999999999",
    b"4294967295",
    b"-1e9",
    b"null",
    b"[",
    b"{\"a\":",
    b"\"",
    b"\n",
    b"inf",
    b"\xff\xff\xff\xff",
    b"\0",
    b"/../",
];

fn varied(random: &mut Random, seed: &[u8]) -> Vec<u8> {
    let mut bytes = random.damage(seed);
    for _ in 0..random.below(3) {
        let at = random.below(bytes.len() + 1);
        match random.below(4) {
            0 => bytes.truncate(at),
            1 => {
                bytes.splice(at..at, WORDS[random.below(WORDS.len())].iter().copied());
            }
            2 => {
                let end = (at + 1 + random.below(40)).min(bytes.len());
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
            _ => {
                let end = (at + random.below(20)).min(bytes.len());
                bytes.drain(at..end);
            }
        }
    }
    // What is no text is refused at the door; most changes shall go further.
    if std::str::from_utf8(seed).is_ok() && random.below(8) > 0 {
        bytes.iter_mut().for_each(|byte| *byte &= 0x7f);
    }
    if bytes.is_empty() { vec![0] } else { bytes }
}

/// Knocks at every door while `goes_on`, which hears how often and for how long; a panic is the
/// failure.
fn knock(goes_on: impl Fn(u64, Duration) -> bool) {
    for (name, door, seeds) in doors() {
        let (mut random, start, mut count) = (Random(3), Instant::now(), 0_u64);
        assert!(
            seeds.iter().any(|seed| door(seed)),
            "{name}: no seed is read"
        );
        let mut slowest = Duration::ZERO;
        while goes_on(count, start.elapsed()) {
            let bytes = varied(&mut random, &seeds[count as usize % seeds.len()]);
            slowest = slowest.max(quickly(name, || door(&bytes)).1);
            count += 1;
        }
        println!(
            "{name}: {count} inputs in {:?}, slowest {slowest:?}",
            start.elapsed()
        );
    }
}

/// So many, and not for so long: a failure must not depend on how quick the machine is.
#[test]
fn no_door_panics_for_a_moment() {
    knock(|count, _| count < 100_000);
}

/// `make fuzz` where there is no cargo-fuzz.
#[test]
#[ignore = "takes five minutes"]
fn no_door_panics_for_a_minute() {
    knock(|_, time| time < Duration::from_secs(60));
}
