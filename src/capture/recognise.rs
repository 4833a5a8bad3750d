//! Which frame a photo shows, and where the display is in it, by the markers.

use super::display::{Display, marker_id};
use super::frame::{CORNERS, Frame};
use crate::camera::{Marker, any_markers, homography};
use crate::error::{Error, Result};
use crate::filter;
use crate::geom::{Homography, Point2};
use crate::image::Image;
use crate::pixel::LinearRgb;
use std::collections::BTreeMap;

/// Fewer markers do not show that the display is where they say.
const MIN_MARKERS: usize = 3;
const CORNER_NAMES: [&str; CORNERS] = ["top left", "top right", "bottom right", "bottom left"];

/// A photo of a frame, without its pixels.
#[derive(Clone, Debug)]
pub struct FramePhoto {
    /// The frame that it shows.
    pub frame: Frame,
    /// Width and height, pixels.
    pub size_px: [u32; 2],
    /// From pixels of the display to those of the photo.
    pub photo_from_display: Homography,
    /// Corners of the markers: on the display, in the photo.
    pub(super) pairs: Vec<(Point2<f64>, Point2<f64>)>,
    /// Light of the paper of each marker, where it is seen.
    pub(super) paper: [Option<LinearRgb>; CORNERS],
}

impl FramePhoto {
    /// Reads the markers of a scene-linear photo.
    ///
    /// # Errors
    /// [`Error::Photo`] where fewer than three markers of one frame are seen.
    pub fn read(photo: &Image<LinearRgb>, display: &Display) -> Result<Self> {
        let (frame, markers) = markers_of_frame(&tags(photo)?)?;
        let pairs = corner_pairs(display, &markers);
        let photo_from_display = map_in_front(&pairs).ok_or_else(|| {
            refused("its markers lie on one line, expected the corners of a display")
        })?;
        let paper = std::array::from_fn(|corner| {
            markers
                .contains_key(&corner)
                .then(|| paper_light(photo, display, corner, &photo_from_display))
        });
        let size_px = [photo.width() as u32, photo.height() as u32];
        Ok(Self {
            frame,
            size_px,
            photo_from_display,
            pairs,
            paper,
        })
    }

    /// Corners of the display in the photo, from the display's top left, clockwise, pixels.
    pub fn display_corners_px(&self, display: &Display) -> [Point2<f64>; 4] {
        let [w, h] = display.size_px.map(f64::from);
        [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]].map(|at| self.photo_from_display.map(at.into()))
    }

    /// How far the display lies off where it is in another photo, pixels: at its worst corner.
    pub(super) fn offset_px(&self, other: &Self, display: &Display) -> f64 {
        let corners = [self, other].map(|photo| photo.display_corners_px(display));
        farthest(&corners[0], &corners[1])
    }

    /// The same whichever way up the photos are: a camera that looks straight down does not know,
    /// and may say so differently from photo to photo.
    pub(super) fn motion_px(&self, other: &Self, display: &Display) -> f64 {
        let corners = self.display_corners_px(display);
        let upright = (
            other.display_corners_px(display),
            other.size_px.map(f64::from),
        );
        let turns = std::iter::successors(Some(upright), |&(corners, [w, h])| {
            Some((corners.map(|p| Point2::new(h - p.y, p.x)), [h, w]))
        });
        let motions = turns.take(4).map(|(turned, _)| farthest(&corners, &turned));
        motions.fold(f64::INFINITY, f64::min)
    }

    /// Factors that make the light of this photo that of another, by the paper that both show.
    pub(super) fn exposure_to(&self, other: &Self) -> [f32; 3] {
        let both = self
            .paper
            .iter()
            .zip(&other.paper)
            .filter_map(|(a, b)| Some(((*a)?, (*b)?)));
        let zero = (LinearRgb::BLACK, LinearRgb::BLACK);
        let (own, theirs) = both.fold(zero, |(a, b), (c, d)| (a + c, b + d));
        let [own, theirs] = [own, theirs].map(|light| light.channels());
        std::array::from_fn(|c| {
            if own[c] > 0.0 {
                theirs[c] / own[c]
            } else {
                1.0
            }
        })
    }
}

/// The largest distance between corners.
fn farthest(a: &[Point2<f64>; 4], b: &[Point2<f64>; 4]) -> f64 {
    let distances = a.iter().zip(b).map(|(a, b)| (a - b).norm());
    distances.fold(0.0, f64::max)
}

