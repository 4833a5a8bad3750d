//! Renders a shot to deep samples, fast.

use crate::asset::Texture;
use crate::deep::DeepImage;
use crate::geom::Vector3;
use crate::image::Image;
use crate::pixel::{LinearRgb, ObjectId};
use crate::render::RenderOptions;
use crate::render::block::PixelBlock;
use crate::render::detail::{detail_level, texels_per_pixel};
use crate::render::interreflection::Bounces;
use crate::render::irradiance::{IrradianceMap, irradiance_maps};
use crate::render::lattice::Lattice;
use crate::render::layers::{
    Layer, LayerStack, RenderedTile, SampleGrid, ShadowCatcher, TileSamples,
};
use crate::render::lens::LensView;
use crate::render::pixel_filter::filter_quantiles;
use crate::render::receiver::{LightingContext, ReceiverIrradiance, VisibleSide};
use crate::render::refraction::refract;
use crate::render::retouch::retouched;
use crate::render::texture::{BakedTexture, TexelContent};
use crate::render::view::{
    CameraView, ProjectedPlane, ScenePlane, rows_and_columns, visible_planes,
};
use crate::scene::{Card, Shot};
use crate::stopwatch::Stopwatch;
use crate::work::{self, Kind};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Side of the tiles that make up the picture.
const TILE_SIDE_PX: usize = 32;

/// Renders a shot: per pixel and card, its light and its coverage; per pixel, the shadow factor of
/// the plate.
///
/// Same bits for any number of threads and any order of the cards. Never fails: invisible cards are
/// left out, and numbers in `options` are clamped to the supported range. Use `check` for shots
/// from external sources.
///
/// # Method
/// Everything is planar, so each map between two planes seen from a point is a homography.
/// Irradiance is smooth: it is computed once per receiver on a lattice in the picture, as a sum
/// over Gauss nodes of the lights and fixed directions of the environment, each attenuated by the
/// product of `1 - alpha` of the cards in between. Textures are sharp: they are sampled at the
/// quantiles of the pixel filter, from the mip level whose own blur makes up for the rest of the
/// filter. Cards are sorted by depth per block; blocks in which they cross are split.
pub fn render(shot: &Shot, options: &RenderOptions) -> DeepImage {
    render_unhidden(shot, options).held_out(shot.holdout.as_deref())
}

/// The same before the holdout hides anything.
pub(crate) fn render_unhidden(shot: &Shot, options: &RenderOptions) -> DeepImage {
    let options = options.clamped().for_image(shot.camera.image);
    let mut watch = Stopwatch::start();
    let finished = &*retouched(shot, &options);
    watch.lap("retouch");
    let bounces = Bounces::new(finished);
    let stack = SeenStack::new(finished, &options, &mut watch);
    let layers = stack.render(|_| true);
    watch.lap("layers");
    let free = bounces.brighten(layers);
    watch.lap("interreflection");
    let bent = if options.refraction {
        let offsets = &stack.stack.samples.offsets;
        refract(free, shot, offsets, |card, reached| {
            bounces.brighten(stack.behind(card).render(|tile| tile.meets(reached)))
        })
    } else {
        free
    };
    watch.lap("refraction");
    watch.log("render");
    bent
}

/// The pixels up to `margin` beyond the picture's border: a deep picture with that many more on
/// every side, whose middle may be incomplete. Cards do not refract in it.
pub(crate) fn render_beyond(shot: &Shot, margin: usize, options: &RenderOptions) -> DeepImage {
    let options = options.clamped().for_image(shot.camera.image);
    let wide = Shot {
        camera: shot.camera.widened(margin as u32),
        ..shot.clone()
    };
    let finished = retouched(&wide, &options);
    let bounces = Bounces::new(&finished);
    let stack = SeenStack::new(&finished, &options, &mut Stopwatch::start());
    let [x, y] = stack.image.map(|side| margin..side - margin);
    let picture = PixelBlock { x, y };
    bounces.brighten(stack.render(|tile| !tile.is_within(&picture)))
}

/// Everything that makes up a picture, seen through the shot's lens.
struct SeenStack {
    stack: LayerStack,
    /// None for a pinhole.
    lens: Option<(LensView, Lattice)>,
    /// Width and height, pixels.
    image: [usize; 2],
}

