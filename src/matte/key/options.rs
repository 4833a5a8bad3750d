//! Settings of a keyer: one struct, one TOML table, Blender's own names.

use crate::error::{Error, Result};
use crate::matte::check::check_value;
use crate::names::{by_name, name_of};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Which keyer to use: one of the three that Blender has shipped, or the careful one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Profile {
    /// Blender 3.4.1, bit for bit.
    #[default]
    #[serde(rename = "blender-3.4")]
    Blender34,
    /// Blender 4.2 and 4.3, bit for bit.
    #[serde(rename = "blender-4.2")]
    Blender42,
    /// Blender 4.5 and 5.0, bit for bit.
    #[serde(rename = "blender-4.5")]
    Blender45,
    /// Blender 3.4 made safe: refuses keys that cannot work, gives defined output for every input,
    /// and counts what it changed (see [`Deviations`](super::Deviations)).
    #[serde(rename = "robust")]
    Robust,
}

impl Profile {
    /// Every profile with its name.
    pub const ALL: [(&'static str, Self); 4] = [
        ("blender-3.4", Self::Blender34),
        ("blender-4.2", Self::Blender42),
        ("blender-4.5", Self::Blender45),
        ("robust", Self::Robust),
    ];
}

impl fmt::Display for Profile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(name_of(&Self::ALL, self))
    }
}

impl std::str::FromStr for Profile {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        by_name("profile", &Self::ALL, name)
    }
}

/// How a feathered edge falls off with the distance `u` from its far end (1) to its near end (0).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub enum Falloff {
    /// `3u^2 - 2u^3`.
    #[default]
    Smooth,
    /// `sqrt(2u - u^2)`.
    Sphere,
    /// `sqrt(u)`.
    Root,
    /// `u (2 - u)`.
    InverseSquare,
    /// `u^2`.
    Sharp,
    /// `u`.
    Linear,
}

/// How the box blurs of [`KeyOptions::blur_pre`] and [`KeyOptions::blur_post`] add up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Blur {
    /// Sample by sample in Blender's order: Blender's bits.
    #[default]
    Exact,
    /// By running sums, whose cost does not depend on the size: nearer the true mean than Blender
    /// is. Samples are rounded to 2^-24 and held within 65504 (half precision's largest); NaN
    /// counts as 0. An edge that only just is one may not be found, so that the levels clip it.
    ///
    /// Worth it beyond a size of about ten: on a 4K frame with both blurs at 6, 20 and 60 it takes
    /// 1.1, 0.6 and 0.3 of the time and differs by 1.8e-7, 3.6e-7 and 6.6e-7 at most (`cargo
    /// bench --bench matte`).
    RunningSum,
}

