//! The operators of Porter and Duff on premultiplied pixels.
//!
//! # Method
//! [Porter and Duff 1984]: each operator keeps a share of each picture that depends only on the other's alpha.
//!
//! [Porter and Duff 1984]: https://doi.org/10.1145/800031.808606

use crate::pixel::{Film, Mix, PremulRgba};

impl PremulRgba {
    /// `self` in front of `behind`.
    #[inline(always)]
    pub fn over(self, behind: Self) -> Self {
        self.add_scaled(1.0 - self.a, behind)
    }

    /// The sum of two pixels that share an area without hiding each other.
    #[inline(always)]
    pub fn plus(self, other: Self) -> Self {
        self.add_scaled(1.0, other)
    }
}

impl Film {
    /// `self` in front of `behind`: films multiply their transmittances.
    #[inline(always)]
    pub fn over(self, behind: Self) -> Self {
        let pass = self.transmittance();
        Self {
            color: self.color + pass * behind.color,
            opacity: self.opacity + pass * behind.opacity,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixel::Coverage;
    use proptest::prelude::*;

    fn pixel() -> impl Strategy<Value = PremulRgba> {
        let channel = 0.0f32..=1.0;
        (channel.clone(), channel.clone(), channel.clone(), channel)
            .prop_map(|(r, g, b, a)| PremulRgba::new(r * a, g * a, b * a, a))
    }

    #[test]
    fn grey_film_goes_over_as_rgba_does() {
        let (a, b) = (
            PremulRgba::new(0.1, 0.2, 0.3, 0.5),
            PremulRgba::new(0.2, 0.1, 0.0, 0.25),
        );
        assert_eq!(Film::from(a).over(b.into()), a.over(b).into());
    }

    fn close(a: PremulRgba, b: PremulRgba) -> bool {
        let d = a.add_scaled(-1.0, b);
        [d.r, d.g, d.b, d.a].iter().all(|v| v.abs() < 1e-6)
    }

    proptest! {
        #[test]
        fn over_is_associative(a in pixel(), b in pixel(), c in pixel()) {
            prop_assert!(close(a.over(b).over(c), a.over(b.over(c))));
        }

        #[test]
        fn nothing_is_neutral_for_over(a in pixel()) {
            prop_assert_eq!(a.over(PremulRgba::TRANSPARENT), a);
            prop_assert_eq!(PremulRgba::TRANSPARENT.over(a), a);
        }

        #[test]
        fn over_is_a_plus_what_is_left_of_b(a in pixel(), b in pixel()) {
            prop_assert!(close(a.over(b), a.plus(b.masked(Coverage(1.0 - a.a)))));
        }
    }

    #[test]
    fn an_opaque_pixel_hides_what_is_behind() {
        let front = PremulRgba::new(0.1, 0.2, 0.3, 1.0);
        assert_eq!(front.over(PremulRgba::new(0.9, 0.9, 0.9, 1.0)), front);
    }
}
