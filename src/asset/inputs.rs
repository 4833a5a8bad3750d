//! Whether a cut-out would be made from the same inputs as before.

use super::entry::PhotoEntry;
use super::review::Review;
use super::role::Role;
use crate::error::Result;
use crate::io::Checksum;
use crate::matte::CutOutOptions;
use std::path::PathBuf;

/// CRC-32 of all that decides a cut-out: the program's version, the options, what its entry says,
/// and the bytes of the files that it names, a review too.
///
/// # Errors
/// [`Error::File`](crate::Error::File) for a file that cannot be read.
pub(super) fn inputs_crc32(entry: &PhotoEntry, options: &CutOutOptions) -> Result<u32> {
    let version = env!("CARGO_PKG_VERSION");
    let said = serde_json::json!([version, options, without_names(entry)]).to_string();
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(said.as_bytes());
    for file in files_of(entry) {
        let Checksum { bytes, crc32 } = Checksum::from_file(file)?;
        hasher.update(&bytes.to_le_bytes());
        hasher.update(&crc32.to_le_bytes());
    }
    Ok(hasher.finalize())
}

/// What an entry says of how its object is cut out, its thickness too, by which a scale in the plane
/// of the screen becomes that of the object; not what else the object is, nor where files lie.
fn without_names(entry: &PhotoEntry) -> PhotoEntry {
    let mut said = PhotoEntry {
        file: PathBuf::new(),
        asset: String::new(),
        role: Role::default(),
        class: String::new(),
        mass: None,
        ..entry.clone()
    };
    said.screen.locate(|_| PathBuf::new());
    let captured = said.captured.take();
    said.captured = captured.map(|captured| captured.located(|_| PathBuf::new()));
    said
}

fn files_of(entry: &PhotoEntry) -> Vec<PathBuf> {
    let captured = entry.captured.as_ref();
    let display = captured.map(|captured| captured.display_file(&entry.file));
    let review = Review::path_of(&entry.file);
    let review = review.exists().then_some(review);
    let pictures = entry.pictures().map(PathBuf::from);
    pictures.chain(display).chain(review).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Scale;
    use super::*;

    #[test]
    fn what_changes_a_cut_out_changes_the_checksum_and_no_name_does() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("a.png"), "one").unwrap();
        std::fs::write(path("b.png"), "one").unwrap();
        std::fs::write(path("c.png"), "two").unwrap();
        let entry =
            |file, asset, length| PhotoEntry::new(path(file), asset, "cup", Scale::Length(length));
        let of =
            |entry: &PhotoEntry, options: &CutOutOptions| inputs_crc32(entry, options).unwrap();
        let plain = CutOutOptions::default();
        let first = of(&entry("a.png", "a", 0.2), &plain);
        assert_eq!(of(&entry("b.png", "b", 0.2), &plain), first);
        let smaller = CutOutOptions {
            longest_side: 64,
            ..plain.clone()
        };
        let others = [
            of(&entry("c.png", "a", 0.2), &plain),
            of(&entry("a.png", "a", 0.3), &plain),
            of(&entry("a.png", "a", 0.2), &smaller),
        ];
        assert!(others.iter().all(|other| *other != first));
        let mut thick = entry("a.png", "a", 0.2);
        thick.thickness = Some(0.06);
        assert_ne!(of(&thick, &plain), first);
        std::fs::write(path("a.review.json"), "{}").unwrap();
        assert_ne!(of(&entry("a.png", "a", 0.2), &plain), first);
    }
}
