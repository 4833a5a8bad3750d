//! Arrays of NumPy as pictures, and pictures as arrays.

use crate::errors::{wrong_type, wrong_value};
use crate::foreign::{Foreign, foreign};
use bytemuck::Pod;
use numpy::ndarray::{ArrayD, IxDyn};
use numpy::{Element, PyArrayDescrMethods, PyArrayDyn, PyUntypedArray, PyUntypedArrayMethods};
use petcomp::color::{decode_row, decode_srgb8};
use petcomp::io::Limits;
use petcomp::{
    Coverage, Error, Image, ImageView, LinearRgb, PremulRgba, Result, Srgb8, Srgba8, StraightRgba,
};
use pyo3::prelude::*;

/// A picture that was given: scene-linear numbers, or codes for a display.
pub(crate) enum Given {
    Rgb(Foreign<LinearRgb>),
    Rgba(Foreign<PremulRgba>),
    Codes(Foreign<Srgb8>),
    CodesAlpha(Foreign<Srgba8>),
}

/// Pixels of one kind: where they were, or made from codes.
pub(crate) enum Pixels<P> {
    Given(Foreign<P>),
    Made(Image<P>),
}

impl<P: Pod> Pixels<P> {
    pub(crate) fn view(&self) -> ImageView<'_, P> {
        match self {
            Self::Given(foreign) => foreign.view(),
            Self::Made(image) => image.view(),
        }
    }

    pub(crate) fn into_image(self) -> Image<P> {
        match self {
            Self::Given(foreign) => copied(foreign.view()),
            Self::Made(image) => image,
        }
    }
}

/// A picture with alpha or without, scene-linear.
pub(crate) enum Photo {
    Rgb(Pixels<LinearRgb>),
    Rgba(Pixels<PremulRgba>),
}

impl Given {
    /// The picture of an argument: float32 (scene-linear, alpha premultiplied) or uint8 (sRGB, alpha
    /// straight), height x width x 3 or 4.
    pub(crate) fn from_argument(name: &str, argument: &Bound<'_, PyAny>) -> PyResult<Self> {
        let array = array_of(name, argument)?;
        let [height, width, channels] = shape_of(name, array)?;
        let size = [width, height];
        check_size(name, size)?;
        if is_of::<f32>(array) {
            Self::of_floats(array, size, channels)
        } else if is_of::<u8>(array) {
            Self::of_codes(array, size, channels)
        } else {
            Err(wrong_dtype(name, array))
        }
    }

    fn of_floats(
        array: &Bound<'_, PyUntypedArray>,
        size: [usize; 2],
        channels: usize,
    ) -> PyResult<Self> {
        match channels {
            3 => foreign::<f32, _>(array, size).map(Self::Rgb),
            _ => foreign::<f32, _>(array, size).map(Self::Rgba),
        }
    }

    fn of_codes(
        array: &Bound<'_, PyUntypedArray>,
        size: [usize; 2],
        channels: usize,
    ) -> PyResult<Self> {
        match channels {
            3 => foreign::<u8, _>(array, size).map(Self::Codes),
            _ => foreign::<u8, _>(array, size).map(Self::CodesAlpha),
        }
    }

    /// Scene-linear pixels; numbers that are none are refused.
    pub(crate) fn decoded(self, name: &str) -> Result<Photo> {
        Ok(match self {
            Self::Rgb(pixels) => Photo::Rgb(finite(name, pixels)?),
            Self::Rgba(pixels) => Photo::Rgba(finite(name, pixels)?),
            Self::Codes(codes) => Photo::Rgb(Pixels::Made(decoded(codes.view()))),
            Self::CodesAlpha(codes) => Photo::Rgba(Pixels::Made(premultiplied(codes.view()))),
        })
    }
}

