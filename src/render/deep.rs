//! A shot becomes deep samples, fast.

use crate::asset::Texture;
use crate::deep::DeepImage;
use crate::image::Image;
use crate::pixel::LinearRgb;
use crate::render::RenderOptions;
use crate::render::half_plane::sides;
use crate::render::irradiance::{IrradianceMap, maps};
use crate::render::lattice::Lattice;
use crate::render::layers::{
    Layer, LayerStack, PixelBlock, RenderedTile, SampleGrid, ShadowCatcher,
};
use crate::render::pixel_filter::{left_over_sigma, quantiles};
use crate::render::receiver::LightingContext;
use crate::render::shadow::{Occluders, rows_and_columns};
use crate::render::texture::BakedTexture;
use crate::render::view::{CameraView, ProjectedPlane, ScenePlane, sheets};
use crate::scene::{Card, Shot};
use crate::work::{self, Kind};
use rayon::prelude::*;

/// Side of the blocks that the picture is put together from, pixels.
const TILE_SIDE_PX: usize = 32;

/// Sub-samples a side from which on a sharper level of detail pays.
const DENSE_SUBSAMPLES: usize = 4;

/// Renders a shot: per pixel and card, its light and its coverage; per pixel, what shadows leave of the plate.
///
/// Same bits for any number of threads and any order of the cards. Never fails: cards that cannot be seen are not, and
/// numbers in `options` are brought into the range that works. Ask [`check`](super::check) about shots from outside.
///
/// # Method
/// Everything is planar, so each map between two planes seen from a point is a homography. Irradiance is smooth: it is
/// computed once per receiver on a lattice in the picture, as a sum over Gauss nodes of the lights and fixed directions
/// of the environment, each seen through the product of `1 - alpha` of the cards in between. Textures are sharp: they are
/// read at the quantiles of the pixel filter, from the mip level whose own blur makes up for what those leave over. Cards
/// are ordered by depth block by block; blocks in which they cross are split.
pub fn render(shot: &Shot, options: &RenderOptions) -> DeepImage {
    let options = options.clamped();
    let view = CameraView::of(&shot.camera);
    let offsets = quantiles(options.subsamples);
    let cards = sheets(shot);
    let casters = Occluders::new(&cards, ScenePlane::surface(shot.catcher));
    let tinted = casters.tinted;
    let [fine, coarse] = [1.0, 2.0].map(|scale| Lattice::new(&view, scale * options.cell_px));
    let studio = LightingContext {
        fine,
        coarse,
        casters,
        shot,
        options,
    };

    let looks: Vec<_> = cards
        .par_iter()
        .map(|(card, sheet)| ProjectedCard::of(card, sheet, &view, &offsets))
        .collect();
    let receiver = |k: usize| match looks.get(k) {
        Some(look) => studio.card(k, look.as_ref()?.texture.grid.reach),
        None => studio.surface(),
    };
    let receivers: Vec<_> = (0..=cards.len()).into_par_iter().map(receiver).collect();
    let mut lights = maps(&receivers);

    let share = lights.pop().flatten();
    let together = cards.iter().zip(looks).zip(receivers.iter().zip(lights));
    let seen = together.filter_map(|(((card, _), look), (lit, light))| {
        Some((card, lit.as_ref().and(look)?, light))
    });
    let layers = seen
        .map(|(card, look, light)| look.layer(card, light))
        .collect();
    let ground = ShadowCatcher {
        seen: ProjectedPlane::of(&studio.casters.surface, &view),
        share,
    };
    let stack = LayerStack {
        layers,
        ground,
        samples: samples(&view, &fine, offsets, &options),
        exposure: shot.exposure,
        tinted,
    };
    assemble(
        &view,
        &tiles(&view)
            .into_par_iter()
            .map(|tile| stack.paint(tile))
            .collect::<Vec<_>>(),
    )
}

/// The same in the dark: what objects cover and hide, and how far away they are, without any light.
///
/// All that labels are made from, at a part of the price; bit for bit what [`render`] says of it.
pub fn render_coverage(shot: &Shot, options: &RenderOptions) -> DeepImage {
    let dark = Shot {
        lights: Vec::new(),
        ambient: LinearRgb::BLACK,
        environment: None,
        plate: None,
        ..shot.clone()
    };
    render(&dark, options)
}

/// Where light is looked up: for each pixel, or for each sub-sample where nodes are closer than pixels.
fn samples(
    view: &CameraView,
    lattice: &Lattice,
    offsets: Vec<f64>,
    options: &RenderOptions,
) -> SampleGrid {
    let each = options.cell_px < 1.0;
    let places = |pixels: usize| lattice.places(pixels, if each { &offsets } else { &[0.0] });
    SampleGrid {
        columns: places(view.width),
        rows: places(view.height),
        each,
        offsets,
    }
}

