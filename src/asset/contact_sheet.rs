//! A sheet of all cut-outs of a folder over four backgrounds, so that a person sees faults at once;
//! of captured ones what was measured, too.

use super::flow_sheet;
use super::library::{Library, Photo};
use super::manifest::{CaptureRecord, PhotoRecord};
use super::pixels::Pixels;
use super::texture::Texture;
use super::thumbnail::{checkerboard, fitted_size};
use crate::color::to_srgb8;
use crate::draw::{self, TextSize};
use crate::error::Result;
use crate::filter;
use crate::image::Image;
use crate::pixel::{Film, LinearRgb, Mix, Srgb8};
use rayon::prelude::*;

/// Longer side of a cut-out on the sheet, pixels.
const CUT_OUT_SIDE_PX: usize = 240;
/// Pixels between things.
const GAP_PX: usize = 8;
/// Photos beside each other.
const COLUMNS: usize = 2;
const PAPER: Srgb8 = draw::rgb(0x1C, 0x1E, 0x22);
const INK: Srgb8 = draw::rgb(0xF2, 0xF2, 0xF2);
const WARNING: Srgb8 = draw::rgb(0xFF, 0xB0, 0x40);
/// A screen's green, so that what is left of a green screen cannot be seen here and is seen on the
/// others.
const GREEN: LinearRgb = LinearRgb::new(0.05, 0.45, 0.08);

/// What lies behind a cut-out at a pixel.
type Background = fn(usize, usize) -> LinearRgb;

const BACKGROUNDS: [Background; 4] = [
    checkerboard,
    |_, _| LinearRgb::BLACK,
    |_, _| LinearRgb::WHITE,
    |_, _| GREEN,
];

/// Width of a cut-out over all backgrounds, pixels.
const STRIP_WIDTH_PX: usize = BACKGROUNDS.len() * (CUT_OUT_SIDE_PX + GAP_PX);

/// From a strip to the next one beside it, pixels.
const COLUMN_WIDTH_PX: usize = STRIP_WIDTH_PX + 2 * GAP_PX;

/// Every cut-out over a checkerboard, black, white and green, with its size, the confidence in
/// outline and colour, and why it needs a review.
///
/// # Errors
/// Those of [`Photo::pixels`].
pub fn contact_sheet(library: &Library) -> Result<Image<Srgb8>> {
    let photos = photos_of(library);
    let strips = photos.par_iter().map(|photo| strip(photo));
    Ok(in_columns(&strips.collect::<Result<Vec<_>>>()?))
}

fn photos_of(library: &Library) -> Vec<&Photo> {
    let assets = library.assets.iter();
    assets.flat_map(|asset| &asset.photos).collect()
}

/// Strips in rows from the top left, each row as high as its highest.
fn in_columns(strips: &[Image<Srgb8>]) -> Image<Srgb8> {
    let mut sheet = blank_sheet(strips);
    let mut top = GAP_PX;
    for row in strips.chunks(COLUMNS) {
        paste_row(&mut sheet, top, row);
        top += row_height(row);
    }
    sheet
}

fn paste_row(sheet: &mut Image<Srgb8>, top: usize, row: &[Image<Srgb8>]) {
    for (i, strip) in row.iter().enumerate() {
        draw::paste(sheet, [GAP_PX + i * COLUMN_WIDTH_PX, top], strip);
    }
}

/// Paper of the size that strips take.
fn blank_sheet(strips: &[Image<Srgb8>]) -> Image<Srgb8> {
    let columns = COLUMNS.min(strips.len().max(1));
    let height: usize = strips.chunks(COLUMNS).map(row_height).sum();
    Image::filled(columns * COLUMN_WIDTH_PX + GAP_PX, height + GAP_PX, PAPER)
}

fn row_height(strips: &[Image<Srgb8>]) -> usize {
    strips.iter().map(Image::height).max().unwrap_or(0) + GAP_PX
}

/// One cut-out over all backgrounds under lines of text.
fn strip(photo: &Photo) -> Result<Image<Srgb8>> {
    let pixels = photo.pixels_once()?;
    let cutout = small(&pixels.texture);
    let lines = lines_of(&photo.record);
    let text_height = lines.len() * TextSize::Small.height() + GAP_PX / 2;
    let rows = tile_rows(&photo.record, &pixels, &cutout);
    let row_height = cutout.height() + GAP_PX;
    let height = text_height + rows.len() * row_height - GAP_PX;
    let mut canvas = Image::filled(STRIP_WIDTH_PX, height, PAPER);
    write_lines(&mut canvas, &lines);
    for (j, row) in rows.iter().enumerate() {
        paste_tiles(&mut canvas, text_height + j * row_height, row);
    }
    Ok(canvas)
}

