//! Post-processing of a finished frame before it is written: the rest of the camera.

use crate::color::planckian;
use crate::error::Result;
use crate::pixel::LinearRgb;
use crate::scene::bounds::{BLUR, CHROMATIC, EV, GAIN, NOISE, SHARPENING, WHITE};
use crate::scene::check::check_factors;
use crate::scene::{Draws, Range};
use serde::{Deserialize, Serialize};

/// Blur and noise that rendered objects lack, then those of a camera, exposure, white balance and
/// sharpening of the whole frame, plate included; the default leaves every bit unchanged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PostProcess {
    /// Exposure, stops. Default: 0.
    pub exposure_ev: f64,
    /// Factor on each channel. Default: 1, 1, 1.
    pub white_balance: LinearRgb,
    /// Blur of rendered cards and shadows, to match the plate. Default: 0.
    pub blur_px: Blur,
    /// Noise of rendered cards, to match the plate. Default: none.
    pub noise: Noise,
    /// Seed of the noise: another number gives another frame of it. Default: 0.
    pub noise_seed: u64,
    /// Lateral chromatic aberration of the detector's camera: pixels by which red moves outwards
    /// from green, and blue inwards, in the frame's corners. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub chromatic_px: f64,
    /// Blur of the whole frame by that camera, pixels. Default: 0.
    pub camera_blur_px: f64,
    /// Noise of the whole frame by that camera. Default: none.
    pub camera_noise: CameraNoise,
    /// Amount of sharpening (unsharp mask of one pixel). Default: 0.
    pub sharpening: f64,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl Default for PostProcess {
    fn default() -> Self {
        Self {
            exposure_ev: 0.0,
            white_balance: LinearRgb::WHITE,
            blur_px: Blur::NONE,
            noise: Noise::default(),
            noise_seed: 0,
            chromatic_px: 0.0,
            camera_blur_px: 0.0,
            camera_noise: CameraNoise::default(),
            sharpening: 0.0,
        }
    }
}

/// Blur of a lens and a sensor: standard deviation of a Gaussian, pixels; in files the number or
/// `"match_plate"`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    rename_all = "snake_case",
    expecting = "expected pixels or \"match_plate\""
)]
pub enum Blur<Px = f64> {
    /// Found by the `light` stage: that of the plate.
    MatchPlate,
    /// This much.
    #[serde(untagged)]
    Known(Px),
}

impl Blur {
    /// No blur.
    pub const NONE: Self = Self::Known(0.0);
}

/// Noise of a sensor: variance `shot * value + read^2` of each scene-linear channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Noise {
    /// None.
    #[default]
    None,
    /// This much.
    Known {
        /// Variance per value: photon noise.
        shot: f64,
        /// Standard deviation in the dark.
        read: f64,
    },
    /// Found by the `light` stage: that of the plate.
    MatchPlate,
}

/// Noise of a sensor as in [`Noise::Known`], or its ranges; the default is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CameraNoise<T: Default = f64> {
    /// Variance per value: photon noise. Default: 0.
    pub shot: T,
    /// Standard deviation in the dark. Default: 0.
    pub read: T,
}

impl PostProcess {
    /// Whether it leaves the frame unchanged.
    pub fn is_identity(&self) -> bool {
        Self {
            noise_seed: 0,
            ..*self
        } == Self::default()
    }

    /// Fails on the first impossible value.
    pub(super) fn check(&self) -> Result<()> {
        EV.check("finish.exposure_ev", self.exposure_ev)?;
        check_factors(self.white_balance, "finish.white_balance", &GAIN)?;
        SHARPENING.check("finish.sharpening", self.sharpening)?;
        CHROMATIC.check("finish.chromatic_px", self.chromatic_px)?;
        BLUR.check("finish.camera_blur_px", self.camera_blur_px)?;
        NOISE.check("finish.camera_noise.shot", self.camera_noise.shot)?;
        NOISE.check("finish.camera_noise.read", self.camera_noise.read)?;
        if let Blur::Known(sigma_px) = self.blur_px {
            BLUR.check("finish.blur_px", sigma_px)?;
        }
        self.noise.check()
    }
}

