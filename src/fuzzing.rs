//! Doors for the fuzzers in `fuzz/`: each takes any bytes and must come back. Not part of the library's interface.

use crate::{camera, dataset, io};

/// A label file, solved where it can be read.
pub fn label(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(label) = io::parse_json::<camera::Label>(text) {
        let _ = camera::solve(&label, &camera::SolveOptions::default());
    }
}

/// A recipe, checked where it can be read.
pub fn recipe(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(setup) = io::parse_toml::<dataset::Setup>(text) {
        let _ = setup.scene.check();
    }
}

/// The journal of a dataset.
pub fn journal(bytes: &[u8]) {
    let _ = dataset::journal_lines(bytes, false);
}

/// What an OpenImageIO worker says.
#[cfg(feature = "oiio")]
pub fn worker(bytes: &[u8]) {
    let _ = io::worker_answer(bytes);
}

/// The first bytes of a picture.
pub fn header(bytes: &[u8]) {
    let _ = io::header_of(bytes);
}
