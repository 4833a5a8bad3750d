//! Cast shadow: screen that a hard light leaves dark beside the object, within edges as sharp as its
//! own.

use super::cluster::{PixelGroups, both};
use crate::diagnostic::{Code, Diagnostic};
use crate::filter;
use crate::image::{Image, Mask};
use crate::matte::plate::ScreenPlate;
use crate::matte::screen::shade_within;
use crate::pixel::LinearRgb;
use crate::quantile::median;
use std::ops::Range;

/// A shadow differs from a shade of the plate by at most this share of the plate's strongest
/// channel: it reflects nothing of its own, where plastic adds sheen and paint another hue.
const MAX_DEVIATION: f32 = 0.01;
/// How bright a hard shadow is, 1 as the plate: clear plastic lets more light through, dark paint
/// less.
const DARK: Range<f32> = 0.3..0.75;
/// Up to where screen that hangs together with a shadow is left out with it: its soft edge, and lit
/// screen in the corner between it and the object.
const LIT: f32 = 1.05;
/// A shadow is even: this share of its core is within that share of the median shade. Paint of the
/// screen's hue is shaded by its shape.
const EVEN_SHARE: f64 = 0.6;
const EVEN_DEVIATION: f32 = 0.1;
/// Half the width of a shadow, at least, pixels: what is narrower is the blur of an edge, or the dark
/// rim of clear plastic.
const HALF_WIDTH_PX: f64 = 2.0;
/// A shadow reaches so far beyond its core, to the middle of its edge, pixels.
const EDGE_PX: f64 = 2.0;
/// The share of what is enclosed that a shadow has. On 24 rendered photos clear plastic that looks
/// like one has 0.032 at most; where more than the upper bound looks like one, it is an object of the
/// screen's colour.
const SHARES: Range<f64> = 0.035..0.3;

/// The shadow beside an object that its edges enclose with it: the wide parts of `inside` that are
/// the plate in one dark shade and touch what is outside. Empty where there is none.
pub(super) fn cast_shadow(smooth: &Image<LinearRgb>, plate: &ScreenPlate, inside: &Mask) -> Mask {
    let shades = shades(smooth, plate, inside);
    let shaded = shades.map(|shade| shade.is_some());
    let core = filter::erode(&shaded, HALF_WIDTH_PX);
    let even = evenly_dark(&shades, &core);
    let wide = filter::dilate(&core, HALF_WIDTH_PX);
    let found = with_tips(&even_groups(&wide, [&core, &even], inside), &shaded);
    let shadow = both(&filter::dilate(&found, EDGE_PX), inside);
    if SHARES.contains(&share_of(&shadow, inside)) {
        shadow
    } else {
        Image::new(inside.width(), inside.height())
    }
}

/// The wide parts of a set with the tips in which it ends.
fn with_tips(wide: &Mask, set: &Mask) -> Mask {
    both(&filter::dilate(wide, 2.0 * HALF_WIDTH_PX), set)
}

/// How bright the screen is, 1 as its plate, where it is seen inside or what is there looks like it.
fn shades(smooth: &Image<LinearRgb>, plate: &ScreenPlate, inside: &Mask) -> Image<Option<f32>> {
    smooth.zip3_map(&plate.image, inside, |p, k, inside| {
        let shade = shade_within(MAX_DEVIATION, p.into(), k.into());
        shade.filter(|shade| inside && (DARK.start..LIT).contains(shade))
    })
}

/// Where a core has the shade that is usual of what is dark in it.
fn evenly_dark(shades: &Image<Option<f32>>, core: &Mask) -> Mask {
    let in_core = shades.zip_map(core, |shade, core| shade.filter(|_| core));
    let dark = in_core.pixels().iter().flatten().copied();
    let usual = median(dark.filter(|shade| DARK.contains(shade)), f32::total_cmp);
    in_core.map(|shade| {
        let pair = shade.zip(usual);
        pair.is_some_and(|(shade, usual)| (shade - usual).abs() < EVEN_DEVIATION * usual)
    })
}

/// The groups of a set that are even over most of their core and touch what is outside.
fn even_groups(set: &Mask, [core, even]: [&Mask; 2], inside: &Mask) -> Mask {
    let groups = PixelGroups::new(set);
    let [core, even] = [core, even].map(|part| groups.sizes(part));
    let open = groups.sizes(&filter::dilate(&inside.complement(), EDGE_PX));
    groups.only(|i| open[i] > 0 && even[i] as f64 >= EVEN_SHARE * core[i] as f64)
}

fn share_of(part: &Mask, whole: &Mask) -> f64 {
    part.count() as f64 / whole.count().max(1) as f64
}

/// The warning about a shadow that is left out of what the edges enclose; none without one.
pub(super) fn shadow_left_out(shadow: &Mask, inside: &Mask) -> Option<Diagnostic> {
    let percent = 100.0 * share_of(shadow, inside);
    (percent > 0.0).then(|| {
        Diagnostic::warning(
            Code::LeftOut,
            format_args!(
                "left out what looks like a hard shadow on the screen, {percent:.0} % of what the edges enclose; soften the light or, if it belongs to the object, draw the outline there"
            ),
        )
    })
}
