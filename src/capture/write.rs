//! The files of a capture: frames, the page that shows them, what is known of the display.

use super::display::Display;
use super::draw::draw_frame;
use super::frame::Frame;
use super::page::page;
use crate::error::Result;
use crate::io;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Name of the page that shows the frames.
const PAGE: &str = "show.html";
/// Name of the file about the display.
pub(super) const DISPLAY: &str = "display.toml";

/// Writes the frames as PNG files, a page that shows them and `display.toml` into a folder, which
/// is made if it is not there; returns the path of the page.
///
/// # Errors
/// [`Error::Value`](crate::Error::Value) for a display that cannot be right; those of writing.
pub fn write_frames(folder: &Path, display: &Display, with_stripes: bool) -> Result<PathBuf> {
    display.check()?;
    io::create_folder(folder)?;
    let frames: Vec<Frame> = Frame::all(with_stripes).collect();
    let pngs: Vec<_> = frames
        .par_iter()
        .map(|&frame| Ok((frame, write_frame(folder, display, frame)?)))
        .collect::<Result<_>>()?;
    io::write_toml(folder.join(DISPLAY), display)?;
    let path = folder.join(PAGE);
    io::write_text(&path, &page(display, &pngs))?;
    Ok(path)
}

/// Writes one frame and returns the bytes of its file.
fn write_frame(folder: &Path, display: &Display, frame: Frame) -> Result<Vec<u8>> {
    let path = folder.join(format!("{:02}_{frame}.png", frame.number()));
    io::write(&path, &draw_frame(display, frame))?;
    io::read_bytes(&path)
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
        assert!(folder.path().join("17_stripes_y_fine_4.png").exists());
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
    }
}
