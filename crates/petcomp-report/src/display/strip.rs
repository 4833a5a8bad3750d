//! Reality next to the result of each method, and the differences; blank if a method refuses.

use super::Reality;
use super::method::{DisplayMethod, SeenFilm};
use petcomp::color::encode_srgb8;
use petcomp::{Image, LinearRgb, Result, Srgb8};

/// Factor on differences.
const GAIN: f32 = 4.0;
/// Pixels between pictures.
const GAP_PX: usize = 4;

/// Two rows: reality and the methods over background `k`; below each method its difference, times
/// four.
pub(super) fn strip(
    reality: &Reality,
    k: usize,
    run: impl Fn(DisplayMethod) -> Result<SeenFilm>,
) -> Image<Srgb8> {
    let inside = |image: &Image<LinearRgb>| {
        image.zip_map(&reality.inside, |p, inside| if inside { p } else { PAPER })
    };
    let seen = inside(&reality.seen[k]);
    let mut columns = vec![[seen.clone(), seen.map(|_| PAPER)]];
    for method in DisplayMethod::ALL {
        let column = match run(method) {
            Ok(found) => {
                let made = inside(&reality.composite(&found, k));
                let off = made.zip_map(&seen, difference);
                [made, inside(&off)]
            }
            Err(_) => [seen.map(|_| PAPER), seen.map(|_| PAPER)],
        };
        columns.push(column);
    }
    laid_out(&columns).map(encode_srgb8)
}

const PAPER: LinearRgb = LinearRgb::new(1.0, 1.0, 1.0);

fn difference(a: LinearRgb, b: LinearRgb) -> LinearRgb {
    let (a, b) = (a.channels(), b.channels());
    LinearRgb::from([0, 1, 2].map(|c: usize| (GAIN * (a[c] - b[c]).abs()).min(1.0)))
}

fn laid_out(columns: &[[Image<LinearRgb>; 2]]) -> Image<LinearRgb> {
    let (w, h) = columns[0][0].size();
    let (across, down) = (w + GAP_PX, h + GAP_PX);
    Image::from_fn(columns.len() * across, 2 * down, |x, y| {
        let picture = &columns[x / across][y / down];
        let (x, y) = (x % across, y % down);
        if x < w && y < h {
            picture[(x, y)]
        } else {
            PAPER
        }
    })
}
