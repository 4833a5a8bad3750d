//! Lines, boxes and text on display-encoded pictures.

use crate::geom::{BBox, Point2, sides};
use crate::image::Image;
use crate::pixel::Srgb8;
use noto_sans_mono_bitmap::{
    FontWeight, RasterHeight, RasterizedChar, get_raster, get_raster_width,
};
use std::ops::Range;

/// Class colours: Okabe and Ito, "Color Universal Design" (2008), distinguishable with every kind
/// of colour vision; ordered so that the first ones stand out most in photos.
const CLASS_PALETTE: [Srgb8; 7] = [
    rgb(0xE6, 0x9F, 0x00),
    rgb(0x56, 0xB4, 0xE9),
    rgb(0x00, 0x9E, 0x73),
    rgb(0xF0, 0xE4, 0x42),
    rgb(0xD5, 0x5E, 0x00),
    rgb(0xCC, 0x79, 0xA7),
    rgb(0x00, 0x72, 0xB2),
];

/// Drawn around lines so that they show on a background of their own colour.
const HALO: Srgb8 = rgb(0, 0, 0);

/// Opacity of the halo.
const HALO_ALPHA: f32 = 0.45;

/// A colour from its 8-bit values.
pub(crate) const fn rgb(r: u8, g: u8, b: u8) -> Srgb8 {
    Srgb8 { r, g, b }
}

/// The colour of a class; the palette repeats after its last colour.
pub(crate) fn class_color(class: u32) -> Srgb8 {
    CLASS_PALETTE[class as usize % CLASS_PALETTE.len()]
}

/// Black or white, whichever is easier to read on a colour.
pub(crate) fn ink_on(paper: Srgb8) -> Srgb8 {
    if luma(paper) > 140_000 {
        rgb(0, 0, 0)
    } else {
        rgb(255, 255, 255)
    }
}

/// Luma of Rec. 601 on the encoded values, times 1000: close to how light a colour looks.
fn luma(color: Srgb8) -> u32 {
    299 * u32::from(color.r) + 587 * u32::from(color.g) + 114 * u32::from(color.b)
}

/// Blends a colour into a pixel; ignored outside the canvas.
fn blend(canvas: &mut Image<Srgb8>, x: isize, y: isize, color: Srgb8, alpha: f32) {
    let (w, h) = canvas.size();
    let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else {
        return;
    };
    if x >= w || y >= h {
        return;
    }
    let under = canvas[(x, y)];
    canvas[(x, y)] = mixed_color(under, color, alpha);
}

#[inline]
fn mixed_color(under: Srgb8, over: Srgb8, alpha: f32) -> Srgb8 {
    rgb(
        mixed(under.r, over.r, alpha),
        mixed(under.g, over.g, alpha),
        mixed(under.b, over.b, alpha),
    )
}

#[inline]
fn mixed(under: u8, over: u8, alpha: f32) -> u8 {
    (f32::from(under) + alpha * (f32::from(over) - f32::from(under)) + 0.5) as u8
}

/// A filled rectangle, clipped to the canvas.
pub(crate) fn fill(
    canvas: &mut Image<Srgb8>,
    [x, y]: [isize; 2],
    [w, h]: [usize; 2],
    color: Srgb8,
) {
    for row in y..y + h as isize {
        for column in x..x + w as isize {
            blend(canvas, column, row, color, 1.0);
        }
    }
}

/// A picture pasted onto the canvas, clipped to it.
pub(crate) fn paste(canvas: &mut Image<Srgb8>, [x, y]: [usize; 2], picture: &Image<Srgb8>) {
    let (width, height) = canvas.size();
    let columns = picture.width().min(width.saturating_sub(x));
    for (row, pixels) in picture.rows().enumerate().take(height.saturating_sub(y)) {
        canvas.row_mut(y + row)[x..x + columns].copy_from_slice(&pixels[..columns]);
    }
}

