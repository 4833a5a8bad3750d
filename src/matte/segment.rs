//! Segmentation: where the object is, from two bands of a Laplacian pyramid.

mod band;
mod cluster;
mod hull;
mod threshold;

pub use band::Tone;
pub use threshold::Threshold;

use super::remark::Remark;
use crate::error::{Error, Result};
use crate::filter;
use crate::geom::Point2;
use crate::image::Image;
use crate::pixel::{Coverage, LinearRgb};
use band::Bands;
use cluster::Groups;
use serde::{Deserialize, Serialize};

/// How an object is found on a uniform background.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SegmentOptions {
    /// What the pyramid is made of. Default: each channel by itself.
    pub tone: Tone,
    /// Which band of the pyramid is the coarse one, 2 to 8; the fine one is the first. Default: 4.
    pub levels: usize,
    /// Cut of the first band. Default: Otsu.
    pub first_threshold: Threshold,
    /// Cut of the last band. Default: Otsu.
    pub last_threshold: Threshold,
    /// An edge stands out at least so many times the noise, whatever the cut of the first band. Default: 6.
    pub least_contrast: f32,
    /// An edge pixel is at least so strong beside the strongest within 2 pixels, 0 to 1: thins edges. Default: 0.6.
    pub ridge: f32,
    /// Groups of fewer edge pixels are dirt or noise. Default: 4.
    pub speck: usize,
    /// Edges nearer to each other than this share of the longer side belong together. Default: 0.04.
    pub join: f64,
    /// Longer side of the picture that is searched, pixels; larger photos are reduced to it. Default: 1024.
    pub working_size: usize,
}

impl Default for SegmentOptions {
    fn default() -> Self {
        Self {
            tone: Tone::Channels,
            levels: 4,
            first_threshold: Threshold::Otsu,
            last_threshold: Threshold::Otsu,
            least_contrast: 6.0,
            ridge: 0.6,
            speck: 4,
            join: 0.04,
            working_size: 1024,
        }
    }
}

/// Where the object is in a photo.
#[derive(Clone, Debug)]
pub struct Segmentation {
    /// Coverage of the hull, of the photo's size.
    pub mask: Image<Coverage>,
    /// Coverage of the object as far as its edges tell: like the hull, but follows hollows. Of the photo's size.
    pub tight: Image<Coverage>,
    /// Convex hull of the object, pixel-corner coordinates of the photo, clockwise as seen.
    pub hull: Vec<Point2<f64>>,
    /// Whether the object reaches the left, top, right and bottom border of the photo: then part of it is missing.
    pub touches: [bool; 4],
    /// What a person should know.
    pub remarks: Vec<Remark>,
    /// Every intermediate picture, in the order of the work.
    pub steps: Vec<Step>,
}

/// An intermediate picture of the segmentation.
#[derive(Clone, Debug)]
pub struct Step {
    /// What it is: a file name without ending.
    pub name: &'static str,
    /// The picture, of the size that was searched; bands are in units of noise.
    pub image: Image<Coverage>,
}

impl Step {
    /// The picture in the range 0 to 1 that files show: where values go above 1, their logarithms as shares of the
    /// largest.
    pub fn shown(&self) -> Image<Coverage> {
        let most = self.image.pixels().iter().fold(0.0f32, |most, c| most.max(c.0));
        if most <= 1.0 {
            return self.image.clone();
        }
        let scale = 1.0 / libm::log1pf(most);
        self.image.map(|c| Coverage(scale * libm::log1pf(c.0.max(0.0))))
    }
}

