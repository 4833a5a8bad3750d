//! A picture to judge a camera by: rectangle, metric grid and a box of the reference height, drawn over the photo.

use super::solution::Solution;
use crate::color::{decode_srgb8, encode_srgb8};
use crate::draw::{self, TextSize};
use crate::geom::{Point2, Point3, Vector2};
use crate::image::Image;
use crate::pixel::{LinearRgb, Srgb8};
use nalgebra::{Matrix2, SymmetricEigen};

/// Colours, scene-linear.
const GRID: LinearRgb = LinearRgb {
    r: 0.9,
    g: 0.9,
    b: 0.9,
};
const RECTANGLE: LinearRgb = LinearRgb {
    r: 0.05,
    g: 0.8,
    b: 0.1,
};
const BOX: LinearRgb = LinearRgb {
    r: 1.0,
    g: 0.3,
    b: 0.0,
};
const LABELLED: LinearRgb = LinearRgb {
    r: 0.9,
    g: 0.0,
    b: 0.35,
};
/// Error ellipses are drawn this many standard deviations large, to be seen at all.
const ELLIPSE_SIGMAS: f64 = 10.0;
const ELLIPSE_POINTS: usize = 48;
/// Grid lines per side, at most.
const MOST_LINES: f64 = 12.0;
/// Half an arm of the cross at a labelled corner, in line widths.
const CROSS: f64 = 5.0;
/// The legend is drawn for a picture of at least half so many columns and no more than so many, and made as large as this
/// one.
const LEGEND_COLUMNS: usize = 1600;
/// Room around the legend and between a mark and its text, and the side of a mark, pixels.
const MARGIN: usize = 8;
const MARK: usize = 12;
const PAPER: Srgb8 = draw::rgb(0x1C, 0x1E, 0x22);
const INK: Srgb8 = draw::rgb(0xF2, 0xF2, 0xF2);
const WARNING: Srgb8 = draw::rgb(0xFF, 0xB0, 0x40);

/// Draws what a solution says over its photo, with a legend below it.
///
/// Green is the rectangle as fitted, white a grid of 1, 2 or 5 times a power of ten metres, orange a box over the rectangle
/// as high as [`Sigma::reference_height`](super::Sigma), crosses are the labelled corners, the ellipses around them ten
/// standard deviations of where the camera sees the corners.
pub fn overlay(photo: &Image<LinearRgb>, solution: &Solution) -> Image<LinearRgb> {
    let image = [photo.width() as u32, photo.height() as u32];
    let zoom = f64::from(image[0]) / f64::from(solution.camera.image[0].max(1));
    let mut sheet = Sheet {
        picture: photo.clone(),
        camera: solution.camera.resized(image),
        width: (f64::from(image[0].max(image[1])) / 800.0).max(1.0),
    };
    let [x, y] = solution.size.map(|s| s / 2.0);
    for line in grid(solution.size) {
        sheet.line(line, GRID, 0.6);
    }
    let base = [[-x, y], [x, y], [x, -y], [-x, -y]];
    let height = solution.sigma.reference_height;
    for i in 0..4 {
        let [a, b] = [base[i], base[(i + 1) % 4]];
        sheet.line([[a[0], a[1], height], [b[0], b[1], height]], BOX, 1.0);
        sheet.line([[a[0], a[1], 0.0], [a[0], a[1], height]], BOX, 1.0);
        sheet.line([[a[0], a[1], 0.0], [b[0], b[1], 0.0]], RECTANGLE, 1.5);
    }
    for (corner, covariance) in solution.corners_px.iter().zip(&solution.sigma.corners_px) {
        sheet.mark(corner * zoom, &(covariance * zoom * zoom));
    }
    let legend = legend(photo.width(), solution);
    let (width, height) = photo.size();
    Image::from_fn(width, height + legend.height(), |x, y| {
        match y.checked_sub(height) {
            None => sheet.picture[(x, y)],
            Some(below) => legend[(x, below)],
        }
    })
}