/// The border of a box, `thick` whole pixels wide and inside the canvas, with a halo one pixel wide
/// on either side.
pub(crate) fn border(canvas: &mut Image<Srgb8>, b: &BBox, color: Srgb8, thick: isize) {
    let (w, h) = canvas.size();
    let [x0, x1] = [b.x0, b.x1].map(|x| nearest_edge(x, w));
    let [y0, y1] = [b.y0, b.y1].map(|y| nearest_edge(y, h));
    for y in y0 - 1..=y1 {
        for x in x0 - 1..=x1 {
            // Pixels from the border's outer edge, inwards; -1 is the halo outside.
            match (x - x0).min(x1 - 1 - x).min(y - y0).min(y1 - 1 - y) {
                depth if depth == -1 || depth == thick => blend(canvas, x, y, HALO, HALO_ALPHA),
                depth if depth < thick => blend(canvas, x, y, color, 1.0),
                _ => {}
            }
        }
    }
}

/// The nearest pixel edge along a side.
fn nearest_edge(at: f64, length: usize) -> isize {
    libm::round(at.clamp(0.0, length as f64)) as isize
}

fn pixel_within(at: f64, length: usize) -> isize {
    at.clamp(0.0, length as f64) as isize
}

/// A closed antialiased line through points, one pixel wide, with a halo.
pub(crate) fn outline(canvas: &mut Image<Srgb8>, ring: &[Point2<f64>], color: Srgb8) {
    for (radius, color, alpha) in [(1.5, HALO, HALO_ALPHA), (0.5, color, 1.0)] {
        for [a, b] in sides(ring) {
            for (x, y, coverage) in Segment::new(a, b, radius).pixels(canvas.size()) {
                blend(canvas, x, y, color, alpha * coverage);
            }
        }
    }
}

/// A line of half width `radius`.
struct Segment {
    from: Point2<f64>,
    to: Point2<f64>,
    radius: f64,
}

impl Segment {
    fn new(from: Point2<f64>, to: Point2<f64>, radius: f64) -> Self {
        Self { from, to, radius }
    }

    /// The pixels of a canvas that it touches, row by row, and its coverage of each.
    fn pixels(&self, (w, h): (usize, usize)) -> impl Iterator<Item = (isize, isize, f32)> {
        let columns = self.pixel_range(self.from.x, self.to.x, w);
        self.pixel_range(self.from.y, self.to.y, h)
            .flat_map(move |y| columns.clone().map(move |x| (x, y)))
            .map(|(x, y)| (x, y, self.coverage(x, y)))
            .filter(|(.., coverage)| *coverage > 0.0)
    }

    /// Columns or rows that it may touch.
    fn pixel_range(&self, a: f64, b: f64, length: usize) -> Range<isize> {
        let reach = self.radius + 1.0;
        pixel_within(a.min(b) - reach, length)..pixel_within(a.max(b) + reach + 1.0, length)
    }

    /// A ramp over one pixel by the distance of its centre from the line.
    fn coverage(&self, x: isize, y: isize) -> f32 {
        let p = Point2::new(x as f64 + 0.5, y as f64 + 0.5);
        let along = self.to - self.from;
        let share = (p - self.from).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE);
        let nearest = self.from + along * share.clamp(0.0, 1.0);
        (self.radius + 0.5 - (p - nearest).norm()).clamp(0.0, 1.0) as f32
    }
}

/// Height of a line of text, pixels.
pub(crate) const LINE_PX: usize = 16;
const RASTER_HEIGHT: RasterHeight = RasterHeight::Size16;

/// Width of a text, pixels.
pub(crate) fn text_width(text: &str) -> usize {
    text.chars().count() * get_raster_width(FontWeight::Regular, RASTER_HEIGHT)
}

/// A letter of the font, which covers European languages in Latin script.
fn glyph(letter: char) -> Option<RasterizedChar> {
    get_raster(letter, FontWeight::Regular, RASTER_HEIGHT)
}

/// The lines of a text wrapped to `width` pixels, broken between words, and within words that are
/// longer.
pub(crate) fn wrapped(text: &str, width: usize) -> Vec<String> {
    let room = (width / text_width("m").max(1)).max(1);
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let letters: Vec<char> = word.chars().collect();
        for (i, part) in letters.chunks(room).enumerate() {
            let last = lines.last_mut().filter(|_| i == 0);
            if !last.is_some_and(|line| append_word(line, part, room)) {
                lines.push(part.iter().collect());
            }
        }
    }
    lines
}

