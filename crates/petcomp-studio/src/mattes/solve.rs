//! Cutting out: the open photos, and their most recent cut-outs.

use super::entry::EntryName;
use crate::folder::Folder;
use crate::message::Json;
use crate::picture::tag_of;
use crate::refusal::{Answer, Refusal};
use crate::studio::{Studio, next_number};
use crate::turn::{Tab, Turn, Turns};
use axum::extract::State;
use axum::http::StatusCode;
use petcomp::asset::{OpenPhoto, PhotoEntry, Review, ScreenSource};
use petcomp::matte::{CutOut, CutOutOptions, Stroke};
use petcomp::{Diagnostic, Error, Film, Image, LinearRgb, Roi};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// Number of photos kept in memory: the current one, and its neighbour.
const OPEN_PHOTOS: usize = 2;
/// Number of cut-outs kept until their layers are requested: enough for a few tabs.
const SOLVED: usize = 6;

/// What the page keeps between requests.
#[derive(Default)]
pub(crate) struct Mattes {
    turns: Turns,
    open: Recent<PhotoKey, OpenPhoto>,
    /// Held while a photo is read: one at a time.
    reading: Mutex<()>,
    solved: Recent<u64, Solved>,
}

/// The most recent results, by their inputs.
struct Recent<K, V>(Mutex<VecDeque<(K, Arc<V>)>>);

impl<K, V> Default for Recent<K, V> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<K: PartialEq, V> Recent<K, V> {
    fn get(&self, key: &K) -> Option<Arc<V>> {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = kept.iter().find(|(known, _)| known == key);
        found.map(|(_, value)| value.clone())
    }

    fn keep(&self, key: K, value: Arc<V>, most: usize) {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.retain(|(known, _)| *known != key);
        kept.truncate(most - 1);
        kept.push_front((key, value));
    }
}

/// What an open photo was read from: it is read again if any of this changes.
#[derive(PartialEq)]
struct PhotoKey {
    entry: PhotoEntry,
    options: CutOutOptions,
    /// State of the photo's file; none if that cannot be read.
    photo: Option<String>,
    /// The same for the photo of the empty screen, if the entry has one.
    screen: Option<String>,
}

impl PhotoKey {
    fn new(name: &EntryName, folder: &Folder) -> Answer<Self> {
        let (entry, options) = name.find(folder)?;
        let screen = match &entry.screen {
            ScreenSource::Photo(empty) => tag_of(empty).ok(),
            _ => None,
        };
        Ok(Self {
            photo: tag_of(&entry.file).ok(),
            screen,
            entry,
            options,
        })
    }
}

/// A photo and its cut-out.
pub(super) struct Solved {
    pub(super) photo: Arc<OpenPhoto>,
    /// None if the photo gives no cut-out.
    pub(super) cut: Option<ShownCut>,
}

/// The displayed parts of a cut-out.
pub(super) struct ShownCut {
    pub(super) film: Image<Film>,
    pub(super) uncertainty: Image<f32>,
    /// The part of the photo that it covers.
    pub(super) roi: Roi,
    /// Mean colour of the screen.
    pub(super) screen: LinearRgb,
}

impl Mattes {
    /// A photo, unless the tab has asked for another one while this waited.
    fn open(&self, key: PhotoKey, turn: &Turn) -> Answer<Arc<OpenPhoto>> {
        let _alone = self.reading.lock().unwrap_or_else(PoisonError::into_inner);
        turn.check()?;
        if let Some(open) = self.open.get(&key) {
            return Ok(open);
        }
        let open = Arc::new(OpenPhoto::read(&key.entry, &key.options)?);
        self.open.keep(key, open.clone(), OPEN_PHOTOS);
        Ok(open)
    }

    /// The cut-out with a number.
    pub(super) fn solved(&self, number: u64) -> Answer<Arc<Solved>> {
        self.solved.get(&number).ok_or_else(|| {
            let what = "this cut-out has expired; reload the page";
            Refusal::new(StatusCode::NOT_FOUND, what)
        })
    }

    fn keep(&self, solved: Solved) -> u64 {
        let number = next_number();
        self.solved.keep(number, Arc::new(solved), SOLVED);
        number
    }
}

#[derive(Deserialize)]
pub(super) struct SolveRequest {
    #[serde(flatten)]
    name: EntryName,
    strokes: Vec<Stroke>,
    /// Width and height of the picture that these were painted on, pixels; none without a review.
    size: Option<[usize; 2]>,
}

