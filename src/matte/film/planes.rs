//! Film as the named channels of a file.

use crate::image::Image;
use crate::io::{TRANSMITTANCE, VIEW_TRANSMITTANCE};
use crate::pixel::{Film, LinearRgb};

/// The channels that a film is kept in: `R G B` the reflected light F, `A` its mean opacity along
/// the line of sight (together premultiplied RGBA for programs that know no film), `TR TG TB` the
/// transmittance as measured with the object's own shadow, `VR VG VB` that of the line of sight
/// alone.
///
/// `film` is F with opacity `1 - V`, `transmittance` is T; samples lie row by row from the top.
///
/// # Panics
/// When the sizes differ.
pub fn film_planes(
    film: &Image<Film>,
    transmittance: &Image<LinearRgb>,
) -> Vec<(&'static str, Vec<f32>)> {
    assert_eq!(
        film.size(),
        transmittance.size(),
        "film and transmittance differ in size"
    );
    let alpha = film.pixels().iter().map(|f| f.to_rgba().a).collect();
    let color = named(["R", "G", "B"], channels(film, |f| f.color));
    let measured = named(TRANSMITTANCE, channels(transmittance, |t| t));
    let seen = named(VIEW_TRANSMITTANCE, channels(film, Film::transmittance));
    color
        .chain([("A", alpha)])
        .chain(measured)
        .chain(seen)
        .collect()
}

fn named(
    names: [&'static str; 3],
    channels: [Vec<f32>; 3],
) -> impl Iterator<Item = (&'static str, Vec<f32>)> {
    names.into_iter().zip(channels)
}

/// The three channels of a colour of every pixel.
fn channels<P: Copy>(image: &Image<P>, color: impl Fn(P) -> LinearRgb) -> [Vec<f32>; 3] {
    [0, 1, 2].map(|c| {
        let pixels = image.pixels().iter();
        pixels.map(|p| color(*p).channels()[c]).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io;

    #[test]
    fn a_file_of_the_planes_is_read_as_film_that_is_seen_through_by_v() {
        let film = Film::new(
            LinearRgb::new(0.1, 0.2, 0.3),
            LinearRgb::new(0.75, 0.5, 0.25),
        );
        let planes = film_planes(
            &Image::filled(3, 2, film),
            &Image::filled(3, 2, LinearRgb::grey(0.4)),
        );
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("film.exr");
        io::exr::write_channels(&path, (3, 2), io::Canvas::default(), planes, &[]).unwrap();
        assert_eq!(io::read::<Film>(&path).unwrap(), Image::filled(3, 2, film));
        assert_eq!(
            io::read::<crate::PremulRgba>(&path).unwrap()[(1, 1)],
            film.to_rgba()
        );
    }
}
