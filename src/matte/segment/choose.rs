//! The depth of the search, chosen by how well searches agree.

use super::pass::{Pass, Search};
use super::{Confidence, SegmentOptions, hull};
use crate::error::Result;
use crate::filter;
use crate::image::{Image, Mask};
use crate::pixel::LinearRgb;
use rayon::prelude::*;

/// The search that is believed.
pub(super) struct Chosen {
    /// What it found.
    pub(super) pass: Pass,
    /// Its first band.
    pub(super) first: Image<f32>,
    /// Where that is above its cut.
    pub(super) first_binary: Mask,
    /// The band that served as the last one.
    pub(super) levels: usize,
    /// How far it can be believed.
    pub(super) confidence: Confidence,
}

/// A picture size and the depths to search it at, the usual one first.
///
/// Half the size sees half the noise, and a third of it at a quarter; the bands then are as wide as those of one depth more.
const SIZES: [(usize, &[usize]); 3] = [(1, &[4, 3, 5, 2]), (2, &[3, 2, 4]), (4, &[2, 3])];
/// The last band has at least so many pixels along the longer side: below that, it does not tell an object from the rest.
const LEAST_CELLS: usize = 30;
/// Shorter side of a smaller picture, at least, pixels.
const SMALLEST_SEARCHED: usize = 32;
/// A finer picture is preferred to one that scores better by less than this factor.
const PREFERENCE: f64 = 0.8;
/// Longer side of the pictures in which outlines are compared, pixels.
const COMPARED: usize = 256;

/// Searches the picture at several sizes and depths.
///
/// # Method
/// An outline is right where it lies on edges and where it does not depend on how it was looked for. Each search scores
/// the share of its outline that lies on edges times its mean overlap (intersection over union) with what the other
/// searches found; a search that finds nothing overlaps with nothing. The best score wins, the finer picture when in
/// doubt.
/// # Errors
/// That of the usual search when more than half of the searches fail.
pub(super) fn best(picture: &Image<LinearRgb>, opts: &SegmentOptions) -> Result<Chosen> {
    let scales = scales(picture, opts);
    let mut searched = searches(&scales, opts);
    let failed = searched.iter().filter(|s| s.pass.is_err()).count();
    if 2 * failed > searched.len() {
        let first = searched.iter().position(|s| s.pass.is_err()).unwrap_or(0);
        return searched
            .swap_remove(first)
            .chosen(scales, Confidence::default());
    }
    let outlines: Vec<Option<Mask>> = searched
        .iter()
        .map(|s| s.compared(picture.size()))
        .collect();
    let beliefs: Vec<Confidence> = searched
        .iter()
        .enumerate()
        .map(|(i, s)| Confidence {
            support: s.support(),
            agreement: agreement(&outlines, i),
            ..Default::default()
        })
        .collect();
    let wanted = |i: usize| {
        opts.levels
            .is_none_or(|levels| searched[i].scale == 0 && searched[i].levels == levels)
    };
    let most = (0..searched.len())
        .filter(|&i| wanted(i))
        .map(|i| beliefs[i].value())
        .fold(0.0, f64::max);
    let pick = (0..searched.len())
        .find(|&i| wanted(i) && beliefs[i].value() >= PREFERENCE * most)
        .unwrap_or(0);
    let confidence = Confidence {
        drift_px: drift_px(&searched, pick, &scales, opts),
        ..beliefs[pick]
    };
    searched.swap_remove(pick).chosen(scales, confidence)
}

/// A picture of one size, ready to be searched, and at which depths.
struct Scale {
    /// Pixels of the whole picture for one of this one.
    reduction: usize,
    search: Search,
    depths: Vec<usize>,
}

/// One search and its setting.
struct Searched {
    /// Which of the scales it was done at.
    scale: usize,
    levels: usize,
    pass: Result<Pass>,
}

fn scales(picture: &Image<LinearRgb>, opts: &SegmentOptions) -> Vec<Scale> {
    let (w, h) = picture.size();
    let large_enough =
        |reduction: usize| reduction == 1 || w.min(h) / reduction >= SMALLEST_SEARCHED;
    let sizes: Vec<_> = SIZES
        .into_iter()
        .filter(|(reduction, _)| large_enough(*reduction))
        .collect();
    let scale = |&(reduction, depths): &(usize, &[usize])| {
        let longer = w.max(h) / reduction;
        let mut depths: Vec<usize> = depths
            .iter()
            .copied()
            .filter(|&d| d == 2 || longer >> d >= LEAST_CELLS)
            .collect();
        depths.extend(
            opts.levels
                .filter(|levels| reduction == 1 && !depths.contains(levels)),
        );
        let smaller =
            (reduction > 1).then(|| filter::resize(picture, w / reduction, h / reduction));
        let search = Search::of(
            smaller.as_ref().unwrap_or(picture),
            opts,
            depths.iter().copied().max().unwrap_or(2),
        );
        Scale {
            reduction,
            search,
            depths,
        }
    };
    sizes.par_iter().map(scale).collect()
}

