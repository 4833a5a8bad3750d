//! A flow as a file beside its cut-out.

use super::manifest::PhotoRecord;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::io;
use crate::io::exr::Channel;
use crate::matte::{Flow, LightPath};
use std::path::{Path, PathBuf};

/// Name of the channel that is 1 where the others are known.
const KNOWN: &str = "known";

/// Names of the channels of a [`LightPath`]; lengths are in metres.
const CHANNELS: [&str; 6] = ["X", "Y", "haze", "scatter.X", "scatter.Y", "scatter.width"];

/// What the channels say, in their order.
fn values(path: LightPath) -> [f32; 6] {
    let ([x, y], [sx, sy]) = (path.displacement, path.scatter_displacement);
    [x, y, path.haze, sx, sy, path.scatter_width]
}

fn path_of([x, y, haze, sx, sy, scatter_width]: [f32; 6]) -> LightPath {
    LightPath {
        displacement: [x, y],
        haze,
        scatter_displacement: [sx, sy],
        scatter_width,
    }
}

/// Writes a flow as an EXR of half floats.
pub(super) fn write(path: &Path, flow: &Flow) -> Result<()> {
    let known = flow.known.map(|known| if known { 1.0 } else { 0.0 });
    let planes: [Vec<f32>; 6] = std::array::from_fn(|k| {
        let pixels = flow.paths.pixels().iter();
        pixels.map(|path| values(*path)[k]).collect()
    });
    let samples = planes.iter().map(Vec::as_slice);
    let channels = CHANNELS.into_iter().zip(samples);
    let channels: Vec<_> = channels.chain([(KNOWN, known.pixels())]).collect();
    io::exr::write_half_channels(path, flow.paths.size(), &channels)
}

/// The file of a record's flow, where it has one.
///
/// # Errors
/// Those of [`io::inside`].
pub(super) fn path(folder: &Path, record: &PhotoRecord) -> Result<Option<PathBuf>> {
    let captured = record.captured.as_ref();
    let file = captured.and_then(|captured| captured.flow.as_deref());
    file.map(|file| io::inside(folder, file)).transpose()
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
    let (Some(path), Some(captured)) = (path(folder, record)?, &record.captured) else {
        return Ok(None);
    };
    Ok(Some(Flow {
        width: record.size_m[0],
        height: captured.height,
        ..decoded(&path, size)?
    }))
}

/// Without its width and height.
fn decoded(path: &Path, size: (usize, usize)) -> Result<Flow> {
    let (found, channels) = io::exr::read_channels(path)?;
    check_size(path, found, size)?;
    let plane = |name: &str| plane(&channels, name, size).map_err(|what| Error::file(path, what));
    let planes: Vec<_> = CHANNELS.into_iter().map(plane).collect::<Result<_>>()?;
    let (w, h) = size;
    Ok(Flow {
        paths: Image::from_fn(w, h, |x, y| {
            path_of(std::array::from_fn(|k| planes[k][(x, y)]))
        }),
        known: plane(KNOWN)?.map(|known| known >= 0.5),
        ..Flow::default()
    })
}

fn check_size(path: &Path, (w, h): (usize, usize), (width, height): (usize, usize)) -> Result<()> {
    if (w, h) == (width, height) {
        return Ok(());
    }
    let what = format!("{w} x {h} pixels, expected the cut-out's {width} x {height}");
    Err(Error::file(path, what))
}

/// The channel of a name, all of whose samples are numbers.
fn plane(
    channels: &[Channel],
    name: &str,
    (w, h): (usize, usize),
) -> std::result::Result<Image<f32>, String> {
    let mut named = channels.iter().filter(|channel| channel.name == name);
    let channel = named.next().ok_or_else(|| format!("no channel {name}"))?;
    if channel.samples.iter().all(|v| v.is_finite()) {
        return Ok(Image::from_vec(w, h, channel.samples.clone()));
    }
    Err(format!("a value of channel {name} is not a finite number"))
}

#[cfg(test)]
mod tests {
    use super::super::manifest::CaptureRecord;
    use super::super::manifest::tests::photo;
    use super::*;

    fn flow() -> Flow {
        Flow {
            paths: Image::from_fn(4, 3, |x, y| LightPath {
                displacement: [0.001 * x as f32, -0.002 * y as f32],
                haze: 0.25,
                scatter_displacement: [0.004, 0.003],
                scatter_width: 0.01,
            }),
            known: Image::from_fn(4, 3, |x, _| x > 0),
            width: 0.4,
            height: 0.03,
        }
    }

    fn record() -> PhotoRecord {
        let captured = CaptureRecord {
            photos: 18,
            transmittance_sigma: 0.01,
            flow: Some("a.flow.exr".into()),
            height: 0.03,
            haze: 0.25,
        };
        PhotoRecord {
            captured: Some(captured),
            ..photo("a.exr")
        }
    }

    #[test]
    fn a_flow_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.flow.exr");
        write(&path, &flow()).unwrap();
        let read = |size| read(folder.path(), &record(), size);
        let through_half = |v: f32| half::f16::from_f32(v).to_f32();
        let stored = flow()
            .paths
            .map(|path| path_of(values(path).map(through_half)));
        let stored = Flow {
            paths: stored,
            ..flow()
        };
        assert_eq!(read((4, 3)).unwrap(), Some(stored));
        let size = read((5, 3)).unwrap_err().to_string();
        assert!(
            size.ends_with("4 x 3 pixels, expected the cut-out's 5 x 3"),
            "{size}"
        );
    }

    #[test]
    fn a_damaged_flow_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.flow.exr");
        let told = |channels: &[(&str, &[f32])]| {
            io::exr::write_half_channels(&path, (2, 1), channels).unwrap();
            read(folder.path(), &record(), (2, 1))
                .unwrap_err()
                .to_string()
        };
        let missing = told(&[("X", &[0.0, 0.0]), ("known", &[1.0, 1.0])]);
        assert!(missing.ends_with("a.flow.exr: no channel Y"), "{missing}");
        let infinite = told(&[
            ("X", &[0.0, 0.0]),
            ("Y", &[f32::NAN, 0.0]),
            ("known", &[1.0, 1.0]),
        ]);
        assert!(
            infinite.ends_with("a value of channel Y is not a finite number"),
            "{infinite}"
        );
    }
}
