//! Other colours for a picture.

use super::dice::Dice;

/// Factors on hue, saturation and value of display-encoded colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Jitter {
    /// Part of the circle that is added, from the hue's own factor.
    hue: f32,
    saturation: f32,
    value: f32,
}

impl Jitter {
    /// Drawn within these reaches of "as it was".
    pub(super) fn draw([hue, saturation, value]: [f64; 3], dice: &mut Dice) -> Self {
        let mut factor = |reach: f64| (1.0 + dice.between(-reach, reach)) as f32;
        Self { hue: factor(hue), saturation: factor(saturation), value: factor(value) }
    }

    /// A colour, channels 0 to 1, with hue, saturation and value times the factors.
    pub(super) fn apply(self, [r, g, b]: [f32; 3]) -> [f32; 3] {
        let most = r.max(g).max(b);
        let range = most - r.min(g).min(b);
        let value = (most * self.value).min(1.0);
        if range <= 0.0 {
            return [value; 3];
        }
        let sixth = if most == r {
            ((g - b) / range).rem_euclid(6.0)
        } else if most == g {
            (b - r) / range + 2.0
        } else {
            (r - g) / range + 4.0
        };
        let saturation = (range / most * self.saturation).min(1.0);
        // Each channel falls off from the value with its distance from its own hue, in sixths of the circle.
        let channel = |own: f32| {
            let k = (own + sixth * self.hue).rem_euclid(6.0);
            value * (1.0 - saturation * k.min(4.0 - k).clamp(0.0, 1.0))
        };
        [channel(5.0), channel(3.0), channel(1.0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_of_one_change_nothing() {
        let same = Jitter { hue: 1.0, saturation: 1.0, value: 1.0 };
        for c in [[0.2, 0.5, 0.9], [0.9, 0.2, 0.3], [0.1, 0.8, 0.1], [0.4; 3], [0.0; 3], [1.0, 1.0, 0.0]] {
            let back = same.apply(c);
            assert!(c.iter().zip(back).all(|(a, b)| (a - b).abs() < 1e-6), "{c:?} {back:?}");
        }
    }

    #[test]
    fn grey_stays_grey_and_no_channel_leaves_its_range() {
        let strong = Jitter { hue: 1.015, saturation: 1.7, value: 1.4 };
        assert_eq!(strong.apply([0.5; 3]), [0.7; 3]);
        let c = strong.apply([0.9, 0.2, 0.3]);
        assert!(c.iter().all(|v| (0.0..=1.0).contains(v)) && c[0] == 1.0, "{c:?}");
    }
}
