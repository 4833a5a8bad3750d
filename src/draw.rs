//! Lines, boxes and text on display-encoded pictures.

use crate::geom::BBox;
use crate::geom::Point2;
use crate::image::Image;
use crate::pixel::Srgb8;
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

/// Colours of classes: Okabe and Ito, "Color Universal Design" (2008), told apart with every kind of colour vision; in an
/// order in which the first ones stand out most on photos.
const PALETTE: [Srgb8; 7] = [
    rgb(0xE6, 0x9F, 0x00),
    rgb(0x56, 0xB4, 0xE9),
    rgb(0x00, 0x9E, 0x73),
    rgb(0xF0, 0xE4, 0x42),
    rgb(0xD5, 0x5E, 0x00),
    rgb(0xCC, 0x79, 0xA7),
    rgb(0x00, 0x72, 0xB2),
];

/// What is drawn around lines, so that they show on a background of their own colour.
const HALO: Srgb8 = rgb(0, 0, 0);

/// Share of the halo over the picture.
const HALO_ALPHA: f32 = 0.45;

/// A colour from its codes.
pub(crate) const fn rgb(r: u8, g: u8, b: u8) -> Srgb8 {
    Srgb8 { r, g, b }
}

/// The colour of a class; the palette starts over after its last.
pub(crate) fn class_color(class: u32) -> Srgb8 {
    PALETTE[class as usize % PALETTE.len()]
}

/// Black or white, whichever is easier to read on a colour.
pub(crate) fn ink_on(paper: Srgb8) -> Srgb8 {
    // Luma of Rec. 601 on the codes: close to how light a colour looks.
    let luma = 299 * u32::from(paper.r) + 587 * u32::from(paper.g) + 114 * u32::from(paper.b);
    if luma > 140_000 {
        rgb(0, 0, 0)
    } else {
        rgb(255, 255, 255)
    }
}

/// Mixes a colour into a pixel, where there is one.
fn blend(canvas: &mut Image<Srgb8>, x: isize, y: isize, color: Srgb8, alpha: f32) {
    let (w, h) = canvas.size();
    let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else {
        return;
    };
    if x >= w || y >= h {
        return;
    }
    let under = canvas[(x, y)];
    let mix = |a: u8, b: u8| (f32::from(a) + alpha * (f32::from(b) - f32::from(a)) + 0.5) as u8;
    canvas[(x, y)] = rgb(
        mix(under.r, color.r),
        mix(under.g, color.g),
        mix(under.b, color.b),
    );
}

/// A filled rectangle; what lies outside the canvas is left out.
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

/// A picture laid onto the canvas; what lies outside is left out.
pub(crate) fn paste(canvas: &mut Image<Srgb8>, [x, y]: [usize; 2], picture: &Image<Srgb8>) {
    let (width, height) = canvas.size();
    let columns = picture.width().min(width.saturating_sub(x));
    for (row, pixels) in picture.rows().enumerate().take(height.saturating_sub(y)) {
        canvas.row_mut(y + row)[x..x + columns].copy_from_slice(&pixels[..columns]);
    }
}

/// The border of a box, `thick` whole pixels wide and inside the canvas, with a halo of one pixel on either side.
pub(crate) fn border(canvas: &mut Image<Srgb8>, b: &BBox, color: Srgb8, thick: isize) {
    let limit = [canvas.width() as f64, canvas.height() as f64];
    let whole = |v: f64, most: f64| libm::round(v.clamp(0.0, most)) as isize;
    let (x0, y0) = (whole(b.x0, limit[0]), whole(b.y0, limit[1]));
    let (x1, y1) = (whole(b.x1, limit[0]), whole(b.y1, limit[1]));
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

/// A closed line of one pixel's width through points, smooth, with a halo.
pub(crate) fn outline(canvas: &mut Image<Srgb8>, ring: &[Point2<f64>], color: Srgb8) {
    for (radius, color, alpha) in [(1.5, HALO, HALO_ALPHA), (0.5, color, 1.0)] {
        for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
            segment(canvas, *a, *b, radius, |canvas, x, y, cover| {
                blend(canvas, x, y, color, alpha * cover)
            });
        }
    }
}

/// Calls `dot` with the coverage of each pixel near a line of half width `radius`.
fn segment(
    canvas: &mut Image<Srgb8>,
    a: Point2<f64>,
    b: Point2<f64>,
    radius: f64,
    mut dot: impl FnMut(&mut Image<Srgb8>, isize, isize, f32),
) {
    let reach = radius + 1.0;
    let clamp = |v: f64, most: usize| v.clamp(0.0, most as f64) as isize;
    let (w, h) = canvas.size();
    let along = b - a;
    for y in clamp(a.y.min(b.y) - reach, h)..clamp(a.y.max(b.y) + reach + 1.0, h) {
        for x in clamp(a.x.min(b.x) - reach, w)..clamp(a.x.max(b.x) + reach + 1.0, w) {
            let p = Point2::new(x as f64 + 0.5, y as f64 + 0.5);
            let t =
                ((p - a).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            let cover = (radius + 0.5 - (p - (a + along * t)).norm()).clamp(0.0, 1.0);
            if cover > 0.0 {
                dot(canvas, x, y, cover as f32);
            }
        }
    }
}

/// Height of text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TextSize {
    /// Lines of 16 pixels.
    Small,
    /// Lines of 24 pixels.
    Large,
}

