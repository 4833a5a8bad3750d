//! Labels drawn over their picture, for inspection.

use crate::color::encode_srgb8;
use crate::draw;
use crate::geom::{BBox, Point2};
use crate::image::Image;
use crate::label::{Labels, ObjectLabel};
use crate::pixel::{PremulRgba, Srgb8};

/// Colour of outlines without a label.
pub(crate) const UNLABELLED: Srgb8 = draw::rgb(0xC8, 0xC8, 0xC8);

/// Draws labels onto a scene-linear picture (over black where it is transparent): a box with the
/// name of its class around each topmost object that is not truncated too much, the outlines of the
/// others in thin grey.
///
/// `classes` are names in order; a class beyond them is named by its number.
pub fn overlay(frame: &Image<PremulRgba>, labels: &Labels, classes: &[String]) -> Image<Srgb8> {
    let mut canvas = frame.map(|p| encode_srgb8(p.color()));
    draw_labels(&mut canvas, labels, is_boxed);
    for object in labels.objects.iter().filter(|o| is_boxed(o)) {
        draw_tag(&mut canvas, object, &name_or_number(object.class, classes));
    }
    canvas
}

fn is_boxed(object: &ObjectLabel) -> bool {
    object.is_topmost() && !object.is_too_truncated()
}

fn name_or_number(class: u32, names: &[String]) -> String {
    let name = names.get(class as usize).cloned();
    name.unwrap_or_else(|| class.to_string())
}

/// Draws boxes around the objects of `boxed` and outlines of the others onto a picture of any size.
pub(crate) fn draw_labels(
    canvas: &mut Image<Srgb8>,
    labels: &Labels,
    boxed: impl Fn(&ObjectLabel) -> bool,
) {
    let scale = scale_of(canvas, labels.image);
    let (boxed, outlined): (Vec<_>, Vec<_>) = labels.objects.iter().partition(|o| boxed(o));
    for ring in outlined.into_iter().flat_map(|o| &o.outline_px) {
        draw::outline(canvas, &scaled_ring(ring, scale), UNLABELLED);
    }
    for object in boxed {
        draw_box(canvas, object, scale);
    }
}

fn draw_box(canvas: &mut Image<Srgb8>, object: &ObjectLabel, scale: [f64; 2]) {
    let b = scaled(&object.amodal_box, scale);
    draw::border(canvas, &b, draw::class_color(object.class), 1);
}

/// Pixels of the canvas per pixel of the labelled picture.
fn scale_of(canvas: &Image<Srgb8>, image: [u32; 2]) -> [f64; 2] {
    let [width, height] = image.map(|side| f64::from(side.max(1)));
    [
        canvas.width() as f64 / width,
        canvas.height() as f64 / height,
    ]
}

fn scaled_ring(ring: &[Point2<f64>], [scale_x, scale_y]: [f64; 2]) -> Vec<Point2<f64>> {
    ring.iter()
        .map(|p| Point2::new(p.x * scale_x, p.y * scale_y))
        .collect()
}

fn scaled(b: &BBox, [x, y]: [f64; 2]) -> BBox {
    BBox {
        x0: b.x0 * x,
        y0: b.y0 * y,
        x1: b.x1 * x,
        y1: b.y1 * y,
    }
}

/// A name on the box's upper edge; below the edge if there is no room above it.
fn draw_tag(canvas: &mut Image<Srgb8>, object: &ObjectLabel, name: &str) {
    let tag = [draw::text_width(name) + 6, draw::LINE_PX];
    let [x, y] = tag_corner(&object.amodal_box, tag, canvas.width());
    let paper = draw::class_color(object.class);
    draw::fill(canvas, [x, y], tag, paper);
    draw::text(canvas, [x + 3, y], name, draw::ink_on(paper));
}

/// Above the box if there is room, else in it.
fn tag_corner(b: &BBox, [w, h]: [usize; 2], canvas_width: usize) -> [isize; 2] {
    let (left, top) = (b.x0 as isize, b.y0 as isize);
    let x = left.min(canvas_width as isize - w as isize).max(0);
    let above = top - h as isize;
    [x, if above >= 0 { above } else { top }]
}
