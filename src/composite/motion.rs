//! Motion blur of what moves while the shutter is open.
//!
//! # Method
//! A pixel is `light + through * plate`, where `through` is what objects and their shadows leave of
//! the plate. Plate and camera stand still, so the mean over time is that of `light` and of
//! `through` alone. Cards and shadows move together along the surface: what a pixel shows at
//! another time is what was next to it on the surface, and both are averaged along that path. What
//! is high above the surface would move a little farther in the picture. Cards and shadows beyond
//! the border move into the picture, too: they are rendered as far as paths reach.

use crate::camera::{Camera, RadialDistortion};
use crate::deep::{DeepImage, HoldoutSample};
use crate::filter::{self, sample_cubic_clamped};
use crate::geom::{Plane, Point2, Point3, Vector2, Vector3};
use crate::image::{Image, Mask};
use crate::pixel::{Film, Mix};
use crate::render::{RenderOptions, render_beyond};
use crate::scene::Shot;
use crate::work::{self, Kind};

/// Side of the squares of pixels that share a path.
const SQUARE_PX: usize = 8;
/// Paths shorter than this leave pixels as they are, pixels.
const LEAST_WAY_PX: f64 = 0.02;
/// Maximum number of samples along a path: near the horizon paths have no end.
const MOST_TAPS: f64 = 256.0;
/// Maximum number of pixels rendered beyond the border.
const MOST_BEYOND_PX: usize = 256;
/// Pixels next to a position that a cubic curve reads.
const CURVE_PX: f64 = 2.0;

/// The mean effect of objects and their shadows on the plate while the shutter is open, behind the
/// holdout, which does not move; none if nothing moves.
///
/// `free` are samples before the holdout is applied; what moves in from beyond the border is
/// rendered with the same `options`.
pub(super) fn moved(free: &DeepImage, shot: &Shot, options: &RenderOptions) -> Option<Image<Film>> {
    if shot.motion_m == [0.0; 2] {
        return None;
    }
    work::add(Kind::Filters, 1);
    let ways = ways(shot);
    let wide = WideDeep::new(free, shot, margin_px(&ways), options);
    let means = WideEffect::new(&wide, shot.plate.is_some()).averaged(&ways);
    Some(match &shot.holdout {
        Some(holdout) => held_out(&means, &wide, holdout, &ways),
        None => means,
    })
}

/// Means behind the holdout: where there is a holdout, only what passes in front of it counts.
fn held_out(
    means: &Image<Film>,
    wide: &WideDeep<'_>,
    holdout: &Image<HoldoutSample>,
    ways: &Image<Vector2<f64>>,
) -> Image<Film> {
    Image::from_fn(means.width(), means.height(), |x, y| {
        let (mean, place) = (means[(x, y)], &holdout[(x, y)]);
        if place.coverage.0 == 0.0 || mean == Film::default() {
            return mean;
        }
        let way = ways[(x / SQUARE_PX, y / SQUARE_PX)];
        let front = mean_in_front(wide, place, along(center(x, y), way));
        let past = Film::default().add_scaled(1.0 - place.coverage.0, mean);
        past.add_scaled(place.coverage.0, front)
    })
}

/// The mean of what is in front of the holdout at some positions, each read from its nearest pixel.
fn mean_in_front(
    wide: &WideDeep<'_>,
    place: &HoldoutSample,
    at: impl ExactSizeIterator<Item = Point2<f64>>,
) -> Film {
    let [width, height] = wide.size();
    let inside = |v: f64, side: usize| {
        let from_corner = (v + wide.margin_px as f64).max(0.0);
        (from_corner as usize).min(side - 1)
    };
    mean(at, |p| {
        let (deep, x, y) = wide.at(inside(p.x, width), inside(p.y, height));
        deep.in_front(x, y, place)
    })
}

/// Deep samples in the picture and in a margin around it.
struct WideDeep<'a> {
    free: &'a DeepImage,
    /// None without a margin.
    beyond: Option<DeepImage>,
    /// Pixels on every side, whole squares.
    margin_px: usize,
}

impl<'a> WideDeep<'a> {
    fn new(free: &'a DeepImage, shot: &Shot, margin_px: usize, options: &RenderOptions) -> Self {
        Self {
            free,
            beyond: (margin_px > 0).then(|| render_beyond(shot, margin_px, options)),
            margin_px,
        }
    }

