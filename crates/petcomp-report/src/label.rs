//! Labels of a shape whose area is known: polygon against raster, error against run time and points.
//!
//! The shape is an ellipse, the reference its closed form. The error is 1 - IoU: for the pixels of a mask by 16 x 16 points
//! each; for a polygon inscribed in the ellipse it is the area that it lacks; for any other by chords along 16 lines a pixel.

use super::clock::timed;
use super::pile::above;
use super::{Diagram, Point};
use petcomp::Image;
use petcomp::Result;
use petcomp::geom::{Point2, Pose, Quad, UnitQuaternion, Vector3};
use petcomp::label::{LabelOptions, Labels, RleMask, label, outline_of, trace};
use petcomp::scene::{Card, Grade, Shot};
use petcomp::{DeepImage, DeepSample};
use petcomp::{Depth, LinearRgb, ObjectId, PremulRgba};
use std::f64::consts::{PI, TAU};

/// Pictures: the usual size, its half and its double.
const SIZES: [[u32; 2]; 3] = [[320, 240], [640, 480], [1280, 960]];
const USUAL: [u32; 2] = [640, 480];
/// Shares of a pixel that must be covered.
const THRESHOLDS: [f32; 4] = [0.02, 0.1, 0.25, 0.5];
/// Corners of the polygon.
const CORNERS: [usize; 5] = [8, 16, 32, 64, 128];
const USUAL_CORNERS: usize = 64;
/// How far a simplified border may be from that of the mask, pixels.
const TOLERANCES: [f64; 6] = [0.5, 0.75, 1.0, 1.5, 2.0, 4.0];
/// Half lengths of the ellipse and how it lies, metres and radians.
const HALF: [f64; 2] = [0.13, 0.045];
const TURN: f64 = 0.5;
/// Points of a pixel along each side.
const POINTS: usize = 16;
const RUNS: usize = 7;

/// Error against time, and against the points that are written.
///
/// # Errors
/// A thread that cannot be had.
pub fn diagrams() -> Result<Vec<Diagram>> {
    let (mut times, mut points) = (Vec::new(), Vec::new());
    for size in SIZES {
        let ellipse = Ellipse::seen_by(size);
        let (shot, deep) = (ellipse.shot(USUAL_CORNERS), ellipse.deep());
        for alpha_threshold in THRESHOLDS
            .into_iter()
            .filter(|t| size == USUAL || *t == usual_threshold())
        {
            let options = LabelOptions {
                alpha_threshold,
                ..LabelOptions::default()
            };
            let (labels, seconds) = timed(RUNS, || Ok(label(&deep, &shot, &options)))?;
            let mask = mask(&labels);
            let error = 1.0 - ellipse.iou(&mask);
            let name = match size == USUAL {
                true => format!("alpha {alpha_threshold}"),
                false => format!("{} px wide", size[0]),
            };
            let is_default = size == USUAL && alpha_threshold == usual_threshold();
            times.push(Point::new("mask", &name, seconds, error).used_where(|_| is_default));
            let (rings, more) = timed(RUNS, || Ok(trace::polygons(&mask, 0.0)))?;
            times.push(Point::new(
                "polygon along pixels",
                &name,
                seconds + more,
                error,
            ));
            points.push(
                Point::new("polygon along pixels", &name, corners(&rings), error)
                    .used_where(|_| is_default),
            );
            points.push(Point::new(
                "mask (runs)",
                &name,
                mask.runs().len() as f64,
                error,
            ));
            for tolerance in TOLERANCES.into_iter().filter(|_| is_default) {
                let (rings, more) = timed(RUNS, || Ok(trace::polygons(&mask, tolerance)))?;
                let (error, name) = (
                    1.0 - ellipse.iou_of_rings(&rings),
                    format!("within {tolerance} px"),
                );
                times.push(Point::new(
                    "simplified polygon",
                    &name,
                    seconds + more,
                    error,
                ));
                points.push(Point::new(
                    "simplified polygon",
                    &name,
                    corners(&rings),
                    error,
                ));
            }
        }
    }
    let ellipse = Ellipse::seen_by(USUAL);
    for corners in CORNERS {
        let shot = ellipse.shot(corners);
        let (rings, seconds) = timed(RUNS, || Ok(outline_of(&shot.cards[0], &shot.camera)))?;
        let error = 1.0 - rings.iter().map(|ring| area(ring)).sum::<f64>() / ellipse.area();
        let name = format!("{corners} corners");
        times.push(Point::new("projected outline", &name, seconds, error));
        points.push(Point::new(
            "projected outline",
            &name,
            self::corners(&rings),
            error,
        ));
    }
    Ok(vec![
        diagram(
            "label_time",
            "label: polygon and raster, error against time",
            "CPU seconds of a picture",
            times,
        ),
        diagram(
            "label_points",
            "label: polygon and raster, error against points",
            "corners, or runs of a mask",
            points,
        ),
    ])
}

