//! The files of a capture: frames, the page that shows them, what is known of the display.

use super::display::Display;
use super::draw::draw_frame;
use super::frame::Frame;
use super::page::page;
use crate::error::{Error, Result};
use crate::io;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Name of the page that shows the frames.
const PAGE: &str = "show.html";
/// Name of the file about the display.
pub(super) const DISPLAY: &str = "display.toml";

/// Writes the frames as PNG files, a page that shows them and `display.toml` into a folder, which
/// is created if missing; returns the path of the page. Frames of an earlier set that are not in
/// this one are removed.
///
/// A display without a width keeps the one that was written into the folder's `display.toml`.
///
/// # Errors
/// [`Error::Value`](crate::Error::Value) for a display that cannot be right; those of reading an
/// existing `display.toml`, and of writing.
pub fn write_frames(folder: &Path, display: &Display, with_stripes: bool) -> Result<PathBuf> {
    display.check()?;
    let display = &with_known_width(display, &folder.join(DISPLAY))?;
    io::create_folder(folder)?;
    let frames: Vec<Frame> = Frame::all(with_stripes).collect();
    let pngs: Vec<_> = frames
        .par_iter()
        .map(|&frame| Ok((frame, write_frame(folder, display, frame)?)))
        .collect::<Result<_>>()?;
    remove_others(folder, &frames)?;
    io::write_toml(folder.join(DISPLAY), display)?;
    let path = folder.join(PAGE);
    io::write_text(&path, &page(display, &pngs))?;
    Ok(path)
}

/// The display with the width that its file says, where it has none itself.
fn with_known_width(display: &Display, file: &Path) -> Result<Display> {
    if display.width.is_some() || !file.exists() {
        return Ok(*display);
    }
    let known: Display = io::read_toml(file)?;
    if known.size_px == display.size_px {
        known.check().map_err(|e| e.in_file(file))?;
        return Ok(known);
    }
    if let Some(width) = known.width {
        let file = file.display();
        log::warn!("{file}: width = {width} was removed: it was measured at another size");
    }
    Ok(*display)
}

/// Writes one frame and returns the bytes of its file.
fn write_frame(folder: &Path, display: &Display, frame: Frame) -> Result<Vec<u8>> {
    let path = frame_path(folder, frame);
    io::write(&path, &draw_frame(display, frame))?;
    io::read_bytes(&path)
}

fn frame_path(folder: &Path, frame: Frame) -> PathBuf {
    folder.join(format!("{:02}_{frame}.png", frame.number()))
}

/// Removes the frames of an earlier set that this one has not.
fn remove_others(folder: &Path, frames: &[Frame]) -> Result<()> {
    let others = Frame::all(true).filter(|frame| !frames.contains(frame));
    let mut paths = others.map(|frame| frame_path(folder, frame));
    paths.try_for_each(|path| match path.exists() {
        true => std::fs::remove_file(&path).map_err(|e| Error::file(&path, e)),
        false => Ok(()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_frames_a_page_and_the_display() {
        let folder = tempfile::tempdir().unwrap();
        let display = Display {
            size_px: [400, 400],
            width: Some(0.2),
        };
        let page = write_frames(folder.path(), &display, true).unwrap();
        let text = std::fs::read_to_string(page).unwrap();
        assert_eq!(text.matches("data:image/png;base64,iVBOR").count(), 18);
        assert!(!text.contains("http"), "needs no network");
        let read: Display = io::read_toml(folder.path().join(DISPLAY)).unwrap();
        assert_eq!(read, display);
        let has = |name: &str| folder.path().join(name).exists();
        assert!(has("01_white.png") && has("17_stripes_y_fine_4.png"));
        write_frames(folder.path(), &display, false).unwrap();
        assert!(has("01_white.png") && !has("17_stripes_y_fine_4.png"));
    }

    #[test]
    fn a_width_that_was_written_later_stays_with_its_size() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(DISPLAY);
        let written = |size_px, width| -> Option<f64> {
            write_frames(folder.path(), &Display { size_px, width }, false).unwrap();
            io::read_toml::<Display>(&file).unwrap().width
        };
        assert_eq!(written([400, 500], None), None);
        let measured = std::fs::read_to_string(&file).unwrap() + "width = 0.345\n";
        std::fs::write(&file, measured).unwrap();
        assert_eq!(written([400, 500], None), Some(0.345));
        assert_eq!(written([400, 500], Some(0.2)), Some(0.2));
        assert_eq!(written([500, 400], None), None);
    }

    #[test]
    fn displays_that_cannot_be_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let told = |size_px, width| {
            let written = write_frames(folder.path(), &Display { size_px, width }, false);
            written.unwrap_err().to_string()
        };
        assert!(told([300, 400], None).starts_with("size_px: 300, expected 400 to"));
        let width = told([400, 400], Some(345.0));
        assert!(
            width.starts_with("width: 345, expected 0.01 to 50 m"),
            "{width}"
        );
        let file = folder.path().join(DISPLAY);
        std::fs::write(file, "size_px = [400, 400]\nwidth = 345.0\n").unwrap();
        let known = told([400, 400], None);
        assert!(known.contains("display.toml: width: 345"), "{known}");
    }
}
