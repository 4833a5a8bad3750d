//! Segmentation: where the object is, from two bands of a Laplacian pyramid.

mod band;
mod cluster;
mod distance;
mod hull;
mod threshold;

pub use threshold::Threshold;

use crate::error::{Error, Result};
use crate::filter;
use crate::geom::Point2;
use crate::image::Image;
use crate::pixel::{Coverage, LinearRgb};
use band::Gaussian;
use cluster::Groups;
use serde::{Deserialize, Serialize};

/// How an object is found on a uniform background.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SegmentOptions {
    /// Which band of the pyramid is the coarse one; the fine one is always 1. Default: 4.
    pub levels: usize,
    /// Weights of red, green and blue in the grey picture. Default: equal.
    pub grey: [f32; 3],
    /// Cut of the first band. Default: Otsu.
    pub first_threshold: Threshold,
    /// Cut of the last band. Default: Otsu.
    pub last_threshold: Threshold,
    /// Fainter cut of the first band, for edges that touch certain ones. Default: 6 times the noise.
    pub first_faint: Threshold,
    /// Fainter cut of the last band, for edges that touch certain ones. Default: 6 times the noise.
    pub last_faint: Threshold,
    /// Edges nearer to each other than this share of the longer side belong together. Default: 0.04.
    pub join: f32,
    /// Longer side of the picture that is searched, pixels; larger photos are reduced to it. Default: 1024.
    pub working_size: usize,
}

