//! Blur of what moves while the shutter is open.
//!
//! # Method
//! A pixel is `light + through * plate`, where `through` is what objects and their shadows leave of
//! the plate. Plate and camera stand still, so the mean over time is that of `light` and of
//! `through` alone. Cards and shadows move together along the surface: what a pixel shows at
//! another time is what lay beside it on the surface, and both are averaged along that way. What
//! stands high over the surface would move a little farther in the picture.

use crate::camera::{Camera, RadialDistortion};
use crate::deep::{DeepImage, HoldoutSample};
use crate::filter::{self, sample_cubic_clamped};
use crate::geom::{Plane, Point2, Point3, Vector2, Vector3};
use crate::image::{Image, Mask};
use crate::pixel::{Film, LinearRgb, Mix};
use crate::scene::Shot;
use crate::work::{self, Kind};

/// Side of the squares of pixels that move by the same way.
const SQUARE_PX: usize = 8;
/// Ways below this leave pixels as they are, pixels.
const LEAST_WAY_PX: f64 = 0.02;
/// Places that are read along a way: near the horizon ways have no end.
const MOST_TAPS: f64 = 256.0;

/// What objects and their shadows do to the plate in the mean while the shutter is open, behind what
/// of the place stands in front and does not move; none where nothing moves.
///
/// `free` are samples that nothing of the place hides yet.
pub(super) fn moved(free: &DeepImage, shot: &Shot) -> Option<Image<Film>> {
    if shot.motion_m == [0.0; 2] {
        return None;
    }
    work::add(Kind::Filters, 1);
    // Shadows need something to fall on.
    let shadows = shot.plate.as_ref().map(|_| free.shadow());
    let effect = Image::from_fn(free.width(), free.height(), |x, y| {
        let film = free.flat(x, y);
        shadows.map_or(film, |shadows| film.shaded(shadows[(x, y)]))
    });
    let ways = ways(shot);
    let means = averaged(&effect, &ways);
    Some(match &shot.holdout {
        Some(holdout) => held_out(&means, free, holdout, &ways),
        None => means,
    })
}

/// Means behind what of the place stands in front: where it is, only what passes in front of it
/// counts.
fn held_out(
    means: &Image<Film>,
    free: &DeepImage,
    holdout: &Image<HoldoutSample>,
    ways: &Image<Vector2<f64>>,
) -> Image<Film> {
    Image::from_fn(means.width(), means.height(), |x, y| {
        let (mean, place) = (means[(x, y)], &holdout[(x, y)]);
        if place.coverage.0 == 0.0 || mean == Film::default() {
            return mean;
        }
        let way = ways[(x / SQUARE_PX, y / SQUARE_PX)];
        let front = mean_in_front(free, place, along(center(x, y), way));
        let past = Film::default().add_scaled(1.0 - place.coverage.0, mean);
        past.add_scaled(place.coverage.0, front)
    })
}

/// The mean at some places, those of the nearest pixels, of what is in front of the place.
fn mean_in_front(
    free: &DeepImage,
    place: &HoldoutSample,
    at: impl ExactSizeIterator<Item = Point2<f64>>,
) -> Film {
    let inside = |v: f64, side: usize| (v.max(0.0) as usize).min(side - 1);
    mean(at, |p| {
        let (x, y) = (inside(p.x, free.width()), inside(p.y, free.height()));
        free.in_front(x, y, place)
    })
}

/// Means along each pixel's way.
fn averaged(effect: &Image<Film>, ways: &Image<Vector2<f64>>) -> Image<Film> {
    let (width, height) = effect.size();
    let reached = reached(effect, ways);
    let least = least(effect);
    Image::from_fn(width, height, |x, y| {
        let square = (x / SQUARE_PX, y / SQUARE_PX);
        if !reached[square] {
            return Film::default();
        }
        let way = along(center(x, y), ways[square]);
        let mean = mean(way, |p| sample_cubic_clamped(effect, p.x, p.y));
        // A cubic curve is beyond its neighbours beside edges.
        Film {
            color: larger(mean.color, least.color),
            opacity: smaller(larger(mean.opacity, least.opacity), LinearRgb::WHITE),
        }
    })
}

/// Squares that anything reaches while the shutter is open.
fn reached(effect: &Image<Film>, ways: &Image<Vector2<f64>>) -> Mask {
    let mut filled = Image::filled(ways.width(), ways.height(), false);
    for (y, row) in effect.rows().enumerate() {
        for (x, film) in row.iter().enumerate() {
            filled[(x / SQUARE_PX, y / SQUARE_PX)] |= *film != Film::default();
        }
    }
    let longest = ways
        .pixels()
        .iter()
        .map(|way| way.norm())
        .fold(0.0, f64::max);
    // Two squares for the curve that is read, and for corners.
    filter::dilate(&filled, 0.5 * longest / SQUARE_PX as f64 + 2.0)
}

/// The mean of what is seen at some places.
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

/// Places along a way through its middle, at most a pixel apart.
fn along(middle: Point2<f64>, way: Vector2<f64>) -> impl ExactSizeIterator<Item = Point2<f64>> {
    let count = (way.norm().ceil() + 1.0).min(MOST_TAPS);
    (0..count as usize).map(move |i| middle + way * ((i as f64 + 0.5) / count - 0.5))
}

/// The least light and opacity of a picture: below 0 where refraction takes away what is seen
/// straight on, and where interreflection brightens the surface.
fn least(effect: &Image<Film>) -> Film {
    let films = effect.pixels().iter();
    films.fold(Film::default(), |least, film| Film {
        color: smaller(least.color, film.color),
        opacity: smaller(least.opacity, film.opacity),
    })
}

fn smaller(a: LinearRgb, b: LinearRgb) -> LinearRgb {
    LinearRgb::new(a.r.min(b.r), a.g.min(b.g), a.b.min(b.b))
}

fn larger(a: LinearRgb, b: LinearRgb) -> LinearRgb {
    LinearRgb::new(a.r.max(b.r), a.g.max(b.g), a.b.max(b.b))
}

/// Way in the picture, in pixels, of a point of the surface in the middle of each square; none
/// where the surface is not seen.
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
    use crate::pixel::{ObjectId, PremulRgba};
    use crate::quality::Quality;
    use crate::render::render;
    use crate::scene::{AreaLight, Blur, Card, LightShape, PostProcess};
    use std::sync::Arc;

    /// Where a shutter that opens at -1/2 and closes at 1/2 sees the card, as shares of its way.
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
        let light = AreaLight {
            shape: LightShape::Rectangle,
            position: [0.2, 0.4, 1.2],
            target: [0.0; 3],
            size: [0.1; 2],
            power: 20.0,
            color: LinearRgb::WHITE,
        };
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
        // So narrow a Gaussian leaves every pixel to itself.
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
