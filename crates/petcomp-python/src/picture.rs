//! Pictures: read, written, keyed, cut out.

use crate::arrays::{Given, Photo, matte_of, to_array};
use crate::document::{parse, text};
use crate::errors::{to_python, wrong_type, wrong_value};
use crate::work;
use numpy::{PyArrayDyn, PyUntypedArray, PyUntypedArrayMethods};
use petcomp::io::{self, Bits, WriteOptions};
use petcomp::matte::key::{Deviations, KeyOptions, Keyed, Keying, Screen};
use petcomp::matte::{self, CutOut, CutOutOptions};
use petcomp::{Coverage, Error, Image, LinearRgb, PremulRgba, Result};
use pyo3::prelude::*;
use std::path::PathBuf;

type FloatArray<'py> = Bound<'py, PyArrayDyn<f32>>;

/// Keys a photo of a screen: matte, cut-out and the deviations of the robust profile.
#[pyfunction]
pub(crate) fn key<'py>(
    py: Python<'py>,
    image: &Bound<'py, PyAny>,
    screen: &Bound<'py, PyAny>,
    garbage: Option<Bound<'py, PyAny>>,
    core: Option<Bound<'py, PyAny>>,
    options: &str,
) -> PyResult<(FloatArray<'py>, FloatArray<'py>, String)> {
    let photo = Given::from_argument("image", image)?;
    let inputs = KeyInputs {
        screen: ScreenArgument::new(screen)?,
        garbage: garbage.map(|m| matte_of("garbage", &m)).transpose()?,
        core: core.map(|m| matte_of("core", &m)).transpose()?,
        options: parse("options", options).map_err(to_python)?,
    };
    let keyed = work::run(py, move || inputs.keyed(photo).map_err(of_screen))?;
    let changed = deviations_json(&keyed.deviations);
    let matte = to_array(py, keyed.matte)?;
    Ok((matte, to_array(py, keyed.cutout)?, changed))
}

/// The same error, whose plate is the argument `screen`.
fn of_screen(error: Error) -> Error {
    match error {
        Error::Value { at, what } if at == "plate" => Error::value("screen", what),
        other => other,
    }
}

/// What a keyer is given beside the photo.
struct KeyInputs {
    screen: ScreenArgument,
    garbage: Option<Image<Coverage>>,
    core: Option<Image<Coverage>>,
    options: KeyOptions,
}

impl KeyInputs {
    fn keyed(mut self, photo: Given) -> Result<Keyed> {
        let plate = self.screen.take_plate()?;
        let color = Screen::Color(self.screen.color());
        let screen = plate.as_ref().map_or(color, Screen::Plate);
        match photo.decoded("image")? {
            Photo::Rgb(pixels) => self.run(Keying::of_view(pixels.view(), screen)),
            Photo::Rgba(pixels) => self.run(Keying::of_view(pixels.view(), screen)),
        }
    }

    fn run<'a, P: matte::key::Photo>(&'a self, mut keying: Keying<'a, P>) -> Result<Keyed> {
        if let Some(garbage) = &self.garbage {
            keying = keying.with_garbage(garbage);
        }
        if let Some(core) = &self.core {
            keying = keying.with_core(core);
        }
        keying.run(&self.options)
    }
}

/// A colour, or a photo of the screen.
enum ScreenArgument {
    Color([f32; 3]),
    Plate(Given),
}

const EXPECTED_SCREEN: &str =
    "expected three numbers (a scene-linear colour) or a picture of the screen";

impl ScreenArgument {
    fn new(argument: &Bound<'_, PyAny>) -> PyResult<Self> {
        let Ok(array) = argument.cast::<PyUntypedArray>() else {
            let color = argument.extract::<[f32; 3]>().map(Self::Color);
            return color.map_err(|_| wrong_type("screen", EXPECTED_SCREEN));
        };
        match array.shape() {
            [3] => color_of(array).map(Self::Color),
            _ => Given::from_argument("screen", argument).map(Self::Plate),
        }
    }

    fn color(&self) -> LinearRgb {
        match self {
            Self::Color(color) => LinearRgb::from(*color),
            Self::Plate(_) => LinearRgb::BLACK,
        }
    }

    /// The photo of the screen, where there is one.
    fn take_plate(&mut self) -> Result<Option<Image<LinearRgb>>> {
        match std::mem::replace(self, Self::Color(self.color().channels())) {
            Self::Color(_) => Ok(None),
            Self::Plate(plate) => plate.decoded("screen")?.into_opaque("screen").map(Some),
        }
    }
}

/// The colour of a pixel: scene-linear or a code, as pictures are.
fn color_of(pixel: &Bound<'_, PyUntypedArray>) -> PyResult<[f32; 3]> {
    let picture = pixel.call_method1("reshape", (1, 1, 3))?;
    let picture = Given::from_argument("screen", &picture)?.decoded("screen");
    let picture = picture.and_then(|picture| picture.into_opaque("screen"));
    Ok(picture.map_err(to_python)?[(0, 0)].channels())
}