impl SeenStack {
    fn new(shot: &Shot, options: &RenderOptions, watch: &mut Stopwatch) -> Self {
        let lens = LensView::new(shot);
        let camera = lens.as_ref().map_or(&shot.camera, |lens| &lens.pinhole);
        let view = CameraView::from_camera(camera);
        Self {
            stack: layer_stack(shot, &view, options, watch),
            lens: lens.map(|lens| (lens, Lattice::new(&view, options.cell_px))),
            image: shot.camera.image.map(|side| side as usize),
        }
    }

    /// The stack behind a card.
    fn behind(&self, card: ObjectId) -> Self {
        Self {
            stack: self.stack.behind(card),
            ..*self
        }
    }

    /// Renders the picture in the wanted tiles; the others stay empty.
    fn render(&self, wanted: impl Fn(&PixelBlock) -> bool + Sync) -> DeepImage {
        let [width, height] = self.image;
        let side = self.lens.map_or(TILE_SIDE_PX, |(lens, _)| lens.tile_side());
        let rendered: Vec<_> = PixelBlock::tiles_of(width, height, side)
            .into_par_iter()
            .map_init(TileSamples::default, |scratch, tile| {
                if wanted(&tile) {
                    self.render_tile(tile, scratch)
                } else {
                    RenderedTile::new(&tile, false)
                }
            })
            .collect();
        assemble_tiles([width, height], side, rendered)
    }

    fn render_tile(&self, tile: PixelBlock, scratch: &mut TileSamples) -> RenderedTile {
        match &self.lens {
            None => self.stack.render_tile(tile, scratch),
            Some((lens, lattice)) => lens
                .stack_in(&self.stack, *lattice, &tile)
                .render_tile(tile, scratch),
        }
    }
}

/// Everything that tiles are rendered from: textures at their level of detail, and the light on
/// them.
fn layer_stack(
    shot: &Shot,
    view: &CameraView,
    options: &RenderOptions,
    watch: &mut Stopwatch,
) -> LayerStack {
    let offsets = filter_quantiles(options.subsamples);
    let planes = visible_planes(shot);
    let context = LightingContext::new(shot, &planes, view, *options);
    let content = TexelContent::needed(context.occluders.tinted, is_lit(shot));
    let cards: Vec<_> = planes
        .par_iter()
        .map(|(card, plane)| ProjectedCard::new(card, plane, view, &offsets, content))
        .collect();
    watch.lap("bake");
    let receivers = receivers(&context, &cards);
    watch.lap("shadows");
    let mut maps = irradiance_maps(&receivers);
    watch.lap("irradiance");
    let catcher = ShadowCatcher {
        plane: ProjectedPlane::new(&context.occluders.surface, view),
        share: maps.pop().flatten().map(Arc::new),
    };
    LayerStack {
        layers: lit_layers(cards, &receivers, maps),
        catcher,
        samples: sample_grid(view, &context.fine, offsets, options),
        exposure: shot.exposure,
        content,
    }
}

/// Whether any light shines.
fn is_lit(shot: &Shot) -> bool {
    !shot.lights.is_empty() || !shot.ambient.is_black() || shot.environment.is_some()
}

/// Renders without light: coverage and depth only.
///
/// Sufficient for labels, at a fraction of the cost; the same bits as those of [`render`].
pub fn render_coverage(shot: &Shot, options: &RenderOptions) -> DeepImage {
    let straight = |card: &Card| Card {
        refraction: Default::default(),
        ..card.clone()
    };
    let dark = Shot {
        cards: shot.cards.iter().map(straight).collect(),
        lights: Vec::new(),
        ambient: LinearRgb::BLACK,
        environment: None,
        interreflection: LinearRgb::BLACK,
        plate: None,
        ..shot.clone()
    };
    render(&dark, options)
}

