//! Which cards stand between a receiver and a light, and how much they let through.

use crate::asset::Texture;
use crate::geom::Vector3;
use crate::render::half_plane::{meet, sides, span, whole};
use crate::render::light_samples::{LightGroup, LightSample, SampleKind};
use crate::render::texture::OpacityLevel;
use crate::render::view::{CameraView, ProjectedPlane, ScenePlane, texture_rows};
use crate::scene::{Card, Grade};
use crate::work::{self, Kind};
use std::ops::Range;
use std::sync::{Arc, OnceLock};

/// Heights and distances below this (metres) are contact.
const CONTACT_EPSILON_M: f64 = 1e-9;

/// How much of the smear by a piece of light is given to a card's shadow.
///
/// All of it would be right for one card. Piles are darkened by it, since a product of blurred shadows is not the blurred
/// product (bias -0.003 in a pile of 20); a quarter takes the facets out of soft shadows and biases by 1e-4.
const PENUMBRA_BLUR_SHARE: f64 = 0.25;

/// A card as something that stops light.
#[derive(Debug)]
pub(super) struct Occluder<'a> {
    /// Where it lies.
    pub(super) sheet: ScenePlane,
    front: Arc<OpacityMips<'a>>,
    /// None where it is the front seen through.
    back: Option<Arc<OpacityMips<'a>>>,
}

/// A texture's opacity at each halving, made when first asked for; shared by the cards that show it.
#[derive(Debug)]
struct OpacityMips<'a> {
    texture: &'a Texture,
    grade: Grade,
    levels: Vec<OnceLock<Arc<OpacityLevel>>>,
}

/// Everything that stops light: cards, and the surface for what comes from below.
#[derive(Debug)]
pub(super) struct Occluders<'a> {
    /// In the order of the cards.
    pub(super) cards: Vec<Occluder<'a>>,
    /// The plane `z = 0` as far as it reaches.
    pub(super) surface: ScenePlane,
    /// Some card is film: what gets through differs from channel to channel.
    pub(super) tinted: bool,
}

/// One source as one receiver sees it.
#[derive(Debug)]
pub(super) struct ShadowRay {
    source: LightSample,
    /// Of the source over the receiver's plane, metres (a cosine for a direction).
    height: f64,
    /// What may be in its way.
    pub(super) blockers: Vec<ProjectedShadow>,
}

/// A caster's shadow on a receiver, in nodes of the lattice.
#[derive(Debug)]
pub(super) struct ProjectedShadow {
    /// Rows that the shadow may touch.
    pub(super) rows: Range<usize>,
    /// Columns that the shadow may touch.
    pub(super) columns: Range<usize>,
    sides: Vec<Vector3<f64>>,
    /// Position among the texels, `u/w` and `v/w`.
    u: Vector3<f64>,
    v: Vector3<f64>,
    w: Vector3<f64>,
    shade: Option<Arc<OpacityLevel>>,
    /// Where nothing gets through an opaque texture, whatever is read of it; none for one that is see-through.
    inside: Option<[Vector3<f64>; 5]>,
}

/// Texels read, bilinearly, to know what gets through.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TexelReads {
    /// Of see-through cards.
    pub(super) see_through: usize,
    /// Of opaque ones, along their edges.
    pub(super) edges: usize,
}

impl std::ops::AddAssign for TexelReads {
    fn add_assign(&mut self, other: Self) {
        self.see_through += other.see_through;
        self.edges += other.edges;
    }
}

/// Rows and columns of the lattice, or pixels of a picture.
pub(super) type LatticeArea = (Range<usize>, Range<usize>);

/// Rows and columns that a sheet is seen in, one more on each side.
pub(super) fn rows_and_columns(
    sheet: &ScenePlane,
    reach: [f64; 2],
    view: &CameraView,
) -> LatticeArea {
    bounds(&sheet.grown(reach).corners(), view)
}

/// Bounds of projected points; the whole view where one of them is not in front.
fn bounds(points: &[Vector3<f64>; 4], view: &CameraView) -> LatticeArea {
    let Some(px) = view.project(points) else {
        return (0..view.height, 0..view.width);
    };
    let range = |axis: usize, count: usize| {
        let low = px.iter().map(|p| p[axis]).fold(f64::INFINITY, f64::min);
        let high = px.iter().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max);
        whole(low - 2.0, high + 2.0, &(0..count))
    };
    (range(1, view.height), range(0, view.width))
}

