//! Pictures for pages: a photo as the browser can show it, and small versions.

use crate::message::Query;
use crate::refusal::{Answer, Refusal};
use crate::studio::Studio;
use axum::Router;
use axum::extract::State;
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE, ETAG, IF_NONE_MATCH};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use petcomp::io::{Format, Header, ToFile};
use petcomp::{Image, Mix, PremulRgba, filter, io};
use serde::Deserialize;
use std::path::Path;
use std::sync::Arc;
use std::time::UNIX_EPOCH;

/// Extensions of possible photos.
const EXTENSIONS: [&str; 11] = [
    "jpg", "jpeg", "png", "tif", "tiff", "exr", "hdr", "webp", "heic", "heif", "hif",
];
const JPEG_QUALITY: u8 = 88;
/// For a photo at full size, in which corners are picked at eight times magnification.
const WHOLE_QUALITY: u8 = 95;
/// Size limit of a file that is sent to a browser unchanged.
const MAX_PLAIN_BYTES: u64 = 64 << 20;
/// Longer sides of downsized pictures, pixels.
const MIN_SIDE_PX: usize = 16;
const MAX_SIDE_PX: usize = 4096;

/// Whether a file has a picture's extension.
pub(crate) fn may_be_photo(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    extension.is_some_and(|extension| EXTENSIONS.contains(&extension.as_str()))
}

/// A JPEG as an answer.
pub(crate) fn jpeg<P: ToFile>(image: &Image<P>) -> Answer<Response> {
    jpeg_of(image, JPEG_QUALITY)
}

fn jpeg_of<P: ToFile>(image: &Image<P>, quality: u8) -> Answer<Response> {
    Ok(of_type("image/jpeg", io::jpeg_bytes(image, quality)?))
}

fn of_type(kind: &'static str, bytes: Vec<u8>) -> Response {
    ([(CONTENT_TYPE, kind)], bytes).into_response()
}

/// A picture downsized to at most this longer side.
pub(crate) fn at_most<P: Mix>(image: Image<P>, side_px: usize) -> Image<P> {
    let (width, height) = image.size();
    let longer = width.max(height);
    if longer <= side_px {
        return image;
    }
    let scaled = |side: usize| (side * side_px / longer).max(1);
    filter::resize(&image, scaled(width), scaled(height))
}

pub(crate) fn routes() -> Router<Arc<Studio>> {
    Router::new().route("/photo", get(photo))
}

/// A photo that a page requests.
#[derive(Deserialize)]
pub(crate) struct PhotoName {
    pub(crate) photo: String,
}

#[derive(Deserialize)]
struct PhotoQuery {
    file: String,
    /// Longer side, pixels; by default the full size.
    side: Option<usize>,
}

/// A photo: the file itself if the browser can show it whole, otherwise a JPEG of it. The browser
/// may cache it, and checks every time whether the file has changed.
async fn photo(
    State(studio): State<Arc<Studio>>,
    Query(query): Query<PhotoQuery>,
    headers: HeaderMap,
) -> Answer<Response> {
    let path = studio.folder.file(&query.file)?;
    let tag = tag_of(&path)?;
    let known = headers.get(IF_NONE_MATCH);
    let is_known = known.is_some_and(|known| *known == tag);
    let keeping = [(CACHE_CONTROL, "private, no-cache".to_owned()), (ETAG, tag)];
    if is_known {
        return Ok((StatusCode::NOT_MODIFIED, keeping).into_response());
    }
    let response = studio.decode(move || shown(&path, query.side)).await?;
    Ok((keeping, response).into_response())
}

/// Entity tag of a file: its modification time and length.
pub(crate) fn tag_of(path: &Path) -> Answer<String> {
    let meta = std::fs::metadata(path).map_err(unreadable)?;
    let written = meta.modified().map_err(unreadable)?;
    let nanos = written
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default()
        .as_nanos();
    Ok(format!("\"{nanos:x}-{:x}\"", meta.len()))
}

/// A picture as the browser can show it, small if a longer side is given. Otherwise it keeps its
/// size, since pages take positions from it.
pub(crate) fn shown(path: &Path, side: Option<usize>) -> Answer<Response> {
    if let Some(side) = side {
        return over_black(path, side.clamp(MIN_SIDE_PX, MAX_SIDE_PX), JPEG_QUALITY);
    }
    match plain_file(path)? {
        Some((kind, bytes)) => Ok(of_type(kind, bytes)),
        None => over_black(path, usize::MAX, WHOLE_QUALITY),
    }
}

/// A JPEG of a picture, which may have alpha.
fn over_black(path: &Path, side_px: usize, quality: u8) -> Answer<Response> {
    let picture = at_most(io::read::<PremulRgba>(path)?, side_px);
    jpeg_of(&picture.map(PremulRgba::color), quality)
}

