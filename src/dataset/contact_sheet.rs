//! A sheet of small pictures with their labels: the first look at a dataset.

use crate::color::to_srgb8;
use crate::dataset::folder;
use crate::dataset::journal::lines_of;
use crate::dataset::journal_line::JournalLine;
use crate::dataset::{Labelling, SampleRecord};
use crate::draw;
use crate::error::Result;
use crate::filter::resize;
use crate::image::Image;
use crate::io;
use crate::label::overlay::{UNLABELLED, draw_labels};
use crate::label::{Labels, ObjectLabel};
use crate::pixel::{LinearRgb, ObjectId, Srgb8};
use rayon::prelude::*;
use std::borrow::Cow;
use std::path::Path;

const PAPER: Srgb8 = draw::rgb(0x1C, 0x1E, 0x22);
const INK: Srgb8 = draw::rgb(0xF2, 0xF2, 0xF2);
const PALE_INK: Srgb8 = draw::rgb(0xA8, 0xAD, 0xB5);

/// Margin of the sheet, pixels.
const MARGIN_PX: usize = 28;

/// Pixels between pictures.
const GAP_PX: usize = 16;

/// Pixels between a picture and its caption.
const CAPTION_GAP_PX: usize = 4;

/// Maximum width of a picture, pixels; larger ones are reduced.
const PICTURE_WIDTH_PX: usize = 320;

/// A picture of a sheet.
struct ContactTile {
    picture: Image<LinearRgb>,
    /// Its labels, in pixels of the size that they name.
    labels: Labels,
    /// Objects that are drawn with a box; the others get a thin grey outline.
    labelled: Vec<ObjectId>,
    /// A line below the picture.
    caption: String,
}

impl ContactTile {
    /// Width of the wider of picture and caption.
    fn width(&self) -> usize {
        let caption = draw::text_width(&self.caption);
        self.picture.width().max(caption)
    }

    fn drawn(&self) -> Image<Srgb8> {
        let mut canvas = to_srgb8(&self.picture);
        draw_labels(&mut canvas, &self.labels, |object| {
            self.labelled.contains(&object.id)
        });
        canvas
    }
}

/// The picture, reduced to at most `width`.
pub(super) fn shrunk(
    picture: Cow<'_, Image<LinearRgb>>,
    width: usize,
) -> Cow<'_, Image<LinearRgb>> {
    let (w, h) = picture.size();
    let width = width.clamp(1, w.max(1));
    if width >= w {
        return picture;
    }
    let height = (h * width).div_ceil(w.max(1)).max(1);
    Cow::Owned(resize(&picture, width, height))
}

/// Lays out pictures in rows, each with its boxes and a caption, under a legend of the classes.
fn contact_sheet(tiles: &[ContactTile], classes: &[String]) -> Image<Srgb8> {
    let layout = SheetLayout::new(tiles, classes);
    let mut sheet = Image::filled(layout.width, layout.height, PAPER);
    draw_legend(&mut sheet, &layout.legend);
    for (i, tile) in tiles.iter().enumerate() {
        layout.draw_tile(&mut sheet, i, tile);
    }
    sheet
}

/// The contact sheet of a dataset on disk: at most `most` of its pictures, evenly spread.
///
/// # Errors
/// If the folder is no dataset or one of archives only, or was written without the
/// [`Pictures`](crate::dataset::Pictures) or the [`Sidecar`](crate::dataset::Sidecar) that the
/// sheet is made from.
pub fn contact_sheet_of(folder: &Path, most: usize) -> Result<Image<Srgb8>> {
    let identity = folder::identity_of_files(folder)?;
    let classes = folder::known_classes(&identity);
    let labelling = Labelling::of_identity(&identity);
    let lines = lines_of(folder)?;
    let shown = most.min(lines.len());
    let tiles: Vec<ContactTile> = (0..shown)
        .into_par_iter()
        .map(|i| read_tile(folder, &lines[i * lines.len() / shown], labelling))
        .collect::<Result<_>>()?;
    Ok(contact_sheet(&tiles, &classes))
}

