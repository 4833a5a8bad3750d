//! Where the object is: where the display differs from the empty one.

use super::recognise::refused;
use crate::bounds::above;
use crate::error::{Error, Result};
use crate::filter;
use crate::image::{Image, Mask};
use crate::matte::{Outline, PixelGroups, filled};
use crate::pixel::{Coverage, LinearRgb};
use crate::quantile::median;

/// The object in the view.
pub(super) struct Object {
    /// What it covers.
    pub(super) coverage: Image<Coverage>,
    /// The border of that.
    pub(super) outline: Outline,
    /// Share of the border at which the object stands out well.
    pub(super) distinct: f64,
    /// What else lies on the display, specks too.
    others: Mask,
}

/// Blur of the evidence before it is judged, pixels.
const EVIDENCE_BLUR_PX: f32 = 0.7;
/// A display that looks different by less than this share of its white may be dirt or a plate that
/// is off.
const MIN_EVIDENCE: f32 = 0.03;
/// Evidence in units of what it is outside the object, in the median.
const EVIDENCE_MEDIANS: f32 = 8.0;
/// Half width of the neighbourhood whose strongest evidence says where an edge is half, pixels.
const EDGE_REACH_PX: usize = 3;
/// Gaps in the evidence up to twice this are closed, as a share of the view's shorter side.
const CLOSED_SHARE: f64 = 0.006;
/// Smallest object, as a share of the view.
pub(super) const MIN_AREA: f64 = 1e-3;
/// Two things are two objects when the fainter one changes the display's light by at least this share
/// of what the other does.
const RIVAL_SHARE: f64 = 0.1;
/// The same of things near to each other: they may be parts of one that is hardly seen between them.
const NEAR_RIVAL_SHARE: f64 = 0.3;
/// What is near, as a share of the view's shorter side.
const NEAR_SHARE: f64 = 0.03;

/// How much otherwise than empty the display looks, as a share of its white.
pub(super) fn evidence(
    [black, white]: [&Image<LinearRgb>; 2],
    [empty_black, empty_white]: [&Image<LinearRgb>; 2],
) -> Image<f32> {
    let in_white = white.zip_map(empty_white, |p, e| {
        (p.mean() - e.mean()).abs() / e.mean().max(f32::MIN_POSITIVE)
    });
    let in_black = black.zip3_map(empty_black, empty_white, |p, e, w| {
        (p.mean() - e.mean()).abs() / w.mean().max(f32::MIN_POSITIVE)
    });
    let strongest = in_white.zip_map(&in_black, f32::max);
    filter::gaussian_blur(&strongest, EVIDENCE_BLUR_PX)
}

impl Object {
    /// The largest thing in the free area of the display.
    ///
    /// # Errors
    /// [`Error::Photo`] where nothing lies there, nothing stands out from an uneven display, or
    /// something is larger than the area.
    pub(super) fn find(evidence: &Image<f32>, free: &Mask) -> Result<Self> {
        let threshold = threshold(evidence, free);
        let strongest = filter::largest_around(evidence, EDGE_REACH_PX);
        let rough = evidence.zip3_map(&strongest, free, |e, most, free| {
            free && most > threshold && e >= 0.5 * most
        });
        let pieces = solid(&rough);
        let mask = largest_piece(&pieces);
        let area = mask.count() as f64 / mask.pixels().len() as f64;
        if area < MIN_AREA {
            return Err(nothing_found(threshold));
        }
        check_within(&mask, free)?;
        let coverage = soft_coverage(&mask, evidence, &strongest);
        let distinct = distinct_share(&mask, &strongest, threshold);
        Ok(Self {
            outline: Outline::around(&coverage),
            coverage,
            distinct,
            others: pieces.zip_map(&mask, |piece, object| piece && !object),
        })
    }