impl Noise {
    /// Variance at a scene-linear value; 0 if it is not known.
    pub(crate) fn variance(&self, value: f64) -> f64 {
        match *self {
            Self::Known { shot, read } => shot * value.max(0.0) + read * read,
            Self::None | Self::MatchPlate => 0.0,
        }
    }

    fn check(&self) -> Result<()> {
        let Self::Known { shot, read } = *self else {
            return Ok(());
        };
        NOISE.check("finish.noise.known.shot", shot)?;
        NOISE.check("finish.noise.known.read", read)
    }
}

/// Ranges of a scene's post-processing; the defaults leave the frame unchanged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PostProcessRanges {
    /// Stops. Default: 0.
    pub exposure_ev: Range,
    /// White balance: temperature of the light that becomes white, kelvin, 2000 to 25 000; below
    /// 6504 the frame becomes bluer. Default: 6504.
    pub white_k: Range,
    /// Blur of rendered cards and shadows, pixels. Default: 0.
    pub blur_px: Blur<Range>,
    /// Noise of rendered cards. Default: `"none"`.
    pub noise: Noise,
    /// Lateral chromatic aberration in the frame's corners, pixels. Default: 0.
    pub chromatic_px: Range,
    /// Blur of the whole frame, pixels. Default: 0.
    pub camera_blur_px: Range,
    /// Noise of the whole frame. Default: none.
    pub camera_noise: CameraNoise<Range>,
    /// Amount of sharpening. Default: 0.
    pub sharpening: Range,
}

/// Temperature of the white of Rec. 709, kelvin, at which nothing changes.
pub(super) const NEUTRAL_K: f64 = 6504.0;

impl Default for PostProcessRanges {
    fn default() -> Self {
        Self {
            exposure_ev: Range::fixed(0.0),
            white_k: Range::fixed(NEUTRAL_K),
            blur_px: Blur::Known(Range::fixed(0.0)),
            noise: Noise::None,
            chromatic_px: Range::fixed(0.0),
            camera_blur_px: Range::fixed(0.0),
            camera_noise: CameraNoise::default(),
            sharpening: Range::fixed(0.0),
        }
    }
}

impl PostProcessRanges {
    /// The same for pictures whose sides are `factor` times as long: values in pixels scale with
    /// them.
    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self {
            blur_px: match self.blur_px {
                Blur::Known(sigma_px) => Blur::Known(sigma_px.scaled(factor)),
                Blur::MatchPlate => Blur::MatchPlate,
            },
            chromatic_px: self.chromatic_px.scaled(factor),
            camera_blur_px: self.camera_blur_px.scaled(factor),
            ..self
        }
    }

    /// `own` draws what differs between pictures of one sequence: noise.
    pub(super) fn draw(&self, draws: &Draws, own: &Draws) -> PostProcess {
        let CameraNoise { shot, read } = self.camera_noise;
        PostProcess {
            exposure_ev: self.exposure_ev.draw(draws, "finish.exposure_ev"),
            white_balance: white_balance(self.white_k.draw(draws, "finish.white_k")),
            blur_px: self.draw_blur(draws),
            noise: self.noise,
            noise_seed: self.draw_noise_seed(own),
            chromatic_px: self.draw_chromatic(draws),
            camera_blur_px: self.camera_blur_px.draw(draws, "finish.camera_blur_px"),
            camera_noise: CameraNoise {
                shot: shot.draw(draws, "finish.camera_noise.shot"),
                read: read.draw(draws, "finish.camera_noise.read"),
            },
            sharpening: self.sharpening.draw(draws, "finish.sharpening"),
        }
    }

    fn draw_blur(&self, draws: &Draws) -> Blur {
        match self.blur_px {
            Blur::Known(sigma_px) => Blur::Known(sigma_px.draw(draws, "finish.blur_px")),
            Blur::MatchPlate => Blur::MatchPlate,
        }
    }

    fn draw_chromatic(&self, draws: &Draws) -> f64 {
        if self.chromatic_px.is_zero() {
            0.0
        } else {
            self.chromatic_px.draw(draws, "finish.chromatic_px")
        }
    }

    fn draw_noise_seed(&self, draws: &Draws) -> u64 {
        if self.noise == Noise::None && self.camera_noise == CameraNoise::default() {
            0
        } else {
            draws.bits("finish.noise") >> 11
        }
    }

    pub(super) fn check(&self) -> Result<()> {
        let CameraNoise { shot, read } = self.camera_noise;
        self.exposure_ev.check("finish.exposure_ev", &EV)?;
        self.white_k.check("finish.white_k", &WHITE)?;
        self.sharpening.check("finish.sharpening", &SHARPENING)?;
        self.chromatic_px.check("finish.chromatic_px", &CHROMATIC)?;
        self.camera_blur_px.check("finish.camera_blur_px", &BLUR)?;
        shot.check("finish.camera_noise.shot", &NOISE)?;
        read.check("finish.camera_noise.read", &NOISE)?;
        if let Blur::Known(sigma_px) = self.blur_px {
            sigma_px.check("finish.blur_px", &BLUR)?;
        }
        self.noise.check()
    }
}

