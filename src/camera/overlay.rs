//! A picture to judge a camera by: rectangle, metric grid and a box of the reference height, drawn
//! over the photo.

use super::pinhole::{Camera, distorted_line};
use super::rectangle::corner_points;
use super::solution::Solution;
use crate::color::{decode_srgb8, encode_srgb8};
use crate::draw;
use crate::geom::{Point2, Point3, Vector2};
use crate::image::Image;
use crate::pixel::{LinearRgb, Srgb8};
use nalgebra::{Matrix2, SymmetricEigen};

const GRID_COLOR: LinearRgb = LinearRgb::grey(0.9);
const RECTANGLE_COLOR: LinearRgb = LinearRgb::new(0.05, 0.8, 0.1);
const BOX_COLOR: LinearRgb = LinearRgb::new(1.0, 0.3, 0.0);
const LABEL_COLOR: LinearRgb = LinearRgb::new(0.9, 0.0, 0.35);
/// Widths of lines, in those of a cross.
const GRID_WEIGHT: f64 = 0.6;
const BOX_WEIGHT: f64 = 1.0;
const RECTANGLE_WEIGHT: f64 = 1.5;
/// Pixels of the picture's longer side for each pixel of a line's width.
const SIDE_PER_LINE_WIDTH: f64 = 800.0;
/// Error ellipses are drawn this many standard deviations large, to be seen at all.
const ELLIPSE_SIGMAS: f64 = 10.0;
const ELLIPSE_POINTS: usize = 48;
/// Grid lines per side, at most.
const MAX_GRID_LINES: f64 = 12.0;
/// Half an arm of the cross at a labelled corner, in line widths.
const CROSS_ARM: f64 = 5.0;
/// The legend is drawn at half this many to this many columns and enlarged to the picture's.
const LEGEND_COLUMNS: usize = 1600;
/// Room around the legend and between a mark and its text, and the side of a mark, pixels.
const MARGIN_PX: usize = 8;
const MARK_PX: usize = 12;
const PAPER: Srgb8 = draw::rgb(0x1C, 0x1E, 0x22);
const INK: Srgb8 = draw::rgb(0xF2, 0xF2, 0xF2);
const WARNING_INK: Srgb8 = draw::rgb(0xFF, 0xB0, 0x40);

/// Draws a solution over its photo, with a legend below it.
///
/// Green is the rectangle as fitted, white a grid of 1, 2 or 5 times a power of ten metres, orange
/// a box over the rectangle as high as [`Sigma::reference_height`](super::Sigma), crosses are the
/// labelled corners, the ellipses around them ten standard deviations of where the camera sees the
/// corners.
pub fn overlay(photo: &Image<LinearRgb>, solution: &Solution) -> Image<LinearRgb> {
    let drawing = OverlayDrawing::new(photo, solution).picture;
    stacked(&drawing, &legend(photo.width(), solution))
}

/// Two pictures of the same width, one above the other.
fn stacked(above: &Image<LinearRgb>, below: &Image<LinearRgb>) -> Image<LinearRgb> {
    let (width, height) = above.size();
    Image::from_fn(width, height + below.height(), |x, y| {
        match y.checked_sub(height) {
            None => above[(x, y)],
            Some(y) => below[(x, y)],
        }
    })
}

/// An entry of the legend.
struct LegendEntry {
    mark: Option<Srgb8>,
    text: String,
    ink: Srgb8,
}

impl LegendEntry {
    /// What a colour means.
    fn for_color(color: LinearRgb, text: String) -> Self {
        Self {
            mark: Some(encode_srgb8(color)),
            ..Self::plain(text, INK)
        }
    }

    fn plain(text: String, ink: Srgb8) -> Self {
        Self {
            mark: None,
            text,
            ink,
        }
    }

    /// Lines of at most `columns` columns, the mark beside the first.
    fn wrapped(&self, columns: usize) -> impl Iterator<Item = Self> {
        let lines = draw::wrapped(&self.text, columns);
        lines.into_iter().enumerate().map(|(i, text)| Self {
            mark: self.mark.filter(|_| i == 0),
            text,
            ink: self.ink,
        })
    }