impl TextSize {
    fn raster(self) -> RasterHeight {
        match self {
            Self::Small => RasterHeight::Size16,
            Self::Large => RasterHeight::Size24,
        }
    }

    /// Height of a line, pixels.
    pub(crate) fn height(self) -> usize {
        self.raster().val()
    }

    /// Width of a text, pixels.
    pub(crate) fn width(self, text: &str) -> usize {
        text.chars().count() * get_raster_width(FontWeight::Regular, self.raster())
    }
}

/// The lines of a text that has room for `width` pixels, broken between words, and within those that are longer.
pub(crate) fn wrapped(text: &str, width: usize, size: TextSize) -> Vec<String> {
    let room = (width / size.width("m").max(1)).max(1);
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let letters: Vec<char> = word.chars().collect();
        for (i, part) in letters.chunks(room).enumerate() {
            let last = lines.last_mut().filter(|line| {
                let used = line.chars().count();
                i == 0 && used + usize::from(used > 0) + part.len() <= room
            });
            match last {
                Some(line) if line.is_empty() => line.extend(part),
                Some(line) => {
                    line.push(' ');
                    line.extend(part);
                }
                None => lines.push(part.iter().collect()),
            }
        }
    }
    lines
}

/// A line of text with its top left corner at a point; characters beyond ASCII become `?`.
pub(crate) fn text(
    canvas: &mut Image<Srgb8>,
    [x, y]: [isize; 2],
    line: &str,
    color: Srgb8,
    size: TextSize,
) {
    let advance = get_raster_width(FontWeight::Regular, size.raster()) as isize;
    for (i, letter) in line.chars().enumerate() {
        let glyph = |c| get_raster(c, FontWeight::Regular, size.raster());
        let Some(glyph) = glyph(letter).or_else(|| glyph('?')) else {
            continue;
        };
        for (v, row) in glyph.rows().enumerate() {
            for (u, &ink) in row.iter().enumerate().filter(|&(_, &ink)| ink > 0) {
                let at = [x + i as isize * advance + u as isize, y + v as isize];
                blend(canvas, at[0], at[1], color, f32::from(ink) / 255.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn black(w: usize, h: usize) -> Image<Srgb8> {
        Image::new(w, h)
    }

    #[test]
    fn a_border_covers_its_outermost_pixels_and_nothing_inside() {
        let mut canvas = black(12, 10);
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
        let mut canvas = black(8, 8);
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
            rgb(255, 255, 255),
        );
        text(
            &mut canvas,
            [-40, 100],
            "out of sight",
            rgb(255, 255, 255),
            TextSize::Large,
        );
        paste(
            &mut canvas,
            [20, 20],
            &Image::filled(4, 4, rgb(255, 255, 255)),
        );
        assert!(canvas.pixels().iter().all(|p| p.r < 10));
    }

    #[test]
    fn a_line_of_one_pixel_carries_one_pixel_of_ink_per_pixel_of_length() {
        let mut canvas = Image::filled(40, 40, rgb(0, 0, 0));
        let (a, b) = (Point2::new(5.3, 8.1), Point2::new(33.2, 29.0));
        let mut ink = 0.0;
        segment(&mut canvas, a, b, 0.5, |_, _, _, cover| {
            ink += f64::from(cover)
        });
        // A ramp from full to nothing over one pixel on either side integrates to a width of 1; the two round ends add
        // about one more.
        let length = (b - a).norm();
        assert!(ink > length && ink < length + 2.0, "{ink} {length}");
    }

    #[test]
    fn text_stays_within_its_width() {
        let width = TextSize::Small.width("0123456789");
        let lines = |text| wrapped(text, width, TextSize::Small);
        assert_eq!(lines("two words or more"), ["two words", "or more"]);
        assert_eq!(lines("a 0123456789abc z"), ["a", "0123456789", "abc z"]);
        assert_eq!(
            (lines(""), wrapped("ab", 0, TextSize::Large)),
            (vec![String::new()], vec!["a".into(), "b".into()])
        );
        assert!(
            lines("none is longer than there is room for")
                .iter()
                .all(|l| TextSize::Small.width(l) <= width)
        );
    }

    #[test]
    fn letters_beyond_ascii_take_a_place() {
        let mut canvas = black(60, 20);
        text(
            &mut canvas,
            [0, 0],
            "öß",
            rgb(255, 255, 255),
            TextSize::Small,
        );
        assert!(canvas.pixels().iter().any(|p| p.r > 128));
        assert_eq!(TextSize::Small.width("öß"), TextSize::Small.width("ab"));
    }
}
