//! The occluders of a shot.

use crate::asset::Texture;
use crate::geom::Vector3;
use crate::render::opacity::OpacityMips;
use crate::render::view::ScenePlane;
use crate::scene::{Card, Grade};
use std::sync::Arc;

/// A card as an occluder.
#[derive(Debug)]
pub(super) struct Occluder<'a> {
    /// Its plane.
    pub(super) plane: ScenePlane,
    front: Arc<OpacityMips<'a>>,
    /// None if the back is the front seen through.
    back: Option<Arc<OpacityMips<'a>>>,
}

/// All occluders: the cards, and the surface for light from below.
#[derive(Debug)]
pub(super) struct Occluders<'a> {
    /// In the order of the cards.
    pub(super) cards: Vec<Occluder<'a>>,
    /// The plane `z = 0` as far as it reaches.
    pub(super) surface: ScenePlane,
    /// Whether some card is film, so that transmittance differs between channels.
    pub(super) tinted: bool,
}

impl<'a> Occluders<'a> {
    /// The occluders of a shot; cards with the same texture share its opacity.
    pub(super) fn new(cards: &[(&'a Card, ScenePlane)], surface: ScenePlane) -> Self {
        let mut known = Vec::new();
        let cards: Vec<_> = cards
            .iter()
            .map(|&(card, plane)| Occluder::new(card, plane, &mut known))
            .collect();
        Self {
            cards,
            surface,
            tinted: known.iter().any(|mips| mips.is_film()),
        }
    }

    /// The point of the surface below the mean of the cards' centres: their shadows fall around it.
    pub(super) fn middle_on_surface(&self) -> Vector3<f64> {
        let centers = self.cards.iter().map(|card| card.plane.center);
        let mean = centers.sum::<Vector3<f64>>() / self.cards.len().max(1) as f64;
        Vector3::new(mean.x, mean.y, 0.0)
    }

    /// Height of the cards above the plane through a point with this unit normal, metres.
    pub(super) fn height_above(&self, normal: &Vector3<f64>, point: &Vector3<f64>) -> f64 {
        let corners = self.cards.iter().flat_map(|card| card.plane.corners());
        let heights = corners.map(|corner| normal.dot(&(corner - point)));
        heights.fold(0.0, f64::max)
    }
}

impl<'a> Occluder<'a> {
    fn new(card: &'a Card, plane: ScenePlane, known: &mut Vec<Arc<OpacityMips<'a>>>) -> Self {
        Self {
            plane,
            front: shared_mips(&card.texture, &card.grade, known),
            back: card
                .back
                .as_ref()
                .map(|back| shared_mips(back, &card.grade, known)),
        }
    }

    /// The side of it that a receiver sees, and whether that is its back; `toward` is the side of
    /// the light on its normal.
    ///
    /// A receiver sees the side that is turned away from the light.
    pub(super) fn side_facing(&self, toward: f64) -> (&OpacityMips<'a>, bool) {
        match &self.back {
            Some(back) if toward > 0.0 => (back, true),
            _ => (&self.front, false),
        }
    }

    /// Whether some corner of it is more than `margin` above a plane, `normal . p = offset`.
    pub(super) fn is_above(&self, normal: &Vector3<f64>, offset: f64, margin: f64) -> bool {
        let corners = self.plane.corners();
        corners.iter().any(|c| normal.dot(c) - offset > margin)
    }
}

fn shared_mips<'a>(
    texture: &'a Texture,
    grade: &Grade,
    known: &mut Vec<Arc<OpacityMips<'a>>>,
) -> Arc<OpacityMips<'a>> {
    if let Some(same) = known.iter().find(|mips| mips.serves(texture, grade)) {
        return same.clone();
    }
    let mips = Arc::new(OpacityMips::new(texture, *grade));
    known.push(mips.clone());
    mips
}
