//! One search of a picture: two of its bands become edges, a cluster of edges, and what they enclose.

use super::band::{self, Bands};
use super::cluster::{self, Groups};
use super::hull;
use super::{SegmentOptions, longer_side, refused};
use crate::diagnostic::{Code, Diagnostic};
use crate::error::Result;
use crate::filter;
use crate::geom::Point2;
use crate::image::{Image, Mask};
use crate::matte::Outline;
use crate::pixel::LinearRgb;

/// A picture ready to be searched at any depth.
pub(super) struct Search {
    bands: Bands,
    /// Cut of the first band, in units of noise.
    cut: f32,
    /// Where the first band is above its cut.
    first_binary: Mask,
    /// Where the first band is no mere smear of a stronger edge.
    ridges: Mask,
}

/// What a search at one depth found, in pixels of the picture that was searched.
pub(super) struct Pass {
    /// The band that served as the last one.
    pub(super) last: Image<f32>,
    /// Where that is above its cut.
    pub(super) last_binary: Mask,
    /// The edges, specks left out.
    pub(super) edges: Mask,
    /// Those of the object.
    pub(super) object: Mask,
    /// Convex hull of the object.
    pub(super) hull: Vec<Point2<f64>>,
    /// What its edges enclose.
    pub(super) inside: Mask,
    /// Left, top, right and bottom border are reached.
    pub(super) touches: [bool; 4],
    /// What was left out.
    pub(super) diagnostics: Vec<Diagnostic>,
}

/// How far the first band smears an edge, pixels: the reach of its kernel.
const SMEAR: usize = 2;
/// Edges nearer than this belong together in the smallest picture, too, pixels: the width of a smeared edge.
const LEAST_JOIN_PX: f64 = 6.0;

impl Search {
    /// Splits a picture into bands, `deepest` of them.
    pub(super) fn of(picture: &Image<LinearRgb>, opts: &SegmentOptions, deepest: usize) -> Self {
        let bands = Bands::of(picture, opts.tone, deepest);
        let first = &bands.first;
        let cut = opts.first_threshold.of(first).max(opts.least_contrast);
        let first_binary = first.map(|v| v > cut);
        let strongest = band::largest_around(first, SMEAR);
        let ridges = first.zip_map(&strongest, |v, most| v >= opts.ridge * most);
        Self {
            bands,
            cut,
            first_binary,
            ridges,
        }
    }

    /// The first band and where it is above its cut.
    pub(super) fn into_first(self) -> (Image<f32>, Mask) {
        (self.bands.first, self.first_binary)
    }

    /// Finds the object with band `levels` as the last one.
    pub(super) fn at(&self, levels: usize, opts: &SegmentOptions) -> Result<Pass> {
        self.pass(levels, &self.first_binary, opts)
    }

    /// The same with so many times the cut of the first band.
    pub(super) fn at_cut(&self, levels: usize, times: f32, opts: &SegmentOptions) -> Result<Pass> {
        let cut = times * self.cut;
        self.pass(levels, &self.bands.first.map(|v| v > cut), opts)
    }

    fn pass(&self, levels: usize, first_binary: &Mask, opts: &SegmentOptions) -> Result<Pass> {
        let last = self.bands.last(levels);
        let cut = opts.last_threshold.of(&last);
        let last_binary = last.map(|v| v > cut);
        let both = first_binary.zip_map(&last_binary, |a, b| a && b);
        let edges = cluster::without_specks(&both.zip_map(&self.ridges, |a, b| a && b), opts.speck);
        let join_px = (opts.join * longer_side(&edges) as f64).max(LEAST_JOIN_PX);
        let (object, diagnostics) = main_cluster(&edges, join_px)?;
        let hull = hull::convex_hull(&object);
        let touches = touches(&object);
        check_object(&hull, touches, edges.size())?;
        let inside = enclosed(&object, join_px);
        Ok(Pass {
            last,
            last_binary,
            edges,
            object,
            hull,
            inside,
            touches,
            diagnostics,
        })
    }
}

/// Two clusters are two objects when the smaller one has at least this share of the larger one's edge pixels.
const RIVAL: f64 = 0.3;
/// A smaller cluster is worth a warning from this share on.
const REMNANT: f64 = 0.05;

/// So many clusters too small for a warning are worth one together: where they lie on the screen, one may lie beside the
/// object.
const SPECKS: usize = 2;

/// The edges of the one object.
///
/// Edges nearer to each other than `join_px` form a cluster; the object is the cluster of most edge pixels and what
/// lies inside its hull. A cluster outside it is an error if it could be an object of its own, else it is left out.
fn main_cluster(edges: &Mask, join_px: f64) -> Result<(Mask, Vec<Diagnostic>)> {
    let groups = Groups::of(&filter::dilate(edges, join_px / 2.0));
    let sizes = groups.sizes(edges);
    let Some(main) = (0..sizes.len()).max_by_key(|&i| (sizes[i], std::cmp::Reverse(i))) else {
        return Err(refused(
            "nothing stands out from what is along the borders; is there an object, in focus, with background all around it?",
        ));
    };
    let member = |i: usize| {
        groups
            .only(move |group| group == i)
            .zip_map(edges, |near, edge| near && edge)
    };
    let object = member(main);
    let hull = under_hull(&object, 0.0);
    let inside = groups.sizes(&edges.zip_map(&hull, |edge, inside| edge && inside));
    let mut diagnostics = Vec::new();
    let mut specks = 0;
    for i in (0..sizes.len()).filter(|&i| i != main && 2 * inside[i] < sizes[i]) {
        let share = sizes[i] as f64 / sizes[main] as f64;
        if share >= RIVAL {
            return Err(refused(format!(
                "two objects, {} and {}; photograph them one by one (or, if it is one, raise segment.join)",
                place(&object),
                place(&member(i))
            )));
        }
        if share >= REMNANT {
            let message = format!(
                "left out what is {}: too far from the object {}",
                place(&member(i)),
                place(&object)
            );
            diagnostics.push(Diagnostic::warning(Code::LeftOut, message));
        } else {
            specks += 1;
        }
    }
    diagnostics.extend((specks >= SPECKS).then(|| specks_on_screen(specks)));
    let belongs = |i: usize| i == main || 2 * inside[i] >= sizes[i];
    let object = groups
        .only(belongs)
        .zip_map(edges, |near, edge| near && edge);
    diagnostics.extend(parted(&object, PARTED * join_px));
    Ok((object, diagnostics))
}

