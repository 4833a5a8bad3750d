//! One search of a picture: two of its bands become edges, a cluster of edges, and what they
//! enclose.

use super::SegmentOptions;
use super::band::Bands;
use super::cluster::{self, PixelGroups, both};
use super::hull;
use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::filter;
use crate::geom::{BBox, Point2};
use crate::image::{Image, Mask};
use crate::matte::Outline;
use crate::matte::check::refused;
use crate::matte::prepared::longer_side;
use crate::matte::stroke::{Claims, corrected};
use crate::pixel::LinearRgb;
use std::cmp::Reverse;
use std::ops::Range;

/// A picture ready to be searched at any depth.
pub(super) struct Search {
    pub(super) bands: Bands,
    /// Threshold of the finest band, in units of noise.
    threshold: f32,
    /// Where the finest band is above its threshold.
    pub(super) finest_binary: Mask,
    /// Where the finest band is more than the smear of a stronger edge.
    ridges: Mask,
    /// What a person says of the outline.
    pub(super) claims: Option<Claims>,
}

/// What a search at one depth found, in pixels of the picture that was searched.
pub(super) struct Pass {
    /// The band that served as the coarsest one.
    pub(super) coarsest: Image<f32>,
    /// Where that is above its threshold.
    pub(super) coarsest_binary: Mask,
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

impl Pass {
    /// How far the hull lies from that of another search, at most.
    pub(super) fn distance(&self, other: &Self) -> f64 {
        hull::farthest(&self.hull, &other.hull)
    }
}

/// How far the finest band smears an edge, pixels: the reach of its kernel.
const SMEAR_PX: usize = 2;
/// Edges nearer than this belong together in the smallest picture, too, pixels: the width of a
/// smeared edge.
const MIN_JOIN_PX: f64 = 6.0;

impl Search {
    /// Splits a picture into bands, `deepest` of them; a person may say of some pixels whether they
    /// are of the object.
    pub(super) fn new(
        picture: &Image<LinearRgb>,
        options: &SegmentOptions,
        deepest: usize,
        claims: Option<Claims>,
    ) -> Self {
        let bands = Bands::new(picture, options.tone, deepest);
        let otsu_or_given = options.finest_threshold.of_band(&bands.finest);
        let threshold = otsu_or_given.max(options.least_contrast);
        Self {
            finest_binary: bands.finest.map(|v| v > threshold),
            ridges: ridges(&bands.finest, options.ridge),
            bands,
            threshold,
            claims,
        }
    }

    /// Finds the object with band `levels` as the coarsest one.
    pub(super) fn at_depth(&self, levels: usize, options: &SegmentOptions) -> Result<Pass> {
        self.pass(levels, &self.finest_binary, options)
    }

    /// The same with `times` times the threshold of the finest band.
    pub(super) fn at_threshold(
        &self,
        levels: usize,
        times: f32,
        options: &SegmentOptions,
    ) -> Result<Pass> {
        let threshold = times * self.threshold;
        let finest_binary = self.bands.finest.map(|v| v > threshold);
        self.pass(levels, &finest_binary, options)
    }

    /// Where both bands have an edge, thinned, without groups of fewer pixels than a speck.
    fn thin_edges(&self, finest: &Mask, coarsest: &Mask, speck: usize) -> Mask {
        let thin = both(&both(finest, coarsest), &self.ridges);
        cluster::without_specks(&thin, speck)
    }

    /// What the object's edges enclose, as a person corrected it; `found` are all edges before.
    ///
    /// A person who cuts through an object takes away edges without which the rest encloses nothing:
    /// then it is what all of it encloses, cut.
    fn inside(&self, object: &Mask, found: &Mask, join_px: f64) -> Mask {
        let inside = self.corrected(enclosed_area(object, join_px));
        if self.claims.is_none() {
            return inside;
        }
        let whole = clusters_with(found, object, join_px);
        let cut = self.corrected(enclosed_area(&whole, join_px));
        if cut.count() as f64 > LEAK_AREA_RATIO * inside.count() as f64 {
            cut
        } else {
            inside
        }
    }

    /// A set of the object's pixels, as a person corrected it.
    fn corrected(&self, set: Mask) -> Mask {
        corrected(set, self.claims.as_ref())
    }