fn searches(scales: &[Scale], opts: &SegmentOptions) -> Vec<Searched> {
    let settings = scales
        .iter()
        .enumerate()
        .flat_map(|(i, scale)| scale.depths.iter().map(move |&levels| (i, levels)));
    let settings: Vec<(usize, usize)> = settings.collect();
    let search = |&(scale, levels): &(usize, usize)| {
        let picture: &Scale = &scales[scale];
        Searched {
            scale,
            levels,
            pass: picture.search.at(levels, opts),
        }
    };
    settings.par_iter().map(search).collect()
}

/// So many times the cut of the first band is a stricter search: half a step of exposure.
const STRICTER: f32 = 1.4;

/// How far a side of the hull's box moves when edges must be stronger, or when the same picture is searched at another
/// depth, pixels of the whole picture. What such a search does not find at all moves by the picture's longer side.
fn drift_px(searched: &[Searched], pick: usize, scales: &[Scale], opts: &SegmentOptions) -> f64 {
    let (own, scale) = (&searched[pick], &scales[searched[pick].scale]);
    let Ok(pass) = &own.pass else { return 0.0 };
    let stricter = scale.search.at_cut(own.levels, STRICTER, opts);
    let lost = pass.inside.width().max(pass.inside.height()) as f64;
    let deeper = searched
        .iter()
        .filter(|other| other.scale == own.scale)
        .filter_map(|other| other.pass.as_ref().ok());
    let moved = deeper.map(|other| hull::farthest_side(&pass.hull, &other.hull));
    let stricter = stricter.map_or(lost, |other| hull::farthest_side(&pass.hull, &other.hull));
    scale.reduction as f64 * moved.fold(stricter, f64::max)
}

impl Searched {
    fn chosen(self, mut scales: Vec<Scale>, confidence: Confidence) -> Result<Chosen> {
        let (first, first_binary) = scales.swap_remove(self.scale).search.into_first();
        Ok(Chosen {
            pass: self.pass?,
            first,
            first_binary,
            levels: self.levels,
            confidence,
        })
    }

    /// The inside in a picture small enough to be compared quickly.
    fn compared(&self, (w, h): (usize, usize)) -> Option<Mask> {
        let pass = self.pass.as_ref().ok()?;
        let longer = w.max(h);
        let side = |len: usize| (len * COMPARED.min(longer)).div_ceil(longer);
        let inside = pass.inside.to_coverage();
        Some(filter::resize(&inside, side(w), side(h)).map(|c| c.0 > 0.5))
    }

    /// Share of the outline that lies on edges; what lies on the picture's border does not count.
    fn support(&self) -> f64 {
        let Ok(pass) = &self.pass else { return 0.0 };
        let near = filter::dilate(&pass.object, EDGE_REACH_PX);
        let core = filter::erode(&pass.inside, 1.0);
        let (w, h) = core.size();
        let (mut length, mut on_edges) = (0u64, 0u64);
        for (y, (inside, core)) in pass.inside.rows().zip(core.rows()).enumerate() {
            for x in (0..w)
                .filter(|&x| inside[x] && !core[x] && x > 0 && y > 0 && x + 1 < w && y + 1 < h)
            {
                length += 1;
                on_edges += u64::from(near[(x, y)]);
            }
        }
        on_edges as f64 / length.max(1) as f64
    }
}

/// How far from an edge pixel an outline still lies on it, pixels: the smear of the first band.
const EDGE_REACH_PX: f64 = 2.0;

/// Mean overlap of one outline with the others.
fn agreement(outlines: &[Option<Mask>], i: usize) -> f64 {
    let others = (0..outlines.len()).filter(|&j| j != i);
    let overlap = |j: usize| {
        outlines[i]
            .as_ref()
            .zip(outlines[j].as_ref())
            .map_or(0.0, |(a, b)| overlap(a, b))
    };
    others.clone().map(overlap).sum::<f64>() / others.count().max(1) as f64
}

/// Intersection over union.
fn overlap(a: &Mask, b: &Mask) -> f64 {
    let count = |holds: fn(bool, bool) -> bool| {
        a.pixels()
            .iter()
            .zip(b.pixels())
            .filter(|(a, b)| holds(**a, **b))
            .count()
    };
    count(|a, b| a && b) as f64 / count(|a, b| a || b).max(1) as f64
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
            (0.0, 0.0)
        );
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
            let chosen = best(
                &photo,
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
}
