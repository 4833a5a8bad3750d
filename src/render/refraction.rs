//! Refraction: what is seen through cards with a flow is read where the lines of sight through them
//! end.
//!
//! A card with a flow itself looks the same as without; what is behind it is displaced. This
//! changes a pixel by the transmittance of the card and of everything in front of it, times the
//! difference between what is behind at the displaced place and straight on. The difference becomes
//! light of the card's own sample, so that pictures remain sums of light, and labels, which depend
//! on coverage alone, are unaffected. The part of it that belongs to the plate is stored
//! separately: it is as sharp as the photo, whatever is done to the objects.

use crate::camera::RadialDistortion;
use crate::deep::{DeepImage, DeepSample, SeenBehind};
use crate::filter::{Pyramid, sample_blurred, sample_cubic_clamped};
use crate::geom::{Point2, Point3, Vector3};
use crate::image::Image;
use crate::matte::{Flow, LightPath};
use crate::pixel::{LinearRgb, Mix, ObjectId};
use crate::render::block::PixelBlock;
use crate::render::view::{
    CameraView, HORIZON_M, ProjectedPlane, ScenePlane, pixel_center, visible_planes,
};
use crate::scene::{Card, Cylinder, Shot};
use crate::work::{self, Kind};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;

/// Pixels around a position that an interpolated reading uses.
const READING_MARGIN_PX: f64 = 3.0;

/// Displaces everything seen through the picture's refracting cards.
///
/// `shot` has the original cards, `offsets` are the sub-samples along a side of a pixel, and
/// `behind` renders the cards behind one of them, at least in a block.
///
/// # Method
/// Back to front, once for each card with a flow: the picture of everything behind it, including
/// refracting cards, is read at the displaced places. Measured on a display, the displacement d
/// stands for a line of sight that leaves the object at its middle, h0 above the display; what is
/// at clearance c below the object is displaced by `d (h0 + c) / h0` along the card. The clearance
/// is the mean of what is seen straight on, weighted by visibility.
pub(super) fn refract(
    deep: DeepImage,
    shot: &Shot,
    offsets: &[f64],
    behind: impl Fn(ObjectId, &PixelBlock) -> DeepImage,
) -> DeepImage {
    let cards = bending_cards(shot);
    if cards.is_empty() {
        return deep;
    }
    let places = places_of(&deep, &cards);
    let sight = Sight::new(shot, offsets);
    let mut changes = Changes::new();
    for card in &cards {
        if let Some(place) = places.get(&card.id) {
            let reached = card.reached(place, &sight.view);
            let light = deep_with(behind(card.id, &reached), &changes, shot);
            let backdrop = Backdrop::new(light, &reached, shot);
            changes.insert(card.id, sight.change(card, place, &backdrop, &deep));
        }
    }
    deep_with(deep, &changes, shot)
}

/// Difference between what is displaced behind a card and what is straight behind it.
struct Change {
    block: PixelBlock,
    pixels: Vec<SeenBehind>,
}

type Changes = BTreeMap<ObjectId, Change>;

impl Change {
    fn at(&self, x: usize, y: usize) -> Option<SeenBehind> {
        let inside = self.block.x.contains(&x) && self.block.y.contains(&y);
        let row = || (y - self.block.y.start) * self.block.x.len();
        inside.then(|| self.pixels[row() + x - self.block.x.start])
    }
}

fn deep_with(deep: DeepImage, changes: &Changes, shot: &Shot) -> DeepImage {
    let blocks = || changes.values().map(|change| &change.block);
    let area = [
        span(blocks().map(|block| &block.x)),
        span(blocks().map(|block| &block.y)),
    ];
    deep.with_light_from_behind(shot.plate.as_deref(), area, |object, x, y| {
        changes.get(&object)?.at(x, y)
    })
}

/// From where the first of some ranges begins to where the last ends; empty without any.
fn span<'a>(ranges: impl Iterator<Item = &'a Range<usize>>) -> Range<usize> {
    let all = ranges
        .cloned()
        .reduce(|a, b| a.start.min(b.start)..a.end.max(b.end));
    all.unwrap_or_default()
}

/// The pixels with a sample of a card, and the depth of the nearest.
struct CardPlace {
    block: PixelBlock,
    nearest: f32,
}