fn read_tile(folder: &Path, line: &JournalLine, labelling: Labelling) -> Result<ContactTile> {
    let picture = io::read::<LinearRgb>(line.file(folder, "images/")?)?;
    let record: SampleRecord = io::read_json(line.file(folder, "scenes/")?)?;
    let record = record.into_labelled(labelling);
    Ok(ContactTile {
        picture: shrunk(Cow::Owned(picture), PICTURE_WIDTH_PX).into_owned(),
        caption: tile_caption(line, &record),
        labels: record.labels,
        labelled: record.labelled,
    })
}

fn tile_caption(line: &JournalLine, record: &SampleRecord) -> String {
    let (k, part) = (line.k, line.part.name());
    let (labelled, all) = (record.labelled.len(), record.labels.objects.len());
    format!("{k:06} {part:5} {labelled}/{all} labelled")
}

/// Layout of a sheet, pixels.
struct SheetLayout {
    width: usize,
    height: usize,
    columns: usize,
    /// Size of a picture with its caption.
    cell: [usize; 2],
    /// Top of the first row.
    top: usize,
    legend: Vec<LegendEntry>,
}

impl SheetLayout {
    fn new(tiles: &[ContactTile], classes: &[String]) -> Self {
        let cell = cell_size(tiles);
        let columns = pleasing_columns(tiles.len(), cell);
        let row = (columns * (cell[0] + GAP_PX)).saturating_sub(GAP_PX);
        let legend = legend_entries(classes, tiles, row);
        let [legend_width, legend_height] = legend_size(&legend);
        let top = MARGIN_PX + legend_height + GAP_PX;
        let rows = tiles.len().div_ceil(columns);
        Self {
            width: row.max(legend_width) + 2 * MARGIN_PX,
            height: top + rows * (cell[1] + GAP_PX) + MARGIN_PX - GAP_PX,
            columns,
            cell,
            top,
            legend,
        }
    }

    /// Draws a picture with its boxes and its caption.
    fn draw_tile(&self, sheet: &mut Image<Srgb8>, i: usize, tile: &ContactTile) {
        let [x, y] = self.place(i);
        draw::paste(sheet, [x, y], &tile.drawn());
        let below = y + self.cell[1] - draw::LINE_PX;
        let at = [x as isize, below as isize];
        draw::text(sheet, at, &tile.caption, PALE_INK);
    }

    /// Top left corner of a picture.
    fn place(&self, i: usize) -> [usize; 2] {
        let [column, row] = [i % self.columns, i / self.columns];
        let [across, down] = self.cell.map(|side| side + GAP_PX);
        [MARGIN_PX + column * across, self.top + row * down]
    }
}

/// Size of the largest picture with its caption.
fn cell_size(tiles: &[ContactTile]) -> [usize; 2] {
    let widths = tiles.iter().map(ContactTile::width);
    let heights = tiles.iter().map(|tile| tile.picture.height());
    [
        widths.max().unwrap_or(0),
        heights.max().unwrap_or(0) + CAPTION_GAP_PX + draw::LINE_PX,
    ]
}

/// The number of columns with which a sheet comes closest to 3:2, the shape of screens; an empty
/// cell at its end counts as much as an excess width of two pictures.
fn pleasing_columns(count: usize, cell: [usize; 2]) -> usize {
    (1..=count.max(1))
        .min_by_key(|&columns| shape_error(count, columns, cell))
        .unwrap_or(1)
}

fn shape_error(count: usize, columns: usize, [w, h]: [usize; 2]) -> usize {
    let rows = count.div_ceil(columns);
    let empty = columns * rows - count;
    (2 * columns * (w + GAP_PX)).abs_diff(3 * rows * (h + GAP_PX)) + 4 * empty * (w + GAP_PX)
}

/// Height of a line of the legend, and of its colour mark.
const LEGEND_LINE_PX: usize = 24;
const MARK_PX: usize = 12;

struct LegendEntry {
    color: Srgb8,
    text: String,
    /// Distance from the margin, pixels.
    x: usize,
    line: usize,
}

impl LegendEntry {
    /// Next to the previous entry, or in the next line if the width is exceeded.
    fn after(before: Option<&Self>, color: Srgb8, text: String, width: usize) -> Self {
        let (x, line) = before.map_or((0, 0), |e| (e.end() + 2 * GAP_PX, e.line));
        let entry = Self {
            color,
            text,
            x,
            line,
        };
        if x == 0 || entry.end() <= width {
            return entry;
        }
        Self {
            x: 0,
            line: line + 1,
            ..entry
        }
    }

