//! Labels of a shape with known area: polygon compared with raster, error against run time and
//! number of points.
//!
//! The shape is an ellipse, the reference its closed form. The error is 1 - IoU: for a mask from 16
//! x 16 points per pixel; for a polygon inscribed in the ellipse from the area that it lacks; for
//! any other polygon from chords along 16 lines per pixel.

mod ellipse;

use super::clock::timed;
use super::{Diagram, Point};
use ellipse::{ELLIPSE_HALF_M, Ellipse, Ring};
use petcomp::DeepImage;
use petcomp::Result;
use petcomp::geom::doubled_area;
use petcomp::label::{LabelOptions, Labels, RleMask, label, outline_of, trace};
use petcomp::scene::Shot;

/// Pictures: the default size, its half and its double.
const SIZES_PX: [[u32; 2]; 3] = [[320, 240], DEFAULT_SIZE_PX, [1280, 960]];
const DEFAULT_SIZE_PX: [u32; 2] = [640, 480];
/// Minimum covered shares of a pixel.
const THRESHOLDS: [f32; 4] = [0.02, 0.1, 0.25, 0.5];
/// Numbers of corners of the polygon.
const CORNERS: [usize; 5] = [8, 16, 32, 64, 128];
const SHOT_CORNERS: usize = 64;
/// Maximum distances of a simplified border from that of the mask, pixels.
const TOLERANCES_PX: [f64; 6] = [0.5, 0.75, 1.0, 1.5, 2.0, 4.0];
const TIMED_RUNS: usize = 7;

/// Error against time, and against the number of written points.
pub(crate) fn diagrams() -> Result<Vec<Diagram>> {
    let mut found = LabelPoints::default();
    for size in SIZES_PX {
        found.add_picture(&EllipsePicture::new(size))?;
    }
    for corners in CORNERS {
        found.add_outline(corners)?;
    }
    Ok(found.into_diagrams())
}

/// The ellipse as seen in a picture.
struct EllipsePicture {
    size: [u32; 2],
    ellipse: Ellipse,
    shot: Shot,
    deep: DeepImage,
}

impl EllipsePicture {
    fn new(size: [u32; 2]) -> Self {
        let ellipse = Ellipse::seen_by(size);
        Self {
            size,
            shot: ellipse.shot(SHOT_CORNERS),
            deep: ellipse.deep(),
            ellipse,
        }
    }

    /// All thresholds in the picture of the default size, the default one in others.
    fn thresholds(&self) -> impl Iterator<Item = f32> + use<> {
        let has_all = self.size == DEFAULT_SIZE_PX;
        THRESHOLDS
            .into_iter()
            .filter(move |threshold| has_all || *threshold == default_threshold())
    }

    fn measure_mask(&self, alpha_threshold: f32) -> Result<MeasuredMask> {
        let options = LabelOptions {
            alpha_threshold,
            ..LabelOptions::default()
        };
        let (labels, seconds) = timed(TIMED_RUNS, || Ok(label(&self.deep, &self.shot, &options)))?;
        let mask = only_mask(&labels);
        Ok(MeasuredMask {
            name: self.setting_name(alpha_threshold),
            error: 1.0 - self.ellipse.iou(&mask),
            mask,
            seconds,
            is_default: self.is_default(alpha_threshold),
        })
    }

    fn setting_name(&self, alpha_threshold: f32) -> String {
        if self.size == DEFAULT_SIZE_PX {
            format!("alpha {alpha_threshold}")
        } else {
            format!("{} px wide", self.size[0])
        }
    }

    fn is_default(&self, alpha_threshold: f32) -> bool {
        self.size == DEFAULT_SIZE_PX && alpha_threshold == default_threshold()
    }
}

/// A mask, and the cost of computing it from deep samples.
struct MeasuredMask {
    name: String,
    mask: RleMask,
    seconds: f64,
    error: f64,
    is_default: bool,
}

impl MeasuredMask {
    fn point(&self, curve: &str, cost: f64) -> Point {
        Point::new(curve, &self.name, cost, self.error)
    }

    /// A point that is the default if the mask is.
    fn marked(&self, point: Point) -> Point {
        point.used_where(|_| self.is_default)
    }

    /// Polygons around the mask, and the seconds that they take.
    fn measure_polygons(&self, tolerance_px: f64) -> Result<(Vec<Ring>, f64)> {
        timed(TIMED_RUNS, || Ok(trace::polygons(&self.mask, tolerance_px)))
    }
}

