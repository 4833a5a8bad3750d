//! Labels in MOTChallenge format: a folder for each sequence of pictures.

use crate::dataset::paths::{create_part_folders, remove_files};
use crate::dataset::{Entry, Extent, LabelledObject, Part, PictureFormat, Writer, Written};
use crate::error::{Error, Result};
use crate::io;
use crate::scene::Belt;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Writes `mot/{train,val}/SSSSSS/`, a folder for each sequence of a belt: `gt/gt.txt`,
/// `seqinfo.ini`, and the pictures as `img1/NNNNNN.png` (links to those in `images/`, which take no
/// space, if the disk supports links); joined from `mot_frames/{train,val}/NNNNNN.json`.
///
/// A line of `gt.txt` is an object in a picture: picture, object, left, top, width, height, 1 (0
/// for objects to be ignored), class, visible share. Pictures, objects, pixels and classes are
/// counted from 1; an object keeps its number throughout the sequence.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Mot {
    /// Whether boxes are those of the whole object or of its visible part. Default: `amodal`.
    pub boxes: Extent,
    /// Format of the pictures that it refers to; in a recipe, that of `pictures`.
    #[serde(skip)]
    pub pictures: PictureFormat,
}

/// Its folder.
const KIND: &str = "mot";

/// Folder of the shares that are joined; not among the sequences, since readers treat every name
/// there as one.
const SHARES_FOLDER: &str = "mot_frames";

/// The files in a sequence's folder by which readers recognise it: its tracks and its description.
const TRACKS: &str = "gt/gt.txt";
const INFO: &str = "seqinfo.ini";

/// One picture's share of its sequence.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct FrameShare {
    belt: Belt,
    image: [u32; 2],
    /// Lines of `gt.txt`.
    lines: Vec<String>,
}

/// A picture of a sequence, and its image.
struct SequenceFrame {
    share: FrameShare,
    image: PathBuf,
}

impl Writer for Mot {
    fn settings(&self) -> serde_json::Value {
        serde_json::json!({ "mot": self })
    }

    fn extent(&self) -> Option<Extent> {
        Some(self.boxes)
    }

    fn begin(&self, folder: &Path, _classes: &[String]) -> Result<()> {
        create_part_folders(folder, SHARES_FOLDER)?;
        create_part_folders(folder, KIND)
    }

    fn write(&self, folder: &Path, entry: &Entry<'_>) -> Result<Vec<PathBuf>> {
        let belt = entry.belt().ok_or_else(no_sequence)?;
        let path = entry.path(SHARES_FOLDER, "json");
        let labels = entry.labelled.iter();
        let lines = labels.filter_map(|label| self.line(belt.frame + 1, label));
        let share = FrameShare {
            belt,
            image: entry.sample.labels.image,
            lines: lines.collect(),
        };
        io::write_json(folder.join(&path), &share)?;
        Ok(vec![path])
    }

    fn reopen(&self, folder: &Path) -> Result<()> {
        let folders = Part::ALL.map(|part| folder.join(KIND).join(part.name()));
        folders.iter().try_for_each(|part| remove_tracks(part))
    }

    fn finish(&self, folder: &Path, _classes: &[String], samples: &[Written]) -> Result<()> {
        Part::ALL.into_iter().try_for_each(|part| {
            let own = samples.iter().filter(|sample| sample.part == part);
            let sequences = sequences(folder, own)?;
            sequences.iter().try_for_each(|(number, frames)| {
                self.write_sequence(&folder.join(place_of(part, *number)), *number, frames)
            })
        })
    }

    /// Pictures are compared in `images/`.
    fn changed(&self, folder: &Path, _classes: &[String], samples: &[Written]) -> Vec<PathBuf> {
        let mut changed = Vec::new();
        for part in Part::ALL {
            let own = samples.iter().filter(|sample| sample.part == part);
            let Ok(sequences) = sequences(folder, own) else {
                changed.push(Path::new(KIND).join(part.name()));
                continue;
            };
            for (number, frames) in sequences {
                let place = place_of(part, number);
                let texts = [
                    (TRACKS, tracks(&frames)),
                    (INFO, self.info(number, &frames)),
                ];
                let other = texts
                    .into_iter()
                    .map(|(name, text)| (place.join(name), text))
                    .filter(|(path, text)| {
                        io::read_text(folder.join(path)).ok().as_ref() != Some(text)
                    });
                changed.extend(other.map(|(path, _)| path));
            }
        }
        changed
    }
}

pub(super) fn no_sequence() -> Error {
    let what = "\"mot\", but the recipe has no belt: tracks need sequences (scene.belt)";
    Error::value("labels.formats", what)
}