impl<'a> Occluders<'a> {
    /// What stops light in a shot.
    pub(super) fn new(cards: &[(&'a Card, ScenePlane)], surface: ScenePlane) -> Self {
        let mut known: Vec<Arc<OpacityMips<'a>>> = Vec::new();
        let mut shades = |texture: &'a Texture, grade: &Grade| {
            if let Some(same) = known.iter().find(|shades| shades.are_of(texture, grade)) {
                return same.clone();
            }
            known.push(Arc::new(OpacityMips::new(texture, *grade)));
            known[known.len() - 1].clone()
        };
        let caster = |&(card, sheet): &(&'a Card, ScenePlane)| Occluder {
            sheet,
            front: shades(&card.texture, &card.grade),
            back: card.back.as_ref().map(|back| shades(back, &card.grade)),
        };
        let cards: Vec<_> = cards.iter().map(caster).collect();
        let tinted = known.iter().any(|shades| shades.texture.is_film());
        Self {
            cards,
            surface,
            tinted,
        }
    }

    /// The beams of a lamp that reach a receiver from above, with what may be in their way.
    ///
    /// `own` is the receiver's place among the cards; none for the surface. `area` is where it is asked for, `cell` the
    /// distance of nodes on it, metres.
    pub(super) fn beams(
        &self,
        (seen, area): (&ProjectedPlane, &LatticeArea),
        view: &CameraView,
        lamp: &LightGroup,
        own: Option<usize>,
        cell: f64,
    ) -> Vec<ShadowRay> {
        let plane = seen.normal.dot(&view.eye) - seen.height;
        let above = |k: usize| {
            self.cards[k]
                .sheet
                .corners()
                .iter()
                .any(|c| seen.normal.dot(c) - plane > CONTACT_EPSILON_M)
        };
        let above: Vec<_> = (0..self.cards.len())
            .filter(|&k| Some(k) != own && above(k))
            .collect();
        let beam = |source: &LightSample| {
            let height = source.at.xyz().dot(&seen.normal) - source.at.w * plane;
            let shadow = ShadowProjection {
                seen,
                area,
                view,
                plane,
                height,
                source,
                cell,
            };
            let from_below = own.is_some() && source.at.w == 0.0 && source.at.z < 0.0;
            let surface = from_below.then(|| shadow.of_surface(&self.surface));
            let cards = above.iter().filter_map(|&k| shadow.of_card(&self.cards[k]));
            (height > CONTACT_EPSILON_M).then(|| ShadowRay {
                source: *source,
                height,
                blockers: surface.into_iter().chain(cards).collect(),
            })
        };
        lamp.sources.iter().filter_map(beam).collect()
    }
}

impl<'a> OpacityMips<'a> {
    fn new(texture: &'a Texture, grade: Grade) -> Self {
        Self {
            texture,
            grade,
            levels: (0..texture.levels()).map(|_| OnceLock::new()).collect(),
        }
    }

    /// Colours do not matter to the alpha of a cut-out.
    fn are_of(&self, texture: &Texture, grade: &Grade) -> bool {
        match (self.texture, texture) {
            (Texture::Rgba(a), Texture::Rgba(b)) => Arc::ptr_eq(a, b),
            (Texture::Film(a), Texture::Film(b)) => Arc::ptr_eq(a, b) && self.grade == *grade,
            _ => false,
        }
    }

    /// The coarsest opacity whose texels are no larger than `cell` metres, or a coarser one that blurs by `blur` metres;
    /// on a card of this size.
    fn at(&self, size: [f64; 2], cell: f64, blur: f64) -> Arc<OpacityLevel> {
        let (width, height) = self.texture.size();
        let texel = (size[0] * size[1] / (width * height) as f64).sqrt();
        let level = libm::log2((cell / texel).max(1.0))
            .floor()
            .max(libm::log2((blur / texel).max(1.0)).round());
        let level = (level as usize).min(self.levels.len() - 1);
        if let Some(shade) = self.levels[level].get() {
            return shade.clone();
        }
        // Made outside of the lock: a pyramid may halve in parallel, and whoever waits may come back here.
        let shade = Arc::new(OpacityLevel::new(self.texture, &self.grade, level));
        let keep = || {
            work::add(Kind::Bakes, 1);
            shade
        };
        self.levels[level].get_or_init(keep).clone()
    }
}

/// One receiver and one source.
struct ShadowProjection<'a> {
    seen: &'a ProjectedPlane,
    /// Where the receiver is asked for.
    area: &'a LatticeArea,
    view: &'a CameraView,
    /// Offset of the receiver's plane along its normal.
    plane: f64,
    /// Of the source over that plane.
    height: f64,
    source: &'a LightSample,
    cell: f64,
}