fn deviations_json(deviations: &Deviations) -> String {
    serde_json::json!({
        "unusable_pixels": deviations.unusable_pixels,
        "filled_plate": deviations.filled_plate,
        "unusable_mattes": deviations.unusable_mattes,
        "clamped": deviations.clamped,
    })
    .to_string()
}

/// Cuts out the single object of a photo; also returns its record as JSON.
#[pyfunction]
pub(crate) fn cut_out<'py>(
    py: Python<'py>,
    image: &Bound<'py, PyAny>,
    empty: Option<Bound<'py, PyAny>>,
    options: &str,
) -> PyResult<(FloatArray<'py>, FloatArray<'py>, String)> {
    let photo = Given::from_argument("image", image)?;
    let empty = empty.map(|e| Given::from_argument("empty", &e));
    let empty = empty.transpose()?;
    let options: CutOutOptions = parse("options", options).map_err(to_python)?;
    let (rgba, cut) = work::run(py, move || {
        let cut = cut_out_of(photo, empty, &options)?;
        Ok((cut.to_rgba(), cut))
    })?;
    let record = text(&cut_out_record(&cut)).map_err(to_python)?;
    Ok((
        to_array(py, rgba)?,
        to_array(py, cut.transmittance)?,
        record,
    ))
}

fn cut_out_of(photo: Given, empty: Option<Given>, options: &CutOutOptions) -> Result<CutOut> {
    let photo = photo.decoded("image")?.into_opaque("image")?;
    let empty = empty.map(|e| e.decoded("empty")?.into_opaque("empty"));
    matte::cut_out_corrected(&photo, empty.transpose()?.as_ref(), &[], options)
}

fn cut_out_record(cut: &CutOut) -> serde_json::Value {
    let hull: Vec<[f64; 2]> = cut.hull.iter().map(|p| [p.x, p.y]).collect();
    serde_json::json!({
        "hull": hull,
        "roi": [cut.roi.x, cut.roi.y, cut.roi.width, cut.roi.height],
        "scale": cut.scale,
        "screen": cut.screen.channels(),
        "method": cut.method.to_string(),
        "residual_matte": cut.residual_matte,
        "diagnostics": cut.diagnostics,
    })
}

/// Reads an image file as float32, scene-linear.
#[pyfunction]
pub(crate) fn read_picture<'py>(
    py: Python<'py>,
    path: PathBuf,
    alpha: bool,
) -> PyResult<FloatArray<'py>> {
    if alpha {
        let image: Image<PremulRgba> = work::run(py, move || io::read(path))?;
        return to_array(py, image);
    }
    let image: Image<LinearRgb> = work::run(py, move || io::read(path))?;
    to_array(py, image)
}

/// Writes an image in the format of the file extension; OpenEXR gets 32-bit floats.
#[pyfunction]
pub(crate) fn write_picture(
    py: Python<'_>,
    path: PathBuf,
    image: &Bound<'_, PyAny>,
) -> PyResult<()> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    if !["exr", "png", "jpg", "jpeg", "tif", "tiff"].contains(&&*extension.to_lowercase()) {
        let what = "expected the extension .exr, .png, .jpg or .tif";
        return Err(wrong_value(
            "path",
            format_args!("{}: {what}", path.display()),
        ));
    }
    let options = WriteOptions {
        bits: extension.eq_ignore_ascii_case("exr").then_some(Bits::Float),
        ..WriteOptions::default()
    };
    let image = Given::from_argument("image", image)?;
    work::run(py, move || match image.decoded("image")? {
        Photo::Rgb(pixels) => io::write_with(path, &pixels.into_image(), &options),
        Photo::Rgba(pixels) => {
            let image = pixels.into_image();
            check_sound("image", &image)?;
            io::write_with(path, &image, &options)
        }
    })
}

/// What rounding may add to an alpha of 1, as where a picture is blurred.
const ALPHA_ROUNDING: f32 = 1e-5;

/// Refuses a picture with a pixel whose alpha no picture has.
pub(crate) fn check_sound(name: &str, image: &Image<PremulRgba>) -> Result<()> {
    let is_sound = |pixel: &PremulRgba| {
        pixel.color().is_finite() && (0.0..=1.0 + ALPHA_ROUNDING).contains(&pixel.a)
    };
    let bad = image.pixels().iter().position(|pixel| !is_sound(pixel));
    bad.map_or(Ok(()), |i| {
        let (x, y) = (i % image.width(), i / image.width());
        let what = format!(
            "alpha {} in column {x}, row {y}, expected 0 to 1",
            image.pixels()[i].a
        );
        Err(Error::value(name, what))
    })
}
