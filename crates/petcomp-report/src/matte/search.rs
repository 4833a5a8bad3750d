//! How large a picture the object is searched in: error of the outline and of the box against run time.
//!
//! Bottles made in code have an outline in closed form; each is photographed by cameras of fewer and of more pixels.

use super::made;
use super::score::box_error;
use super::truth::Known;
use crate::clock::timed;
use crate::{Diagram, Point};
use petcomp::Coverage;
use petcomp::Image;
use petcomp::Quality;
use petcomp::Result;
use petcomp::matte::{CutOutOptions, SegmentOptions, segment};

/// Longer sides of the picture that is searched, pixels: those of the qualities, half of the least and double the most.
const SIDES: [usize; 5] = [160, 320, 640, 1280, 2560];
/// Pixels of the photos along each side, as multiples of the least.
const TIMES: [usize; 3] = [1, 2, 4];
const USUAL_TIMES: usize = 4;
/// Means over the photos are even enough.
const RUNS: usize = 1;

/// Errors and seconds of one search.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    /// 1 - IoU of coverage.
    outline: f64,
    /// The side of the box that is farthest off, pixels of the photo.
    box_px: f64,
    seconds: f64,
}

/// Overlap of the outline, and the box, each against time, of so many bottles: four, or fewer for a look.
///
/// # Errors
/// As [`segment`]; a thread that cannot be had.
pub fn searches(bottles: usize) -> Result<Vec<Diagram>> {
    let (mut outlines, mut boxes) = (Vec::new(), Vec::new());
    for times in TIMES {
        let photos: Vec<Known> = (0..bottles.min(made::COUNT))
            .map(|i| made::enlarged(i, times))
            .collect();
        let longer = photos
            .iter()
            .map(|known| known.photo.width())
            .max()
            .unwrap_or(0);
        // A photo is not enlarged to be searched.
        for side in SIDES.into_iter().filter(|side| *side <= longer) {
            let found = searched(&photos, side)?;
            let point = |error: f64| {
                Point::new(
                    format!("photos {longer} px wide"),
                    format!("{side} px"),
                    found.seconds,
                    error,
                )
                .used_where(|quality| times == USUAL_TIMES && side == side_of(quality))
            };
            outlines.push(point(found.outline));
            boxes.push(point(found.box_px));
        }
    }
    Ok(vec![
        diagram(
            "matte_search_outline",
            "matte: size of the search, outline",
            "1 - IoU",
            bottles,
            outlines,
        ),
        diagram(
            "matte_search_box",
            "matte: size of the search, box",
            "error of the box, px of the photo",
            bottles,
            boxes,
        ),
    ])
}

fn side_of(quality: Quality) -> usize {
    quality
        .cut_out(CutOutOptions::default())
        .segment
        .working_size
}

/// Means over the photos.
fn searched(photos: &[Known], working_size: usize) -> Result<Found> {
    let options = SegmentOptions {
        working_size,
        ..SegmentOptions::default()
    };
    let found: Vec<Found> = photos
        .iter()
        .map(|known| search(known, &options))
        .collect::<Result<_>>()?;
    let mean =
        |of: fn(&Found) -> f64| found.iter().map(of).sum::<f64>() / found.len().max(1) as f64;
    Ok(Found {
        outline: mean(|f| f.outline),
        box_px: mean(|f| f.box_px),
        seconds: mean(|f| f.seconds),
    })
}

fn search(known: &Known, options: &SegmentOptions) -> Result<Found> {
    let (found, seconds) = timed(RUNS, || segment(&known.photo, options))?;
    let outline = 1.0 - overlap(&found.tight, &known.mask);
    Ok(Found {
        outline,
        box_px: box_error(&found.hull, known.box_px),
        seconds,
    })
}

/// Intersection over union, where a pixel counts as far as it is covered.
fn overlap(a: &Image<Coverage>, b: &Image<Coverage>) -> f64 {
    let pairs = || a.pixels().iter().zip(b.pixels());
    let sum = |of: fn(f32, f32) -> f32| pairs().map(|(a, b)| f64::from(of(a.0, b.0))).sum::<f64>();
    sum(f32::min) / sum(f32::max).max(f64::MIN_POSITIVE)
}

fn diagram(file: &str, title: &str, error: &str, bottles: usize, points: Vec<Point>) -> Diagram {
    Diagram {
        file: file.into(),
        title: title.into(),
        input: format!("{bottles} see-through bottles on an uneven screen with noise, made in code"),
        error: error.into(),
        cost: "CPU seconds per photo".into(),
        reference: "the bottles' outline (closed form)".into(),
        points,
        inputs: true,
        why: "However large a photo is, its outline is moved to where the photo itself changes, so that a search of 640 px \
              is right to 0.2 % of the object; a box that is a few pixels off in a photo of 2400 is so by a fraction of one in a \
              picture of 640 that the object is put into. Draft and reference move along the curve."
            .into(),
        ..Diagram::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_quality_searches_a_size_that_is_measured() {
        assert!(Quality::ALL.iter().all(|q| SIDES.contains(&side_of(*q))));
    }

    #[test]
    fn a_search_is_held_against_the_closed_form() {
        let found = searched(&[made::enlarged(1, 1)], side_of(Quality::Draft)).unwrap();
        assert!(
            found.outline < 0.03 && found.box_px < 3.0 && found.seconds > 0.0,
            "{found:?}"
        );
    }

    #[test]
    fn a_larger_camera_sees_the_same_bottle() {
        let [small, large] = [1, 2].map(|times| made::enlarged(2, times));
        let area = |known: &Known| {
            known
                .mask
                .pixels()
                .iter()
                .map(|c| f64::from(c.0))
                .sum::<f64>()
        };
        assert!((area(&large) / area(&small) / 4.0 - 1.0).abs() < 1e-3);
        assert_eq!(large.box_px, small.box_px.map(|side| 2.0 * side));
        assert!((overlap(&small.mask, &small.mask) - 1.0).abs() < 1e-12);
    }
}
