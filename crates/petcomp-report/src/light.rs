//! Light and shadow: the filtered form and plain samples against closed forms, error against run time.
//!
//! One opaque card hangs over the surface. What it leaves of a rectangular light at a point is Lambert's formula for the
//! part of the light that the card does not hide: the light cut by the planes through the point and the card's sides. What
//! it leaves of an even sky is 1 less the card's form factor. Neither shares anything with the renderer's sampling.

use super::clock::timed;
use super::pile::above;
use super::{Diagram, Point};
use petcomp::DeepImage;
use petcomp::Image;
use petcomp::Quality;
use petcomp::Result;
use petcomp::geom::{Plane, Point2, Point3, Pose, Quad, UnitQuaternion, Vector3};
use petcomp::light::{frame, polygon_irradiance};
use petcomp::render::{RenderOptions, render, render_reference};
use petcomp::scene::{AreaLight, Card, Grade, LightShape, Shot};
use petcomp::{LinearRgb, ObjectId, PremulRgba};
use std::f64::consts::PI;

const SIZE: [u32; 2] = [160, 120];
/// Size, height and turn of the card, metres and radians.
const CARD: [f64; 2] = [0.2, 0.08];
const HEIGHT: f64 = 0.05;
const TURN: f64 = 0.4;
/// Samples along each side of the light.
const LIGHT: [usize; 7] = [1, 2, 3, 4, 6, 8, 12];
const SKY: [usize; 7] = [4, 12, 32, 64, 100, 200, 400];
const CELLS: [f64; 5] = [4.0, 2.0, 1.5, 1.0, 0.33];
/// The plain form takes a thousand times as long, so that it is tried with fewer samples.
const MOST_PLAIN: usize = 64;
const RUNS: usize = 5;
/// Error of the shadow's share of light that nobody sees: half of a code of 8 bits at middle grey.
const UNSEEN: f64 = 0.004;

/// Which light there is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum LightKind {
    Area,
    Sky,
}

/// The shadow of a card under an area light, and under an even sky.
///
/// # Errors
/// A thread that cannot be had.
pub fn diagrams() -> Result<Vec<Diagram>> {
    [LightKind::Area, LightKind::Sky]
        .map(diagram)
        .into_iter()
        .collect()
}

fn diagram(kind: LightKind) -> Result<Diagram> {
    let shot = shot(kind);
    let exact = exact(&shot, kind);
    let usual = RenderOptions::default();
    let sampled = |n: usize| match kind {
        LightKind::Area => RenderOptions {
            light_samples: n,
            ..usual
        },
        LightKind::Sky => RenderOptions {
            ambient_samples: n,
            ..usual
        },
    };
    let counts = if kind == LightKind::Area { LIGHT } else { SKY };
    let name = |n: usize| {
        if kind == LightKind::Area {
            format!("{n} x {n}")
        } else {
            n.to_string()
        }
    };
    let mut points = Vec::new();
    for n in counts {
        points.push(measured(
            ("filtered", name(n)),
            &shot,
            &exact,
            &sampled(n),
            render,
        )?);
    }
    for cell_px in CELLS.into_iter().filter(|c| *c != usual.cell_px) {
        let options = RenderOptions { cell_px, ..usual };
        points.push(measured(
            ("filtered, other cells", format!("{cell_px} px")),
            &shot,
            &exact,
            &options,
            render,
        )?);
    }
    for n in counts.into_iter().filter(|n| *n <= MOST_PLAIN) {
        // One sample a pixel: shadows are smooth, and what is compared is the light.
        let options = RenderOptions {
            subsamples: 1,
            ..sampled(n)
        };
        points.push(measured(
            ("plain samples", name(n)),
            &shot,
            &exact,
            &options,
            render_reference,
        )?);
    }
    for quality in [Quality::Draft, Quality::Reference] {
        let options = quality.render();
        let point = measured(
            ("all of a quality", String::new()),
            &shot,
            &exact,
            &options,
            render,
        )?;
        points.push(point.used_where(|q| q == quality));
    }
    Ok(told(kind, points))
}

