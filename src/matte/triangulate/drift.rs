//! Exposure and white balance that differ between photos, by the light that the object reflects.

use super::lines::PixelFilm;
use crate::bounds::above;
use crate::diagnostic::{Code, Diagnostic};
use crate::image::Image;
use crate::matte::arrays::channel_pairs;
use crate::matte::film::OPAQUE;
use crate::pixel::{Coverage, LinearRgb};

/// Least reflected light of a channel that tells of its exposure: labels, caps, glints. What the
/// film of an open channel is off, times what the screens differ there, is far less.
const MIN_REFLECTED: f64 = 0.05;
/// So many pixels of that light are assumed not to differ: a few that do are noise.
const PRIOR_PIXELS: f64 = 100.0;
/// Reflected light that differs by more than this share between two photos, or more, gives a
/// warning. In JPEGs of rendered bottles it was up to 0.018 on two screens without drift, and 0.056
/// and more in 21 of 24 at 7 % more exposure, with an error of 0.08 in red; on three, with light of
/// the screens that the object reflects, up to 0.05 without drift, and 0.17 to 0.22 at 0.3 EV.
const MAX_DRIFT: [f32; 2] = [0.055, 0.08];

/// What a film leaves over of a photo on its screen, as a share of the light that it reflects, per
/// channel: least squares.
pub(super) fn unexplained_share(
    [photo, screen]: [&Image<LinearRgb>; 2],
    film: &Image<PixelFilm>,
    inside: &Image<Coverage>,
) -> [f32; 3] {
    let (mut top, mut bottom) = ([0.0; 3], [PRIOR_PIXELS * MIN_REFLECTED.powi(2); 3]);
    let pixels = photo.pixels().iter().zip(screen.pixels());
    let covered = film.pixels().iter().zip(inside.pixels());
    for ((photo, screen), (film, _)) in pixels.zip(covered).filter(|(_, (_, c))| c.0 >= OPAQUE) {
        let unexplained = channel_pairs(*photo, film.over(*screen)).map(|(p, f)| f64::from(p - f));
        let reflected = film.reflected.channels().map(f64::from);
        for c in (0..3).filter(|&c| reflected[c] >= MIN_REFLECTED) {
            top[c] += unexplained[c] * reflected[c];
            bottom[c] += reflected[c] * reflected[c];
        }
    }
    [0, 1, 2].map(|c| (top[c] / bottom[c]) as f32)
}

/// The warning about photos whose unexplained shares differ. A channel that the film explains in
/// any case has none, so that the drift is at least what is told; in an open one the dye was
/// inferred, and may be another.
pub(super) fn warning(shares: &[[f32; 3]], determined: [bool; 3]) -> Option<Diagnostic> {
    let drift = [0, 1, 2]
        .map(|c| spread(shares.iter().map(|share| share[c])))
        .into_iter()
        .fold(0.0, f32::max);
    let most = MAX_DRIFT[usize::from(shares.len() > 2)];
    (drift > most).then(|| drifted([drift, most], determined != [true; 3]))
}

/// Distance of the least from the greatest of some values.
fn spread(values: impl Iterator<Item = f32>) -> f32 {
    let (low, high) = values.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    high - low
}

fn drifted([drift, most]: [f32; 2], is_dye_inferred: bool) -> Diagnostic {
    let cause = match is_dye_inferred {
        true => {
            "exposure or white balance changed, or the dye is not a PET dye; lock both, or add a third screen colour"
        }
        false => "exposure or white balance changed; lock both",
    };
    Diagnostic::warning(
        Code::MatteExposureDrift,
        format_args!(
            "the light that the object reflects differs by {} % or more between the photos, expected at most {:.1} %, \
             and the transmittance is wrong: {cause}, and photograph again",
            above(100.0 * drift, 100.0 * most),
            100.0 * most
        ),
    )
}