/// Where cards are in the picture; cards outside it have no place.
fn places_of(deep: &DeepImage, cards: &[BendingCard<'_>]) -> BTreeMap<ObjectId, CardPlace> {
    let mut places = BTreeMap::new();
    for y in 0..deep.height() {
        for x in 0..deep.width() {
            for sample in deep.at(x, y) {
                if cards.iter().any(|card| card.id == sample.object) {
                    include(&mut places, sample, [x, y]);
                }
            }
        }
    }
    places
}

fn include(places: &mut BTreeMap<ObjectId, CardPlace>, sample: &DeepSample, [x, y]: [usize; 2]) {
    let place = places.entry(sample.object).or_insert_with(|| CardPlace {
        block: PixelBlock {
            x: x..x + 1,
            y: y..y + 1,
        },
        nearest: sample.depth.0,
    });
    let block = &mut place.block;
    block.x = block.x.start.min(x)..block.x.end.max(x + 1);
    block.y = block.y.start.min(y)..block.y.end.max(y + 1);
    place.nearest = place.nearest.min(sample.depth.0);
}

/// A refracting card and its visible side.
struct BendingCard<'a> {
    id: ObjectId,
    plane: ScenePlane,
    projected: ProjectedPlane,
    flow: &'a Flow,
    /// Whether the side is a back with a flow of its own, which is mirrored.
    mirrored: bool,
    cylinder: Option<Cylinder>,
    /// The eye in the frame of the card.
    eye: Point3<f64>,
    /// How much larger the object is than it was on the display.
    scale: f64,
    /// From the middle of the body to what it rests on.
    resting_height: f64,
}

/// The refracting cards of a shot, the farthest first.
fn bending_cards(shot: &Shot) -> Vec<BendingCard<'_>> {
    if shot.cards.iter().all(|card| card.refraction.is_none()) {
        return Vec::new();
    }
    let view = CameraView::from_camera(&shot.camera);
    let planes = visible_planes(shot).into_iter();
    let mut cards: Vec<_> = planes
        .filter_map(|(card, plane)| BendingCard::new(card, plane, &view))
        .collect();
    let along_axis = view.ray * Vector3::from(shot.camera.principal_px.to_homogeneous());
    cards.sort_by(|a, b| {
        let [a, b] = [a, b].map(|card| along_axis.dot(&(card.plane.center - view.eye)));
        b.total_cmp(&a)
    });
    cards
}

impl<'a> BendingCard<'a> {
    fn new(card: &'a Card, plane: ScenePlane, view: &CameraView) -> Option<Self> {
        let mirrored = card.back.is_some() && plane.is_seen_from_behind(&view.eye);
        let flow = card.refraction.flows[usize::from(mirrored)].as_deref()?;
        (!flow.is_empty()).then_some(Self {
            id: card.id,
            projected: ProjectedPlane::new(&plane, view)?,
            plane,
            flow,
            mirrored,
            cylinder: card.cylinder_seen_from(&view.eye.into()),
            eye: card
                .quad
                .world_from_card
                .inverse_transform_point(&view.eye.into()),
            scale: card.quad.size[0] / flow.width,
            resting_height: 0.5 * card.refraction.thickness,
        })
    }

    /// The light path at a picture position, at the object's own height; along the card and down
    /// it, metres.
    fn path(&self, p: &Vector3<f64>) -> Option<LightPath> {
        let w = self.projected.w.dot(p);
        let [u, v] = self.on_card([self.projected.u.dot(p) / w, self.projected.v.dot(p) / w]);
        let turned = if self.mirrored { 1.0 - u } else { u };
        let path = self.flow.at([turned, v])?.scaled(self.scale as f32);
        let along = |[right, down]: [f32; 2]| [if self.mirrored { -right } else { right }, down];
        Some(LightPath {
            displacement: along(path.displacement),
            scatter_displacement: along(path.scatter_displacement),
            ..path
        })
    }

    /// Texture coordinates of the point of a curved card that is seen at a point of the flat one.
    fn on_card(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let Some(cylinder) = &self.cylinder else {
            return [u, v];
        };
        let [w, h] = self.plane.size;
        let flat = Point2::new((u - 0.5) * w, (0.5 - v) * h);
        let seen = cylinder.seen_point(&self.eye, &flat);
        [seen.x / w + 0.5, 0.5 - seen.y / h]
    }

    /// Factor on displacements at a point, relative to the display.
    fn growth_at(&self, point: &Vector3<f64>) -> f64 {
        let distance = self.plane.normal.dot(&(point - self.plane.center)).abs();
        self.growth((distance - self.resting_height).max(0.0))
    }