/// Finds the one object on a uniform background.
///
/// `photo` is scene-linear, at least 32 pixels a side. The object may reach the border of the photo (which is warned
/// of), but not all four.
///
/// # Method
/// A cut of a Laplacian pyramid ([Burt and Adelson 1983]): the first and the last band, brought to full size, are
/// binarised and combined by AND. Noise has no coarse structure and soft shadows have no fine one, so that what is left
/// are the object's edges; the hull is theirs. Departs from the plain method in that
/// * bands are those of the square roots of the three channels, in units of their noise along the border ([`Tone`]);
/// * the thresholds are Otsu's on a logarithmic scale ([`Threshold`]);
/// * the last band is spread by one of its pixels, since it passes through 0 on an edge;
/// * edges are thinned to their ridge and specks dropped;
/// * edges nearer than `join` form clusters, and only the cluster of most edge pixels is kept, so that dirt far away
///   does not blow up the hull.
/// # Errors
/// [`Error::Photo`] when there is nothing, only a speck, more than one object, or no background around the object;
/// [`Error::Value`] for an option that cannot be right.
///
/// [Burt and Adelson 1983]: https://doi.org/10.1109/TCOM.1983.1095851
pub fn segment(photo: &Image<LinearRgb>, opts: &SegmentOptions) -> Result<Segmentation> {
    opts.check()?;
    check_photo(photo)?;
    let small = reduced(photo, opts.working_size);
    let Bands { first, last } = Bands::of(&small, opts.tone, opts.levels);
    let first_cut = opts.first_threshold.of(&first).max(opts.least_contrast);
    let last_cut = opts.last_threshold.of(&last);
    let first_binary = first.map(|c| c.0 > first_cut);
    let last_binary = last.map(|c| c.0 > last_cut);
    let both = first_binary.zip_map(&last_binary, |a, b| a && b);
    let edges = cluster::without_specks(&thinned(&both, &first, opts.ridge), opts.speck);
    let join_px = opts.join * longer_side(&small) as f64;
    let (object, mut remarks) = main_cluster(&edges, join_px)?;
    let hull = scaled(&hull::convex_hull(&object), small.size(), photo.size());
    let touches = touches(&object);
    check_object(&hull, touches, photo.size())?;
    remarks.extend(truncation(touches));
    let tight = shown(&enclosed(&object, join_px));
    let steps = [
        ("grey", band::root(&small, [1.0; 3])),
        ("first_band", first),
        ("last_band", last),
        ("first_binary", shown(&first_binary)),
        ("last_binary", shown(&last_binary)),
        ("both", shown(&both)),
        ("edges", shown(&edges)),
        ("object", shown(&object)),
    ];
    Ok(Segmentation {
        mask: hull::coverage(&hull, photo.width(), photo.height()),
        tight: filter::resize(&tight, photo.width(), photo.height()),
        hull,
        touches,
        remarks,
        steps: steps.map(|(name, image)| Step { name, image }).into(),
    })
}

impl SegmentOptions {
    /// # Errors
    /// [`Error::Value`] for the first option that cannot be right.
    fn check(&self) -> Result<()> {
        if !(2..=8).contains(&self.levels) {
            return Err(Error::value("levels", format!("{}, expected 2 to 8", self.levels)));
        }
        let share = |at: &str, value: f64| match (0.0..=1.0).contains(&value) {
            true => Ok(()),
            false => Err(Error::value(at, format!("{value}, expected 0 to 1"))),
        };
        share("ridge", f64::from(self.ridge))?;
        share("join", self.join)?;
        let weights = if let Tone::Grey(weights) = self.tone { weights } else { [1.0; 3] };
        if !weights.iter().all(|w| (0.0..=1e6).contains(w)) || weights == [0.0; 3] {
            return Err(Error::value("tone.grey", format!("{weights:?}, expected weights of 0 to 1e6, not all 0")));
        }
        if self.working_size < SMALLEST {
            return Err(Error::value("working_size", format!("{}, expected at least {SMALLEST}", self.working_size)));
        }
        Ok(())
    }
}

/// Shortest side that can hold an object and its background, pixels.
const SMALLEST: usize = 32;

fn check_photo(photo: &Image<LinearRgb>) -> Result<()> {
    let (w, h) = photo.size();
    if w.min(h) < SMALLEST {
        return Err(refused(format!("the photo is {w} x {h} pixels, expected at least {SMALLEST} x {SMALLEST}")));
    }
    match photo.pixels().iter().position(|p| !p.is_finite()) {
        Some(i) => Err(refused(format!("pixel ({}, {}) is not a finite number", i % w, i / w))),
        None => Ok(()),
    }
}

fn refused(what: impl Into<String>) -> Error {
    Error::Photo { what: what.into() }
}

fn longer_side<P: Copy>(image: &Image<P>) -> usize {
    image.width().max(image.height())
}

