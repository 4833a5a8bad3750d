//! Photos of one camera, solved together.

use super::label_file::{labelled, usable};
use super::photos::beside;
use crate::folder::Folder;
use crate::refusal::Answer;
use petcomp::camera::{self, CameraFile, Label, LabelledPhoto, Solution, SolveError, SolveOptions};
use petcomp::{Error, io};
use serde::Serialize;
use std::collections::BTreeSet;

/// What became of one of the photos.
#[derive(Default, Serialize)]
pub(super) struct JointPhoto {
    photo: String,
    /// How many photos share its camera.
    together: usize,
    focal_px: Option<f64>,
    focal_sigma: Option<f64>,
    rms_px: Option<f64>,
    /// Why it has no camera, or what is odd about it.
    why: Option<String>,
}

impl JointPhoto {
    fn without_camera(photo: &str, together: usize, why: String) -> Self {
        Self {
            photo: photo.into(),
            together,
            why: Some(why),
            ..Self::default()
        }
    }
}

/// Solves the labels of photos, those of each camera together and each once, and writes the cameras,
/// as `petcomp camera joint` does. A label that cannot be read keeps no other from its camera.
pub(super) fn solve(folder: &Folder, photos: &[String]) -> Answer<Vec<JointPhoto>> {
    let (mut names, mut all, mut solved) = (Vec::new(), Vec::new(), Vec::new());
    for photo in photos.iter().collect::<BTreeSet<_>>() {
        match labelled(folder, photo) {
            Ok(label) => {
                names.push(photo.clone());
                all.push(label);
            }
            Err(refusal) => solved.push(JointPhoto::without_camera(photo, 1, refusal.what)),
        }
    }
    for group in camera::group_by_camera(&labels_of(&all)) {
        let (names, members) = (chosen(&names, &group), chosen(&all, &group));
        solved.extend(solve_group(folder, &names, &members)?);
    }
    solved.sort_by(|a, b| a.photo.cmp(&b.photo));
    Ok(solved)
}

fn chosen<T: Clone>(all: &[T], places: &[usize]) -> Vec<T> {
    places.iter().map(|&i| all[i].clone()).collect()
}

fn labels_of(photos: &[LabelledPhoto]) -> Vec<Label> {
    photos.iter().map(|photo| photo.label.clone()).collect()
}

fn solve_group(
    folder: &Folder,
    names: &[String],
    members: &[LabelledPhoto],
) -> Answer<Vec<JointPhoto>> {
    let labels = labels_of(members);
    let joint = match camera::solve_joint(&labels, &SolveOptions::default()) {
        Ok(joint) => joint,
        Err(error) => return Ok(unsolved(names, &Error::from(error))),
    };
    let mut solved = Vec::new();
    for ((name, member), outcome) in names.iter().zip(members).zip(joint.photos) {
        solved.push(written(folder, name, member, outcome, members)?);
    }
    for outlier in &joint.outliers {
        solved[outlier.photo].why = Some(outlier.diagnostic().to_string());
    }
    Ok(solved)
}

fn unsolved(names: &[String], error: &Error) -> Vec<JointPhoto> {
    let unsolved = |name: &String| JointPhoto::without_camera(name, names.len(), error.to_string());
    names.iter().map(unsolved).collect()
}

/// Writes the camera of a photo where it has one that fits.
fn written(
    folder: &Folder,
    name: &str,
    member: &LabelledPhoto,
    outcome: Result<Solution, SolveError>,
    all: &[LabelledPhoto],
) -> Answer<JointPhoto> {
    let outcome = usable(outcome);
    if let Ok(solution) = &outcome {
        let file = CameraFile::solved_together(member, solution, all);
        io::write_json(folder.place(&beside(name, "camera.json"))?, &file)?;
    }
    let found = outcome.as_ref().ok();
    Ok(JointPhoto {
        photo: name.into(),
        together: all.len(),
        focal_px: found.map(|solution| solution.camera.focal_px.x),
        focal_sigma: found.map(|solution| solution.sigma.ln_focal),
        rms_px: found.map(|solution| solution.rms_px),
        why: outcome.as_ref().err().map(ToString::to_string),
    })
}