/// The cards as receivers of light, then the surface; none for those that are not visible.
fn receivers(
    context: &LightingContext<'_>,
    cards: &[Option<ProjectedCard<'_>>],
) -> Vec<Option<ReceiverIrradiance>> {
    (0..=cards.len())
        .into_par_iter()
        .map(|k| match cards.get(k) {
            Some(card) => context.card(k, &card.as_ref()?.visible_side()),
            None => context.surface(),
        })
        .collect()
}

/// The layers of the visible cards that have a receiver, each with the light on it.
fn lit_layers(
    cards: Vec<Option<ProjectedCard<'_>>>,
    receivers: &[Option<ReceiverIrradiance>],
    maps: Vec<Option<IrradianceMap>>,
) -> Vec<Layer> {
    cards
        .into_iter()
        .zip(receivers.iter().zip(maps))
        .filter_map(|(card, (receiver, light))| {
            let card = receiver.as_ref().and(card)?;
            Some(card.into_layer(light))
        })
        .collect()
}

/// Where light is looked up: per pixel, or per sub-sample if nodes are closer together than pixels.
fn sample_grid(
    view: &CameraView,
    lattice: &Lattice,
    offsets: Vec<f64>,
    options: &RenderOptions,
) -> SampleGrid {
    let per_subsample = options.cell_px < 1.0;
    let looked_up: &[f64] = if per_subsample { &offsets } else { &[0.0] };
    SampleGrid {
        columns: lattice.positions_of(view.width, looked_up),
        rows: lattice.positions_of(view.height, looked_up),
        per_subsample,
        offsets,
        bent: None,
    }
}

/// A card in the picture, before it is lit.
struct ProjectedCard<'a> {
    card: &'a Card,
    plane: ProjectedPlane,
    texture: BakedTexture,
    /// Whether its texture is mirrored.
    mirrored: bool,
    columns: Range<usize>,
    rows: Range<usize>,
}

impl<'a> ProjectedCard<'a> {
    /// None for a card that is edge-on, behind the eye or outside the picture; `offsets` are the
    /// sub-samples along each side of a pixel.
    fn new(
        card: &'a Card,
        plane: &ScenePlane,
        view: &CameraView,
        offsets: &[f64],
        content: TexelContent,
    ) -> Option<Self> {
        let projected = ProjectedPlane::new(plane, view)?;
        let (rows, columns) = rows_and_columns(plane, [0.0; 2], view);
        let is_behind = !view.has_in_front(&plane.corners());
        if is_behind || rows.is_empty() || columns.is_empty() {
            return None;
        }
        work::add(Kind::Bakes, 1);
        let (texture, mirrored) = visible_texture(card, plane, &view.eye);
        let projected = projected.mirrored_if(mirrored);
        let texels = texels_per_pixel(texture, plane, &projected, view, &plane.center);
        let level = detail_level(texels, offsets);
        let texture = BakedTexture::new(texture, &card.grade, level, content);
        let (rows, columns) = rows_and_columns(plane, texture.grid.reach, view);
        Some(Self {
            card,
            plane: projected,
            texture,
            mirrored,
            columns,
            rows,
        })
    }

    fn visible_side(&self) -> VisibleSide<'_> {
        VisibleSide {
            texture: &self.texture,
            mirrored: self.mirrored,
        }
    }

    fn into_layer(self, light: Option<IrradianceMap>) -> Layer {
        let area = (self.rows, self.columns);
        let texture = Arc::new(self.texture);
        Layer::new(
            self.card.id,
            (self.plane, texture),
            light.map(Arc::new),
            area,
        )
    }
}

/// The side of a card that faces the camera, and whether its texture is mirrored.
fn visible_texture<'a>(
    card: &'a Card,
    plane: &ScenePlane,
    eye: &Vector3<f64>,
) -> (&'a Texture, bool) {
    match &card.back {
        Some(back) if plane.is_seen_from_behind(eye) => (back, true),
        _ => (&card.texture, false),
    }
}

/// Assembles tiles into one picture; the factor on the plate is 1 where no tile has one.
fn assemble_tiles([width, height]: [usize; 2], side: usize, tiles: Vec<RenderedTile>) -> DeepImage {
    let mut shadow = Image::filled(width, height, LinearRgb::WHITE);
    for tile in &tiles {
        if let Some(values) = &tile.shadow {
            copy_block(&tile.block, values, &mut shadow);
        }
    }
    let samples = tiles.into_iter().map(|tile| tile.samples).collect();
    DeepImage::from_tiles(shadow, side, samples)
}

/// Copies a block's values, row by row, to its place in a picture.
fn copy_block(block: &PixelBlock, values: &[LinearRgb], picture: &mut Image<LinearRgb>) {
    let rows = values.chunks_exact(block.x.len());
    for (y, row) in block.y.clone().zip(rows) {
        picture.row_mut(y)[block.x.clone()].copy_from_slice(row);
    }
}
