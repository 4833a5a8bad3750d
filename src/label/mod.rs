//! Label: what is where in a picture, read from the same deep samples as the picture itself.
//!
//! Masks, boxes and visibility are folds over the deep samples, so a label cannot disagree with its
//! picture. Outlines and what lies over what are geometry: the cards' outlines as the camera sees
//! them, or the borders of their masks ([`OutlineKind`]). An [`ObstructionRule`] says which of the
//! two decides what is topmost.
//!
//! ```
//! use petcomp::geom::{Pose, Quad};
//! use petcomp::label::{LabelOptions, label};
//! use petcomp::render::{RenderOptions, render};
//! use petcomp::scene::Card;
//! use petcomp::{Camera, Image, ObjectId, PremulRgba, Shot};
//!
//! let card = |id, height| {
//!     let quad = Quad { world_from_card: Pose::translation(0.0, 0.0, height), size: [0.2, 0.1] };
//!     Card::new(ObjectId(id), quad, Image::filled(8, 8, PremulRgba::new(0.2, 0.2, 0.2, 1.0)))
//! };
//! let shot = Shot::new(Camera::looking_down(1.0, 80.0, [64, 48]))
//!     .with_card(card(1, 0.01))
//!     .with_card(card(2, 0.02));
//! let labels = label(&render(&shot, &RenderOptions::default()), &shot, &LabelOptions::default());
//! assert_eq!(labels.objects[0].covered_by, [ObjectId(2)]);
//! assert!(labels.objects[1].is_topmost());
//! ```

mod boolean;
mod border;
mod distractor;
pub(crate) mod gallery;
mod holdout;
mod mask;
mod obstruction;
mod outline;
pub(crate) mod overlay;
mod rle;
mod simplify;
mod topmost;
#[doc(hidden)]
pub mod trace;
mod truncation;
mod visibility;

#[doc(hidden)]
pub use border::{Border, borders};
#[doc(hidden)]
pub use distractor::Distractor;
pub use mask::RleMask;
pub use obstruction::ObstructionRule;
pub(crate) use obstruction::RuleInFile;
#[doc(hidden)]
pub use overlay::overlay;
pub use topmost::cyclic_overlaps;
#[doc(hidden)]
pub use truncation::Truncation;
pub use visibility::DepthRange;

use crate::camera::{Camera, RadialDistortion};
use crate::deep::DeepImage;
use crate::geom::{BBox, Point2};
use crate::pixel::ObjectId;
use crate::scene::{Card, Shot};
use geo::MultiPolygon;
use serde::{Deserialize, Serialize};
use std::cell::LazyCell;
use visibility::ObjectVisibility;

/// How far the outline that is written may be from the border of a mask, pixels: the stairs of a
/// slanting border become a line. What lies over what goes by the border itself.
const MASK_OUTLINE_TOLERANCE_PX: f64 = 1.0;

/// Everything known of the objects in one picture.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Labels {
    /// Width and height of the picture, pixels.
    pub image: [u32; 2],
    /// One entry per object that touches the picture, in order of id.
    pub objects: Vec<ObjectLabel>,
    /// What touches the picture and has no label: it is in the way, in order of id.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub distractors: Vec<Distractor>,
    /// What the picture shows too faintly for a box, no pixel being above
    /// [`alpha_threshold`](LabelOptions::alpha_threshold), with its class (none of a distractor), in
    /// order of id; in no file.
    #[serde(skip)]
    pub faint: Vec<(ObjectId, Option<u32>)>,
}

/// Everything known of one object in one picture.
///
/// "Amodal" is the whole object as far as it lies in the picture, as if it were alone; "visible" is
/// what is seen of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ObjectLabel {
    /// Which object of the scene.
    pub id: ObjectId,
    /// Index into the class list.
    pub class: u32,
    /// Outline in the picture, pixels, by [`LabelOptions::outline`]: one ring per part (the clipping
    /// leaves one of a convex outline), none for a card seen edge-on. That of a mask is simplified by
    /// up to 1 pixel; what lies over what goes by the mask, to the pixel.
    pub outline_px: Vec<Vec<Point2<f64>>>,
    /// Box around the whole object.
    pub amodal_box: BBox,
    /// Box around what is seen of it; empty when nothing is.
    pub visible_box: BBox,
    /// Pixels that it covers, seen or not.
    pub amodal_mask: RleMask,
    /// Pixels in which it is seen. See-through objects over each other are seen in the same
    /// pixels.
    pub visible_mask: RleMask,
    /// Seen share of its coverage, 0 to 1: what half covers a pixel counts half.
    pub visible_fraction: f64,
    /// How far away it is; of a curved card, how far the flat one is.
    pub depth: DepthRange,
    /// Objects and distractors that lie over it, by their outlines, in order of id.
    pub covered_by: Vec<ObjectId>,
    /// Share of its outline that no other one lies over and the place does not hide, 0 to 1; none
    /// by [`ObstructionRule::Overlap`], which does not ask.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncovered_fraction: Option<f64>,
    /// Whether that is too little, by [`ObstructionRule::Visibility`]; by
    /// [`ObstructionRule::Overlap`] it is true where the place hides more than that share of it, and
    /// else none: `covered_by` tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub obstructed: Option<bool>,
    /// How far it reaches out of the picture; none where
    /// [`max_truncation`](LabelOptions::max_truncation) does not ask.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truncation: Option<Truncation>,
}

