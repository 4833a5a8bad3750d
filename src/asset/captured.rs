//! A capture on a luminous display as a cut-out: measured film, its size, how it bends light.

use super::DEFAULT_THICKNESS;
use super::capture_entry::CaptureEntry;
use super::concave::concave_warning;
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
use crate::matte::{ColorUncertainty, CutOutOptions, Flow, LightPath, Outline, from_top_left};
use crate::pixel::{Film, Mix};
use std::path::PathBuf;

/// An object that was captured on a display.
pub(super) struct CapturedObject {
    /// Trimmed to the object and a margin.
    pub(super) film: Image<Film>,
    /// How it bends light, where stripes were photographed.
    pub(super) flow: Option<Flow>,
    pub(super) record: PhotoRecord,
}

/// Memory that a photo takes for each of its pixels while its frame is recognised: the picture, its
/// samples as decoded, and copies that markers are searched in.
const BYTES_PER_PIXEL: u64 = 40;
/// Noise of a corner of the display, pixels: those of four markers, carried to the corners.
const CORNER_SIGMA_PX: f64 = 0.15;
/// Standard error of one side of the outline, pixels of the view: on synthetic captures the area of
/// an ellipse is right to 0.3 pixels of its radius.
const SIDE_ERROR_PX: f64 = 0.5;

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
    let files = CaptureFiles::new(entry, captured);
    let seen = files.seen(&display).map_err(|e| in_capture(e, entry))?;
    let pose = seen.pose(&display, width)?;
    let place = Placed::new(
        entry,
        width / f64::from(display.size_px[0]),
        &seen.view,
        pose,
    );
    let trim = Trim::new(&seen.measured.outline, seen.view.size, options);
    Ok(place.object(&seen.measured, &trim, files.count()))
}

/// The photos of a capture with the object and without.
struct CaptureFiles {
    photos: Vec<PathBuf>,
    empty: Vec<PathBuf>,
}

/// What they show.
struct SeenCapture {
    measured: Measured,
    view: View,
    /// The photo of the white frame, from which scale and view are taken.
    white: FramePhoto,
    white_file: PathBuf,
}

impl CaptureFiles {
    fn new(entry: &PhotoEntry, captured: &CaptureEntry) -> Self {
        let photos = [&entry.file].into_iter().chain(&captured.photos);
        Self {
            photos: photos.cloned().collect(),
            empty: captured.empty.clone(),
        }
    }

    fn count(&self) -> usize {
        self.photos.len() + self.empty.len()
    }

    fn seen(&self, display: &Display) -> Result<SeenCapture> {
        let (names, empty_names) = (names(&self.photos), names(&self.empty));
        let read = |i: usize| io::read(&self.photos[i]);
        let read_empty = |i: usize| io::read(&self.empty[i]);
        let sources = Sources {
            names: &names,
            read: &read,
        };
        let empty_sources = Sources {
            names: &empty_names,
            read: &read_empty,
        };
        let mut files = self.photos.iter().chain(&self.empty);
        files.try_for_each(io::check_square_pixels)?;
        let at_once = io::pictures_at_once(self.photos.iter().chain(&self.empty), BYTES_PER_PIXEL);
        let recognised = sources.recognised(display, at_once)?;
        let empty_recognised = empty_sources.recognised(display, at_once)?;
        let number = number_of_white(&recognised, &names)?;
        let view = View::of_photo(display, &recognised[number]);
        let photos = Photos {
            sources,
            recognised: &recognised,
        };
        let empty = Photos {
            sources: empty_sources,
            recognised: &empty_recognised,
        };
        Ok(SeenCapture {
            measured: measure(display, &view, &photos, &empty)?,
            view,
            white: recognised[number].clone(),
            white_file: self.photos[number].clone(),
        })
    }
}

fn names(files: &[PathBuf]) -> Vec<String> {
    let names = files
        .iter()
        .map(|file| file.file_name().unwrap_or_default());
    names
        .map(|name| name.to_string_lossy().into_owned())
        .collect()
}

fn in_capture(error: Error, entry: &PhotoEntry) -> Error {
    match error {
        Error::Photo { what } => Error::Photo {
            what: format!("{}: {what}", entry.asset),
        },
        other => other,
    }
}

fn number_of_white(recognised: &[FramePhoto], names: &[String]) -> Result<usize> {
    let mut photos = recognised.iter();
    let number = photos.position(|photo| photo.frame == Frame::White);
    number.ok_or_else(|| Error::Photo {
        what: format!("no photo of the white frame among {}", names.join(", ")),
    })
}

impl SeenCapture {
    /// Where the camera stood over a display of this width, metres.
    fn pose(&self, display: &Display, width: f64) -> Result<ScreenPose> {
        let [w, h] = display.size_px.map(f64::from);
        let reference = ReferenceRectangle {
            size: [width, width * h / w],
            corners_px: from_top_left(self.white.display_corners_px(display)),
            sigma_px: CORNER_SIGMA_PX,
        };
        let header = io::read_header(&self.white_file)?;
        let pose = ScreenPose::solve(&reference, self.white.size_px, &header);
        pose.map_err(|e| with_name(e, &self.white_file))
    }
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
    fn new(entry: &'a PhotoEntry, pitch: f64, view: &View, pose: ScreenPose) -> Self {
        let height = entry.thickness() / 2.0;
        let warnings = pose_warning(&pose)
            .into_iter()
            .chain(thickness_warning(entry));
        Self {
            entry,
            pitch,
            px_per_metre: spread(&pose, height) / (view.display_px * pitch),
            height,
            sigma: pose.sigma(Point3::new(0.0, 0.0, height)),
            diagnostics: warnings.collect(),
        }
    }

