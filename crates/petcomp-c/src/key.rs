//! Blender's keyer on a buffer.
#![expect(unsafe_code, reason = "called from C")]

use crate::memory::{array, slice, store, text};
use crate::status::{Failure, Status, call};
use petcomp::matte::key::{KeyOptions, Keying, Screen};
use petcomp::{Error, Image, ImageView, LinearRgb, PremulRgba, io};
use std::ffi::c_char;

const CHANNELS: usize = 4;

/// Keys an image exactly like Blender's Keying node, bit for bit.
///
/// * `rgba`: `height` rows of `width` pixels of four floats, scene-linear (Rec. 709 primaries),
///   alpha premultiplied; rows without gaps are read in place
/// * `row_stride`: distance between rows in floats, at least 4 * `width`
/// * `screen`: colour of the screen, three scene-linear floats
/// * `options`: JSON object with Blender's settings, e.g. {"profile": "blender-4.5", "clip_black":
///   0.1}, or null for the defaults
/// * `matte`: null, or receives `width` * `height` floats, 0 to 1
/// * `cutout`: null, or receives four times as many, scene-linear, premultiplied, rows without gaps
///
/// # Safety
/// Each pointer is null or points to memory as described.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn petcomp_key(
    rgba: *const f32,
    width: usize,
    height: usize,
    row_stride: usize,
    screen: *const f32,
    options: *const c_char,
    matte: *mut f32,
    cutout: *mut f32,
) -> Status {
    call(|| {
        let size = [width, height];
        check_size(size, row_stride)?;
        let count = (height - 1) * row_stride + width * CHANNELS;
        // SAFETY: promised by the caller.
        let (floats, screen, options) = unsafe {
            let floats = slice("rgba", rgba, count)?;
            (floats, array("screen", screen)?, options_of(options)?)
        };
        let packed = packed(floats, size, row_stride);
        let photo = ImageView::new(width, height, packed.as_ref());
        check_finite(photo)?;
        let keying = Keying::of_view(photo, Screen::Color(LinearRgb::from(screen)));
        if cutout.is_null() {
            // SAFETY: promised by the caller.
            return unsafe { store_picture("matte", &keying.matte(&options)?, matte) };
        }
        let keyed = keying.run(&options)?;
        // SAFETY: promised by the caller.
        unsafe {
            store_picture("matte", &keyed.matte, matte)?;
            store_picture("cutout", &keyed.cutout, cutout)
        }
    })
}

fn check_size(size: [usize; 2], row_stride: usize) -> Result<(), Failure> {
    let [width, height] = size;
    io::Limits::default()
        .check_size(size)
        .map_err(|what| Failure::argument("width, height", what))?;
    let least = width * CHANNELS;
    // The most that memory can hold.
    let most = isize::MAX.unsigned_abs() / size_of::<f32>() / height;
    let expected = match row_stride {
        stride if stride < least => format!("at least {least}"),
        stride if stride > most => format!("at most {most}"),
        _ => return Ok(()),
    };
    let what = format_args!("{row_stride} floats, expected {expected}");
    Err(Failure::argument("row_stride", what))
}

/// The pixels without gaps between rows.
fn packed(
    floats: &[f32],
    [width, height]: [usize; 2],
    row_stride: usize,
) -> std::borrow::Cow<'_, [PremulRgba]> {
    let row = width * CHANNELS;
    if row_stride == row {
        return bytemuck::cast_slice(floats).into();
    }
    let rows = (0..height).map(|y| &floats[y * row_stride..][..row]);
    rows.flat_map(bytemuck::cast_slice::<f32, PremulRgba>)
        .copied()
        .collect()
}

fn check_finite(photo: ImageView<'_, PremulRgba>) -> Result<(), Failure> {
    let bad = |pixel: &PremulRgba| !(pixel.color().is_finite() && pixel.a.is_finite());
    for y in 0..photo.size().1 {
        if let Some(x) = photo.row(y).iter().position(bad) {
            let what = format!("not finite in column {x}, row {y}, expected finite numbers");
            return Err(Failure::argument("rgba", what));
        }
    }
    Ok(())
}

/// # Safety
/// `options` is null or a text.
unsafe fn options_of(options: *const c_char) -> Result<KeyOptions, Failure> {
    if options.is_null() {
        return Ok(KeyOptions::default());
    }
    // SAFETY: promised.
    let json = unsafe { text("options", options) }?;
    // A list would be parsed as the settings in order.
    if !json.trim_start().starts_with('{') {
        let what = r#"not a JSON object, expected one such as {"clip_black": 0.1}"#;
        return Err(Error::value("options", what).into());
    }
    Ok(serde_json::from_str(json).map_err(|e| Error::value("options", e))?)
}

/// # Safety
/// `buffer` is null or has room for the picture.
unsafe fn store_picture<P: bytemuck::Pod>(
    name: &str,
    picture: &Image<P>,
    buffer: *mut f32,
) -> Result<(), Failure> {
    if buffer.is_null() {
        return Ok(());
    }
    let floats: &[f32] = bytemuck::cast_slice(picture.pixels());
    // SAFETY: promised.
    unsafe { store(name, floats, buffer, floats.len()) }
}