/// Appends a word to a line; `false` where it does not fit.
fn append_word(line: &mut String, word: &[char], room: usize) -> bool {
    let used = line.chars().count();
    if used + usize::from(used > 0) + word.len() > room {
        return false;
    }
    if used > 0 {
        line.push(' ');
    }
    line.extend(word);
    true
}

/// A line of text with its top left corner at a point; letters that are not Latin become `?`.
pub(crate) fn text(canvas: &mut Image<Srgb8>, [x, y]: [isize; 2], line: &str, color: Srgb8) {
    let advance = text_width("m") as isize;
    for (i, letter) in line.chars().enumerate() {
        let glyph = glyph(letter).or_else(|| glyph('?'));
        let left = x + i as isize * advance;
        for (v, row) in glyph.iter().flat_map(|glyph| glyph.rows().enumerate()) {
            for (u, &ink) in row.iter().enumerate().filter(|&(_, &ink)| ink > 0) {
                let at = (left + u as isize, y + v as isize);
                blend(canvas, at.0, at.1, color, f32::from(ink) / 255.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: Srgb8 = rgb(255, 255, 255);

    #[test]
    fn a_border_covers_its_outermost_pixels_and_nothing_inside() {
        let mut canvas = Image::new(12, 10);
        border(
            &mut canvas,
            &BBox {
                x0: 2.0,
                y0: 3.0,
                x1: 9.0,
                y1: 8.0,
            },
            rgb(255, 0, 0),
            1,
        );
        let red: Vec<_> = (0..120)
            .filter(|i| canvas.pixels()[*i].r == 255)
            .map(|i| (i % 12, i / 12))
            .collect();
        assert_eq!(red.len(), 2 * 7 + 2 * 3);
        assert!(
            red.iter()
                .all(|&(x, y)| x == 2 || x == 8 || y == 3 || y == 7)
        );
    }

    #[test]
    fn drawing_outside_the_canvas_draws_nothing() {
        let mut canvas = Image::new(8, 8);
        border(
            &mut canvas,
            &BBox {
                x0: -50.0,
                y0: -50.0,
                x1: 90.0,
                y1: 90.0,
            },
            rgb(9, 9, 9),
            1,
        );
        outline(
            &mut canvas,
            &[Point2::new(-1e9, -1e9), Point2::new(1e9, -1e9)],
            WHITE,
        );
        text(&mut canvas, [-40, 100], "out of sight", WHITE);
        paste(&mut canvas, [20, 20], &Image::filled(4, 4, WHITE));
        assert!(canvas.pixels().iter().all(|p| p.r < 10));
    }

    #[test]
    fn a_line_of_one_pixel_carries_one_pixel_of_ink_per_pixel_of_length() {
        let (a, b) = (Point2::new(5.3, 8.1), Point2::new(33.2, 29.0));
        let ink: f64 = Segment::new(a, b, 0.5)
            .pixels((40, 40))
            .map(|(.., coverage)| f64::from(coverage))
            .sum();
        // A ramp from full to zero over one pixel on either side integrates to a width of 1; the
        // two round ends add about one more.
        let length = (b - a).norm();
        assert!(ink > length && ink < length + 2.0, "{ink} {length}");
    }

    #[test]
    fn text_stays_within_its_width() {
        let width = text_width("0123456789");
        let lines = |text| wrapped(text, width);
        assert_eq!(lines("two words or more"), ["two words", "or more"]);
        assert_eq!(lines("a 0123456789abc z"), ["a", "0123456789", "abc z"]);
        assert_eq!(
            (lines(""), wrapped("ab", 0)),
            (vec![String::new()], vec!["a".into(), "b".into()])
        );
        assert!(
            lines("none is longer than there is room for")
                .iter()
                .all(|l| text_width(l) <= width)
        );
    }

    #[test]
    fn letters_beyond_ascii_take_a_place() {
        let mut canvas = Image::new(60, 20);
        text(&mut canvas, [0, 0], "öß", WHITE);
        assert!(canvas.pixels().iter().any(|p| p.r > 128));
        assert_eq!(text_width("öß"), text_width("ab"));
    }
}