    fn object(&self, measured: &Measured, trim: &Trim, photos: usize) -> CapturedObject {
        // The weights of a reduction add up to 1 only up to rounding.
        let film = trim.cropped(&measured.film).map(Film::clamped);
        let flow = self.flow(measured, trim, &film);
        let captured = self.capture_record(measured, flow.as_ref(), photos);
        let record = self.record(measured, trim, &film, captured);
        CapturedObject { film, flow, record }
    }

    /// In metres on the display, over the whole cut-out.
    fn flow(&self, measured: &Measured, trim: &Trim, film: &Image<Film>) -> Option<Flow> {
        let refraction = measured.refraction.as_ref()?;
        let metres = |path: LightPath| path.scaled(self.pitch as f32);
        let paths = trim.cropped(&refraction.paths.map(metres));
        let share = trim.cropped(
            &refraction
                .known
                .map(|known| if known { 1.0_f32 } else { 0.0 }),
        );
        let known = share.map(|share| share >= 0.5);
        let paths = paths.zip_map(&share, |path, share| {
            if share >= 0.5 {
                LightPath::default().add_scaled(share.recip(), path)
            } else {
                LightPath::default()
            }
        });
        let width = film.width() as f64 / (self.px_per_metre * trim.scale);
        Some(Flow {
            paths,
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
        captured: CaptureRecord,
    ) -> PhotoRecord {
        let placed = self.placed_record(trim, film.size());
        let side = std::f64::consts::SQRT_2 * SIDE_ERROR_PX / self.px_per_metre;
        PhotoRecord {
            source: self.entry.source(),
            error_m: libm::hypot(side, self.sigma * placed.object_m[0]),
            screen: measured.light,
            unevenness: measured.unevenness.into(),
            outline_confidence: measured.distinct,
            color_confidence: Some(confidence(captured.transmittance_sigma)),
            diagnostics: self.all_diagnostics(measured),
            captured: Some(captured),
            ..placed
        }
    }

    /// Where the object is in a cut-out of some pixels, and how large it is.
    fn placed_record(&self, trim: &Trim, (w, h): (usize, usize)) -> PhotoRecord {
        let px_per_metre = self.px_per_metre * trim.scale;
        let size_m = [w as f64, h as f64].map(|px| px / px_per_metre);
        let outline_px = trim.hull.iter().map(files::rounded).collect();
        let file = self.entry.cut_out_file();
        PhotoRecord {
            object_m: oriented_size(&trim.hull).map(|px| px / px_per_metre),
            ..PhotoRecord::new(file, px_per_metre, size_m, outline_px)
        }
    }

    fn capture_record(
        &self,
        measured: &Measured,
        flow: Option<&Flow>,
        photos: usize,
    ) -> CaptureRecord {
        let file = self.entry.cut_out_file();
        CaptureRecord {
            photos,
            transmittance_sigma: mean_sigma(&measured.sigma),
            flow: flow.map(|_| files::flow_file(&file)),
            height: self.height,
            haze: flow.map_or(0.0, mean_haze),
        }
    }

    fn all_diagnostics(&self, measured: &Measured) -> Vec<Diagnostic> {
        let all = self.diagnostics.iter().chain(&measured.diagnostics);
        all.cloned()
            .chain(concave_warning(&measured.outline))
            .collect()
    }
}

/// How much farther apart than at a height lines of sight end on the display.
fn spread(pose: &ScreenPose, height: f64) -> f64 {
    let camera = pose.camera.center().z;
    camera / (camera - height).max(MIN_CLEARANCE * camera)
}

/// A camera is at least this share of its own height above the middle of an object.
const MIN_CLEARANCE: f64 = 0.1;

/// Confidence in colours whose transmittance has this standard error.
fn confidence(sigma: f64) -> f64 {
    let uncertainty = ColorUncertainty {
        tint: sigma as f32,
        ..ColorUncertainty::default()
    };
    uncertainty.confidence()
}

fn pose_warning(pose: &ScreenPose) -> Option<Diagnostic> {
    pose.is_poor_fit.then(|| {
        let what = "the markers fit those of the display poorly; was the picture stretched?";
        Diagnostic::warning(Code::ScreenSizeMismatch, what)
    })
}

/// The warning about an object of whose thickness nothing is known.
fn thickness_warning(entry: &PhotoEntry) -> Option<Diagnostic> {
    entry.thickness.is_none().then(|| {
        let what = format!(
            "thickness: missing, {DEFAULT_THICKNESS} m is assumed, and size and refraction apply at half of it; \
             give `thickness` (--thickness) of the object as it lies, metres"
        );
        Diagnostic::warning(Code::ThicknessUnknown, what)
    })
}

/// Mean haze where refraction is known.
fn mean_haze(flow: &Flow) -> f64 {
    let pixels = flow.paths.pixels().iter().zip(flow.known.pixels());
    let known = pixels.filter(|(_, known)| **known);
    let (sum, count) = known.fold((0.0, 0.0), |(sum, n), (path, _)| {
        (sum + f64::from(path.haze), n + 1.0)
    });
    sum / f64::max(count, 1.0)
}

/// Mean over the object.
fn mean_sigma(sigma: &Image<f32>) -> f64 {
    let inside = sigma.pixels().iter().filter(|s| **s > 0.0);
    let (sum, count) = inside.fold((0.0, 0.0), |(sum, n), s| (sum + f64::from(*s), n + 1.0));
    sum / f64::max(count, 1.0)
}