fn told(kind: LightKind, points: Vec<Point>) -> Diagram {
    let (file, title, reference) = match kind {
        LightKind::Area => (
            "shadow_light",
            "shadow: a card under an area light",
            "Lambert's formula for the part of the light that is seen (closed form)",
        ),
        LightKind::Sky => (
            "shadow_sky",
            "shadow: a card under an even sky",
            "form factor of the card (closed form)",
        ),
    };
    Diagram {
        file: file.into(),
        title: title.into(),
        input: format!("one opaque card {} mm over the surface, {} x {}", HEIGHT * 1e3, SIZE[0], SIZE[1]),
        error: "RMS error of the share of light".into(),
        cost: "CPU seconds of a picture".into(),
        reference: reference.into(),
        points,
        limit: Some((UNSEEN, "half of an 8-bit code at middle grey".into())),
        why: "Piles cast many shadows on each other, so that a single one is held to a fraction of what is seen."
            .into(),
        ..Diagram::default()
    }
}

type Renderer = fn(&Shot, &RenderOptions) -> DeepImage;

fn measured(
    (curve, setting): (&str, String),
    shot: &Shot,
    exact: &[Option<f64>],
    options: &RenderOptions,
    renderer: Renderer,
) -> Result<Point> {
    let (deep, seconds) = timed(RUNS, || Ok(renderer(shot, options)))?;
    let pairs = deep
        .shadow()
        .pixels()
        .iter()
        .zip(exact)
        .filter_map(|(p, e)| Some((f64::from(p.g), (*e)?)));
    let (sum, count) = pairs.fold((0.0, 0.0), |(sum, n), (p, e)| {
        (sum + (p - e).powi(2), n + 1.0)
    });
    let is_default = *options == RenderOptions::default();
    Ok(
        Point::new(curve, setting, seconds, (sum / f64::max(count, 1.0)).sqrt())
            .used_where(|q| is_default && q == Quality::default()),
    )
}

fn shot(kind: LightKind) -> Shot {
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), TURN);
    let card = Card {
        id: ObjectId(1),
        class: 0,
        quad: Quad {
            world_from_card: Pose::from_parts(Vector3::new(0.0, 0.0, HEIGHT).into(), rotation),
            size: CARD,
        },
        // So fine that its border, half a texel soft, is a sharp one.
        texture: Image::filled(512, 256, PremulRgba::new(0.0, 0.0, 0.0, 1.0)).into(),
        back: None,
        outline_uv: [].into(),
        grade: Grade::default(),
    };
    let shot = Shot::new(above(SIZE, 0.6)).with_card(card);
    match kind {
        LightKind::Sky => shot.with_ambient(LinearRgb::WHITE),
        LightKind::Area => shot.with_light(AreaLight {
            shape: LightShape::Rectangle,
            position: [0.3, 0.2, 0.8],
            target: [0.0; 3],
            size: [0.3; 2],
            power: 5.0,
            color: LinearRgb::WHITE,
        }),
    }
}

/// What the card leaves of the light at each pixel's centre; nothing where the card itself is seen, or near its border.
fn exact(shot: &Shot, kind: LightKind) -> Vec<Option<f64>> {
    let quad = &shot.cards[0].quad;
    // A tenth more to each side, for the pixels of its border.
    let around = Quad {
        size: quad.size.map(|side| 1.2 * side),
        ..*quad
    };
    let (card, [w, h]) = (quad.corners(), shot.camera.image);
    let at = |i: u32| {
        let ray = shot
            .camera
            .ray(Point2::new(f64::from(i % w) + 0.5, f64::from(i / w) + 0.5));
        let point = ray.at(Plane::surface().intersect(&ray)?);
        around
            .intersect(&ray)
            .is_none()
            .then(|| share(shot, kind, &card, point))
    };
    (0..w * h).map(at).collect()
}