impl ShadowProjection<'_> {
    /// The homography from the lattice over the receiver, through the source, to a card's texels.
    fn of_card(&self, caster: &Occluder<'_>) -> Option<ProjectedShadow> {
        let sheet = &caster.sheet;
        let (at, q) = (self.source.at.xyz(), self.source.at.w);
        let toward = sheet.normal.dot(&at) - q * sheet.normal.dot(&sheet.center);
        if toward.abs() <= CONTACT_EPSILON_M {
            return None;
        }
        // A receiver sees the side that is turned away from the source.
        let (shades, turned) = match &caster.back {
            Some(back) if toward > 0.0 => (back, true),
            _ => (&caster.front, false),
        };
        let shade = shades.at(sheet.size, self.cell, self.blur(sheet));
        let (rows, columns) = self.bounds(&sheet.grown(shade.grid.reach));
        let missed = !meet(&rows, &self.area.0) || !meet(&columns, &self.area.1);
        if missed || rows.len() < 2 || columns.len() < 2 {
            return None;
        }
        let normal = sheet.normal * toward.signum();
        // With p = (i, j, 1) the receiver's point is point p / depth; all of the following are rows times depth.
        let (point, depth) = (&self.seen.point, &self.seen.w);
        let below = depth * normal.dot(&sheet.center) - point.transpose() * normal;
        let w = depth * normal.dot(&at) - point.transpose() * normal * q;
        let hit = point * toward.abs() + at * below.transpose();
        let [u, v] = texture_rows(sheet, &hit, &w);
        let u = if turned { w - u } else { u };
        let mut sides = sides(&u, &v, &w, shade.grid.reach).to_vec();
        // Below the card, seen from the source; w is positive there.
        sides[4] = below;
        sides.push(*depth);
        let inside = shade
            .inset()
            .map(|inset| self::sides(&u, &v, &w, inset.map(|by| -by)));
        let [u, v] = shade.grid.rows(&u, &v, &w);
        Some(ProjectedShadow {
            rows,
            columns,
            sides,
            u,
            v,
            w,
            shade: Some(shade),
            inside,
        })
    }

    /// How far the piece of light that a source stands for smears a card's shadow, metres on the card, as the side of a
    /// texel whose bilinear reading has the same variance.
    ///
    /// A square of side b has variance `b^2 / 12`, texels of side t read bilinearly have `t^2 / 4`.
    fn blur(&self, sheet: &ScenePlane) -> f64 {
        let height = |p: &Vector3<f64>| (self.seen.normal.dot(p) - self.plane).max(0.0);
        let lowest = sheet
            .corners()
            .iter()
            .map(height)
            .fold(f64::INFINITY, f64::min);
        // Cards that lean on the receiver are sharp where they touch it and blurred at the other end.
        let way = 0.5 * (lowest + height(&sheet.center)) / self.height;
        PENUMBRA_BLUR_SHARE * self.source.width * way * libm::sqrt(4.0 / 12.0)
    }

    /// The surface stops what comes from below it.
    fn of_surface(&self, sheet: &ScenePlane) -> ProjectedShadow {
        let (point, depth) = (&self.seen.point, &self.seen.w);
        let direction = self.source.at.xyz();
        let height = point.transpose() * Vector3::z() / -direction.z;
        let foot = point + direction * height.transpose();
        let mut sides = vec![*depth];
        for (axis, size) in [(0, sheet.size[0]), (1, sheet.size[1])] {
            if size.is_finite() {
                let row = foot.row(axis).transpose();
                sides.extend([depth * (0.5 * size) - row, depth * (0.5 * size) + row]);
            }
        }
        let zero = Vector3::zeros();
        ProjectedShadow {
            rows: 0..self.view.height,
            columns: 0..self.view.width,
            sides,
            u: zero,
            v: zero,
            w: zero,
            shade: None,
            inside: None,
        }
    }

    /// Part of the lattice that a shadow lies in: bounds of the four corners thrown onto the receiver.
    fn bounds(&self, sheet: &ScenePlane) -> LatticeArea {
        let everything = (0..self.view.height, 0..self.view.width);
        let mut thrown = sheet.corners();
        for corner in &mut thrown {
            let h = self.seen.normal.dot(corner) - self.plane;
            let fall = self.height - self.source.at.w * h;
            // A corner beside or above the light throws its shadow away from the receiver, the others without end.
            if fall <= 1e-6 * self.height {
                return everything;
            }
            *corner = (*corner * self.height - self.source.at.xyz() * h) / fall;
        }
        bounds(&thrown, self.view)
    }
}

