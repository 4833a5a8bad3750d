//! Random numbers and pictures from seeds.

use petcomp::{Image, LinearRgb};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Longest side of a patch of a new background, pixels.
const MAX_PATCH_PX: usize = 24;
/// Average number of patches over each position of a background, if all had the maximum size.
const PATCH_LAYERS: usize = 4;
/// Colour between the patches.
const BACKGROUND_GREY: f32 = 0.2;
/// Number of uniform numbers whose sum has variance 1.
const UNIFORM_NUMBERS: usize = 12;

/// Uniform numbers from 0 to 1.
pub(crate) fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    move || f64::from(rng.next_u32()) / f64::from(u32::MAX)
}

/// Normal numbers: sums of twelve uniform ones.
pub(crate) fn normal(seed: u64) -> impl FnMut() -> f64 {
    let mut draw = uniform(seed);
    move || {
        let sum: f64 = (0..UNIFORM_NUMBERS).map(|_| draw()).sum();
        sum - UNIFORM_NUMBERS as f64 / 2.0
    }
}

/// A background that no method has seen: patches of random colours and sizes.
pub(super) fn patched_background((w, h): (usize, usize), seed: u64) -> Image<LinearRgb> {
    let mut draw = uniform(seed);
    let mut image = Image::filled(w, h, LinearRgb::grey(BACKGROUND_GREY));
    for _ in 0..w * h * PATCH_LAYERS / (MAX_PATCH_PX * MAX_PATCH_PX) {
        let color: [f32; 3] = std::array::from_fn(|_| draw() as f32);
        let [x, y, across, down] =
            [w, h, MAX_PATCH_PX, MAX_PATCH_PX].map(|below| (draw() as f32 * below as f32) as usize);
        fill_patch(&mut image, [x, y], [1 + across, 1 + down], color.into());
    }
    image
}

/// Parts beyond the picture are left out.
fn fill_patch(
    image: &mut Image<LinearRgb>,
    [x, y]: [usize; 2],
    [width, height]: [usize; 2],
    color: LinearRgb,
) {
    let (w, h) = image.size();
    for row in y..(y + height).min(h) {
        image.row_mut(row)[x..(x + width).min(w)].fill(color);
    }
}
