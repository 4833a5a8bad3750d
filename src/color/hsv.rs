//! Hue, saturation and value of linear colour, without clamping.

use crate::pixel::LinearRgb;

/// A colour as hue, saturation and value.
///
/// `v` is the largest channel and may be of any size and sign; `h` is a fraction of a turn, 0 =
/// red, 1/3 = green; `s` is the spread of the channels over `v`: 0 to 1 where no channel is
/// negative, above 1 where one is, negative where all are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hsv {
    /// Hue in turns, 0 up to 1; 0 for grey.
    pub h: f32,
    /// Saturation; 0 for grey.
    pub s: f32,
    /// Value: the largest channel.
    pub v: f32,
}

/// 1.5 x 2^23: floats around it are integers.
const WHOLE_TURNS: f32 = 12_582_912.0;

/// Hue, saturation and value of a colour; the largest channel may be above 1 and any channel below
/// 0.
///
/// The inverse is exact up to rounding, with one exception: where the largest channel is exactly 0
/// saturation has no value, and the colour becomes black.
///
/// # Method
/// The hexcone model of [Smith 1978], whose formulas need no bounds on the channels.
///
/// [Smith 1978]: https://doi.org/10.1145/965139.807361
#[inline(always)]
pub fn rgb_to_hsv(c: LinearRgb) -> Hsv {
    let v = c.max_channel();
    let spread = v - c.r.min(c.g).min(c.b);
    let h = if spread == 0.0 {
        0.0
    } else {
        turn(hue_sixths(c, v, spread) / 6.0)
    };
    let s = if v == 0.0 { 0.0 } else { spread / v };
    Hsv { h, s, v }
}

/// Hue in sixths of a turn, from the largest channel and the spread of all.
#[inline(always)]
fn hue_sixths(c: LinearRgb, largest: f32, spread: f32) -> f32 {
    if c.r == largest {
        (c.g - c.b) / spread
    } else if c.g == largest {
        2.0 + (c.b - c.r) / spread
    } else {
        4.0 + (c.r - c.g) / spread
    }
}

/// The colour of a hue, saturation and value; whole turns of the hue are ignored, up to 2^22 of them.
#[inline(always)]
pub fn hsv_to_rgb(c: Hsv) -> LinearRgb {
    let sixths = 6.0 * turn(c.h);
    let r = ((sixths - 3.0).abs() - 1.0).clamp(0.0, 1.0);
    let g = (2.0 - (sixths - 2.0).abs()).clamp(0.0, 1.0);
    let b = (2.0 - (sixths - 4.0).abs()).clamp(0.0, 1.0);
    LinearRgb::new(r, g, b).map(|full| c.v - c.v * c.s * (1.0 - full))
}

/// The colour turned in hue, its saturation and value multiplied.
///
/// `hue_deg` is added to the hue, in degrees; `saturation` and `value` are factors. Saturation is
/// clipped to 1, negative results to 0, and nothing at the top. A colour times k gives the result
/// times k, so premultiplied colour may be passed as it is. The values (0, 1, 1) return the
/// colour unchanged.
///
/// # Method
/// Cycles' Hue Saturation Value node on linear colour, factor 1 (Blender 3.4 and 4.5 agree within
/// 2e-4 per texel).
#[inline(always)]
pub fn shift_hsv(c: LinearRgb, hue_deg: f32, saturation: f32, value: f32) -> LinearRgb {
    if (hue_deg, saturation, value) == (0.0, 1.0, 1.0) {
        return c;
    }
    let Hsv { h, s, v } = rgb_to_hsv(c);
    let shifted = Hsv {
        h: h + hue_deg / 360.0,
        s: (s * saturation).clamp(0.0, 1.0),
        v: v * value,
    };
    hsv_to_rgb(shifted).map(|x| x.max(0.0))
}