    /// Draws a line of the legend.
    fn draw(&self, canvas: &mut Image<Srgb8>, top: usize) {
        if let Some(color) = self.mark {
            let at = [MARGIN_PX as isize, top as isize + 2];
            draw::fill(canvas, at, [MARK_PX; 2], color);
        }
        let at = [TEXT_LEFT_PX as isize, top as isize];
        draw::text(canvas, at, &self.text, self.ink);
    }
}

/// Where the legend's texts begin, pixels.
const TEXT_LEFT_PX: usize = 2 * MARGIN_PX + MARK_PX;

/// What the colours mean, what was found, and what to look at, as wide as the picture.
fn legend(width: usize, solution: &Solution) -> Image<LinearRgb> {
    let grown = (width * 2).div_ceil(LEGEND_COLUMNS).max(1);
    let columns = width.div_ceil(grown).max(1);
    let text_columns = columns.saturating_sub(TEXT_LEFT_PX + MARGIN_PX);
    let lines: Vec<_> = legend_entries(solution)
        .iter()
        .flat_map(|entry| entry.wrapped(text_columns))
        .collect();
    let canvas = draw_lines(&lines, columns);
    Image::from_fn(width, canvas.height() * grown, |x, y| {
        decode_srgb8(canvas[(x / grown, y / grown)])
    })
}

fn draw_lines(lines: &[LegendEntry], columns: usize) -> Image<Srgb8> {
    let rows = 2 * MARGIN_PX + lines.len() * draw::LINE_PX;
    let mut canvas = Image::filled(columns, rows, PAPER);
    for (i, line) in lines.iter().enumerate() {
        line.draw(&mut canvas, MARGIN_PX + i * draw::LINE_PX);
    }
    canvas
}

fn legend_entries(solution: &Solution) -> Vec<LegendEntry> {
    let warnings = solution
        .warnings
        .iter()
        .map(|warning| LegendEntry::plain(warning.to_string(), WARNING_INK));
    color_meanings(solution)
        .into_iter()
        .map(|(color, text)| LegendEntry::for_color(color, text))
        .chain([LegendEntry::plain(camera_text(solution), INK)])
        .chain(warnings)
        .collect()
}

fn color_meanings(solution: &Solution) -> [(LinearRgb, String); 4] {
    let [w, h] = solution.size;
    let step = grid_step(solution.size);
    let height = solution.sigma.reference_height;
    let rectangle = format!("fitted rectangle, {w:.3} x {h:.3} m");
    let corner = format!(
        "labelled corner, and {ELLIPSE_SIGMAS:.0} standard deviations of where the camera sees it"
    );
    [
        (RECTANGLE_COLOR, rectangle),
        (GRID_COLOR, format!("grid of {step:.3} m on the surface")),
        (
            BOX_COLOR,
            format!("box {height:.3} m high over the rectangle"),
        ),
        (LABEL_COLOR, corner),
    ]
}

fn camera_text(solution: &Solution) -> String {
    let camera = &solution.camera;
    format!(
        "focal length {:.0} px (+- {:.1} %), {:.3} m high, tilt {:.1} degrees, {} to {:.2} px",
        camera.focal_px.x,
        100.0 * solution.sigma.ln_focal,
        camera.height_m(),
        camera.tilt_deg(),
        solution.fit.labelled(),
        solution.rms_px
    )
}

/// Lines of a grid over a rectangle: both ends, metres.
pub(super) fn grid(size: [f64; 2]) -> impl Iterator<Item = [Point3<f64>; 2]> {
    let step = grid_step(size);
    let [x, y] = size.map(|s| s / 2.0);
    let upright = multiples(step, x).map(move |at| [on_surface(at, -y), on_surface(at, y)]);
    let level = multiples(step, y).map(move |at| [on_surface(-x, at), on_surface(x, at)]);
    upright.chain(level)
}

fn on_surface(x: f64, y: f64) -> Point3<f64> {
    Point3::new(x, y, 0.0)
}

/// Multiples of a step up to a distance from zero.
fn multiples(step: f64, most: f64) -> impl Iterator<Item = f64> {
    let count = (most / step).floor() as i32;
    (-count..=count).map(move |i| f64::from(i) * step)
}

pub(super) fn grid_step(size: [f64; 2]) -> f64 {
    round_step(size[0].max(size[1]) / MAX_GRID_LINES)
}