/// The type and the bytes of a file that every browser shows as petcomp reads it. An upright JPEG
/// is sent without its EXIF data.
fn plain_file(path: &Path) -> Answer<Option<(&'static str, Vec<u8>)>> {
    let header = io::read_header(path)?;
    let Some(kind) = plain_type(path, &header)? else {
        return Ok(None);
    };
    let bytes = std::fs::read(path).map_err(unreadable)?;
    let plain = match header.format {
        Format::Jpeg => without_metadata(&bytes),
        _ => Some(bytes),
    };
    let plain = plain.filter(|bytes| !may_have_exif(bytes));
    Ok(plain.map(|bytes| (kind, bytes)))
}

// Markers of ISO/IEC 10918-1, table B.1: Huffman tables, start of scan, end of image, and
// application segment 1 with EXIF data or XMP.
const DHT: u8 = 0xc4;
const SOS: u8 = 0xda;
const EOI: u8 = 0xd9;
const APP1: u8 = 0xe1;

/// A JPEG without EXIF data, XMP and anything after the end of the picture, where cameras put a
/// smaller picture with EXIF data of its own. None for one that not every browser shows, or with
/// anything but segments in it.
fn without_metadata(jpeg: &[u8]) -> Option<Vec<u8>> {
    let (start, mut rest) = jpeg.split_at_checked(2)?;
    let mut kept = start.to_vec();
    while !rest.starts_with(&[0xff, EOI]) {
        let (segment, behind) = rest.split_at_checked(segment_bytes(rest)?)?;
        if is_rare_frame(segment) {
            return None;
        }
        if segment[1] != APP1 {
            kept.extend_from_slice(segment);
        }
        rest = behind;
    }
    kept.extend_from_slice(&[0xff, EOI]);
    Some(kept)
}

/// Length of the first segment of the rest of a JPEG, including the pixels that follow it.
fn segment_bytes(jpeg: &[u8]) -> Option<usize> {
    let &[0xff, marker, high, low, ..] = jpeg else {
        return None;
    };
    let length = 2 + usize::from(u16::from_be_bytes([high, low]));
    if marker != SOS {
        return Some(length);
    }
    let mut pairs = jpeg.get(length..)?.windows(2);
    // Not an escaped byte of pixels, padding or a restart marker.
    let end = pairs.position(|pair| pair[0] == 0xff && !matches!(pair[1], 0 | 0xff | 0xd0..=0xd7));
    Some(length + end?)
}

/// Whether the header belongs to a picture that not every browser shows: other than 8 bits,
/// lossless, hierarchical or arithmetic-coded.
fn is_rare_frame(segment: &[u8]) -> bool {
    match segment[1] {
        DHT => false,
        0xc0..=0xc2 => segment.get(4) != Some(&8),
        0xc3..=0xcf => true,
        _ => false,
    }
}

/// Whether browsers may rotate or scale a picture by EXIF data differently from petcomp: by an
/// orientation of an unusual type, a resolution together with a size, or a second block of such
/// data.
fn may_have_exif(bytes: &[u8]) -> bool {
    let mut places = bytes.windows(4);
    places.any(|place| place == b"Exif" || place == b"eXIf")
}

/// The type of a file whose pixels every browser shows as petcomp reads them.
fn plain_type(path: &Path, header: &Header) -> Answer<Option<&'static str>> {
    let bytes = std::fs::metadata(path).map_err(unreadable)?.len();
    Ok(match header.format {
        _ if bytes > MAX_PLAIN_BYTES => None,
        Format::Jpeg if header.turned || header.noted_adobe_rgb => None,
        Format::Jpeg => Some("image/jpeg"),
        Format::Png if header.bits == 8 => Some("image/png"),
        _ => None,
    })
}