/// The part of a turn beyond whole turns, 0 to 1.
///
/// By a sum that rounds to whole turns: `floor` is a function call on processors older than SSE 4.1,
/// and conversions to integers, with all their checks, are not vectorised.
#[inline(always)]
fn turn(h: f32) -> f32 {
    let beyond = h - ((h + WHOLE_TURNS) - WHOLE_TURNS);
    if beyond < 0.0 { beyond + 1.0 } else { beyond }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Colours between -1 and 3, grey and pure ones included.
    fn colors() -> impl Iterator<Item = LinearRgb> {
        let steps = || (-4..=12).map(|i| i as f32 * 0.25);
        steps().flat_map(move |r| {
            steps().flat_map(move |g| steps().map(move |b| LinearRgb::new(r, g, b)))
        })
    }

    fn distance(a: LinearRgb, b: LinearRgb) -> f32 {
        (a.r - b.r)
            .abs()
            .max((a.g - b.g).abs())
            .max((a.b - b.b).abs())
    }

    #[test]
    fn the_way_to_hsv_and_back_changes_no_colour() {
        for c in colors().filter(|c| c.max_channel() != 0.0) {
            let back = hsv_to_rgb(rgb_to_hsv(c));
            assert!(distance(back, c) < 4e-6, "{c:?} became {back:?}");
        }
    }

    #[test]
    fn hue_is_less_than_a_turn_or_rounds_to_one() {
        assert!(colors().all(|c| (0.0..=1.0).contains(&rgb_to_hsv(c).h)));
    }

    #[test]
    fn primaries_lie_a_third_of_a_turn_apart() {
        let hue = |r, g, b| rgb_to_hsv(LinearRgb::new(r, g, b)).h;
        assert_eq!(hue(2.0, 0.0, 0.0), 0.0);
        assert_eq!(hue(0.0, 2.0, 0.0), 2.0 / 6.0);
        assert_eq!(hue(0.0, 0.0, 2.0), 4.0 / 6.0);
    }

    #[test]
    fn no_shift_asked_is_no_change_at_all() {
        assert!(colors().all(|c| shift_hsv(c, 0.0, 1.0, 1.0) == c));
    }

    #[test]
    fn a_third_of_a_turn_moves_red_to_green_and_a_negative_one_to_blue() {
        let [red, green, blue] =
            [[3.0_f32, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 3.0]].map(LinearRgb::from);
        for (hue_deg, expected, near) in [
            (120.0, green, 1e-6),
            (-120.0, blue, 1e-6),
            (480.0, green, 2e-6),
        ] {
            assert!(distance(shift_hsv(red, hue_deg, 1.0, 1.0), expected) < near);
        }
    }

    #[test]
    fn a_shift_of_k_times_a_colour_is_k_times_its_shift() {
        for c in colors().filter(|c| c.r.min(c.g).min(c.b) >= 0.0) {
            let once = shift_hsv(c, 33.0, 1.2, 0.7).scale(0.3);
            assert!(distance(shift_hsv(c.scale(0.3), 33.0, 1.2, 0.7), once) < 2e-6);
        }
    }

    #[test]
    fn shifted_colours_are_never_negative() {
        for c in colors() {
            let out = shift_hsv(c, 77.0, 3.0, 1.5);
            assert!(
                out.r >= 0.0 && out.g >= 0.0 && out.b >= 0.0,
                "{c:?} became {out:?}"
            );
        }
    }

    #[test]
    fn colours_without_negative_channels_agree_with_the_palette_crate() {
        use palette::{FromColor, Hsv as Theirs, LinSrgb, encoding::Linear, encoding::Srgb};
        for c in colors().filter(|c| c.r.min(c.g).min(c.b) >= 0.0 && c.max_channel() <= 1.0) {
            let theirs = Theirs::<Linear<Srgb>>::from_color(LinSrgb::new(c.r, c.g, c.b));
            let ours = rgb_to_hsv(c);
            assert!(
                (360.0 * ours.h - theirs.hue.into_positive_degrees()).abs() < 1e-3,
                "{c:?}"
            );
            assert!(
                (ours.s - theirs.saturation).abs() < 1e-6 && (ours.v - theirs.value).abs() < 1e-6,
                "{c:?}"
            );
        }
    }
}