impl ObjectLabel {
    /// It is not obstructed, by the rule that it was labelled with: it can be picked.
    pub fn is_topmost(&self) -> bool {
        match self.obstructed {
            Some(obstructed) => !obstructed,
            None => self.covered_by.is_empty(),
        }
    }

    /// More of it lies outside of the picture than the options allow: it has no label.
    pub fn is_too_truncated(&self) -> bool {
        self.truncation
            .is_some_and(|truncation| truncation.above_max)
    }
}

/// How [`label()`] decides.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LabelOptions {
    /// What the amodal box is drawn around. Default: `mask`.
    pub amodal: AmodalBox,
    /// What is taken for the outline of an object. Default: `hull`.
    #[serde(skip_serializing_if = "OutlineKind::is_hull")]
    pub outline: OutlineKind,
    /// A pixel belongs to an object when more than this share of it is covered, 0 to less than 1;
    /// counts for masks, not for sums of coverage. Default: 0.1, under which thin film and the noise
    /// of a matte look alike.
    pub alpha_threshold: f32,
    /// An object has no label when more than this share of its outline lies outside of the picture,
    /// 0 to 1. Default: none, however little of it is inside; then truncation is not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_truncation: Option<f64>,
    /// When an object is obstructed. Default: when another lies over it, any overlap.
    #[serde(flatten)]
    pub obstruction: ObstructionRule,
}

impl Default for LabelOptions {
    fn default() -> Self {
        Self {
            amodal: AmodalBox::Mask,
            outline: OutlineKind::Hull,
            alpha_threshold: 0.1,
            max_truncation: None,
            obstruction: ObstructionRule::default(),
        }
    }
}

/// What an amodal box is drawn around.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AmodalBox {
    /// The pixels that the object covers, as if alone.
    #[default]
    Mask,
    /// The outline, which may be wider than what can be seen of a transparent object.
    Outline,
}

/// What is taken for the outline of an object: what lies over it, how much of it is free, and
/// where it is drawn go by that.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OutlineKind {
    /// The card's own outline, projected: of an asset its convex hull, as in the paper.
    #[default]
    Hull,
    /// The border of the pixels that it covers, as if alone: without the hole of a ring and the
    /// angle of an L, and, where film is clearer than
    /// [`alpha_threshold`](LabelOptions::alpha_threshold), without that film.
    Mask,
}

impl OutlineKind {
    /// Whether it is the default, which no file has to tell.
    pub(crate) fn is_hull(&self) -> bool {
        *self == Self::Hull
    }
}

/// The outline of a card as the camera sees it, clipped to the picture: one ring per part, pixels.
#[doc(hidden)]
pub fn outline_of(card: &Card, camera: &Camera) -> Vec<Vec<Point2<f64>>> {
    let pinhole = RadialDistortion::new(camera, 0.0);
    outline::rings(&outline::region(card, camera, &pinhole))
}

/// A card as the camera sees it.
struct Silhouette<'a> {
    card: &'a Card,
    /// What lies inside of its outline.
    region: MultiPolygon<f64>,
    outline_px: Vec<Vec<Point2<f64>>>,
    visibility: ObjectVisibility,
    truncation: Option<Truncation>,
}

/// Labels the picture `deep` of `shot`: every object with a box in the picture, in order of id.
///
/// # Panics
/// When `deep` does not have the size of the shot's camera.
pub fn label(deep: &DeepImage, shot: &Shot, options: &LabelOptions) -> Labels {
    let image = shot.camera.image;
    check_size(deep, image);
    let (boxless, objects): (Vec<_>, Vec<_>) = silhouettes(deep, shot, options)
        .into_iter()
        .partition(|s| s.amodal_box(options.amodal).is_empty());
    let occluders = topmost::occluders(&objects, shot, options.obstruction.pair_iou());
    let uncovered: Vec<_> =
        uncovered_fractions(&objects, &occluders, shot, options.obstruction).collect();
    let mut labels = Labels {
        image,
        faint: faint(&boxless),
        ..Labels::default()
    };
    for ((object, covered_by), uncovered) in objects.into_iter().zip(occluders).zip(uncovered) {
        labels.push(
            object,
            shot,
            options,
            Cover {
                by: covered_by,
                free: uncovered,
            },
        );
    }
    labels
}

