//! `petcomp matte film`, `triangulate`: film from one photo, or from several on different screens.

use super::picture_files::{canvas_of, check_same_size, is_exr, write_optional};
use crate::diagnostics::report_diagnostics;
use crate::global::GlobalArgs;
use anyhow::Result;
use petcomp::io::{self, Canvas, Override, from_overrides};
use petcomp::matte::{
    FilmMatte, FilmOptions, PlateOptions, ScreenPlate, SegmentOptions, TriangulateOptions,
    Triangulated, film, film_planes, segment, triangulate,
};
use petcomp::{Coverage, Error, Film, Image, LinearRgb};
use std::path::{Path, PathBuf};

/// Inputs and outputs of both commands.
#[derive(clap::Args)]
pub(crate) struct FilmOptionArgs {
    /// Film to write, an EXR: R G B A (the object alone), transmittance TR TG TB (as measured) and
    /// VR VG VB (along the line of sight)
    #[arg(short, long, value_name = "EXR")]
    output: PathBuf,
    /// Photo of the empty screen, one for each photo; by default the screen is fitted around the
    /// object
    #[arg(long = "plate", value_name = "PHOTO")]
    plates: Vec<PathBuf>,
    /// Coverage of the object in the (first) photo; by default it is detected
    #[arg(long, value_name = "PICTURE")]
    mask: Option<PathBuf>,
    /// Screen plate (of the first photo) to write
    #[arg(long, value_name = "FILE")]
    plate_out: Option<PathBuf>,
    /// Image of the expected transmittance error to write
    #[arg(long, value_name = "FILE")]
    uncertainty: Option<PathBuf>,
    /// Option, such as film.clipped=0.9
    #[arg(long = "set", value_name = "film.NAME=VALUE")]
    settings: Vec<Override>,
}

#[derive(clap::Args)]
pub(crate) struct FilmArgs {
    /// Photo of one object on a coloured screen
    photo: PathBuf,
    #[command(flatten)]
    options: FilmOptionArgs,
}

#[derive(clap::Args)]
#[command(mut_arg("settings", |arg| arg.help("Option, such as film.max_sigma=0.1")))]
pub(crate) struct TriangulateArgs {
    /// Photos of one stationary object, each on a different screen, with exposure and white balance
    /// locked
    #[arg(required = true, num_args = 2..)]
    photos: Vec<PathBuf>,
    #[command(flatten)]
    options: FilmOptionArgs,
}

impl FilmArgs {
    pub(crate) fn run(&self, global: &GlobalArgs) -> Result<()> {
        let args = &self.options;
        args.check(std::slice::from_ref(&self.photo))?;
        let photo: Image<LinearRgb> = io::read(&self.photo)?;
        let inside = args.object_mask(&self.photo, &photo)?;
        let plate = args.screen_plate(0, &self.photo, &photo, &inside)?;
        let found = self.solve(&photo, &plate, &inside)?;
        let canvas = canvas_of(&self.photo)?;
        args.write_film(&found.film, &found.transmittance, canvas)?;
        args.write_extras(&plate, &found.uncertainty, canvas)?;
        global.print_written(&args.output, describe_plate(&plate, found.flat));
        Ok(())
    }

    fn solve(
        &self,
        photo: &Image<LinearRgb>,
        plate: &ScreenPlate,
        inside: &Image<Coverage>,
    ) -> Result<FilmMatte> {
        let options: FilmOptions = from_overrides("film", &self.options.settings)?;
        options.check().map_err(|e| e.within("film"))?;
        let found = film(photo, plate, inside, &options);
        let found = found.map_err(|e| self.options.of_mask(e).in_file(&self.photo))?;
        report_diagnostics(self.photo.display(), &found.diagnostics);
        Ok(found)
    }
}

impl TriangulateArgs {
    pub(crate) fn run(&self, global: &GlobalArgs) -> Result<()> {
        let args = &self.options;
        args.check(&self.photos)?;
        let photos = self.read_photos()?;
        let inside = args.object_mask(&self.photos[0], &photos[0])?;
        let plates = self.screen_plates(&photos, &inside)?;
        let found = self.triangulate(&photos, &plates, &inside)?;
        let canvas = canvas_of(&self.photos[0])?;
        args.write_film(&found.film, &found.transmittance, canvas)?;
        args.write_extras(&plates[0], &found.uncertainty, canvas)?;
        let what = describe_plate(&plates[0], found.flat);
        global.print_written(
            &args.output,
            format_args!("{what}; residual {:.4}", found.residual),
        );
        Ok(())
    }