/// Points of both diagrams.
#[derive(Default)]
struct LabelPoints {
    by_time: Vec<Point>,
    by_length: Vec<Point>,
}

impl LabelPoints {
    fn add_picture(&mut self, picture: &EllipsePicture) -> Result<()> {
        for threshold in picture.thresholds() {
            let found = picture.measure_mask(threshold)?;
            self.add_mask(&found)?;
            if found.is_default {
                self.add_simplified(&found, &picture.ellipse)?;
            }
        }
        Ok(())
    }

    /// A mask, as runs and as the polygon along its pixels.
    fn add_mask(&mut self, found: &MeasuredMask) -> Result<()> {
        let (rings, more) = found.measure_polygons(0.0)?;
        let polygon = [found.seconds + more, count_corners(&rings)]
            .map(|cost| found.point("polygon along pixels", cost));
        let [by_time, by_length] = polygon;
        let mask = found.point("mask", found.seconds);
        let runs = found.point("mask (runs)", found.mask.runs().len() as f64);
        self.by_time.extend([found.marked(mask), by_time]);
        self.by_length.extend([found.marked(by_length), runs]);
        Ok(())
    }

    /// Polygons of a mask with fewer corners.
    fn add_simplified(&mut self, found: &MeasuredMask, ellipse: &Ellipse) -> Result<()> {
        for tolerance in TOLERANCES_PX {
            let (rings, more) = found.measure_polygons(tolerance)?;
            let error = 1.0 - ellipse.iou_of_rings(&rings);
            let name = format!("within {tolerance} px");
            let costs = [found.seconds + more, count_corners(&rings)];
            self.add_polygon("simplified polygon", &name, costs, error);
        }
        Ok(())
    }

    /// The outline of the geometry with this number of corners.
    fn add_outline(&mut self, corners: usize) -> Result<()> {
        let ellipse = Ellipse::seen_by(DEFAULT_SIZE_PX);
        let shot = ellipse.shot(corners);
        let (rings, seconds) = timed(TIMED_RUNS, || Ok(outline_of(&shot.cards[0], &shot.camera)))?;
        let error = 1.0 - total_area(&rings) / ellipse.area();
        let name = format!("{corners} corners");
        let costs = [seconds, count_corners(&rings)];
        self.add_polygon("projected outline", &name, costs, error);
        Ok(())
    }

    /// A polygon with its seconds and its corners.
    fn add_polygon(&mut self, curve: &str, name: &str, [time, length]: [f64; 2], error: f64) {
        self.by_time.push(Point::new(curve, name, time, error));
        self.by_length.push(Point::new(curve, name, length, error));
    }

    fn into_diagrams(self) -> Vec<Diagram> {
        vec![time_diagram(self.by_time), length_diagram(self.by_length)]
    }
}

fn time_diagram(points: Vec<Point>) -> Diagram {
    Diagram {
        file: "label_time".into(),
        title: "label: polygon and raster, error against time".into(),
        cost: "CPU seconds of a picture".into(),
        points,
        ..label_diagram()
    }
}

fn length_diagram(points: Vec<Point>) -> Diagram {
    Diagram {
        file: "label_points".into(),
        title: "label: polygon and raster, error against points".into(),
        cost: "corners, or runs of a mask".into(),
        points,
        ..label_diagram()
    }
}

/// Properties shared by both diagrams.
fn label_diagram() -> Diagram {
    Diagram {
        input: input_words(),
        error: "1 - IoU".into(),
        reference: "the ellipse (closed form)".into(),
        why: "Masks are computed from the deep samples, like the picture, so they agree with the visible parts of \
              see-through objects; the outline is purely geometric. A pixel counts from a coverage of 0.1, at which \
              film can still be distinguished from noise: masks are therefore a fraction of a pixel too wide, and \
              boxes contain the whole object. Polygons keep all corners of their pixels unless a recipe sets a \
              tolerance (`labels.simplify`)."
            .into(),
        ..Diagram::default()
    }
}

fn input_words() -> String {
    let [long, short] = ELLIPSE_HALF_M.map(|half| 2e3 * half);
    let [w, h] = DEFAULT_SIZE_PX;
    let threshold = default_threshold();
    format!(
        "an ellipse of {long:.0} x {short:.0} mm from straight above; {w} x {h} px and alpha {threshold} unless stated otherwise"
    )
}