    fn pass(&self, levels: usize, finest_binary: &Mask, options: &SegmentOptions) -> Result<Pass> {
        let coarsest = self.bands.at_full_size(levels);
        let coarsest_binary = options.coarsest_threshold.binarised(&coarsest);
        let found = self.thin_edges(finest_binary, &coarsest_binary, options.speck);
        let edges = self.corrected(found.clone());
        let join_px = (options.join * longer_side(&edges) as f64).max(MIN_JOIN_PX);
        let (object, diagnostics) = main_object(&edges, self.claims.as_ref(), join_px)?;
        let hull = hull::convex_hull(&object);
        let touches = reached_borders(&object);
        check_object(&hull, touches, edges.size())?;
        let inside = self.inside(&object, &found, join_px);
        Ok(Pass {
            coarsest,
            coarsest_binary,
            edges,
            object,
            hull,
            inside,
            touches,
            diagnostics,
        })
    }
}

/// Edges and the clusters of others that they are part of.
fn clusters_with(others: &Mask, edges: &Mask, join_px: f64) -> Mask {
    let all = edges.zip_map(others, |a, b| a || b);
    let groups = PixelGroups::new(&filter::dilate(&all, join_px / 2.0));
    let sizes = groups.sizes(edges);
    both(&groups.only(|i| sizes[i] > 0), &all)
}

/// Where a band has at least a share of the strongest value nearby.
fn ridges(band: &Image<f32>, share: f32) -> Mask {
    let strongest = filter::largest_around(band, SMEAR_PX);
    band.zip_map(&strongest, |v, most| v >= share * most)
}

/// Two clusters are two objects when the smaller one has at least this share of the larger one's
/// edge pixels.
const RIVAL_SHARE: f64 = 0.3;
/// A smaller cluster is worth a warning from this share on.
const REMNANT_SHARE: f64 = 0.05;
/// This many clusters too small for a warning each give one together: where they lie on the screen,
/// one may lie beside the object.
const SPECK_COUNT: usize = 2;

/// Edge pixels in clusters; the largest cluster is the main one, or the one with most pixels that are
/// said to be the object.
struct EdgeClusters<'a> {
    edges: &'a Mask,
    groups: PixelGroups,
    /// Edge pixels of each cluster.
    sizes: Vec<usize>,
    /// Those that a person says are of the object.
    core_sizes: Vec<usize>,
    main: usize,
    /// Edge pixels of each cluster within the hull of the main one.
    sizes_inside: Vec<usize>,
}

impl<'a> EdgeClusters<'a> {
    /// Edges nearer to each other than `join_px` form a cluster; nothing where there are no edges.
    fn new(edges: &'a Mask, claims: Option<&Claims>, join_px: f64) -> Option<Self> {
        let groups = PixelGroups::new(&filter::dilate(edges, join_px / 2.0));
        let sizes = groups.sizes(edges);
        let core_sizes = core_sizes(&groups, claims, sizes.len());
        let main = (0..sizes.len()).max_by_key(|&i| (core_sizes[i], sizes[i], Reverse(i)))?;
        let hull = under_hull(&both(&groups.only(|i| i == main), edges), 0.0);
        Some(Self {
            edges,
            sizes_inside: groups.sizes(&both(edges, &hull)),
            groups,
            sizes,
            core_sizes,
            main,
        })
    }

    /// The edge pixels of the clusters for which a claim holds.
    fn only(&self, holds: impl Fn(usize) -> bool) -> Mask {
        both(&self.groups.only(holds), self.edges)
    }

    /// Descriptions of where the main cluster and another one are.
    fn places(&self, other: usize) -> [String; 2] {
        [self.main, other].map(|cluster| place(&self.only(|i| i == cluster)))
    }

    /// At least half of a cluster lies within the hull of the main one, or it is that, or a person
    /// says so.
    fn belongs(&self, cluster: usize) -> bool {
        let is_claimed = self.core_sizes[cluster] > 0;
        is_claimed || cluster == self.main || 2 * self.sizes_inside[cluster] >= self.sizes[cluster]
    }

    /// The warnings about what is left out.
    ///
    /// # Errors
    /// [`Error::Photo`] where it could be an object of its own.
    fn judge_others(&self) -> Result<Vec<Diagnostic>> {
        let mut diagnostics = Vec::new();
        let mut specks = 0;
        for (i, share) in self.others() {
            if share >= RIVAL_SHARE {
                return Err(two_objects(&self.places(i)));
            }
            if share >= REMNANT_SHARE {
                diagnostics.push(left_out(&self.places(i)));
            } else {
                specks += 1;
            }
        }
        diagnostics.extend((specks >= SPECK_COUNT).then(|| specks_on_screen(specks)));
        Ok(diagnostics)
    }

