//! The list of photos beside a photo (`photos.toml`): what it says of the photo's scale, and how that
//! is changed with everything else in it as it was.

use crate::folder::Folder;
use crate::refusal::{Answer, Refusal};
use axum::http::StatusCode;
use petcomp::Error;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::Path;
use toml::{Table, Value};

const LIST_NAME: &str = "photos.toml";
const HEADER: &str = "[[photos]]";
/// Keys that say how large things in a photo are, one way or another.
const SCALE_KEYS: [&str; 6] = [
    "length",
    "width",
    "px_per_metre",
    "screen_size",
    "screen_corners",
    "marker_size",
];

/// A photo in its list.
#[derive(Serialize)]
pub(super) struct ListedPhoto {
    /// The list, whether it is there or not.
    list: String,
    /// The state of the list; none where there is none.
    version: Option<String>,
    /// What the list says of the photo.
    entry: Option<Table>,
}

/// How large things in a photo are.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum PhotoScale {
    /// Pixels for a metre.
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

/// The list beside a photo, and the photo's name in it.
fn list_of(photo: &str) -> (String, &str) {
    match photo.rsplit_once('/') {
        Some((folder, file)) => (format!("{folder}/{LIST_NAME}"), file),
        None => (LIST_NAME.into(), photo),
    }
}

/// What the list beside a photo says of it.
pub(super) fn read(folder: &Folder, photo: &str) -> Answer<ListedPhoto> {
    let (list, file) = list_of(photo);
    let Some(versioned) = folder.text_if_any(&list)? else {
        return Ok(ListedPhoto {
            list,
            version: None,
            entry: None,
        });
    };
    let entries = entries_of(&versioned.text, &list)?;
    Ok(ListedPhoto {
        list,
        version: Some(versioned.version),
        entry: entries.into_iter().find(|entry| names(entry, file)),
    })
}

/// The photos that have a scale, of some.
pub(super) fn scaled_photos(folder: &Folder, photos: &[String]) -> BTreeSet<String> {
    let lists: BTreeSet<String> = photos.iter().map(|photo| list_of(photo).0).collect();
    let mut scaled = BTreeSet::new();
    for list in lists {
        let text = folder
            .read_text(&list)
            .map_or(String::new(), |file| file.text);
        let below = list.strip_suffix(LIST_NAME).unwrap_or_default();
        for entry in entries_of(&text, &list).unwrap_or_default() {
            if let Some(file) = file_of(&entry).filter(|_| has_scale(&entry)) {
                scaled.insert(format!("{below}{file}"));
            }
        }
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
    let table: Table = toml::from_str(text).map_err(|e| Error::file(list, e.message()))?;
    let entries = table.get("photos").and_then(Value::as_array);
    let entries = entries.into_iter().flatten();
    Ok(entries.filter_map(Value::as_table).cloned().collect())
}

/// Saves the scale of a photo in the list beside it; one that is not in it is added at its end.
pub(super) fn save(folder: &Folder, new: &ScaledPhoto<'_>, version: Option<&str>) -> Answer<()> {
    check(new)?;
    let (list, _) = list_of(new.photo);
    let text = folder
        .text_if_any(&list)?
        .map_or(String::new(), |file| file.text);
    let changed = with_scale(&text, new);
    let (before, after) = (entries_of(&text, &list)?, entries_of(&changed, &list)?);
    check_rest(&before, &after, new, &list)?;
    folder.save(&list, &changed, version)?;
    Ok(())
}

fn check(new: &ScaledPhoto<'_>) -> Answer<()> {
    let is_length = |value: &f64| value.is_finite() && *value > 0.0;
    let fine = match &new.scale {
        PhotoScale::PxPerMetre(scale) => is_length(scale),
        PhotoScale::Screen(size, corners) => {
            size.iter().all(is_length) && corners.iter().flatten().all(|v| v.is_finite())
        }
    };
    if fine {
        return Ok(());
    }
    let what = "scale: expected positive numbers";
    Err(Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, what))
}

