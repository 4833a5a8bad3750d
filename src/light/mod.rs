//! Light: area lights, ambient, and the exposure that makes rendered light match a plate.
//!
//! A light answers three questions: how bright it is (`radiance`), where it is sampled
//! (`nodes`) and, where nothing is in the way, what it does in closed form ([`polygon_irradiance`],
//! `irradiance`). [`match_plate`] is the stage: it turns what a scene leaves to its plate
//! (exposure, colour of the light, blur, noise) into numbers.
//!
//! ```
//! use petcomp::geom::{Point3, Vector3};
//! use petcomp::light::irradiance;
//! use petcomp::scene::{AreaLight, LightShape};
//! use std::f64::consts::PI;
//!
//! let lamp = AreaLight {
//!     shape: LightShape::Ellipse,
//!     ..AreaLight::new([0.0, 0.0, 10.0], [0.1; 2], 10.0)
//! };
//! // So far away it is a point: power over pi times the squared distance.
//! let e = irradiance(&lamp, Point3::origin(), Vector3::z());
//! assert!((f64::from(e.g) - 10.0 / PI / 100.0).abs() < 1e-5);
//! ```

mod ambient;
mod area;
mod blur;
mod expose;
mod irradiance;
mod lamp;
mod light_map;
mod measured_plate;
mod nodes;
mod noise;
mod polygon;
mod quadrature;
mod sky;
mod surface;

pub(crate) use ambient::ambient_directions;
#[doc(hidden)]
pub use area::{LightFrame, frame, radiance};
pub(crate) use area::{lowest_z, side_lengths};
#[doc(hidden)]
pub use blur::plate_blur;
#[doc(hidden)]
pub use expose::expose;
pub use expose::match_plate;
#[doc(hidden)]
pub use irradiance::irradiance;
pub(crate) use irradiance::unit_irradiance;
#[doc(hidden)]
pub use measured_plate::MeasuredPlate;
pub(crate) use measured_plate::PlateMeasures;
#[doc(hidden)]
pub use nodes::{Node, nodes, samples_along};
pub(crate) use nodes::{geometry_term, nodes_above};
#[doc(hidden)]
pub use noise::plate_noise;
#[doc(hidden)]
pub use polygon::polygon_irradiance;
pub(crate) use sky::sky_cells;
#[doc(hidden)]
pub use sky::{SkyPiece, sky_pieces};
#[doc(hidden)]
pub use surface::match_light_tint;

/// The pixels that are at least `margin` away from every border, row by row.
fn inner_pixels(
    (width, height): (usize, usize),
    margin: usize,
) -> impl Iterator<Item = (usize, usize)> {
    let (right, bottom) = (width.saturating_sub(margin), height.saturating_sub(margin));
    (margin..bottom).flat_map(move |y| (margin..right).map(move |x| (x, y)))
}
