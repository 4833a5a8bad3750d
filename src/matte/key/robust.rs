//! What the robust profile adds: keys that cannot work are refused, holes in plates are filled, and
//! all is counted.

use super::model::{is_usable, primary_channel};
use super::options::{KeyOptions, Profile};
use super::photo::{Photo, socket_color};
use super::{Deviations, Keying, Screen};
use crate::error::{Error, Result};
use crate::filter::Pyramid;
use crate::image::Image;
use crate::matte::screen::{mean_color, other_channels};
use crate::pixel::{Coverage, LinearRgb, PremulRgba};
use rayon::prelude::*;
use std::ops::Range;

/// Least excess of a key's primary channel over the other two, and least saturation: below, noise
/// of half a percent becomes matte noise of a quarter.
const MIN_KEY_STRENGTH: f32 = 0.02;

/// Channel names for messages.
const CHANNEL_NAMES: [&str; 3] = ["red", "green", "blue"];

/// How far a colour exceeds the grey of its other channels in `channel`: the lesser of excess and
/// saturation.
fn key_strength(key: LinearRgb, channel: usize, balance: f32) -> f32 {
    let c = key.channels();
    let (lo, hi) = other_channels(c, channel);
    let v = balance * lo + (1.0 - balance) * hi;
    let excess = c[channel] - v;
    excess.min(excess * (1.0 - v).abs())
}

/// Refuses a key colour from which no matte but noise can be made.
pub(super) fn check_color(key: LinearRgb, options: &KeyOptions) -> Result<()> {
    let (key, channel) = (socket_color(key), primary_channel(socket_color(key)));
    let found = key_strength(key, channel, options.screen_balance);
    if options.profile != Profile::Robust || options.accept_weak_key || found >= MIN_KEY_STRENGTH {
        return Ok(());
    }
    Err(weak_key(key, CHANNEL_NAMES[channel], found))
}

fn weak_key(LinearRgb { r, g, b }: LinearRgb, channel: &str, strength: f32) -> Error {
    let what = format!(
        "{r},{g},{b} is too grey to key: its {channel} stands out by {strength:.4}, expected at least {MIN_KEY_STRENGTH}; \
         give a more saturated screen colour, or set key.accept_weak_key = true"
    );
    Error::value("screen", what)
}

/// Warns of settings that switch the edge search into something hardly wanted.
pub(super) fn warn_of_edge_settings(options: &KeyOptions) {
    if options.profile != Profile::Robust
        || (options.clip_black <= 0.0 && options.clip_white >= 1.0)
    {
        return;
    }
    if options.edge_kernel_radius == 1 {
        log::warn!(
            "key.edge_kernel_radius: 1 makes every pixel an edge, so the levels do nothing; 0 clips all pixels"
        );
    } else if options.edge_kernel_radius > 0 && options.edge_kernel_tolerance == 0.0 {
        log::warn!(
            "key.edge_kernel_tolerance: 0 makes every pixel an edge, so the levels do nothing"
        );
    }
}

/// A plate without holes.
pub(super) struct FilledPlate {
    pub(super) plate: Image<LinearRgb>,
    /// The primary channel of the plate's mean.
    pub(super) channel: usize,
    /// How many pixels were filled.
    pub(super) count: usize,
}

/// Fills the pixels of a plate that are no usable key from those around them.
///
/// # Method
/// A pyramid of halved means that count only the usable pixels; a hole takes the colour of the
/// finest level that has one.
///
/// # Errors
/// [`Error::Value`] where no pixel of the plate is usable.
pub(super) fn fill_plate(plate: &Image<LinearRgb>, options: &KeyOptions) -> Result<FilledPlate> {
    let channel = primary_channel(usable_mean(plate));
    let known = usable_keys(plate, channel, options);
    let count = known.pixels().par_iter().filter(|p| p.a == 0.0).count();
    if count == plate.pixels().len() && count > 0 {
        return Err(no_usable_key(channel));
    }
    let levels = Pyramid::new(known);
    let plate = Image::from_fn(plate.width(), plate.height(), |x, y| {
        nearest_known(&levels, x, y)
    });
    Ok(FilledPlate {
        plate,
        channel,
        count,
    })
}

/// The plate with its holes transparent.
fn usable_keys(
    plate: &Image<LinearRgb>,
    channel: usize,
    options: &KeyOptions,
) -> Image<PremulRgba> {
    plate.map(|c| match is_usable_key(c, channel, options) {
        true => c.opaque(),
        false => PremulRgba::TRANSPARENT,
    })
}

