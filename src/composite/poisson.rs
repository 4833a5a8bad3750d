//! Objects blended into what is behind them.

use crate::deep::{DeepImage, DeepSample};
use crate::filter::dilate;
use crate::image::{Image, Mask};
use crate::pixel::{LinearRgb, Mix, PremulRgba};
use crate::work::{self, Kind};

/// Coverage above which a pixel is an object's: that of labels.
const COVERED: f32 = 0.1;
/// How far a difference at the outline extends into the object, pixels.
const REACH_PX: f32 = 2.0;
/// Number of reaches after which nothing of a difference is left.
const BAND_REACHES: f64 = 4.0;
/// Change of a value at which the solver stops: below an 8-bit code in the dark.
const TOLERANCE: f32 = 1e-4;
/// Maximum number of sweeps over the picture. At this reach an error falls to an eighth in sixteen
/// of them.
const MAX_SWEEPS: usize = 48;

/// Blends every visible object into what is behind it, along its outline, in a finished frame;
/// scene-linear.
///
/// # Method
/// The composite keeps the gradients of the object and takes the values of what is behind at its
/// outline ([Pérez, Gangnet and Blake 2003]). It departs from that by a screening term
/// ([Bhat et al. 2008]), so that the object keeps its own colours farther inside: a bottle does not
/// take on the tray's. The correction `c` of a pixel solves
/// `sum (c - c_q) + sum (s + c - b_q) + c / reach^2 = 0`, the first sum over neighbours of the same
/// object, the second over those behind, where `b_q` is their value and `s` the object's; by
/// Gauss-Seidel, alternately forwards and backwards, in the band where it is not 0.
///
/// [Pérez, Gangnet and Blake 2003]: https://doi.org/10.1145/882262.882269
/// [Bhat et al. 2008]: https://doi.org/10.1007/978-3-540-88688-4_9
pub(super) fn blend(frame: &Image<PremulRgba>, deep: &DeepImage) -> Image<PremulRgba> {
    work::add(Kind::Filters, 1);
    let (width, height) = frame.size();
    let top = Image::from_fn(width, height, |x, y| topmost(deep.at(x, y)));
    let band = band(&top);
    let pixels = equations(frame, &top, &band);
    let corrections = solve(&pixels, width, height);
    frame.zip_map(&corrections, corrected)
}

/// The object that is visible in a pixel and its depth; none if nothing covers the pixel; none with
/// depth 0, in front of everything, if the holdout hides the object.
fn topmost(samples: &[DeepSample]) -> (u32, f32) {
    match samples.iter().find(|sample| sample.alpha > COVERED) {
        None => (0, f32::INFINITY),
        Some(top) if top.visible > 0.0 => (top.object.0, top.depth.0),
        Some(_) => (0, 0.0),
    }
}

fn corrected(p: PremulRgba, by: LinearRgb) -> PremulRgba {
    let LinearRgb { r, g, b } = (p.color() + by).map(|v| v.max(0.0));
    PremulRgba { r, g, b, ..p }
}

/// Pixels of objects near an object's outline.
fn band(top: &Image<(u32, f32)>) -> Mask {
    let outline = Image::from_fn(top.width(), top.height(), |x, y| {
        neighbors(top, x, y).any(|(q, _)| top[q].0 != top[(x, y)].0)
    });
    let near = dilate(&outline, BAND_REACHES * f64::from(REACH_PX));
    near.zip_map(top, |near, top| near && top.0 != 0)
}

/// The up to four neighbours of a pixel, and their numbers.
fn neighbors<P: Copy>(
    image: &Image<P>,
    x: usize,
    y: usize,
) -> impl Iterator<Item = ((usize, usize), usize)> {
    let (width, height) = image.size();
    [
        (x.wrapping_sub(1), y),
        (x + 1, y),
        (x, y.wrapping_sub(1)),
        (x, y + 1),
    ]
    .into_iter()
    .filter(move |&(x, y)| x < width && y < height)
    .map(move |(x, y)| ((x, y), y * width + x))
}

/// The equation of a pixel's correction.
struct PixelEquation {
    /// Number of the pixel.
    pixel: usize,
    /// Numbers of the neighbours of the same object, `count` of them.
    same: [usize; 4],
    count: usize,
    /// Sum of the differences from the neighbours behind.
    jump: LinearRgb,
    /// Factor of its own correction.
    factor: f32,
}

fn equations(
    frame: &Image<PremulRgba>,
    top: &Image<(u32, f32)>,
    band: &Mask,
) -> Vec<PixelEquation> {
    let width = frame.width();
    let pixels = (0..width * frame.height()).filter(|&i| band.pixels()[i]);
    pixels
        .map(|i| equation(frame, top, (i % width, i / width)))
        .collect()
}

fn equation(
    frame: &Image<PremulRgba>,
    top: &Image<(u32, f32)>,
    at: (usize, usize),
) -> PixelEquation {
    let mut equation = PixelEquation::new(at.1 * frame.width() + at.0);
    for (q, number) in neighbors(frame, at.0, at.1) {
        if top[q].0 == top[at].0 {
            equation.add_same(number);
        } else if top[q].1 > top[at].1 {
            // What is in front has its own outline.
            equation.add_behind(frame[at].color(), frame[q].color());
        }
    }
    equation
}

