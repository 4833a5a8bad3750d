//! Plastic of another colour, and weaker glints.

use crate::asset::SurfaceTexel;
use crate::image::Image;
use crate::pixel::{Film, LinearRgb, Mix};
use crate::scene::Grade;

/// Dyes see-through plastic and changes the strength of glints.
///
/// # Method
/// A dye multiplies the plastic's transmittance by its own (Beer and Lambert). Only the part of a
/// texel that the object covers is dyed, and of that only the clear part, which is the covered part
/// less what is opaque: paint, labels and caps keep their colours, and soft borders do not tint
/// what is next to them. Light that comes back out of the plastic is multiplied likewise; glints
/// come from its surface and keep the colour of the light.
pub(super) fn dye(film: &mut Image<Film>, surface: &Image<SurfaceTexel>, grade: &Grade) {
    let texels = film.pixels_mut().iter_mut().zip(surface.pixels());
    for (film, surface) in texels {
        *film = dyed(*film, surface, grade);
    }
}

fn dyed(film: Film, surface: &SurfaceTexel, grade: &Grade) -> Film {
    let held_back = grade.tint.map(|passes| 1.0 - passes);
    let clear = film.opacity.map(|o| (surface.body - o).max(0.0));
    let glint = LinearRgb::grey(surface.glint);
    let body = film.color.add_scaled(-1.0, glint);
    let kept = (clear * held_back).map(|lost| 1.0 - lost / surface.body.max(f32::MIN_POSITIVE));
    Film {
        color: (body * kept).add_scaled(grade.glints, glint),
        opacity: (film.opacity + clear * held_back).map(|o| o.min(1.0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TINT: LinearRgb = LinearRgb::new(0.5, 0.25, 1.0);

    fn texel(light: f32, opacity: f32, body: f32, glint: f32, grade: Grade) -> Film {
        let film = Film {
            color: LinearRgb::grey(light),
            opacity: LinearRgb::grey(opacity),
        };
        dyed(film, &SurfaceTexel { body, glint }, &grade)
    }

    fn tinted() -> Grade {
        Grade {
            tint: TINT,
            ..Grade::default()
        }
    }

    fn assert_near(a: LinearRgb, b: LinearRgb) {
        let pairs = a.channels().into_iter().zip(b.channels());
        assert!(
            pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-6),
            "{a:?} {b:?}"
        );
    }

    #[test]
    fn what_passes_a_clear_bottle_is_multiplied() {
        let dyed = texel(0.1, 0.2, 1.0, 0.0, tinted());
        assert_near(dyed.transmittance(), TINT.scale(0.8));
        // Light from within: a fifth comes from opaque parts.
        assert_near(
            dyed.color,
            (TINT.scale(0.8) + LinearRgb::grey(0.2)).scale(0.1),
        );
    }

    #[test]
    fn what_is_opaque_or_beside_the_object_keeps_its_colour() {
        let paint = texel(0.7, 1.0, 1.0, 0.0, tinted());
        assert_eq!(
            (paint.color, paint.opacity),
            (LinearRgb::grey(0.7), LinearRgb::WHITE)
        );
        let outside = texel(0.0, 0.0, 0.0, 0.0, tinted());
        assert_eq!(outside, Film::default());
        // Half covered by opaque paint: none of it is clear.
        let border = texel(0.3, 0.5, 0.5, 0.0, tinted());
        assert_near(border.transmittance(), LinearRgb::grey(0.5));
        // Half covered by plastic of transmittance 0.8.
        let border = texel(0.0, 0.1, 0.5, 0.0, tinted());
        assert_near(
            border.transmittance(),
            TINT.scale(0.4) + LinearRgb::grey(0.5),
        );
    }

    #[test]
    fn glints_are_weakened_and_keep_the_colour_of_the_light() {
        let grade = Grade {
            glints: 0.25,
            ..tinted()
        };
        let dyed = texel(0.9, 0.0, 1.0, 0.8, grade);
        assert_near(dyed.color, TINT.scale(0.1) + LinearRgb::grey(0.2));
    }
}