impl SolveRequest {
    /// Why its strokes do not apply to a photo, in the words of `asset build`: they were painted on
    /// another size.
    fn outdated(&self, photo: &OpenPhoto) -> Option<String> {
        let size = self.size.filter(|_| !self.strokes.is_empty())?;
        let checked = Review::new(size.into(), Vec::new()).check_size(photo.picture().size());
        let error = checked.err()?;
        let file = Review::path_of(Path::new(&self.name.photo));
        Some(error.in_file(file).to_string())
    }
}

/// The description of a cut-out; its layers are requested by its number.
#[derive(Serialize)]
pub(super) struct SolvedInWords {
    number: u64,
    /// Width and height of the picture to paint strokes on, pixels.
    size: [usize; 2],
    /// Why there is no cut-out.
    refused: Option<String>,
    /// Why it is solved without the strokes.
    outdated: Option<String>,
    diagnostics: Vec<Diagnostic>,
    outline_confidence: Option<f64>,
    color_confidence: Option<f64>,
    seconds: f64,
}

pub(super) async fn solve(
    State(studio): State<Arc<Studio>>,
    tab: Tab,
    Json(request): Json<SolveRequest>,
) -> Answer<Json<SolvedInWords>> {
    let turns = studio.mattes.turns.clone();
    let work = move |turn: &Turn| {
        let key = PhotoKey::new(&request.name, &studio.folder)?;
        let photo = studio.mattes.open(key, turn)?;
        turn.check()?;
        let outdated = request.outdated(&photo);
        let strokes = match outdated {
            Some(_) => Vec::new(),
            None => request.strokes,
        };
        let solved = cut_out(&studio.mattes, photo, &strokes)?;
        Ok(Json(SolvedInWords { outdated, ..solved }))
    };
    turns.run(tab, work).await
}

fn cut_out(mattes: &Mattes, photo: Arc<OpenPhoto>, strokes: &[Stroke]) -> Answer<SolvedInWords> {
    let start = Instant::now();
    let outcome = photo.cut_out(strokes);
    let seconds = start.elapsed().as_secs_f64();
    let words = SolvedInWords::new(&outcome, photo.picture().size(), seconds);
    let cut = match outcome {
        Ok(cut) => Some(ShownCut::from(cut)),
        // A photo in which nothing was found can be painted on, too.
        Err(Error::Photo { .. }) => None,
        Err(other) => return Err(other.into()),
    };
    let number = mattes.keep(Solved { photo, cut });
    Ok(SolvedInWords { number, ..words })
}

impl SolvedInWords {
    /// Without its number.
    fn new(outcome: &petcomp::Result<CutOut>, size: (usize, usize), seconds: f64) -> Self {
        let cut = outcome.as_ref().ok();
        Self {
            number: 0,
            size: size.into(),
            refused: outcome.as_ref().err().map(ToString::to_string),
            outdated: None,
            diagnostics: cut.map(|cut| cut.diagnostics.clone()).unwrap_or_default(),
            outline_confidence: cut.map(|cut| cut.segmentation.confidence.value()),
            color_confidence: cut
                .and_then(|cut| cut.color_uncertainty)
                .map(|uncertainty| uncertainty.confidence()),
            seconds,
        }
    }
}

impl From<CutOut> for ShownCut {
    fn from(cut: CutOut) -> Self {
        Self {
            film: cut.film,
            uncertainty: cut.uncertainty,
            roi: cut.roi,
            screen: cut.screen,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_photo_is_read_again_beside_another_empty_screen() {
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
        write(
            "photos.csv",
            "file,asset,class,length,screen\na.png,a,c,0.2,empty.png\n",
        );
        write("a.png", "photo");
        write("empty.png", "screen");
        let folder = Folder::open(dir.path()).unwrap();
        let name = serde_json::json!({ "list": "photos.csv", "photo": "a.png" });
        let name: EntryName = serde_json::from_value(name).unwrap();
        let key = || PhotoKey::new(&name, &folder).unwrap();
        let before = key();
        assert!(before == key());
        write("empty.png", "another screen");
        assert!(before != key());
    }

    #[test]
    fn what_was_kept_longest_goes_first() {
        let recent = Recent::default();
        for key in [1, 2, 1, 3] {
            recent.keep(key, Arc::new(10 * key), 2);
        }
        assert_eq!(recent.get(&3).as_deref(), Some(&30));
        assert_eq!(recent.get(&1).as_deref(), Some(&10));
        assert!(recent.get(&2).is_none());
    }
}
