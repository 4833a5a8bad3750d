//! A preview of a scene from above and from the side, without textures, to judge a fall at a
//! glance.

use super::bodies::solids_at_rest;
use super::overlap::{Solid, from_lowest};
use crate::draw::{class_color, ink_on, outline, rgb, text};
use crate::geom::{Point2, Point3};
use crate::image::Image;
use crate::pixel::Srgb8;
use crate::scene::{Scene, SettleOptions, Surface, Wall};

/// Width of the picture, pixels.
const WIDTH_PX: usize = 640;
/// Margin around each view, pixels.
const MARGIN_PX: f64 = 24.0;
/// Maximum ratio of the surface's width to the height of the front view.
const MAX_ASPECT_RATIO: f64 = 20.0;
const PAPER_COLOR: Srgb8 = rgb(0xff, 0xff, 0xff);
const WALL_COLOR: Srgb8 = rgb(0x60, 0x60, 0x60);

/// Draws the bodies of a scene as lines, display-encoded, 640 pixels wide: at the top, seen from
/// above (`+y` up); below, seen from the front (`+z` up), at the same scale. Falling objects are
/// shown where they start. Numbers are ids.
pub fn preview(scene: &Scene, options: &SettleOptions) -> Image<Srgb8> {
    let bodies = solids_at_rest(scene, scene, options);
    let views = Views::new(&scene.surface, &bodies);
    let mut canvas = Image::filled(WIDTH_PX, views.height_px(), PAPER_COLOR);
    views.draw_room(&mut canvas);
    for i in from_lowest(&bodies)
        .into_iter()
        .filter(|&i| !bodies[i].is_gone)
    {
        views.draw_body(&mut canvas, i, &bodies[i]);
    }
    canvas
}

/// The view from above, and below it the view from the front.
struct Views {
    /// Size of the surface, metres.
    size: [f64; 2],
    /// Its walls.
    wall: Option<Wall>,
    /// Height of the highest point in the front view, metres.
    top: f64,
    /// Pixels per metre.
    scale: f64,
    /// Height of the view from above, pixels.
    above_height: f64,
}

impl Views {
    fn new(surface: &Surface, bodies: &[Solid]) -> Self {
        let [w, h] = surface.size;
        let scale = (WIDTH_PX as f64 - 2.0 * MARGIN_PX) / w;
        let tops = bodies.iter().map(Solid::top);
        Self {
            size: [w, h],
            wall: surface.wall,
            top: tops.fold(w / MAX_ASPECT_RATIO, f64::max),
            scale,
            above_height: h * scale + 2.0 * MARGIN_PX,
        }
    }

    fn height_px(&self) -> usize {
        let front_height = self.top * self.scale + MARGIN_PX;
        (self.above_height + front_height).ceil() as usize
    }

    fn column_px(&self, x: f64) -> f64 {
        MARGIN_PX + (x + self.size[0] / 2.0) * self.scale
    }

    fn seen_from_above(&self, p: Point3<f64>) -> Point2<f64> {
        let row = MARGIN_PX + (self.size[1] / 2.0 - p.y) * self.scale;
        Point2::new(self.column_px(p.x), row)
    }

    fn seen_from_front(&self, p: Point3<f64>) -> Point2<f64> {
        let row = self.above_height + (self.top - p.z) * self.scale;
        Point2::new(self.column_px(p.x), row)
    }

    /// The edges of the surface, and the floor with the walls.
    fn draw_room(&self, canvas: &mut Image<Srgb8>) {
        outline(canvas, &self.surface_edges(), WALL_COLOR);
        outline(canvas, &self.walls(), WALL_COLOR);
    }

    fn surface_edges(&self) -> [Point2<f64>; 4] {
        let [x, y] = self.size.map(|side| side / 2.0);
        [(-x, -y), (x, -y), (x, y), (-x, y)]
            .map(|(x, y)| self.seen_from_above(Point3::new(x, y, 0.0)))
    }

    fn walls(&self) -> [Point2<f64>; 4] {
        let x = self.size[0] / 2.0;
        let (rim, top) = match self.wall {
            Some(wall) => (x + wall.outset(), wall.height),
            None => (x, self.top),
        };
        [(-x, 0.0), (x, 0.0), (rim, top), (-rim, top)]
            .map(|(x, z)| self.seen_from_front(Point3::new(x, 0.0, z)))
    }

    fn draw_body(&self, canvas: &mut Image<Srgb8>, index: usize, body: &Solid) {
        let color = class_color(index as u32);
        draw_faces(canvas, body, color, |p| self.seen_from_above(p));
        draw_faces(canvas, body, color, |p| self.seen_from_front(p));
        let at = self.seen_from_above(body.center().into());
        let at = [at.x as isize, at.y as isize];
        text(canvas, at, &(index + 1).to_string(), ink_on(PAPER_COLOR));
    }
}

/// Draws the upper and the lower face of a body.
fn draw_faces(
    canvas: &mut Image<Srgb8>,
    body: &Solid,
    color: Srgb8,
    project: impl Fn(Point3<f64>) -> Point2<f64>,
) {
    for z in [body.half.z, -body.half.z] {
        let corners = body.outline.iter();
        let corners = corners.map(|&[x, y]| body.world_from_body * Point3::new(x, y, z));
        let ring: Vec<_> = corners.map(&project).collect();
        outline(canvas, &ring, color);
    }
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
            assert_eq!(picture.width(), WIDTH_PX);
            let colored = |p: &&Srgb8| p.r != p.g || p.g != p.b;
            let above =
                (0.4 / 0.6 * (WIDTH_PX as f64 - 2.0 * MARGIN_PX) + 2.0 * MARGIN_PX) as usize;
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
