//! A decoded picture whose pixels are converted on request.

use super::codec::channels::{ChannelMatch, Wanted};
use super::codec::profile::{ColorDescription, DisplayProfile};
use super::codec::raster::Raster;
use super::codec::refusal::Refusal;
use super::codec::{FromFile, heif, jpeg, png, tiff};
use super::decode::{camera_notes, catch_panic, decode_raster, warn_unreadable};
use super::format::Format;
use super::limits::{Limits, affordable, saturating_product};
use super::options::ReadOptions;
use super::source::SourceFile;
use crate::error::{Error, Result};
use crate::image::Image;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A picture stored as the samples of its file, usually one byte per channel of a pixel.
///
/// For processing large pictures part by part; [`read`](super::read) returns all pixels at once.
#[derive(Debug)]
pub struct Picture {
    path: PathBuf,
    format: Format,
    raster: Raster,
    profile: Option<DisplayProfile>,
}

impl Picture {
    /// Reads a colour picture with the default [`ReadOptions`].
    ///
    /// # Errors
    /// [`Error::File`] as in [`read`](super::read).
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let picture = Self::decode(path.as_ref(), &ReadOptions::default(), Wanted::Color)?;
        Wanted::Color
            .pick(&picture.raster.names)
            .map_err(|e| Error::file(&picture.path, e))?;
        Ok(picture)
    }

    pub(super) fn decode(path: &Path, options: &ReadOptions, wanted: Wanted) -> Result<Self> {
        let source = SourceFile::open(path, &options.limits)?;
        Self::from_source(&source, options, wanted)
    }

    pub(super) fn from_source(
        source: &SourceFile,
        options: &ReadOptions,
        wanted: Wanted,
    ) -> Result<Self> {
        let raster = decode_raster(source, options, wanted);
        Self::from_raster(raster, source, &options.limits, wanted)
    }

    /// Determines the meaning of the samples, and rotates the picture upright.
    pub(super) fn from_raster(
        raster: std::result::Result<Raster, Refusal>,
        source: &SourceFile,
        limits: &Limits,
        wanted: Wanted,
    ) -> Result<Self> {
        let raster = raster.map_err(|e| Error::file(&source.path, e))?;
        let notes = camera_notes(source);
        warn_unreadable(&notes, &source.path);
        let noted = notes.color.filter(|_| raster.display_encoded);
        let profile = wanted
            .is_color()
            .then(|| usable_profile(&raster, source, limits, noted))
            .flatten();
        warn_not_finite(&raster, source, wanted);
        warn_unusual_channels(&raster, source, wanted);
        warn_undeclared_samples(&raster, source, wanted);
        warn_narrow_range(source, limits, wanted);
        Ok(Self {
            path: source.path.clone(),
            format: source.format,
            raster: raster.upright(notes.orientation),
            profile,
        })
    }

    /// Width and height, upright.
    pub fn size(&self) -> (usize, usize) {
        (self.raster.width, self.raster.height)
    }

    /// The kind of file, by its content.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Names of the channels used for its colours.
    pub fn channels(&self) -> &[String] {
        &self.raster.names
    }

    /// Whether its samples are display-encoded integers; others are scene-linear.
    pub fn is_display_encoded(&self) -> bool {
        self.raster.display_encoded
    }

    /// Whether its colours have alpha.
    pub fn has_alpha(&self) -> bool {
        Wanted::Color
            .pick(&self.raster.names)
            .is_ok_and(|picked| picked.len() > 3)
    }

    /// The colours of some rows, converted as by [`read`](super::read); for `LinearRgb`, without
    /// checking alpha.
    ///
    /// # Panics
    /// When the rows reach outside the picture, or the requested pixels are not colours.
    pub fn rows<P: FromFile>(&self, rows: Range<usize>) -> Image<P> {
        self.colors(self.profile.as_ref(), rows)
    }

    /// Like [`rows`](Self::rows), but decoded as sRGB whatever the file's profile: encoding them
    /// again gives its codes.
    ///
    /// # Panics
    /// As in [`rows`](Self::rows).
    pub fn rows_as_srgb<P: FromFile>(&self, rows: Range<usize>) -> Image<P> {
        self.colors(None, rows)
    }

    /// All colours, converted as by [`read`](super::read).
    ///
    /// # Errors
    /// [`Error::File`] for a picture with alpha below 1 if `LinearRgb` is requested.
    ///
    /// # Panics
    /// When the requested pixels are not colours.
    pub fn pixels<P: FromFile>(&self) -> Result<Image<P>> {
        let rows = 0..self.raster.height;
        let whole = self.raster.rows(self.profile.as_ref(), rows.clone());
        P::check(&whole).map_err(|e| Error::file(&self.path, e))?;
        Ok(self.rows(rows))
    }

    fn colors<P: FromFile>(
        &self,
        profile: Option<&DisplayProfile>,
        rows: Range<usize>,
    ) -> Image<P> {
        assert_eq!(P::WANTED, Wanted::Color, "pixels that are not colours");
        self.raster
            .pixels(profile, rows)
            .expect("colours were found when the picture was read")
    }

    pub(super) fn into_image<P: FromFile>(self) -> Result<Image<P>> {
        let (raster, profile) = (self.raster, self.profile);
        let sizes = [raster.width, raster.height, size_of::<P>()];
        affordable(saturating_product(sizes.map(|n| n as u64)))
            .and_then(|()| raster.into_image(profile.as_ref()))
            .map_err(|e| Error::file(self.path, e))
    }
}

