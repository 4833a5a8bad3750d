//! What was cut out with an object and hangs together with it by bare screen alone.

use super::ObjectRegion;
use crate::diagnostic::{Code, Diagnostic};
use crate::image::{Image, Mask};
use crate::matte::segment::PixelGroups;
use crate::pixel::Film;
use std::cmp::Reverse;

/// Film that is less opaque than this may be bare screen.
const MIN_OPACITY: f32 = 0.08;
/// A separate piece of the cut-out is worth a warning from this share of it on. On 48 rendered photos
/// of bottles alone the largest has 0.0014; of 96 with a coin, a label or tape beside the bottle 74
/// are told.
const MIN_PIECE_SHARE: f64 = 0.003;

/// The warning about the largest piece of a cut-out beside its main one, which bare screen separates
/// from it: a coin, a label, tape. None where there is no such piece, and where a person says that it
/// is the object. `photo` is the size of the photo.
pub(super) fn separate_piece(
    film: &Image<Film>,
    region: &ObjectRegion,
    photo: (usize, usize),
) -> Option<Diagnostic> {
    let opaque = film.map(|f| f.to_rgba().a > MIN_OPACITY);
    let pieces = PixelGroups::new(&opaque);
    let sizes = pieces.sizes(&opaque);
    let mut by_size: Vec<usize> = (0..sizes.len()).collect();
    by_size.sort_by_key(|&i| Reverse(sizes[i]));
    let second = *by_size.get(1)?;
    let share = sizes[second] as f64 / opaque.count() as f64;
    if share < MIN_PIECE_SHARE {
        return None;
    }
    let piece = pieces.only(|i| i == second);
    (!is_claimed(&piece, region)).then(|| warning(share, middle(&piece, region, photo)))
}

/// A person says that some of it is the object.
fn is_claimed(piece: &Mask, region: &ObjectRegion) -> bool {
    region.drawn.as_ref().is_some_and(|claims| {
        let mut pixels = claims.pixels().iter().zip(piece.pixels());
        pixels.any(|(claim, is_piece)| *is_piece && *claim == Some(true))
    })
}

/// The middle of a piece as percentages of the photo's width and height.
fn middle(piece: &Mask, region: &ObjectRegion, photo: (usize, usize)) -> [f64; 2] {
    let (w, h) = piece.size();
    let places = (0..w * h).filter(|&i| piece.pixels()[i]);
    let [x, y] = places.fold([0.0, 0.0], |[x, y], i| {
        [x + (i % w) as f64 + 0.5, y + (i / w) as f64 + 0.5]
    });
    let count = piece.count() as f64;
    let at = [
        x / count + region.around.x as f64,
        y / count + region.around.y as f64,
    ];
    [
        100.0 * at[0] / photo.0 as f64,
        100.0 * at[1] / photo.1 as f64,
    ]
}

fn warning(share: f64, [x, y]: [f64; 2]) -> Diagnostic {
    Diagnostic::warning(
        Code::TwoObjects,
        format_args!(
            "possibly two objects: bare screen separates {:.1} % of the cut-out from the rest, at {x:.0} % of the width and {y:.0} % of the height; remove what is there",
            100.0 * share
        ),
    )
}
