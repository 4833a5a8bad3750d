//! Kinds of picture file that are known and not read: what they are, and what to do with them.

/// How the compressed pictures of phones and of the web become one that is read.
const CONVERT: &str = "convert it to PNG first";
/// The same of what a camera has not developed.
pub(super) const DEVELOP: &str = "develop it to a 16-bit TIFF first";

/// First bytes of each kind from a place on; its name, and what to do.
const KINDS: [(usize, &[u8], &str, &str); 21] = [
    (4, b"ftypheic", HEIC, CONVERT_HEIC),
    (4, b"ftypheix", HEIC, CONVERT_HEIC),
    (4, b"ftyphevc", HEIC, CONVERT_HEIC),
    (4, b"ftypmif1", HEIC, CONVERT_HEIC),
    (4, b"ftypmsf1", HEIC, CONVERT_HEIC),
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
];

const HEIC: &str = "HEIC";
const CONVERT_HEIC: &str =
    "convert it to PNG first (`heif-convert IN.heic OUT.png`), or set the phone to JPEG";
pub(super) const RAW: &str = "a camera's raw file";

/// Name and advice of a file of such a kind.
pub(super) fn recognized(start: &[u8]) -> Option<(&'static str, &'static str)> {
    let is_kind = |(at, magic, ..): &&(usize, &[u8], _, _)| {
        start.get(*at..).is_some_and(|rest| rest.starts_with(magic))
    };
    KINDS
        .iter()
        .find(is_kind)
        .map(|&(_, _, name, advice)| (name, advice))
}