/// A cut-out over all backgrounds; below, what was measured on a display.
fn tile_rows(
    record: &PhotoRecord,
    pixels: &Pixels,
    cutout: &Image<Film>,
) -> Vec<Vec<Image<Srgb8>>> {
    let over = BACKGROUNDS
        .iter()
        .map(|background| over_background(cutout, *background));
    let measured = record.captured.is_some();
    let flow = pixels.flow.as_deref();
    let measured = measured.then(|| flow_sheet::tiles(flow, cutout));
    [over.collect()].into_iter().chain(measured).collect()
}

fn paste_tiles(canvas: &mut Image<Srgb8>, top: usize, tiles: &[Image<Srgb8>]) {
    for (i, tile) in tiles.iter().enumerate() {
        draw::paste(canvas, [i * (CUT_OUT_SIDE_PX + GAP_PX), top], tile);
    }
}

fn over_background(cutout: &Image<Film>, background: Background) -> Image<Srgb8> {
    to_srgb8(&Image::from_fn(cutout.width(), cutout.height(), |x, y| {
        cutout[(x, y)].over_color(background(x, y))
    }))
}

fn write_lines(canvas: &mut Image<Srgb8>, lines: &[(String, Srgb8)]) {
    for (i, (line, ink)) in lines.iter().enumerate() {
        let at = [0, (i * TextSize::Small.height()) as isize];
        draw::text(canvas, at, line, *ink, TextSize::Small);
    }
}

/// What is written over a cut-out: its size, and why it needs a review.
fn lines_of(record: &PhotoRecord) -> Vec<(String, Srgb8)> {
    let title = wrapped_in(INK, &title(record));
    let captured = record.captured.iter().map(CaptureRecord::summary);
    let captured = captured.flat_map(|summary| wrapped_in(INK, &summary));
    let messages = record.diagnostics.iter().map(|d| &d.message);
    let reasons = messages.flat_map(|message| wrapped_in(WARNING, message));
    title.into_iter().chain(captured).chain(reasons).collect()
}

/// The lines of a text in one colour.
fn wrapped_in(ink: Srgb8, text: &str) -> Vec<(String, Srgb8)> {
    let lines = draw::wrapped(text, STRIP_WIDTH_PX, TextSize::Small);
    lines.into_iter().map(|line| (line, ink)).collect()
}

fn title(record: &PhotoRecord) -> String {
    let [length, width] = record.object_m.map(|m| 1e3 * m);
    let color = record
        .color_confidence
        .map(|confidence| format!(", colour {confidence:.2}"))
        .unwrap_or_default();
    format!(
        "{}  {length:.1} x {width:.1} mm (+- {:.1})  outline confidence {:.2}{color}",
        record.file,
        1e3 * record.error_m,
        record.outline_confidence,
    )
}

fn small(cutout: &Texture) -> Image<Film> {
    match cutout {
        Texture::Rgba(pyramid) => fitted(pyramid.base()).map(Film::from),
        Texture::Film(pyramid) => fitted(pyramid.base()),
    }
}

fn fitted<P: Mix>(cutout: &Image<P>) -> Image<P> {
    let (width, height) = fitted_size(cutout.size(), CUT_OUT_SIDE_PX);
    filter::resize(cutout, width, height)
}

#[cfg(test)]
mod tests {
    use super::super::manifest::Asset;
    use super::super::manifest::tests::photo;
    use super::super::role::Role;
    use super::*;
    use crate::diagnostic::{Code, Diagnostic};
    use crate::pixel::PremulRgba;

    fn library(warnings: &[&str], count: usize) -> Library {
        let mut record = photo("a.exr");
        record.diagnostics = warnings
            .iter()
            .map(|text| Diagnostic::warning(Code::Uncoded, text))
            .collect();
        let one = Photo::new(Image::filled(480, 240, PremulRgba::TRANSPARENT), record);
        let asset = Asset {
            role: Role::Object,
            name: "a".into(),
            class: "cap".into(),
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
        let sheet = contact_sheet(&library(&[], 1)).unwrap();
        let y = sheet.height() - 3 * GAP_PX;
        let at = |i: usize| sheet[(GAP_PX + i * (CUT_OUT_SIDE_PX + GAP_PX) + 2, y)];
        assert_eq!(
            [at(1), at(2)],
            [draw::rgb(0, 0, 0), draw::rgb(255, 255, 255)]
        );
        assert!(at(3).g > 150 && at(3).r < 80 && at(0).r == at(0).g);
    }

    #[test]
    fn diagnostics_are_written_and_make_room() {
        let heights = [&[][..], &["two objects"], &["two objects", "blurred"]]
            .map(|d| contact_sheet(&library(d, 1)).unwrap().height());
        assert!(heights[0] < heights[1] && heights[1] < heights[2]);
        assert!(
            contact_sheet(&library(&[], 3)).unwrap().height() > heights[0]
                && contact_sheet(&library(&[], 0)).unwrap().height() > 0
        );
    }
}
