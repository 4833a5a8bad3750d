//! Label files: read or created for a photo, and saved with their cameras.

use super::photos::{beside, file_name};
use crate::folder::Folder;
use crate::refusal::{Answer, Refusal};
use axum::http::StatusCode;
use petcomp::camera::{self, CameraFile, Label, LabelledPhoto, Solution, SolveError, SolveOptions};
use petcomp::{Error, io};
use serde::Serialize;
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};

/// The label of a photo, from its file or newly created.
#[derive(Serialize)]
pub(super) struct LabelFile {
    name: String,
    label: Label,
    /// Version of the file; none if there is no file yet.
    version: Option<String>,
    /// Why nothing was copied from the other photo's label.
    remark: Option<String>,
}

/// Path of a photo's label.
pub(super) fn path(folder: &Folder, photo: &str) -> Answer<PathBuf> {
    folder.file(photo)?;
    folder.place(&beside(photo, "label.json"))
}

/// The label of a photo, or a new one with everything that it shares with the label of another
/// photo (`like`). If that one cannot be read, the new label is created without it, with a remark.
pub(super) fn read(folder: &Folder, photo: &str, like: Option<&str>) -> Answer<LabelFile> {
    let name = beside(photo, "label.json");
    if let Some(file) = folder.text_if_any(&name)? {
        return Ok(LabelFile {
            label: io::read_json(path(folder, photo)?)?,
            version: Some(file.version),
            remark: None,
            name,
        });
    }
    let (like, remark) = match like.map(|photo| label_of(folder, photo)).transpose() {
        Ok(like) => (like, None),
        Err(refusal) => (None, Some(refusal.what)),
    };
    let label = camera::init_label(&folder.file(photo)?, &path(folder, photo)?, like.as_ref())?;
    Ok(LabelFile {
        name,
        label,
        version: None,
        remark,
    })
}

fn label_of(folder: &Folder, photo: &str) -> Answer<Label> {
    Ok(io::read_json(folder.file(&beside(photo, "label.json"))?)?)
}

/// Result of saving a label.
#[derive(Serialize)]
pub(super) struct SavedLabel {
    name: String,
    version: String,
    /// The camera file, if the label has a camera.
    camera: Option<String>,
    /// Why it has none.
    why: Option<String>,
}

/// Saves a label, with the remarks of the existing file, and then the camera that is solved from
/// it. A label without a camera is saved, too; a camera of another label is then removed.
pub(super) fn save(
    folder: &Folder,
    photo: &str,
    label: Label,
    version: Option<&str>,
) -> Answer<SavedLabel> {
    let name = beside(photo, "label.json");
    check_photo(&label, photo)?;
    let text = text_of(folder, &name, &label)?;
    let version = folder.save(&name, &text, version)?;
    let outcome = write_camera(folder, photo);
    Ok(SavedLabel {
        name,
        version,
        why: outcome.as_ref().err().map(|refusal| refusal.what.clone()),
        camera: outcome.ok(),
    })
}

/// Checks that a label names the photo next to it.
fn check_photo(label: &Label, photo: &str) -> Answer<()> {
    let (named, file) = (&label.image.file, file_name(photo));
    if named == file {
        return Ok(());
    }
    let place = beside(photo, "label.json");
    let what = format!("{place}: image.file: {named}, expected {file}");
    Err(Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, what))
}

/// The text of a label in the format of `petcomp camera init`, with the remarks of the existing
/// file.
fn text_of(folder: &Folder, name: &str, label: &Label) -> Answer<String> {
    let text = camera::commented(label)?;
    match stored_remarks(folder, name)? {
        Some(remarks) => Ok(with_remarks(&text, remarks).map_err(|e| Error::value("label", e))?),
        None => Ok(text),
    }
}

/// The remarks in a label file, if it has any.
fn stored_remarks(folder: &Folder, name: &str) -> Answer<Option<Value>> {
    let file = folder.text_if_any(name)?;
    let label = file.and_then(|file| serde_json::from_str(&file.text).ok());
    let remarks = label.map(remarks_of);
    Ok(remarks.filter(|remarks| remarks.as_object().is_some_and(|table| !table.is_empty())))
}

fn with_remarks(text: &str, remarks: Value) -> serde_json::Result<String> {
    let mut label: Value = serde_json::from_str(text)?;
    merge(&mut label, remarks);
    let text = serde_json::to_string_pretty(&label)?;
    Ok(camera::with_folded_lists(&text) + "\n")
}

/// Remarks that a person has written: keys that begin with `_`, and the tables and lists that
/// contain them. `_todo` is petcomp's own.
fn remarks_of(value: Value) -> Value {
    match value {
        Value::Object(table) => Value::Object(table.into_iter().filter_map(remark_at).collect()),
        Value::Array(items) => Value::Array(items.into_iter().map(remarks_of).collect()),
        _ => Value::Null,
    }
}

