//! A flow as a file beside its cut-out.

use super::manifest::{CaptureRecord, PhotoRecord};
use crate::error::{Error, Result};
use crate::image::Image;
use crate::io;
use crate::matte::Flow;
use std::path::Path;

/// Names of the channels: displacement in metres, right and down; 1 where it is known; what
/// scattering leaves of contrast.
const CHANNELS: [&str; 4] = ["X", "Y", "known", "modulation"];

/// Writes a flow as an EXR of half floats, and returns it as it will be read back.
pub(super) fn write(path: &Path, flow: &Flow, modulation: &Image<f32>) -> Result<Flow> {
    let part = |axis: usize| flow.displacement.pixels().iter().map(|d| d[axis]).collect();
    let known = flow
        .known
        .pixels()
        .iter()
        .map(|known| f32::from(u8::from(*known)))
        .collect();
    let planes: [Vec<f32>; 4] = [part(0), part(1), known, modulation.pixels().to_vec()];
    let channels: Vec<_> = CHANNELS
        .into_iter()
        .zip(planes.iter().map(Vec::as_slice))
        .collect();
    io::exr::write_half_channels(path, flow.displacement.size(), &channels, &[])?;
    let stored = |d: [f32; 2]| d.map(|v| half::f16::from_f32(v).to_f32());
    Ok(Flow {
        displacement: flow.displacement.map(stored),
        ..flow.clone()
    })
}

/// Reads the flow of a record, where it has one.
///
/// # Errors
/// Those of [`io::exr::read_channels`]; [`Error::File`] for a file without its channels, of another
/// size than the cut-out, or with values that no flow has.
pub(super) fn read(
    folder: &Path,
    record: &PhotoRecord,
    size: (usize, usize),
) -> Result<Option<Flow>> {
    let Some(CaptureRecord {
        flow: Some(file),
        height,
        ..
    }) = &record.captured
    else {
        return Ok(None);
    };
    let path = io::inside(folder, file)?;
    let flow = decoded(&path, size)?;
    Ok(Some(Flow {
        width: record.size_m[0],
        height: *height,
        ..flow
    }))
}

/// Without its width and height.
fn decoded(path: &Path, size: (usize, usize)) -> Result<Flow> {
    let ((w, h), channels) = io::exr::read_channels(path)?;
    if (w, h) != size {
        let what = format!(
            "{w} x {h} pixels, expected the cut-out's {} x {}",
            size.0, size.1
        );
        return Err(Error::file(path, what));
    }
    let plane = |name: &str| -> Result<Image<f32>> {
        let mut named = channels.iter().filter(|channel| channel.name == name);
        let channel = named
            .next()
            .ok_or_else(|| Error::file(path, format!("no channel {name}")))?;
        Ok(Image::from_vec(w, h, channel.samples.clone()))
    };
    let [x, y, known] = [
        plane(CHANNELS[0])?,
        plane(CHANNELS[1])?,
        plane(CHANNELS[2])?,
    ];
    let displacement = x.zip_map(&y, |x, y| [x, y]);
    if displacement
        .pixels()
        .iter()
        .flatten()
        .any(|v| !v.is_finite())
    {
        return Err(Error::file(
            path,
            "a displacement that is no number, expected metres",
        ));
    }
    Ok(Flow {
        displacement,
        known: known.map(|known| known >= 0.5),
        ..Flow::default()
    })
}