impl PixelEquation {
    fn new(pixel: usize) -> Self {
        Self {
            pixel,
            same: [0; 4],
            count: 0,
            jump: LinearRgb::BLACK,
            factor: 1.0 / (REACH_PX * REACH_PX),
        }
    }

    fn add_same(&mut self, number: usize) {
        self.same[self.count] = number;
        self.count += 1;
        self.factor += 1.0;
    }

    fn add_behind(&mut self, own: LinearRgb, behind: LinearRgb) {
        self.jump = self.jump + behind.add_scaled(-1.0, own);
        self.factor += 1.0;
    }
}

fn solve(pixels: &[PixelEquation], width: usize, height: usize) -> Image<LinearRgb> {
    let mut corrections = Image::filled(width, height, LinearRgb::BLACK);
    let values = corrections.pixels_mut();
    for sweep in 0..MAX_SWEEPS {
        let change = if sweep % 2 == 0 {
            relax(pixels.iter(), values)
        } else {
            relax(pixels.iter().rev(), values)
        };
        if change < TOLERANCE {
            break;
        }
    }
    corrections
}

/// Solves every equation once; returns the largest change.
fn relax<'a>(pixels: impl Iterator<Item = &'a PixelEquation>, values: &mut [LinearRgb]) -> f32 {
    let mut largest = 0.0_f32;
    for p in pixels {
        let same = p.same[..p.count].iter();
        let sum = same.fold(p.jump, |sum, &q| sum + values[q]);
        let value = sum.scale(1.0 / p.factor);
        let change = value.add_scaled(-1.0, values[p.pixel]);
        largest = largest.max(change.map(f32::abs).max_channel());
        values[p.pixel] = value;
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixel::{Depth, ObjectId};

    fn sample(object: u32, depth: f32) -> DeepSample {
        DeepSample {
            object: ObjectId(object),
            depth: Depth(depth),
            light: LinearRgb::grey(0.8),
            alpha: 1.0,
            visible: 1.0,
        }
    }

    /// A card of 0.8 from column 20 to 60 on a plate of 0.2, another in front of it from 40 on.
    fn blended() -> Image<PremulRgba> {
        let list = |i: usize| match i % 80 {
            20..40 => vec![sample(1, 1.0)],
            40..60 => vec![sample(2, 0.9), sample(1, 1.0)],
            _ => vec![],
        };
        let shadow = Image::filled(80, 30, LinearRgb::WHITE);
        let deep = DeepImage::from_pixels(shadow, (0..80 * 30).map(list));
        let value = |x: usize| if (20..60).contains(&x) { 0.8 } else { 0.2 };
        let frame = Image::from_fn(80, 30, |x, _| LinearRgb::grey(value(x)).opaque());
        blend(&frame, &deep)
    }

    #[test]
    fn an_outline_takes_what_is_behind_and_the_middle_stays() {
        let out = blended();
        // Along a straight outline the correction falls by a constant factor for each pixel: the
        // root below 1 of r + 1 / r = 2 + 1 / reach^2.
        let sum = 2.0 + 1.0 / f64::from(REACH_PX * REACH_PX);
        let root = 0.5 * (sum - (sum * sum - 4.0).sqrt());
        let first = -0.6 / (sum - root);
        for k in 0..8 {
            let expected = 0.8 + first * root.powi(k);
            let found = f64::from(out[(20 + k as usize, 15)].g);
            assert!((found - expected).abs() < 4e-3, "{k}: {found} {expected}");
        }
        assert!((out[(30, 15)].g - 0.8).abs() < 5e-3);
    }

    #[test]
    fn what_is_in_front_does_not_change_what_is_behind() {
        let out = blended();
        assert!((out[(39, 15)].g - 0.8).abs() < 2e-3);
        assert!((0..20).all(|x| out[(x, 4)].g == 0.2) && out[(60, 4)].g == 0.2);
    }

    #[test]
    fn a_wall_keeps_every_bit_and_has_an_outline_of_its_own() {
        // A card of 0.8 from column 20 to 60, of which a wall of 0.2 hides the part from 40 on.
        let list = |i: usize| match i % 80 {
            20..40 => vec![sample(1, 1.0)],
            40..60 => vec![DeepSample {
                light: LinearRgb::BLACK,
                visible: 0.0,
                ..sample(1, 1.0)
            }],
            _ => vec![],
        };
        let shadow = Image::filled(80, 30, LinearRgb::WHITE);
        let deep = DeepImage::from_pixels(shadow, (0..80 * 30).map(list));
        let value = |x: usize| match x {
            20..40 => 0.8,
            60.. => 0.5,
            _ => 0.2,
        };
        let frame = Image::from_fn(80, 30, |x, _| LinearRgb::grey(value(x)).opaque());
        let out = blend(&frame, &deep);
        assert!((40..80).all(|x| out[(x, 15)] == frame[(x, 15)]));
        assert!((out[(39, 15)].g - 0.8).abs() < 2e-3 && out[(20, 15)].g < 0.7);
    }

    #[test]
    fn nothing_to_blend_leaves_every_bit() {
        let deep = DeepImage::from_pixels(
            Image::filled(3, 2, LinearRgb::WHITE),
            (0..6).map(|_| Vec::new()),
        );
        let frame = Image::from_fn(3, 2, |x, y| LinearRgb::grey((x + 7 * y) as f32).opaque());
        assert_eq!(blend(&frame, &deep), frame);
    }
}