/// A key that is a remark or contains remarks.
fn remark_at((key, value): (String, Value)) -> Option<(String, Value)> {
    if key.starts_with('_') && key != "_todo" {
        return Some((key, value));
    }
    let remarks = remarks_of(value);
    (!is_without_remarks(&remarks)).then_some((key, remarks))
}

fn is_without_remarks(remarks: &Value) -> bool {
    match remarks {
        Value::Object(table) => table.is_empty(),
        Value::Array(items) => items.iter().all(is_without_remarks),
        _ => true,
    }
}

/// Merges remarks back to their positions; not into a list of another length, whose items differ.
fn merge(label: &mut Value, remarks: Value) {
    match (label, remarks) {
        (Value::Object(label), Value::Object(remarks)) => merge_tables(label, remarks),
        (Value::Array(label), Value::Array(remarks)) if label.len() == remarks.len() => {
            for (item, remarks) in label.iter_mut().zip(remarks) {
                merge(item, remarks);
            }
        }
        _ => {}
    }
}

fn merge_tables(label: &mut Map<String, Value>, remarks: Map<String, Value>) {
    for (key, value) in remarks {
        match label.get_mut(&key) {
            Some(part) => merge(part, value),
            None if key.starts_with('_') => drop(label.insert(key, value)),
            None => {}
        }
    }
}

/// Solves the label of a photo and writes the camera next to it, as `petcomp camera solve` does. If
/// none fits, a camera of another label is removed.
fn write_camera(folder: &Folder, photo: &str) -> Answer<String> {
    let name = beside(photo, "camera.json");
    let place = folder.place(&name)?;
    let labelled = labelled(folder, photo).inspect_err(|_| remove_if_any(&place))?;
    match usable(camera::solve(&labelled.label, &SolveOptions::default())) {
        Ok(solution) => {
            io::write_json(place, &CameraFile::new(&labelled.label, &solution))?;
            Ok(name)
        }
        Err(error) => {
            remove_anothers(folder, photo, &labelled)?;
            Err(error.into())
        }
    }
}

/// Removes the camera next to a label unless it was solved from that label: alone, or with
/// `--force`.
pub(super) fn remove_anothers(folder: &Folder, photo: &str, label: &LabelledPhoto) -> Answer<()> {
    let name = beside(photo, "camera.json");
    let place = folder.place(&name)?;
    let stored = folder.file(&name).ok();
    let stored = stored.and_then(|path| io::read_json::<CameraFile>(path).ok());
    if stored.is_none_or(|file| !file.is_of(label)) {
        remove_if_any(&place);
    }
    Ok(())
}

fn remove_if_any(place: &Path) {
    let _ = std::fs::remove_file(place);
}

/// The label of a photo as a stage reads it.
pub(super) fn labelled(folder: &Folder, photo: &str) -> Answer<LabelledPhoto> {
    let mut labels = camera::read_labels(path(folder, photo)?, None)?;
    match labels.len() {
        1 => {
            let label = labels.remove(0);
            if !label.label.image.file.is_empty() {
                check_photo(&label.label, photo)?;
            }
            Ok(label)
        }
        n => {
            let what = format!("{}: {n} labels, expected one", beside(photo, "label.json"));
            Err(Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, what))
        }
    }
}

/// Checks that a camera fits its label and can see objects on the surface.
pub(super) fn usable(outcome: Result<Solution, SolveError>) -> petcomp::Result<Solution> {
    let solution = outcome.and_then(Solution::fitting)?;
    camera::check_distance(&solution)?;
    camera::check_lens(&solution.camera, solution.k1())?;
    Ok(solution)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn remarks_stay_where_they_were() {
        let before = json!({ "_by": "Ada", "_todo": [], "image": { "file": "a.jpg", "_lens": 2 },
            "markers": { "_sheet": "A4" } });
        let mut after = json!({ "image": { "file": "a.jpg" }, "camera": {} });
        merge(&mut after, remarks_of(before));
        let expected =
            json!({ "_by": "Ada", "image": { "file": "a.jpg", "_lens": 2 }, "camera": {} });
        assert_eq!(after, expected);
    }

    #[test]
    fn remarks_stay_in_lists_of_the_same_length() {
        let before = json!({ "points": [{ "px": [1, 2] }, { "px": [3, 4], "_why": "a scratch" }] });
        let merged = |mut after: Value| {
            merge(&mut after, remarks_of(before.clone()));
            after
        };
        let moved = merged(json!({ "points": [{ "px": [5, 6] }, { "px": [7, 8] }] }));
        let expected =
            json!({ "points": [{ "px": [5, 6] }, { "px": [7, 8], "_why": "a scratch" }] });
        assert_eq!(moved, expected);
        let other = json!({ "points": [{ "px": [7, 8] }] });
        assert_eq!(merged(other.clone()), other);
    }
}
