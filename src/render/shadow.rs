//! Shadows of cards and of the surface on a receiver: where they are, and their transmittance.

use crate::geom::Vector3;
use crate::render::float4::Float4;
use crate::render::half_plane::{ConvexShape, nodes_inside, quad_sides};
use crate::render::lattice::Lattice;
use crate::render::light_samples::{LightSample, LightSampleKind};
use crate::render::occluders::{Occluder, Occluders};
use crate::render::opacity::OpacityLevel;
use crate::render::texel_grid::{TexelLine, texel_line};
use crate::render::view::{
    CameraView, LatticeArea, ProjectedPlane, ScenePlane, areas_meet, texture_rows,
};
use nalgebra::Matrix3;
use std::ops::Range;
use std::sync::Arc;

/// Heights and distances below this count as contact.
pub(super) const CONTACT_EPSILON_M: f64 = 1e-9;

/// Share of the blur by a piece of the sky that is applied to a card's shadow.
///
/// For a single card, all of it would be right. But pieces are so wide and overlapping shadows so
/// many that it darkens pictures, since a product of blurred shadows is not the blurred product
/// (bias -0.0005); a quarter removes the facets of soft shadows with a bias of 1e-4.
const SKY_BLUR_SHARE: f64 = 0.25;

/// A receiver of shadows.
#[derive(Clone, Copy)]
pub(super) struct ShadowedReceiver<'a> {
    /// Its plane in the lattice.
    pub(super) plane: &'a ProjectedPlane,
    /// The requested part of it.
    pub(super) area: &'a LatticeArea,
    /// The camera, in nodes.
    pub(super) view: &'a CameraView,
    /// Its index among the cards; none for the surface.
    pub(super) own: Option<usize>,
    /// Spacing on it that textures are read for.
    pub(super) cell_m: f64,
}

impl<'a> ShadowedReceiver<'a> {
    /// Card number `own`, or the surface, with the node spacing at `target`.
    pub(super) fn new(
        plane: &'a ProjectedPlane,
        area: &'a LatticeArea,
        lattice: &'a Lattice,
        own: Option<usize>,
        target: &Vector3<f64>,
    ) -> Self {
        Self {
            plane,
            area,
            view: &lattice.view,
            own,
            cell_m: lattice.detail * plane.cell_metres(&lattice.view, target),
        }
    }

    /// Offset of its plane along its normal.
    pub(super) fn plane_offset(&self) -> f64 {
        self.plane.normal.dot(&self.view.eye) - self.plane.height
    }

    /// Indices of the other cards that are at least partly above it.
    pub(super) fn cards_above(&self, occluders: &Occluders<'_>) -> Vec<usize> {
        let (normal, offset) = (&self.plane.normal, self.plane_offset());
        let cards = occluders.cards.iter().enumerate();
        cards
            .filter(|&(k, _)| Some(k) != self.own)
            .filter(|(_, card)| card.is_above(normal, offset, CONTACT_EPSILON_M))
            .map(|(k, _)| k)
            .collect()
    }
}

/// An occluder's shadow on a receiver, in nodes of the lattice.
#[derive(Debug)]
pub(super) struct ProjectedShadow {
    /// Rows that the shadow may touch.
    pub(super) rows: Range<usize>,
    /// Columns that the shadow may touch.
    pub(super) columns: Range<usize>,
    shape: ConvexShape,
    /// Position among the texels, `u/w` and `v/w`.
    u: Vector3<f64>,
    v: Vector3<f64>,
    w: Vector3<f64>,
    opacity: Option<Arc<OpacityLevel>>,
    /// Where an opaque texture is certain to block all light; none for a see-through one.
    pub(super) inside: Option<[Vector3<f64>; 5]>,
}

/// Bilinear texel reads for transmittance.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TexelReads {
    /// Reads of see-through cards.
    pub(super) see_through: usize,
    /// Reads of opaque ones, along their edges.
    pub(super) edges: usize,
}

impl std::ops::AddAssign for TexelReads {
    fn add_assign(&mut self, other: Self) {
        self.see_through += other.see_through;
        self.edges += other.edges;
    }
}

/// One receiver and one light sample.
pub(super) struct ShadowProjection<'a> {
    receiver: &'a ShadowedReceiver<'a>,
    sample: &'a LightSample,
    /// Offset of the receiver's plane along its normal.
    plane_offset: f64,
    /// Height of the sample above that plane, metres (a cosine for a direction).
    pub(super) height: f64,
}

/// The homography from the lattice over a receiver, through a light sample, to a card; all rows
/// times depth.
struct CardMap {
    u: Vector3<f64>,
    v: Vector3<f64>,
    w: Vector3<f64>,
    /// Positive below the card, as seen from the light; `w` is positive there.
    below: Vector3<f64>,
}

