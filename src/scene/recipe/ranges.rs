//! Ranges of an object's colours and of a light.

use crate::bounds::Bounds;
use crate::color::planckian;
use crate::error::Result;
use crate::pixel::LinearRgb;
use crate::scene::bounds::{GRADE, KELVIN, LIGHT_HEIGHT, LIGHT_OFFSET, LIGHT_SIZE, RADIANCE, TURN};
use crate::scene::check::check_each;
use crate::scene::palette::{PaletteEntry, check_palette, draw_tint};
use crate::scene::{AreaLight, Draws, Grade, LightShape, Range};
use serde::{Deserialize, Serialize};

/// Change of an object's colours, see [`Grade`](crate::scene::Grade).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GradeRanges {
    /// Hue shift, degrees. Default: `[-20, 20]`.
    pub hue_deg: Range,
    /// Factor. Default: `[0.8, 1.2]`.
    pub saturation: Range,
    /// Factor. Default: `[0.8, 1.2]`.
    pub value: Range,
    /// Colours of see-through plastic to choose from instead of a hue shift; they are dyes on top
    /// of the plastic's own colour. Default: none.
    pub palette: Vec<PaletteEntry>,
    /// Factor on glints, which come from the studio's light. Default: 1.
    pub glints: Range,
}

/// An area light that faces the centre of the surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LightRanges {
    /// Shape. Default: `ellipse`.
    pub shape: LightShape,
    /// Height over the surface, metres. Default: `[0.8, 1.6]`.
    pub height: Range,
    /// Distance from the vertical through the surface's centre, metres. Default: `[0.0, 0.8]`.
    pub offset: Range,
    /// Direction of that offset, degrees from `+x` towards `+y`. Default: `[-180, 180]`.
    pub azimuth_deg: Range,
    /// Side length or diameter, metres: softness. Default: `[0.05, 0.6]`.
    pub size: Range,
    /// Power, watts; it cancels out if a single light is matched to the plate. Default: `10`.
    pub power: Range,
    /// Red, green and blue, scene-linear. Default: `[1, 1, 1]`.
    pub color: [Range; 3],
    /// Colour temperature, kelvin, 1667 to 25 000, on top of `color`; power keeps its luminance.
    /// Default: that of white.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature_k: Option<Range>,
}

impl Default for GradeRanges {
    fn default() -> Self {
        Self {
            hue_deg: Range::new(-20.0, 20.0),
            saturation: Range::new(0.8, 1.2),
            value: Range::new(0.8, 1.2),
            palette: Vec::new(),
            glints: Range::fixed(1.0),
        }
    }
}

impl Default for LightRanges {
    fn default() -> Self {
        Self {
            shape: LightShape::Ellipse,
            height: Range::new(0.8, 1.6),
            offset: Range::new(0.0, 0.8),
            azimuth_deg: Range::new(-180.0, 180.0),
            size: Range::new(0.05, 0.6),
            power: Range::fixed(10.0),
            color: [Range::fixed(1.0); 3],
            temperature_k: None,
        }
    }
}

impl GradeRanges {
    /// Colours as in the photo.
    pub const UNCHANGED: Self = Self {
        hue_deg: Range::fixed(0.0),
        saturation: Range::fixed(1.0),
        value: Range::fixed(1.0),
        palette: Vec::new(),
        glints: Range::fixed(1.0),
    };

    /// The colour change of an object at a path.
    pub(super) fn draw(&self, draws: &Draws, path: &str) -> Grade {
        Grade {
            hue_deg: self.draw_hue(draws, path) as f32,
            saturation: self.saturation.draw_field(draws, path, "saturation") as f32,
            value: self.value.draw_field(draws, path, "value") as f32,
            tint: draw_tint(&self.palette, draws, &format!("{path}.palette")),
            glints: self.draw_glints(draws, path) as f32,
        }
    }

    /// Hue shift, degrees; none if there is a palette.
    fn draw_hue(&self, draws: &Draws, path: &str) -> f64 {
        if self.palette.is_empty() {
            self.hue_deg.draw_field(draws, path, "hue_deg")
        } else {
            0.0
        }
    }

    fn draw_glints(&self, draws: &Draws, path: &str) -> f64 {
        if self.glints == Range::fixed(1.0) {
            1.0
        } else {
            self.glints.draw_field(draws, path, "glints")
        }
    }

    pub(super) fn check(&self) -> Result<()> {
        self.hue_deg.check("grade.hue_deg", &TURN)?;
        self.saturation.check("grade.saturation", &GRADE)?;
        self.value.check("grade.value", &GRADE)?;
        self.glints.check("grade.glints", &GRADE)?;
        check_palette(&self.palette, "grade.palette")
    }
}

impl LightRanges {
    pub(super) fn draw(&self, draws: &Draws, path: &str) -> AreaLight {
        let [x, y] = self.draw_offset(draws, path);
        let color = self.draw_color(draws, path);
        AreaLight {
            shape: self.shape,
            position: [x, y, self.height.draw_field(draws, path, "height")],
            target: [0.0; 3],
            size: [self.size.draw_field(draws, path, "size"); 2],
            power: self.power.draw_field(draws, path, "power"),
            color,
        }
    }

    /// Position over the surface, from its centre.
    fn draw_offset(&self, draws: &Draws, path: &str) -> [f64; 2] {
        let offset = self.offset.draw_field(draws, path, "offset");
        let azimuth = self.azimuth_deg.draw_field(draws, path, "azimuth_deg");
        let azimuth = azimuth.to_radians();
        [offset * libm::cos(azimuth), offset * libm::sin(azimuth)]
    }

    fn draw_color(&self, draws: &Draws, path: &str) -> LinearRgb {
        let tint =
            [0, 1, 2].map(|c| self.color[c].draw(draws, &format!("{path}.color[{c}]")) as f32);
        LinearRgb::from(tint) * self.draw_glow(draws, path)
    }

    /// The colour of its temperature.
    fn draw_glow(&self, draws: &Draws, path: &str) -> LinearRgb {
        self.temperature_k.map_or(LinearRgb::WHITE, |range| {
            planckian(range.draw_field(draws, path, "temperature_k"))
        })
    }

    /// The light at the middle of its ranges, its size still varying.
    pub(super) fn at_middle(&self) -> Self {
        Self {
            height: self.height.middle(),
            offset: self.offset.middle(),
            azimuth_deg: self.azimuth_deg.middle(),
            power: self.power.middle(),
            color: self.color.map(|range| range.middle()),
            temperature_k: self.temperature_k.map(|range| range.middle()),
            ..*self
        }
    }

    pub(super) fn check(&self, at: &str) -> Result<()> {
        for (name, range, bounds) in self.bounded_ranges() {
            range.check(&format!("{at}.{name}"), bounds)?;
        }
        Range::check_optional(self.temperature_k, &format!("{at}.temperature_k"), &KELVIN)?;
        check_each(&self.color, &format!("{at}.color"), |range, at| {
            range.check(at, &RADIANCE)
        })
    }

    fn bounded_ranges(&self) -> [(&str, &Range, &Bounds); 5] {
        [
            ("height", &self.height, &LIGHT_HEIGHT),
            ("offset", &self.offset, &LIGHT_OFFSET),
            ("azimuth_deg", &self.azimuth_deg, &TURN),
            ("size", &self.size, &LIGHT_SIZE),
            ("power", &self.power, &RADIANCE),
        ]
    }
}