/// The next 1, 2 or 5 times a power of ten.
fn round_step(least: f64) -> f64 {
    let power = libm::pow(10.0, libm::floor(libm::log10(least)));
    [power, 2.0 * power, 5.0 * power]
        .into_iter()
        .find(|&step| step >= least)
        .unwrap_or(10.0 * power)
}

/// A picture that is drawn on.
struct OverlayDrawing {
    picture: Image<LinearRgb>,
    /// Camera and radial distortion of the solution, in the label's pixels.
    camera: Camera,
    kappa: f64,
    /// The label's pixels to the picture's, whose shape may be another.
    zoom: Matrix2<f64>,
    /// Width of a line, pixels.
    line_px: f64,
}

impl OverlayDrawing {
    /// A solution drawn over a photo, of the label's size or another.
    fn new(photo: &Image<LinearRgb>, solution: &Solution) -> Self {
        let (width, height) = photo.size();
        let [from_width, from_height] = solution.camera.image.map(|side| f64::from(side.max(1)));
        let zoom = Vector2::new(width as f64 / from_width, height as f64 / from_height);
        let mut drawing = Self {
            picture: photo.clone(),
            camera: solution.camera,
            kappa: solution.kappa,
            zoom: Matrix2::from_diagonal(&zoom),
            line_px: (width.max(height) as f64 / SIDE_PER_LINE_WIDTH).max(1.0),
        };
        for line in grid(solution.size) {
            drawing.line(line, GRID_COLOR, GRID_WEIGHT);
        }
        drawing.draw_box(solution.size, solution.sigma.reference_height);
        drawing.draw_corners(solution);
        drawing
    }

    /// The labelled corners and their error ellipses.
    fn draw_corners(&mut self, solution: &Solution) {
        let zoom = self.zoom;
        for (corner, covariance) in solution.corners_px.iter().zip(&solution.sigma.corners_px) {
            self.cross(zoom * corner);
            self.ellipse(zoom * corner, &(zoom * covariance * zoom));
        }
    }

    /// The rectangle, and a box of some height over it.
    fn draw_box(&mut self, size: [f64; 2], height: f64) {
        let base = corner_points(size);
        for i in 0..4 {
            let feet = [base[i], base[(i + 1) % 4]];
            let tops = feet.map(|foot| Point3::new(foot.x, foot.y, height));
            self.line(tops, BOX_COLOR, BOX_WEIGHT);
            self.line([feet[0], tops[0]], BOX_COLOR, BOX_WEIGHT);
            self.line(feet, RECTANGLE_COLOR, RECTANGLE_WEIGHT);
        }
    }

    /// A straight line in space, bent as the lens bends it; nothing where an end is behind the camera.
    fn line(&mut self, ends: [Point3<f64>; 2], color: LinearRgb, weight: f64) {
        let seen = distorted_line(&self.camera, self.kappa, ends).unwrap_or_default();
        for ends in seen.windows(2) {
            let ends = [self.zoom * ends[0], self.zoom * ends[1]];
            self.stroke(ends, color, weight * self.line_px);
        }
    }

    /// A cross at a labelled corner.
    fn cross(&mut self, at: Point2<f64>) {
        let arm = CROSS_ARM * self.line_px;
        for direction in [Vector2::new(arm, arm), Vector2::new(arm, -arm)] {
            self.stroke([at - direction, at + direction], LABEL_COLOR, self.line_px);
        }
    }

    /// The error ellipse of a position; nothing where the error is not finite.
    fn ellipse(&mut self, center: Point2<f64>, covariance: &Matrix2<f64>) {
        if covariance.iter().any(|v| !v.is_finite()) {
            return;
        }
        let eigen = SymmetricEigen::new(*covariance);
        let sigmas = eigen.eigenvalues.map(|v| v.max(0.0).sqrt());
        let points = (0..=ELLIPSE_POINTS)
            .map(|i| center + eigen.eigenvectors * on_ellipse(&sigmas, i))
            .collect::<Vec<_>>();
        for ends in points.windows(2) {
            self.stroke([ends[0], ends[1]], LABEL_COLOR, self.line_px);
        }
    }

