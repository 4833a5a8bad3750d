//! Photos that are hard to cut out: each must come out right, or say that it may not have.
//!
//! The bottle is made in code: a waisted body of film with a rim, glints, a striped label and a cap, in its own soft shadow.

use petcomp::matte::{CutOut, CutOutOptions, MatteMethod, cut_out};
use petcomp::{Error, Image, LinearRgb};
use rand::{RngExt, SeedableRng};

const GREEN: LinearRgb = LinearRgb::new(0.04, 0.4, 0.08);
const BLUE: LinearRgb = LinearRgb::new(0.03, 0.06, 0.35);
const RED: LinearRgb = LinearRgb::new(0.5, 0.03, 0.04);

/// What a photo is taken of, and how.
struct Take {
    size: (usize, usize),
    screen: LinearRgb,
    cap: LinearRgb,
    /// Standard deviation of the sensor's noise.
    noise: f32,
    /// The screen loses this share of its light from one corner to the other.
    uneven: f32,
    /// Everything is so much brighter before the sensor saturates at 1.
    exposure: f32,
    /// Middles of the bottles, as shares of the width and height.
    at: Vec<[f64; 2]>,
    /// Length of a bottle as a share of the width.
    length: f64,
}

impl Default for Take {
    fn default() -> Self {
        Self {
            size: (600, 320),
            screen: GREEN,
            cap: RED,
            noise: 0.003,
            uneven: 0.1,
            exposure: 1.0,
            at: vec![[0.5, 0.5]],
            length: 0.8,
        }
    }
}

/// Light added and transmittance at a point of a bottle 2 long; nothing beside it.
fn bottle(x: f64, y: f64, cap: LinearRgb) -> Option<(LinearRgb, f32)> {
    let half = if x < 0.78 { 0.36 - 0.1 * (1.0 - (x / 0.5).powi(2)).max(0.0) } else { 0.12 };
    let ends = if x < 0.0 { 0.36 * (1.0 - (((-x - 0.8).max(0.0)) / 0.2).powi(2)).max(0.0).sqrt() } else { half };
    let (half, neck) = (half.min(ends), 0.36 - (x - 0.5).max(0.0) * 0.85);
    let half = if (0.5..0.78).contains(&x) { half.min(neck) } else { half };
    if !(-1.0..1.0).contains(&x) || y.abs() >= half {
        return None;
    }
    if x > 0.86 {
        return Some((cap, 0.0));
    }
    if (-0.1..0.3).contains(&x) {
        let stripe = (x * 20.0).floor() as i64 % 2 == 0;
        return Some((if stripe { LinearRgb::grey(0.7) } else { LinearRgb::new(0.4, 0.1, 0.05) }, 0.0));
    }
    let rim = half - y.abs() < 0.03 || x < -0.97;
    let glint = (x * 37.0 + y * 61.0).sin() * (x * 11.0 - y * 29.0).cos() > 0.8;
    Some(match (rim, glint) {
        (_, true) => (LinearRgb::grey(0.8), 0.5),
        (true, false) => (LinearRgb::grey(0.05), 0.5),
        (false, false) => (LinearRgb::grey(0.02), 0.8),
    })
}

impl Take {
    /// Where a pixel's point lies on bottle `i`, which is tilted a little.
    fn on(&self, i: usize, x: f64, y: f64) -> (f64, f64) {
        let (w, h) = (self.size.0 as f64, self.size.1 as f64);
        let unit = self.length * w / 2.0;
        let (x, y) = ((x - self.at[i][0] * w) / unit, (y - self.at[i][1] * h) / unit);
        let (sin, cos) = 0.1_f64.sin_cos();
        (cos * x + sin * y, cos * y - sin * x)
    }

    fn seen(&self, x: f64, y: f64) -> LinearRgb {
        let (w, h) = (self.size.0 as f64, self.size.1 as f64);
        let light = 1.0 - self.uneven * ((0.7 * x / w + 0.3 * y / h) as f32);
        let shadow = (0..self.at.len()).map(|i| self.on(i, x, y)).map(|(u, v)| {
            let beyond = ((u.abs() - 0.9).max(0.0).powi(2) + (v.abs() - 0.25).max(0.0).powi(2)) / 0.02;
            1.0 - 0.2 * (-beyond).exp() as f32
        });
        let behind = self.screen.scale(shadow.fold(1.0, |all, s| all * s));
        let there = (0..self.at.len()).find_map(|i| {
            let (u, v) = self.on(i, x, y);
            bottle(u, v, self.cap)
        });
        there.map_or(behind, |(f, t)| f + behind.scale(t)).scale(light * self.exposure)
    }

    /// The photo in 8 bits, and which pixels show a bottle.
    fn taken(&self) -> (Image<LinearRgb>, Image<bool>) {
        const OFFSETS: [[f64; 2]; 4] = [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]];
        let (w, h) = self.size;
        let mut photo = Image::from_fn(w, h, |x, y| {
            let sum = OFFSETS.iter().map(|[u, v]| self.seen(x as f64 + u, y as f64 + v));
            sum.fold(LinearRgb::BLACK, |a, b| a + b).scale(0.25)
        });
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        for p in photo.pixels_mut() {
            *p = p.map(|v| {
                let normal = (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0;
                let code = 255.0 * petcomp::color::linear_to_srgb((v + self.noise * normal).clamp(0.0, 1.0));
                petcomp::color::srgb_to_linear(code.round() / 255.0)
            });
        }
        let mask = Image::from_fn(w, h, |x, y| {
            (0..self.at.len()).any(|i| {
                let (u, v) = self.on(i, x as f64 + 0.5, y as f64 + 0.5);
                bottle(u, v, self.cap).is_some()
            })
        });
        (photo, mask)
    }