    /// The vector of a displacement along the card and down it.
    fn along(&self, displacement: [f32; 2]) -> Vector3<f64> {
        let [along, down] = displacement.map(f64::from);
        self.plane.x * along - self.plane.y * down
    }

    /// Factor on displacements for this clearance, relative to the display.
    fn growth(&self, clearance: f64) -> f64 {
        1.0 + clearance / (self.flow.height * self.scale)
    }

    /// The pixels in which its lines of sight may end.
    fn reached(&self, place: &CardPlace, view: &CameraView) -> PixelBlock {
        let paths = self.flow.paths.pixels().iter();
        let longest = paths.fold(0.0_f64, |most, path| most.max(path.reach().into()));
        let highest = self.plane.corners().map(|corner| corner.z.abs());
        let height = highest.into_iter().fold(0.0, f64::max);
        let px_per_metre = view.px_per_metre(place.nearest.into());
        let reach = longest * self.scale * self.growth(2.0 * height) * px_per_metre;
        place.block.grown(reach + READING_MARGIN_PX, view)
    }
}

impl CameraView {
    /// Pixels per metre across the view at a depth.
    fn px_per_metre(&self, depth: f64) -> f64 {
        let focal_px = 1.0 / self.ray.column(0).norm();
        focal_px / depth
    }
}

impl PixelBlock {
    fn grown(&self, by: f64, view: &CameraView) -> Self {
        let by = by.min(1e6).ceil() as usize;
        Self {
            x: self.x.start.saturating_sub(by)..(self.x.end + by).min(view.width),
            y: self.y.start.saturating_sub(by)..(self.y.end + by).min(view.height),
        }
    }
}

/// What is behind a card: what is visible in a block, and its depth.
struct Backdrop {
    block: PixelBlock,
    seen: Pyramid<SeenBehind>,
    deep: DeepImage,
}

impl Backdrop {
    fn new(deep: DeepImage, block: &PixelBlock, shot: &Shot) -> Self {
        let plate = shot.plate.as_deref();
        let seen = Image::from_fn(block.x.len(), block.y.len(), |x, y| {
            let (x, y) = (x + block.x.start, y + block.y.start);
            let displaced = |plate| deep.displaced_plate_at(x, y, plate);
            SeenBehind {
                light: deep.light_over(x, y, plate),
                plate: plate.map_or(LinearRgb::BLACK, displaced),
            }
        });
        Self {
            block: block.clone(),
            seen: Pyramid::new(seen),
            deep,
        }
    }

    /// At a picture position, also between pixels.
    fn sharp_at(&self, at: Point2<f64>) -> SeenBehind {
        let [x, y] = self.in_block(at);
        let SeenBehind { light, plate } = sample_cubic_clamped(self.seen.base(), x, y);
        SeenBehind {
            light: light.map(|v| v.max(0.0)),
            plate: plate.map(|v| v.max(0.0)),
        }
    }

    /// Mean around a picture position.
    fn blurred_at(&self, at: Point2<f64>, sigma_px: f64) -> SeenBehind {
        let [x, y] = self.in_block(at);
        sample_blurred(&self.seen, x, y, sigma_px)
    }

    fn in_block(&self, at: Point2<f64>) -> [f64; 2] {
        [
            at.x - self.block.x.start as f64,
            at.y - self.block.y.start as f64,
        ]
    }

    fn pixel(&self, x: usize, y: usize) -> SeenBehind {
        self.seen.base()[(x - self.block.x.start, y - self.block.y.start)]
    }

    /// Mean depth at a pixel, weighted by visibility; `surface` is that of the surface.
    fn depth(&self, x: usize, y: usize, surface: f64) -> Option<f64> {
        let samples = self.deep.at(x, y);
        let hidden: f64 = samples.iter().map(|s| f64::from(s.visible)).sum();
        let near = samples
            .iter()
            .map(|s| f64::from(s.visible) * f64::from(s.depth.0));
        let rest = if surface < HORIZON_M {
            (1.0 - hidden).max(0.0)
        } else {
            0.0
        };
        let total = hidden + rest;
        (total > 0.0).then(|| (near.sum::<f64>() + rest * surface.min(HORIZON_M)) / total)
    }
}

/// Where a line of sight through a card ends straight on.
struct Ending<'a> {
    card: &'a BendingCard<'a>,
    point: Vector3<f64>,
    depth: f64,
    /// Factor on displacements, relative to the display.
    growth: f64,
}

impl Ending<'_> {
    /// Where it ends with a displacement.
    fn at(&self, displacement: [f32; 2]) -> Vector3<f64> {
        self.point + self.card.along(displacement) * self.growth
    }
}

