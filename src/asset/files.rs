//! The files of one cut-out: film and thumbnail.

use super::thumbnail::thumbnail;
use crate::error::{Error, Result};
use crate::geom::Point2;
use crate::image::Image;
use crate::io;
use crate::pixel::{Film, LinearRgb};
use crate::stopwatch::Stopwatch;
use half::f16;
use std::io::ErrorKind;
use std::path::Path;

/// Writes film (`.exr`) and thumbnail (`.png`) under one name, and returns the film as it will be
/// read back.
///
/// The EXR holds half floats, zip-compressed: `R G B` is the object's own light F, `A` the mean
/// opacity along the line of sight (together: premultiplied RGBA for programs that know no film),
/// `TR TG TB` the transmittance as measured, the object's own shadow included, and `VR VG VB` that
/// of the line of sight alone.
pub(super) fn write(
    path: &Path,
    film: &Image<Film>,
    transmittance: &Image<LinearRgb>,
) -> Result<Image<Film>> {
    let mut watch = Stopwatch::start();
    let channels = channels(film, transmittance);
    watch.lap("planes");
    write_film(path, film.size(), &channels)?;
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

fn write_film(path: &Path, size: (usize, usize), channels: &[NamedPlane]) -> Result<()> {
    let channels: Vec<(&str, &[f32])> = channels
        .iter()
        .map(|(name, samples)| (*name, samples.as_slice()))
        .collect();
    io::exr::write_half_channels(path, size, &channels, &[])
}

/// A channel's name and samples.
type NamedPlane = (&'static str, Vec<f32>);

/// The channels of a cut-out's file; see [`write`].
fn channels(film: &Image<Film>, transmittance: &Image<LinearRgb>) -> Vec<NamedPlane> {
    let alpha = film.pixels().iter().map(|f| f.to_rgba().a).collect();
    let mut channels = Vec::from(rgb_planes(["R", "G", "B"], film, |f| f.color));
    channels.push(("A", alpha));
    channels.extend(rgb_planes(["TR", "TG", "TB"], transmittance, |t| *t));
    channels.extend(rgb_planes(["VR", "VG", "VB"], film, |f| f.transmittance()));
    channels
}

fn rgb_planes<P: Copy>(
    names: [&'static str; 3],
    image: &Image<P>,
    color: impl Fn(&P) -> LinearRgb,
) -> [NamedPlane; 3] {
    std::array::from_fn(|c| {
        let pixels = image.pixels().iter();
        let plane = pixels.map(|p| <[f32; 3]>::from(color(p))[c]).collect();
        (names[c], plane)
    })
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
/// [`Error::File`] for one that cannot be deleted.
pub(super) fn remove(folder: &Path, cut_out: &str) -> Result<()> {
    let mut paths = all_of(cut_out).into_iter().map(|file| folder.join(file));
    paths.try_for_each(|path| match std::fs::remove_file(&path) {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(Error::file(path, e)),
        _ => Ok(()),
    })
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
        let color = rgb_planes(["R", "G", "B"], &film, |f| f.color);
        let seen = rgb_planes(["VR", "VG", "VB"], &film, |f| f.transmittance());
        let planes = [color, seen].concat();
        let channels: Vec<_> = planes.iter().map(|(n, v)| (*n, v.as_slice())).collect();
        io::exr::write_half_channels(&path, film.size(), &channels, &[]).unwrap();
        assert_eq!(io::read::<Film>(&path).unwrap(), film.map(as_stored));
    }
}