/// The pictures of each sequence, in order.
fn sequences<'a>(
    folder: &Path,
    samples: impl Iterator<Item = &'a Written>,
) -> Result<BTreeMap<u64, Vec<SequenceFrame>>> {
    let mut sequences: BTreeMap<u64, Vec<SequenceFrame>> = BTreeMap::new();
    for sample in samples {
        let file = |kind| sample.file(kind).map_err(|e| Error::file(folder, e));
        let share: FrameShare = io::read_json(io::inside(folder, file(SHARES_FOLDER)?)?)?;
        let image = io::inside(folder, file("images")?)?;
        let frames = sequences.entry(share.belt.sequence).or_default();
        frames.push(SequenceFrame { share, image });
    }
    Ok(sequences)
}

impl Mot {
    /// None for an object without a box.
    fn line(&self, frame: u64, label: &LabelledObject<'_>) -> Option<String> {
        let (b, _) = self.boxes.of(label.object);
        let [left, top] = [b.x0, b.y0].map(|edge| edge + 1.0);
        let (id, counts) = (label.object.id.0, u8::from(!label.ignored));
        let (class, visible) = (label.class + 1, label.object.visible_fraction);
        let (width, height) = (b.width(), b.height());
        (!b.is_empty()).then(|| {
            format!("{frame},{id},{left},{top},{width},{height},{counts},{class},{visible:.4}")
        })
    }

    fn write_sequence(&self, place: &Path, number: u64, frames: &[SequenceFrame]) -> Result<()> {
        let pictures = place.join("img1");
        io::create_folder(place.join("gt"))?;
        io::create_folder(&pictures)?;
        for SequenceFrame { share, image } in frames {
            let shown = format!("{:06}.{}", share.belt.frame + 1, self.pictures.extension());
            link(image, &pictures.join(shown))?;
        }
        io::write_text(place.join(TRACKS), &tracks(frames))?;
        io::write_text(place.join(INFO), &self.info(number, frames))
    }

    fn info(&self, number: u64, frames: &[SequenceFrame]) -> String {
        let length = frames.len();
        let last = frames.last().map(|frame| &frame.share);
        let [width, height] = last.map_or([0; 2], |share| share.image);
        let rate = last.map_or(0.0, |share| share.belt.frame_rate);
        format!(
            "[Sequence]\nname={number:06}\nimDir=img1\nframeRate={rate}\nseqLength={length}\nimWidth={width}\n\
             imHeight={height}\nimExt=.{}\n",
            self.pictures.extension()
        )
    }
}

/// The folder of a sequence.
fn place_of(part: Part, number: u64) -> PathBuf {
    let parts = Path::new(KIND).join(part.name());
    parts.join(format!("{number:06}"))
}

/// The lines of `gt.txt`.
fn tracks(frames: &[SequenceFrame]) -> String {
    let lines = frames.iter().flat_map(|frame| &frame.share.lines);
    lines.map(|line| format!("{line}\n")).collect()
}

/// Deletes the tracks of a part's sequences; their pictures stay, and so do files that others put
/// there.
fn remove_tracks(folder: &Path) -> Result<()> {
    let entries = io::entries(folder)?;
    let mut sequences = entries.iter().filter(|entry| {
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        is_folder && is_number(&entry.file_name())
    });
    sequences.try_for_each(|entry| remove_files(&entry.path(), [TRACKS, INFO]))
}

fn is_number(name: &OsStr) -> bool {
    name.as_encoded_bytes().iter().all(u8::is_ascii_digit)
}

/// A second name for a file; a copy of it if there are no links.
fn link(file: &Path, name: &Path) -> Result<()> {
    io::remove_if_exists(name)?;
    let linked = std::fs::hard_link(file, name);
    let there = linked.or_else(|_| std::fs::copy(file, name).map(drop));
    there.map_err(|e| Error::file(name, e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tracks_of_sequences_alone_are_taken_away() {
        let dir = tempfile::tempdir().unwrap();
        Mot::default().begin(dir.path(), &[]).unwrap();
        let own = ["000001/gt/gt.txt", "000001/seqinfo.ini"];
        let others = [
            "000001/det/det.txt",
            "000001/img1/000001.png",
            "mine/seqinfo.ini",
        ];
        let place = |name: &str| dir.path().join("mot/train").join(name);
        for name in own.iter().chain(&others) {
            std::fs::create_dir_all(place(name).parent().unwrap()).unwrap();
            std::fs::write(place(name), "").unwrap();
        }
        Mot::default().reopen(dir.path()).unwrap();
        assert_eq!(own.map(|name| place(name).exists()), [false; 2]);
        assert_eq!(others.map(|name| place(name).exists()), [true; 3]);
    }
}