/// The colour profile of display codes, if there is one other than sRGB.
fn usable_profile(
    raster: &Raster,
    source: &SourceFile,
    limits: &Limits,
    noted: Option<ColorDescription>,
) -> Option<DisplayProfile> {
    let path = source.path.display();
    let described = catch_panic(|| Ok(described_profile(source, limits, noted)?));
    let profile = described.unwrap_or_else(|e| {
        log::warn!("{path}: has {e}; treated as sRGB");
        None
    });
    if profile.is_some() && !raster.display_encoded {
        log::warn!("{path}: has a colour profile, but float samples; treated as linear Rec. 709");
        return None;
    }
    if profile
        .as_ref()
        .is_some_and(|profile| profile.has_unapplied_table)
    {
        log::warn!(
            "{path}: has a colour profile with a lookup table, which is ignored; its primaries and curves are used"
        );
    }
    profile
}

/// The profile in a file, or the one recorded by its camera, unless it is sRGB; formats with linear
/// light have none.
fn described_profile(
    source: &SourceFile,
    limits: &Limits,
    noted: Option<ColorDescription>,
) -> std::result::Result<Option<DisplayProfile>, String> {
    let description = match source.format {
        Format::Png => png::color_description(&source.bytes, limits),
        Format::Jpeg => jpeg::profile(&source.bytes)
            .map(ColorDescription::Icc)
            .or(noted),
        Format::Tiff => tiff::profile(&source.bytes, limits)
            .map(ColorDescription::Icc)
            .or(noted),
        Format::Heif => heif::color_description(&source.bytes),
        _ => None,
    };
    description.map_or(Ok(None), DisplayProfile::from_description)
}

/// Warns of samples that are not finite; infinite depth is normal where there is nothing.
fn warn_not_finite(raster: &Raster, source: &SourceFile, wanted: Wanted) {
    if wanted == Wanted::Depth {
        return;
    }
    let count = raster.count_not_finite();
    if count > 0 {
        let path = source.path.display();
        log::warn!("{path}: {count} samples are infinite or NaN");
    }
}

/// Reports the channels used from a picture without the default names.
fn warn_unusual_channels(raster: &Raster, source: &SourceFile, wanted: Wanted) {
    let path = source.path.display();
    match wanted.choose(&raster.names) {
        Ok((ChannelMatch::Layer, _)) => {
            log::warn!("{path}: uses the channels {}", raster.names.join(" "))
        }
        Ok((ChannelMatch::Alone, _)) if wanted != Wanted::Depth => {
            log::warn!("{path}: uses the channel {} as grey", raster.names[0])
        }
        _ => {}
    }
}

