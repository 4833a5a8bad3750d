//! Label: what is where in a picture, read from the same deep samples as the picture itself.
//!
//! Masks, boxes and visibility are folds over the deep samples, so a label cannot disagree with its
//! picture. Outlines and which object covers which are geometry: the cards' outlines as the camera
//! sees them, or the borders of their masks ([`OutlineKind`]). An [`ObstructionRule`] decides which
//! objects are topmost.
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

/// Maximum distance of the written outline from the border of a mask, pixels: the staircase of a
/// slanting border becomes a line. Which object covers which is decided by the exact border.
const MASK_OUTLINE_TOLERANCE_PX: f64 = 1.0;

/// Everything known about the objects in one picture.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Labels {
    /// Width and height of the picture, pixels.
    pub image: [u32; 2],
    /// One entry per object that touches the picture, in order of id.
    pub objects: Vec<ObjectLabel>,
    /// Objects that touch the picture, are in the way and have no label, in order of id.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub distractors: Vec<Distractor>,
    /// Objects that the picture shows too faintly for a box, no pixel being above
    /// [`alpha_threshold`](LabelOptions::alpha_threshold), with their class (none for a
    /// distractor), in order of id; not written to files.
    #[serde(skip)]
    pub faint: Vec<(ObjectId, Option<u32>)>,
}

/// Everything known about one object in one picture.
///
/// "Amodal" is the whole object as far as it is in the picture, as if it were alone; "visible" is
/// its visible part.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ObjectLabel {
    /// Id of the object in the scene.
    pub id: ObjectId,
    /// Index into the class list.
    pub class: u32,
    /// Outline in the picture, pixels, according to [`LabelOptions::outline`]: one ring per part (a
    /// convex outline has one after clipping), none for a card seen edge-on. The outline of a mask
    /// is simplified by up to 1 pixel; which object covers which is decided by the mask itself, to
    /// the pixel.
    pub outline_px: Vec<Vec<Point2<f64>>>,
    /// Box around the whole object.
    pub amodal_box: BBox,
    /// Box around its visible part; empty if nothing is visible.
    pub visible_box: BBox,
    /// Pixels that it covers, visible or not.
    pub amodal_mask: RleMask,
    /// Pixels in which it is visible. See-through objects over each other are visible in the same
    /// pixels.
    pub visible_mask: RleMask,
    /// Visible share of its coverage, 0 to 1: a half-covered pixel counts half.
    pub visible_fraction: f64,
    /// Its distance; for a curved card, that of the flat card.
    pub depth: DepthRange,
    /// Objects and distractors that cover it, by their outlines, in order of id.
    pub covered_by: Vec<ObjectId>,
    /// Share of its outline that no other object covers and the holdout does not hide, 0 to 1; none
    /// with [`ObstructionRule::Overlap`], which does not need it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncovered_fraction: Option<f64>,
    /// With [`ObstructionRule::Visibility`], whether that share is too small. With
    /// [`ObstructionRule::Overlap`], true if the holdout hides more than the rule's share of the
    /// object, otherwise none: `covered_by` decides.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub obstructed: Option<bool>,
    /// How far it extends beyond the picture; none unless
    /// [`max_truncation`](LabelOptions::max_truncation) is set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truncation: Option<Truncation>,
}

impl ObjectLabel {
    /// Whether it is not obstructed, by the rule that it was labelled with, and can be picked.
    pub fn is_topmost(&self) -> bool {
        match self.obstructed {
            Some(obstructed) => !obstructed,
            None => self.covered_by.is_empty(),
        }
    }

    /// Whether more of it is outside the picture than the options allow, so that it has no label.
    pub fn is_too_truncated(&self) -> bool {
        self.truncation
            .is_some_and(|truncation| truncation.above_max)
    }
}

/// Options of [`label()`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LabelOptions {
    /// What the amodal box is drawn around. Default: `mask`.
    pub amodal: AmodalBox,
    /// What is used as the outline of an object. Default: `hull`.
    #[serde(skip_serializing_if = "OutlineKind::is_hull")]
    pub outline: OutlineKind,
    /// A pixel belongs to an object if more than this share of it is covered, 0 to less than 1;
    /// applies to masks, not to sums of coverage. Default: 0.1, below which thin film and the noise
    /// of a matte look alike.
    pub alpha_threshold: f32,
    /// An object has no label if more than this share (0 to 1) of its outline is outside the picture.
    /// Default: none: labelled however little of it is inside; truncation is then not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_truncation: Option<f64>,
    /// When an object is obstructed. Default: when another covers it, with any overlap.
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
    /// The outline, which may be wider than the visible part of a transparent object.
    Outline,
}

/// What is used as the outline of an object: it decides which objects cover it, how much of it is
/// free, and where it is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OutlineKind {
    /// The card's own outline, projected: for an asset its convex hull, as in the paper.
    #[default]
    Hull,
    /// The border of the pixels that it covers, as if alone: excludes the hole of a ring, the notch
    /// of an L, and film that is clearer than [`alpha_threshold`](LabelOptions::alpha_threshold).
    Mask,
}

impl OutlineKind {
    /// Whether it is the default, which files omit.
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
    /// The region inside its outline.
    region: MultiPolygon<f64>,
    outline_px: Vec<Vec<Point2<f64>>>,
    visibility: ObjectVisibility,
    truncation: Option<Truncation>,
}

/// Labels the picture `deep` of `shot`: every object with a box in the picture, in order of id.
///
/// # Panics
/// If `deep` does not have the size of the shot's camera.
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

/// Those that cover anything, with their classes.
fn faint(boxless: &[Silhouette<'_>]) -> Vec<(ObjectId, Option<u32>)> {
    let covering = boxless.iter().filter(|s| s.visibility.covers_any());
    covering.map(|s| (s.card.id, s.card.class)).collect()
}

/// What covers a card: the ids of other cards, and the share that neither they nor the holdout
/// cover, if the rule needs it.
struct Cover {
    by: Vec<ObjectId>,
    free: Option<f64>,
}

impl Labels {
    /// Adds a card as an object of a class or as a distractor.
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

/// How much of each object no other one covers, if the rule needs it.
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
    /// Whether an object is obstructed; none if only the objects covering it decide.
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

/// The region of a mask, to the pixel, and its border with fewer corners.
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
        // If the mask's border is the outline, only truncation needs the hull.
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

    /// Everything except what covers it.
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
