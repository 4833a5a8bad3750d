//! Cut-out: segmentation, screen colour and key in one go, trimmed to the object.

use super::key::{KeyOptions, Keying, Screen};
use super::remark::Remark;
use super::screen::{is_keyable, screen_color, screen_pixels};
use super::segment::{SegmentOptions, Segmentation, segment};
use crate::error::{Error, Result};
use crate::filter;
use crate::geom::Point2;
use crate::image::{Image, Roi};
use crate::pixel::{Coverage, LinearRgb, PremulRgba};
use serde::{Deserialize, Serialize};

/// How a photo becomes a cut-out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CutOutOptions {
    /// How the object is found.
    pub segment: SegmentOptions,
    /// How it is keyed.
    pub key: KeyOptions,
    /// Where the matte comes from; nothing = from the key where the screen has a colour. Default: nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<MatteMethod>,
    /// What the matte of a key is cut to. Default: `tight`.
    pub within: Within,
    /// Softness of the edge that the cut makes, standard deviation in pixels. Default: 0.8.
    pub soften_px: f32,
    /// Empty pixels kept around the hull. Default: 4.
    pub margin_px: usize,
    /// Longer side of the cut-out, pixels; larger ones are reduced to it. Default: 2048.
    pub longest_side: usize,
}

impl Default for CutOutOptions {
    fn default() -> Self {
        Self {
            segment: SegmentOptions::default(),
            key: KeyOptions::default(),
            method: None,
            within: Within::Tight,
            soften_px: 0.8,
            margin_px: 4,
            longest_side: 2048,
        }
    }
}

/// Where a matte comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MatteMethod {
    /// From the screen's colour: see-through plastic is see-through.
    Key,
    /// From the object's outline alone: nothing is see-through, and what shines through is part of the object.
    Outline,
}

/// What a key's matte is cut to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Within {
    /// The outline that follows hollows.
    #[default]
    Tight,
    /// The convex hull, as the paper has it: the screen's shadows stay in the hollows.
    Hull,
}

/// An object without its background.
#[derive(Clone, Debug)]
pub struct CutOut {
    /// The object, premultiplied, scene-linear, trimmed to its hull and a margin.
    pub image: Image<PremulRgba>,
    /// Convex hull of the object in pixels of `image`, clockwise as seen.
    pub hull: Vec<Point2<f64>>,
    /// The part of the photo that `image` shows.
    pub roi: Roi,
    /// Pixels of `image` for one pixel of the photo: 1 unless the cut-out had to be reduced.
    pub scale: f64,
    /// Colour of the screen, scene-linear.
    pub screen: LinearRgb,
    /// Where the matte came from.
    pub method: MatteMethod,
    /// Mean matte that the key leaves on the screen far from the object, where it should be 0; 0 for an outline.
    pub residue: f32,
    /// What a person should know, of the segmentation and of the key.
    pub remarks: Vec<Remark>,
    /// Where the object was found in the photo.
    pub segmentation: Segmentation,
}

/// A key that leaves more than this of the screen is worth a remark: what it leaves veils the object, too. An even screen
/// leaves 0.01 to 0.12 with one key colour for the whole picture.
const RESIDUE: f32 = 0.2;

/// Cuts the one object out of a photo on a uniform screen or board.
///
/// `photo` is scene-linear. A screen too grey to be keyed gives a matte from the outline, and a [`Remark`].
///
/// # Errors
/// Those of [`segment`]; [`Error::Value`] (`key.clip_black`, `soften_px`, ..) for an option that cannot be right.
pub fn cut_out(photo: &Image<LinearRgb>, opts: &CutOutOptions) -> Result<CutOut> {
    opts.check()?;
    let segmentation = segment(photo, &opts.segment).map_err(|e| e.within("segment"))?;
    let screen = screen_color(photo, &segmentation.mask)?;
    let method = opts.method.unwrap_or_else(|| method_for(screen));
    let (whole, residue) = match method {
        MatteMethod::Key => keyed(photo, screen, &segmentation, opts)?,
        MatteMethod::Outline => {
            let matte = softened(&segmentation.tight, opts.soften_px);
            (photo.zip_map(&matte, |p, m| p.opaque().masked(m)), 0.0)
        }
    };
    let roi = trimmed(&segmentation.hull, opts.margin_px, photo.size());
    let (image, scale) = reduced(whole.crop(roi), opts.longest_side);
    let corner = Point2::new(roi.x as f64, roi.y as f64);
    let hull = segmentation.hull.iter().map(|p| ((p - corner) * scale).into()).collect();
    let mut remarks = segmentation.remarks.clone();
    match method {
        MatteMethod::Outline if opts.method.is_none() => remarks.push(Remark::GreyScreen(screen)),
        MatteMethod::Key if residue > RESIDUE => remarks.push(Remark::Residue(residue)),
        _ => {}
    }
    Ok(CutOut { image, hull, roi, scale, screen, method, residue, remarks, segmentation })
}

impl CutOutOptions {
    fn check(&self) -> Result<()> {
        if !(0.0..=100.0).contains(&self.soften_px) {
            return Err(Error::value("soften_px", format!("{}, expected 0 to 100", self.soften_px)));
        }
        if self.longest_side < 16 {
            return Err(Error::value("longest_side", format!("{}, expected at least 16", self.longest_side)));
        }
        Ok(())
    }
}

fn method_for(screen: LinearRgb) -> MatteMethod {
    if is_keyable(screen) { MatteMethod::Key } else { MatteMethod::Outline }
}

