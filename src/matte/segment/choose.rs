//! The depth of the search, chosen by how well searches agree.

use super::confidence::Confidence;
use super::holes::{self, ObjectArea};
use super::pass::{Pass, Search};
use super::{SegmentOptions, SegmentStep, band, cluster, hull};
use crate::diagnostic::{Code, Diagnostic};
use crate::error::Result;
use crate::filter;
use crate::geom::Point2;
use crate::image::{Image, Mask};
use crate::matte::prepared::{longer_side, scaled_sides};
use crate::matte::stroke::{Claims, StrokesOnPhoto};
use crate::pixel::LinearRgb;
use rayon::prelude::*;
use std::borrow::Cow;

/// The search that agrees best with the others.
pub(super) struct ChosenSearch<'a> {
    /// What it found.
    pub(super) pass: Pass,
    /// The picture that it searched.
    pub(super) picture: Cow<'a, Image<LinearRgb>>,
    /// Its finest band.
    finest: Image<f32>,
    /// Where that is above its threshold.
    finest_binary: Mask,
    /// What a person says of the outline, in the picture that it searched.
    claims: Option<Claims>,
    /// The band that served as the coarsest one.
    pub(super) levels: usize,
    /// How well it agrees.
    pub(super) confidence: Confidence,
}

/// A picture size and the depths to search it at, the default one first.
///
/// Half the size sees half the noise, and a third of it at a quarter; the bands then are as wide as
/// those of one depth more.
const SEARCHED_SIZES: [(usize, &[usize]); 3] = [(1, &[4, 3, 5, 2]), (2, &[3, 2, 4]), (4, &[2, 3])];
/// The coarsest band has at least this many pixels along the longer side: below that, it does not
/// separate an object from the rest.
const MIN_COARSEST_SIDE: usize = 30;
/// Shorter side of a smaller picture, at least, pixels.
const MIN_SEARCHED_SIDE_PX: usize = 32;
/// A finer picture is preferred to one that scores better by less than this factor.
const FINER_PREFERENCE: f64 = 0.8;
/// Longer side of the pictures in which outlines are compared, pixels.
const COMPARED_SIDE_PX: usize = 256;

/// Searches the picture at several sizes and depths.
///
/// # Method
/// An outline is right where it lies on edges and where it does not depend on how it was searched
/// for. Each search scores the share of its outline that lies on edges times its mean overlap
/// (intersection over union) with what the other searches found; a search that finds nothing
/// overlaps with nothing. The best score wins, the finer picture when in doubt.
/// What strokes say of the outline holds in each of them.
/// # Errors
/// That of the default search when more than half of the searches fail.
pub(super) fn best_search<'a>(
    picture: &'a Image<LinearRgb>,
    strokes: StrokesOnPhoto<'_>,
    options: &SegmentOptions,
) -> Result<ChosenSearch<'a>> {
    let scales = scales(picture, strokes, options);
    let mut searched = searches(&scales, options);
    if let Some(failed) = first_of_many_failures(&searched) {
        return searched
            .swap_remove(failed)
            .into_chosen(scales, Confidence::default());
    }
    let confidences = confidences(&searched, picture.size());
    let pick = best_candidate(&searched, &confidences, options.levels);
    let [drift_px, faint_px] = drift_px(&searched, pick, &scales, options);
    let confidence = Confidence {
        drift_px,
        faint_px,
        ..confidences[pick]
    };
    searched.swap_remove(pick).into_chosen(scales, confidence)
}

/// The first search that failed, where more than half of them did.
fn first_of_many_failures(searched: &[SearchRun]) -> Option<usize> {
    let are_many = 2 * failures(searched).count() > searched.len();
    failures(searched).next().filter(|_| are_many)
}

fn failures(searched: &[SearchRun]) -> impl Iterator<Item = usize> {
    (0..searched.len()).filter(|&i| searched[i].pass.is_err())
}

/// Support and agreement of each search.
fn confidences(searched: &[SearchRun], size: (usize, usize)) -> Vec<Confidence> {
    let areas: Vec<Option<Mask>> = searched.iter().map(|s| s.small_area(size)).collect();
    let confidence = searched.iter().enumerate().map(|(i, s)| Confidence {
        support: s.edge_support(),
        agreement: agreement(&areas, i),
        ..Default::default()
    });
    confidence.collect()
}

/// The first search, finer pictures before coarser ones, that scores almost as well as the best; of
/// those at a depth that was asked for, if one was.
fn best_candidate(
    searched: &[SearchRun],
    confidences: &[Confidence],
    levels: Option<usize>,
) -> usize {
    let mut candidates = (0..searched.len()).filter(|&i| searched[i].is_candidate(levels));
    let values = candidates.clone().map(|i| confidences[i].value());
    let most = values.fold(0.0, f64::max);
    candidates
        .find(|&i| confidences[i].value() >= FINER_PREFERENCE * most)
        .unwrap_or(0)
}