/// Settings of the [keyer](super), under the names that Blender 3.4 gives its Keying node.
///
/// The ranges are Blender's. [`Keying::run`](super::Keying::run) refuses values outside them,
/// [`key`](super::key) moves them to the nearest end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct KeyOptions {
    /// Which keyer to use. Default: `blender-3.4`.
    pub profile: Profile,
    /// Size of the blur of the chroma before keying, 0 to 2048 pixels; against noise and chroma
    /// subsampling. Default: 0.
    pub blur_pre: u32,
    /// How both blurs add up. Not a setting of Blender's. Default: `exact`.
    pub blur: Blur,
    /// Which of the two other channels the key is weighed against: 0 = the later one, 1 = the
    /// earlier one. Default: 0.5.
    pub screen_balance: f32,
    /// Raw matte at or below this becomes 0, in 0..1. Default: 0.
    pub clip_black: f32,
    /// Raw matte at or above this becomes 1, in 0..1. Default: 1.
    pub clip_white: f32,
    /// Half-size of the window of the edge search (edges are not clipped), 0 to 100 pixels.
    /// Default: 3.
    pub edge_kernel_radius: u32,
    /// Matte values closer than this are alike for the edge search, in 0..1. Default: 0.1.
    pub edge_kernel_tolerance: f32,
    /// Size of the blur of the finished matte, 0 to 2048 pixels. Default: 0.
    pub blur_post: u32,
    /// Pixels by which the matte grows, or shrinks where negative, -100 to 100. Default: 0.
    pub dilate_distance: i32,
    /// Pixels over which the matte is feathered, outwards or, where negative, inwards, -100 to
    /// 100. Default: 0.
    pub feather_distance: i32,
    /// Shape of the feathered edge. Default: `SMOOTH`.
    pub feather_falloff: Falloff,
    /// How much of the screen's colour that exceeds the other channels is removed, in 0..1.
    /// Default: 1.
    pub despill_factor: f32,
    /// Which of the two other channels the despill compares with, as `screen_balance`. Default:
    /// 0.5.
    pub despill_balance: f32,
    /// Leaves out the factor `|1 - v|` that ties the matte to brightness. Not Blender's matte.
    /// Default: false.
    pub ignore_brightness: bool,
    /// The remaining screen is subtracted from the picture, `max(0, I - (1 - M) K)`, instead of it being
    /// multiplied by its matte and despilled. Not Blender's picture. Default: false.
    pub subtract_screen: bool,
    /// Lets the `robust` profile key against a screen too grey to be distinguished from the
    /// foreground. Default: false.
    pub accept_weak_key: bool,
}

impl Default for KeyOptions {
    fn default() -> Self {
        Self {
            profile: Profile::default(),
            blur_pre: 0,
            blur: Blur::default(),
            screen_balance: 0.5,
            clip_black: 0.0,
            clip_white: 1.0,
            edge_kernel_radius: 3,
            edge_kernel_tolerance: 0.1,
            blur_post: 0,
            dilate_distance: 0,
            feather_distance: 0,
            feather_falloff: Falloff::default(),
            despill_factor: 1.0,
            despill_balance: 0.5,
            ignore_brightness: false,
            subtract_screen: false,
            accept_weak_key: false,
        }
    }
}

/// Largest blur size of Blender's node.
const MAX_BLUR_SIZE: u32 = 2048;
/// Largest edge radius, dilate and feather distance of Blender's node.
const MAX_DISTANCE: i32 = 100;

impl KeyOptions {
    /// The default settings of another profile.
    pub fn for_profile(profile: Profile) -> Self {
        Self {
            profile,
            ..Self::default()
        }
    }

    /// Whether every setting lies in its range and the robust profile can keep its promise.
    ///
    /// # Errors
    /// [`Error::Value`] with the setting's name, its value and what was expected.
    pub fn check(&self) -> Result<()> {
        let near = self.clamped();
        for ((at, value), (_, nearest)) in self.fractions().into_iter().zip(near.fractions()) {
            check_inside(at, value, nearest, "0 to 1")?;
        }
        for ((at, value, range), (_, nearest, _)) in self.sizes().into_iter().zip(near.sizes()) {
            check_inside(at, value, nearest, range)?;
        }
        self.check_levels()
    }

    /// In the robust profile, white is above black.
    fn check_levels(&self) -> Result<()> {
        let (black, white) = (self.clip_black, self.clip_white);
        let is_right = self.profile != Profile::Robust || white > black;
        check_value(is_right, "key.clip_white", || {
            format!("{white}, expected more than clip_black ({black})")
        })
    }