    /// Width and height including the margin.
    fn size(&self) -> [usize; 2] {
        [self.free.width(), self.free.height()].map(|side| side + 2 * self.margin_px)
    }

    /// The samples that contain a pixel counted from the margin's corner, and its position in them.
    fn at(&self, x: usize, y: usize) -> (&DeepImage, usize, usize) {
        let inside = |at: usize, side| at.checked_sub(self.margin_px).filter(|at| *at < side);
        match (inside(x, self.free.width()), inside(y, self.free.height())) {
            (Some(x), Some(y)) => (self.free, x, y),
            _ => (self.beyond.as_ref().unwrap_or(self.free), x, y),
        }
    }
}

/// The effect of objects and their shadows on the plate, in the picture and in a margin around it.
struct WideEffect {
    films: Image<Film>,
    /// Squares on every side.
    margin: usize,
    /// Width and height of the picture.
    picture: [usize; 2],
}

impl WideEffect {
    /// Shadows need something to fall on.
    fn new(wide: &WideDeep<'_>, is_shaded: bool) -> Self {
        let [width, height] = wide.size();
        Self {
            films: Image::from_fn(width, height, |x, y| {
                let (deep, x, y) = wide.at(x, y);
                let film = deep.flat(x, y);
                if is_shaded {
                    film.shaded(deep.shadow()[(x, y)])
                } else {
                    film
                }
            }),
            margin: wide.margin_px / SQUARE_PX,
            picture: [wide.free.width(), wide.free.height()],
        }
    }

    /// Means along each pixel's path, for the picture alone.
    fn averaged(&self, ways: &Image<Vector2<f64>>) -> Image<Film> {
        let (reached, least) = (reached(&self.films, ways), least(&self.films));
        let corner = Vector2::repeat((self.margin * SQUARE_PX) as f64);
        let [width, height] = self.picture;
        Image::from_fn(width, height, |x, y| {
            let square = (x / SQUARE_PX, y / SQUARE_PX);
            if !reached[(square.0 + self.margin, square.1 + self.margin)] {
                return Film::default();
            }
            let way = along(center(x, y) + corner, ways[square]);
            let mean = mean(way, |p| sample_cubic_clamped(&self.films, p.x, p.y));
            // A cubic curve overshoots near edges.
            let opacity = mean.opacity.zip_map(least.opacity, f32::max);
            Film {
                color: mean.color.zip_map(least.color, f32::max),
                opacity: opacity.map(|o| o.min(1.0)),
            }
        })
    }
}

/// Pixels beyond the border from which paths lead into the picture, as whole squares.
fn margin_px(ways: &Image<Vector2<f64>>) -> usize {
    let longest = longest(ways);
    if longest == 0.0 {
        return 0;
    }
    let reach = (0.5 * longest + CURVE_PX).min(MOST_BEYOND_PX as f64);
    (reach.ceil() as usize).next_multiple_of(SQUARE_PX)
}

fn longest(ways: &Image<Vector2<f64>>) -> f64 {
    let lengths = ways.pixels().iter().map(|way| way.norm());
    lengths.fold(0.0, f64::max)
}

/// Squares that anything reaches while the shutter is open.
fn reached(effect: &Image<Film>, ways: &Image<Vector2<f64>>) -> Mask {
    let [columns, rows] = [effect.width(), effect.height()].map(|side| side.div_ceil(SQUARE_PX));
    let mut filled = Image::filled(columns, rows, false);
    for (y, row) in effect.rows().enumerate() {
        for (x, film) in row.iter().enumerate() {
            filled[(x / SQUARE_PX, y / SQUARE_PX)] |= *film != Film::default();
        }
    }
    // Two squares for the curve's neighbours, and for corners.
    filter::dilate(&filled, 0.5 * longest(ways) / SQUARE_PX as f64 + 2.0)
}

/// The mean of what is seen at some positions.
fn mean(
    at: impl ExactSizeIterator<Item = Point2<f64>>,
    seen: impl Fn(Point2<f64>) -> Film,
) -> Film {
    let weight = 1.0 / at.len() as f32;
    at.fold(Film::default(), |sum, p| sum.add_scaled(weight, seen(p)))
}