/// A list in a form that lines do not show (tables in one line) is not changed at all.
fn check_rest(before: &[Table], after: &[Table], new: &ScaledPhoto<'_>, list: &str) -> Answer<()> {
    let (_, file) = list_of(new.photo);
    let others = |entries: &[Table]| {
        let others = entries.iter().filter(|entry| !names(entry, file));
        others.cloned().collect::<Vec<_>>()
    };
    let mine: Vec<&Table> = after.iter().filter(|entry| names(entry, file)).collect();
    if others(before) == others(after) && mine.len() == 1 && has_scale(mine[0]) {
        return Ok(());
    }
    let what = format!("{list}: its photos are not written as {HEADER}; copy the line there");
    Err(Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, what))
}

/// The text of a list with the scale of a photo; remarks and everything else stay.
fn with_scale(text: &str, new: &ScaledPhoto<'_>) -> String {
    let (_, file) = list_of(new.photo);
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    match block_of(&lines, file) {
        Some(block) => {
            let changed = changed_block(&lines[block.clone()], new.scale);
            lines.splice(block, changed);
        }
        None => lines.extend(new_block(new, lines.is_empty())),
    }
    lines.join("\n") + "\n"
}

/// The lines of a photo's table with another scale, before the empty ones at its end.
fn changed_block(block: &[String], scale: PhotoScale) -> Vec<String> {
    let mut lines: Vec<String> = block
        .iter()
        .filter(|line| !is_scale(line))
        .cloned()
        .collect();
    let last = lines.iter().rposition(|line| !line.trim().is_empty());
    let end = last.map_or(0, |last| last + 1);
    lines.splice(end..end, scale_lines(scale));
    lines
}

/// The lines of a photo's table, its header among them.
fn block_of(lines: &[String], file: &str) -> Option<std::ops::Range<usize>> {
    let is_header = |line: &String| line.trim_start().starts_with('[');
    let starts = (0..lines.len()).filter(|&i| lines[i].trim() == HEADER);
    let blocks = starts.map(|start| {
        let rest = lines[start + 1..].iter().position(is_header);
        start..rest.map_or(lines.len(), |rest| start + 1 + rest)
    });
    blocks.into_iter().find(|block| {
        let text = lines[block.clone()].join("\n");
        entries_of(&text, "").is_ok_and(|entries| entries.iter().any(|entry| names(entry, file)))
    })
}

fn is_scale(line: &str) -> bool {
    let key = line.split('=').next().unwrap_or_default().trim();
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

fn new_block(new: &ScaledPhoto<'_>, is_first: bool) -> Vec<String> {
    let (_, file) = list_of(new.photo);
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

/// The name that was given, or else the file's.
fn asset_name(given: &str, file: &str) -> String {
    if given.is_empty() {
        let stem = Path::new(file).file_stem().unwrap_or_default();
        stem.to_string_lossy().into_owned()
    } else {
        given.into()
    }
}

fn quoted(text: &str) -> String {
    Value::from(text).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIST: &str = "# my photos\nclasses = [\"cup\"]\n\n[[photos]]\nfile = \"a.jpg\" # first\nlength = 0.2\nasset = \"a\"\n\n[[photos]]\nfile = \"b.jpg\"\nlength = 0.3\n";

    fn scaled(photo: &str) -> String {
        let new = ScaledPhoto {
            photo,
            scale: PhotoScale::PxPerMetre(1966.72),
            asset: "cup \"1\"",
            class: "cup",
        };
        with_scale(LIST, &new)
    }

    #[test]
    fn a_photo_gets_another_scale_and_all_else_stays() {
        let expected = LIST.replace(
            "length = 0.2\nasset = \"a\"\n",
            "asset = \"a\"\npx_per_metre = 1966.7\n",
        );
        assert_eq!(scaled("sub/a.jpg"), expected);
    }

    #[test]
    fn a_new_photo_comes_last() {
        let text = scaled("c.jpg");
        assert!(text.starts_with(LIST), "{text}");
        let last = entries_of(&text, "").unwrap().pop().unwrap();
        assert_eq!(last["asset"].as_str(), Some("cup \"1\""));
        assert_eq!(last["px_per_metre"].as_float(), Some(1966.7));
    }
}
