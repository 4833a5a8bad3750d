//! Kinds of picture files that are recognised but not read: their names, and what to do with them.

use super::format::begins_at;

/// How to convert compressed pictures from phones and from the web to a supported format.
const CONVERT: &str = "convert it to PNG first";
/// The same for raw files from cameras.
pub(super) const DEVELOP: &str = "develop it to a 16-bit TIFF first";

/// First bytes of each kind and their position; its name, and what to do.
const KINDS: [(usize, &[u8], &str, &str); 22] = [
    (4, b"ftyphevc", SEQUENCE, CONVERT),
    (4, b"ftypmsf1", SEQUENCE, CONVERT),
    (4, b"ftypavif", "AVIF", CONVERT),
    (4, b"ftypavis", "AVIF", CONVERT),
    (8, b"WEBP", "WebP", CONVERT),
    (0, b"\xff\x0a", "JPEG XL", CONVERT),
    (0, b"\0\0\0\x0cJXL ", "JPEG XL", CONVERT),
    (0, b"GIF8", "GIF", CONVERT),
    (0, b"BM", "BMP", CONVERT),
    (0, b"8BPS", "Photoshop's PSD", CONVERT),
    (4, b"ftypcrx ", RAW, DEVELOP),
    (8, b"CR\x02\0", RAW, DEVELOP),
    (0, b"IIRO", RAW, DEVELOP),
    (0, b"IIRS", RAW, DEVELOP),
    (0, b"MMOR", RAW, DEVELOP),
    (0, b"IIU\0", RAW, DEVELOP),
    (0, b"FUJIFILMCCD-RAW", RAW, DEVELOP),
    (0, b"FOVb", RAW, DEVELOP),
    // Phase One: after IIII and a letter, which may also be the first pixels of an ordinary TIFF.
    (13, b"waR", RAW, DEVELOP),
    (8, b"MMMMRaw", RAW, DEVELOP),
    (6, b"HEAPCCDR", RAW, DEVELOP),
    (0, b"\0MRM", RAW, DEVELOP),
];

const SEQUENCE: &str = "a sequence of HEIC pictures";
pub(super) const RAW: &str = "a camera's raw file";

/// Name and advice for a file of one of these kinds.
pub(super) fn recognized(start: &[u8]) -> Option<(&'static str, &'static str)> {
    KINDS
        .iter()
        .find(|&&(at, magic, ..)| begins_at(start, at, magic))
        .map(|&(_, _, name, advice)| (name, advice))
}