/// A picture of one size, ready to be searched, and at which depths.
struct SearchScale<'a> {
    /// Pixels of the whole picture for one of this one.
    reduction: usize,
    picture: Cow<'a, Image<LinearRgb>>,
    search: Search,
    depths: Vec<usize>,
}

impl<'a> SearchScale<'a> {
    fn new(
        whole: &'a Image<LinearRgb>,
        reduction: usize,
        depths: Vec<usize>,
        strokes: StrokesOnPhoto<'_>,
        options: &SegmentOptions,
    ) -> Self {
        let picture = reduced(whole, reduction);
        let claims = strokes.about_outline(picture.size());
        let deepest = depths.iter().copied().max().unwrap_or(2);
        Self {
            reduction,
            search: Search::new(&picture, options, deepest, claims),
            picture,
            depths,
        }
    }
}

fn reduced(picture: &Image<LinearRgb>, reduction: usize) -> Cow<'_, Image<LinearRgb>> {
    if reduction <= 1 {
        return Cow::Borrowed(picture);
    }
    let (w, h) = picture.size();
    Cow::Owned(filter::resize(picture, w / reduction, h / reduction))
}

fn scales<'a>(
    picture: &'a Image<LinearRgb>,
    strokes: StrokesOnPhoto<'_>,
    options: &SegmentOptions,
) -> Vec<SearchScale<'a>> {
    let (longer, shorter) = (longer_side(picture), picture.width().min(picture.height()));
    SEARCHED_SIZES
        .into_par_iter()
        .filter(|(reduction, _)| *reduction == 1 || shorter / reduction >= MIN_SEARCHED_SIDE_PX)
        .map(|(reduction, depths)| {
            let asked = options.levels.filter(|_| reduction == 1);
            let depths = usable_depths(depths, longer / reduction, asked);
            SearchScale::new(picture, reduction, depths, strokes, options)
        })
        .collect()
}

/// The depths at which a picture of a longer side still has enough pixels in its coarsest band, and
/// the one that is asked for.
fn usable_depths(depths: &[usize], longer: usize, asked: Option<usize>) -> Vec<usize> {
    let mut usable: Vec<usize> = depths
        .iter()
        .copied()
        .filter(|&depth| depth == 2 || longer >> depth >= MIN_COARSEST_SIDE)
        .collect();
    usable.extend(asked.filter(|depth| !usable.contains(depth)));
    usable
}

/// One search and its setting.
struct SearchRun {
    /// Which of the scales it was done at.
    scale: usize,
    levels: usize,
    pass: Result<Pass>,
}