/// The photo, or a copy whose longer side is `working_size`.
fn reduced(photo: &Image<LinearRgb>, working_size: usize) -> std::borrow::Cow<'_, Image<LinearRgb>> {
    let longer = longer_side(photo);
    if longer <= working_size {
        return std::borrow::Cow::Borrowed(photo);
    }
    let side = |len: usize| (len * working_size).div_ceil(longer).max(SMALLEST);
    std::borrow::Cow::Owned(filter::resize(photo, side(photo.width()), side(photo.height())))
}

fn shown(set: &Image<bool>) -> Image<Coverage> {
    set.map(|p| Coverage(f32::from(u8::from(p))))
}

/// How far the first band smears an edge, pixels: the reach of its kernel.
const SMEAR: usize = 2;

/// The edge pixels that are not merely the smear of a stronger one.
fn thinned(edges: &Image<bool>, band: &Image<Coverage>, ridge: f32) -> Image<bool> {
    Image::from_fn(edges.width(), edges.height(), |x, y| {
        edges[(x, y)] && band[(x, y)].0 >= ridge * band::largest_around(band, x, y, SMEAR).0
    })
}

/// Two clusters are two objects when the smaller one has at least this share of the larger one's edge pixels.
const RIVAL: f64 = 0.3;
/// A smaller cluster is worth a warning from this share on.
const REMNANT: f64 = 0.05;

/// The edges of the one object.
///
/// Edges nearer to each other than `join_px` form a cluster; the object is the cluster of most edge pixels and what
/// lies inside its hull. A cluster outside it is an error if it could be an object of its own, else it is left out.
fn main_cluster(edges: &Image<bool>, join_px: f64) -> Result<(Image<bool>, Vec<Remark>)> {
    let groups = Groups::of(&filter::dilate(edges, join_px / 2.0));
    let sizes = groups.sizes(edges);
    let Some(main) = (0..sizes.len()).max_by_key(|&i| (sizes[i], std::cmp::Reverse(i))) else {
        return Err(refused(
            "nothing stands out from what is along the borders; is there an object, in focus, with background all around it?",
        ));
    };
    let member = |i: usize| groups.only(move |group| group == i).zip_map(edges, |near, edge| near && edge);
    let object = member(main);
    let hull = hull::coverage(&hull::convex_hull(&object), edges.width(), edges.height()).map(|c| c.0 > 0.0);
    let inside = groups.sizes(&edges.zip_map(&hull, |edge, inside| edge && inside));
    let mut remarks = Vec::new();
    for i in (0..sizes.len()).filter(|&i| i != main && 2 * inside[i] < sizes[i]) {
        let share = sizes[i] as f64 / sizes[main] as f64;
        if share >= RIVAL {
            return Err(refused(format!(
                "two objects, {} and {}; photograph them one by one (or, if it is one, raise segment.join)",
                place(&object),
                place(&member(i))
            )));
        }
        if share >= REMNANT {
            remarks.push(Remark::LeftOut { what: place(&member(i)), object: place(&object) });
        }
    }
    let belongs = |i: usize| i == main || 2 * inside[i] >= sizes[i];
    Ok((groups.only(belongs).zip_map(edges, |near, edge| near && edge), remarks))
}

/// Where a set of pixels is, in words, as shares of the picture.
fn place(set: &Image<bool>) -> String {
    let hull = hull::convex_hull(set);
    let n = hull.len().max(1) as f64;
    let percent = |sum: f64, len: usize| (100.0 * sum / n / len as f64).round();
    let x = percent(hull.iter().map(|p| p.x).sum(), set.width());
    let y = percent(hull.iter().map(|p| p.y).sum(), set.height());
    format!("at {x} % of the width and {y} % of the height")
}

/// The area may grow by this factor when twice the gap is bridged; by more, and it had leaked.
const LEAK: f64 = 1.1;

