//! Which assets a scene shows: their number, and the photo of each.

use super::compose::SceneNumber;
use crate::asset::Role;
use crate::error::{Error, Result};
use crate::scene::belt::SequencePlace;
use crate::scene::{AssetVariant, Count, DrawLog, Draws, DropRanges, Object, Recipe, Take};
use serde::{Deserialize, Serialize};

/// Collision shape of a cut-out, as thick as the asset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Collider {
    /// A box around the whole card.
    #[default]
    Box,
    /// A convex prism of the object's hull: cards come to rest closer to each other, at some cost
    /// in time.
    Hull,
}

/// Number of different selections of objects; in files `"unique"` or a number above 0.
///
/// A selection is the number of objects and the asset and photo of each; size, colour and start are
/// drawn for every scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "SelectionsInFile", into = "SelectionsInFile")]
pub enum Selections {
    /// A new selection for every scene.
    #[default]
    Unique,
    /// This many; scene `k` (with a belt, sequence `k`) has selection `k + k / n` modulo this `n`:
    /// each round begins with another one, so that a split that takes every fifth scene gets all of
    /// them.
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
    /// The selection of a sequence, which without a belt is a single scene.
    fn index_for(self, place: SequencePlace) -> Result<u64> {
        match self {
            Self::Unique => Ok(place.first),
            Self::Count(0) => Err(Error::value("selections", "0, expected at least 1")),
            Self::Count(n) => Ok(place.sequence.wrapping_add(place.sequence / n) % n),
        }
    }
}

/// What is selected from one part of the catalog: objects, or distractors.
pub(super) struct Choice<'a> {
    role: Role,
    count: &'a Count,
    /// Path of the count in the recipe.
    pub(super) at: &'static str,
    /// Path prefix of each choice, without its number.
    path: &'static str,
}

impl Recipe {
    /// Assets and photos of one selection, at their own size and colour: objects, then distractors.
    pub(super) fn select_objects(
        &self,
        number: SceneNumber,
        log: &DrawLog,
        catalog: &[AssetVariant],
    ) -> Result<Vec<Object>> {
        let selection = self.selections.index_for(number.place)?;
        let draws = Draws::new(number.seed, selection).logged(log);
        let mut selected = self.select(&self.choice_of(Role::Object), &draws, catalog)?;
        if !self.distractors.is_zero() {
            let distractors = self.choice_of(Role::Distractor);
            selected.extend(self.select(&distractors, &draws, catalog)?);
        }
        Ok(selected)
    }

    pub(super) fn choice_of(&self, role: Role) -> Choice<'_> {
        let (count, at, path) = match role {
            Role::Object => (&self.objects, "objects", "selection"),
            Role::Distractor => (&self.distractors, "distractors", "distractors"),
        };
        Choice {
            role,
            count,
            at,
            path,
        }
    }

    fn select(
        &self,
        choice: &Choice<'_>,
        draws: &Draws,
        catalog: &[AssetVariant],
    ) -> Result<Vec<Object>> {
        let part = choice.part_of(catalog);
        let path = format!("selection.{}", choice.at);
        let count = choice.count.draw(draws, &path);
        self.check_selection(choice, count, part.len())?;
        let mut left = Vec::new();
        (0..count)
            .map(|i| {
                let path = format!("{}[{i}]", choice.path);
                let variant = draw_without_repetition(draws, &path, &mut left, &part);
                variant.draw_object(draws, &path, self.photos, self.collider)
            })
            .collect()
    }

    /// Fails if more objects may be requested than there are assets, and none may occur twice.
    pub(super) fn check_selections(&self, catalog: &[AssetVariant]) -> Result<()> {
        for role in [Role::Object, Role::Distractor] {
            let choice = self.choice_of(role);
            let assets = choice.part_of(catalog).len();
            self.check_selection(&choice, choice.count.max(), assets)?;
        }
        Ok(())
    }

    fn check_selection(&self, choice: &Choice<'_>, count: usize, assets: usize) -> Result<()> {
        choice.check_part(count, assets)?;
        match self.at_most_once {
            true => choice.check_once(count, assets),
            false => Ok(()),
        }
    }

    /// Whether pictures can contain assets of a role.
    pub(super) fn draws_from(&self, role: Role) -> bool {
        !self.choice_of(role).count.is_zero()
    }
}

impl Choice<'_> {
    /// The part of a catalog that it selects from.
    fn part_of<'a>(&self, catalog: &'a [AssetVariant]) -> Vec<&'a AssetVariant> {
        let part = catalog.iter().filter(|variant| variant.role == self.role);
        part.collect()
    }

    /// Fails on an empty part although objects are requested from it.
    fn check_part(&self, count: usize, assets: usize) -> Result<()> {
        if count == 0 || assets > 0 {
            return Ok(());
        }
        let what = match self.role {
            Role::Object => "there is no asset to choose from",
            Role::Distractor => "no asset has the role \"distractor\"",
        };
        Err(Error::value(
            self.at,
            format!("{count} requested, but {what}"),
        ))
    }

    /// Fails if an asset would have to occur twice.
    fn check_once(&self, count: usize, assets: usize) -> Result<()> {
        if count <= assets {
            return Ok(());
        }
        let (at, role) = (self.at, self.role);
        let what = format!(
            "{count} requested, but there are {assets} assets of role \"{role}\" and at_most_once is true; \
             expected {at} up to {assets}"
        );
        Err(Error::value(at, what))
    }
}

/// Draws an asset that is still in `left`; once none is, all of them are again.
fn draw_without_repetition<'a>(
    draws: &Draws,
    path: &str,
    left: &mut Vec<usize>,
    part: &[&'a AssetVariant],
) -> &'a AssetVariant {
    if left.is_empty() {
        *left = (0..part.len()).collect();
    }
    part[left.swap_remove(draws.choose(&format!("{path}.asset"), left.len()))]
}

impl AssetVariant {
    /// An object with one of the asset's photos, not yet placed.
    fn draw_object(
        &self,
        draws: &Draws,
        path: &str,
        photos: Take,
        collider: Collider,
    ) -> Result<Object> {
        self.check_photos()?;
        let photo = draws.choose(
            &format!("{path}.photo"),
            photos.slice_of(&self.photo_sizes).len(),
        );
        let (size, placement) = (self.photo_sizes[photo], DropRanges::unplaced());
        Ok(Object {
            role: self.role,
            photo,
            outline: self.collider_outline(photo, collider),
            ..Object::new(&self.asset, size, self.thickness, self.mass, placement)
        })
    }

    fn check_photos(&self) -> Result<()> {
        if !self.photo_sizes.is_empty() {
            return Ok(());
        }
        let at = format!("assets.{}", self.asset);
        Err(Error::value(at, "no photo, expected at least one"))
    }

    /// Corners of the falling prism; none if a box falls.
    fn collider_outline(&self, photo: usize, collider: Collider) -> Vec<[f64; 2]> {
        match collider {
            Collider::Box => Vec::new(),
            Collider::Hull => self.photo_outlines.get(photo).cloned().unwrap_or_default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Recipe;
    use std::collections::BTreeSet;

    #[test]
    fn every_fifth_scene_comes_to_all_selections_and_so_do_the_others() {
        let selections = Selections::Count(50);
        let of_scene = |k| {
            let place = Recipe::default().place_in_sequence(k);
            selections.index_for(place).unwrap()
        };
        for is_val in [true, false] {
            let part = (0..250).filter(|k| (k % 5 == 0) == is_val);
            let found: BTreeSet<u64> = part.map(of_scene).collect();
            assert!(found.into_iter().eq(0..50), "for validation: {is_val}");
        }
    }
}
