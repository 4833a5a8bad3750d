//! Retouched cards compared with what they stand for.

use super::*;
use crate::camera::Camera;
use crate::composite;
use crate::deep::DeepImage;
use crate::filter::halve;
use crate::geom::{Point2, Point3, Pose, Quad, UnitQuaternion};
use crate::image::{Image, Mask};
use crate::label::{LabelOptions, label};
use crate::pixel::{Film, LinearRgb, ObjectId, PremulRgba};
use crate::render::{render, render_coverage, render_reference};
use crate::scene::{AreaLight, Bend, Grade};
use geo::{Area, Contains};

const OPTIONS: RenderOptions = RenderOptions {
    subsamples: 3,
    light_samples: 3,
    ambient_samples: 32,
    cell_px: 1.5,
    refraction: true,
};

fn camera() -> Camera {
    let eye = Point3::new(0.3, -0.35, 0.7);
    Camera::look_at(eye, Point3::new(0.0, 0.0, 0.05), 420.0, [240, 180])
}

/// An ellipse of the texture.
fn is_inside(u: f64, v: f64) -> bool {
    ((u - 0.5) / 0.42).powi(2) + ((v - 0.5) / 0.36).powi(2) < 1.0
}

/// An opaque ellipse of odd size, rotated about all axes.
fn card(bend: Bend, roll: f64) -> Card {
    let rotation = UnitQuaternion::from_euler_angles(0.2 + roll, -0.15, 0.5);
    let quad = Quad {
        world_from_card: Pose::from_parts(nalgebra::Vector3::new(0.01, 0.0, 0.06).into(), rotation),
        size: [0.26, 0.12],
    };
    let texture = Image::from_fn(601, 279, |x, y| {
        let [u, v] = [(x as f64 + 0.5) / 601.0, (y as f64 + 0.5) / 279.0];
        let a = if is_inside(u, v) { 1.0 } else { 0.0 };
        PremulRgba::new(0.5 * a, 0.5 * a, 0.5 * a, a)
    });
    let outline = (0..90).map(|k| {
        let turn = f64::from(k).to_radians() * 4.0;
        Point2::new(0.5 + 0.42 * turn.cos(), 0.5 + 0.36 * turn.sin())
    });
    Card {
        outline_uv: outline.collect(),
        bend,
        ..Card::new(ObjectId(1), quad, texture)
    }
}

fn shot(card: Card) -> Shot {
    Shot::new(camera()).with_card(card)
}

/// Pixels of which the card covers more than half: of four by four parts of a pixel, those that
/// contain points of it.
fn pixels_hit(card: &Card) -> Mask {
    let (camera, mut hit) = (camera(), Image::filled(960, 720, 0.0_f32));
    for i in 0..3000 {
        for j in 0..1400 {
            let [u, v] = [(f64::from(i) + 0.5) / 3000.0, (f64::from(j) + 0.5) / 1400.0];
            if is_inside(u, v) {
                let (px, _) = camera.project(card.point(u, v)).unwrap();
                hit[((4.0 * px.x) as usize, (4.0 * px.y) as usize)] = 1.0;
            }
        }
    }
    halve(&halve(&hit)).map(|share| share > 0.5)
}

fn alpha(deep: &DeepImage) -> Image<f32> {
    Image::from_fn(deep.width(), deep.height(), |x, y| {
        deep.at(x, y).iter().map(|sample| sample.alpha).sum()
    })
}

#[test]
fn what_asks_for_nothing_is_passed_on() {
    let shot = shot(card(Bend::default(), 0.0));
    assert!(matches!(retouched(&shot, &OPTIONS), Cow::Borrowed(_)));
    assert!(matches!(retouched_fully(&shot, &OPTIONS), Cow::Borrowed(_)));
}

#[test]
fn a_bent_card_and_its_outline_are_seen_where_the_cylinder_is() {
    let bends = [(40.0, 90.0), (-40.0, 90.0), (30.0, 20.0)];
    for ((deg, axis_deg), roll) in bends.into_iter().zip([0.0, 0.0, std::f64::consts::PI]) {
        let bent = card(Bend { deg, axis_deg }, roll);
        let hit = pixels_hit(&bent);
        let shot = shot(bent);
        let deep = render_coverage(&shot, &OPTIONS);
        let wrong = |hit: &Mask| {
            let inside = alpha(&deep).map(|a| a > 0.5);
            let differ = inside.zip_map(hit, |a, b| a != b);
            differ.count()
        };
        let [same, other] = [&hit, &pixels_hit(&card(Bend::default(), roll))].map(wrong);
        assert!(
            same < 60 && other > 2 * same,
            "{deg}: {same} {other} of {}",
            hit.count()
        );

        let labels = label(&deep, &shot, &LabelOptions::default());
        let ring = &labels.objects[0].outline_px[0];
        let ring: Vec<_> = ring.iter().map(|p| geo::Coord { x: p.x, y: p.y }).collect();
        let outlined = geo::Polygon::new(geo::LineString(ring), Vec::new()).unsigned_area();
        let covered: f32 = alpha(&deep).pixels().iter().sum();
        assert!(
            (outlined / f64::from(covered) - 1.0).abs() < 0.01,
            "{outlined} {covered}"
        );
        let (a, b) = (
            labels.objects[0].amodal_box,
            outline_box(&labels.objects[0].outline_px[0]),
        );
        let sides = [a.x0 - b[0], a.y0 - b[1], a.x1 - b[2], a.y1 - b[3]];
        assert!(sides.iter().all(|d| d.abs() < 1.5), "{sides:?}");
    }
}