fn center(x: usize, y: usize) -> Point2<f64> {
    Point2::new(x as f64 + 0.5, y as f64 + 0.5)
}

/// Positions along a path about its middle, at most a pixel apart.
fn along(middle: Point2<f64>, way: Vector2<f64>) -> impl ExactSizeIterator<Item = Point2<f64>> {
    let count = (way.norm().ceil() + 1.0).min(MOST_TAPS);
    (0..count as usize).map(move |i| middle + way * ((i as f64 + 0.5) / count - 0.5))
}

/// The minimum light and opacity of a picture: below 0 where refraction removes what would be seen
/// straight on, and where interreflection brightens the surface.
fn least(effect: &Image<Film>) -> Film {
    let films = effect.pixels().iter();
    films.fold(Film::default(), |least, film| Film {
        color: least.color.zip_map(film.color, f32::min),
        opacity: least.opacity.zip_map(film.opacity, f32::min),
    })
}

/// Path in the picture, in pixels, of a point of the surface in the middle of each square; 0 where
/// the surface is not visible.
fn ways(shot: &Shot) -> Image<Vector2<f64>> {
    let [width, height] = shot.camera.image.map(|n| (n as usize).div_ceil(SQUARE_PX));
    let (camera, distortion) = (&shot.camera, shot.distortion());
    Image::from_fn(width, height, |x, y| {
        let [x, y] = [x, y].map(|n| (n as f64 + 0.5) * SQUARE_PX as f64);
        let way = way_at(camera, &distortion, Point2::new(x, y), shot.motion_m);
        way.filter(|way| way.norm() >= LEAST_WAY_PX)
            .unwrap_or_default()
    })
}