/// The map that takes places on the display to those in the photo, which has them in front: the
/// last coordinate is positive.
pub(super) fn map_in_front(pairs: &[(Point2<f64>, Point2<f64>)]) -> Option<Homography> {
    let map = homography(pairs)?;
    let (first, _) = pairs.first()?;
    let depth = (map.0 * first.to_homogeneous()).z;
    Some(Homography(map.0 * depth.signum()))
}

fn tags(photo: &Image<LinearRgb>) -> Result<Vec<Marker>> {
    if cfg!(feature = "markers") {
        return Ok(any_markers(photo));
    }
    Err(refused(
        "its markers cannot be read: petcomp was built without the `markers` feature",
    ))
}

/// The frame that most markers tell, and its markers by corner.
fn markers_of_frame(found: &[Marker]) -> Result<(Frame, BTreeMap<usize, Marker>)> {
    let frames = Frame::all(true).map(|frame| (frame, by_corner(frame, found)));
    let Some((frame, markers)) = frames.max_by_key(|(_, markers)| markers.len()) else {
        return Err(refused("shows no frame"));
    };
    if markers.len() >= MIN_MARKERS {
        return Ok((frame, markers));
    }
    let missing = (0..CORNERS).filter(|corner| !markers.contains_key(corner));
    let names: Vec<_> = missing.map(|corner| CORNER_NAMES[corner]).collect();
    Err(refused(&format!(
        "{} of the 4 markers of a frame were found, expected at least {MIN_MARKERS} (missing: {}); \
         are they hidden, blurred or cut off?",
        markers.len(),
        names.join(", ")
    )))
}

fn by_corner(frame: Frame, found: &[Marker]) -> BTreeMap<usize, Marker> {
    let corners = (0..CORNERS).filter_map(|corner| {
        let marker = found
            .iter()
            .find(|marker| marker.id == marker_id(frame, corner))?;
        Some((corner, *marker))
    });
    corners.collect()
}

/// The corners of markers: on the display, in the photo.
fn corner_pairs(
    display: &Display,
    markers: &BTreeMap<usize, Marker>,
) -> Vec<(Point2<f64>, Point2<f64>)> {
    let squares = display.markers().map(|marker| marker.square_px());
    let pairs = markers.iter().flat_map(|(corner, marker)| {
        let on_display = squares[*corner].into_iter().map(Point2::from);
        on_display.zip(marker.corners_px)
    });
    pairs.collect()
}

/// Mean light of the paper around a marker.
fn paper_light(
    photo: &Image<LinearRgb>,
    display: &Display,
    corner: usize,
    photo_from_display: &Homography,
) -> LinearRgb {
    let marker = display.markers()[corner];
    let places = marker
        .paper_points_px()
        .map(|at| photo_from_display.map(at.into()));
    let light = places.map(|at| filter::sample_bilinear_clamped(photo, at.x, at.y));
    let (sum, count) = light.fold((LinearRgb::BLACK, 0.0_f32), |(sum, n), p| {
        (sum + p, n + 1.0)
    });
    sum.scale(1.0 / count.max(1.0))
}

pub(super) fn refused(what: &str) -> Error {
    Error::Photo { what: what.into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    const DISPLAY: Display = Display {
        size_px: [640, 400],
        width: None,
    };

    fn photo(size_px: [u32; 2], photo_from_display: Matrix3<f64>) -> FramePhoto {
        FramePhoto {
            frame: Frame::White,
            size_px,
            photo_from_display: Homography(photo_from_display),
            pairs: Vec::new(),
            paper: [None; CORNERS],
        }
    }

    #[test]
    fn a_photo_that_is_flagged_another_way_up_has_not_moved() {
        let seen = |dx| Matrix3::new(1.4, 0.0, 30.0 + dx, 0.0, 1.4, 50.0, 0.0, 0.0, 1.0);
        let quarter_turn = |high: u32| {
            let high = f64::from(high);
            Matrix3::new(0.0, -1.0, high, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        };
        let reference = photo([960, 660], seen(0.0));
        let (mut size, mut turn) = ([960, 660], Matrix3::<f64>::identity());
        for _ in 0..3 {
            turn = quarter_turn(size[1]) * turn;
            size = [size[1], size[0]];
            let [still, moved] = [0.0, 3.0].map(|dx| photo(size, turn * seen(dx)));
            assert!(still.offset_px(&reference, &DISPLAY) > 100.0);
            assert!(still.motion_px(&reference, &DISPLAY) < 1e-9);
            assert!((moved.motion_px(&reference, &DISPLAY) - 3.0).abs() < 1e-9);
        }
    }
}
