//! Joint solution of the photos of one camera.

use super::label_file::{labelled, remove_anothers, usable};
use super::photos::beside;
use crate::folder::Folder;
use crate::refusal::Answer;
use petcomp::camera::{self, CameraFile, Label, LabelledPhoto, Solution, SolveError, SolveOptions};
use petcomp::{Error, io};
use serde::Serialize;
use std::collections::BTreeSet;

/// Result for one of the photos.
#[derive(Default, Serialize)]
pub(super) struct JointPhoto {
    photo: String,
    /// Number of photos that share its camera.
    together: usize,
    focal_px: Option<f64>,
    focal_sigma: Option<f64>,
    rms_px: Option<f64>,
    /// Why it has no camera, or a diagnostic about it.
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

/// Solves the labels of photos, jointly for each camera and each label once, and writes the same
/// cameras as `petcomp camera joint`. A label that cannot be read does not affect the other
/// cameras.
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
        Err(error) => return unsolved(folder, names, members, &error),
    };
    let mut solved = Vec::new();
    for ((name, member), outcome) in names.iter().zip(members).zip(joint.photos) {
        solved.push(written(folder, name, member, outcome, members)?);
    }
    for outlier in &joint.outliers {
        // The reason for a missing camera takes precedence.
        let why = &mut solved[outlier.photo].why;
        why.get_or_insert_with(|| outlier.diagnostic().to_string());
    }
    Ok(solved)
}

/// Photos that all have no camera, each with the error of its own label, if it has one.
fn unsolved(
    folder: &Folder,
    names: &[String],
    members: &[LabelledPhoto],
    error: &SolveError,
) -> Answer<Vec<JointPhoto>> {
    let photos = names.iter().zip(members).map(|(name, member)| {
        let own = camera::solve(&member.label, &SolveOptions::default()).err();
        let why = Error::from(own.unwrap_or_else(|| error.clone()));
        refused(folder, name, member, members.len(), &why)
    });
    photos.collect()
}

/// A photo whose label has no camera that fits; a camera file of another label is removed.
fn refused(
    folder: &Folder,
    name: &str,
    member: &LabelledPhoto,
    together: usize,
    error: &Error,
) -> Answer<JointPhoto> {
    remove_anothers(folder, name, member)?;
    let why = error.to_string();
    Ok(JointPhoto::without_camera(name, together, why))
}

/// Writes the camera of a photo if one fits.
fn written(
    folder: &Folder,
    name: &str,
    member: &LabelledPhoto,
    outcome: Result<Solution, SolveError>,
    all: &[LabelledPhoto],
) -> Answer<JointPhoto> {
    let solution = match usable(outcome) {
        Ok(solution) => solution,
        Err(error) => return refused(folder, name, member, all.len(), &error),
    };
    let file = CameraFile::solved_together(member, &solution, all);
    io::write_json(folder.place(&beside(name, "camera.json"))?, &file)?;
    Ok(JointPhoto {
        photo: name.into(),
        together: all.len(),
        focal_px: Some(solution.camera.focal_px.x),
        focal_sigma: Some(solution.sigma.ln_focal).filter(|sigma| sigma.is_finite()),
        rms_px: Some(solution.rms_px),
        why: None,
    })
}
