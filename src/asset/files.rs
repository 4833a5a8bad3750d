//! The files of one cut-out: film, thumbnail, outline.

use super::thumbnail::thumbnail;
use crate::error::Result;
use crate::geom::Point2;
use crate::io;
use crate::matte::CutOut;
use crate::stopwatch::Stopwatch;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Outline of a cut-out as its own file: `NAME.outline.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutlineFile {
    /// Convex hull in pixels of the cut-out, clockwise as seen.
    pub hull_px: Vec<[f64; 2]>,
    /// Tight outline: rings around the object clockwise, rings around holes the other way.
    pub rings_px: Vec<Vec<[f64; 2]>>,
}

/// Names of the channels of a cut-out's file; see [`write`].
const CHANNELS: [&str; 10] = ["R", "G", "B", "A", "TR", "TG", "TB", "VR", "VG", "VB"];

/// Writes film (`.exr`), thumbnail (`.png`) and outline (`.outline.json`) under one name.
///
/// The EXR holds half floats, zip-compressed: `R G B` is the object's own light F, `A` the mean opacity along the line of
/// sight (together: premultiplied RGBA for programs that know no film), `TR TG TB` the transmittance as measured, the
/// object's own shadow included, and `VR VG VB` that of the line of sight alone.
pub(super) fn write(path: &Path, cut: &CutOut) -> Result<()> {
    let mut watch = Stopwatch::start();
    let plane =
        |value: fn(&crate::Film) -> f32| cut.film.pixels().iter().map(value).collect::<Vec<f32>>();
    let through = |value: fn(&crate::LinearRgb) -> f32| {
        cut.transmittance
            .pixels()
            .iter()
            .map(value)
            .collect::<Vec<f32>>()
    };
    let planes = [
        plane(|f| f.color.r),
        plane(|f| f.color.g),
        plane(|f| f.color.b),
        plane(|f| f.to_rgba().a),
        through(|t| t.r),
        through(|t| t.g),
        through(|t| t.b),
        plane(|f| f.transmittance().r),
        plane(|f| f.transmittance().g),
        plane(|f| f.transmittance().b),
    ];
    watch.lap("planes");
    let channels: Vec<(&str, &[f32])> = CHANNELS
        .into_iter()
        .zip(planes.iter().map(Vec::as_slice))
        .collect();
    io::exr::write_half_channels(path, cut.film.size(), &channels, &[])?;
    watch.lap("film");
    io::write(path.with_extension("png"), &thumbnail(&cut.to_rgba()))?;
    watch.lap("thumbnail");
    let rings = cut
        .outline
        .rings
        .iter()
        .map(|ring| ring.iter().map(rounded).collect());
    let outline = OutlineFile {
        hull_px: cut.hull.iter().map(rounded).collect(),
        rings_px: rings.collect(),
    };
    io::write_json(path.with_extension("outline.json"), &outline)?;
    watch.lap("outline");
    watch.log("write");
    Ok(())
}

/// As exact as a pixel coordinate needs to be in a file that people read.
pub(super) fn rounded(p: &Point2<f64>) -> [f64; 2] {
    [p.x, p.y].map(|px| (px * 1000.0).round() / 1000.0)
}