impl Default for SegmentOptions {
    fn default() -> Self {
        Self {
            levels: 4,
            grey: [1.0; 3],
            first_threshold: Threshold::Otsu,
            last_threshold: Threshold::Otsu,
            first_faint: Threshold::Noise(6.0),
            last_faint: Threshold::Noise(6.0),
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
    /// Coverage of the object as far as its edges tell: inside the hull, follows hollows. Of the photo's size.
    pub tight: Image<Coverage>,
    /// Convex hull of the object, pixel-corner coordinates of the photo, clockwise as seen.
    pub hull: Vec<Point2<f64>>,
    /// Whether the object reaches the left, top, right and bottom border of the photo.
    pub touches: [bool; 4],
    /// Every intermediate picture, in the order of the work.
    pub steps: Vec<Step>,
}

/// An intermediate picture of the segmentation.
#[derive(Clone, Debug)]
pub struct Step {
    /// What it is: a file name without ending.
    pub name: &'static str,
    /// The picture, at the size that was searched.
    pub image: Image<Coverage>,
}

/// Finds the one object on a uniform background.
///
/// `photo` is scene-linear, of any size from 32 pixels a side.
///
/// # Method
/// Laplacian pyramid (Burt and Adelson 1983) of a grey picture; first and last band binarised and combined by AND.
/// # Errors
/// [`Error::Photo`] when nothing, or no single object that leaves some background free, was found; [`Error::Value`] for
/// options that cannot be right.
pub fn segment(photo: &Image<LinearRgb>, opts: &SegmentOptions) -> Result<Segmentation> {
    let small = working_copy(photo, opts)?;
    let grey = grey(&small, opts.grey);
    let pyramid = Gaussian::new(grey.clone(), opts.levels);
    let first = magnitude(pyramid.band(1));
    let last = magnitude(pyramid.to_full_size(pyramid.band(opts.levels), opts.levels - 1));
    let first_cut = opts.first_threshold.of(&first);
    let last_cut = opts.last_threshold.of(&last);
    let first_faint = opts.first_faint.of(&first).min(first_cut);
    let last_faint = opts.last_faint.of(&last).min(last_cut);
    let certain = first.zip_map(&last, |a, b| a.0 > first_cut && b.0 > last_cut);
    let faint = first.zip_map(&last, |a, b| a.0 > first_faint && b.0 > last_faint);
    let both = cluster::reached(&faint, &certain);
    let join = opts.join * small.width().max(small.height()) as f32;
    let main = main_cluster(&both, join)?;
    let hull_small = hull::convex_hull(&main);
    let scale = [photo.width() as f64 / small.width() as f64, photo.height() as f64 / small.height() as f64];
    let hull: Vec<_> = hull_small.iter().map(|p| Point2::new(p.x * scale[0], p.y * scale[1])).collect();
    let tight_small = closed(&main, join);
    let touches = touches(&main);
    if touches == [true; 4] {
        return Err(nothing("the object reaches all four borders; photograph it with background all around"));
    }
    let shown = |set: &Image<bool>| set.map(|p| Coverage(f32::from(u8::from(p))));
    let tight = filter::resize(&shown(&tight_small), photo.width(), photo.height());
    let steps = vec![
        Step { name: "grey", image: grey },
        Step { name: "first_band_binary", image: first.map(|c| Coverage(f32::from(u8::from(c.0 > first_cut)))) },
        Step { name: "last_band_binary", image: last.map(|c| Coverage(f32::from(u8::from(c.0 > last_cut)))) },
        Step { name: "first_band", image: first },
        Step { name: "last_band", image: last },
        Step { name: "certain", image: shown(&certain) },
        Step { name: "faint", image: shown(&faint) },
        Step { name: "edges", image: shown(&both) },
        Step { name: "object", image: shown(&main) },
    ];
    let mask = hull::coverage(&hull, photo.width(), photo.height());
    Ok(Segmentation { mask, tight, hull, touches, steps })
}

fn nothing(what: impl Into<String>) -> Error {
    Error::Photo { what: what.into() }
}

/// Shortest side that can hold an object and its background.
const SMALLEST: usize = 32;

fn working_copy(photo: &Image<LinearRgb>, opts: &SegmentOptions) -> Result<Image<LinearRgb>> {
    let (w, h) = photo.size();
    if w.min(h) < SMALLEST {
        return Err(nothing(format!("the photo is {w} x {h} pixels, expected at least {SMALLEST} x {SMALLEST}")));
    }
    if !(1..=8).contains(&opts.levels) {
        return Err(Error::value("levels", format!("{}, expected 1 to 8", opts.levels)));
    }
    if let Some(i) = photo.pixels().iter().position(|p| !p.is_finite()) {
        return Err(nothing(format!("pixel {}, {} is not a number", i % w, i / w)));
    }
    let longest = w.max(h);
    if longest <= opts.working_size {
        return Ok(photo.clone());
    }
    let reduced = |side: usize| (side * opts.working_size).div_ceil(longest);
    Ok(filter::resize(photo, reduced(w), reduced(h)))
}

/// The grey picture: weighted mean of the square roots of the channels.
///
/// The square root makes the shot noise of a sensor the same everywhere (it is the Anscombe transform without its
/// offset) and is near to what a display-encoded photo holds; equal weights keep a blue screen from going black, which
/// luminance would do.
fn grey(photo: &Image<LinearRgb>, weights: [f32; 3]) -> Image<Coverage> {
    let sum: f32 = weights.iter().sum();
    let [r, g, b] = weights.map(|w| w / sum);
    photo.map(|p| {
        let root = p.map(|v| v.max(0.0).sqrt());
        Coverage(r * root.r + g * root.g + b * root.b)
    })
}

fn magnitude(band: Image<Coverage>) -> Image<Coverage> {
    band.map(|c| Coverage(c.0.abs()))
}

/// The edges of the one object.
///
/// Edges nearer to each other than `join` form a cluster; the cluster of most edge pixels is the object.
fn main_cluster(edges: &Image<bool>, join: f32) -> Result<Image<bool>> {
    let groups = Groups::of(&distance::grown(edges, join / 2.0));
    let sizes = groups.sums(edges);
    let Some(main) = (0..sizes.len()).max_by_key(|&i| (sizes[i], std::cmp::Reverse(i))) else {
        return Err(nothing("no edges found; is there an object, and is the photo in focus?"));
    };
    Ok(groups.labels.zip_map(edges, |label, edge| edge && label as usize == main + 1))
}

/// The area that the edges enclose, gaps up to `join` bridged.
fn closed(edges: &Image<bool>, join: f32) -> Image<bool> {
    distance::shrunk(&cluster::filled(&distance::grown(edges, join)), join)
}

fn touches(set: &Image<bool>) -> [bool; 4] {
    let (w, h) = set.size();
    let any = |xs: std::ops::Range<usize>, ys: std::ops::Range<usize>| {
        ys.into_iter().any(|y| set.row(y)[xs.clone()].iter().any(|p| *p))
    };
    [any(0..1, 0..h), any(0..w, 0..1), any(w - 1..w, 0..h), any(0..w, h - 1..h)]
}