    /// # Errors
    /// [`Error::Photo`] where something else on the display could be an object of its own.
    pub(super) fn check_alone(&self, evidence: &Image<f32>) -> Result<()> {
        let object = self.coverage.map(|c| c.0 >= 0.5);
        let (w, h) = object.size();
        let near = filter::dilate(&object, NEAR_SHARE * w.min(h) as f64);
        let other = largest_piece(&self.others);
        let is_near = other.zip_map(&near, |other, near| other && near).count() > 0;
        let share = if is_near {
            NEAR_RIVAL_SHARE
        } else {
            RIVAL_SHARE
        };
        let is_speck = (other.count() as f64) < MIN_AREA * (w * h) as f64;
        // Dirt and reflections are large, but faint.
        // By how much a piece changes the display's light, all its pixels together.
        let [faint, strong] =
            [&other, &object].map(|piece| evidence.pixels_in(piece).map(f64::from).sum::<f64>());
        if is_speck || faint < share * strong {
            return Ok(());
        }
        let [one, other] = [&object, &other].map(place);
        Err(refused(&format!(
            "two objects, {one} and {other} of the display; photograph them one by one, \
             wipe the display, and darken the room; what is also in photos of the empty \
             display (--empty) is not treated as an object"
        )))
    }
}

fn threshold(evidence: &Image<f32>, free: &Mask) -> f32 {
    let typical = median(evidence.pixels_in(free), f32::total_cmp).unwrap_or_default();
    MIN_EVIDENCE.max(EVIDENCE_MEDIANS * typical)
}

/// Why no object is found: there is none, or the display itself differs too much from what is
/// expected of it.
fn nothing_found(threshold: f32) -> Error {
    if threshold <= MIN_EVIDENCE {
        return refused("nothing lies on the display, or nothing that differs from it");
    }
    let [typical, most] = [threshold, MIN_EVIDENCE].map(|t| 100.0 * t / EVIDENCE_MEDIANS);
    refused(&format!(
        "nothing lies on the display, or nothing that stands out: \
         the display is uneven or changes its colour, typically by {} % of white, or the photos are noisy \
         (expected at most {most:.1} %); also photograph it empty, from the same place and in the same light (--empty)",
        above(typical, most)
    ))
}

/// A mask without gaps and holes.
fn solid(rough: &Mask) -> Mask {
    let (w, h) = rough.size();
    let radius = (CLOSED_SHARE * w.min(h) as f64).max(2.0);
    let closed = filled(&filter::dilate(rough, radius));
    filter::erode(&closed, radius)
}

/// The connected piece of most pixels.
fn largest_piece(mask: &Mask) -> Mask {
    let groups = PixelGroups::new(mask);
    let sizes = groups.sizes(mask);
    // Of several the first.
    let largest = (0..sizes.len()).rev().max_by_key(|&group| sizes[group]);
    groups.only(|group| Some(group) == largest)
}

/// Description of where a set of pixels is in the middle, as shares of the picture.
fn place(set: &Mask) -> String {
    let (w, h) = set.size();
    let pixels = (0..h).flat_map(|y| (0..w).map(move |x| (x, y)));
    let (x, y) = pixels
        .filter(|&at| set[at])
        .fold((0, 0), |(i, j), (x, y)| (i + x, j + y));
    let percent = |sum: usize, side: usize| 100 * sum / (set.count() * side).max(1);
    let [x, y] = [percent(x, w), percent(y, h)];
    format!("at {x} % of the width and {y} % of the height")
}

/// Fails where an object reaches the end of the free area.
fn check_within(mask: &Mask, free: &Mask) -> Result<()> {
    let inner = filter::erode(free, 2.0);
    let beyond = mask.zip_map(&inner, |object, free| object && !free);
    let Some(i) = beyond.pixels().iter().position(|beyond| *beyond) else {
        return Ok(());
    };
    let (w, h) = mask.size();
    let side = match ((i % w) * 3 / w, (i / w) * 3 / h) {
        (0, _) => "left",
        (2, _) => "right",
        (_, 0) => "top",
        _ => "bottom",
    };
    Err(refused(&format!(
        "the object reaches the markers or the border of the display ({side}), expected it inside; \
         use a larger display, or lay the object diagonally"
    )))
}

