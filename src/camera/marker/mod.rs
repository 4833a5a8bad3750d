//! Printed square markers in a photo, with corners to a fraction of a pixel: ArUco `DICT_4X4_50` by
//! our own detector, AprilTags (`tag36h11`) by the AprilTag library where petcomp is built with the
//! feature `markers`.
//!
//! # Method
//! Dark regions of a locally thresholded picture whose hull has four corners are candidates; each
//! side is then fitted as a straight edge in linear light, neighbours meet in the corners, and the
//! cells in between are read as bits. Their edges show how far an overexposed white has grown over
//! the black, and the corners are moved back by that; they also show the uncertainty of the
//! outline, which from a steep side and out of focus is larger than from above. The bits are looked
//! up in the dictionary in all four rotations, one wrong bit allowed, so that corner 0 is the
//! printed top left. Corners that the AprilTag library finds are refined and corrected in the same
//! way.

#[cfg(feature = "markers")]
mod april;
mod candidate;
mod dictionary;
mod edge;

use super::chi::CHI2_99;
use super::label::{Label, LabelPoint, MarkerMap};
use super::options::SolveOptions;
use super::rectangle::corner_points;
use super::solution::Fit;
use super::solve::solve;
use crate::error::{Error, Result};
use crate::geom::{Point2, Vector3};
use crate::image::Image;
use crate::pixel::LinearRgb;
use edge::{EdgeSearch, MOST_REACH_PX};
use std::collections::BTreeMap;

/// The family of markers that is always found.
pub(crate) const FAMILY: &str = "DICT_4X4_50";
/// How far across a side its edge is looked for, as a share of the marker: its border is a sixth
/// wide, and so should be the paper's margin.
const REACH: f64 = 0.1;
/// Across an edge light rises by more than this, scene-linear.
const MIN_RISE: f64 = 0.02;
/// Least noise of a corner that a label states, pixels: lenses bend and paper is not flat, which no
/// marker by itself shows. Root mean square on the sample background with markers.
const MIN_STATED_SIGMA_PX: f64 = 0.15;
/// Markers that fit less well than this are tried in the other directions, too.
const POOR_FIT_P: f64 = 1e-4;

/// A marker in a photo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marker {
    /// Its number in the dictionary.
    pub id: u32,
    /// Corners of its black square as printed: top left, top right, bottom right, bottom left,
    /// pixels.
    pub corners_px: [Point2<f64>; 4],
    /// Standard deviation of their coordinates, pixels.
    pub sigma_px: f64,
}

/// All markers of the family DICT_4X4_50 in a scene-linear photo, in order of number and then of
/// place.
pub fn find_markers(photo: &Image<LinearRgb>) -> Vec<Marker> {
    let light = photo.map(LinearRgb::luminance);
    let mut found: Vec<Marker> = candidate::quads(photo)
        .iter()
        .filter_map(|rough| marker_at(&light, rough))
        .collect();
    found.sort_by(|a, b| {
        let [left, right] = [a, b].map(|marker| marker.corners_px[0].x);
        a.id.cmp(&b.id).then(left.total_cmp(&right))
    });
    found
}

/// The marker between four rough corners.
fn marker_at(light: &Image<f32>, rough: &[Point2<f64>; 4]) -> Option<Marker> {
    let search = EdgeSearch {
        light,
        reach: REACH,
        min_rise: MIN_RISE,
        most_reach_px: MOST_REACH_PX,
    };
    let fine = edge::refined(search, rough)?;
    let reading = dictionary::read(light, &fine.px)?;
    let corners = edge::by_cells(&fine, &reading.cells)?;
    Some(Marker {
        id: reading.id,
        corners_px: [0, 1, 2, 3].map(|i| corners.px[(i + reading.turns) % 4]),
        sigma_px: corners.sigma_px,
    })
}