impl ProjectedShadow {
    /// Nodes of a row that the shadow touches.
    pub(super) fn nodes(&self, j: usize, within: &Range<usize>) -> Range<usize> {
        if !self.rows.contains(&j) {
            return within.start..within.start;
        }
        let (low, high) = span(&self.sides, j as f64);
        whole(low, high, within)
    }

    /// Multiplies what gets through to these nodes of a row, in one channel; tells what had to be read for it.
    pub(super) fn darken(
        &self,
        channel: usize,
        j: usize,
        nodes: &Range<usize>,
        through: &mut [f32],
    ) -> TexelReads {
        let Some(shade) = &self.shade else {
            through.fill(0.0);
            return TexelReads::default();
        };
        let first = Vector3::new(nodes.start as f64, j as f64, 1.0);
        let line = [self.u, self.v, self.w].map(|row| (row.dot(&first) as f32, row.x as f32));
        let Some(inside) = &self.inside else {
            shade.darken(channel, &line, 0, through);
            return TexelReads {
                see_through: nodes.len(),
                edges: 0,
            };
        };
        let (low, high) = span(inside, j as f64);
        let dark = whole(low, high, nodes);
        let dark = dark.start - nodes.start..dark.end - nodes.start;
        through[dark.clone()].fill(0.0);
        shade.darken(channel, &line, 0, &mut through[..dark.start]);
        shade.darken(channel, &line, dark.end, &mut through[dark.end..]);
        TexelReads {
            see_through: 0,
            edges: nodes.len() - dark.len(),
        }
    }
}

/// Irradiance by unit radiance of one source, at any point of a plane.
#[derive(Clone, Copy, Debug)]
pub(super) enum UnitIrradiance {
    /// The same everywhere.
    Even(f32),
    /// By a piece of a light's face.
    Face {
        /// Where it is.
        at: [f32; 3],
        /// Unit normal.
        normal: [f32; 3],
        /// Area times height over the plane.
        scale: f32,
    },
}

impl ShadowRay {
    /// It comes from an area light, not from the sky.
    pub(super) fn is_face(&self) -> bool {
        matches!(self.source.kind, SampleKind::Face { .. })
    }

    /// For the receiver it was made for.
    pub(super) fn strength(&self) -> UnitIrradiance {
        match self.source.kind {
            SampleKind::Sky { share } => UnitIrradiance::Even(share as f32),
            // All points of a plane see a light from the same height.
            SampleKind::Face { normal, area } => UnitIrradiance::Face {
                at: self.source.at.xyz().map(|c| c as f32).into(),
                normal: normal.map(|c| c as f32).into(),
                scale: (area * self.height) as f32,
            },
        }
    }
}

impl UnitIrradiance {
    /// Cosines over squared distance times area, at points of the plane.
    pub(super) fn fill(&self, [x, y, z]: [&[f32]; 3], out: &mut [f32]) {
        match *self {
            Self::Even(share) => out.fill(share),
            Self::Face { at, normal, scale } => fill_face(at, normal, scale, [x, y, z], out),
        }
    }
}