/// The area inside the hull that the edges enclose, gaps up to twice `join_px` bridged; wider ones while that makes the
/// area jump, for then the outline had a gap through which the inside leaked out.
fn enclosed(edges: &Image<bool>, join_px: f64) -> Image<bool> {
    let hull = hull::coverage(&hull::convex_hull(edges), edges.width(), edges.height()).map(|c| c.0 > 0.5);
    let area = |set: &Image<bool>| set.pixels().iter().filter(|p| **p).count() as f64;
    let mut narrow = closed(edges, &hull, join_px / 2.0);
    for times in [1.0, 2.0, 4.0] {
        let wide = closed(edges, &hull, times * join_px);
        if area(&wide) <= LEAK * area(&narrow) {
            return wide;
        }
        narrow = wide;
    }
    hull
}

fn closed(edges: &Image<bool>, hull: &Image<bool>, radius_px: f64) -> Image<bool> {
    let whole = filter::erode(&cluster::filled(&filter::dilate(edges, radius_px)), radius_px);
    whole.zip_map(hull, |inside, hull| inside && hull)
}

fn scaled(polygon: &[Point2<f64>], from: (usize, usize), to: (usize, usize)) -> Vec<Point2<f64>> {
    let (x, y) = (to.0 as f64 / from.0 as f64, to.1 as f64 / from.1 as f64);
    polygon.iter().map(|p| Point2::new(p.x * x, p.y * y)).collect()
}

fn touches(set: &Image<bool>) -> [bool; 4] {
    let (w, h) = set.size();
    let column = |x: usize| set.rows().any(|row| row[x]);
    let row = |y: usize| set.row(y).iter().any(|p| *p);
    [column(0), row(0), column(w - 1), row(h - 1)]
}

/// Names of the borders in the order of [`Segmentation::touches`].
const BORDERS: [&str; 4] = ["left", "top", "right", "bottom"];
/// Least length of an object as a share of the photo's longer side; anything smaller is dirt.
const LEAST_LENGTH: f64 = 0.05;

fn check_object(hull: &[Point2<f64>], touches: [bool; 4], (w, h): (usize, usize)) -> Result<()> {
    let extent = |along: fn(&Point2<f64>) -> f64| {
        let (low, high) = hull.iter().map(along).fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        (high - low).max(0.0)
    };
    let (width, height) = (extent(|p| p.x), extent(|p| p.y));
    if hull.is_empty() || width.max(height) < LEAST_LENGTH * w.max(h) as f64 {
        return Err(refused(format!(
            "the largest thing found is {width:.0} x {height:.0} of {w} x {h} pixels; is there an object, and is it in focus?"
        )));
    }
    if touches == [true; 4] {
        return Err(refused("the object reaches all four borders; photograph it with background all around it"));
    }
    Ok(())
}

