//! A sheet of all cut-outs of a folder over four backgrounds, so that a person sees faults at once.

use super::{Library, Photo, Texture};
use crate::color::to_srgb8;
use crate::draw::{self, TextSize};
use crate::filter;
use crate::image::Image;
use crate::pixel::{Film, LinearRgb, Mix, Srgb8};
use rayon::prelude::*;

/// Longer side of a cut-out on the sheet, pixels.
const SIDE: usize = 240;
/// Pixels between things.
const GAP: usize = 8;
/// Photos beside each other.
const COLUMNS: usize = 2;
const PAPER: Srgb8 = draw::rgb(0x1C, 0x1E, 0x22);
const INK: Srgb8 = draw::rgb(0xF2, 0xF2, 0xF2);
const WARNING: Srgb8 = draw::rgb(0xFF, 0xB0, 0x40);
/// Side of a square of the checkerboard, pixels, and its two greys, scene-linear.
const SQUARE: usize = 8;
const GREYS: [f32; 2] = [0.2, 0.45];
/// A screen's green, so that what is left of a green screen cannot be seen here and is seen on the others.
const GREEN: LinearRgb = LinearRgb::new(0.05, 0.45, 0.08);

/// What lies behind a cut-out at a pixel.
type Background = fn(usize, usize) -> LinearRgb;

const BACKGROUNDS: [Background; 4] = [
    |x, y| LinearRgb::grey(GREYS[(x / SQUARE + y / SQUARE) % GREYS.len()]),
    |_, _| LinearRgb::BLACK,
    |_, _| LinearRgb::WHITE,
    |_, _| GREEN,
];

/// Every cut-out over a checkerboard, black, white and green, with its size, how sure outline and colour are and why it is in doubt.
pub fn contact_sheet(library: &Library) -> Image<Srgb8> {
    let photos: Vec<&Photo> = library
        .assets
        .iter()
        .flat_map(|asset| &asset.photos)
        .collect();
    let strips: Vec<Image<Srgb8>> = photos.par_iter().map(|photo| strip(photo)).collect();
    let rows = strips.chunks(COLUMNS);
    let cell = [BACKGROUNDS.len() * (SIDE + GAP) + 2 * GAP, 0];
    let heights: Vec<usize> = rows
        .clone()
        .map(|row| row.iter().map(Image::height).max().unwrap_or(0) + GAP)
        .collect();
    let columns = COLUMNS.min(strips.len().max(1));
    let mut sheet = Image::filled(
        columns * cell[0] + GAP,
        heights.iter().sum::<usize>() + GAP,
        PAPER,
    );
    let mut top = GAP;
    for (row, height) in rows.zip(heights) {
        for (i, strip) in row.iter().enumerate() {
            draw::paste(&mut sheet, [GAP + i * cell[0], top], strip);
        }
        top += height;
    }
    sheet
}

/// One cut-out over all backgrounds under a line of text.
fn strip(photo: &Photo) -> Image<Srgb8> {
    let cutout = small(&photo.texture);
    let (w, h) = cutout.size();
    let record = &photo.record;
    let line_height = TextSize::Small.height();
    let width = BACKGROUNDS.len() * (SIDE + GAP);
    let [length, across] = record.object_m.map(|m| 1e3 * m);
    let title = format!(
        "{}  {length:.1} x {across:.1} mm (+- {:.1})  outline confidence {:.2}{}",
        record.file,
        1e3 * record.error_m,
        record.outline_confidence,
        record
            .color_confidence
            .map(|sure| format!(", colour {sure:.2}"))
            .unwrap_or_default()
    );
    let reasons = record.diagnostics.iter().map(|d| (&d.message, WARNING));
    let lines: Vec<(String, Srgb8)> = std::iter::once((&title, INK))
        .chain(reasons)
        .flat_map(|(text, ink)| {
            draw::wrapped(text, width, TextSize::Small)
                .into_iter()
                .map(move |line| (line, ink))
        })
        .collect();
    let text_height = lines.len() * line_height + GAP / 2;
    let mut canvas = Image::filled(width, text_height + h, PAPER);
    for (i, (line, ink)) in lines.iter().enumerate() {
        draw::text(
            &mut canvas,
            [0, (i * line_height) as isize],
            line,
            *ink,
            TextSize::Small,
        );
    }
    for (i, background) in BACKGROUNDS.iter().enumerate() {
        let over = Image::from_fn(w, h, |x, y| cutout[(x, y)].over_color(background(x, y)));
        draw::paste(
            &mut canvas,
            [i * (SIDE + GAP), text_height],
            &to_srgb8(&over),
        );
    }
    canvas
}

fn small(cutout: &Texture) -> Image<Film> {
    match cutout {
        Texture::Rgba(pyramid) => fitted(pyramid.base()).map(Film::from),
        Texture::Film(pyramid) => fitted(pyramid.base()),
    }
}

fn fitted<P: Mix>(cutout: &Image<P>) -> Image<P> {
    let (w, h) = cutout.size();
    let longest = w.max(h).max(SIDE);
    let side = |len: usize| (len * SIDE).div_ceil(longest).max(1);
    filter::resize(cutout, side(w), side(h))
}

#[cfg(test)]
mod tests {
    use super::super::manifest::tests::photo;
    use super::*;
    use crate::asset::Asset;
    use crate::diagnostic::{Code, Diagnostic};
    use crate::pixel::PremulRgba;
    use std::sync::Arc;

    fn library(warnings: &[&str], count: usize) -> Library {
        let mut record = photo("a.exr");
        record.diagnostics = warnings
            .iter()
            .map(|text| Diagnostic::warning(Code::Uncoded, text))
            .collect();
        let texture = Image::filled(480, 240, PremulRgba::TRANSPARENT).into();
        let one = Photo {
            size: [0.4, 0.2],
            texture,
            outline_uv: Arc::new([]),
            record,
        };
        let asset = Asset {
            name: "a".into(),
            class: 0,
            thickness: 0.01,
            mass: 0.02,
            photos: vec![one; count],
        };
        Library {
            classes: vec!["cap".into()],
            assets: vec![asset],
        }
    }

    #[test]
    fn an_empty_cut_out_shows_the_four_backgrounds() {
        let sheet = contact_sheet(&library(&[], 1));
        let y = sheet.height() - 3 * GAP;
        let at = |i: usize| sheet[(GAP + i * (SIDE + GAP) + 2, y)];
        assert_eq!(
            [at(1), at(2)],
            [draw::rgb(0, 0, 0), draw::rgb(255, 255, 255)]
        );
        assert!(at(3).g > 150 && at(3).r < 80 && at(0).r == at(0).g);
    }

    #[test]
    fn diagnostics_are_written_and_make_room() {
        let heights = [&[][..], &["two objects"], &["two objects", "blurred"]]
            .map(|d| contact_sheet(&library(d, 1)).height());
        assert!(heights[0] < heights[1] && heights[1] < heights[2]);
        assert!(
            contact_sheet(&library(&[], 3)).height() > heights[0]
                && contact_sheet(&library(&[], 0)).height() > 0
        );
    }
}