fn default_threshold() -> f32 {
    LabelOptions::default().alpha_threshold
}

/// The mask of the one object.
fn only_mask(labels: &Labels) -> RleMask {
    labels
        .objects
        .first()
        .map(|object| object.amodal_mask.clone())
        .unwrap_or_default()
}

fn total_area(rings: &[Ring]) -> f64 {
    let areas = rings.iter().map(|ring| 0.5 * doubled_area(ring).abs());
    areas.sum()
}

fn count_corners(rings: &[Ring]) -> f64 {
    rings.iter().map(Vec::len).sum::<usize>() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use petcomp::geom::sides;
    use std::f64::consts::TAU;

    #[test]
    fn the_outline_and_the_raster_show_the_same_ellipse() {
        let ellipse = Ellipse::seen_by([160, 120]);
        let shot = ellipse.shot(128);
        let rings = outline_of(&shot.cards[0], &shot.camera);
        let ring = &rings[0];
        assert!(
            ring.iter()
                .all(|p| (ellipse.level(p.x, p.y) - 1.0).abs() < 1e-5),
            "corners lie on it"
        );
        // An inscribed polygon of n corners lacks 1 - sin(2 pi / n) / (2 pi / n) of the area.
        let turn = TAU / 128.0;
        // `geo` snaps corners to 2^-30 of the extent, 1.5e-7 pixels of half lengths of 8 and 24.
        assert!((total_area(&rings) / ellipse.area() - libm::sin(turn) / turn).abs() < 1e-7);
        let half = LabelOptions {
            alpha_threshold: 0.5,
            ..LabelOptions::default()
        };
        let mask = only_mask(&label(&ellipse.deep(), &shot, &half));
        // A pixel on the border is wrong by at most a half, and by a quarter on average.
        let border: f64 = sides(ring).map(|[a, b]| (b - a).norm()).sum();
        assert!(
            1.0 - ellipse.iou(&mask) < 0.5 * border / ellipse.area(),
            "{}",
            ellipse.iou(&mask)
        );
    }

    #[test]
    fn chords_measure_a_polygon_as_its_area_does() {
        let ellipse = Ellipse::seen_by([160, 120]);
        let rings = outline_of(&ellipse.shot(32).cards[0], &ellipse.shot(32).camera);
        // An inscribed polygon shares all of its area; lines are 1/16 of a pixel apart.
        assert!((ellipse.iou_of_rings(&rings) - total_area(&rings) / ellipse.area()).abs() < 1e-3);
        let y = ellipse.center.y + 3.0;
        assert!(
            ellipse
                .chord(y)
                .unwrap()
                .iter()
                .all(|x| (ellipse.level(*x, y) - 1.0).abs() < 1e-9)
        );
        assert_eq!((ellipse.chord(0.0), ellipse.iou_of_rings(&[])), (None, 0.0));
    }

    #[test]
    fn a_looser_polygon_has_fewer_corners() {
        let ellipse = Ellipse::seen_by([160, 120]);
        let mask = only_mask(&label(
            &ellipse.deep(),
            &ellipse.shot(32),
            &LabelOptions::default(),
        ));
        let [exact, loose, looser] =
            [0.0, 1.0, 4.0].map(|tolerance| trace::polygons(&mask, tolerance));
        assert!(
            count_corners(&exact) > 3.0 * count_corners(&loose)
                && count_corners(&loose) > count_corners(&looser)
        );
        // The mask's own IoU is by points and this one by lines, both 1/16 of a pixel apart.
        assert!((ellipse.iou_of_rings(&exact) - ellipse.iou(&mask)).abs() < 2e-3);
    }

    #[test]
    fn a_wide_mask_overlaps_less() {
        let ellipse = Ellipse::seen_by([160, 120]);
        let (shot, deep) = (ellipse.shot(32), ellipse.deep());
        let at = |alpha_threshold| {
            ellipse.iou(&only_mask(&label(
                &deep,
                &shot,
                &LabelOptions {
                    alpha_threshold,
                    ..LabelOptions::default()
                },
            )))
        };
        assert!(at(0.02) < at(0.1) && at(0.1) < at(0.5));
        assert_eq!(ellipse.iou(&RleMask::default()), 0.0);
    }
}
