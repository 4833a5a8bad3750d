//! A picture of where everything lies, from above and from the side: no textures, to see a fall at a glance.

use super::overlap::Solid;
use super::{SettleOptions, solids_at_rest};
use crate::draw::{TextSize, class_color, ink_on, outline, rgb, text};
use crate::geom::{Point2, Point3};
use crate::image::Image;
use crate::pixel::Srgb8;
use crate::scene::Scene;

/// Width of the picture, and room around each view, pixels.
const WIDTH: usize = 640;
const MARGIN: f64 = 24.0;
const PAPER: Srgb8 = rgb(0xff, 0xff, 0xff);
const WALLS: Srgb8 = rgb(0x60, 0x60, 0x60);

/// The bodies of a scene as lines, display-encoded, 640 pixels wide: above, seen from above (`+y` up); below, seen from
/// the front (`+z` up), to the same scale. What still falls is shown where it starts. Numbers are ids.
pub fn preview(scene: &Scene, options: &SettleOptions) -> Image<Srgb8> {
    let [w, h] = scene.surface.size;
    let scale = (WIDTH as f64 - 2.0 * MARGIN) / w;
    let bodies = solids_at_rest(scene, scene, options);
    let top = bodies
        .iter()
        .map(|body| body.center().z + body.extent().z)
        .fold(w / 20.0, f64::max);
    let (from_above, from_front) = (h * scale + 2.0 * MARGIN, top * scale + MARGIN);
    let mut canvas = Image::filled(WIDTH, (from_above + from_front).ceil() as usize, PAPER);
    let above = |p: Point3<f64>| {
        Point2::new(
            MARGIN + (p.x + w / 2.0) * scale,
            MARGIN + (h / 2.0 - p.y) * scale,
        )
    };
    let front = |p: Point3<f64>| {
        Point2::new(
            MARGIN + (p.x + w / 2.0) * scale,
            from_above + (top - p.z) * scale,
        )
    };
    let corner = |x: f64, y: f64, z: f64| Point3::new(x * w / 2.0, y * h / 2.0, z);
    outline(
        &mut canvas,
        &[(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| above(corner(x, y, 0.0))),
        WALLS,
    );
    let room =
        [(-1.0, 0.0), (1.0, 0.0), (1.0, top), (-1.0, top)].map(|(x, z)| front(corner(x, 0.0, z)));
    outline(&mut canvas, &room, WALLS);
    let mut order: Vec<usize> = (0..bodies.len()).collect();
    order.sort_by(|&a, &b| bodies[a].center().z.total_cmp(&bodies[b].center().z));
    for i in order {
        let color = class_color(i as u32);
        faces(&bodies[i]).iter().for_each(|ring| {
            outline(
                &mut canvas,
                &ring.iter().map(|p| above(*p)).collect::<Vec<_>>(),
                color,
            )
        });
        faces(&bodies[i]).iter().for_each(|ring| {
            outline(
                &mut canvas,
                &ring.iter().map(|p| front(*p)).collect::<Vec<_>>(),
                color,
            )
        });
        let at = above(bodies[i].center().into());
        text(
            &mut canvas,
            [at.x as isize, at.y as isize],
            &(i + 1).to_string(),
            ink_on(PAPER),
            TextSize::Small,
        );
    }
    canvas
}

/// The upper and the lower face of a body.
fn faces(body: &Solid) -> [Vec<Point3<f64>>; 2] {
    [body.half.z, -body.half.z].map(|z| {
        let corner = |&[x, y]: &[f64; 2]| body.world_from_body * Point3::new(x, y, z);
        body.outline.iter().map(corner).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settle::tests::{dropped, falling};

    #[test]
    fn every_body_is_seen_twice() {
        let marks = |n: usize| {
            let mut scene = dropped(0, n);
            scene
                .objects
                .iter_mut()
                .for_each(|object| object.size = [0.1, 0.05]);
            let picture = preview(&scene, &SettleOptions::default());
            assert_eq!(picture.width(), WIDTH);
            let colored = |p: &&Srgb8| p.r != p.g || p.g != p.b;
            let above = (0.4 / 0.6 * (WIDTH as f64 - 2.0 * MARGIN) + 2.0 * MARGIN) as usize;
            let seen = |rows: std::ops::Range<usize>| {
                rows.map(|y| picture.row(y).iter().filter(colored).count())
                    .sum::<usize>()
            };
            [seen(0..above), seen(above..picture.height())]
        };
        let (none, some) = (marks(0), marks(3));
        assert!(
            none == [0, 0] && some.iter().all(|n| *n > 100),
            "{none:?} {some:?}"
        );
    }

    #[test]
    fn what_lies_far_outside_does_not_panic() {
        let mut scene = falling(&[([0.0, 0.0], 0.1)]);
        scene.objects[0].placement =
            crate::scene::Placement::At(crate::geom::Pose::translation(50.0, -9.0, -3.0));
        assert!(preview(&scene, &SettleOptions::default()).width() > 0);
    }
}