#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn fill_face(at: [f32; 3], normal: [f32; 3], scale: f32, [x, y, z]: [&[f32]; 3], out: &mut [f32]) {
    for (((e, &x), &y), &z) in out.iter_mut().zip(x).zip(y).zip(z) {
        let (x, y, z) = (x - at[0], y - at[1], z - at[2]);
        let r2 = x * x + y * y + z * z;
        let face = (normal[0] * x + normal[1] * y + normal[2] * z).max(0.0);
        *e = scale * face / (r2 * r2).max(f32::MIN_POSITIVE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::geom::{Point2, Pose, Quad, UnitQuaternion, Vector2};
    use crate::image::Image;
    use crate::pixel::{LinearRgb, ObjectId, PremulRgba};
    use crate::render::RenderOptions;
    use crate::render::light_samples::LightSamples;
    use crate::render::view::sheets;
    use crate::scene::{AreaLight, LightShape, Shot};

    fn camera() -> Camera {
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 2.6);
        Camera {
            image: [200, 150],
            focal_px: Vector2::new(240.0, 240.0),
            principal_px: Point2::new(100.0, 75.0),
            camera_from_world: Pose::from_parts(Vector3::new(0.0, 0.0, 1.0).into(), down),
        }
    }

    fn light() -> AreaLight {
        AreaLight {
            shape: LightShape::Rectangle,
            position: [0.4, 0.3, 0.8],
            target: [0.0; 3],
            size: [0.3; 2],
            power: 9.0,
            color: LinearRgb::WHITE,
        }
    }

    /// A card of odd size, turned in every way.
    fn shot(tilt: f64) -> Shot {
        let turn = UnitQuaternion::from_euler_angles(tilt, 0.2, 0.7);
        let card = Card {
            id: ObjectId(1),
            class: 0,
            quad: Quad {
                world_from_card: Pose::from_parts(Vector3::new(0.02, 0.0, 0.12).into(), turn),
                size: [0.3, 0.2],
            },
            texture: Image::filled(301, 203, PremulRgba::new(0.5, 0.5, 0.5, 1.0)).into(),
            back: None,
            outline_uv: Arc::new([]),
            grade: Grade::default(),
        };
        Shot::new(camera())
            .with_light(light())
            .with_ambient(LinearRgb::WHITE)
            .with_card(card)
    }

    #[test]
    fn the_inside_of_an_opaque_card_is_as_dark_as_if_it_were_read() {
        for tilt in [0.0, 0.3, 1.2] {
            let shot = shot(tilt);
            let view = CameraView::of(&shot.camera);
            let casters = Occluders::new(&sheets(&shot), ScenePlane::surface(shot.catcher));
            let seen = ProjectedPlane::of(&casters.surface, &view).unwrap();
            let LightSamples { faces, sky } = LightSamples::of(
                &shot,
                &RenderOptions::default(),
                &casters.surface.center,
                &seen.normal,
            );
            let area = (0..view.height, 0..view.width);
            let (mut edges, mut all) = (0, 0);
            // Fine and coarse levels of the texture.
            for (lamp, cell) in faces
                .iter()
                .chain(&sky)
                .flat_map(|lamp| [(lamp, 1e-4), (lamp, 5e-3)])
            {
                let blockers = casters
                    .beams((&seen, &area), &view, lamp, None, cell)
                    .into_iter()
                    .flat_map(|beam| beam.blockers);
                for mut blocker in blockers {
                    for j in blocker.rows.clone() {
                        let nodes = blocker.nodes(j, &(0..view.width));
                        let inside = blocker.inside;
                        let [mut quick, mut read] =
                            [vec![1.0; nodes.len()], vec![1.0; nodes.len()]];
                        edges += blocker.darken(0, j, &nodes, &mut quick).edges;
                        blocker.inside = None;
                        all += blocker.darken(0, j, &nodes, &mut read).see_through;
                        blocker.inside = inside;
                        assert_eq!(quick, read, "tilt {tilt}, row {j}");
                    }
                }
            }
            assert!(all > 10_000 && edges < all / 3, "{edges} of {all} read");
        }
    }

    #[test]
    fn shadows_that_miss_the_receiver_are_left_out() {
        let shot = shot(0.0);
        let view = CameraView::of(&shot.camera);
        let casters = Occluders::new(&sheets(&shot), ScenePlane::surface(shot.catcher));
        let seen = ProjectedPlane::of(&casters.surface, &view).unwrap();
        let lamps = LightSamples::of(
            &shot,
            &RenderOptions::default(),
            &casters.surface.center,
            &seen.normal,
        )
        .faces;
        let blockers = |area: LatticeArea| {
            let beams = casters.beams((&seen, &area), &view, &lamps[0], None, 1e-3);
            beams.iter().map(|beam| beam.blockers.len()).sum::<usize>()
        };
        assert_eq!(blockers((0..2, 0..2)), 0);
        assert!(blockers((0..view.height, 0..view.width)) > 0);
    }
}
