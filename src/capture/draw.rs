//! Frames as pictures.

use super::display::{Display, DisplayMarker, MarkerPart, marker_id};
use super::frame::{Frame, Stripes};
use super::tag;
use crate::color::encode_srgb8;
use crate::image::Image;
use crate::pixel::{LinearRgb, Srgb8};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Light of a marker's paper, in every frame alike; white is 1. Half of white is easy to read and
/// leaves the black frame dark.
pub(super) const PAPER_LIGHT: f32 = 0.5;

/// What the display shows for a frame, display-encoded.
///
/// # Panics
/// For a display that does not pass [`Display::check`].
pub fn draw_frame(display: &Display, frame: Frame) -> Image<Srgb8> {
    let [w, h] = display.size_px.map(|side| side as usize);
    let markers = numbered_markers(display, frame);
    let at_pixel = |x: usize, y: usize| {
        let light = marker_light(&markers, [x, y]);
        let light =
            light.unwrap_or_else(|| frame.light_at(display, [x, y].map(|i| i as f64 + 0.5)));
        encode_srgb8(LinearRgb::grey(light))
    };
    Image::from_fn(w, h, at_pixel)
}

fn numbered_markers(display: &Display, frame: Frame) -> Vec<(u32, DisplayMarker)> {
    let markers = display.markers().into_iter().enumerate();
    markers
        .map(|(corner, marker)| (marker_id(frame, corner), marker))
        .collect()
}

/// Light of the marker at a pixel, where there is one.
fn marker_light(markers: &[(u32, DisplayMarker)], pixel: [usize; 2]) -> Option<f32> {
    let mut parts = markers
        .iter()
        .map(|(id, marker)| (id, marker.part_at(pixel)));
    let (id, part) = parts.find_map(|(id, part)| Some((*id, part?)))?;
    let is_lit = match part {
        MarkerPart::Paper => true,
        MarkerPart::Cell(row, column) => tag::is_white(id, row, column),
    };
    Some(if is_lit { PAPER_LIGHT } else { 0.0 })
}

impl Frame {
    /// Light at a place of the display, pixels, outside of its markers; white is 1.
    pub(super) fn light_at(self, display: &Display, at_px: [f64; 2]) -> f32 {
        match self {
            Self::Black => 0.0,
            Self::White => 1.0,
            Self::Stripes(stripes) => stripes.light_at(display, at_px),
        }
    }
}

impl Stripes {
    fn light_at(self, display: &Display, at_px: [f64; 2]) -> f32 {
        let phase = TAU * at_px[self.axis] / display.period_px(self.is_fine);
        let shifted = phase + FRAC_PI_2 * self.shift as f64;
        (0.5 + 0.5 * libm::cos(shifted)) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::rgb;

    const DISPLAY: Display = Display {
        size_px: [640, 400],
        width: None,
    };

    #[test]
    fn markers_stand_on_grey_paper_in_every_frame() {
        for frame in Frame::all(true) {
            let shown = draw_frame(&DISPLAY, frame);
            let cell = DISPLAY.cell_px();
            let paper = shown[(2 * cell, 2 * cell)];
            assert_eq!(paper, rgb(188, 188, 188), "{frame}");
            assert_eq!(
                shown[(3 * cell, 3 * cell)],
                rgb(0, 0, 0),
                "{frame}: the square's border"
            );
            assert_eq!(shown[(640 - 2 * cell, 400 - 2 * cell)], paper, "{frame}");
        }
    }

    #[test]
    fn stripes_swing_from_black_to_white_along_their_axis() {
        let stripes = |axis, shift| {
            Frame::Stripes(Stripes {
                axis,
                is_fine: true,
                shift,
            })
        };
        let shown = draw_frame(&DISPLAY, stripes(0, 0));
        let row: Vec<u8> = (200..440).map(|x| shown[(x, 200)].g).collect();
        assert!(row.iter().min() < Some(&60) && row.iter().max() > Some(&250));
        assert!((100..300).all(|y| shown[(320, y)] == shown[(320, 200)]));
        for at in [[201.5, 10.5], [333.3, 77.7]] {
            let [a, b, c, d] = [0, 1, 2, 3].map(|shift| stripes(1, shift).light_at(&DISPLAY, at));
            assert!((a + c - 1.0).abs() < 1e-6 && (b + d - 1.0).abs() < 1e-6);
            let phase = libm::atan2f(d - b, a - c);
            let expected = TAU * at[1] / DISPLAY.period_px(true);
            assert!(libm::sin((f64::from(phase) - expected) / 2.0).abs() < 1e-5);
        }
    }
}