    fn width(&self) -> usize {
        MARK_PX + 8 + draw::text_width(&self.text)
    }

    /// Its end, pixels from the margin.
    fn end(&self) -> usize {
        self.x + self.width()
    }
}

/// The legend's entries, in as many lines as they need within a width.
fn legend_entries(classes: &[String], tiles: &[ContactTile], width: usize) -> Vec<LegendEntry> {
    let (labelled, unlabelled) = count_objects(classes.len(), tiles);
    let named = classes.iter().zip(labelled);
    let texts = named.map(|(name, count)| format!("{name} ({count})"));
    let own = (0..).map(draw::class_color).zip(texts);
    let why = why_unlabelled(tiles);
    let none = (UNLABELLED, format!("no label, {why} ({unlabelled})"));
    let mut placed = Vec::new();
    for (color, text) in own.chain([none]) {
        placed.push(LegendEntry::after(placed.last(), color, text, width));
    }
    placed
}

/// Truncation removes a label only if it was measured.
fn why_unlabelled(tiles: &[ContactTile]) -> &'static str {
    let mut objects = tiles.iter().flat_map(|tile| &tile.labels.objects);
    if objects.any(ObjectLabel::is_too_truncated) {
        "another lies over it, or the picture's edge cuts it off"
    } else {
        "another lies over it"
    }
}

/// Width and height of the legend, pixels.
fn legend_size(entries: &[LegendEntry]) -> [usize; 2] {
    let width = entries.iter().map(LegendEntry::end).max();
    let lines = entries.last().map_or(0, |entry| entry.line + 1);
    [width.unwrap_or(0), lines * LEGEND_LINE_PX]
}

/// Objects with a label for each class, and objects without one.
fn count_objects(class_count: usize, tiles: &[ContactTile]) -> (Vec<usize>, usize) {
    let (mut labelled, mut unlabelled) = (vec![0; class_count], 0);
    for tile in tiles {
        for object in &tile.labels.objects {
            if !tile.labelled.contains(&object.id) {
                unlabelled += 1;
            } else if let Some(count) = labelled.get_mut(object.class as usize) {
                *count += 1;
            }
        }
    }
    (labelled, unlabelled)
}

fn draw_legend(sheet: &mut Image<Srgb8>, entries: &[LegendEntry]) {
    for entry in entries {
        let x = (MARGIN_PX + entry.x) as isize;
        let y = (MARGIN_PX + entry.line * LEGEND_LINE_PX) as isize;
        draw_mark(sheet, [x, y], entry.color);
        let text = [x + MARK_PX as isize + 8, y];
        draw::text(sheet, text, &entry.text, INK);
    }
}

fn draw_mark(sheet: &mut Image<Srgb8>, [x, y]: [isize; 2], color: Srgb8) {
    let mark = [x, y + ((draw::LINE_PX - MARK_PX) / 2) as isize];
    draw::fill(sheet, mark, [MARK_PX, MARK_PX], color);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_is_wider_than_high_and_has_no_hole_where_that_is_possible() {
        assert_eq!(pleasing_columns(24, [320, 260]), 6);
        assert_eq!(pleasing_columns(16, [320, 260]), 4);
        assert_eq!(pleasing_columns(1, [320, 260]), 1);
        assert_eq!(pleasing_columns(0, [0, 0]), 1);
    }

    #[test]
    fn a_sheet_without_pictures_still_has_its_legend() {
        let sheet = contact_sheet(&[], &["cap".into()]);
        assert!(sheet.pixels().contains(&draw::class_color(0)));
    }

    #[test]
    fn a_small_picture_is_not_made_larger() {
        let picture = Image::filled(40, 30, LinearRgb::WHITE);
        let size = |width| shrunk(Cow::Borrowed(&picture), width).size();
        assert_eq!((size(320), size(20)), ((40, 30), (20, 15)));
    }

    #[test]
    fn a_narrow_legend_goes_on_in_the_next_line() {
        let classes = ["cap_label", "cap", "label", "none"].map(String::from);
        let narrow = legend_entries(&classes, &[], 250);
        assert!(narrow.iter().all(|e| e.x == 0 || e.x + e.width() <= 250));
        assert!(narrow.last().expect("five entries").line >= 2);
    }
}