/// The markers of every known family, for when only their size is given.
pub fn any_markers(photo: &Image<LinearRgb>) -> Vec<Marker> {
    #[cfg(feature = "markers")]
    {
        let tags = april::find(photo, super::label::Artwork::Apriltag);
        if !tags.is_empty() {
            return tags;
        }
    }
    // The dictionary's, none of them stated better than in general.
    let mut found = find_markers(photo);
    for marker in &mut found {
        marker.sigma_px = marker.sigma_px.max(MIN_STATED_SIGMA_PX);
    }
    found
}

/// The label with the corners of its markers, found in its photo, as points of known place; those
/// that it had before are dropped.
///
/// A number that the photo shows several times is left out, with a message in the log: only one of
/// its markers can be where the map says.
///
/// Where the corners fit the map only when every marker is turned by the same angle, they are
/// turned, with a message in the log: another program's artwork was printed, or the map has other
/// axes.
///
/// # Errors
/// [`Error::Value`] for a label without a marker map, one of a family that is not known or without
/// a size, and a photo that shows none of its markers.
pub fn with_markers(mut label: Label, photo: &Image<LinearRgb>) -> Result<Label> {
    label.points.retain(|point| !point.is_marker_corner());
    let layout = MarkerLayout::find(&label, photo)?;
    let turns = layout.fitting_turns();
    if turns > 0 {
        let degrees = 90 * turns;
        log::warn!(
            "markers: they fit the map only when rotated by {degrees} degrees; check markers.artwork and the map's axes"
        );
    }
    Ok(layout.label_turned(turns))
}

fn marker_map(label: &Label) -> Result<&MarkerMap> {
    let missing = || Error::value("markers", "missing, expected family, size_m and map");
    let map = label.markers.as_ref().ok_or_else(missing)?;
    if map.size_m > 0.0 {
        return Ok(map);
    }
    let what = format!("{}, expected a positive number", map.size_m);
    Err(Error::value("markers.size_m", what))
}

/// The markers of a map's family, and the least noise that is stated of their corners.
fn find_family(map: &MarkerMap, photo: &Image<LinearRgb>) -> Result<(Vec<Marker>, f64)> {
    match map.family.as_str() {
        FAMILY => Ok((find_markers(photo), MIN_STATED_SIGMA_PX)),
        #[cfg(feature = "markers")]
        april::FAMILY => Ok((april::find(photo, map.artwork), april::CORNER_SIGMA_PX)),
        #[cfg(not(feature = "markers"))]
        "tag36h11" => Err(Error::value(
            "markers.family",
            "\"tag36h11\", but petcomp was built without the `markers` feature",
        )),
        other => Err(Error::value(
            "markers.family",
            format!("\"{other}\", expected \"{FAMILY}\" or \"tag36h11\""),
        )),
    }
}

fn expect_some(found: &[Marker], what: &str) -> Result<()> {
    match found {
        [] => Err(Error::value("markers", what)),
        _ => Ok(()),
    }
}

/// The markers whose number was found once; a warning for each of the others.
fn without_repeated(mut found: Vec<Marker>) -> Vec<Marker> {
    let mut counts = BTreeMap::new();
    for marker in &found {
        *counts.entry(marker.id).or_insert(0) += 1;
    }
    for (id, count) in counts.iter().filter(|(_, count)| **count > 1) {
        log::warn!("markers: number {id} was found {count} times, expected once; it is left out");
    }
    found.retain(|marker| counts[&marker.id] == 1);
    found
}

/// Markers that were found in the photo of a label with a marker map.
struct MarkerLayout<'a> {
    label: &'a Label,
    map: &'a MarkerMap,
    found: Vec<Marker>,
    /// Least noise that is stated of their corners, pixels.
    min_sigma_px: f64,
}