    /// A line with soft edges, pixel centres nearer than half its width fully covered.
    fn stroke(&mut self, ends: [Point2<f64>; 2], color: LinearRgb, width: f64) {
        let (columns, rows) = self.pixels_near(ends, width / 2.0 + 1.0);
        for y in rows {
            for x in columns.clone() {
                let cover = stroke_coverage(x, y, ends, width);
                if cover > 0.0 {
                    self.picture[(x, y)] = mixed(self.picture[(x, y)], color, cover);
                }
            }
        }
    }

    /// Columns and rows of the picture within a distance of a line's box.
    fn pixels_near(
        &self,
        [a, b]: [Point2<f64>; 2],
        reach: f64,
    ) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
        (
            range_near([a.x, b.x], reach, self.picture.width()),
            range_near([a.y, b.y], reach, self.picture.height()),
        )
    }
}

/// How much of a pixel a line covers.
#[inline]
fn stroke_coverage(x: usize, y: usize, ends: [Point2<f64>; 2], width: f64) -> f32 {
    let center = Point2::new(x as f64 + 0.5, y as f64 + 0.5);
    (width / 2.0 + 0.5 - distance(center, ends)).clamp(0.0, 1.0) as f32
}

/// One of the points around an ellipse along the axes.
fn on_ellipse(sigmas: &Vector2<f64>, i: usize) -> Vector2<f64> {
    let radii = sigmas.map(|sigma| ELLIPSE_SIGMAS * sigma);
    let angle = std::f64::consts::TAU * i as f64 / ELLIPSE_POINTS as f64;
    Vector2::new(radii.x * libm::cos(angle), radii.y * libm::sin(angle))
}

/// The pixels of a row or column of `count` that are within a distance of an interval.
fn range_near([p, q]: [f64; 2], reach: f64, count: usize) -> std::ops::Range<usize> {
    let from = (p.min(q) - reach).clamp(0.0, count as f64);
    let to = (p.max(q) + reach).clamp(0.0, count as f64);
    from.floor() as usize..to.ceil() as usize
}

fn mixed(under: LinearRgb, color: LinearRgb, cover: f32) -> LinearRgb {
    LinearRgb {
        r: under.r + (color.r - under.r) * cover,
        g: under.g + (color.g - under.g) * cover,
        b: under.b + (color.b - under.b) * cover,
    }
}