impl<'a> ShadowProjection<'a> {
    /// None for a sample that is not above the receiver.
    pub(super) fn new(receiver: &'a ShadowedReceiver<'a>, sample: &'a LightSample) -> Option<Self> {
        let plane_offset = receiver.plane_offset();
        let height = sample.at.xyz().dot(&receiver.plane.normal) - sample.at.w * plane_offset;
        (height > CONTACT_EPSILON_M).then_some(Self {
            receiver,
            sample,
            plane_offset,
            height,
        })
    }

    /// The shadow of a card; none if it misses the receiver.
    pub(super) fn project_card(&self, occluder: &Occluder<'_>) -> Option<ProjectedShadow> {
        let plane = &occluder.plane;
        let toward = self.height_over(plane);
        if toward.abs() <= CONTACT_EPSILON_M {
            return None;
        }
        let (mips, from_behind) = occluder.side_facing(toward);
        let opacity = mips.level_for(plane.size, self.cell_m(plane), self.blur_m(plane));
        let area = self.shadow_area(&plane.grown_by(opacity.grid.reach));
        if self.misses(&area) {
            return None;
        }
        let map = self.card_map(plane, toward, from_behind);
        Some(map.into_shadow(area, self.receiver.plane.w, opacity))
    }

    /// Height of the sample over a card's plane, metres (a cosine for a direction); negative behind
    /// it.
    fn height_over(&self, plane: &ScenePlane) -> f64 {
        let at = &self.sample.at;
        plane.normal.dot(&at.xyz()) - at.w * plane.normal.dot(&plane.center)
    }

    fn misses(&self, area: &LatticeArea) -> bool {
        let (rows, columns) = area;
        !areas_meet(area, self.receiver.area) || rows.len() < 2 || columns.len() < 2
    }

    fn card_map(&self, plane: &ScenePlane, toward: f64, from_behind: bool) -> CardMap {
        let (at, q) = (self.sample.at.xyz(), self.sample.at.w);
        let normal = plane.normal * toward.signum();
        // With p = (i, j, 1) the receiver's point is point p / depth.
        let (point, depth) = (&self.receiver.plane.point, &self.receiver.plane.w);
        let below = depth * normal.dot(&plane.center) - point.transpose() * normal;
        let w = depth * normal.dot(&at) - point.transpose() * normal * q;
        let hit = point * toward.abs() + at * below.transpose();
        let [u, v] = texture_rows(plane, &hit, &w);
        let u = if from_behind { w - u } else { u };
        CardMap { u, v, w, below }
    }

    /// Spacing of the nodes projected onto a card: the nearer to the light, the shorter.
    fn cell_m(&self, plane: &ScenePlane) -> f64 {
        let way = self.sample.at.w * self.height_of(&plane.center) / self.height;
        (1.0 - way).max(0.0) * self.receiver.cell_m
    }

    /// Blur of a card's shadow by the piece of light of a sample, metres on the card, as the side
    /// of a texel whose bilinear reading has the same variance.
    ///
    /// A square of side b has variance `b^2 / 12`, texels of side t read bilinearly have `t^2 / 4`.
    fn blur_m(&self, plane: &ScenePlane) -> f64 {
        let way = self.blurring_height(plane) / self.height;
        self.sample.width * way * libm::sqrt(4.0 / 12.0)
    }

    /// The height above the receiver from which a card's shadow is blurred. The shadow of a card
    /// that leans on the receiver is sharp where they touch and blurred at the other end: for a
    /// lamp, all of it is as sharp as at its sharpest.
    fn blurring_height(&self, plane: &ScenePlane) -> f64 {
        let heights = plane.corners().map(|corner| self.height_of(&corner));
        let lowest = heights.into_iter().fold(f64::INFINITY, f64::min);
        match self.sample.kind {
            LightSampleKind::Face { .. } => lowest,
            LightSampleKind::Sky { .. } => {
                SKY_BLUR_SHARE * 0.5 * (lowest + self.height_of(&plane.center))
            }
        }
    }

    fn height_of(&self, point: &Vector3<f64>) -> f64 {
        (self.receiver.plane.normal.dot(point) - self.plane_offset).max(0.0)
    }

    /// The shadow of the surface, which blocks light from below it.
    pub(super) fn project_surface(&self, surface: &ScenePlane) -> ProjectedShadow {
        ProjectedShadow {
            rows: 0..self.receiver.view.height,
            columns: 0..self.receiver.view.width,
            shape: ConvexShape::new(&self.surface_sides(surface)),
            u: Vector3::zeros(),
            v: Vector3::zeros(),
            w: Vector3::zeros(),
            opacity: None,
            inside: None,
        }
    }

    /// Where the line to the light crosses the surface inside its sides.
    fn surface_sides(&self, surface: &ScenePlane) -> Vec<Vector3<f64>> {
        let (foot, w) = self.foot_map();
        let mut sides = vec![self.receiver.plane.w, w];
        for (axis, size) in surface.size.into_iter().enumerate() {
            if size.is_finite() {
                let row = foot.row(axis).transpose();
                sides.extend([w * (0.5 * size) - row, w * (0.5 * size) + row]);
            }
        }
        sides
    }

