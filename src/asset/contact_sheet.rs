//! Sheets of all cut-outs of a folder over four backgrounds, so that a person sees faults at once;
//! for captured ones also what was measured.

use super::flow_sheet;
use super::library::{Library, Photo};
use super::manifest::{CaptureRecord, PhotoRecord};
use super::pixels::Pixels;
use super::texture::Texture;
use super::thumbnail::{checkerboard, fitted_size};
use crate::color::to_srgb8;
use crate::draw;
use crate::error::{Error, Result};
use crate::filter;
use crate::image::Image;
use crate::pixel::{Film, LinearRgb, Mix, Srgb8};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Longer side of a cut-out on the sheet, pixels.
const CUT_OUT_SIDE_PX: usize = 240;
/// Pixels between things.
const GAP_PX: usize = 8;
/// Photos beside each other.
const COLUMNS: usize = 2;
/// Height that a page has at most, pixels: half of the side of pictures that programs still open.
const MAX_PAGE_PX: usize = 16_384;
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
/// outline and colour, and why it needs a review: one page at least, of at most 16,384 pixels
/// height. A page is drawn on demand, so that memory does not grow with their number.
///
/// # Errors
/// Those of [`Photo::pixels`], for a page that shows it.
pub fn contact_sheets(library: &Library) -> impl ExactSizeIterator<Item = Result<Image<Srgb8>>> {
    let pages = in_pages(&photos_of(library)).into_iter();
    pages.map(|photos| page(&photos))
}

/// Path of a page of a contact sheet, counted from 0; the first has the given path.
pub fn contact_sheet_page(first: &Path, page: usize) -> PathBuf {
    if page == 0 {
        return first.into();
    }
    let mut name = first.file_stem().unwrap_or_default().to_owned();
    name.push(format!("_{}", page + 1));
    if let Some(extension) = first.extension() {
        name.push(".");
        name.push(extension);
    }
    first.with_file_name(name)
}

/// Deletes the pages of a contact sheet from one on, counted from 0.
///
/// # Errors
/// [`Error::File`] for a page that cannot be deleted.
pub fn remove_contact_sheet(first: &Path, from: usize) -> Result<()> {
    let pages = (from..).map(|page| contact_sheet_page(first, page));
    let mut left = pages.take_while(|page| page.exists());
    left.try_for_each(|page| std::fs::remove_file(&page).map_err(|e| Error::file(page, e)))
}

fn photos_of(library: &Library) -> Vec<&Photo> {
    let assets = library.assets.iter();
    assets.flat_map(|asset| &asset.photos).collect()
}

/// As many rows on a page as surely fit, and at least one.
fn in_pages<'a>(photos: &[&'a Photo]) -> Vec<Vec<&'a Photo>> {
    let (mut pages, mut page, mut height) = (Vec::new(), Vec::new(), GAP_PX);
    for row in photos.chunks(COLUMNS) {
        let strips = row.iter().map(|photo| most_height(&photo.record));
        let row_height = strips.max().unwrap_or(0) + GAP_PX;
        if height + row_height > MAX_PAGE_PX && !page.is_empty() {
            pages.push(std::mem::take(&mut page));
            height = GAP_PX;
        }
        page.extend_from_slice(row);
        height += row_height;
    }
    pages.push(page);
    pages
}

fn page(photos: &[&Photo]) -> Result<Image<Srgb8>> {
    let strips = photos.par_iter().map(|photo| strip(photo));
    Ok(in_columns(&strips.collect::<Result<Vec<_>>>()?))
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
    let rows = tile_rows(&photo.record, &pixels, &cutout);
    let height = strip_height(lines.len(), rows.len(), cutout.height());
    let mut canvas = Image::filled(STRIP_WIDTH_PX, height, PAPER);
    write_lines(&mut canvas, &lines);
    for (j, row) in rows.iter().enumerate() {
        let top = text_height(lines.len()) + j * (cutout.height() + GAP_PX);
        paste_tiles(&mut canvas, top, row);
    }
    Ok(canvas)
}

/// Height of lines of text over rows of tiles, pixels.
fn strip_height(lines: usize, rows: usize, tile_height: usize) -> usize {
    text_height(lines) + rows * (tile_height + GAP_PX) - GAP_PX
}

fn text_height(lines: usize) -> usize {
    lines * draw::LINE_PX + GAP_PX / 2
}

/// Height of the strip of a record whose cut-out is as high as any, pixels.
fn most_height(record: &PhotoRecord) -> usize {
    let rows = 1 + usize::from(record.captured.is_some());
    strip_height(lines_of(record).len(), rows, CUT_OUT_SIDE_PX)
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
        let at = [0, (i * draw::LINE_PX) as isize];
        draw::text(canvas, at, line, *ink);
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
    let lines = draw::wrapped(text, STRIP_WIDTH_PX);
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
        library_of((480, 240), warnings, count)
    }

    fn library_of((w, h): (usize, usize), warnings: &[&str], count: usize) -> Library {
        let mut record = photo("a.exr");
        record.diagnostics = warnings
            .iter()
            .map(|text| Diagnostic::warning(Code::Uncoded, text))
            .collect();
        let one = Photo::new(Image::filled(w, h, PremulRgba::TRANSPARENT), record);
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

    fn pages(library: &Library) -> Vec<Image<Srgb8>> {
        contact_sheets(library).map(Result::unwrap).collect()
    }

    /// Height of the only page.
    fn height(warnings: &[&str], count: usize) -> usize {
        let pages = pages(&library(warnings, count));
        assert_eq!(pages.len(), 1);
        pages[0].height()
    }

    #[test]
    fn an_empty_cut_out_shows_the_four_backgrounds() {
        let sheet = &pages(&library(&[], 1))[0];
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
            .map(|warnings| height(warnings, 1));
        assert!(heights[0] < heights[1] && heights[1] < heights[2]);
        assert!(height(&[], 3) > heights[0] && height(&[], 0) > 0);
    }

    #[test]
    fn pages_are_no_higher_than_programs_open_and_hold_every_cut_out() {
        let warning = "two objects ".repeat(40);
        let tall = |count| library_of((4, CUT_OUT_SIDE_PX), &[warning.as_str()], count);
        let row_height = pages(&tall(1))[0].height() - GAP_PX;
        let pages = pages(&tall(301));
        let heights: Vec<usize> = pages.iter().map(Image::height).collect();
        assert!(heights.len() > 2, "{heights:?}");
        assert!(
            heights.iter().all(|height| *height <= MAX_PAGE_PX),
            "{heights:?}"
        );
        let rows = heights.iter().map(|height| (height - GAP_PX) / row_height);
        assert_eq!(rows.sum::<usize>(), 151);
    }

    #[test]
    fn further_pages_lie_beside_the_first() {
        let page = |first: &str, page| contact_sheet_page(Path::new(first), page);
        assert_eq!(page("a/sheet.png", 0), Path::new("a/sheet.png"));
        assert_eq!(page("a/sheet.v1.png", 1), Path::new("a/sheet.v1_2.png"));
    }
}