fn specks_on_screen(count: usize) -> Diagnostic {
    Diagnostic::warning(
        Code::Specks,
        format_args!(
            "{count} specks on the screen: one beside the object may have been treated as part of it; clean the screen, or check the outline"
        ),
    )
}

/// Edges that fall apart into two clusters when they are joined over this share of the gap may be of two objects.
const PARTED: f64 = 0.5;

/// The warning about an object whose edges are two clusters beside each other unless gaps of `join_px` are bridged.
fn parted(object: &Mask, join_px: f64) -> Option<Diagnostic> {
    let groups = Groups::of(&filter::dilate(object, join_px / 2.0));
    let sizes = groups.sizes(object);
    let main = (0..sizes.len()).max_by_key(|&i| (sizes[i], std::cmp::Reverse(i)))?;
    let member = |i: usize| {
        groups
            .only(move |group| group == i)
            .zip_map(object, |near, edge| near && edge)
    };
    let first = member(main);
    let hull = under_hull(&first, 0.0);
    let inside = groups.sizes(&object.zip_map(&hull, |edge, inside| edge && inside));
    let rival = |i: &usize| {
        *i != main && 2 * inside[*i] < sizes[*i] && sizes[*i] as f64 >= RIVAL * sizes[main] as f64
    };
    let other = (0..sizes.len()).find(rival)?;
    let message = format!(
        "possibly two objects, {} and {}: only a narrow gap separates them",
        place(&first),
        place(&member(other))
    );
    Some(Diagnostic::warning(Code::TwoObjects, message))
}

/// The pixels of which more than a share lies in the convex hull of a set.
fn under_hull(set: &Mask, share: f32) -> Mask {
    let hull = Outline {
        rings: vec![hull::convex_hull(set)],
    };
    hull.coverage(set.width(), set.height())
        .map(|c| c.0 > share)
}

/// Where a set of pixels is, in words, as shares of the picture.
fn place(set: &Mask) -> String {
    let hull = hull::convex_hull(set);
    let n = hull.len().max(1) as f64;
    let percent = |sum: f64, len: usize| (100.0 * sum / n / len as f64).round();
    let x = percent(hull.iter().map(|p| p.x).sum(), set.width());
    let y = percent(hull.iter().map(|p| p.y).sum(), set.height());
    format!("at {x} % of the width and {y} % of the height")
}

/// The area may grow by this factor when twice the gap is bridged; by more, and it had leaked.
const LEAK: f64 = 1.1;

/// The area inside the hull that the edges enclose, gaps up to twice `join_px` bridged; wider ones while that makes the
/// area jump, for then the outline had a gap through which the inside leaked out.
fn enclosed(edges: &Mask, join_px: f64) -> Mask {
    let hull = under_hull(edges, 0.5);
    let area = |set: &Mask| set.count() as f64;
    let mut narrow = closed(edges, &hull, join_px / 2.0);
    for times in [1.0, 2.0, 4.0] {
        let wide = closed(edges, &hull, times * join_px);
        if area(&wide) <= LEAK * area(&narrow) {
            return wide;
        }
        narrow = wide;
    }
    hull
}

fn closed(edges: &Mask, hull: &Mask, radius_px: f64) -> Mask {
    let whole = filter::erode(
        &cluster::filled(&filter::dilate(edges, radius_px)),
        radius_px,
    );
    whole.zip_map(hull, |inside, hull| inside && hull)
}

/// An object whose edges come so near to the border, pixels, may go on beyond: an edge has two sides, and a faint tip is
/// seen a few pixels late.
const NEAR_BORDER: usize = 4;

fn touches(set: &Mask) -> [bool; 4] {
    let (w, h) = set.size();
    let columns =
        |xs: std::ops::Range<usize>| set.rows().any(|row| row[xs.clone()].contains(&true));
    let rows = |ys: std::ops::Range<usize>| ys.into_iter().any(|y| set.row(y).contains(&true));
    let near = |len: usize| NEAR_BORDER.min(len);
    [
        columns(0..near(w)),
        rows(0..near(h)),
        columns(w - near(w)..w),
        rows(h - near(h)..h),
    ]
}

/// Least length of an object as a share of the photo's longer side; anything smaller is dirt.
const LEAST_LENGTH: f64 = 0.05;

fn check_object(hull: &[Point2<f64>], touches: [bool; 4], (w, h): (usize, usize)) -> Result<()> {
    let extent = |along: fn(&Point2<f64>) -> f64| {
        let (low, high) = hull
            .iter()
            .map(along)
            .fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        (high - low).max(0.0)
    };
    let (width, height) = (extent(|p| p.x), extent(|p| p.y));
    if hull.is_empty() || width.max(height) < LEAST_LENGTH * w.max(h) as f64 {
        return Err(refused(format!(
            "the largest thing found is {width:.0} x {height:.0} of {w} x {h} pixels; is there an object, and is it in focus?"
        )));
    }
    if touches == [true; 4] {
        return Err(refused(
            "the object reaches all four borders; photograph it with background all around it",
        ));
    }
    Ok(())
}