    fn cut(&self) -> Result<(CutOut, Quality), Error> {
        let (photo, mask) = self.taken();
        let cut = cut_out(&photo, &CutOutOptions::default())?;
        let quality = Quality::of(&cut, &mask);
        Ok((cut, quality))
    }
}

#[derive(Debug)]
struct Quality {
    iou: f64,
    box_px: f64,
    doubts: Vec<String>,
}

impl Quality {
    fn of(cut: &CutOut, mask: &Image<bool>) -> Self {
        let found = cut.segmentation.tight.map(|c| c.0 >= 0.5);
        let count = |holds: fn(bool, bool) -> bool| {
            found.pixels().iter().zip(mask.pixels()).filter(|(a, b)| holds(**a, **b)).count() as f64
        };
        let (w, h) = mask.size();
        let columns = || (0..w).filter(|&x| (0..h).any(|y| mask[(x, y)]));
        let rows = || (0..h).filter(|&y| (0..w).any(|x| mask[(x, y)]));
        let truth = [columns().next(), rows().next(), columns().last().map(|x| x + 1), rows().last().map(|y| y + 1)];
        let hull = &cut.segmentation.hull;
        let least = |of: fn(&petcomp::geom::Point2<f64>) -> f64| hull.iter().map(of).fold(f64::MAX, f64::min);
        let sides = [least(|p| p.x), least(|p| p.y), -least(|p| -p.x), -least(|p| -p.y)];
        let off = sides.iter().zip(truth).map(|(a, b)| (a - b.unwrap_or(0) as f64).abs());
        Self {
            iou: count(|a, b| a && b) / count(|a, b| a || b),
            box_px: off.fold(0.0, f64::max),
            doubts: cut.remarks.iter().filter(|r| r.is_doubt()).map(ToString::to_string).collect(),
        }
    }

    /// The bounds of the promise, for a picture whose pixels are `scale` times those of the search.
    fn is_right(&self, scale: f64) -> bool {
        self.iou >= 0.95 && self.box_px <= 2.0 * scale.max(1.0)
    }
}

/// Right without a doubt.
fn assert_right(take: &Take) -> CutOut {
    let (cut, quality) = take.cut().unwrap();
    assert!(quality.is_right(cut.segmentation.reduction), "{quality:?} {:?}", cut.segmentation.confidence);
    assert!(quality.doubts.is_empty(), "{quality:?} {:?}", cut.segmentation.confidence);
    cut
}

/// Right, or in doubt, or refused; never silently wrong.
fn assert_right_or_told(take: &Take) {
    if let Ok((cut, quality)) = take.cut() {
        let right = quality.is_right(cut.segmentation.reduction);
        assert!(right || !quality.doubts.is_empty(), "silently wrong: {quality:?} {:?}", cut.segmentation.confidence);
    }
}

fn refusal(take: &Take) -> String {
    take.cut().err().expect("a photo that must be refused").to_string()
}

#[test]
fn a_plain_photo_comes_out_right_on_either_screen() {
    for screen in [GREEN, BLUE] {
        let cut = assert_right(&Take { screen, ..Take::default() });
        assert_eq!(cut.method, MatteMethod::Physical);
        assert!(cut.residue < 0.003, "{}", cut.residue);
    }
}

#[test]
fn a_cap_of_the_screens_hue_is_found() {
    assert_right_or_told(&Take { cap: LinearRgb::new(0.02, 0.25, 0.05), ..Take::default() });
}

#[test]
fn a_grey_screen_gives_an_opaque_object_and_says_so() {
    let cut = assert_right(&Take { screen: LinearRgb::new(0.5, 0.52, 0.5), ..Take::default() });
    assert_eq!(cut.method, MatteMethod::Outline);
}

#[test]
fn clipped_highlights_do_no_harm() {
    assert_right(&Take { exposure: 1.8, ..Take::default() });
}

#[test]
fn a_photo_that_is_clipped_all_over_is_right_or_told() {
    assert_right_or_told(&Take { exposure: 3.0, ..Take::default() });
}

#[test]
fn heavy_noise_is_right_or_told() {
    for screen in [GREEN, BLUE] {
        assert_right_or_told(&Take { noise: 0.03, screen, ..Take::default() });
    }
}

#[test]
fn a_screen_uneven_by_sixty_percent_does_no_harm() {
    let cut = assert_right(&Take { uneven: 0.6, ..Take::default() });
    assert!((cut.unevenness - 0.6).abs() < 0.1, "{}", cut.unevenness);
    assert!(cut.residue < 0.003, "{}", cut.residue);
}

#[test]
fn an_object_over_the_border_is_told() {
    let (_, quality) = Take { at: vec![[0.2, 0.5]], ..Take::default() }.cut().unwrap();
    assert!(quality.doubts.iter().any(|d| d.contains("left border")), "{quality:?}");
}

#[test]
fn two_objects_are_refused() {
    let said = refusal(&Take { at: vec![[0.25, 0.5], [0.75, 0.5]], length: 0.4, ..Take::default() });
    assert!(said.contains("two objects"), "{said}");
}

#[test]
fn an_empty_screen_is_refused() {
    for uneven in [0.0, 0.6] {
        assert!(refusal(&Take { at: vec![], uneven, ..Take::default() }).contains("is there an object"));
    }
}

#[test]
fn twelve_megapixels_come_out_right() {
    let cut = assert_right(&Take { size: (4000, 3000), ..Take::default() });
    assert_eq!(cut.film.width().max(cut.film.height()), CutOutOptions::default().longest_side);
}

#[test]
fn a_photo_of_64_pixels_is_right_or_told() {
    for screen in [GREEN, BLUE] {
        assert_right_or_told(&Take { size: (64, 64), screen, ..Take::default() });
    }
}