/// A card in the picture, before it is lit.
struct ProjectedCard {
    seen: ProjectedPlane,
    texture: BakedTexture,
    columns: std::ops::Range<usize>,
    rows: std::ops::Range<usize>,
}

impl ProjectedCard {
    /// None for a card that is edge-on or outside the picture.
    fn of(card: &Card, sheet: &ScenePlane, view: &CameraView, offsets: &[f64]) -> Option<Self> {
        let seen = ProjectedPlane::of(sheet, view)?;
        let (rows, columns) = rows_and_columns(sheet, [0.0; 2], view);
        if rows.is_empty() || columns.is_empty() {
            return None;
        }
        work::add(Kind::Bakes, 1);
        let (seen, texture) = side(card, sheet, seen, view);
        let texture = BakedTexture::new(
            texture,
            &card.grade,
            level(texture, sheet, &seen, view, offsets),
        );
        let (rows, columns) = rows_and_columns(sheet, texture.grid.reach, view);
        Some(Self {
            seen,
            texture,
            columns,
            rows,
        })
    }

    fn layer(self, card: &Card, light: Option<IrradianceMap>) -> Layer {
        let Self {
            seen,
            texture,
            columns,
            rows,
        } = self;
        let sides = sides(&seen.u, &seen.v, &seen.w, texture.grid.reach);
        Layer {
            id: card.id,
            seen,
            texture,
            light,
            sides,
            columns,
            rows,
        }
    }
}

/// The side of a card that is turned to the eye, and how it lies.
fn side<'a>(
    card: &'a Card,
    sheet: &ScenePlane,
    seen: ProjectedPlane,
    view: &CameraView,
) -> (ProjectedPlane, &'a Texture) {
    let from_behind = sheet.normal.dot(&(view.eye - sheet.center)) < 0.0;
    match &card.back {
        Some(back) if from_behind => (
            ProjectedPlane {
                u: seen.w - seen.u,
                ..seen
            },
            back,
        ),
        _ => (seen, &card.texture),
    }
}

/// Level of detail by matching variance: what sub-samples leave of the pixel's window, the texture's own filter covers.
///
/// A level read bilinearly has variance `4^level / 4` texels.
fn level(
    texture: &Texture,
    sheet: &ScenePlane,
    seen: &ProjectedPlane,
    view: &CameraView,
    offsets: &[f64],
) -> f64 {
    let (width, height) = texture.size();
    let texels = (width * height) as f64;
    let per_pixel =
        seen.cell_metres(view, &sheet.center) * (texels / (sheet.size[0] * sheet.size[1])).sqrt();
    let dense = if offsets.len() >= DENSE_SUBSAMPLES {
        0.25
    } else {
        0.0
    };
    let level = libm::log2(2.0 * left_over_sigma(offsets) * per_pixel) - dense;
    // A NaN from a card that fills the horizon reads the full texture.
    level.clamp(0.0, 32.0).max(0.0)
}

fn tiles(view: &CameraView) -> Vec<PixelBlock> {
    let cuts = |len: usize| {
        (0..len)
            .step_by(TILE_SIDE_PX)
            .map(move |a| a..(a + TILE_SIDE_PX).min(len))
    };
    cuts(view.height)
        .flat_map(|y| cuts(view.width).map(move |x| PixelBlock { x, y: y.clone() }))
        .collect()
}

/// Puts the tiles' pixels in order.
fn assemble(view: &CameraView, painted: &[RenderedTile]) -> DeepImage {
    let mut shadow = Image::filled(view.width, view.height, LinearRgb::WHITE);
    for p in painted {
        let Some(values) = &p.shadow else { continue };
        for (y, line) in p.block.y.clone().zip(values.chunks_exact(p.block.x.len())) {
            shadow.row_mut(y)[p.block.x.clone()].copy_from_slice(line);
        }
    }
    let paintings = || painted.iter().map(|p| &p.painting);
    let samples = paintings().flat_map(|p| &p.samples).copied();
    DeepImage::from_samples(shadow, samples, paintings().flat_map(|p| &p.tints).copied())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Vector3;

    #[test]
    fn tiles_cover_every_pixel_once() {
        let view = CameraView {
            eye: Vector3::zeros(),
            ray: nalgebra::Matrix3::identity(),
            width: 37,
            height: 17,
        };
        let area: usize = tiles(&view).iter().map(|t| t.x.len() * t.y.len()).sum();
        assert_eq!(area, 37 * 17);
    }
}