/// Those that cover anything, and their classes.
fn faint(boxless: &[Silhouette<'_>]) -> Vec<(ObjectId, Option<u32>)> {
    let covering = boxless.iter().filter(|s| s.visibility.covers_any());
    covering.map(|s| (s.card.id, s.card.class)).collect()
}

/// What lies over a card: others by their ids, and the share that neither they nor the place cover,
/// where a rule asks.
struct Cover {
    by: Vec<ObjectId>,
    free: Option<f64>,
}

impl Labels {
    /// Adds a card as what it is: an object of a class, or a distractor.
    fn push(
        &mut self,
        silhouette: Silhouette<'_>,
        shot: &Shot,
        options: &LabelOptions,
        cover: Cover,
    ) {
        match silhouette.card.class {
            Some(class) => self.objects.push(ObjectLabel {
                obstructed: options.obstruction.verdict(&silhouette, cover.free, shot),
                covered_by: cover.by,
                uncovered_fraction: cover.free,
                ..silhouette.into_label(class, options)
            }),
            None => {
                let distractor = silhouette.into_distractor(options, cover.by);
                self.distractors.push(distractor);
            }
        }
    }
}

/// How much of each object no other one lies over, where the rule asks for it.
fn uncovered_fractions(
    objects: &[Silhouette<'_>],
    occluders: &[Vec<ObjectId>],
    shot: &Shot,
    rule: ObstructionRule,
) -> impl Iterator<Item = Option<f64>> {
    let pairs = objects.iter().zip(occluders);
    pairs.map(move |(object, over)| {
        rule.asks_for_share()
            .then(|| topmost::uncovered_fraction(object, over, objects, shot))
    })
}

impl ObstructionRule {
    /// Whether an object is obstructed; none where only those over it tell.
    fn verdict(self, object: &Silhouette<'_>, uncovered: Option<f64>, shot: &Shot) -> Option<bool> {
        match uncovered {
            Some(share) => self.is_obstructed(share),
            None => topmost::is_held_out(object, self.pair_iou(), shot).then_some(true),
        }
    }
}

fn check_size(deep: &DeepImage, [width, height]: [u32; 2]) {
    assert_eq!(
        (deep.width(), deep.height()),
        (width as usize, height as usize),
        "deep picture and camera differ"
    );
}

/// What a mask covers, to the pixel, and its border with fewer corners.
fn mask_outline(mask: &RleMask) -> (MultiPolygon<f64>, Vec<Vec<Point2<f64>>>) {
    let [exact, simplified] = trace::exact_and_simplified(mask, MASK_OUTLINE_TOLERANCE_PX);
    (outline::inside(&exact), simplified)
}

/// All cards of a shot as its camera sees them, in order of id.
fn silhouettes<'a>(
    deep: &DeepImage,
    shot: &'a Shot,
    options: &LabelOptions,
) -> Vec<Silhouette<'a>> {
    let cards = cards_by_id(shot);
    let ids: Vec<_> = cards.iter().map(|card| card.id).collect();
    let visibilities = visibility::fold_samples(deep, &ids, options);
    let pairs = cards.into_iter().zip(visibilities);
    pairs
        .map(|(card, visibility)| Silhouette::new(card, shot, visibility, options))
        .collect()
}

fn cards_by_id(shot: &Shot) -> Vec<&Card> {
    let mut cards: Vec<&Card> = shot.cards.iter().collect();
    cards.sort_by_key(|card| card.id);
    cards
}

impl<'a> Silhouette<'a> {
    fn new(
        card: &'a Card,
        shot: &Shot,
        visibility: ObjectVisibility,
        options: &LabelOptions,
    ) -> Self {
        // Where the mask's border is the outline, truncation alone asks for it.
        let hull = LazyCell::new(|| outline::region(card, &shot.camera, &shot.distortion()));
        let truncation = options
            .max_truncation
            .map(|max| Truncation::new(card, shot, &hull, max));
        let (region, outline_px) = match options.outline {
            OutlineKind::Hull => (hull.clone(), outline::rings(&hull)),
            OutlineKind::Mask => mask_outline(&visibility.amodal),
        };
        Self {
            card,
            region,
            outline_px,
            visibility,
            truncation,
        }
    }

    fn amodal_box(&self, around: AmodalBox) -> BBox {
        match around {
            AmodalBox::Mask => self.visibility.amodal.bounds(),
            AmodalBox::Outline => outline::bounds(&self.region),
        }
    }

    /// All but what lies over it.
    fn into_label(self, class: u32, options: &LabelOptions) -> ObjectLabel {
        let amodal_box = self.amodal_box(options.amodal);
        let seen = self.visibility;
        ObjectLabel {
            id: self.card.id,
            class,
            outline_px: self.outline_px,
            amodal_box,
            visible_box: seen.visible.bounds(),
            visible_fraction: seen.fraction,
            amodal_mask: seen.amodal,
            visible_mask: seen.visible,
            depth: seen.depth,
            truncation: self.truncation,
            ..ObjectLabel::default()
        }
    }

    fn into_distractor(self, options: &LabelOptions, covered_by: Vec<ObjectId>) -> Distractor {
        let amodal_box = self.amodal_box(options.amodal);
        let seen = self.visibility;
        Distractor {
            id: self.card.id,
            outline_px: self.outline_px,
            amodal_box,
            visible_box: seen.visible.bounds(),
            visible_fraction: seen.fraction,
            amodal_mask: seen.amodal,
            visible_mask: seen.visible,
            depth: seen.depth,
            covered_by,
        }
    }
}