impl<'a> MarkerLayout<'a> {
    /// Those of the label's map that the photo shows once, at least one.
    fn find(label: &'a Label, photo: &Image<LinearRgb>) -> Result<Self> {
        let map = marker_map(label)?;
        let (mut found, min_sigma_px) = find_family(map, photo)?;
        found.retain(|marker| map.map.contains_key(&marker.id));
        expect_some(&found, "none of them was found in the photo")?;
        let found = without_repeated(found);
        expect_some(&found, "each was found several times in the photo")?;
        Ok(Self {
            label,
            map,
            found,
            min_sigma_px,
        })
    }

    /// The label with the corners of the markers as points, each marker turned by `turns` right
    /// angles.
    fn label_turned(&self, turns: usize) -> Label {
        let mut label = self.label.clone();
        for marker in &self.found {
            label.points.extend(self.points(marker, turns));
        }
        label
    }

    /// The corners of a marker where the map has it; none where it has not.
    fn points(&self, marker: &Marker, turns: usize) -> impl Iterator<Item = LabelPoint> {
        let marker = *marker;
        let center = self.map.map.get(&marker.id);
        center.into_iter().flat_map(move |&center| {
            let corners = corner_points([self.map.size_m; 2]);
            [0, 1, 2, 3].map(|i| LabelPoint {
                xyz_m: (corners[i] + Vector3::from(center)).into(),
                px: self.label.labelled_px(marker.corners_px[(i + turns) % 4]),
                sigma_px: Some(marker.sigma_px.max(self.min_sigma_px)),
                note: Some(format!("marker {}", marker.id)),
            })
        })
    }

    /// By how many right angles the markers have to be turned for a camera to fit clearly better
    /// than as they are; 0 where the photo does not decide it.
    fn fitting_turns(&self) -> usize {
        let straight = self.fit(0);
        if straight.is_some_and(|fit| fit.p_value.is_none_or(|p| p >= POOR_FIT_P)) {
            return 0;
        }
        (1..4)
            .map(|turns| (turns, chi2_or_infinite(self.fit(turns))))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .filter(|(_, chi2)| chi2 + CHI2_99 < chi2_or_infinite(straight))
            .map_or(0, |(turns, _)| turns)
    }

    /// How well a camera fits the markers when they are turned.
    fn fit(&self, turns: usize) -> Option<Fit> {
        let label = self.label_turned(turns);
        let solution = solve(&label, &SolveOptions::default()).ok()?;
        Some(solution.fit)
    }
}

fn chi2_or_infinite(fit: Option<Fit>) -> f64 {
    fit.map_or(f64::INFINITY, |fit| fit.chi2)
}