fn diagram(file: &str, title: &str, cost: &str, points: Vec<Point>) -> Diagram {
    Diagram {
        file: file.into(),
        title: title.into(),
        input: format!(
            "an ellipse of {:.0} x {:.0} mm from straight above; {} x {} px and alpha {} where nothing else is said",
            2e3 * HALF[0],
            2e3 * HALF[1],
            USUAL[0],
            USUAL[1],
            usual_threshold()
        ),
        error: "1 - IoU".into(),
        cost: cost.into(),
        reference: "the ellipse (closed form)".into(),
        points,
        why: "Masks are read from the deep samples, like the picture, so they agree with what is seen of see-through objects; the \
              outline is what the geometry says. A pixel counts from a coverage of 0.1, where film is still told from noise: \
              masks are a fraction of a pixel too wide for that, and boxes hold all of the object. Polygons keep all corners of their \
              pixels unless a recipe says how far they may be off (`labels.simplify`)."
            .into(),
        ..Diagram::default()
    }
}

fn usual_threshold() -> f32 {
    LabelOptions::default().alpha_threshold
}

/// The mask of the one object.
fn mask(labels: &Labels) -> RleMask {
    labels
        .objects
        .first()
        .map(|object| object.amodal_mask.clone())
        .unwrap_or_default()
}

fn corners(rings: &[Vec<Point2<f64>>]) -> f64 {
    rings.iter().map(Vec::len).sum::<usize>() as f64
}

/// Area of a ring, by the shoelace formula.
fn area(ring: &[Point2<f64>]) -> f64 {
    let sides = ring.iter().zip(ring.iter().cycle().skip(1));
    0.5 * sides.map(|(a, b)| a.x * b.y - b.x * a.y).sum::<f64>().abs()
}

/// The parts of a line along the rows that lie in an odd number of rings.
fn inside(rings: &[Vec<Point2<f64>>], y: f64) -> Vec<[f64; 2]> {
    let sides = rings
        .iter()
        .flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1)));
    let crossed = sides.filter(|(a, b)| (a.y <= y) != (b.y <= y));
    let mut crossings: Vec<f64> = crossed
        .map(|(a, b)| a.x + (y - a.y) * (b.x - a.x) / (b.y - a.y))
        .collect();
    crossings.sort_by(f64::total_cmp);
    crossings
        .chunks_exact(2)
        .map(|pair| [pair[0], pair[1]])
        .collect()
}

/// The ellipse in a picture.
struct Ellipse {
    image: [u32; 2],
    center: Point2<f64>,
    half: [f64; 2],
}

impl Ellipse {
    fn seen_by(image: [u32; 2]) -> Self {
        let camera = above(image, 1.0);
        Self {
            image,
            center: camera.principal_px,
            half: HALF.map(|h| h * camera.focal_px.x),
        }
    }

    fn area(&self) -> f64 {
        PI * self.half[0] * self.half[1]
    }

    /// 1 on the ellipse, less inside.
    fn level(&self, x: f64, y: f64) -> f64 {
        let (sin, cos) = (libm::sin(TURN), libm::cos(TURN));
        // The picture's y runs down, the world's up: the ellipse turns the other way.
        let (dx, dy) = (x - self.center.x, self.center.y - y);
        let along = [dx * cos + dy * sin, dy * cos - dx * sin];
        (along[0] / self.half[0]).powi(2) + (along[1] / self.half[1]).powi(2)
    }

    /// The share of a pixel inside.
    fn coverage(&self, x: u32, y: u32) -> f64 {
        let part = |i: usize| (i as f64 + 0.5) / POINTS as f64;
        let inside = (0..POINTS * POINTS)
            .filter(|i| {
                self.level(
                    f64::from(x) + part(i % POINTS),
                    f64::from(y) + part(i / POINTS),
                ) <= 1.0
            })
            .count();
        inside as f64 / (POINTS * POINTS) as f64
    }

    fn iou(&self, mask: &RleMask) -> f64 {
        let both: f64 = mask.pixels().map(|(x, y)| self.coverage(x, y)).sum();
        both / (mask.area() as f64 + self.area() - both)
    }

    /// The same for what lies in an odd number of rings.
    fn iou_of_rings(&self, rings: &[Vec<Point2<f64>>]) -> f64 {
        let step = 1.0 / POINTS as f64;
        let lines = (0..self.image[1] as usize * POINTS).map(|i| (i as f64 + 0.5) * step);
        let (both, own) = lines.fold((0.0, 0.0), |(both, own), y| {
            let chord = self.chord(y).unwrap_or_default();
            let inside = inside(rings, y);
            let shared = |[a, b]: &[f64; 2]| (b.min(chord[1]) - a.max(chord[0])).max(0.0);
            (
                both + step * inside.iter().map(shared).sum::<f64>(),
                own + step * inside.iter().map(|[a, b]| b - a).sum::<f64>(),
            )
        });
        both / (own + self.area() - both)
    }

