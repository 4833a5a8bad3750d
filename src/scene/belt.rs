//! A belt that carries objects past the camera: pictures come in sequences of the same objects.

use crate::bounds::Bounds;
use crate::error::Result;
use crate::scene::bounds::{BELT_SPEED, EXPOSURE_TIME, FRAME_RATE, FRAMES, TURN, WAY};
use crate::scene::{Draws, Range};
use serde::{Deserialize, Serialize};

/// Ranges of a recipe's belt: pictures `n frames` to `n frames + frames - 1` are sequence `n`,
/// whose objects fall once and are then carried along from picture to picture. In the middle of the
/// sequence they are where they came to rest.
///
/// Plate and camera do not move: photograph a belt with a visible pattern while it is running.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BeltRanges {
    /// Pictures per sequence.
    pub frames: u64,
    /// Pictures per second.
    pub frame_rate: f64,
    /// Metres per second.
    pub speed: Range,
    /// Direction of motion, degrees from the surface's width towards its height. Default: 0.
    #[serde(default)]
    pub direction_deg: Range,
    /// Exposure time, seconds: objects are blurred along the belt. Default: 0.
    #[serde(default)]
    pub exposure_s: Range,
}

/// Where a belt has carried the objects of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Belt {
    /// Number of the sequence in the dataset.
    pub sequence: u64,
    /// Number of the picture in the sequence, from 0.
    pub frame: u64,
    /// Pictures in the sequence.
    pub frames: u64,
    /// Pictures per second.
    pub frame_rate: f64,
    /// How far the objects are from where they came to rest, along x and y, metres.
    pub offset_m: [f64; 2],
    /// How far they move while the shutter is open, along x and y, metres.
    pub motion_m: [f64; 2],
}

impl Belt {
    /// Fails on the first impossible value.
    pub(super) fn check(&self) -> Result<()> {
        for along in self.offset_m {
            WAY.check("belt.offset_m", along)?;
        }
        for along in self.motion_m {
            WAY.check("belt.motion_m", along)?;
        }
        FRAME_RATE.check("belt.frame_rate", self.frame_rate)?;
        let last = self.frames.saturating_sub(1) as f64;
        Bounds::new(0.0, last, "the sequence").check("belt.frame", self.frame as f64)
    }
}

/// A picture's place in its sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SequencePlace {
    /// Number of the sequence.
    pub(crate) sequence: u64,
    /// Number of the sequence's first picture.
    pub(crate) first: u64,
    /// Number of the picture in the sequence.
    pub(crate) frame: u64,
}

impl BeltRanges {
    /// Where picture `k` of a dataset is in its sequence.
    pub(crate) fn place_of(&self, k: u64) -> SequencePlace {
        let frames = self.frames.max(1);
        let frame = k % frames;
        SequencePlace {
            sequence: k / frames,
            first: k - frame,
            frame,
        }
    }

    /// The belt at one picture; `draws` are those of its sequence.
    pub(super) fn draw(&self, draws: &Draws, place: SequencePlace) -> Belt {
        let angle = self.direction_deg.draw(draws, "belt.direction_deg");
        let speed = self.speed.draw(draws, "belt.speed");
        let exposure = self.exposure_s.draw(draws, "belt.exposure_s");
        let (sin, cos) = libm::sincos(angle.to_radians());
        let after = |seconds: f64| [cos, sin].map(|along| along * speed * seconds);
        let from_middle = place.frame as f64 - 0.5 * (self.frames - 1) as f64;
        Belt {
            sequence: place.sequence,
            frame: place.frame,
            frames: self.frames,
            frame_rate: self.frame_rate,
            offset_m: after(from_middle / self.frame_rate),
            motion_m: after(exposure),
        }
    }

    pub(super) fn check(&self) -> Result<()> {
        FRAMES.check("belt.frames", self.frames as f64)?;
        FRAME_RATE.check("belt.frame_rate", self.frame_rate)?;
        self.speed.check("belt.speed", &BELT_SPEED)?;
        self.direction_deg.check("belt.direction_deg", &TURN)?;
        self.exposure_s.check("belt.exposure_s", &EXPOSURE_TIME)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn belt() -> BeltRanges {
        toml::from_str(
            "frames = 5\nframe_rate = 10\nspeed = 0.5\ndirection_deg = 90\nexposure_s = 0.01",
        )
        .unwrap()
    }

    #[test]
    fn objects_pass_where_they_came_to_rest_in_the_middle_of_a_sequence() {
        let places = [10, 12, 14].map(|k| belt().place_of(k));
        assert_eq!(
            places.map(|p| (p.first, p.frame)),
            [(10, 0), (10, 2), (10, 4)]
        );
        let [early, middle, late] = places.map(|place| belt().draw(&Draws::new(0, 10), place));
        assert_eq!((middle.sequence, middle.frame, middle.frames), (2, 2, 5));
        assert_eq!(middle.offset_m, [0.0; 2]);
        assert!((late.offset_m[1] - 0.1).abs() < 1e-12 && late.offset_m[0].abs() < 1e-12);
        assert_eq!(early.offset_m, late.offset_m.map(|o| -o));
        assert!((late.motion_m[1] - 0.005).abs() < 1e-12);
    }

    #[test]
    fn impossible_belts_are_told() {
        let told = |change: fn(&mut BeltRanges)| {
            let mut belt = belt();
            change(&mut belt);
            belt.check().unwrap_err().to_string()
        };
        assert!(told(|b| b.frames = 0).contains("belt.frames: 0"));
        assert!(told(|b| b.frame_rate = 0.0).contains("belt.frame_rate: 0"));
        assert!(told(|b| b.speed = Range::fixed(-1.0)).contains("belt.speed: -1"));
        assert!(belt().check().is_ok());
        let unknown =
            toml::from_str::<BeltRanges>("frames = 5\nframe_rate = 10\nspeed = 1\nblur = 1");
        assert!(unknown.is_err());
    }
}