    /// The clusters that do not belong to the main one, and their sizes as shares of its size.
    fn others(&self) -> impl Iterator<Item = (usize, f64)> {
        (0..self.sizes.len())
            .filter(|&i| !self.belongs(i))
            .map(|i| (i, self.sizes[i] as f64 / self.sizes[self.main] as f64))
    }
}

/// Pixels of each of `count` groups that a person says are of the object.
fn core_sizes(groups: &PixelGroups, claims: Option<&Claims>, count: usize) -> Vec<usize> {
    let none = || vec![0; count];
    claims.map_or_else(none, |claims| {
        groups.sizes(&claims.map(|claim| claim == Some(true)))
    })
}

/// The edges of the one object.
///
/// Edges nearer to each other than `join_px` form a cluster; the object is the cluster of most edge
/// pixels and what lies inside its hull. A cluster outside it is an error if it could be an object
/// of its own, else it is left out.
fn main_object(
    edges: &Mask,
    claims: Option<&Claims>,
    join_px: f64,
) -> Result<(Mask, Vec<Diagnostic>)> {
    let clusters = EdgeClusters::new(edges, claims, join_px).ok_or_else(|| {
        refused(
            "nothing stands out from the background along the borders; is there an object, in focus, with background all around it?",
        )
    })?;
    let mut diagnostics = clusters.judge_others()?;
    let object = clusters.only(|i| clusters.belongs(i));
    let closer_px = CLOSER_JOIN_SHARE * join_px;
    diagnostics.extend(possibly_two_objects(&object, claims, closer_px));
    Ok((object, diagnostics))
}

fn two_objects([one, other]: &[String; 2]) -> Error {
    refused(format!(
        "two objects, {one} and {other}; photograph them one by one (or, if it is one, set `join = 0.08` or more under `[cut_out.segment]` in a TOML list of photos)"
    ))
}

fn left_out([object, other]: &[String; 2]) -> Diagnostic {
    Diagnostic::warning(
        Code::LeftOut,
        format_args!("left out something {other}: too far from the object {object}"),
    )
}

fn specks_on_screen(count: usize) -> Diagnostic {
    Diagnostic::warning(
        Code::Specks,
        format_args!(
            "{count} specks on the screen: one next to the object may have been treated as part of it; clean the screen, or check the outline"
        ),
    )
}

/// Edges that fall apart into two clusters when they are joined over this share of the gap may be
/// of two objects.
const CLOSER_JOIN_SHARE: f64 = 0.5;

/// The warning about an object whose edges are two clusters beside each other unless gaps of
/// `join_px` are bridged.
fn possibly_two_objects(
    object: &Mask,
    claims: Option<&Claims>,
    join_px: f64,
) -> Option<Diagnostic> {
    let clusters = EdgeClusters::new(object, claims, join_px)?;
    let least = RIVAL_SHARE * clusters.sizes[clusters.main] as f64;
    let (other, _) = clusters
        .others()
        .find(|(i, _)| clusters.sizes[*i] as f64 >= least)?;
    let [one, other] = clusters.places(other);
    let message =
        format!("possibly two objects, {one} and {other}: only a narrow gap separates them");
    Some(Diagnostic::warning(Code::TwoObjects, message))
}

/// The pixels that lie in the convex hull of a set by more than a share.
fn under_hull(set: &Mask, share: f32) -> Mask {
    Outline::from_ring(hull::convex_hull(set))
        .coverage(set.width(), set.height())
        .map(|c| c.0 > share)
}

/// Description of where a set of pixels is, as shares of the picture.
fn place(set: &Mask) -> String {
    let hull = hull::convex_hull(set);
    let x = mean_percent(hull.iter().map(|p| p.x), set.width());
    let y = mean_percent(hull.iter().map(|p| p.y), set.height());
    format!("at {x} % of the width and {y} % of the height")
}

/// Mean of coordinates as a rounded percentage of a length.
fn mean_percent(coordinates: impl ExactSizeIterator<Item = f64>, len: usize) -> f64 {
    let n = coordinates.len().max(1) as f64;
    (100.0 * coordinates.sum::<f64>() / n / len as f64).round()
}

