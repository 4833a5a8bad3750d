//! The photo list next to a photo (`photos.toml`): its scale for the photo, and changes to it that
//! leave everything else in the list as it was.

use crate::folder::Folder;
use crate::refusal::{Answer, Refusal};
use axum::http::StatusCode;
use petcomp::Error;
use petcomp::asset::{List, Manifest, PhotoEntry, with_actual_spelling};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::Path;
use toml::{Table, Value};

const LIST_NAME: &str = "photos.toml";
/// A list in a format that is only read here, not written.
const OTHER_LIST_NAME: &str = "photos.csv";
const HEADER: &str = "[[photos]]";
/// Keys that give the scale of a photo, in one form or another.
const SCALE_KEYS: [&str; 7] = [
    "length",
    "width",
    "px_per_metre",
    "px_per_meter",
    "screen_size",
    "screen_corners",
    "marker_size",
];

/// A list's entry for a photo, with the list's version.
#[derive(Serialize)]
pub(super) struct VersionedEntry {
    /// The list, whether it exists or not.
    list: String,
    /// Version of the list; none if there is none.
    version: Option<String>,
    /// The entry of the photo.
    entry: Option<Table>,
}

/// The scale of a photo.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum PhotoScale {
    /// Pixels per metre.
    PxPerMetre(f64),
    /// Width and height of the screen, metres, and its corners, pixels.
    Screen([f64; 2], [[f64; 2]; 4]),
}

/// A photo with its scale, for its list.
pub(super) struct ScaledPhoto<'a> {
    pub(super) photo: &'a str,
    pub(super) scale: PhotoScale,
    pub(super) asset: &'a str,
    pub(super) class: &'a str,
}

/// The list next to a photo, and the photo's name in it.
fn list_of(photo: &str) -> (String, &str) {
    match photo.rsplit_once('/') {
        Some((folder, file)) => (format!("{folder}/{LIST_NAME}"), file),
        None => (LIST_NAME.into(), photo),
    }
}

/// The entry of a photo in the list next to it.
pub(super) fn read(folder: &Folder, photo: &str) -> Answer<VersionedEntry> {
    let (list, file) = list_of(photo);
    let Some(versioned) = folder.text_if_any(&list)? else {
        return Ok(VersionedEntry {
            list,
            version: None,
            entry: None,
        });
    };
    let entries = entries_of(&versioned.text, &list)?;
    let file = listed_name(folder, &entries, photo)?.unwrap_or(file.into());
    Ok(VersionedEntry {
        list,
        version: Some(versioned.version),
        entry: entries.into_iter().find(|entry| names(entry, &file)),
    })
}

/// The name of a photo in the list next to it.
fn listed_name(folder: &Folder, entries: &[Table], photo: &str) -> Answer<Option<String>> {
    let path = folder.file(photo)?;
    let mut files = entries.iter().filter_map(file_of);
    let name = files.find(|file| listed_photo(folder, &path, file) == photo);
    Ok(name.map(str::to_owned))
}

/// The studio's name of the photo that a path in the list next to a file refers to, found as in
/// `asset build`: in any capitalisation.
fn listed_photo(folder: &Folder, beside: &Path, path: &str) -> String {
    let place = beside.parent().unwrap_or(Path::new(""));
    folder.name_of_listed(&with_actual_spelling(place.join(path)))
}

/// Those of some photos that have a scale.
pub(super) fn scaled_photos(folder: &Folder, photos: &[String]) -> BTreeSet<String> {
    let lists: BTreeSet<String> = photos.iter().map(|photo| list_of(photo).0).collect();
    let mut scaled = BTreeSet::new();
    for list in lists {
        let text = folder
            .read_text(&list)
            .map_or(String::new(), |file| file.text);
        let Ok(path) = folder.file(&list) else {
            continue;
        };
        let entries = entries_of(&text, &list).unwrap_or_default();
        let files = entries
            .iter()
            .filter(|entry| has_scale(entry))
            .filter_map(file_of);
        scaled.extend(files.map(|file| listed_photo(folder, &path, file)));
    }
    scaled
}

fn has_scale(entry: &Table) -> bool {
    SCALE_KEYS.iter().any(|key| entry.contains_key(*key))
}