/// What the colours mean, what was found, and what to look at, as wide as the picture.
fn legend(width: usize, solution: &Solution) -> Image<LinearRgb> {
    let grown = (width * 2).div_ceil(LEGEND_COLUMNS).max(1);
    let columns = width.div_ceil(grown).max(1);
    let left = 2 * MARGIN + MARK;
    let size = TextSize::Small;
    let lines: Vec<(Option<Srgb8>, String, Srgb8)> = entries(solution)
        .into_iter()
        .flat_map(|(mark, text, ink)| {
            let lines = draw::wrapped(&text, columns.saturating_sub(left + MARGIN), size);
            lines
                .into_iter()
                .enumerate()
                .map(move |(i, line)| (mark.filter(|_| i == 0), line, ink))
        })
        .collect();
    let mut canvas = Image::filled(columns, 2 * MARGIN + lines.len() * size.height(), PAPER);
    for (i, (mark, line, ink)) in lines.into_iter().enumerate() {
        let top = (MARGIN + i * size.height()) as isize;
        if let Some(color) = mark {
            draw::fill(&mut canvas, [MARGIN as isize, top + 2], [MARK, MARK], color);
        }
        draw::text(&mut canvas, [left as isize, top], &line, ink, size);
    }
    Image::from_fn(width, canvas.height() * grown, |x, y| {
        decode_srgb8(canvas[(x / grown, y / grown)])
    })
}

/// Lines of the legend: a mark's colour, a text and its colour.
fn entries(solution: &Solution) -> Vec<(Option<Srgb8>, String, Srgb8)> {
    let ([w, h], camera, sigma) = (solution.size, &solution.camera, &solution.sigma);
    let percent = 100.0 * sigma.ln_focal;
    let marks = [
        (RECTANGLE, format!("rectangle as fitted, {w:.3} x {h:.3} m")),
        (
            GRID,
            format!("grid of {:.3} m on the surface", grid_step(solution.size)),
        ),
        (
            BOX,
            format!(
                "box {:.3} m high over the rectangle",
                sigma.reference_height
            ),
        ),
        (
            LABELLED,
            format!(
                "labelled corner, and {ELLIPSE_SIGMAS:.0} standard deviations of where the camera sees it"
            ),
        ),
    ];
    let found = format!(
        "focal length {:.0} px (+- {percent:.1} %), {:.3} m high, tilt {:.1} degrees, corners to {:.2} px",
        camera.focal_px.x,
        camera.center().z,
        camera.tilt().to_degrees(),
        solution.rms_px
    );
    let marks = marks.map(|(color, text)| (Some(encode_srgb8(color)), text, INK));
    let warnings = solution
        .warnings
        .iter()
        .map(|warning| (None, warning.to_string(), WARNING));
    marks
        .into_iter()
        .chain([(None, found, INK)])
        .chain(warnings)
        .collect()
}

/// Lines of a grid over a rectangle: both ends, metres.
fn grid(size: [f64; 2]) -> Vec<[[f64; 3]; 2]> {
    let step = grid_step(size);
    let [x, y] = size.map(|s| s / 2.0);
    let lines = |half: f64| {
        let count = (half / step).floor() as i32;
        (-count..=count).map(move |i| f64::from(i) * step)
    };
    let upright = lines(x).map(|at| [[at, -y, 0.0], [at, y, 0.0]]);
    let level = lines(y).map(|at| [[-x, at, 0.0], [x, at, 0.0]]);
    upright.chain(level).collect()
}

fn grid_step(size: [f64; 2]) -> f64 {
    round_step(size[0].max(size[1]) / MOST_LINES)
}

/// The next 1, 2 or 5 times a power of ten.
fn round_step(least: f64) -> f64 {
    let power = libm::pow(10.0, libm::floor(libm::log10(least)));
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|n| n * power)
        .find(|&step| step >= least)
        .unwrap_or(10.0 * power)
}

/// A picture that is drawn on.
struct Sheet {
    picture: Image<LinearRgb>,
    camera: crate::Camera,
    /// Width of a line, pixels.
    width: f64,
}

