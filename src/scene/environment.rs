//! Light from all around: an equirectangular environment map, as a scene names it and as a shot
//! holds it.

use crate::asset::Panorama;
use crate::error::{Error, Result};
use crate::geom::Vector3;
use crate::pixel::LinearRgb;
use crate::scene::bounds::{RADIANCE, TURN};
use crate::scene::{Draws, Range};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// An environment map as a scene names it; its light is added to the constant `ambient`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Environment {
    /// The picture: HDR or EXR, equirectangular, `+z` up.
    pub file: String,
    /// Rotation about `+z`, degrees: at 90 the world's `+x` shows what is at `+y` in the picture.
    /// Default: 0.
    #[serde(default)]
    pub rotation_deg: f64,
    /// Factor on its values. Default: 1.
    #[serde(default = "one")]
    pub strength: f64,
}

fn one() -> f64 {
    1.0
}

impl Environment {
    /// Whether it gives light, so that its picture is needed.
    pub fn shines(&self) -> bool {
        self.strength > 0.0
    }

    /// Fails on the first impossible value.
    pub(super) fn check(&self) -> Result<()> {
        if self.file.is_empty() {
            return Err(unnamed_picture("environment.file"));
        }
        TURN.check("environment.rotation_deg", self.rotation_deg)?;
        RADIANCE.check("environment.strength", self.strength)
    }
}

/// An environment map in memory: a shared picture and its rotation.
#[derive(Clone, Debug)]
pub struct EnvironmentMap {
    /// The picture.
    pub panorama: Arc<Panorama>,
    /// Rotation about `+z`, radians: a direction of the world is rotated by this before it is
    /// looked up.
    pub rotation: f64,
    /// Factor on its values.
    pub strength: f32,
}

impl EnvironmentMap {
    /// A picture, not rotated, at its own strength.
    pub fn new(panorama: Arc<Panorama>) -> Self {
        Self {
            panorama,
            rotation: 0.0,
            strength: 1.0,
        }
    }

    /// Radiance from a direction of the world.
    pub fn radiance(&self, direction: &Vector3<f64>) -> LinearRgb {
        self.panorama
            .radiance(&turned(direction, self.rotation))
            .scale(self.strength)
    }

    /// Unobstructed irradiance of a receiver with this unit normal.
    pub(crate) fn irradiance(&self, normal: &Vector3<f64>) -> LinearRgb {
        let all = self.panorama.irradiance(&turned(normal, self.rotation));
        LinearRgb::from(all.map(|e| e as f32)).scale(self.strength)
    }
}

/// A direction rotated about `+z`, counterclockwise as seen from above.
pub(crate) fn turned(direction: &Vector3<f64>, angle: f64) -> Vector3<f64> {
    let (sin, cos) = libm::sincos(angle);
    let d = direction;
    Vector3::new(cos * d.x - sin * d.y, sin * d.x + cos * d.y, d.z)
}

fn unnamed_picture(at: &str) -> Error {
    Error::value(at, "\"\", expected the name of a picture")
}

/// Ranges of a scene's environment map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EnvironmentRanges {
    /// Pictures to choose from, relative to the recipe; without any, scenes have no map. Default:
    /// none.
    pub files: Vec<String>,
    /// Rotation about the vertical, degrees. Default: `[-180, 180]`.
    pub rotation_deg: Range,
    /// Factor on the picture's values. Default: 1.
    pub strength: Range,
}

impl Default for EnvironmentRanges {
    fn default() -> Self {
        Self {
            files: Vec::new(),
            rotation_deg: Range::new(-180.0, 180.0),
            strength: Range::fixed(1.0),
        }
    }
}

impl EnvironmentRanges {
    /// A map with its rotation and strength; none if there are no files to choose from.
    pub(super) fn draw(&self, draws: &Draws) -> Option<Environment> {
        if self.files.is_empty() {
            return None;
        }
        let i = draws.choose("environment.file", self.files.len());
        Some(Environment {
            file: self.files[i].clone(),
            rotation_deg: self.rotation_deg.draw(draws, "environment.rotation_deg"),
            strength: self.strength.draw(draws, "environment.strength"),
        })
    }

    pub(super) fn check(&self) -> Result<()> {
        if let Some(i) = self.files.iter().position(String::is_empty) {
            return Err(unnamed_picture(&format!("environment.files[{i}]")));
        }
        self.rotation_deg.check("environment.rotation_deg", &TURN)?;
        self.strength.check("environment.strength", &RADIANCE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asset::direction_to_uv;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn a_quarter_turn_shows_y_at_x() {
        let [u, v] = direction_to_uv(&turned(&Vector3::x(), FRAC_PI_2));
        assert!((u - 0.25).abs() < 1e-12 && (v - 0.5).abs() < 1e-12);
    }

    fn lab() -> Environment {
        Environment {
            file: "lab.hdr".into(),
            rotation_deg: 0.0,
            strength: 1.0,
        }
    }

    #[test]
    fn a_file_needs_only_a_name() {
        let read: Environment = toml::from_str("file = 'lab.hdr'").unwrap();
        assert_eq!(read, lab());
        assert!(read.check().is_ok());
    }

    #[test]
    fn what_cannot_be_right_is_told() {
        let reported = |spoil: fn(&mut Environment)| {
            let mut spoiled = lab();
            spoil(&mut spoiled);
            spoiled.check().unwrap_err().to_string()
        };
        assert!(reported(|e| e.file.clear()).starts_with("environment.file"));
        assert!(reported(|e| e.rotation_deg = f64::NAN).starts_with("environment.rotation_deg"));
        assert!(reported(|e| e.strength = -1.0).starts_with("environment.strength: -1,"));
    }

    #[test]
    fn no_pictures_are_no_environment() {
        assert_eq!(EnvironmentRanges::default().draw(&Draws::new(1, 2)), None);
        let ranges = EnvironmentRanges {
            files: vec!["a.hdr".into(), "b.hdr".into()],
            ..Default::default()
        };
        let files: std::collections::BTreeSet<_> = (0..20)
            .filter_map(|k| ranges.draw(&Draws::new(1, k)))
            .map(|e| e.file)
            .collect();
        assert_eq!(files.len(), 2);
    }
}