fn file_of(entry: &Table) -> Option<&str> {
    entry.get("file").and_then(Value::as_str)
}

fn names(entry: &Table, file: &str) -> bool {
    file_of(entry) == Some(file)
}

fn entries_of(text: &str, list: &str) -> Answer<Vec<Table>> {
    let table = table_of(text, list)?;
    let entries = table.get("photos").and_then(Value::as_array);
    let entries = entries.into_iter().flatten();
    Ok(entries.filter_map(Value::as_table).cloned().collect())
}

/// The classes that a list declares.
fn classes_of(text: &str, list: &str) -> Answer<Vec<String>> {
    let declared = table_of(text, list)?.remove("classes");
    let classes: Result<Vec<String>, toml::de::Error> =
        declared.map_or(Ok(Vec::new()), Value::try_into);
    Ok(classes.map_err(|e| Error::file(list, e.message()))?)
}

fn table_of(text: &str, list: &str) -> Answer<Table> {
    let table = toml::from_str(text);
    Ok(table.map_err(|e| Error::file(list, e.message()))?)
}

/// Saves the scale of a photo in the list next to it; a photo that is not in the list is added at
/// its end.
pub(super) fn save(folder: &Folder, new: &ScaledPhoto<'_>, version: Option<&str>) -> Answer<()> {
    let (list, file) = list_of(new.photo);
    let text = match folder.text_if_any(&list)? {
        Some(versioned) => versioned.text,
        None => no_list(folder, &list)?,
    };
    let before = entries_of(&text, &list)?;
    let file = listed_name(folder, &before, new.photo)?.unwrap_or(file.into());
    let changed = with_scale(&text, &file, new);
    let after = entries_of(&changed, &list).map_err(|_| not_in_tables(&list))?;
    let classes = classes_of(&text, &list)?;
    let entry = changed_entry(&before, &after, &file, &list)?;
    check_entry(entry, classes, &list)?;
    check_beside_others(&text, &changed, &list)?;
    folder.save(&list, &changed, version)?;
    Ok(())
}

/// The text of a list that does not exist yet; an error if there is another list that `asset build`
/// would then ignore.
fn no_list(folder: &Folder, list: &str) -> Answer<String> {
    let other = list.replace(LIST_NAME, OTHER_LIST_NAME);
    if folder.file(&other).is_ok() {
        let what = format!("{other}: already lists the photos here; write the scale there");
        return Err(Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, what));
    }
    Ok(String::new())
}

/// The only changed entry. A list in a form that cannot be edited by lines (tables in one line) is
/// not changed at all.
fn changed_entry<'a>(
    before: &[Table],
    after: &'a [Table],
    file: &str,
    list: &str,
) -> Answer<&'a Table> {
    let others = |entries: &[Table]| {
        let others = entries.iter().filter(|entry| !names(entry, file));
        others.cloned().collect::<Vec<_>>()
    };
    if before.iter().filter(|entry| names(entry, file)).count() > 1 {
        let what = format!("{list}: photos: {file} is listed more than once, expected once");
        return Err(Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, what));
    }
    let mine: Vec<&Table> = after.iter().filter(|entry| names(entry, file)).collect();
    match mine[..] {
        [mine] if others(before) == others(after) && has_scale(mine) => Ok(mine),
        _ => Err(not_in_tables(list)),
    }
}

/// The error for a list whose photos are not tables of their own.
fn not_in_tables(list: &str) -> Refusal {
    let what = format!("{list}: its photos are not written as {HEADER}; copy the line into it");
    Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, what)
}

/// Fails on an entry for which `asset build` would reject the whole list. The list declares
/// `classes`, or none and then accepts any.
fn check_entry(entry: &Table, mut classes: Vec<String>, list: &str) -> Answer<()> {
    let read: Result<PhotoEntry, toml::de::Error> = entry.clone().try_into();
    let entry = read.map_err(|e| Error::file(list, e.message()))?;
    if classes.is_empty() {
        classes.push(entry.class.clone());
    }
    let known = Manifest {
        classes,
        ..Manifest::default()
    };
    Ok(entry.check(&known).map_err(|e| e.in_file(list))?)
}