/// The remark on an object that the photo cuts off; none for a whole one.
fn truncation(touches: [bool; 4]) -> Option<Remark> {
    let reached: Vec<_> = BORDERS.into_iter().zip(touches).filter(|(_, t)| *t).map(|(name, _)| name).collect();
    (!reached.is_empty()).then_some(Remark::Truncated(reached))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};

    const GREEN: LinearRgb = LinearRgb::new(0.04, 0.4, 0.08);
    const WHITE: LinearRgb = LinearRgb::new(0.8, 0.82, 0.78);

    /// A screen with vignetting and sensor noise (shot and read noise of a small camera) and what lies on it.
    fn photo(w: usize, h: usize, screen: LinearRgb, paint: impl Fn(f64, f64) -> Option<LinearRgb>) -> Image<LinearRgb> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let mut image = Image::new(w, h);
        for i in 0..w * h {
            let (x, y) = ((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
            let (u, v) = (x / w as f64 - 0.5, y / h as f64 - 0.5);
            let fall = 1.0 - 0.3 * (u * u + v * v) as f32;
            let clean = paint(x, y).unwrap_or(screen).scale(fall);
            image.pixels_mut()[i] = clean.map(|c| {
                let normal = (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0;
                c + normal * (0.006 * 0.006 * c + 0.002 * 0.002).sqrt()
            });
        }
        image
    }

    fn disc(x: f64, y: f64, [cx, cy, r]: [f64; 3]) -> bool {
        (x - cx).powi(2) + (y - cy).powi(2) < r * r
    }

    fn find(photo: &Image<LinearRgb>) -> Result<Segmentation> {
        segment(photo, &SegmentOptions::default())
    }

    fn bounds(hull: &[Point2<f64>]) -> [f64; 4] {
        let xs = || hull.iter().map(|p| p.x);
        let ys = || hull.iter().map(|p| p.y);
        [
            xs().fold(f64::MAX, f64::min),
            ys().fold(f64::MAX, f64::min),
            xs().fold(0.0, f64::max),
            ys().fold(0.0, f64::max),
        ]
    }

    /// The hull's box is within 2 pixels of `truth`, the accuracy that is promised of photos.
    fn assert_box(found: &Segmentation, truth: [f64; 4]) {
        let found = bounds(&found.hull);
        let worst = found.iter().zip(truth).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst <= 2.0, "{found:?}, expected {truth:?}");
    }

    fn said(photo: &Image<LinearRgb>) -> String {
        find(photo).unwrap_err().to_string()
    }

    #[test]
    fn a_disc_is_found_where_it_is() {
        for screen in [GREEN, WHITE] {
            let red = LinearRgb::new(0.5, 0.04, 0.05);
            let found = find(&photo(300, 200, screen, |x, y| disc(x, y, [150.0, 90.0, 50.0]).then_some(red))).unwrap();
            assert_box(&found, [100.0, 40.0, 200.0, 140.0]);
            let area: f32 = found.mask.pixels().iter().map(|c| c.0).sum();
            assert!((f64::from(area) / (std::f64::consts::PI * 2500.0) - 1.0).abs() < 0.05);
            assert_eq!(found.touches, [false; 4]);
        }
    }

    #[test]
    fn a_clear_film_is_found_by_its_rim() {
        // 15 % darker along a rim of 4 pixels, the screen's colour within.
        let rim = |x, y| disc(x, y, [150.0, 100.0, 70.0]) && !disc(x, y, [150.0, 100.0, 66.0]);
        let found = find(&photo(300, 200, GREEN, |x, y| rim(x, y).then_some(GREEN.scale(0.85)))).unwrap();
        assert_box(&found, [80.0, 30.0, 220.0, 170.0]);
        assert!(found.tight[(150, 100)].0 > 0.99, "the inside belongs to it");
    }

    #[test]
    fn a_soft_shadow_is_not_the_object() {
        let shadow = |x: f64, y: f64| (((x - 220.0).powi(2) + (y - 100.0).powi(2)) / 2000.0).min(10.0) as f32;
        let found = find(&photo(300, 200, WHITE, |x, y| {
            if disc(x, y, [110.0, 100.0, 50.0]) {
                Some(LinearRgb::new(0.1, 0.2, 0.5))
            } else {
                Some(WHITE.scale(1.0 - 0.3 * libm::expf(-shadow(x, y))))
            }
        }));
        assert_box(&found.unwrap(), [60.0, 50.0, 160.0, 150.0]);
    }

    #[test]
    fn dirt_far_away_does_not_blow_up_the_hull() {
        let found = find(&photo(400, 300, WHITE, |x, y| {
            let there = disc(x, y, [150.0, 150.0, 60.0]) || disc(x, y, [370.0, 20.0, 2.0]);
            there.then_some(LinearRgb::grey(0.1))
        }));
        assert_box(&found.unwrap(), [90.0, 90.0, 210.0, 210.0]);
    }

    #[test]
    fn a_cap_of_the_same_grey_as_the_screen_is_seen() {
        // Equal means of the square roots, which is what the grey picture shows.
        let (screen, cap) = (LinearRgb::new(0.04, 0.09, 0.36), LinearRgb::new(0.36, 0.09, 0.04));
        let picture = photo(300, 200, screen, |x, y| disc(x, y, [150.0, 100.0, 40.0]).then_some(cap));
        assert_box(&find(&picture).unwrap(), [110.0, 60.0, 190.0, 140.0]);
    }

    #[test]
    fn hollows_are_in_the_hull_and_not_in_the_tight_mask() {
        let ell = |x: f64, y: f64| (40.0..260.0).contains(&x) && (40.0..260.0).contains(&y) && (x < 120.0 || y > 180.0);
        let found = find(&photo(300, 300, GREEN, |x, y| ell(x, y).then_some(LinearRgb::grey(0.5)))).unwrap();
        assert!(found.mask[(160, 140)].0 == 1.0 && found.tight[(190, 110)].0 == 0.0 && found.tight[(80, 80)].0 == 1.0);
    }

    #[test]
    fn an_object_may_reach_a_border() {
        let found = find(&photo(300, 200, GREEN, |x, y| (x < 90.0 && (50.0..150.0).contains(&y)).then_some(WHITE)));
        let found = found.unwrap();
        assert_eq!(found.touches, [true, false, false, false]);
        assert_box(&found, [0.0, 50.0, 90.0, 150.0]);
    }

    #[test]
    fn large_photos_are_searched_small_and_told_in_their_own_pixels() {
        let found = find(&photo(2000, 1500, GREEN, |x, y| disc(x, y, [900.0, 700.0, 400.0]).then_some(WHITE))).unwrap();
        let worst = bounds(&found.hull).into_iter().zip([500.0, 300.0, 1300.0, 1100.0]).map(|(a, b)| (a - b).abs());
        assert!(worst.fold(0.0, f64::max) <= 4.0, "2 pixels of the search are 4 of the photo");
        assert_eq!((found.mask.size(), found.tight.size()), ((2000, 1500), (2000, 1500)));
        assert_eq!(found.steps[0].image.size(), (1024, 768));
    }

    #[test]
    fn an_empty_screen_is_refused() {
        assert!(said(&photo(300, 200, GREEN, |_, _| None)).contains("is there an object"));
        assert!(said(&Image::filled(100, 100, GREEN)).contains("is there an object"));
        assert!(said(&Image::filled(100, 100, LinearRgb::BLACK)).contains("is there an object"));
    }

    #[test]
    fn a_lone_speck_is_refused() {
        let speck = photo(400, 300, GREEN, |x, y| disc(x, y, [200.0, 150.0, 4.0]).then_some(WHITE));
        assert!(said(&speck).contains("the largest thing found is"));
    }

    #[test]
    fn two_objects_are_refused() {
        let two = photo(400, 200, GREEN, |x, y| {
            (disc(x, y, [90.0, 100.0, 50.0]) || disc(x, y, [310.0, 100.0, 45.0])).then_some(WHITE)
        });
        assert!(said(&two).contains("two objects, at 23 % of the width"), "{}", said(&two));
    }

    #[test]
    fn a_picture_full_of_object_is_refused() {
        let stripes = photo(300, 200, GREEN, |x, y| ((x + y) % 16.0 < 8.0).then_some(WHITE));
        assert!(said(&stripes).contains("background all around it"), "{}", said(&stripes));
        let cross = |x: f64, y: f64| (146.0..154.0).contains(&x) || (96.0..104.0).contains(&y);
        let cross = photo(300, 200, GREEN, |x, y| cross(x, y).then_some(WHITE));
        assert!(said(&cross).contains("all four borders"), "{}", said(&cross));
    }

    #[test]
    fn tiny_and_broken_photos_are_refused() {
        assert!(said(&Image::filled(31, 100, GREEN)).contains("31 x 100"));
        assert!(said(&Image::new(0, 0)).contains("0 x 0"));
        let mut broken = Image::filled(64, 64, GREEN);
        broken[(5, 9)] = LinearRgb::grey(f32::NAN);
        assert!(said(&broken).contains("pixel (5, 9)"));
    }

    #[test]
    fn impossible_options_are_named() {
        let said = |opts: SegmentOptions| segment(&Image::filled(64, 64, GREEN), &opts).unwrap_err().to_string();
        assert_eq!(said(SegmentOptions { levels: 1, ..Default::default() }), "levels: 1, expected 2 to 8");
        assert!(said(SegmentOptions { join: f64::NAN, ..Default::default() }).starts_with("join: NaN"));
        assert!(said(SegmentOptions { tone: Tone::Grey([0.0; 3]), ..Default::default() }).starts_with("tone.grey"));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn moving_the_object_moves_the_hull(dx in 0..60usize, dy in 0..60usize, size in 30.0..60.0f64) {
            let (cx, cy) = (90.0 + dx as f64, 90.0 + dy as f64);
            let found = find(&photo(260, 240, GREEN, |x, y| disc(x, y, [cx, cy, size]).then_some(WHITE))).unwrap();
            assert_box(&found, [cx - size, cy - size, cx + size, cy + size]);
        }
    }
}
