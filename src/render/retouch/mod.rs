//! Retouched cut-outs: with other dyes, glints or edges, or curved.
//!
//! Whatever a card needs beyond its own texture is done to the texture before anything is rendered,
//! at the level of detail that the picture reads and on the visible part of the card's plane. All
//! later stages, other renderers included, only see flat cards in their own colours; cards that
//! need nothing are passed on unchanged.

mod bend;
mod dye;
mod edges;
mod painted_plane;

use crate::asset::{SurfaceCache, SurfaceTexel, Texture};
use crate::image::Image;
use crate::render::RenderOptions;
use crate::render::detail::{detail_level, texels_per_pixel};
use crate::render::pixel_filter::filter_quantiles;
use crate::render::view::{CameraView, ProjectedPlane, ScenePlane};
use crate::scene::{Card, EdgeTreatment, Shot};
use bend::BentShading;
use painted_plane::PaintedPlane;
use rayon::prelude::*;
use std::borrow::Cow;

/// A shot with flat cards and final textures, at the detail that a picture needs.
pub(super) fn retouched<'a>(shot: &'a Shot, options: &RenderOptions) -> Cow<'a, Shot> {
    retouch(shot, options, Some(filter_quantiles(options.subsamples)))
}

/// A shot with flat cards and final textures at full detail, for renderers without mip levels.
pub fn retouched_fully<'a>(shot: &'a Shot, options: &RenderOptions) -> Cow<'a, Shot> {
    retouch(shot, &options.clamped(), None)
}

fn retouch<'a>(
    shot: &'a Shot,
    options: &RenderOptions,
    offsets: Option<Vec<f64>>,
) -> Cow<'a, Shot> {
    if !shot.cards.iter().any(|card| asks_for_retouch(card, shot)) {
        return Cow::Borrowed(shot);
    }
    let darkroom = Darkroom {
        shot,
        options,
        offsets,
        view: CameraView::from_camera(&shot.camera),
    };
    let cards = shot.cards.par_iter();
    Cow::Owned(Shot {
        cards: cards.map(|card| darkroom.retouch_card(card)).collect(),
        edges: EdgeTreatment::AsIs,
        ..shot.clone()
    })
}

fn asks_for_retouch(card: &Card, shot: &Shot) -> bool {
    card.grade.changes_surface() || !card.bend.is_flat() || shot.edges.reshape_cut_outs()
}

/// The context of retouching.
struct Darkroom<'a> {
    shot: &'a Shot,
    options: &'a RenderOptions,
    /// Sub-samples along each side of a pixel; none for full detail.
    offsets: Option<Vec<f64>>,
    view: CameraView,
}

/// The visible side of a card, and the size of its texels.
struct SeenSide<'a> {
    texture: &'a Texture,
    surface: &'a SurfaceCache,
    /// Whether it is the back, whose texture is mirrored.
    mirrored: bool,
    texels_per_pixel: f64,
}

impl Darkroom<'_> {
    /// Invisible cards are unchanged.
    fn retouch_card(&self, card: &Card) -> Card {
        let seen = ScenePlane::from_card(card)
            .filter(|_| asks_for_retouch(card, self.shot) && !card.texture.is_empty())
            .filter(|plane| self.view.has_in_front(&plane.corners()))
            .and_then(|plane| Some((plane, self.seen_side(card, &plane)?)));
        seen.map_or_else(
            || card.clone(),
            |(plane, side)| self.retouch_side(card, &plane, &side),
        )
    }

    /// None if the card is seen edge-on.
    fn seen_side<'c>(&self, card: &'c Card, plane: &ScenePlane) -> Option<SeenSide<'c>> {
        let projected = ProjectedPlane::new(plane, &self.view)?;
        let behind = plane.is_seen_from_behind(&self.view.eye);
        let (texture, surface) = match &card.back {
            Some(back) if behind => (back, &card.surfaces[1]),
            _ => (&card.texture, &card.surfaces[0]),
        };
        let corners = plane.corners();
        let texels = corners
            .iter()
            .map(|corner| texels_per_pixel(texture, plane, &projected, &self.view, corner));
        Some(SeenSide {
            texture,
            surface,
            mirrored: behind && card.back.is_some(),
            texels_per_pixel: texels.fold(f64::INFINITY, f64::min),
        })
    }

    /// The mip level that the nearest corner of a card is read from, or the next finer one if
    /// texels are moved.
    fn level(&self, card: &Card, side: &SeenSide<'_>) -> usize {
        let Some(offsets) = &self.offsets else {
            return 0;
        };
        let level = detail_level(side.texels_per_pixel, offsets) as usize;
        let moved = !card.bend.is_flat() || self.shot.edges.reshape_cut_outs();
        let level = level.saturating_sub(usize::from(moved));
        level.min(side.texture.levels() - 1)
    }

    fn retouch_side(&self, card: &Card, plane: &ScenePlane, side: &SeenSide<'_>) -> Card {
        let flat = self.paint(card, side);
        let painted = match card.cylinder_seen_from(&self.shot.camera.center()) {
            Some(cylinder) => {
                let shading = BentShading::new(self, card, plane, &cylinder);
                let center = self.shot.camera.center();
                let eye = card.quad.world_from_card.inverse_transform_point(&center);
                bend::bend(&flat, card, &cylinder, &shading, &eye)
            }
            None => flat,
        };
        painted.into_card(card)
    }

    /// A side in its final colours and with its final edges.
    fn paint(&self, card: &Card, side: &SeenSide<'_>) -> PaintedPlane {
        let (level, edges) = (self.level(card, side), self.shot.edges);
        let mut painted = PaintedPlane::new(card, side.texture, side.mirrored, level);
        if card.grade.changes_surface() {
            dye::dye(&mut painted.film, &side.surface_level(level), &card.grade);
        }
        if edges.reshape_cut_outs() {
            // The edges of a card smaller than a pixel are those of one that fills it.
            let longest = painted.film.width().max(painted.film.height()) as f64;
            let pixel = (side.texels_per_pixel / libm::exp2(level as f64)).min(longest);
            edges::treat(
                &mut painted,
                &side.surface_level(level),
                edges,
                pixel as f32,
            );
        }
        painted
    }
}

impl SeenSide<'_> {
    /// The surface map at a mip level.
    fn surface_level(&self, level: usize) -> Image<SurfaceTexel> {
        let surface = self.surface.of(self.texture);
        painted_plane::turned(surface.level(level).clone(), self.mirrored)
    }
}

#[cfg(test)]
mod tests;