impl Photo {
    /// Refuses alpha.
    pub(crate) fn into_opaque(self, name: &str) -> Result<Image<LinearRgb>> {
        match self {
            Self::Rgb(pixels) => Ok(pixels.into_image()),
            Self::Rgba(_) => Err(Error::value(name, "4 channels, expected 3 (no alpha)")),
        }
    }

    /// Takes pixels without alpha as covering.
    pub(crate) fn into_premul(self) -> Image<PremulRgba> {
        match self {
            Self::Rgb(pixels) => pixels.into_image().map(LinearRgb::opaque),
            Self::Rgba(pixels) => pixels.into_image(),
        }
    }
}

/// A matte that was given: shares of pixels, or whether they are inside.
pub(crate) enum GivenMatte {
    Coverage(Foreign<Coverage>),
    Inside(Foreign<u8>),
}

impl GivenMatte {
    /// The matte of an argument: float32 from 0 to 1, or bool, height x width.
    pub(crate) fn from_argument(name: &str, argument: &Bound<'_, PyAny>) -> PyResult<Self> {
        let array = array_of(name, argument)?;
        let size = matte_size(name, array)?;
        if is_of::<bool>(array) {
            return foreign::<bool, _>(array, size).map(Self::Inside);
        }
        if !is_of::<f32>(array) {
            let found = array.dtype();
            let what = format!("dtype {found}, expected float32 (0 to 1) or bool");
            return Err(wrong_type(name, &what));
        }
        let matte = foreign::<f32, Coverage>(array, size)?;
        check_coverage(name, matte.view()).map_err(crate::errors::to_python)?;
        Ok(Self::Coverage(matte))
    }

    /// `(width, height)`.
    pub(crate) fn size(&self) -> (usize, usize) {
        match self {
            Self::Coverage(matte) => matte.view().size(),
            Self::Inside(inside) => inside.view().size(),
        }
    }
}

/// A matte of an argument, copied.
pub(crate) fn matte_of(name: &str, argument: &Bound<'_, PyAny>) -> PyResult<Image<Coverage>> {
    Ok(match GivenMatte::from_argument(name, argument)? {
        GivenMatte::Coverage(matte) => copied(matte.view()),
        GivenMatte::Inside(inside) => matte_of_mask(inside.view()),
    })
}

fn matte_size(name: &str, array: &Bound<'_, PyUntypedArray>) -> PyResult<[usize; 2]> {
    let &[height, width] = array.shape() else {
        let found = array.shape();
        let what = format!("shape {found:?}, expected (height, width)");
        return Err(wrong_value(name, what));
    };
    check_size(name, [width, height])?;
    Ok([width, height])
}

fn matte_of_mask(inside: ImageView<'_, u8>) -> Image<Coverage> {
    let (width, height) = inside.size();
    let codes = copied(inside).into_vec().into_iter();
    let shares = codes.map(|code| Coverage(f32::from(u8::from(code != 0))));
    Image::from_vec(width, height, shares.collect())
}

fn check_coverage(name: &str, matte: ImageView<'_, Coverage>) -> Result<()> {
    for y in 0..matte.size().1 {
        let row = matte.row(y);
        if let Some(x) = row.iter().position(|c| !(0.0..=1.0).contains(&c.0)) {
            let what = format!("{} at column {x}, row {y}, expected 0 to 1", row[x].0);
            return Err(Error::value(name, what));
        }
    }
    Ok(())
}

fn array_of<'a, 'py>(
    name: &str,
    argument: &'a Bound<'py, PyAny>,
) -> PyResult<&'a Bound<'py, PyUntypedArray>> {
    let array = argument.cast::<PyUntypedArray>().map_err(|_| {
        let found = argument.get_type();
        wrong_type(name, &format!("{found}, expected a NumPy array"))
    })?;
    let masked = argument.py().import("numpy.ma")?.getattr("MaskedArray")?;
    match argument.is_instance(&masked)? {
        // Its mask would be lost without a word.
        true => Err(wrong_type(name, "a masked array, expected a plain one")),
        false => Ok(array),
    }
}