fn unreadable(error: std::io::Error) -> Refusal {
    petcomp::Error::file("photo", error).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use petcomp::LinearRgb;
    use petcomp::io::{Bits, WriteOptions};

    fn body_of(photo: &Path, side: Option<usize>) -> Vec<u8> {
        let body = shown(photo, side).unwrap().into_body();
        let bytes = axum::body::to_bytes(body, usize::MAX);
        let runtime = tokio::runtime::Builder::new_current_thread().build();
        runtime.unwrap().block_on(bytes).unwrap().to_vec()
    }

    #[test]
    fn a_photo_that_no_browser_shows_keeps_its_size_unless_a_side_is_given() {
        let folder = tempfile::tempdir().unwrap();
        let (photo, answered) = (folder.path().join("a.png"), folder.path().join("a.jpg"));
        let deep = WriteOptions {
            bits: Some(Bits::Sixteen),
            ..WriteOptions::default()
        };
        let long = Image::filled(MAX_SIDE_PX + 4, 2, LinearRgb::WHITE);
        io::write_with(&photo, &long, &deep).unwrap();
        for (side, width) in [(None, MAX_SIDE_PX + 4), (Some(usize::MAX), MAX_SIDE_PX)] {
            std::fs::write(&answered, body_of(&photo, side)).unwrap();
            assert_eq!(io::read_header(&answered).unwrap().width, width, "{side:?}");
        }
    }

    /// An orientation as a LONG: petcomp turns the photo, Chromium does not.
    #[test]
    fn a_photo_with_exif_data_is_sent_upright_without_them() {
        let folder = tempfile::tempdir().unwrap();
        let (photo, answered) = (folder.path().join("a.jpg"), folder.path().join("b.jpg"));
        io::write(&photo, &Image::filled(40, 20, LinearRgb::WHITE)).unwrap();
        let mut jpeg = std::fs::read(&photo).unwrap();
        assert_eq!(body_of(&photo, None), jpeg);
        let exif = b"\xff\xe1\0\x22Exif\0\0MM\0*\0\0\0\x08\
            \0\x01\x01\x12\0\x04\0\0\0\x01\0\0\0\x06\0\0\0\0";
        jpeg.splice(2..2, exif.iter().copied());
        std::fs::write(&photo, jpeg).unwrap();
        let sent = body_of(&photo, None);
        assert!(!may_have_exif(&sent));
        std::fs::write(&answered, sent).unwrap();
        let header = io::read_header(&answered).unwrap();
        assert_eq!((header.width, header.height), (20, 40));
    }

    /// Re-encoding 12 megapixels took 0.6 s each time the photo was opened.
    #[test]
    fn an_upright_photo_with_exif_data_is_sent_without_them_and_not_encoded_anew() {
        let folder = tempfile::tempdir().unwrap();
        let photo = folder.path().join("a.jpg");
        io::write(&photo, &Image::filled(40, 20, LinearRgb::WHITE)).unwrap();
        let plain = std::fs::read(&photo).unwrap();
        let exif = b"\xff\xe1\0\x22Exif\0\0MM\0*\0\0\0\x08\
            \0\x01\x01\x12\0\x03\0\0\0\x01\0\x01\0\0\0\0\0\0";
        let noted = [&plain[..2], exif, &plain[2..]].concat();
        std::fs::write(&photo, &noted).unwrap();
        assert!(may_have_exif(&noted));
        assert_eq!(body_of(&photo, None), plain);
        // A preview after the picture, as many cameras write it.
        std::fs::write(&photo, [&noted[..], &noted].concat()).unwrap();
        assert_eq!(body_of(&photo, None), plain);
    }

    #[test]
    fn a_photo_in_a_camera_s_adobe_rgb_is_sent_in_srgb() {
        let folder = tempfile::tempdir().unwrap();
        let (photo, answered) = (folder.path().join("a.jpg"), folder.path().join("b.jpg"));
        let green = Image::filled(40, 20, LinearRgb::new(0.2, 0.4, 0.2));
        io::write(&photo, &green).unwrap();
        let light = |path: &Path| io::read::<LinearRgb>(path).unwrap()[(8, 8)];
        let own_codes = light(&photo);
        let exif = b"\xff\xe1\0\x52Exif\0\0MM\0*\0\0\0\x08\
            \0\x01\x87\x69\0\x04\0\0\0\x01\0\0\0\x1a\0\0\0\0\
            \0\x02\xa0\x01\0\x03\0\0\0\x01\xff\xff\0\0\
            \xa0\x05\0\x04\0\0\0\x01\0\0\0\x38\0\0\0\0\
            \0\x01\0\x01\0\x02\0\0\0\x04R03\0\0\0\0\0";
        let mut jpeg = std::fs::read(&photo).unwrap();
        jpeg.splice(2..2, exif.iter().copied());
        std::fs::write(&photo, jpeg).unwrap();
        std::fs::write(&answered, body_of(&photo, None)).unwrap();
        let (sent, expected) = (light(&answered), light(&photo));
        assert!(
            (sent.r - expected.r).abs() < 0.01,
            "{sent:?}, expected {expected:?}"
        );
        assert!((sent.r - own_codes.r).abs() > 0.03, "{sent:?}");
    }

    /// Browsers do not decode these; OpenImageIO does.
    #[test]
    fn an_arithmetic_coded_or_12_bit_photo_is_not_sent_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let photo = folder.path().join("a.jpg");
        io::write(&photo, &Image::filled(40, 20, LinearRgb::WHITE)).unwrap();
        let jpeg = std::fs::read(&photo).unwrap();
        assert_eq!(without_metadata(&jpeg).as_ref(), Some(&jpeg));
        let frame = jpeg
            .windows(2)
            .position(|pair| pair.starts_with(&[0xff, 0xc0]))
            .unwrap();
        for (place, byte) in [(frame + 1, 0xc9), (frame + 4, 12)] {
            let mut rare = jpeg.clone();
            rare[place] = byte;
            assert_eq!(without_metadata(&rare), None);
        }
    }

    #[test]
    fn a_picture_with_alpha_has_a_small_one() {
        let folder = tempfile::tempdir().unwrap();
        let picture = folder.path().join("a.png");
        let half = PremulRgba::new(0.5, 0.25, 0.0, 0.5);
        io::write(&picture, &Image::filled(40, 20, half)).unwrap();
        assert!(shown(&picture, Some(16)).is_ok());
    }
}