#[cfg(test)]
pub(crate) use tests::printed;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::simulate::Scenario;
    use crate::camera::{Camera, project_picture};
    use crate::filter::{Pyramid, gaussian_blur};
    use crate::pixel::Coverage;

    /// Marker `id` as printed, with a margin of one cell, `cell` pixels to the cell.
    pub(crate) fn printed(id: u32, cell: usize) -> Image<LinearRgb> {
        Image::from_fn(8 * cell, 8 * cell, |x, y| {
            let is_white = dictionary::is_white(id, x / cell, y / cell);
            LinearRgb::grey(if is_white { 0.8 } else { 0.04 })
        })
    }

    /// What a camera sees of a printed marker, with its margin 0.4 m large, on a grey table.
    fn on_table(camera: &Camera, id: u32, cell: usize) -> Image<LinearRgb> {
        let (sheet, size) = (printed(id, cell), [0.4, 0.4]);
        let paper = Pyramid::new(sheet.map(|_| Coverage(1.0)));
        let paper = project_picture(&paper, camera, 0.0, size);
        let seen = project_picture(&Pyramid::new(sheet), camera, 0.0, size);
        seen.zip_map(&paper, |p, a| p + LinearRgb::grey(0.3 * (1.0 - a.0)))
    }

    #[test]
    fn printed_markers_are_found_to_a_tenth_of_a_pixel() {
        for (id, tilt) in [(0, 0.0), (7, 20.0), (23, 40.0), (49, 55.0)] {
            let scenario = Scenario {
                image: [400, 300],
                focal_px: 320.0,
                size: [0.4, 0.4],
                ..Scenario::default()
            };
            let camera = scenario.tilted(tilt).view(5, u64::from(id)).camera;
            let found = find_markers(&on_table(&camera, id, 24));
            assert_eq!(
                found.iter().map(|m| m.id).collect::<Vec<_>>(),
                [id],
                "{tilt}"
            );
            for (i, error) in errors_px(&found[0], &camera).into_iter().enumerate() {
                assert!(error < 0.15, "{id} at {tilt}, corner {i}: {error}");
            }
        }
    }

    #[test]
    fn a_large_marker_is_found_out_of_focus() {
        // 69 pixels to the cell, on a grey table.
        let sheet = printed(3, 69);
        let [left, top] = [300, 200];
        let sharp = Image::from_fn(1200, 1000, |x, y| {
            let on_sheet = (left..left + 552).contains(&x) && (top..top + 552).contains(&y);
            match on_sheet {
                true => sheet[(x - left, y - top)],
                false => LinearRgb::grey(0.3),
            }
        });
        let found = find_markers(&gaussian_blur(&sharp, 6.0));
        assert_eq!(found.iter().map(|m| m.id).collect::<Vec<_>>(), [3]);
        let [x, y] = [left, top].map(|from| from as f64 + 69.0);
        let truth = [[0.0, 0.0], [414.0, 0.0], [414.0, 414.0], [0.0, 414.0]];
        for (px, [right, down]) in found[0].corners_px.iter().zip(truth) {
            let off = (px - Point2::new(x + right, y + down)).norm();
            assert!(off < 0.3, "{off}");
        }
    }

    /// A photo of one marker on a grey table, and its camera.
    fn photo(id: u32, tilt: f64, fill: f64, k: u64) -> (Image<LinearRgb>, Camera) {
        let scenario = Scenario {
            image: [320, 240],
            focal_px: 300.0,
            size: [0.4, 0.4],
            fill,
            ..Scenario::default()
        };
        let camera = scenario.tilted(tilt).view(11, k).camera;
        (on_table(&camera, id, 16), camera)
    }

    /// Normal noise, as the sum of twelve uniform numbers.
    fn noisy(photo: &Image<LinearRgb>, sigma: f32) -> Image<LinearRgb> {
        let width = photo.width();
        let uniform = |i: usize| {
            let seed = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            ((seed ^ (seed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as f32 / 16_777_216.0
        };
        Image::from_fn(width, photo.height(), |x, y| {
            let noise = (0..12)
                .map(|i| uniform(12 * (y * width + x) + i))
                .sum::<f32>()
                - 6.0;
            photo[(x, y)] + LinearRgb::grey(sigma * noise)
        })
    }

    /// Distances of a found marker's corners from the truth.
    fn errors_px(found: &Marker, camera: &Camera) -> [f64; 4] {
        let truth = corner_points([0.3; 2]).map(|corner| camera.project(corner).unwrap().0);
        [0, 1, 2, 3].map(|i| (found.corners_px[i] - truth[i]).norm())
    }

    /// The same in those that its standard deviation makes expect.
    fn ratios(found: &Marker, camera: &Camera) -> [f64; 4] {
        let expected = found.sigma_px * (std::f64::consts::PI / 2.0).sqrt();
        errors_px(found, camera).map(|error| error / expected)
    }

    #[test]
    fn corners_are_as_sure_as_they_say_from_any_side_sharp_or_blurred() {
        for tilt in [0.0, 45.0, 59.0] {
            let mut all = [const { Vec::new() }; 3];
            for (k, fill) in (0..8).zip([0.9, 0.3].into_iter().cycle()) {
                let (sharp, camera) = photo(k as u32 * 6, tilt, fill, k);
                for (blur, all) in [0.0, 0.7, 1.2].into_iter().zip(&mut all) {
                    let photo = if blur > 0.0 {
                        gaussian_blur(&sharp, blur)
                    } else {
                        sharp.clone()
                    };
                    all.extend(
                        find_markers(&noisy(&photo, 0.01))
                            .iter()
                            .flat_map(|found| ratios(found, &camera)),
                    );
                }
            }
            for (blur, all) in ["sharp", "soft", "blurred"].into_iter().zip(&all) {
                let mean = all.iter().sum::<f64>() / all.len() as f64;
                let most = all.iter().copied().fold(0.0, f64::max);
                println!(
                    "{tilt} degrees, {blur}: {} corners, errors {mean:.2} times as large as stated, at most {most:.2}",
                    all.len()
                );
                assert!(
                    all.len() >= 20 && (0.5..1.5).contains(&mean),
                    "{tilt} degrees, {blur}: {mean} of {}",
                    all.len()
                );
            }
        }
    }

    #[test]
    fn markers_without_a_size_are_refused() {
        for size_m in [0.0, -0.1, f64::NAN] {
            let mut label = Scenario::default().view(1, 0).label;
            label.markers = Some(MarkerMap {
                family: FAMILY.into(),
                artwork: Default::default(),
                size_m,
                map: [(0, [0.0; 3])].into(),
            });
            let refusal = with_markers(label, &printed(0, 24))
                .unwrap_err()
                .to_string();
            assert!(refusal.contains("markers.size_m"), "{refusal}");
        }
    }

    /// A label whose map has these markers in a row.
    fn label_of(image: [u32; 2], ids: &[u32]) -> Label {
        let mut label = Label::new(image, [[0.0; 2]; 4], [0.6, 0.2]);
        label.surface.corners_px = None;
        let places = ids.iter().map(|&id| (id, [0.1 * f64::from(id), 0.0, 0.0]));
        label.markers = Some(MarkerMap {
            family: FAMILY.into(),
            artwork: Default::default(),
            size_m: 0.05,
            map: places.collect(),
        });
        label
    }

    /// Printed markers in a row on a grey table.
    fn row_of(ids: &[u32]) -> Image<LinearRgb> {
        let sheets: Vec<_> = ids.iter().map(|&id| printed(id, 10)).collect();
        Image::from_fn(100 * ids.len(), 100, |x, y| {
            let (sheet, [x, y]) = (&sheets[x / 100], [x % 100, y]);
            let is_sheet = (10..90).contains(&x) && (10..90).contains(&y);
            match is_sheet {
                true => sheet[(x - 10, y - 10)],
                false => LinearRgb::grey(0.3),
            }
        })
    }

    #[test]
    fn a_number_that_is_there_twice_is_left_out() {
        let photo = row_of(&[4, 1, 2, 1]);
        let label = label_of([400, 100], &[1, 2, 3, 4]);
        let label = with_markers(label, &photo).unwrap();
        let notes: Vec<_> = label.points.iter().flat_map(|p| &p.note).collect();
        assert_eq!(notes[..4], ["marker 2"; 4]);
        assert_eq!(notes[4..], ["marker 4"; 4]);
    }

    #[test]
    fn markers_that_are_all_there_twice_are_an_error() {
        let photo = row_of(&[1, 2, 2, 1]);
        let refusal = with_markers(label_of([400, 100], &[1, 2]), &photo).unwrap_err();
        assert_eq!(
            refusal.to_string(),
            "markers: each was found several times in the photo"
        );
    }

    #[test]
    fn nothing_is_found_where_nothing_is() {
        assert!(find_markers(&Image::filled(100, 80, LinearRgb::WHITE)).is_empty());
        assert!(find_markers(&Image::new(0, 0)).is_empty());
        let noise = Image::from_fn(200, 200, |x, y| {
            let v = ((x * 7919 + y * 104_729) % 97) as f32 / 97.0;
            LinearRgb::grey(v)
        });
        assert!(find_markers(&noise).is_empty());
    }
}