/// The area may grow by this factor when twice the gap is bridged; if it grows by more, it had
/// leaked.
const LEAK_AREA_RATIO: f64 = 1.1;

/// The area inside the hull that the edges enclose, gaps up to twice `join_px` bridged; wider ones
/// while that makes the area jump, for then the outline had a gap through which the inside leaked
/// out.
fn enclosed_area(edges: &Mask, join_px: f64) -> Mask {
    let hull = under_hull(edges, 0.5);
    let edges = closed_at_borders(edges);
    let mut narrow = closed(&edges, &hull, join_px / 2.0);
    for times in [1.0, 2.0, 4.0] {
        let wide = closed(&edges, &hull, times * join_px);
        if wide.count() as f64 <= LEAK_AREA_RATIO * narrow.count() as f64 {
            return wide;
        }
        narrow = wide;
    }
    hull
}

fn closed(edges: &Mask, hull: &Mask, radius_px: f64) -> Mask {
    let filled = cluster::filled(&filter::dilate(edges, radius_px));
    both(&filter::erode(&filled, radius_px), hull)
}

/// An object whose edges come so near to the border, pixels, may go on beyond: an edge has two
/// sides, and a faint tip is seen a few pixels late.
const NEAR_BORDER_PX: usize = 4;

/// Edges, with a line along each border between the first and the last that come near it: an object
/// that the border cuts off has no edge there, and would leak out.
fn closed_at_borders(edges: &Mask) -> Mask {
    let (w, h) = edges.size();
    let [near_x, near_y] = [w, h].map(|len| NEAR_BORDER_PX.min(len));
    let rows_near = |columns: Range<usize>| {
        spanned((0..h).filter(|&y| is_any_set(edges, columns.clone(), y..y + 1)))
    };
    let columns_near =
        |rows: Range<usize>| spanned((0..w).filter(|&x| is_any_set(edges, x..x + 1, rows.clone())));
    let (left, right) = (rows_near(0..near_x), rows_near(w - near_x..w));
    let (top, bottom) = (columns_near(0..near_y), columns_near(h - near_y..h));
    let is_border = |x: usize, y: usize| {
        (x == 0 && left.contains(&y))
            || (x + 1 == w && right.contains(&y))
            || (y == 0 && top.contains(&x))
            || (y + 1 == h && bottom.contains(&x))
    };
    Mask::from_fn(w, h, |x, y| edges[(x, y)] || is_border(x, y))
}

/// From the first of some places to the last; empty without any.
fn spanned(mut places: impl DoubleEndedIterator<Item = usize>) -> Range<usize> {
    places
        .next()
        .map_or(0..0, |first| first..places.next_back().unwrap_or(first) + 1)
}

/// Whether a set comes near the left, top, right and bottom border.
fn reached_borders(set: &Mask) -> [bool; 4] {
    let (w, h) = set.size();
    let [near_x, near_y] = [w, h].map(|len| NEAR_BORDER_PX.min(len));
    [
        is_any_set(set, 0..near_x, 0..h),
        is_any_set(set, 0..w, 0..near_y),
        is_any_set(set, w - near_x..w, 0..h),
        is_any_set(set, 0..w, h - near_y..h),
    ]
}

fn is_any_set(set: &Mask, columns: Range<usize>, mut rows: Range<usize>) -> bool {
    rows.any(|y| set.row(y)[columns.clone()].contains(&true))
}

/// Least length of an object as a share of the photo's longer side; anything smaller is dirt.
const MIN_OBJECT_LENGTH: f64 = 0.05;

fn check_object(hull: &[Point2<f64>], touches: [bool; 4], (w, h): (usize, usize)) -> Result<()> {
    let found = BBox::around(hull.iter().copied());
    let (width, height) = (found.width(), found.height());
    if hull.is_empty() || width.max(height) < MIN_OBJECT_LENGTH * w.max(h) as f64 {
        return Err(refused(format!(
            "the largest thing found is {width:.0} x {height:.0} of {w} x {h} pixels; is there an object, and is it in focus?"
        )));
    }
    if touches == [true; 4] {
        let what =
            "the object reaches all four borders; photograph it with background all around it";
        return Err(refused(what));
    }
    Ok(())
}
