//! A decoded picture whose pixels are made when they are asked for.

use super::format::{Format, Source};
use super::limits::{Limits, affordable};
use super::profile::Profile;
use super::raster::{Fit, FromFile, Opaque, Raster, Refusal, Wanted};
use super::{ReadOptions, camera_notes, caught, raster_of};
use crate::{Error, Image, Result};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A picture in the samples of its file: a byte for each channel of a pixel in most.
///
/// For what looks at large pictures part by part; [`read`](super::read) gives all pixels at once.
#[derive(Debug)]
pub struct Picture {
    path: PathBuf,
    format: Format,
    raster: Raster,
    profile: Option<Profile>,
}

impl Picture {
    /// Reads a picture of colours, with the default [`ReadOptions`].
    ///
    /// # Errors
    /// [`Error::File`] as [`read`](super::read).
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let picture = Self::decode(path.as_ref(), &ReadOptions::default(), Wanted::Color)?;
        Wanted::Color
            .pick(&picture.raster.names)
            .map_err(|e| Error::file(&picture.path, e))?;
        Ok(picture)
    }

    pub(super) fn decode(path: &Path, options: &ReadOptions, wanted: Wanted) -> Result<Self> {
        let source = Source::open(path, &options.limits)?;
        Self::of(
            raster_of(&source, options, wanted),
            &source,
            &options.limits,
            wanted,
        )
    }

    /// Says what samples mean, and turns the picture the way the camera was held.
    pub(super) fn of(
        raster: std::result::Result<Raster, Refusal>,
        source: &Source,
        limits: &Limits,
        wanted: Wanted,
    ) -> Result<Self> {
        let raster = raster.map_err(|e| Error::file(&source.path, e))?;
        let profile = match wanted {
            Wanted::Color | Wanted::Film => profile_of(&raster, source, limits),
            Wanted::Coverage | Wanted::Depth => None,
        };
        warn_of_samples(&raster, source, wanted);
        let raster = raster.upright(camera_notes(source).orientation);
        Ok(Self {
            path: source.path.clone(),
            format: source.format,
            raster,
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

    /// Its colours have alpha.
    pub fn has_alpha(&self) -> bool {
        Wanted::Color
            .pick(&self.raster.names)
            .is_ok_and(|picked| picked.len() > 3)
    }

    /// The colours of some rows, as [`read`](super::read) makes them; of `LinearRgb`, without a look at alpha.
    ///
    /// # Panics
    /// When the rows reach outside the picture, or the pixels asked for are no colours.
    pub fn rows<P: FromFile>(&self, rows: Range<usize>) -> Image<P> {
        assert_eq!(P::WANTED, Wanted::Color, "pixels that are no colours");
        self.raster
            .pixels(self.profile.as_ref(), rows)
            .expect("colours were found when the picture was read")
    }

    /// All colours, as [`read`](super::read) makes them.
    ///
    /// # Errors
    /// [`Error::File`] for a picture with alpha below 1 where `LinearRgb` is asked for.
    ///
    /// # Panics
    /// When the pixels asked for are no colours.
    pub fn pixels<P: FromFile>(&self) -> Result<Image<P>> {
        let rows = 0..self.raster.height;
        P::check(&Opaque {
            raster: &self.raster,
            profile: self.profile.as_ref(),
            rows: rows.clone(),
        })
        .map_err(|e| Error::file(&self.path, e))?;
        Ok(self.rows(rows))
    }

    pub(super) fn into_image<P: FromFile>(self) -> Result<Image<P>> {
        let Self {
            path,
            raster,
            profile,
            ..
        } = self;
        let bytes = [raster.height, size_of::<P>()]
            .into_iter()
            .fold(raster.width as u64, |n, m| n.saturating_mul(m as u64));
        affordable(bytes)
            .and_then(|()| raster.into_image(profile.as_ref()))
            .map_err(|e| Error::file(path, e))
    }
}

/// The colour profile of display codes, where there is one other than sRGB.
fn profile_of(raster: &Raster, source: &Source, limits: &Limits) -> Option<Profile> {
    let path = source.path.display();
    match caught(|| Ok(Profile::of_file(source, limits)?)) {
        Ok(Some(_)) if !raster.display_encoded => {
            log::warn!(
                "{path}: has a colour profile, but float samples; taken for linear Rec. 709"
            );
            None
        }
        Ok(profile) => profile,
        Err(e) => {
            log::warn!("{path}: has {e}; taken for sRGB");
            None
        }
    }
}

/// What a person should know of the samples that were taken.
fn warn_of_samples(raster: &Raster, source: &Source, wanted: Wanted) {
    let path = source.path.display();
    // Endless depth is where nothing is.
    let wild = if wanted == Wanted::Depth {
        0
    } else {
        raster.not_finite()
    };
    if wild > 0 {
        log::warn!("{path}: {wild} samples are infinite or no number");
    }
    match wanted.choose(&raster.names) {
        Ok((Fit::Layer, _)) => {
            log::warn!("{path}: the channels {} are taken", raster.names.join(" "))
        }
        Ok((Fit::Alone, _)) => {
            log::warn!("{path}: the channel {} is taken for grey", raster.names[0])
        }
        _ => {}
    }
}
