//! Files of the keyers' commands, in full precision.

use anyhow::Result;
use petcomp::Image;
use petcomp::io::{self, Bits, Canvas, Format, Header, ToFile, WriteOptions};
use petcomp::matte::CutOut;
use std::fmt::Display;
use std::path::{Path, PathBuf};

/// Writes a picture, in full precision if it is an EXR.
pub(super) fn write_picture<P: ToFile>(
    path: &Path,
    image: &Image<P>,
    canvas: Canvas,
) -> Result<()> {
    let options = WriteOptions {
        bits: is_exr(path).then_some(Bits::Float),
        canvas,
        ..WriteOptions::default()
    };
    Ok(io::write_with(path, image, &options)?)
}

/// Whether the file has the extension `.exr`.
pub(super) fn is_exr(path: &Path) -> bool {
    io::has_extension(path, "exr")
}

/// The canvas of a photo, for pictures made from it; warns of stored pixels that they do not keep.
pub(super) fn canvas_of(photo: &Path) -> petcomp::Result<Canvas> {
    Ok(canvas_of_exr(photo)?.unwrap_or_default())
}

/// The same for a cut-out of the photo, which stays in the photo's display window. A reduced
/// cut-out has no position there.
pub(super) fn canvas_of_cut_out(
    photo: &Path,
    (width, height): (usize, usize),
    cut: &CutOut,
) -> petcomp::Result<Canvas> {
    let Some(whole) = canvas_of_exr(photo)? else {
        return Ok(Canvas::default());
    };
    if cut.scale != 1.0 {
        return Ok(Canvas {
            at: [0; 2],
            ..whole
        });
    }
    let [x, y] = whole.at;
    Ok(Canvas {
        at: [x + cut.roi.x as i32, y + cut.roi.y as i32],
        display: Some((whole.at, [width, height])),
        ..whole
    })
}

/// None for a photo in another format.
fn canvas_of_exr(photo: &Path) -> petcomp::Result<Option<Canvas>> {
    if io::read_format(photo)? != Format::Exr {
        return Ok(None);
    }
    let header = io::read_header(photo)?;
    if stores_more_than_shown(&header) {
        let (photo, [w, h]) = (photo.display(), header.data_size);
        log::warn!(
            "{photo}: of {w} x {h} stored pixels, those outside the display window are dropped"
        );
    }
    Ok(Some(header.canvas))
}

fn stores_more_than_shown(header: &Header) -> bool {
    let shown = [header.width, header.height];
    (0..2).any(|axis| {
        let at = header.data_at[axis];
        at < 0 || at + header.data_size[axis] as i64 > shown[axis] as i64
    })
}

/// Fails if a picture does not have the size of a photo; both are named as the user does.
pub(super) fn check_same_size(
    name: impl Display,
    (w, h): (usize, usize),
    photo: &Path,
    (width, height): (usize, usize),
) -> Result<()> {
    let photo = photo.display();
    anyhow::ensure!(
        (w, h) == (width, height),
        "{name}: {w} x {h} pixels, expected {width} x {height} as {photo}"
    );
    Ok(())
}

/// Writes a picture if it was requested.
pub(super) fn write_optional<P: ToFile>(
    path: &Option<PathBuf>,
    image: &Image<P>,
    canvas: Canvas,
) -> Result<()> {
    path.iter()
        .try_for_each(|path| write_picture(path, image, canvas))
}