    /// Where the ellipse crosses a line along the rows; none where it does not.
    fn chord(&self, y: f64) -> Option<[f64; 2]> {
        // The level is a parabola along the line: through three points of it.
        let [low, middle, high] =
            [-1.0, 0.0, 1.0].map(|dx| self.level(self.center.x + dx, y) - 1.0);
        let (a, b) = (0.5 * (low + high) - middle, 0.5 * (high - low));
        let discriminant = b * b - 4.0 * a * middle;
        let at = |sign: f64| self.center.x + (sign * discriminant.sqrt() - b) / (2.0 * a);
        (discriminant > 0.0).then(|| [at(-1.0), at(1.0)])
    }

    /// A card whose outline has so many corners on the ellipse.
    fn shot(&self, corners: usize) -> Shot {
        let turn = |i: usize| TAU * i as f64 / corners as f64;
        let on_ellipse = |i: usize| {
            Point2::new(
                0.5 + 0.5 * libm::cos(turn(i)),
                0.5 + 0.5 * libm::sin(turn(i)),
            )
        };
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), TURN);
        Shot::new(above(self.image, 1.0)).with_card(Card {
            id: ObjectId(1),
            class: 0,
            quad: Quad {
                world_from_card: Pose::from_parts(Vector3::zeros().into(), rotation),
                size: HALF.map(|h| 2.0 * h),
            },
            texture: Image::<PremulRgba>::new(2, 2).into(),
            back: None,
            outline_uv: (0..corners).map(on_ellipse).collect(),
            grade: Grade::default(),
        })
    }

    /// What a perfect renderer sees of it.
    fn deep(&self) -> DeepImage {
        let [w, h] = self.image;
        let sample = |(x, y): (u32, u32)| match self.coverage(x, y) as f32 {
            0.0 => Vec::new(),
            alpha => vec![DeepSample {
                object: ObjectId(1),
                depth: Depth(1.0),
                light: LinearRgb::BLACK,
                alpha,
                visible: alpha,
            }],
        };
        let pixels = (0..h).flat_map(|y| (0..w).map(move |x| (x, y)));
        DeepImage::from_pixels(
            Image::filled(w as usize, h as usize, LinearRgb::WHITE),
            pixels.map(sample),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_outline_and_the_raster_show_the_same_ellipse() {
        let ellipse = Ellipse::seen_by([160, 120]);
        let shot = ellipse.shot(128);
        let ring = &outline_of(&shot.cards[0], &shot.camera)[0];
        assert!(
            ring.iter()
                .all(|p| (ellipse.level(p.x, p.y) - 1.0).abs() < 1e-5),
            "corners lie on it"
        );
        // An inscribed polygon of n corners lacks 1 - sin(2 pi / n) / (2 pi / n) of the area.
        let turn = TAU / 128.0;
        // `geo` snaps corners to 2^-30 of the extent, 1.5e-7 pixels of half lengths of 8 and 24.
        assert!((area(ring) / ellipse.area() - libm::sin(turn) / turn).abs() < 1e-7);
        let half = LabelOptions {
            alpha_threshold: 0.5,
            ..LabelOptions::default()
        };
        let mask = mask(&label(&ellipse.deep(), &shot, &half));
        // A pixel on the border is wrong by at most a half, and by a quarter in the mean.
        let border: f64 = ring
            .iter()
            .zip(ring.iter().cycle().skip(1))
            .map(|(a, b)| (b - a).norm())
            .sum();
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
        assert!((ellipse.iou_of_rings(&rings) - area(&rings[0]) / ellipse.area()).abs() < 1e-3);
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
        let mask = mask(&label(
            &ellipse.deep(),
            &ellipse.shot(32),
            &LabelOptions::default(),
        ));
        let [exact, loose, looser] =
            [0.0, 1.0, 4.0].map(|tolerance| trace::polygons(&mask, tolerance));
        assert!(corners(&exact) > 3.0 * corners(&loose) && corners(&loose) > corners(&looser));
        // The mask's own IoU is by points and this one by lines, both 1/16 of a pixel apart.
        assert!((ellipse.iou_of_rings(&exact) - ellipse.iou(&mask)).abs() < 2e-3);
    }

    #[test]
    fn a_wide_mask_overlaps_less() {
        let ellipse = Ellipse::seen_by([160, 120]);
        let (shot, deep) = (ellipse.shot(32), ellipse.deep());
        let at = |alpha_threshold| {
            ellipse.iou(&mask(&label(
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