/// Fails if `asset build` would reject a list that it accepted before. An incomplete list is
/// completed photo by photo.
fn check_beside_others(before: &str, after: &str, list: &str) -> Answer<()> {
    match check_list(before, list) {
        Ok(()) => Ok(check_list(after, list)?),
        Err(_) => Ok(()),
    }
}

fn check_list(text: &str, list: &str) -> petcomp::Result<()> {
    let read: List = toml::from_str(text).map_err(|e| Error::file(list, e.message()))?;
    let checked = read.check(&mut Manifest::default());
    checked.map_err(|e| e.in_file(list))
}

/// The text of a list with the scale of a photo; comments and everything else are unchanged.
fn with_scale(text: &str, file: &str, new: &ScaledPhoto<'_>) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    match block_of(&lines, file) {
        Some(block) => {
            let changed = changed_block(&lines[block.clone()], new.scale);
            lines.splice(block, changed);
        }
        None => lines.extend(new_block(file, new, lines.is_empty())),
    }
    let end = if text.contains("\r\n") { "\r\n" } else { "\n" };
    lines.join(end) + end
}

/// The lines of a photo's table with another scale, placed before the empty lines and the comments
/// at its end: those may belong to the next photo.
fn changed_block(block: &[String], scale: PhotoScale) -> Vec<String> {
    let mut lines = without_scale(block);
    let says = |line: &String| !matches!(line.trim().chars().next(), None | Some('#'));
    let last = lines.iter().rposition(says);
    let end = last.map_or(0, |last| last + 1);
    lines.splice(end..end, scale_lines(scale));
    lines
}

/// The lines of a photo's table without those of its scale.
fn without_scale(block: &[String]) -> Vec<String> {
    let (mut kept, mut rest) = (Vec::new(), block);
    while !rest.is_empty() {
        let (value, behind) = rest.split_at(lines_of_first(rest));
        if !is_scale(&value[0]) {
            kept.extend_from_slice(value);
        }
        rest = behind;
    }
    kept
}

/// Number of lines of a table's first value: an array may span several.
fn lines_of_first(lines: &[String]) -> usize {
    let mut counts = 1..=lines.len();
    counts.find(|&n| is_whole(&lines[..n])).unwrap_or(1)
}

/// Whether no value continues after the lines.
fn is_whole(lines: &[String]) -> bool {
    table_of(&lines.join("\n"), "").is_ok()
}

/// The lines of a photo's table, including its header.
fn block_of(lines: &[String], file: &str) -> Option<std::ops::Range<usize>> {
    let starts = (0..lines.len()).filter(|&i| is_header(&lines[i]));
    let mut blocks = starts.filter_map(|start| table_from(lines, start));
    blocks.find(|block| {
        let text = lines[block.clone()].join("\n");
        entries_of(&text, "").is_ok_and(|entries| entries.iter().any(|entry| names(entry, file)))
    })
}

/// The lines of the table whose header is at `start`. A line that begins with a bracket ends it,
/// unless it is part of an array that spans several lines.
fn table_from(lines: &[String], start: usize) -> Option<std::ops::Range<usize>> {
    let is_end = |i: usize| {
        lines
            .get(i)
            .is_none_or(|line| line.trim_start().starts_with('['))
    };
    let ends = (start + 1..=lines.len()).filter(|&i| is_end(i));
    let mut blocks = ends.map(|end| start..end);
    blocks.find(|block| is_whole(&lines[block.clone()]))
}

/// Whether a line begins a photo's table: there may be spaces and a comment.
fn is_header(line: &str) -> bool {
    let header = line.split('#').next().unwrap_or_default();
    header.replace(' ', "").trim() == HEADER
}

fn is_scale(line: &str) -> bool {
    let key = line.split('=').next().unwrap_or_default().trim();
    let key = key.trim_matches(['"', '\'']);
    line.contains('=') && SCALE_KEYS.contains(&key)
}

fn scale_lines(scale: PhotoScale) -> Vec<String> {
    match scale {
        PhotoScale::PxPerMetre(scale) => vec![format!("px_per_metre = {scale:.1}")],
        PhotoScale::Screen([width, height], corners) => {
            let corners = corners.map(|[x, y]| format!("[{x:.1}, {y:.1}]")).join(", ");
            vec![
                format!("screen_size = [{width}, {height}]"),
                format!("screen_corners = [{corners}]"),
            ]
        }
    }
}