fn outline_box(ring: &[Point2<f64>]) -> [f64; 4] {
    let all = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
    ring.iter().fold(all, |b, p| {
        [b[0].min(p.x), b[1].min(p.y), b[2].max(p.x), b[3].max(p.y)]
    })
}

#[test]
fn a_bent_card_seen_from_low_down_and_its_outline_agree() {
    // 80 degrees from straight down, half a metre away.
    let eye = Point3::new(0.0, -0.492, 0.087);
    let camera = Camera::look_at(eye, Point3::origin(), 300.0, [320, 240]);
    for deg in [60.0, -60.0] {
        let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.5);
        let at = nalgebra::Vector3::new(0.0, 0.0, 0.06);
        let quad = Quad {
            world_from_card: Pose::from_parts(at.into(), turn),
            size: [0.2; 2],
        };
        let texture = Image::filled(64, 64, PremulRgba::new(0.5, 0.5, 0.5, 1.0));
        let bent = Card {
            bend: Bend {
                deg,
                axis_deg: 20.0,
            },
            ..Card::new(ObjectId(1), quad, texture)
        };
        let shot = Shot::new(camera).with_card(bent);
        let deep = render_coverage(&shot, &OPTIONS);
        let labels = label(&deep, &shot, &LabelOptions::default());
        let rings = labels.objects[0].outline_px.iter().map(|ring| {
            let ring = ring.iter().map(|p| geo::Coord { x: p.x, y: p.y });
            geo::Polygon::new(geo::LineString(ring.collect()), Vec::new())
        });
        let rings: Vec<_> = rings.collect();
        let outlined = Image::from_fn(320, 240, |x, y| {
            let center = geo::Point::new(x as f64 + 0.5, y as f64 + 0.5);
            rings.iter().any(|ring| ring.contains(&center))
        });
        let covered = alpha(&deep).map(|a| a > 0.5);
        let both = covered.zip_map(&outlined, |a, b| a && b).count() as f64;
        let either = covered.zip_map(&outlined, |a, b| a || b).count() as f64;
        assert!(both > 0.8 * either, "{deg}: {both} of {either}");
    }
}

#[test]
fn a_card_behind_the_camera_is_not_seen_whatever_is_asked_of_it() {
    let eye = Point3::new(0.0, -0.9, 0.6);
    let tilt = 75_f64.to_radians();
    let target = eye + nalgebra::Vector3::new(0.0, tilt.sin(), -tilt.cos());
    let [lean, roll] = [-25_f64, 160.0].map(f64::to_radians);
    let turn = UnitQuaternion::from_euler_angles(lean, 0.0, 0.0)
        * UnitQuaternion::from_euler_angles(0.0, 0.0, roll);
    let at = nalgebra::Vector3::new(0.2, -1.35, 0.06);
    let quad = Quad {
        world_from_card: Pose::from_parts(at.into(), turn),
        size: [0.2; 2],
    };
    let texture = Image::filled(64, 64, PremulRgba::new(0.5, 0.5, 0.5, 1.0));
    let plain = Card::new(ObjectId(1), quad, texture);
    let grade = Grade {
        glints: 0.5,
        ..Grade::default()
    };
    let bend = Bend {
        deg: 20.0,
        axis_deg: 0.0,
    };
    let cards = [
        (plain.clone(), EdgeTreatment::Soft),
        (
            Card {
                bend,
                ..plain.clone()
            },
            EdgeTreatment::AsIs,
        ),
        (Card { grade, ..plain }, EdgeTreatment::AsIs),
    ];
    // The same view in a normal picture and in a tiny one.
    for (focal_px, image) in [(280.0, [320, 240]), (7.0, [8, 6])] {
        let camera = Camera::look_at(eye, target, focal_px, image);
        for (card, edges) in cards.clone() {
            let shot = Shot {
                edges,
                ..Shot::new(camera).with_card(card)
            };
            let deep = render(&shot, &OPTIONS);
            assert!(alpha(&deep).pixels().iter().all(|a| *a == 0.0), "{edges:?}");
            let labels = label(&deep, &shot, &LabelOptions::default());
            assert!(labels.objects.is_empty(), "{edges:?}");
        }
    }
}