fn is_of<T: Element>(array: &Bound<'_, PyUntypedArray>) -> bool {
    array.dtype().is_equiv_to(&numpy::dtype::<T>(array.py()))
}

fn shape_of(name: &str, array: &Bound<'_, PyUntypedArray>) -> PyResult<[usize; 3]> {
    match *array.shape() {
        [height, width, channels @ (3 | 4)] => Ok([height, width, channels]),
        _ => Err(wrong_shape(name, array)),
    }
}

fn wrong_shape(name: &str, array: &Bound<'_, PyUntypedArray>) -> PyErr {
    let found = array.shape();
    wrong_value(
        name,
        format_args!("shape {found:?}, expected (height, width, 3) or (height, width, 4)"),
    )
}

fn wrong_dtype(name: &str, array: &Bound<'_, PyUntypedArray>) -> PyErr {
    let found = array.dtype();
    let what = format!("dtype {found}, expected float32 (scene-linear) or uint8 (sRGB)");
    wrong_type(name, &what)
}

fn check_size(name: &str, size: [usize; 2]) -> PyResult<()> {
    let checked = Limits::default().check_size(size);
    checked.map_err(|what| wrong_value(name, what))
}

fn copied<P: Pod>(view: ImageView<'_, P>) -> Image<P> {
    let (width, height) = view.size();
    let mut pixels = Vec::with_capacity(width * height);
    (0..height).for_each(|y| pixels.extend_from_slice(view.row(y)));
    Image::from_vec(width, height, pixels)
}

fn decoded(codes: ImageView<'_, Srgb8>) -> Image<LinearRgb> {
    let (width, height) = codes.size();
    let mut image = Image::new(width, height);
    for y in 0..height {
        decode_row(codes.row(y), image.row_mut(y));
    }
    image
}

fn premultiplied(codes: ImageView<'_, Srgba8>) -> Image<PremulRgba> {
    let (width, height) = codes.size();
    Image::from_fn(width, height, |x, y| premultiplied_pixel(codes.row(y)[x]))
}

/// As in files: straight alpha, multiplied in linear light.
fn premultiplied_pixel(code: Srgba8) -> PremulRgba {
    let color = decode_srgb8(Srgb8 {
        r: code.r,
        g: code.g,
        b: code.b,
    });
    let straight = StraightRgba {
        r: color.r,
        g: color.g,
        b: color.b,
        a: f32::from(code.a) / 255.0,
    };
    straight.to_premul()
}

fn is_finite<P: Pod>(pixel: &P) -> bool {
    let channels: &[f32] = bytemuck::cast_slice(std::slice::from_ref(pixel));
    channels.iter().all(|channel| channel.is_finite())
}

/// Pixels made of floats, each of which is a number.
fn finite<P: Pod>(name: &str, pixels: Foreign<P>) -> Result<Pixels<P>> {
    let view = pixels.view();
    for y in 0..view.size().1 {
        let mut row = view.row(y).iter();
        if let Some(x) = row.position(|pixel| !is_finite(pixel)) {
            let what = format!("not finite in column {x}, row {y}, expected finite numbers");
            return Err(Error::value(name, what));
        }
    }
    Ok(Pixels::Given(pixels))
}

/// A picture as an array, its memory moved: height x width, and the channels where there are
/// several.
pub(crate) fn to_array<'py, P: Pod, T: Element + Pod>(
    py: Python<'py>,
    image: Image<P>,
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let (width, height) = image.size();
    let channels = size_of::<P>() / size_of::<T>();
    let shape: &[usize] = match channels {
        1 => &[height, width],
        _ => &[height, width, channels],
    };
    let numbers = bytemuck::allocation::cast_vec::<P, T>(image.into_vec());
    let array = ArrayD::from_shape_vec(IxDyn(shape), numbers);
    let array = array.map_err(|e| crate::errors::internal(&e.to_string()))?;
    Ok(PyArrayDyn::from_owned_array(py, array))
}