    /// Photos of equal size.
    fn read_photos(&self) -> Result<Vec<Image<LinearRgb>>> {
        let photos: petcomp::Result<Vec<Image<LinearRgb>>> =
            self.photos.iter().map(io::read).collect();
        let photos = photos?;
        for (path, photo) in self.photos.iter().zip(&photos) {
            let first = photos[0].size();
            check_same_size(path.display(), photo.size(), &self.photos[0], first)?;
        }
        Ok(photos)
    }

    fn triangulate(
        &self,
        photos: &[Image<LinearRgb>],
        plates: &[ScreenPlate],
        inside: &Image<Coverage>,
    ) -> Result<Triangulated> {
        let shots: Vec<_> = photos.iter().zip(plates).collect();
        let options: TriangulateOptions = from_overrides("film", &self.options.settings)?;
        options.check().map_err(|e| e.within("film"))?;
        let found = triangulate(&shots, inside, &options).map_err(|e| self.options.of_mask(e))?;
        report_diagnostics(self.photos[0].display(), &found.diagnostics);
        Ok(found)
    }

    fn screen_plates(
        &self,
        photos: &[Image<LinearRgb>],
        inside: &Image<Coverage>,
    ) -> Result<Vec<ScreenPlate>> {
        let each = self.photos.iter().zip(photos).enumerate();
        each.map(|(i, (path, photo))| self.options.screen_plate(i, path, photo, inside))
            .collect()
    }
}

impl FilmOptionArgs {
    /// Checks that the output is an EXR, since no other format holds the channels of film, that
    /// plates are given for all photos or none, and that no input is overwritten.
    fn check(&self, photos: &[PathBuf]) -> Result<()> {
        anyhow::ensure!(
            is_exr(&self.output),
            "{}: film needs the extension .exr",
            self.output.display()
        );
        let inputs = photos.iter().chain(&self.plates).chain(&self.mask);
        let extras = self.plate_out.iter().chain(&self.uncertainty);
        io::check_distinct(inputs, extras.chain([&self.output]))?;
        let (plates, photos) = (self.plates.len(), photos.len());
        anyhow::ensure!(
            plates == 0 || plates == photos,
            "--plate: {plates} given, expected {photos}, one for each photo"
        );
        Ok(())
    }

    /// The given mask, or that of the detected object.
    fn object_mask(&self, path: &Path, photo: &Image<LinearRgb>) -> Result<Image<Coverage>> {
        if let Some(file) = &self.mask {
            let mask: Image<Coverage> = io::read(file)?;
            check_same_size(file.display(), mask.size(), path, photo.size())?;
            return Ok(mask);
        }
        let found = segment(photo, &SegmentOptions::default()).map_err(|e| e.in_file(path))?;
        report_diagnostics(path.display(), &found.diagnostics);
        Ok(found.tight)
    }

    /// An error about the mask names its file.
    fn of_mask(&self, error: Error) -> Error {
        match (error, &self.mask) {
            (Error::Value { at, what }, Some(file)) if at == "mask" => Error::file(file, what),
            (other, _) => other,
        }
    }

    /// From the photo of the empty screen or, without one, fitted around the object.
    fn screen_plate(
        &self,
        i: usize,
        path: &Path,
        photo: &Image<LinearRgb>,
        inside: &Image<Coverage>,
    ) -> Result<ScreenPlate> {
        let options = PlateOptions::default();
        let plate = match self.plates.get(i) {
            Some(file) => {
                let empty = io::read(file)?;
                check_same_size(file.display(), empty.size(), path, photo.size())?;
                ScreenPlate::from_photo_outside(&empty, photo, inside, &options)
            }
            None => ScreenPlate::fit_outside(photo, inside, &options),
        };
        Ok(plate.map_err(|e| e.in_file(path))?)
    }

    fn write_film(
        &self,
        film: &Image<Film>,
        transmittance: &Image<LinearRgb>,
        canvas: Canvas,
    ) -> Result<()> {
        let planes = film_planes(film, transmittance);
        io::exr::write_channels(&self.output, film.size(), canvas, planes, &[])?;
        Ok(())
    }

    fn write_extras(
        &self,
        plate: &ScreenPlate,
        uncertainty: &Image<f32>,
        canvas: Canvas,
    ) -> Result<()> {
        write_optional(&self.plate_out, &plate.image, canvas)?;
        write_optional(&self.uncertainty, uncertainty, canvas)
    }
}

/// The screen and the plastic in a few words.
fn describe_plate(plate: &ScreenPlate, flat: LinearRgb) -> String {
    let (screen, uneven) = (plate_source(plate), 100.0 * plate.unevenness);
    format!(
        "screen {screen}, {uneven:.0} % uneven; flat plastic transmits {:.2} {:.2} {:.2}",
        flat.r, flat.g, flat.b
    )
}

fn plate_source(plate: &ScreenPlate) -> String {
    match plate.degree {
        Some(degree) => format!("fitted with degree {degree}"),
        None => "photographed".into(),
    }
}