fn searches(scales: &[SearchScale<'_>], options: &SegmentOptions) -> Vec<SearchRun> {
    let settings: Vec<(usize, usize)> = (0..scales.len())
        .flat_map(|i| scales[i].depths.iter().map(move |&levels| (i, levels)))
        .collect();
    settings
        .par_iter()
        .map(|&(scale, levels)| SearchRun {
            scale,
            levels,
            pass: scales[scale].search.at_depth(levels, options),
        })
        .collect()
}

/// Factors of the finest band's threshold in a stricter search and in a laxer one: half a step of
/// exposure.
const STRICTER_FACTOR: f32 = 1.4;
const LAXER_FACTOR: f32 = 1.0 / STRICTER_FACTOR;

/// How far the hull moves, pixels of the whole picture: when edges must be stronger or the same
/// picture is searched at another depth, and when edges may be weaker.
fn drift_px(
    searched: &[SearchRun],
    pick: usize,
    scales: &[SearchScale<'_>],
    options: &SegmentOptions,
) -> [f64; 2] {
    let (own, scale) = (&searched[pick], &scales[searched[pick].scale]);
    let Ok(pass) = &own.pass else {
        return [0.0; 2];
    };
    let moved_px = [STRICTER_FACTOR, LAXER_FACTOR].map(|factor| {
        let other = scale.search.at_threshold(own.levels, factor, options);
        // What such a search does not find at all moves by the picture's longer side.
        other.map_or(longer_side(&pass.inside) as f64, |p| pass.distance(&p))
    });
    let at_other_depths = passes_at(searched, own.scale).map(|other| pass.distance(other));
    let stricter_px = at_other_depths.fold(moved_px[0], f64::max);
    [stricter_px, moved_px[1]].map(|px| scale.reduction as f64 * px)
}

/// What the searches of one picture size found.
fn passes_at(searched: &[SearchRun], scale: usize) -> impl Iterator<Item = &Pass> {
    let same = searched.iter().filter(move |other| other.scale == scale);
    same.filter_map(|other| other.pass.as_ref().ok())
}

impl SearchRun {
    /// It was done at the depth that was asked for, if one was.
    fn is_candidate(&self, levels: Option<usize>) -> bool {
        levels.is_none_or(|levels| self.scale == 0 && self.levels == levels)
    }

    fn into_chosen(
        self,
        mut scales: Vec<SearchScale<'_>>,
        confidence: Confidence,
    ) -> Result<ChosenSearch<'_>> {
        let scale = scales.swap_remove(self.scale);
        Ok(ChosenSearch {
            pass: self.pass?,
            picture: scale.picture,
            // The rest of the search goes at once: it is as large as several photos.
            finest: scale.search.bands.finest,
            finest_binary: scale.search.finest_binary,
            claims: scale.search.claims,
            levels: self.levels,
            confidence,
        })
    }

    /// The inside in a picture small enough to be compared quickly.
    fn small_area(&self, (w, h): (usize, usize)) -> Option<Mask> {
        let inside = self.pass.as_ref().ok()?.inside.to_coverage();
        let [w, h] = scaled_sides((w, h), COMPARED_SIDE_PX.min(w.max(h)), 1);
        Some(filter::resize(&inside, w, h).map(|c| c.0 > 0.5))
    }

    /// Share of the outline that lies on edges; what lies on the picture's border does not count.
    fn edge_support(&self) -> f64 {
        let Ok(pass) = &self.pass else { return 0.0 };
        let near = filter::dilate(&pass.object, EDGE_REACH_PX);
        let core = filter::erode(&pass.inside, 1.0);
        let outline = off_border(core.size()).filter(|&at| pass.inside[at] && !core[at]);
        let (length, on_edges) = outline.fold((0_usize, 0_usize), |(length, on_edges), at| {
            (length + 1, on_edges + usize::from(near[at]))
        });
        on_edges as f64 / length.max(1) as f64
    }
}

/// The pixels of a picture without those on its border.
fn off_border((w, h): (usize, usize)) -> impl Iterator<Item = (usize, usize)> {
    (1..h.saturating_sub(1)).flat_map(move |y| (1..w.saturating_sub(1)).map(move |x| (x, y)))
}

/// How far from an edge pixel an outline still lies on it, pixels: the smear of the finest band.
const EDGE_REACH_PX: f64 = 2.0;

/// Mean overlap of one area with the others; 1 without others.
fn agreement(areas: &[Option<Mask>], i: usize) -> f64 {
    if areas.len() < 2 {
        return 1.0;
    }
    let others = (0..areas.len()).filter(|&j| j != i);
    // 0 where one area was not found.
    let overlaps = others
        .map(|j| areas[i].as_ref().zip(areas[j].as_ref()))
        .map(|both| both.map_or(0.0, |(a, b)| overlap(a, b)));
    overlaps.sum::<f64>() / (areas.len() - 1) as f64
}

/// Intersection over union.
fn overlap(a: &Mask, b: &Mask) -> f64 {
    let both = a.zip_map(b, |a, b| a && b).count();
    let either = a.count() + b.count() - both;
    both as f64 / either.max(1) as f64
}

impl ChosenSearch<'_> {
    /// What it left out or saw only in part; `asked` is the width of the picture that should have
    /// been searched.
    pub(super) fn diagnostics(&self, asked: usize) -> Vec<Diagnostic> {
        let mut diagnostics = self.pass.diagnostics.clone();
        diagnostics.extend(truncated(self.pass.touches));
        diagnostics.extend(noisy(asked, self.picture.width()));
        diagnostics
    }

    /// What the edges enclose, without holes, as a person corrected it.
    pub(super) fn object_area(&self) -> ObjectArea {
        let found = holes::object_area(&self.picture, &self.pass.inside);
        found.corrected(self.claims.as_ref())
    }

    /// The hull of the object's edges, but those of its shadow.
    pub(super) fn hull_of(&self, area: &ObjectArea) -> Cow<'_, [Point2<f64>]> {
        if !area.shadow.pixels().contains(&true) {
            return Cow::Borrowed(&self.pass.hull);
        }
        let near = filter::dilate(&area.shadow, EDGE_REACH_PX);
        Cow::Owned(hull::convex_hull(&cluster::without(
            &self.pass.object,
            &near,
        )))
    }

    /// The pictures (a) to (e) of the paper's Figure 2, and what lies between; `whole` is the
    /// picture at full search size.
    pub(super) fn into_steps(self, whole: &Image<LinearRgb>) -> Vec<SegmentStep> {
        let (pass, finest_binary) = (self.pass, self.finest_binary);
        let both = finest_binary.zip_map(&pass.coarsest_binary, |a, b| a && b);
        let steps = [
            ("grey", band::luma_root(whole, [1.0; 3])),
            ("first_band", self.finest),
            ("last_band", pass.coarsest),
            ("first_binary", as_plane(&finest_binary)),
            ("last_binary", as_plane(&pass.coarsest_binary)),
            ("both", as_plane(&both)),
            ("edges", as_plane(&pass.edges)),
            ("object", as_plane(&pass.object)),
            ("inside", as_plane(&pass.inside)),
        ];
        steps
            .map(|(name, image)| SegmentStep { name, image })
            .into()
    }
}

