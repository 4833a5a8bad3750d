//! Kinds of picture file that are known and not read: what they are, and what to do with them.

use super::format::begins_at;

/// How the compressed pictures of phones and of the web become one that is read.
const CONVERT: &str = "convert it to PNG first";
/// The same of what a camera has not developed.
pub(super) const DEVELOP: &str = "develop it to a 16-bit TIFF first";

/// First bytes of each kind from a place on; its name, and what to do.
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
    // Phase One: behind IIII and a letter, which pixels of an ordinary TIFF may begin with, too.
    (13, b"waR", RAW, DEVELOP),
    (8, b"MMMMRaw", RAW, DEVELOP),
    (6, b"HEAPCCDR", RAW, DEVELOP),
    (0, b"\0MRM", RAW, DEVELOP),
];

const SEQUENCE: &str = "a sequence of HEIC pictures";
pub(super) const RAW: &str = "a camera's raw file";

/// Name and advice of a file of such a kind.
pub(super) fn recognized(start: &[u8]) -> Option<(&'static str, &'static str)> {
    KINDS
        .iter()
        .find(|&&(at, magic, ..)| begins_at(start, at, magic))
        .map(|&(_, _, name, advice)| (name, advice))
}