#[test]
fn edges_of_a_card_smaller_than_a_pixel_stay_close_to_it() {
    let far = Point3::new(0.0, 0.0, 1e5);
    let camera = Camera::look_at(far, Point3::origin(), 300.0, [64, 48]);
    let shot = Shot {
        edges: EdgeTreatment::Soft,
        ..Shot::new(camera).with_card(card(Bend::default(), 0.0))
    };
    let size = retouched(&shot, &OPTIONS).cards[0].quad.size;
    assert!(size.iter().all(|side| *side < 4.0), "{size:?}");
}

#[test]
fn light_on_a_bent_card_follows_its_normal() {
    // So far away that its direction is the same everywhere on the card.
    let sun = AreaLight::new([60.0, 10.0, 60.0], [0.1; 2], 1e5);
    let quad = Quad {
        world_from_card: Pose::translation(0.0, 0.0, 0.06),
        size: [0.26, 0.12],
    };
    let texture = Image::filled(521, 241, PremulRgba::new(0.5, 0.5, 0.5, 1.0));
    let bent = Card {
        bend: Bend {
            deg: -36.0,
            axis_deg: 90.0,
        },
        ..Card::new(ObjectId(1), quad, texture)
    };
    let shot = Shot::new(camera()).with_light(sun).with_card(bent.clone());
    let deep = render(&shot, &OPTIONS);
    let to_sun = nalgebra::Vector3::new(60.0, 10.0, 60.0).normalize();
    // The sum of a quarter turn over 0.26 m, by the circle's own equation.
    let radius = 0.26 / 36_f64.to_radians();
    let light = |u: f64| {
        let (px, _) = camera().project(bent.point(u, 0.5)).unwrap();
        f64::from(deep.at(px.x as usize, px.y as usize)[0].light.g)
    };
    let expected = |u: f64| {
        let turn = (u - 0.5) * 0.26 / radius;
        nalgebra::Vector3::new(turn.sin(), 0.0, turn.cos()).dot(&to_sun)
    };
    for u in [0.1, 0.3, 0.5, 0.7, 0.9] {
        let found = light(u) / light(0.5) / (expected(u) / expected(0.5));
        assert!((found - 1.0).abs() < 0.015, "{u}: {found}");
    }
}

#[test]
fn retouching_nothing_at_another_level_changes_next_to_nothing() {
    let plain = card(Bend::default(), 0.0);
    let grade = Grade {
        glints: 0.5,
        ..Grade::default()
    };
    // None of its texels is a glint.
    let retouched = Card {
        grade,
        ..plain.clone()
    };
    let [a, b] = [plain, retouched].map(|card| {
        let shot = shot(card).with_ambient(LinearRgb::WHITE);
        composite::film(&render(&shot, &OPTIONS))
    });
    let differences = a.zip_map(&b, |a, b| (a.color.g - b.color.g).abs());
    let worst = differences.pixels().iter().fold(0.0_f32, |m, &d| m.max(d));
    assert!(worst < 0.01, "{worst}");
}

#[test]
fn a_dyed_card_colours_what_is_seen_through_it_as_in_the_definition() {
    let film = Image::from_fn(300, 140, |x, y| {
        let is_bottle = (20..280).contains(&x) && (20..120).contains(&y);
        let a = if is_bottle { 0.2 } else { 0.0 };
        PremulRgba::new(0.1 * a, 0.1 * a, 0.1 * a, a)
    });
    let quad = Quad {
        world_from_card: Pose::translation(0.0, 0.0, 0.06),
        size: [0.26, 0.12],
    };
    let tint = LinearRgb::new(0.25, 0.61, 0.32);
    let dyed = Card {
        grade: Grade {
            tint,
            ..Grade::default()
        },
        ..Card::new(ObjectId(1), quad, film)
    };
    let shot = shot(dyed).with_ambient(LinearRgb::WHITE);
    let fast = composite::film(&render(&shot, &OPTIONS));
    let exact = composite::film(&render_reference(&shot, &OPTIONS));
    let middle: Film = fast[(120, 90)];
    let expected = tint.scale(0.8).channels();
    let passes = middle.transmittance().channels();
    assert!(
        passes
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-3),
        "{passes:?}"
    );
    let worst = fast.zip_map(&exact, |a, b| (a.opacity.r - b.opacity.r).abs());
    let worst = worst.pixels().iter().fold(0.0_f32, |m, &d| m.max(d));
    assert!(worst < 0.08, "{worst}");
}