/// 1 where set, 0 elsewhere.
fn as_plane(set: &Mask) -> Image<f32> {
    set.map(|set| f32::from(u8::from(set)))
}

/// Names of the borders in the order of [`Pass::touches`].
const BORDERS: [&str; 4] = ["left", "top", "right", "bottom"];

/// The warning about an object that the photo cuts off; none for a whole one.
fn truncated(touches: [bool; 4]) -> Option<Diagnostic> {
    let borders = BORDERS.into_iter().zip(touches);
    let reached: Vec<&str> = borders
        .filter_map(|(name, reached)| reached.then_some(name))
        .collect();
    (!reached.is_empty()).then(|| truncated_at(&reached))
}

fn truncated_at(borders: &[&str]) -> Diagnostic {
    Diagnostic::warning(
        Code::Truncated,
        format_args!(
            "the object reaches the {} border: the part beyond it is missing, and a stated length or size makes the \
             rest too large; photograph the whole object",
            listed(borders)
        ),
    )
}

/// Names as a sentence lists them.
fn listed(names: &[&str]) -> String {
    match names {
        [others @ .., last] if !others.is_empty() => format!("{} and {last}", others.join(", ")),
        _ => names.concat(),
    }
}

/// The warning about an object that was found at a lower resolution than asked for; from the widths
/// of the pictures.
fn noisy(asked: usize, searched: usize) -> Option<Diagnostic> {
    let reduction = asked as f64 / searched as f64;
    (reduction > 1.0).then(|| {
        Diagnostic::warning(
            Code::Noisy,
            format_args!(
                "the photo is noisy: the outline was found at 1/{reduction:.0} of the resolution and is accurate to one pixel there"
            ),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(side: usize) -> Option<Mask> {
        Some(Image::from_fn(20, 20, |x, y| x < side && y < side))
    }

    #[test]
    fn agreement_is_the_mean_overlap_and_failures_do_not_agree() {
        assert_eq!(overlap(&square(10).unwrap(), &square(5).unwrap()), 0.25);
        let found = [square(10), square(10), square(5), None];
        assert!((agreement(&found, 0) - (1.0 + 0.25 + 0.0) / 3.0).abs() < 1e-12);
        assert_eq!(
            (agreement(&found, 3), agreement(&found[..1], 0)),
            (0.0, 1.0)
        );
    }

    #[test]
    fn borders_that_are_reached_are_listed() {
        let said = |touches| truncated(touches).unwrap().message;
        assert!(said([true, false, false, true]).contains("the left and bottom border"));
        assert!(said([true, false, true, true]).contains("the left, right and bottom border"));
    }

    #[test]
    fn the_depth_that_was_asked_for_is_taken() {
        let disc = |x: f64, y: f64| (x - 150.0).hypot(y - 100.0) < 60.0;
        let photo = Image::from_fn(300, 200, |x, y| {
            if disc(x as f64, y as f64) {
                LinearRgb::WHITE
            } else {
                LinearRgb::new(0.04, 0.4, 0.08)
            }
        });
        for levels in [2, 3, 6] {
            let chosen = best_search(
                &photo,
                StrokesOnPhoto::default(),
                &SegmentOptions {
                    levels: Some(levels),
                    ..Default::default()
                },
            )
            .unwrap();
            assert_eq!(chosen.levels, levels);
            assert_eq!(chosen.pass.inside.size(), photo.size());
        }
    }

    #[test]
    fn the_picture_of_the_chosen_search_is_kept_and_not_made_again() {
        let disc = |x: f64, y: f64| (x - 150.0).hypot(y - 100.0) < 60.0;
        let photo = Image::from_fn(300, 200, |x, y| {
            LinearRgb::grey(if disc(x as f64, y as f64) { 0.8 } else { 0.1 })
        });
        let options = SegmentOptions::default();
        let strokes = StrokesOnPhoto::default();
        let whole = best_search(&photo, strokes, &options).unwrap();
        assert!(matches!(whole.picture, Cow::Borrowed(picture) if std::ptr::eq(picture, &photo)));
        for scale in scales(&photo, strokes, &options) {
            let searched = scale.search.at_depth(2, &options).unwrap().inside.size();
            assert_eq!(scale.picture.size(), searched);
        }
    }
}
