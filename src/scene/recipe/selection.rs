//! Which assets a scene shows: their number, and the photo of each.

use super::compose::SceneNumber;
use crate::error::{Error, Result};
use crate::scene::{AssetVariant, DrawLog, Draws, DropRanges, Grade, Object, Recipe, Take};
use serde::{Deserialize, Serialize};

/// What falls in place of a cut-out, as thick as the asset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Collider {
    /// A box around the whole card.
    #[default]
    Box,
    /// A convex prism of the object's hull: cards come to lie closer, at some cost in time.
    Hull,
}

/// How many different choices of objects there are; in files `"unique"` or a number above 0.
///
/// A choice is the number of objects and the asset and photo of each; size, colour and start are
/// drawn for every scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "SelectionsInFile", into = "SelectionsInFile")]
pub enum Selections {
    /// A new choice for every scene.
    #[default]
    Unique,
    /// This many; scene `k` has choice `k` modulo this.
    Count(u64),
}

#[derive(Serialize, Deserialize)]
#[serde(untagged, expecting = "expected \"unique\" or a number above 0")]
enum SelectionsInFile {
    Word(String),
    Number(u64),
}

impl TryFrom<SelectionsInFile> for Selections {
    type Error = String;

    fn try_from(written: SelectionsInFile) -> std::result::Result<Self, String> {
        match written {
            SelectionsInFile::Word(word) if word == "unique" => Ok(Self::Unique),
            SelectionsInFile::Word(word) => Err(format!(
                "\"{word}\", expected \"unique\" or a number above 0"
            )),
            SelectionsInFile::Number(0) => Err("0, expected \"unique\" or a number above 0".into()),
            SelectionsInFile::Number(n) => Ok(Self::Count(n)),
        }
    }
}

impl From<Selections> for SelectionsInFile {
    fn from(selections: Selections) -> Self {
        match selections {
            Selections::Unique => Self::Word("unique".into()),
            Selections::Count(n) => Self::Number(n),
        }
    }
}

impl Selections {
    /// The selection that scene `k` has.
    fn index_for(self, k: u64) -> Result<u64> {
        match self {
            Self::Unique => Ok(k),
            Self::Count(0) => Err(Error::value("selections", "0, expected at least 1")),
            Self::Count(n) => Ok(k % n),
        }
    }
}

impl Recipe {
    /// Assets and photos of one selection, at their own size and colour.
    pub(super) fn select_objects(
        &self,
        number: SceneNumber,
        log: &DrawLog,
        catalog: &[AssetVariant],
    ) -> Result<Vec<Object>> {
        let selection = self.selections.index_for(number.k)?;
        let draws = Draws::new(number.seed, selection).logged(log);
        let count = self.objects.draw_count(&draws, "selection.objects");
        check_catalog(count, catalog)?;
        let mut left = Vec::new();
        (0..count)
            .map(|i| {
                let place = draw_without_repetition(&draws, i, &mut left, catalog.len());
                let path = format!("selection[{i}].photo");
                catalog[place].draw_object(&draws, &path, self.photos, self.collider)
            })
            .collect()
    }
}

/// Fails on an empty catalog while there should be objects.
fn check_catalog(count: usize, catalog: &[AssetVariant]) -> Result<()> {
    if count == 0 || !catalog.is_empty() {
        return Ok(());
    }
    let what = format!("{count} asked for, but there is no asset to choose from");
    Err(Error::value("objects", what))
}

/// A place in a catalog of this length that is still `left`; all of them are once none is.
fn draw_without_repetition(draws: &Draws, i: usize, left: &mut Vec<usize>, length: usize) -> usize {
    if left.is_empty() {
        *left = (0..length).collect();
    }
    left.swap_remove(draws.choose(&format!("selection[{i}].asset"), left.len()))
}

impl AssetVariant {
    /// An object with one of the asset's photos, not placed yet.
    fn draw_object(
        &self,
        draws: &Draws,
        path: &str,
        photos: Take,
        collider: Collider,
    ) -> Result<Object> {
        self.check_photos()?;
        let photo = draws.choose(path, photos.slice_of(&self.photo_sizes).len());
        Ok(Object {
            asset: self.asset.clone(),
            photo,
            back: None,
            size: self.photo_sizes[photo],
            thickness: self.thickness,
            outline: self.collider_outline(photo, collider),
            mass: self.mass,
            placement: DropRanges::unplaced(),
            grade: Grade::default(),
            bend: Default::default(),
        })
    }

    fn check_photos(&self) -> Result<()> {
        if !self.photo_sizes.is_empty() {
            return Ok(());
        }
        let at = format!("assets.{}", self.asset);
        Err(Error::value(at, "no photo, expected at least one"))
    }

    /// Corners of the prism that falls; none where a box does.
    fn collider_outline(&self, photo: usize, collider: Collider) -> Vec<[f64; 2]> {
        match collider {
            Collider::Box => Vec::new(),
            Collider::Hull => self.photo_outlines.get(photo).cloned().unwrap_or_default(),
        }
    }
}