/// A pixel of a plate that can be keyed against.
fn is_usable_key(c: LinearRgb, channel: usize, options: &KeyOptions) -> bool {
    is_usable(c.opaque())
        && (options.accept_weak_key
            || key_strength(c, channel, options.screen_balance) >= MIN_KEY_STRENGTH)
}

fn no_usable_key(channel: usize) -> Error {
    let what = format!(
        "no pixel's {} stands out by {MIN_KEY_STRENGTH} or more; give a plate of the screen alone, or set \
         key.accept_weak_key = true",
        CHANNEL_NAMES[channel]
    );
    Error::value("plate", what)
}

fn nearest_known(levels: &Pyramid<PremulRgba>, x: usize, y: usize) -> LinearRgb {
    let known = (0..levels.levels())
        .map(|level| levels.level(level)[(x >> level, y >> level)])
        .find(|p| p.a > 0.0)
        .unwrap_or_default();
    if known.a == 1.0 {
        known.color()
    } else {
        known.color().scale(1.0 / known.a)
    }
}

/// Mean of the usable pixels; black where there is none.
fn usable_mean(plate: &Image<LinearRgb>) -> LinearRgb {
    let usable = plate.pixels().iter().filter(|c| is_usable(c.opaque()));
    mean_color(usable.copied()).unwrap_or(LinearRgb::BLACK)
}

/// A value of a garbage or core matte that the robust profile takes as it is.
pub(super) fn is_usable_matte(m: Coverage) -> bool {
    is_usable(PremulRgba::new(m.0, 0.0, 0.0, 0.0))
}

/// Counts what the robust profile replaces in some rows of the photo and its mattes.
pub(super) fn count_unusable<P: Photo>(
    keying: &Keying<'_, P>,
    options: &KeyOptions,
    rows: Range<usize>,
) -> Deviations {
    if options.profile != Profile::Robust {
        return Deviations::default();
    }
    rows.map(|y| unusable_in_row(keying, y)).sum()
}

fn unusable_in_row<P: Photo>(keying: &Keying<'_, P>, y: usize) -> Deviations {
    let pixels = keying.photo.row(y).iter();
    let mattes = [keying.garbage, keying.core].into_iter().flatten();
    Deviations {
        unusable_pixels: pixels.filter(|p| !is_usable(p.premul())).count(),
        unusable_mattes: mattes
            .flat_map(|matte| matte.row(y))
            .filter(|m| !is_usable_matte(**m))
            .count(),
        ..Deviations::default()
    }
}

/// The screen as the robust profile keys against it: a plate without holes, its mean's primary
/// channel.
pub(super) fn without_holes(
    screen: Screen<'_>,
    options: &KeyOptions,
) -> Result<Option<FilledPlate>> {
    match screen {
        Screen::Plate(plate) if options.profile == Profile::Robust => {
            fill_plate(plate, options).map(Some)
        }
        _ => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GREEN: LinearRgb = LinearRgb::new(0.1, 0.7, 0.2);

    #[test]
    fn a_hole_in_a_plate_takes_the_colour_around_it() {
        let mut plate = Image::filled(8, 8, GREEN);
        plate[(3, 3)] = LinearRgb::new(f32::NAN, 0.0, 0.0);
        plate[(4, 3)] = LinearRgb::grey(0.5);
        let filled = fill_plate(&plate, &KeyOptions::for_profile(Profile::Robust)).unwrap();
        assert_eq!((filled.count, filled.channel), (2, 1));
        for c in filled.plate.pixels() {
            assert!((c.g - 0.7).abs() < 1e-6 && (c.r - 0.1).abs() < 1e-6);
        }
    }

    #[test]
    fn a_plate_without_colour_is_refused() {
        let plate = Image::filled(4, 4, LinearRgb::grey(0.5));
        assert!(fill_plate(&plate, &KeyOptions::for_profile(Profile::Robust)).is_err());
    }

    #[test]
    fn a_grey_key_is_refused_with_advice() {
        let options = KeyOptions::for_profile(Profile::Robust);
        let message = check_color(LinearRgb::grey(0.5), &options)
            .unwrap_err()
            .to_string();
        assert!(
            message.starts_with("screen: 0.5,0.5,0.5 is too grey")
                && message.contains("accept_weak_key")
        );
        assert!(check_color(GREEN, &options).is_ok());
        let accepting = KeyOptions {
            accept_weak_key: true,
            ..options
        };
        assert!(check_color(LinearRgb::grey(0.5), &accepting).is_ok());
    }
}