/// Gains that make light of a temperature look like light of 6504 K; green is unchanged.
pub fn white_balance(white_k: f64) -> LinearRgb {
    if white_k == NEUTRAL_K {
        return LinearRgb::WHITE;
    }
    let (wanted, seen) = (planckian(NEUTRAL_K), planckian(white_k));
    LinearRgb::new(
        relative_gain([wanted.r, wanted.g], [seen.r, seen.g]),
        1.0,
        relative_gain([wanted.b, wanted.g], [seen.b, seen.g]),
    )
}

/// The gain of a channel relative to green.
fn relative_gain([wanted, wanted_green]: [f32; 2], [seen, seen_green]: [f32; 2]) -> f32 {
    (wanted / wanted_green) / (seen / seen_green).max(f32::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_do_nothing_and_draw_nothing() {
        let finish = PostProcessRanges::default().draw(&Draws::new(3, 4), &Draws::new(3, 5));
        assert_eq!(finish, PostProcess::default());
        assert!(finish.is_identity());
    }

    #[test]
    fn a_warm_white_makes_the_frame_bluer() {
        let gains = white_balance(3000.0);
        assert!(
            gains.r < 0.8 && gains.g == 1.0 && gains.b > 2.0,
            "{gains:?}"
        );
        let balanced = planckian(3000.0) * gains;
        let neutral = planckian(NEUTRAL_K);
        assert!((balanced.r / balanced.b - neutral.r / neutral.b).abs() < 1e-5);
    }

    #[test]
    fn the_whites_that_are_taken_give_gains_that_a_scene_may_have() {
        let drawn_at = |white_k: f64| {
            let finish = PostProcessRanges {
                white_k: Range::fixed(white_k),
                ..PostProcessRanges::default()
            };
            finish.check()?;
            finish.draw(&Draws::new(3, 4), &Draws::new(3, 5)).check()
        };
        for end in [2000.0, 25_000.0] {
            assert!(drawn_at(end).is_ok(), "{end}");
        }
        let told = drawn_at(1700.0).unwrap_err().to_string();
        assert!(told.starts_with("finish.white_k: 1700"), "{told}");
    }

    #[test]
    fn what_cannot_be_right_is_told() {
        let reported = |spoil: fn(&mut PostProcess)| {
            let mut spoiled = PostProcess::default();
            assert!(spoiled.check().is_ok());
            spoil(&mut spoiled);
            spoiled.check().unwrap_err().to_string()
        };
        assert!(reported(|f| f.exposure_ev = f64::NAN).starts_with("finish.exposure_ev: NaN"));
        let black = reported(|f| f.white_balance = LinearRgb::BLACK);
        assert!(black.starts_with("finish.white_balance"));
        let negative = reported(|f| {
            f.noise = Noise::Known {
                shot: -1.0,
                read: 0.0,
            }
        });
        assert!(negative.starts_with("finish.noise.known.shot: -1,"));
        let read: PostProcess = toml::from_str("noise = 'match_plate'").unwrap();
        assert_eq!(read.noise, Noise::MatchPlate);
    }
}