/// Distance of a point from a segment.
fn distance(p: Point2<f64>, [a, b]: [Point2<f64>; 2]) -> f64 {
    let (along, to) = (b - a, p - a);
    let part = (to.dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (to - along * part).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::simulate::{Scenario, View};
    use crate::camera::{SolveOptions, distorted, solve};

    fn small_picture() -> Scenario {
        Scenario {
            image: [400, 300],
            focal_px: 320.0,
            ..Scenario::default()
        }
    }

    fn tilted() -> Solution {
        let view = small_picture().tilted(30.0).view(1, 0);
        solve(&view.label, &SolveOptions::default()).unwrap()
    }

    #[test]
    fn the_rectangle_is_drawn_where_it_was_labelled() {
        let solution = tilted();
        let drawn = overlay(&Image::filled(400, 300, LinearRgb::BLACK), &solution);
        let corners = solution.corners_px;
        let middle = nalgebra::center(&corners[0], &corners[1]);
        let near = |x: f64, y: f64| drawn[(x as usize, y as usize)];
        assert!(
            near(middle.x, middle.y).g > 0.3,
            "{:?}",
            near(middle.x, middle.y)
        );
        assert!(
            drawn
                .pixels()
                .iter()
                .filter(|p| **p != LinearRgb::BLACK)
                .count()
                > 1000
        );
    }

    /// A view through a lens that bends lines, and its k1, which the label states.
    fn bent() -> (View, f64) {
        let scenario = Scenario {
            kappa: 0.2,
            ..small_picture()
        };
        let mut view = scenario.tilted(20.0).view(1, 0);
        // Kappa is in half diagonals, of 250 pixels here.
        let k1 = view.kappa * (320.0_f64 / 250.0).powi(2);
        view.label.camera.k1 = Some(k1);
        (view, k1)
    }

    #[test]
    fn lines_are_drawn_where_the_lens_bends_them() {
        let (view, k1) = bent();
        let solution = solve(&view.label, &SolveOptions::default()).unwrap();
        // A photo of half the size.
        let drawn = overlay(&Image::filled(200, 150, LinearRgb::BLACK), &solution);
        let corners = corner_points(view.size);
        let mut farthest = 0.0_f64;
        for (side, part) in (0..4).flat_map(|side| [0.25, 0.5, 0.75].map(|part| (side, part))) {
            let place = corners[side] + (corners[(side + 1) % 4] - corners[side]) * part;
            let (straight, _) = view.camera.project(place).unwrap();
            // OpenCV's distortion.
            let x = (straight - view.camera.principal_px) / 320.0;
            let px = view.camera.principal_px + x * (1.0 + k1 * x.norm_squared()) * 320.0;
            let seen = drawn[((px.x / 2.0) as usize, (px.y / 2.0) as usize)];
            assert!(seen.g > 2.0 * seen.r, "{side} {part}: {seen:?}");
            farthest = farthest.max((px - straight).norm());
        }
        // Lines are 3 pixels wide.
        assert!(farthest > 4.0, "{farthest}");
    }

    #[test]
    fn labelled_corners_are_marked_on_a_photo_of_another_shape() {
        let solution = tilted();
        let drawn = overlay(&Image::filled(200, 300, LinearRgb::BLACK), &solution);
        let is_mark = |p: LinearRgb| p.r > 0.3 && p.g < 0.1 * p.r && p.b > 0.3 * p.r;
        let pixels = (0..300).flat_map(|y| (0..200).map(move |x| (x, y)));
        let marks: Vec<(usize, usize)> = pixels.filter(|&at| is_mark(drawn[at])).collect();
        for corner in solution.corners_px {
            let shown = Point2::new(corner.x / 2.0, corner.y);
            let off_px = |(x, y): (usize, usize)| (Point2::new(x as f64, y as f64) - shown).norm();
            let near = marks.iter().filter(|&&at| off_px(at) < 6.0);
            assert!(near.count() >= 4, "{shown}: {marks:?}");
        }
    }

    #[test]
    fn a_lens_bends_lines_on_a_photo_of_another_shape_as_on_the_label_s() {
        let solution = solve(&bent().0.label, &SolveOptions::default()).unwrap();
        let drawn = overlay(&Image::filled(200, 300, LinearRgb::BLACK), &solution);
        let corners = corner_points(solution.size);
        for side in 0..4 {
            let middle = nalgebra::center(&corners[side], &corners[(side + 1) % 4]);
            let px = distorted(&solution.camera, solution.kappa, middle);
            let seen = drawn[((px.x / 2.0) as usize, px.y as usize)];
            assert!(seen.g > 2.0 * seen.r, "{side}: {seen:?}");
        }
    }

    #[test]
    fn the_legend_stands_below_the_photo_and_names_the_colours() {
        let solution = tilted();
        let texts: Vec<String> = legend_entries(&solution)
            .into_iter()
            .map(|entry| entry.text)
            .collect();
        for word in [
            "fitted rectangle",
            "grid of 0.100 m",
            "box 0.0",
            "labelled corner",
            "focal length",
        ] {
            assert!(
                texts.iter().any(|text| text.contains(word)),
                "{word}: {texts:?}"
            );
        }
        for width in [1, 90, 400, 4000] {
            let drawn = overlay(&Image::filled(width, 300, LinearRgb::BLACK), &solution);
            assert!(
                drawn.width() == width && drawn.height() > 350,
                "{:?}",
                drawn.size()
            );
        }
        let drawn = overlay(&Image::filled(400, 300, LinearRgb::BLACK), &solution);
        let green = encode_srgb8(RECTANGLE_COLOR);
        let below = drawn
            .rows()
            .skip(300)
            .flatten()
            .filter(|p| encode_srgb8(**p) == green)
            .count();
        assert_eq!(below, MARK_PX * MARK_PX);
    }

    #[test]
    fn steps_are_round() {
        assert_eq!(
            [0.04, 0.05, 0.06, 3.0]
                .map(round_step)
                .map(|s| (s * 1e6).round()),
            [5e4, 5e4, 1e5, 5e6]
        );
    }
}