fn share(shot: &Shot, kind: LightKind, card: &[Point3<f64>; 4], point: Point3<f64>) -> f64 {
    match kind {
        LightKind::Sky => 1.0 - polygon_irradiance(card, point, Vector3::z()) / PI,
        LightKind::Area => {
            let light = &shot.lights[0];
            let face = frame(light).corners(light.size);
            let hidden = shadowed(&face, card, point);
            1.0 - polygon_irradiance(&hidden, point, Vector3::z())
                / polygon_irradiance(&face, point, Vector3::z())
        }
    }
}

/// The part of a light's face that a card hides from a point: cut by the planes through the point and each side.
fn shadowed(
    face: &[Point3<f64>; 4],
    card: &[Point3<f64>; 4],
    point: Point3<f64>,
) -> Vec<Point3<f64>> {
    let middle =
        Point3::from(card.iter().map(|c| c.coords).sum::<Vector3<f64>>() / card.len() as f64);
    let sides = card.iter().zip(card.iter().cycle().skip(1));
    sides.fold(face.to_vec(), |kept, (a, b)| {
        let normal = (a - point).cross(&(b - point));
        let inwards = normal * normal.dot(&(middle - point)).signum();
        cut(&kept, |p| inwards.dot(&(p - point)))
    })
}

/// The part of a polygon on the positive side (Sutherland and Hodgman 1974).
fn cut(polygon: &[Point3<f64>], side: impl Fn(&Point3<f64>) -> f64) -> Vec<Point3<f64>> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (a, b) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        let (s, t) = (side(a), side(b));
        if s >= 0.0 {
            kept.push(*a);
        }
        if (s >= 0.0) != (t >= 0.0) {
            kept.push(a + (b - a) * (s / (s - t)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The share of the light's points that a point sees past the card, weighted as light is.
    fn brute_force(shot: &Shot, point: Point3<f64>) -> f64 {
        const N: usize = 120;
        let light = &shot.lights[0];
        let face = frame(light);
        let place = |i: usize, side: f64| ((i as f64 + 0.5) / N as f64 - 0.5) * side;
        let (mut open, mut all) = (0.0, 0.0);
        for i in 0..N * N {
            let from = face.point(place(i % N, light.size[0]), place(i / N, light.size[1]));
            let way = from - point;
            let weight = way.z * -face.normal.dot(&way) / way.norm_squared().powi(2);
            let ray = petcomp::geom::Ray {
                origin: point,
                direction: way,
            };
            let is_hidden = shot.cards[0]
                .quad
                .intersect(&ray)
                .is_some_and(|(t, _)| t > 0.0);
            all += weight;
            open += if is_hidden { 0.0 } else { weight };
        }
        open / all
    }

    #[test]
    fn the_closed_form_is_what_many_rays_find() {
        let shot = shot(LightKind::Area);
        let card = shot.cards[0].quad.corners();
        for [x, y] in [
            [0.0, 0.0],
            [-0.06, -0.03],
            [-0.1, 0.02],
            [0.05, -0.08],
            [0.3, 0.3],
        ] {
            let point = Point3::new(x, y, 0.0);
            let (exact, found) = (
                share(&shot, LightKind::Area, &card, point),
                brute_force(&shot, point),
            );
            assert!((exact - found).abs() < 0.01, "{x} {y}: {exact} {found}");
        }
    }

    #[test]
    fn more_samples_come_nearer_and_the_default_is_near() {
        let shot = shot(LightKind::Area);
        let exact = exact(&shot, LightKind::Area);
        let error = |options: RenderOptions| {
            measured(("", String::new()), &shot, &exact, &options, render)
                .unwrap()
                .error
        };
        let [draft, normal, best] = Quality::ALL.map(|q| error(q.render()));
        assert!(
            draft > normal && normal > best && best < 0.005 && normal < 0.03,
            "{draft} {normal} {best}"
        );
    }

    #[test]
    fn a_card_far_from_the_light_hides_nothing() {
        let shot = shot(LightKind::Area);
        let card = shot.cards[0].quad.corners();
        assert_eq!(
            share(&shot, LightKind::Area, &card, Point3::new(2.0, 2.0, 0.0)),
            1.0
        );
        assert!(share(&shot, LightKind::Sky, &card, Point3::new(50.0, 0.0, 0.0)) > 0.999_99);
    }
}
