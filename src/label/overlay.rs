//! Labels drawn onto their picture, to look at.

use crate::color::encode_srgb8;
use crate::draw::{self, TextSize};
use crate::geom::BBox;
use crate::image::Image;
use crate::label::{Labels, ObjectLabel};
use crate::pixel::{PremulRgba, Srgb8};

/// Colour of outlines without a label.
pub(crate) const UNLABELLED: Srgb8 = draw::rgb(0xC8, 0xC8, 0xC8);

/// Draws labels onto a scene-linear picture (over black where it is transparent): a box with the name of its class around
/// each topmost object, the outlines of the others in thin grey.
///
/// `classes` are names in order; a class beyond them is named by its number.
pub fn overlay(frame: &Image<PremulRgba>, labels: &Labels, classes: &[String]) -> Image<Srgb8> {
    let mut canvas = frame.map(|p| encode_srgb8(p.color()));
    draw_labels(&mut canvas, labels, ObjectLabel::is_topmost);
    for object in labels.objects.iter().filter(|o| o.is_topmost()) {
        let name = classes.get(object.class as usize).cloned();
        let name = name.unwrap_or_else(|| object.class.to_string());
        draw_tag(&mut canvas, object, &name);
    }
    canvas
}

/// Draws boxes around the objects of `boxed` and outlines of the others onto a picture of any size.
pub(crate) fn draw_labels(
    canvas: &mut Image<Srgb8>,
    labels: &Labels,
    boxed: impl Fn(&ObjectLabel) -> bool,
) {
    let scale_x = canvas.width() as f64 / f64::from(labels.image[0].max(1));
    let scale_y = canvas.height() as f64 / f64::from(labels.image[1].max(1));
    let (boxed, outlined): (Vec<_>, Vec<_>) = labels.objects.iter().partition(|o| boxed(o));
    for ring in outlined.into_iter().flat_map(|o| &o.outline_px) {
        let ring: Vec<_> = ring
            .iter()
            .map(|p| [p.x * scale_x, p.y * scale_y].into())
            .collect();
        draw::outline(canvas, &ring, UNLABELLED);
    }
    for object in boxed {
        let b = object.amodal_box;
        let b = BBox {
            x0: b.x0 * scale_x,
            y0: b.y0 * scale_y,
            x1: b.x1 * scale_x,
            y1: b.y1 * scale_y,
        };
        draw::border(canvas, &b, draw::class_color(object.class), 1);
    }
}

/// A name on the box's upper edge; below the edge where there is no room above it.
fn draw_tag(canvas: &mut Image<Srgb8>, object: &ObjectLabel, name: &str) {
    let size = TextSize::Small;
    let [w, h] = [size.width(name) + 6, size.height()];
    let (left, top) = (object.amodal_box.x0 as isize, object.amodal_box.y0 as isize);
    let x = left.min(canvas.width() as isize - w as isize).max(0);
    let y = if top >= h as isize {
        top - h as isize
    } else {
        top
    };
    let paper = draw::class_color(object.class);
    draw::fill(canvas, [x, y], [w, h], paper);
    draw::text(canvas, [x + 3, y], name, draw::ink_on(paper), size);
}
