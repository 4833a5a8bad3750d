//! A capture on a luminous display as a cut-out: measured film, its size, how it bends light.

use super::capture_entry::CaptureEntry;
use super::entry::PhotoEntry;
use super::files;
use super::manifest::{CaptureRecord, PhotoRecord};
use super::open_photo::with_name;
use super::screen_pose::{ReferenceRectangle, ScreenPose};
use super::size::oriented_size;
use crate::capture::{Display, Frame, FramePhoto, Measured, Photos, Sources, View, measure};
use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::filter;
use crate::geom::{Point2, Point3};
use crate::image::{Image, Roi};
use crate::io;
use crate::matte::{ColorUncertainty, CutOutOptions, Flow, Outline, from_top_left};
use crate::pixel::Film;
use std::path::PathBuf;

/// An object that was captured on a display.
pub(super) struct CapturedObject {
    /// Trimmed to the object and a margin.
    pub(super) film: Image<Film>,
    /// How it bends light, where stripes were photographed.
    pub(super) flow: Option<Flow>,
    /// What scattering leaves of contrast, of the size of the flow.
    pub(super) modulation: Image<f32>,
    pub(super) record: PhotoRecord,
}

/// Noise of a corner of the display, pixels: those of four markers, carried to the corners.
const CORNER_SIGMA_PX: f64 = 0.15;
/// Standard error of one side of the outline, pixels of the view: on synthetic captures the area of
/// an ellipse is right to 0.3 pixels of its radius.
const SIDE_ERROR_PX: f64 = 0.5;
/// Where refraction is known on less of what is see-through, a person should know.
const MIN_KNOWN: f64 = 0.5;
/// What passes less light is opaque.
const OPAQUE: f32 = 0.05;

/// Measures the object of an entry.
///
/// # Errors
/// Those of reading; [`Error::Value`] for an unknown width of the display; [`Error::Photo`] for a
/// capture that cannot be measured, naming the photo where it is one photo's fault.
pub(super) fn captured_object(
    entry: &PhotoEntry,
    captured: &CaptureEntry,
    options: &CutOutOptions,
) -> Result<CapturedObject> {
    let (display, width) = captured.display(&entry.file)?;
    let files: Vec<PathBuf> = [&entry.file]
        .into_iter()
        .chain(&captured.photos)
        .cloned()
        .collect();
    let (names, empty_names) = (names(&files), names(&captured.empty));
    let (read, read_empty) = (
        |i: usize| io::read(&files[i]),
        |i: usize| io::read(&captured.empty[i]),
    );
    let sources = Sources {
        names: &names,
        read: &read,
    };
    let empty_sources = Sources {
        names: &empty_names,
        read: &read_empty,
    };
    let (recognised, empty_recognised) = (
        sources.recognised(&display)?,
        empty_sources.recognised(&display)?,
    );
    let photos = Photos {
        sources,
        recognised: &recognised,
    };
    let empty = Photos {
        sources: empty_sources,
        recognised: &empty_recognised,
    };
    let reference = reference_number(&recognised, &names)?;
    let view = View::of_photo(&display, &recognised[reference]);
    let pose = pose(&display, width, &recognised[reference], &files[reference])
        .map_err(|e| with_name(e, &files[reference]))?;
    let measured = measure(&display, &view, &photos, &empty).map_err(|e| in_capture(e, entry))?;
    let place = Placed::new(entry, &display, width, &view, pose);
    let trim = Trim::new(&measured.outline, view.size, options);
    Ok(place.object(&measured, &trim, recognised.len() + empty_recognised.len()))
}