/// What a mask covers, its border where the evidence is half of what it is inside.
fn soft_coverage(mask: &Mask, evidence: &Image<f32>, strongest: &Image<f32>) -> Image<Coverage> {
    let core = filter::erode(mask, EDGE_REACH_PX as f64);
    let around = filter::dilate(mask, 1.5);
    let share = evidence.zip_map(strongest, |e, most| e / most.max(f32::MIN_POSITIVE));
    let rim = share.zip3_map(&around, mask, |share, around, inside| {
        if !around {
            0.0
        } else if inside {
            share.max(0.5)
        } else {
            share.min(0.5)
        }
    });
    rim.zip_map(&core, |rim, core| {
        Coverage(if core { 1.0 } else { rim.clamp(0.0, 1.0) })
    })
}

/// Share of the border near which the evidence is at least twice what is asked.
fn distinct_share(mask: &Mask, strongest: &Image<f32>, threshold: f32) -> f64 {
    let core = filter::erode(mask, 1.5);
    let border = mask.zip_map(&core, |inside, core| inside && !core);
    let distinct = border.zip_map(strongest, |border, most| border && most > 2.0 * threshold);
    distinct.count() as f64 / border.count().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_is_found_with_what_it_encloses_and_specks_are_not() {
        let far = |x: usize, y: usize| libm::hypotf(x as f32 - 60.0, y as f32 - 40.0);
        let evidence = Image::from_fn(120, 80, |x, y| {
            let rim = if (far(x, y) - 25.0).abs() < 2.0 {
                0.5
            } else {
                0.002
            };
            if (x, y) == (5, 5) { 0.5 } else { rim }
        });
        let free = Image::filled(120, 80, true);
        let object = Object::find(&evidence, &free).unwrap();
        let area: f32 = object.coverage.pixels().iter().map(|c| c.0).sum();
        let expected = std::f32::consts::PI * 27.0 * 27.0;
        assert!(
            (area / expected - 1.0).abs() < 0.06,
            "{area} for {expected}"
        );
        assert!(object.distinct > 0.99);
    }

    #[test]
    fn two_objects_are_refused_and_parts_of_one_are_not() {
        let free = Image::filled(600, 300, true);
        let checked = |wide: usize, gap: usize| {
            let start = 240 + gap;
            let evidence = Image::from_fn(600, 300, |x, y| {
                let inside = (120..240).contains(&x) || (start..start + wide).contains(&x);
                if inside && (90..210).contains(&y) {
                    0.5
                } else {
                    0.002
                }
            });
            Object::find(&evidence, &free)
                .unwrap()
                .check_alone(&evidence)
        };
        let told = checked(90, 150).unwrap_err().to_string();
        assert!(
            told.contains("two objects, at 29 % of the width and 49 % of the height and at 72 %"),
            "{told}"
        );
        assert!(checked(60, 6).is_err());
        // A small thing, and the cap of a bottle whose neck is hardly seen.
        assert!(checked(9, 150).is_ok());
        assert!(checked(24, 6).is_ok());
    }

    #[test]
    fn what_reaches_the_border_is_refused_and_nothing_too() {
        let free = Image::from_fn(120, 80, |x, y| {
            (3..117).contains(&x) && (3..77).contains(&y)
        });
        let bar = Image::from_fn(
            120,
            80,
            |_, y| if (30..50).contains(&y) { 0.5 } else { 0.0 },
        );
        let told = |evidence: &Image<f32>| Object::find(evidence, &free).err().unwrap().to_string();
        assert!(told(&bar).contains("(left)"), "{}", told(&bar));
        assert!(told(&Image::filled(120, 80, 0.001)).contains("nothing lies on the display"));
        let uneven = told(&bar.map(|e| e.max(0.1)));
        assert!(
            uneven.contains("the display is uneven or changes its colour, typically by 10.0 %")
                && uneven.contains("(--empty)"),
            "{uneven}"
        );
    }
}