fn new_block(file: &str, new: &ScaledPhoto<'_>, is_first: bool) -> Vec<String> {
    let mut lines: Vec<String> = (!is_first).then(String::new).into_iter().collect();
    lines.push(HEADER.into());
    lines.push(format!("file = {}", quoted(file)));
    lines.push(format!("asset = {}", quoted(&asset_name(new.asset, file))));
    if !new.class.is_empty() {
        lines.push(format!("class = {}", quoted(new.class)));
    }
    lines.extend(scale_lines(new.scale));
    lines
}

/// The given name, or else the file's, restricted to the characters of asset names.
fn asset_name(given: &str, file: &str) -> String {
    let stem = Path::new(file).file_stem().unwrap_or_default();
    let stem = stem.to_string_lossy();
    let name = if given.is_empty() { &*stem } else { given };
    name.replace(|c: char| !c.is_alphanumeric() && !"_-.".contains(c), "_")
}

fn quoted(text: &str) -> String {
    Value::from(text).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIST: &str = "# my photos\nclasses = [\"cup\"]\n\n[[photos]]\nfile = \"a.jpg\" # first\nlength = 0.2\nasset = \"a\"\n\n[[photos]]\nfile = \"b.jpg\"\nlength = 0.3\n";

    fn cup(photo: &str, px_per_metre: f64) -> ScaledPhoto<'_> {
        ScaledPhoto {
            photo,
            scale: PhotoScale::PxPerMetre(px_per_metre),
            asset: "my cup",
            class: "cup \"1\"",
        }
    }

    fn scaled(file: &str) -> String {
        with_scale(LIST, file, &cup(file, 1966.72))
    }

    #[test]
    fn a_photo_gets_another_scale_and_all_else_stays() {
        let expected = LIST.replace(
            "length = 0.2\nasset = \"a\"\n",
            "asset = \"a\"\npx_per_metre = 1966.7\n",
        );
        assert_eq!(scaled("a.jpg"), expected);
    }

    #[test]
    fn remarks_of_the_next_photo_and_ends_of_lines_stay() {
        let entry = |scale: &str| {
            let rest = "\r\n# the lid\r\n[[photos]]\r\nfile = \"b.jpg\"\r\n";
            format!("[[photos]]\r\nfile = \"a.jpg\"\r\n{scale}\r\n{rest}")
        };
        let before = entry("length = 0.2");
        let after = with_scale(&before, "a.jpg", &cup("a.jpg", 1966.72));
        assert_eq!(after, entry("px_per_metre = 1966.7"));
    }

    #[test]
    fn a_new_photo_comes_last() {
        let text = scaled("c.jpg");
        assert!(text.starts_with(LIST), "{text}");
        let last = entries_of(&text, "").unwrap().pop().unwrap();
        assert_eq!(last["asset"].as_str(), Some("my_cup"));
        assert_eq!(last["class"].as_str(), Some("cup \"1\""));
        assert_eq!(last["px_per_metre"].as_float(), Some(1966.7));
    }

    /// The list of a folder after the scale of a photo was saved, or the error.
    fn saved(list: &str, text: &str, new: &ScaledPhoto<'_>) -> Result<String, String> {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join(new.photo), "").unwrap();
        std::fs::write(dir.path().join(list), text).unwrap();
        let folder = Folder::open(dir.path()).unwrap();
        let there = folder.text_if_any(LIST_NAME).unwrap();
        let version = there.map(|there| there.version);
        save(&folder, new, version.as_deref()).map_err(|refusal| refusal.what)?;
        let photos = [new.photo.to_owned()];
        assert!(scaled_photos(&folder, &photos).contains(new.photo));
        Ok(folder.read_text(LIST_NAME).unwrap().text)
    }

    #[test]
    fn what_is_saved_is_what_a_build_takes() {
        let entry = |scale: &str| {
            format!("[[photos]]\nfile = \"a.png\"\nasset = \"a\"\nclass = \"c\"\n{scale}")
        };
        let now = entry("px_per_metre = 2000.0\n");
        for photo in ["a.png", "a.PNG"] {
            let before = entry("px_per_meter = 9.0\n");
            assert_eq!(saved(LIST_NAME, &before, &cup(photo, 2e3)), Ok(now.clone()));
        }
        let refused = |list, scale: &str, px_per_metre| {
            saved(list, &entry(scale), &cup("a.png", px_per_metre)).unwrap_err()
        };
        let captured = "captured = { photos = [\"b.png\"] }\n";
        assert!(refused(LIST_NAME, captured, 2e3).contains("one of several scales"));
        assert!(refused(LIST_NAME, "", 0.004).contains("photos.toml: px_per_metre: 0, expected"));
        assert!(refused(OTHER_LIST_NAME, "", 2e3).contains("photos.csv: already lists the photos"));
        let declared = "classes = [\"cup\", \"lid\"]\n";
        let class = saved(LIST_NAME, declared, &cup("a.png", 2e3)).unwrap_err();
        let expected = "photos.toml: class: \"cup \"1\"\", expected one of cup, lid";
        assert_eq!(class, expected);
    }

    #[test]
    fn a_scale_is_replaced_however_it_is_written() {
        let list = |scale: &str| {
            format!("[[ photos ]] # first\nfile = \"a.png\"\n{scale}asset = \"a\"\nclass = \"c\"\n")
        };
        let corners = "screen_size = [0.3, 0.2]\nscreen_corners = [\n  [1, 2],\n  [3, 4],\n  \
            [5, 6],\n  [7, 8],\n]\n";
        let expected = format!("{}px_per_metre = 2000.0\n", list(""));
        for scale in ["\"length\" = 0.2\n", corners] {
            let after = saved(LIST_NAME, &list(scale), &cup("a.png", 2e3));
            assert_eq!(after.as_ref(), Ok(&expected), "{scale}");
        }
    }

    #[test]
    fn what_cannot_be_changed_is_refused_for_what_it_is() {
        let refused = |text: &str| saved(LIST_NAME, text, &cup("a.png", 2e3)).unwrap_err();
        let entry = "[[photos]]\nfile = \"a.png\"\nasset = \"a\"\nclass = \"c\"\n";
        let twice = refused(&[entry, entry].concat());
        let expected = "photos.toml: photos: a.png is listed more than once, expected once";
        assert_eq!(twice, expected);
        for in_one_line in ["photos = []\n", "photos = [{ file = \"a.png\" }]\n"] {
            assert!(refused(in_one_line).contains("not written as [[photos]]"));
        }
    }

    #[test]
    fn a_photo_is_found_in_its_list_by_any_path() {
        let dir = tempfile::tempdir().unwrap();
        let absolute = dir.path().join("a.png");
        std::fs::write(&absolute, "").unwrap();
        let folder = Folder::open(dir.path()).unwrap();
        for file in ["./a.png", "b/../a.png", absolute.to_str().unwrap()] {
            let entry = |scale: &str| {
                format!("[[photos]]\nfile = '{file}'\nasset = \"a\"\nclass = \"c\"\n{scale}\n")
            };
            std::fs::write(dir.path().join(LIST_NAME), entry("length = 0.2")).unwrap();
            let version = read(&folder, "a.png").unwrap().version;
            save(&folder, &cup("a.png", 2e3), version.as_deref()).unwrap();
            let after = folder.read_text(LIST_NAME).unwrap().text;
            assert_eq!(after, entry("px_per_metre = 2000.0"));
            let scaled = scaled_photos(&folder, &["a.png".to_owned()]);
            assert_eq!(scaled.into_iter().collect::<Vec<_>>(), ["a.png"]);
        }
    }

    #[test]
    fn a_list_that_a_build_takes_stays_one() {
        let entry = |file: &str, scale: &str| {
            format!("[[photos]]\nfile = \"{file}\"\nasset = \"a\"\nclass = \"c\"\n{scale}")
        };
        let lid = ScaledPhoto {
            asset: "a",
            class: "lid",
            ..cup("b.png", 2e3)
        };
        let refused = saved(LIST_NAME, &entry("a.png", "length = 0.2\n"), &lid);
        let expected =
            "photos.toml: photos[1].class: \"lid\", but another photo of the asset has \"c\"";
        assert_eq!(refused, Err(expected.to_owned()));
        let incomplete = [entry("a.png", ""), entry("b.png", "")].concat();
        assert!(saved(LIST_NAME, &incomplete, &lid).is_ok());
    }
}