    /// Every setting moved to the nearest value that Blender's node can hold; a fraction that is
    /// NaN becomes 0.
    pub fn clamped(&self) -> Self {
        Self {
            blur_pre: self.blur_pre.min(MAX_BLUR_SIZE),
            screen_balance: clamped_fraction(self.screen_balance),
            clip_black: clamped_fraction(self.clip_black),
            clip_white: clamped_fraction(self.clip_white),
            edge_kernel_radius: self.edge_kernel_radius.min(MAX_DISTANCE.unsigned_abs()),
            edge_kernel_tolerance: clamped_fraction(self.edge_kernel_tolerance),
            blur_post: self.blur_post.min(MAX_BLUR_SIZE),
            dilate_distance: self.dilate_distance.clamp(-MAX_DISTANCE, MAX_DISTANCE),
            feather_distance: self.feather_distance.clamp(-MAX_DISTANCE, MAX_DISTANCE),
            despill_factor: clamped_fraction(self.despill_factor),
            despill_balance: clamped_fraction(self.despill_balance),
            ..self.clone()
        }
    }

    fn fractions(&self) -> [(&'static str, f32); 6] {
        [
            ("key.screen_balance", self.screen_balance),
            ("key.clip_black", self.clip_black),
            ("key.clip_white", self.clip_white),
            ("key.edge_kernel_tolerance", self.edge_kernel_tolerance),
            ("key.despill_factor", self.despill_factor),
            ("key.despill_balance", self.despill_balance),
        ]
    }

    fn sizes(&self) -> [(&'static str, i64, &'static str); 5] {
        [
            ("key.blur_pre", self.blur_pre.into(), "0 to 2048"),
            (
                "key.edge_kernel_radius",
                self.edge_kernel_radius.into(),
                "0 to 100",
            ),
            ("key.blur_post", self.blur_post.into(), "0 to 2048"),
            (
                "key.dilate_distance",
                self.dilate_distance.into(),
                "-100 to 100",
            ),
            (
                "key.feather_distance",
                self.feather_distance.into(),
                "-100 to 100",
            ),
        ]
    }
}

fn clamped_fraction(v: f32) -> f32 {
    if v > 0.0 { v.min(1.0) } else { 0.0 }
}

fn check_inside<T: PartialEq + fmt::Display>(
    at: &str,
    value: T,
    nearest: T,
    range: &str,
) -> Result<()> {
    check_value(value == nearest, at, || {
        format!("{value}, expected {range}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_toml_table_is_the_struct() {
        let text = "profile = \"blender-4.5\"\nclip_black = 0.25\nfeather_falloff = \"INVERSE_SQUARE\"\nblur = \"running_sum\"\n";
        let options: KeyOptions = toml::from_str(text).unwrap();
        let want = KeyOptions {
            clip_black: 0.25,
            feather_falloff: Falloff::InverseSquare,
            blur: Blur::RunningSum,
            ..KeyOptions::for_profile(Profile::Blender45)
        };
        assert_eq!(options, want);
    }

    #[test]
    fn an_unknown_setting_is_refused() {
        let error = toml::from_str::<KeyOptions>("clip_blak = 0.1").unwrap_err();
        assert!(error.to_string().contains("clip_blak"), "{error}");
    }

    #[test]
    fn a_setting_out_of_range_is_named() {
        let said = |change: fn(&mut KeyOptions)| {
            let mut options = KeyOptions::default();
            change(&mut options);
            options.check().unwrap_err().to_string()
        };
        let expected = "key.feather_distance: -101, expected -100 to 100";
        assert_eq!(said(|o| o.feather_distance = -101), expected);
        let expected = "key.screen_balance: NaN, expected 0 to 1";
        assert_eq!(said(|o| o.screen_balance = f32::NAN), expected);
    }

    #[test]
    fn only_the_robust_profile_refuses_levels_in_the_wrong_order() {
        let levels = |profile| KeyOptions {
            clip_black: 0.5,
            clip_white: 0.5,
            ..KeyOptions::for_profile(profile)
        };
        assert!(levels(Profile::Blender34).check().is_ok());
        assert!(levels(Profile::Robust).check().is_err());
    }

    #[test]
    fn profiles_are_known_by_their_names() {
        for (name, profile) in Profile::ALL {
            assert_eq!(name.parse::<Profile>().unwrap(), profile);
        }
        assert!("blender-5".parse::<Profile>().is_err());
    }
}