fn way_at(
    camera: &Camera,
    distortion: &RadialDistortion,
    px: Point2<f64>,
    [x, y]: [f64; 2],
) -> Option<Vector2<f64>> {
    let ray = camera.ray(distortion.undistort(px));
    let depth = Plane::surface().intersect(&ray)?;
    let middle = ray.at(depth);
    let half = Vector3::new(x, y, 0.0) * 0.5;
    let shown = |at: Point3<f64>| Some(distortion.distort(camera.project(at)?.0));
    Some(shown(middle + half)? - shown(middle - half)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::composite::{Exposed, picture};
    use crate::geom::{Pose, Quad};
    use crate::pixel::{LinearRgb, ObjectId, PremulRgba};
    use crate::quality::Quality;
    use crate::render::render;
    use crate::scene::{AreaLight, Blur, Card, PostProcess};
    use std::sync::Arc;

    /// Where a shutter that opens at -1/2 and closes at 1/2 sees the card, as shares of its path.
    const TIMES: usize = 16;
    const WAY_M: [f64; 2] = [0.03, 0.01];
    const Z: f64 = 0.01;

    /// A see-through card and an opaque one under a small light, over a plate with stripes.
    fn shot(moved: f64) -> Shot {
        let plate = Image::from_fn(80, 60, |x, y| {
            LinearRgb::new(0.3, 0.5, 0.4).scale(1.0 + 0.5 * ((x / 2 + y / 5) % 2) as f32)
        });
        let card = |id: u32, at: [f64; 2], alpha: f32| {
            let [x, y] = [0, 1].map(|axis| at[axis] + moved * WAY_M[axis]);
            let quad = Quad {
                world_from_card: Pose::translation(x, y, Z),
                size: [0.12, 0.06],
            };
            let texel = PremulRgba::new(0.7 * alpha, 0.2 * alpha, 0.1 * alpha, alpha);
            Card::new(ObjectId(id), quad, Image::filled(16, 8, texel))
        };
        let light = AreaLight::new([0.2, 0.4, 1.2], [0.1; 2], 20.0);
        Shot::new(Camera::looking_down(1.0, 160.0, [80, 60]))
            .with_plate(Arc::new(plate))
            .with_light(light)
            .with_ambient(LinearRgb::grey(0.2))
            .with_card(card(1, [-0.05, 0.03], 1.0))
            .with_card(card(2, [0.08, -0.04], 0.4))
    }

    fn rendered(shot: &Shot) -> Image<PremulRgba> {
        picture(shot, &Quality::Reference.into())
    }

    fn rmse(a: &Image<PremulRgba>, b: &Image<PremulRgba>) -> f32 {
        let pairs = a.pixels().iter().zip(b.pixels());
        let squares = pairs.map(|(a, b)| (a.g - b.g).powi(2)).sum::<f32>();
        (squares / a.pixels().len() as f32).sqrt()
    }

    #[test]
    fn what_lies_beyond_the_border_moves_in_as_in_a_wider_picture() {
        let narrow = Shot {
            plate: None,
            motion_m: WAY_M,
            // The opaque card ends a pixel beyond the left border.
            camera: Camera {
                principal_px: Point2::new(-3.0, 30.0),
                ..shot(0.0).camera
            },
            lights: Vec::new(),
            ..shot(0.0)
        };
        let wide = Shot {
            camera: narrow.camera.widened(24),
            ..narrow.clone()
        };
        let [found, expected] = [&narrow, &wide].map(rendered);
        let mut seen = 0.0_f32;
        for (x, y) in (0..60).flat_map(|y| [(0, y), (1, y), (5, y)]) {
            let expected = expected[(x + 24, y + 24)];
            assert!((found[(x, y)].r - expected.r).abs() < 1e-3, "({x}, {y})");
            seen = seen.max(expected.a);
        }
        assert!(seen > 0.01, "nothing moves in");
    }

    #[test]
    fn the_blur_is_the_mean_of_many_pictures_while_the_shutter_is_open() {
        let times = (0..TIMES).map(|i| (i as f64 + 0.5) / TIMES as f64 - 0.5);
        let pictures: Vec<_> = times.map(|t| rendered(&shot(t))).collect();
        let exact = Image::from_fn(80, 60, |x, y| {
            pictures.iter().fold(PremulRgba::default(), |sum, picture| {
                sum.add_scaled(1.0 / TIMES as f32, picture[(x, y)])
            })
        });
        let still = rendered(&shot(0.0));
        let blurred = rendered(&Shot {
            motion_m: WAY_M,
            ..shot(0.0)
        });
        let (off, unblurred) = (rmse(&blurred, &exact), rmse(&still, &exact));
        assert!(
            off < 0.002 && unblurred > 5.0 * off,
            "{off}, {unblurred} without"
        );
        assert_eq!(blurred[(0, 0)], still[(0, 0)], "far from all cards");
    }

    #[test]
    fn what_interreflection_brightens_stays_bright() {
        let still = Shot {
            interreflection: LinearRgb::grey(0.9),
            ..shot(0.0)
        };
        let moving = Shot {
            motion_m: [1e-4, 0.0],
            ..still.clone()
        };
        let (still, moving) = (rendered(&still), rendered(&moving));
        let pairs = still.pixels().iter().zip(moving.pixels());
        let most = pairs.map(|(a, b)| (a.r - b.r).abs()).fold(0.0, f32::max);
        assert!(most < 0.01, "{most}");
    }

    #[test]
    fn a_blur_of_the_photo_comes_on_top_of_that_of_the_motion() {
        let moving = Shot {
            motion_m: WAY_M,
            ..shot(0.0)
        };
        let options = Quality::Draft.into();
        let exposed = Exposed::new(render(&moving, &options), &moving, &options);
        // A Gaussian this narrow leaves every pixel unchanged.
        let blur_px = Blur::Known(0.05);
        let [sharp, blurred] = [Blur::NONE, blur_px].map(|blur_px| {
            let finish = PostProcess {
                blur_px,
                ..PostProcess::default()
            };
            exposed.finished(&moving, &finish)
        });
        assert!(rmse(&sharp, &blurred) < 1e-6);
    }

    #[test]
    fn without_a_plate_coverage_is_blurred_too() {
        let moving = Shot {
            plate: None,
            motion_m: WAY_M,
            ..shot(0.0)
        };
        let alphas: Vec<f32> = rendered(&moving).pixels().iter().map(|p| p.a).collect();
        assert!(alphas.iter().any(|a| (0.5..0.95).contains(a)));
        assert!(alphas.iter().all(|a| (0.0..=1.0).contains(a)));
    }
}