/// The lines of sight of a picture.
struct Sight<'a> {
    view: CameraView,
    lens: RadialDistortion,
    surface: Option<ProjectedPlane>,
    offsets: &'a [f64],
}

impl<'a> Sight<'a> {
    fn new(shot: &Shot, offsets: &'a [f64]) -> Self {
        let view = CameraView::from_camera(&shot.camera);
        let surface = ScenePlane::shadow_catcher([f64::INFINITY; 2]);
        Self {
            surface: ProjectedPlane::from_above(&surface, &view),
            lens: shot.distortion(),
            view,
            offsets,
        }
    }

    /// What a card changes in the pixels with a sample of it.
    fn change(
        &self,
        card: &BendingCard<'_>,
        place: &CardPlace,
        backdrop: &Backdrop,
        deep: &DeepImage,
    ) -> Change {
        let block = place.block.clone();
        let columns = block.x.len();
        let pixels = (0..block.len()).into_par_iter().with_min_len(columns);
        let pixels = pixels.map(|i| {
            let (x, y) = (block.x.start + i % columns, block.y.start + i / columns);
            if deep.at(x, y).iter().any(|s| s.object == card.id) {
                self.change_at(card, backdrop, [x, y])
            } else {
                SeenBehind::default()
            }
        });
        let pixels: Vec<_> = pixels.collect();
        work::add(Kind::BentPixels, pixels.len() as u64);
        Change { block, pixels }
    }

    /// The mean over the sub-samples of a pixel, each at the place to which its own line of sight
    /// leads from the pixel's middle, so that unrefracted light stays sharp.
    fn change_at(&self, card: &BendingCard<'_>, backdrop: &Backdrop, at: [usize; 2]) -> SeenBehind {
        let [x, y] = at;
        let middle = self.ideal(pixel_center(x, y).xy().into());
        let surface = self.surface.map_or(f64::INFINITY, |s| s.depth_at(&middle));
        let Some(depth) = backdrop.depth(x, y, surface) else {
            return SeenBehind::default();
        };
        let point = self.view.point_at(middle.x, middle.y, depth);
        let ending = Ending {
            card,
            point,
            depth,
            growth: card.growth_at(&point),
        };
        let straight = backdrop.pixel(x, y);
        let weight = 1.0 / (self.offsets.len() * self.offsets.len()) as f32;
        let seen = self
            .sub_samples(at)
            .filter_map(|p| self.seen_along(card.path(&self.ideal(p))?, &ending, backdrop));
        seen.fold(SeenBehind::default(), |sum, seen| {
            sum.add_scaled(weight, seen.add_scaled(-1.0, straight))
        })
    }

    /// What is seen along a path; none if the light comes from behind the eye.
    fn seen_along(
        &self,
        path: LightPath,
        ending: &Ending<'_>,
        backdrop: &Backdrop,
    ) -> Option<SeenBehind> {
        let sharp = backdrop.sharp_at(self.seen_at(&ending.at(path.displacement))?);
        if path.haze <= 0.0 {
            return Some(sharp);
        }
        let middle = self.seen_at(&ending.at(path.scatter_displacement))?;
        let px_per_metre = self.view.px_per_metre(ending.depth);
        let sigma_px = f64::from(path.scatter_width) * ending.growth * px_per_metre;
        let soft = backdrop.blurred_at(middle, sigma_px);
        Some(SeenBehind {
            light: path.mixed(sharp.light, soft.light),
            plate: path.mixed(sharp.plate, soft.plate),
        })
    }

    fn sub_samples(&self, [x, y]: [usize; 2]) -> impl Iterator<Item = Point2<f64>> + '_ {
        let middle = [x, y].map(|i| i as f64 + 0.5);
        let rows = self.offsets.iter();
        rows.flat_map(move |dy| {
            let columns = self.offsets.iter();
            columns.map(move |dx| Point2::new(middle[0] + dx, middle[1] + dy))
        })
    }

    /// Maps a position in the picture to that of a camera without the lens.
    fn ideal(&self, px: Point2<f64>) -> Vector3<f64> {
        self.lens.undistort(px).to_homogeneous()
    }

    /// Where the picture shows a point of the world; none if it is not in front of the eye.
    fn seen_at(&self, point: &Vector3<f64>) -> Option<Point2<f64>> {
        let [px] = self.view.project_points(&[*point])?;
        Some(self.lens.distort(px.xy().into()))
    }
}