fn keyed(
    photo: &Image<LinearRgb>,
    screen: LinearRgb,
    found: &Segmentation,
    opts: &CutOutOptions,
) -> Result<(Image<PremulRgba>, f32)> {
    let keyed = Keying::new(photo, Screen::Color(screen)).run(&opts.key).map_err(|e| e.within("key"))?;
    let residue = mean(&keyed.matte, &screen_pixels(&found.mask));
    let cut = match opts.within {
        Within::Tight => softened(&found.tight, opts.soften_px),
        Within::Hull => softened(&found.mask, opts.soften_px),
    };
    Ok((keyed.cutout.zip_map(&cut, |p, m| p.masked(m)), residue))
}

fn softened(mask: &Image<Coverage>, sigma_px: f32) -> Image<Coverage> {
    if sigma_px > 0.0 { filter::gaussian_blur(mask, sigma_px) } else { mask.clone() }
}

fn mean(matte: &Image<Coverage>, set: &Image<bool>) -> f32 {
    let chosen = matte.pixels().iter().zip(set.pixels()).filter(|(_, inside)| **inside);
    let (sum, count) = chosen.fold((0.0, 0u64), |(sum, count), (m, _)| (sum + f64::from(m.0), count + 1));
    if count == 0 { 0.0 } else { (sum / count as f64) as f32 }
}

/// The whole pixels that a hull and a margin around it cover.
fn trimmed(hull: &[Point2<f64>], margin_px: usize, (w, h): (usize, usize)) -> Roi {
    let range = |along: fn(&Point2<f64>) -> f64, len: usize| {
        let (low, high) = hull.iter().map(along).fold((f64::MAX, 0.0), |(l, h): (f64, f64), v| (l.min(v), h.max(v)));
        (low.max(0.0) as usize).min(len)..(high.ceil() as usize).min(len)
    };
    Roi::spanning(range(|p| p.x, w), range(|p| p.y, h)).grown(margin_px, w, h)
}

/// A picture no larger than `longest`, and its pixels for one of before.
fn reduced(image: Image<PremulRgba>, longest: usize) -> (Image<PremulRgba>, f64) {
    let (w, h) = image.size();
    if w.max(h) <= longest {
        return (image, 1.0);
    }
    let scale = longest as f64 / w.max(h) as f64;
    let side = |len: usize| ((len as f64 * scale).round() as usize).max(1);
    (filter::resize(&image, side(w), side(h)), scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GREEN: LinearRgb = LinearRgb::new(0.04, 0.4, 0.08);

    /// A slab of 60 x 30 pixels with its corner at (30, 25).
    fn slab(screen: LinearRgb) -> Image<LinearRgb> {
        Image::from_fn(120, 80, |x, y| {
            let inside = (30..90).contains(&x) && (25..55).contains(&y);
            if inside { LinearRgb::new(0.5, 0.05, 0.05) } else { screen }
        })
    }

    #[test]
    fn a_coloured_screen_is_keyed_and_gone() {
        let cut = cut_out(&slab(GREEN), &CutOutOptions::default()).unwrap();
        assert_eq!(cut.method, MatteMethod::Key);
        assert!((cut.screen.g - GREEN.g).abs() < 1e-6 && cut.residue < 1e-6);
        let (w, h) = cut.image.size();
        assert_eq!(cut.image[(0, 0)], PremulRgba::TRANSPARENT);
        assert!((cut.image[(w / 2, h / 2)].a - 1.0).abs() < 1e-5);
        assert!(w.abs_diff(68) <= 2 && h.abs_diff(38) <= 2, "{w} x {h}: the slab and 4 pixels around it");
    }

    #[test]
    fn a_white_board_gives_an_opaque_object() {
        let cut = cut_out(&slab(LinearRgb::new(0.6, 0.62, 0.7)), &CutOutOptions::default()).unwrap();
        assert_eq!(cut.method, MatteMethod::Outline);
        let centre = cut.image[(cut.image.width() / 2, cut.image.height() / 2)];
        assert!((centre.a - 1.0).abs() < 1e-5 && (centre.r - 0.5).abs() < 1e-5);
        assert_eq!(cut.image[(0, 0)].a, 0.0);
    }

    #[test]
    fn the_hull_is_told_in_pixels_of_the_cut_out() {
        let whole = cut_out(&slab(GREEN), &CutOutOptions::default()).unwrap();
        let left = |cut: &CutOut| cut.hull.iter().map(|p| p.x).fold(f64::MAX, f64::min);
        assert!((left(&whole) + whole.roi.x as f64 - 30.0).abs() <= 1.0);
        let half = CutOutOptions { longest_side: whole.image.width() / 2, ..Default::default() };
        let half = cut_out(&slab(GREEN), &half).unwrap();
        assert!((left(&half) - 0.5 * left(&whole)).abs() < 0.1 && (half.scale - 0.5).abs() < 0.01);
    }

    #[test]
    fn options_are_a_toml_table_and_named_where_they_are_wrong() {
        let opts: CutOutOptions = toml::from_str(
            "method = \"key\"\nwithin = \"hull\"\n[segment]\nlevels = 5\nfirst_threshold = { noise = 8.0 }\n[key]\nclip_black = 0.1\n",
        )
        .unwrap();
        assert_eq!((opts.within, opts.segment.first_threshold), (Within::Hull, super::super::Threshold::Noise(8.0)));
        let back: CutOutOptions = toml::from_str(&toml::to_string(&opts).unwrap()).unwrap();
        assert_eq!(back, opts);
        let wrong = CutOutOptions { segment: SegmentOptions { levels: 99, ..Default::default() }, ..opts };
        let said = cut_out(&slab(GREEN), &wrong).unwrap_err().to_string();
        assert_eq!(said, "segment.levels: 99, expected 2 to 8");
    }
}
