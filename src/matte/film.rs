//! Film: reflected light and transmittance of see-through plastic from one photo on a coloured screen.

use super::plate::ScreenPlate;
use super::remark::Remark;
use super::screen::strongest_channel;
use crate::error::Result;
use crate::image::Image;
use crate::pixel::{Coverage, Film, LinearRgb};
use serde::{Deserialize, Serialize};

/// How film is solved for.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FilmOptions {}

/// What one photo tells of a film.
#[derive(Clone, Debug)]
pub struct FilmMatte {
    /// Reflected light F and opacity `1 - V` by the view transmittance V: what goes over a background that is lit by
    /// itself. Of the photo's size, empty outside the object.
    pub film: Image<Film>,
    /// Transmittance T per channel as measured: the screen seen through the object and in its shadow. 1 outside.
    pub transmittance: Image<LinearRgb>,
    /// Expected error of T in each pixel, 0 to 1: where the photo does not fix it.
    pub uncertainty: Image<Coverage>,
    /// What a person should know.
    pub remarks: Vec<Remark>,
}

/// Solves `photo = F + T * plate` for the reflected light F and the transmittance T.
pub fn film(
    photo: &Image<LinearRgb>,
    plate: &ScreenPlate,
    inside: &Image<Coverage>,
    _opts: &FilmOptions,
) -> Result<FilmMatte> {
    let key = strongest_channel(plate.color());
    let transmittance = Image::from_fn(photo.width(), photo.height(), |x, y| {
        let (p, k): ([f32; 3], [f32; 3]) = (photo[(x, y)].into(), plate.image[(x, y)].into());
        let others = |c: [f32; 3]| 0.5 * (c[(key + 1) % 3] + c[(key + 2) % 3]);
        let t = ((p[key] - others(p)) / (k[key] - others(k)).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        LinearRgb::grey(1.0 - inside[(x, y)].0 * (1.0 - t))
    });
    let film = Image::from_fn(photo.width(), photo.height(), |x, y| {
        let (p, k, t) = (photo[(x, y)], plate.image[(x, y)], transmittance[(x, y)]);
        let screen = t * k;
        let color = LinearRgb::new((p.r - screen.r).max(0.0), (p.g - screen.g).max(0.0), (p.b - screen.b).max(0.0));
        Film::new(color.scale(inside[(x, y)].0), t.map(|t| t.sqrt()))
    });
    let uncertainty = Image::new(photo.width(), photo.height());
    Ok(FilmMatte { film, transmittance, uncertainty, remarks: Vec::new() })
}
