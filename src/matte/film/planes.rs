//! Film as the named channels of a file.

use crate::image::Image;
use crate::io::{TRANSMITTANCE, VIEW_TRANSMITTANCE};
use crate::pixel::{Film, LinearRgb};

/// The channels that a film is kept in: `R G B` the reflected light F, `A` its mean opacity along the line of sight (together
/// premultiplied RGBA for programs that know no film), `TR TG TB` the transmittance as measured with the object's own
/// shadow, `VR VG VB` that of the line of sight alone.
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
    let color = |of: fn(LinearRgb) -> f32| film.pixels().iter().map(|f| of(f.color)).collect();
    let view = |of: fn(LinearRgb) -> f32| {
        film.pixels()
            .iter()
            .map(|f| of(f.transmittance()))
            .collect()
    };
    let measured =
        |of: fn(LinearRgb) -> f32| transmittance.pixels().iter().map(|&t| of(t)).collect();
    vec![
        ("R", color(|c| c.r)),
        ("G", color(|c| c.g)),
        ("B", color(|c| c.b)),
        ("A", film.pixels().iter().map(|f| f.to_rgba().a).collect()),
        (TRANSMITTANCE[0], measured(|t| t.r)),
        (TRANSMITTANCE[1], measured(|t| t.g)),
        (TRANSMITTANCE[2], measured(|t| t.b)),
        (VIEW_TRANSMITTANCE[0], view(|t| t.r)),
        (VIEW_TRANSMITTANCE[1], view(|t| t.g)),
        (VIEW_TRANSMITTANCE[2], view(|t| t.b)),
    ]
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
        let planes: Vec<(&str, &[f32])> = planes
            .iter()
            .map(|(name, plane)| (*name, &plane[..]))
            .collect();
        io::exr::write_channels(&path, (3, 2), &planes, &[]).unwrap();
        assert_eq!(io::read::<Film>(&path).unwrap(), Image::filled(3, 2, film));
        assert_eq!(
            io::read::<crate::PremulRgba>(&path).unwrap()[(1, 1)],
            film.to_rgba()
        );
    }
}
