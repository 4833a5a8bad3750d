//! Colours of plastic to choose from.

use crate::error::{Error, Result};
use crate::pixel::LinearRgb;
use crate::scene::bounds::{SHARE, WEIGHT};
use crate::scene::check::{check_each, check_factors, field};
use crate::scene::draw::weighted_place;
use crate::scene::{Draws, Range};
use serde::{Deserialize, Serialize};

/// Colours of PET bottles, as the transmittance of their plastic relative to clear plastic.
///
/// # Method
/// The mean transmittance of label-free plastic in the cut-outs of `tests/samples/bottles` (two
/// green, two brown and two light blue views), over that of the clear ones (0.74): both walls of a
/// bottle, scene-linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PlasticColor {
    /// As photographed.
    Clear,
    /// Water bottles.
    LightBlue,
    /// Lemonade bottles.
    Green,
    /// Bottles of beer and some juices.
    Brown,
}

impl PlasticColor {
    /// Transmittance of the dye.
    pub fn tint(self) -> LinearRgb {
        match self {
            Self::Clear => LinearRgb::WHITE,
            Self::LightBlue => LinearRgb::new(0.55, 0.80, 0.93),
            Self::Green => LinearRgb::new(0.25, 0.61, 0.32),
            Self::Brown => LinearRgb::new(0.44, 0.18, 0.10),
        }
    }
}

/// A colour to choose from: a name, its red, green and blue, or a table with a weight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected \"clear\", \"light_blue\", \"green\", \"brown\", three numbers, or { color = .., weight = .. }"
)]
pub enum PaletteEntry {
    /// With a weight of 1.
    Plain(PaletteColor),
    /// With a weight of its own.
    Weighted(WeightedColor),
}

/// A colour by name or by the transmittance of red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum PaletteColor {
    /// A colour of PET.
    Named(PlasticColor),
    /// Transmittance of the dye, scene-linear, 0 to 1.
    Known(LinearRgb),
}

/// A colour and its weight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WeightedColor {
    /// The colour.
    pub color: PaletteColor,
    /// Its weight relative to the others.
    pub weight: f64,
}

impl PaletteEntry {
    fn tint(&self) -> LinearRgb {
        let (Self::Plain(color) | Self::Weighted(WeightedColor { color, .. })) = *self;
        match color {
            PaletteColor::Named(name) => name.tint(),
            PaletteColor::Known(tint) => tint,
        }
    }

    fn weight(&self) -> f64 {
        match self {
            Self::Plain(_) => 1.0,
            Self::Weighted(weighted) => weighted.weight,
        }
    }

    fn check(&self, at: &str) -> Result<()> {
        WEIGHT.check(&field(at, "weight"), self.weight())?;
        check_factors(self.tint(), at, &SHARE)
    }
}

/// Fails on the first colour that is no transmittance, and if all weights are 0.
pub(super) fn check_palette(palette: &[PaletteEntry], at: &str) -> Result<()> {
    check_each(palette, at, PaletteEntry::check)?;
    if palette.is_empty() || palette.iter().any(|entry| entry.weight() > 0.0) {
        return Ok(());
    }
    let what = "all weights are 0, expected one above 0";
    Err(Error::value(at, what))
}

/// The tint at a path; white, and nothing drawn, if the palette is empty.
pub(super) fn draw_tint(palette: &[PaletteEntry], draws: &Draws, path: &str) -> LinearRgb {
    if palette.is_empty() {
        return LinearRgb::WHITE;
    }
    let weights: Vec<f64> = palette.iter().map(PaletteEntry::weight).collect();
    let number = Range::new(0.0, weights.iter().sum()).draw(draws, path);
    palette[weighted_place(&weights, number)].tint()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Serialize, Deserialize)]
    struct File {
        palette: Vec<PaletteEntry>,
    }

    fn read(text: &str) -> Vec<PaletteEntry> {
        let read: std::result::Result<File, _> = toml::from_str(&format!("palette = {text}"));
        read.unwrap().palette
    }

    #[test]
    fn names_numbers_and_weights_are_read_and_written_back() {
        let palette = read("['green', [0.5, 1, 0.25], { color = 'brown', weight = 3 }]");
        assert_eq!(palette[0].tint(), PlasticColor::Green.tint());
        assert_eq!(palette[1].tint(), LinearRgb::new(0.5, 1.0, 0.25));
        assert_eq!(palette[2].weight(), 3.0);
        let written = toml::to_string(&File {
            palette: palette.clone(),
        });
        let again: File = toml::from_str(&written.unwrap()).unwrap();
        assert_eq!(again.palette, palette);
    }

    #[test]
    fn colours_come_as_often_as_they_weigh() {
        let palette =
            read("['clear', { color = 'green', weight = 3 }, { color = [0, 0, 0], weight = 0 }]");
        let green = (0..4000).filter(|&k| {
            let tint = draw_tint(&palette, &Draws::new(1, k), "a");
            assert_ne!(tint, LinearRgb::BLACK);
            tint == PlasticColor::Green.tint()
        });
        // Binomial: standard deviation 27.
        assert!((green.count() as f64 - 3000.0).abs() < 5.0 * 27.0);
        assert_eq!(draw_tint(&[], &Draws::new(1, 2), "a"), LinearRgb::WHITE);
    }

    #[test]
    fn colours_that_no_plastic_has_are_refused() {
        let refused = |text| check_palette(&read(text), "p").unwrap_err().to_string();
        assert!(refused("[[0.5, 1.5, 0.2]]").starts_with("p[0]: [0.5, 1.5, 0.2], expected"));
        assert!(refused("[{ color = 'green', weight = -1 }]").starts_with("p[0].weight: -1,"));
        assert!(refused("[{ color = 'green', weight = 0 }]").contains("expected one above 0"));
        assert!(check_palette(&[], "p").is_ok());
        assert!(toml::from_str::<File>("palette = ['pink']").is_err());
    }
}