fn names(files: &[PathBuf]) -> Vec<String> {
    let name = |file: &PathBuf| {
        file.file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    files.iter().map(name).collect()
}

fn in_capture(error: Error, entry: &PhotoEntry) -> Error {
    match error {
        Error::Photo { what } => Error::Photo {
            what: format!("{}: {what}", entry.asset),
        },
        other => other,
    }
}

/// The photo of the white frame, from which scale and view are taken.
fn reference_number(recognised: &[FramePhoto], names: &[String]) -> Result<usize> {
    let number = recognised
        .iter()
        .position(|photo| photo.frame == Frame::White);
    number.ok_or_else(|| Error::Photo {
        what: format!("no photo of the white frame among {}", names.join(", ")),
    })
}

/// Where the camera stood over the display.
fn pose(display: &Display, width: f64, white: &FramePhoto, file: &PathBuf) -> Result<ScreenPose> {
    let [w, h] = display.size_px.map(f64::from);
    let reference = ReferenceRectangle {
        size: [width, width * h / w],
        corners_px: from_top_left(white.display_corners_px(display)),
        sigma_px: CORNER_SIGMA_PX,
    };
    ScreenPose::solve(&reference, white.size_px, &io::read_header(file)?)
}

/// The part of the view that a cut-out shows.
struct Trim {
    roi: Roi,
    /// Pixels of the cut-out for one of the view.
    scale: f64,
    /// In pixels of the cut-out.
    hull: Vec<Point2<f64>>,
}

impl Trim {
    fn new(outline: &Outline, (w, h): (usize, usize), options: &CutOutOptions) -> Self {
        let hull = outline.hull();
        let span = |values: &dyn Fn(&Point2<f64>) -> f64, side: usize| {
            let [low, high] = hull
                .iter()
                .map(values)
                .fold([f64::MAX, 0.0], |[low, high], v| [v.min(low), v.max(high)]);
            (low.max(0.0) as usize).min(side)..(high.ceil() as usize).min(side)
        };
        let roi =
            Roi::spanning(span(&|p| p.x, w), span(&|p| p.y, h)).grown(options.margin_px, w, h);
        let longer = roi.width.max(roi.height).max(1);
        let scale = (options.longest_side as f64 / longer as f64).min(1.0);
        let corner = Point2::new(roi.x as f64, roi.y as f64);
        let hull = hull
            .iter()
            .map(|p| Point2::from((p - corner) * scale))
            .collect();
        Self { roi, scale, hull }
    }

    fn cropped<P: crate::pixel::Mix>(&self, image: &Image<P>) -> Image<P> {
        let image = image.crop(self.roi);
        if self.scale >= 1.0 {
            return image;
        }
        let side = |side: usize| ((side as f64 * self.scale).round() as usize).max(1);
        filter::resize(&image, side(image.width()), side(image.height()))
    }
}

/// A view of a size in metres, and the entry that it is of.
struct Placed<'a> {
    entry: &'a PhotoEntry,
    /// Of the display, metres for a pixel.
    pitch: f64,
    /// Pixels of the view for a metre at half the object's height.
    px_per_metre: f64,
    height: f64,
    /// Standard error of a length, as a share.
    sigma: f64,
    diagnostics: Vec<Diagnostic>,
}

impl<'a> Placed<'a> {
    fn new(
        entry: &'a PhotoEntry,
        display: &Display,
        width: f64,
        view: &View,
        pose: ScreenPose,
    ) -> Self {
        let (pitch, height) = (width / f64::from(display.size_px[0]), entry.thickness / 2.0);
        let camera = pose.camera.center().z;
        // Lines of sight that pass an object at this height end farther apart on the display.
        let spread = camera / (camera - height).max(0.1 * camera);
        let poor = pose.is_poor_fit.then(|| {
            let what =
                "the markers hardly look like those of the display; was the picture stretched?";
            Diagnostic::warning(Code::ScreenSizeMismatch, what)
        });
        Self {
            entry,
            pitch,
            px_per_metre: spread / (view.display_px * pitch),
            height,
            sigma: pose.sigma(Point3::new(0.0, 0.0, height)),
            diagnostics: poor.into_iter().collect(),
        }
    }

    fn object(&self, measured: &Measured, trim: &Trim, photos: usize) -> CapturedObject {
        let film = trim.cropped(&measured.film);
        let flow = self.flow(measured, trim, &film);
        let modulation = measured
            .refraction
            .as_ref()
            .map(|r| trim.cropped(&r.modulation));
        let record = self.record(measured, trim, &film, flow.as_ref(), photos);
        CapturedObject {
            film,
            flow,
            modulation: modulation.unwrap_or_else(|| Image::new(0, 0)),
            record,
        }
    }

