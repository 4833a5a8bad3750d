//! `petcomp matte film`, `triangulate`: film from one photo, or from several on different screens.

use super::picture::write_some;
use crate::common::{Common, report_diagnostics};
use anyhow::Result;
use petcomp::io::{self, Override, from_overrides};
use petcomp::matte::{
    PlateOptions, ScreenPlate, SegmentOptions, film, film_planes, segment, triangulate,
};
use petcomp::{Coverage, Film as FilmPixel, Image, LinearRgb};
use std::path::{Path, PathBuf};

/// What both commands ask and write.
#[derive(clap::Args)]
pub(crate) struct Files {
    /// Film to write, an EXR: R G B A as seen alone, TR TG TB as measured, VR VG VB along the line of sight
    #[arg(short, long, value_name = "EXR")]
    output: PathBuf,
    /// Photo of the empty screen, one for each photo; without, the screen is fitted around the object
    #[arg(long = "plate", value_name = "PHOTO")]
    plates: Vec<PathBuf>,
    /// Coverage of the object in the (first) photo; without, it is searched for
    #[arg(long, value_name = "PICTURE")]
    mask: Option<PathBuf>,
    /// Where the screen plate (of the first photo) goes
    #[arg(long, value_name = "FILE")]
    plate_out: Option<PathBuf>,
    /// Where the expected error of the transmittance goes
    #[arg(long, value_name = "FILE")]
    uncertainty: Option<PathBuf>,
    /// An option, such as film.clipped=0.9
    #[arg(long = "set", value_name = "film.NAME=VALUE")]
    settings: Vec<Override>,
}

#[derive(clap::Args)]
pub(crate) struct Film {
    /// Photo of one object on a coloured screen
    photo: PathBuf,
    #[command(flatten)]
    files: Files,
}

#[derive(clap::Args)]
pub(crate) struct Triangulate {
    /// Photos of one object that stays where it is, each on another screen
    #[arg(required = true, num_args = 2..)]
    photos: Vec<PathBuf>,
    #[command(flatten)]
    files: Files,
}

impl Film {
    pub(crate) fn run(&self, common: &Common) -> Result<()> {
        let photo: Image<LinearRgb> = io::read(&self.photo)?;
        let inside = self.files.inside(&self.photo, &photo)?;
        let plate = self.files.plate(0, &self.photo, &photo, &inside)?;
        let options = from_overrides("film", &self.files.settings)?;
        let found = film(&photo, &plate, &inside, &options).map_err(|e| e.in_file(&self.photo))?;
        report_diagnostics(&self.photo, &found.diagnostics);
        self.files.write(
            &plate,
            &found.film,
            &found.transmittance,
            &found.uncertainty,
        )?;
        common.say(format_args!(
            "{}: {}",
            self.files.output.display(),
            summary(&plate, found.flat)
        ));
        Ok(())
    }
}

impl Triangulate {
    pub(crate) fn run(&self, common: &Common) -> Result<()> {
        let photos: Vec<Image<LinearRgb>> =
            self.photos.iter().map(io::read).collect::<Result<_, _>>()?;
        let inside = self.files.inside(&self.photos[0], &photos[0])?;
        let plates = self.plates(&photos, &inside)?;
        let shots: Vec<_> = photos.iter().zip(&plates).collect();
        let options = from_overrides("film", &self.files.settings)?;
        let found = triangulate(&shots, &inside, &options)?;
        report_diagnostics(&self.photos[0], &found.diagnostics);
        self.files.write(
            &plates[0],
            &found.film,
            &found.transmittance,
            &found.uncertainty,
        )?;
        let residual = found.residual;
        common.say(format_args!(
            "{}: {}; residual {residual:.4}",
            self.files.output.display(),
            summary(&plates[0], found.flat)
        ));
        Ok(())
    }
}

impl Triangulate {
    fn plates(
        &self,
        photos: &[Image<LinearRgb>],
        inside: &Image<Coverage>,
    ) -> Result<Vec<ScreenPlate>> {
        let each = self.photos.iter().zip(photos).enumerate();
        each.map(|(i, (path, photo))| self.files.plate(i, path, photo, inside))
            .collect()
    }
}

impl Files {
    fn inside(&self, path: &Path, photo: &Image<LinearRgb>) -> Result<Image<Coverage>> {
        if let Some(mask) = &self.mask {
            let mask: Image<Coverage> = io::read(mask)?;
            let ((w, h), (width, height)) = (mask.size(), photo.size());
            anyhow::ensure!(
                [w, h] == [width, height],
                "--mask: {w} x {h} pixels, expected {width} x {height} as the photo"
            );
            return Ok(mask);
        }
        let found = segment(photo, &SegmentOptions::default()).map_err(|e| e.in_file(path))?;
        report_diagnostics(path, &found.diagnostics);
        Ok(found.tight)
    }

    fn plate(
        &self,
        i: usize,
        path: &Path,
        photo: &Image<LinearRgb>,
        inside: &Image<Coverage>,
    ) -> Result<ScreenPlate> {
        let options = PlateOptions::default();
        let plate = match self.plates.get(i) {
            Some(empty) => {
                ScreenPlate::from_photo_outside(&io::read(empty)?, photo, inside, &options)
            }
            None => ScreenPlate::fit_outside(photo, inside, &options),
        };
        Ok(plate.map_err(|e| e.in_file(path))?)
    }

    fn write(
        &self,
        plate: &ScreenPlate,
        film: &Image<FilmPixel>,
        transmittance: &Image<LinearRgb>,
        uncertainty: &Image<f32>,
    ) -> Result<()> {
        let planes = film_planes(film, transmittance);
        let planes: Vec<(&str, &[f32])> = planes
            .iter()
            .map(|(name, plane)| (*name, &plane[..]))
            .collect();
        io::exr::write_channels(&self.output, film.size(), &planes, &[])?;
        write_some(&self.plate_out, &plate.image)?;
        write_some(&self.uncertainty, uncertainty)
    }
}

/// The screen and the plastic in a few words.
fn summary(plate: &ScreenPlate, flat: LinearRgb) -> String {
    let fitted = plate.degree.map_or("photographed".into(), |degree| {
        format!("fitted by degree {degree}")
    });
    let uneven = 100.0 * plate.unevenness;
    format!(
        "screen {fitted}, {uneven:.0} % uneven; flat plastic lets through {:.2} {:.2} {:.2}",
        flat.r, flat.g, flat.b
    )
}