    /// Map from the lattice to the point of `z = 0` on the line to the light, times the other
    /// returned row, which is positive above the light.
    fn foot_map(&self) -> (Matrix3<f64>, Vector3<f64>) {
        let (point, depth) = (&self.receiver.plane.point, &self.receiver.plane.w);
        let (at, q) = (self.sample.at.xyz(), self.sample.at.w);
        let height = point.transpose() * Vector3::z();
        let foot = at * height.transpose() - point * at.z;
        (foot, height * q - depth * at.z)
    }

    /// Whether the light comes from below the surface.
    pub(super) fn comes_from_below(&self) -> bool {
        self.receiver.own.is_some() && self.sample.at.z < 0.0
    }

    /// Part of the lattice that contains a shadow: bounds of the four corners projected onto the
    /// receiver.
    fn shadow_area(&self, plane: &ScenePlane) -> LatticeArea {
        let view = self.receiver.view;
        let mut corners = plane.corners();
        for corner in &mut corners {
            match self.shadow_of(corner) {
                Some(point) => *corner = point,
                None => return view.whole_area(),
            }
        }
        view.area_around(&corners)
    }

    /// Where a point casts its shadow on the receiver's plane; none for one level with or above the
    /// light, whose shadow falls away from it, while shadows of points around it are unbounded.
    fn shadow_of(&self, point: &Vector3<f64>) -> Option<Vector3<f64>> {
        let h = self.receiver.plane.normal.dot(point) - self.plane_offset;
        let fall = self.height - self.sample.at.w * h;
        let below = fall > 1e-6 * self.height;
        below.then(|| (*point * self.height - self.sample.at.xyz() * h) / fall)
    }
}

impl CardMap {
    fn into_shadow(
        self,
        (rows, columns): LatticeArea,
        depth: Vector3<f64>,
        opacity: Arc<OpacityLevel>,
    ) -> ProjectedShadow {
        let Self { u, v, w, below } = self;
        let inset = opacity.opaque_inset();
        let inside = inset.map(|inset| quad_sides(&u, &v, &w, inset.map(|by| -by)));
        let [u, v] = opacity.grid.texel_rows(&u, &v, &w);
        // It ends at the card's edges, below the card, and in front of the eye.
        let [a, b, c, d, e, f, g, h] = opacity.extent.sides([&u, &v], &w);
        let sides = [a, b, c, d, e, f, g, h, below, depth];
        ProjectedShadow {
            rows,
            columns,
            shape: ConvexShape::new(&sides),
            u,
            v,
            w,
            opacity: Some(opacity),
            inside,
        }
    }
}

impl ProjectedShadow {
    /// Rows and columns that the shadow may touch.
    pub(super) fn area(&self) -> LatticeArea {
        (self.rows.clone(), self.columns.clone())
    }

    /// Left and right ends of the shadow in `N` rows from `first` on; reversed where it has none.
    pub(super) fn row_spans<const N: usize>(&self, first: usize) -> ([f64; N], [f64; N]) {
        self.shape.row_spans(first as f64)
    }

    /// Multiplies the transmittance at these nodes of a row; returns the reads that this needed.
    pub(super) fn attenuate(
        &self,
        j: usize,
        nodes: &Range<usize>,
        through: &mut [Float4],
    ) -> TexelReads {
        let Some(opacity) = &self.opacity else {
            through.fill(Float4::ZERO);
            return TexelReads::default();
        };
        let line = self.texel_line(j, nodes);
        if let Some(dark) = self.dark_nodes(j, nodes) {
            through[dark.clone()].fill(Float4::ZERO);
            opacity.attenuate(&line, 0, &mut through[..dark.start]);
            opacity.attenuate(&line, dark.end, &mut through[dark.end..]);
            TexelReads {
                see_through: 0,
                edges: nodes.len() - dark.len(),
            }
        } else {
            opacity.attenuate(&line, 0, through);
            TexelReads {
                see_through: nodes.len(),
                edges: 0,
            }
        }
    }

    /// Positions among the texels along a row, from the first of the nodes on.
    fn texel_line(&self, j: usize, nodes: &Range<usize>) -> TexelLine {
        let first = Vector3::new(nodes.start as f64, j as f64, 1.0);
        texel_line([self.u, self.v, self.w], &first)
    }

    /// Where an opaque card is certain to block all light, counted from the first of the nodes.
    fn dark_nodes(&self, j: usize, nodes: &Range<usize>) -> Option<Range<usize>> {
        let dark = nodes_inside(self.inside.as_ref()?, j, nodes);
        Some(dark.start - nodes.start..dark.end - nodes.start)
    }
}