impl Sheet {
    /// A straight line in space; nothing where an end is behind the camera.
    fn line(&mut self, ends: [[f64; 3]; 2], color: LinearRgb, weight: f64) {
        let [a, b] = ends.map(|p| self.camera.project(Point3::from(p)).map(|(px, _)| px));
        if let (Some(a), Some(b)) = (a, b) {
            self.stroke(a, b, color, weight * self.width);
        }
    }

    /// A cross at a labelled corner and the ellipse of where the camera sees it.
    fn mark(&mut self, at: Point2<f64>, covariance: &Matrix2<f64>) {
        let arm = CROSS * self.width;
        for direction in [Vector2::new(arm, arm), Vector2::new(arm, -arm)] {
            self.stroke(at - direction, at + direction, LABELLED, self.width);
        }
        if covariance.iter().any(|v| !v.is_finite()) {
            return;
        }
        let eigen = SymmetricEigen::new(*covariance);
        let radii = eigen
            .eigenvalues
            .map(|v| ELLIPSE_SIGMAS * v.max(0.0).sqrt());
        let point = |i: usize| {
            let angle = std::f64::consts::TAU * i as f64 / ELLIPSE_POINTS as f64;
            at + eigen.eigenvectors
                * Vector2::new(radii.x * libm::cos(angle), radii.y * libm::sin(angle))
        };
        for i in 0..ELLIPSE_POINTS {
            self.stroke(point(i), point(i + 1), LABELLED, self.width);
        }
    }

    /// A line with soft edges, pixel centres nearer than half its width fully covered.
    fn stroke(&mut self, a: Point2<f64>, b: Point2<f64>, color: LinearRgb, width: f64) {
        let reach = width / 2.0 + 1.0;
        let bounds = |p: f64, q: f64, end: usize| {
            let from = (p.min(q) - reach).clamp(0.0, end as f64);
            let to = (p.max(q) + reach).clamp(0.0, end as f64);
            from.floor() as usize..to.ceil() as usize
        };
        let (columns, rows) = (
            bounds(a.x, b.x, self.picture.width()),
            bounds(a.y, b.y, self.picture.height()),
        );
        for y in rows {
            for x in columns.clone() {
                let center = Point2::new(x as f64 + 0.5, y as f64 + 0.5);
                let cover = (width / 2.0 + 0.5 - distance(center, a, b)).clamp(0.0, 1.0) as f32;
                if cover > 0.0 {
                    let under = self.picture[(x, y)];
                    let mix = |u: f32, c: f32| u + (c - u) * cover;
                    self.picture[(x, y)] = LinearRgb {
                        r: mix(under.r, color.r),
                        g: mix(under.g, color.g),
                        b: mix(under.b, color.b),
                    };
                }
            }
        }
    }
}

/// Distance of a point from a segment.
fn distance(p: Point2<f64>, a: Point2<f64>, b: Point2<f64>) -> f64 {
    let (along, to) = (b - a, p - a);
    let part = (to.dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (to - along * part).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::simulate::Scenario;
    use crate::camera::{SolveOptions, solve};

    #[test]
    fn the_rectangle_is_drawn_where_it_was_labelled() {
        let scenario = Scenario {
            image: [400, 300],
            focal_px: 320.0,
            ..Scenario::default()
        };
        let view = scenario.tilted(30.0).view(1, 0);
        let solution = solve(&view.label, &SolveOptions::default()).unwrap();
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

    #[test]
    fn the_legend_stands_below_the_photo_and_names_the_colours() {
        let scenario = Scenario {
            image: [400, 300],
            focal_px: 320.0,
            ..Scenario::default()
        };
        let solution = solve(
            &scenario.tilted(30.0).view(1, 0).label,
            &SolveOptions::default(),
        )
        .unwrap();
        let texts: Vec<String> = entries(&solution)
            .into_iter()
            .map(|(_, text, _)| text)
            .collect();
        for word in [
            "rectangle as fitted",
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
        let green = encode_srgb8(RECTANGLE);
        let below = drawn
            .rows()
            .skip(300)
            .flatten()
            .filter(|p| encode_srgb8(**p) == green)
            .count();
        assert_eq!(below, MARK * MARK);
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