/// Reports a TIFF with samples after its colours, the first of which is not declared as alpha: if
/// they are declared as something else, most programs ignore them, some treat the first one as
/// alpha; if no tag mentions them, it is alpha in most.
fn warn_undeclared_samples(raster: &Raster, source: &SourceFile, wanted: Wanted) {
    if source.format != Format::Tiff || !wanted.is_color() {
        return;
    }
    let picked = Wanted::Color.pick(&raster.names);
    let (is_undeclared, what): (fn(&[u8]) -> bool, _) = match picked.map_or(0, |p| p.len()) {
        3 => (
            tiff::has_unspecified_sample,
            "has extra samples, the first of which is not declared as alpha (ExtraSamples 1 or 2); ignored",
        ),
        4 => (
            tiff::has_unstated_alpha,
            "has a fourth sample without ExtraSamples, treated as straight alpha",
        ),
        _ => return,
    };
    if catch_panic(|| Ok(is_undeclared(&source.bytes))).unwrap_or(false) {
        log::warn!("{}: {what}", source.path.display());
    }
}

/// Reports a PNG with video codes, whose black and white are not the lowest and highest codes.
fn warn_narrow_range(source: &SourceFile, limits: &Limits, wanted: Wanted) {
    if source.format != Format::Png || !wanted.is_color() {
        return;
    }
    let is_narrow = catch_panic(|| Ok(png::has_narrow_range(&source.bytes, limits)));
    if is_narrow.unwrap_or(false) {
        let path = source.path.display();
        log::warn!("{path}: has narrow-range codes (cICP), treated as full range");
    }
}

#[cfg(test)]
mod tests {
    use crate::image::Image;
    use crate::io;
    use crate::pixel::{LinearRgb, Srgb8};
    use exif::experimental::Writer;
    use exif::{Field, In, Tag, Value};
    use moxcms::ColorProfile;

    const APP1: u8 = 0xe1;
    const APP2: u8 = 0xe2;

    /// Light of a single-colour JPEG with a segment.
    fn light(marker: u8, data: &[u8]) -> LinearRgb {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.jpg");
        let green = Srgb8 {
            r: 60,
            g: 180,
            b: 90,
        };
        io::write(&path, &Image::filled(16, 16, green)).unwrap();
        let mut jpeg = std::fs::read(&path).unwrap();
        let length = (data.len() as u16 + 2).to_be_bytes();
        jpeg.splice(2..2, [&[0xff, marker][..], &length, data].concat());
        std::fs::write(&path, jpeg).unwrap();
        io::read::<LinearRgb>(&path).unwrap()[(8, 8)]
    }

    /// EXIF data of a camera that was set to Adobe RGB.
    fn noted_adobe_rgb() -> Vec<u8> {
        let field = |tag, value| Field {
            tag,
            ifd_num: In::PRIMARY,
            value,
        };
        let space = field(Tag::ColorSpace, Value::Short(vec![65_535]));
        let index = Value::Ascii(vec![b"R03".to_vec()]);
        let index = field(Tag::InteroperabilityIndex, index);
        let (mut writer, mut notes) = (Writer::new(), std::io::Cursor::new(Vec::new()));
        writer.push_field(&space);
        writer.push_field(&index);
        writer.write(&mut notes, false).unwrap();
        [&b"Exif\0\0"[..], notes.get_ref()].concat()
    }

    #[test]
    fn a_camera_s_adobe_rgb_is_that_of_the_profile() {
        let icc = ColorProfile::new_adobe_rgb().encode().unwrap();
        let profile = [&b"ICC_PROFILE\0\x01\x01"[..], &icc].concat();
        let [noted, profiled] = [light(APP1, &noted_adobe_rgb()), light(APP2, &profile)];
        let apart = |other: LinearRgb| {
            let [r, g, b] = [noted.r - other.r, noted.g - other.g, noted.b - other.b];
            r.abs().max(g.abs()).max(b.abs())
        };
        assert!(apart(profiled) < 1e-3, "{noted:?}, expected {profiled:?}");
        assert!(apart(light(APP1, b"nothing")) > 0.02, "{noted:?}");
    }
}
