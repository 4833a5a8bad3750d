//! The files of one cut-out: film and thumbnail.

use super::thumbnail::thumbnail;
use crate::error::Result;
use crate::geom::Point2;
use crate::image::Image;
use crate::io;
use crate::matte::film_planes;
use crate::pixel::{Film, LinearRgb};
use crate::stopwatch::Stopwatch;
use half::f16;
use std::path::Path;

/// Writes film (`.exr`) and thumbnail (`.png`) under one name, and returns the film as it will be
/// read back.
///
/// The EXR holds [`film_planes`] as half floats, zip-compressed.
pub(super) fn write(
    path: &Path,
    film: &Image<Film>,
    transmittance: &Image<LinearRgb>,
) -> Result<Image<Film>> {
    let mut watch = Stopwatch::start();
    let planes = film_planes(film, transmittance);
    watch.lap("planes");
    io::exr::write_half_channels(path, film.size(), &planes)?;
    watch.lap("film");
    io::write(
        path.with_extension("png"),
        &thumbnail(&film.map(Film::to_rgba)),
    )?;
    watch.lap("thumbnail");
    let stored = film.map(as_stored);
    watch.lap("stored film");
    watch.log("write");
    Ok(stored)
}

/// A pixel as it is read back from half floats.
fn as_stored(film: Film) -> Film {
    let [color, transmittance] =
        [film.color, film.transmittance()].map(|color: LinearRgb| color.map(through_half));
    Film::new(color, transmittance)
}

/// A number as an EXR of half floats keeps it: what is too large becomes the largest.
fn through_half(value: f32) -> f32 {
    let most = f32::from(f16::MAX);
    let kept = if value.is_finite() {
        value.clamp(-most, most)
    } else {
        value
    };
    f16::from_f32(kept).to_f32()
}

/// Name of the flow of a cut-out, beside it: `bottle/one.flow.exr`.
pub(super) fn flow_file(cut_out: &str) -> String {
    let stem = cut_out.strip_suffix(".exr").unwrap_or(cut_out);
    format!("{stem}.flow.exr")
}

/// All files of a cut-out, relative to the folder; a flow is not always among them.
pub(super) fn all_of(cut_out: &str) -> [String; 3] {
    let stem = cut_out.strip_suffix(".exr").unwrap_or(cut_out);
    let thumbnail = format!("{stem}.png");
    [cut_out.to_owned(), thumbnail, flow_file(cut_out)]
}

/// Deletes the files of a cut-out that the manifest tells of no more.
///
/// # Errors
/// [`Error::File`](crate::Error::File) for one that cannot be deleted.
pub(super) fn remove(folder: &Path, cut_out: &str) -> Result<()> {
    let mut files = all_of(cut_out).into_iter();
    files.try_for_each(|file| io::remove_if_exists(&folder.join(file)))
}

/// As exact as a pixel coordinate needs to be in a file that people read.
pub(super) fn rounded(p: &Point2<f64>) -> [f64; 2] {
    [p.x, p.y].map(|px| (px * 1000.0).round() / 1000.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn film_in_memory_is_what_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let film = Image::from_fn(7, 5, |x, y| {
            let v = (x as f32 + 7.3 * y as f32) / 37.1;
            Film::new(
                LinearRgb::new(v, 1e5 * v, 1e-7 * v),
                LinearRgb::new(1.0 - 0.9 * v, 0.3, v / 3.0),
            )
        });
        let stored = write(&path, &film, &Image::filled(7, 5, LinearRgb::grey(0.4))).unwrap();
        assert_eq!(io::read::<Film>(&path).unwrap(), stored);
    }
}