    /// In metres on the display, over the whole cut-out.
    fn flow(&self, measured: &Measured, trim: &Trim, film: &Image<Film>) -> Option<Flow> {
        let refraction = measured.refraction.as_ref()?;
        let part = |axis: usize| {
            let metres = |d: [f64; 2]| (d[axis] * self.pitch) as f32;
            trim.cropped(&refraction.displacement_px.map(metres))
        };
        let share = trim.cropped(
            &refraction
                .known
                .map(|known| if known { 1.0_f32 } else { 0.0 }),
        );
        let known = share.map(|share| share >= 0.5);
        let displacement = part(0).zip3_map(&part(1), &share, |x, y, share| {
            if share >= 0.5 {
                [x / share, y / share]
            } else {
                [0.0; 2]
            }
        });
        let width = film.width() as f64 / (self.px_per_metre * trim.scale);
        Some(Flow {
            displacement,
            known,
            width,
            height: self.height,
        })
    }

    fn record(
        &self,
        measured: &Measured,
        trim: &Trim,
        film: &Image<Film>,
        flow: Option<&Flow>,
        photos: usize,
    ) -> PhotoRecord {
        let px_per_metre = self.px_per_metre * trim.scale;
        let (w, h) = film.size();
        let size_m = [w as f64, h as f64].map(|px| px / px_per_metre);
        let object_m = oriented_size(&trim.hull).map(|px| px / px_per_metre);
        let outline_px = trim.hull.iter().map(files::rounded).collect();
        let side = std::f64::consts::SQRT_2 * SIDE_ERROR_PX / self.px_per_metre;
        let file = self.entry.cut_out_file();
        let known = flow.map_or(0.0, |flow| known_share(flow, film));
        let sigma = mean_sigma(&measured.sigma);
        let hidden = flow.is_some().then(|| flow_unknown(known)).flatten();
        let captured = CaptureRecord {
            photos,
            transmittance_sigma: sigma,
            flow: flow.map(|_| files::flow_file(&file)),
            height: self.height,
            known,
        };
        let diagnostics = [&self.diagnostics[..], &measured.diagnostics].concat();
        PhotoRecord {
            source: self.entry.source(),
            object_m,
            error_m: libm::hypot(side, self.sigma * object_m[0]),
            screen: measured.light,
            unevenness: measured.unevenness.into(),
            outline_confidence: measured.distinct,
            color_confidence: Some(
                ColorUncertainty {
                    tint: sigma as f32,
                    ..ColorUncertainty::default()
                }
                .confidence(),
            ),
            diagnostics: diagnostics.into_iter().chain(hidden).collect(),
            captured: Some(captured),
            ..PhotoRecord::new(file, px_per_metre, size_m, outline_px)
        }
    }
}

/// The share of what is see-through where refraction is known.
fn known_share(flow: &Flow, film: &Image<Film>) -> f64 {
    let clear = film.map(|film| {
        let v = film.transmittance().max_channel();
        film != Film::default() && v >= OPAQUE
    });
    let known = clear.zip_map(&flow.known, |clear, known| clear && known);
    known.count() as f64 / clear.count().max(1) as f64
}

fn flow_unknown(known: f64) -> Option<Diagnostic> {
    (known < MIN_KNOWN).then(|| {
        let what = format!(
            "refraction is known on {:.0} % of what is see-through, expected at least {:.0} %: \
             lines of sight leave the display or scatter; use a larger display or a camera farther away",
            100.0 * known,
            100.0 * MIN_KNOWN
        );
        Diagnostic::note(Code::FlowUnknown, what)
    })
}

/// Mean over the object.
fn mean_sigma(sigma: &Image<f32>) -> f64 {
    let inside = sigma.pixels().iter().filter(|s| **s > 0.0);
    let (sum, count) = inside.fold((0.0, 0.0), |(sum, n), s| (sum + f64::from(*s), n + 1.0));
    sum / f64::max(count, 1.0)
}
