//! Light: area lights, ambient, and the exposure that makes rendered light match a plate.
//!
//! A light is asked three things: how bright it is ([`radiance`]), where it is sampled ([`nodes`]) and, where nothing is
//! in the way, what it does in closed form ([`polygon_irradiance`], [`irradiance`]). [`match_plate`] is the stage: it
//! turns what a scene leaves to its plate (exposure, colour of the light, noise) into numbers.

mod ambient;
mod area;
mod expose;
mod irradiance;
mod nodes;
mod noise;
mod polygon;
mod quadrature;
mod sky;
mod surface;

pub use ambient::ambient_directions;
pub use area::{LightFrame, frame, radiance};
pub use expose::{expose, match_plate, plate_white};
pub use irradiance::irradiance;
pub(crate) use nodes::nodes_above;
pub use nodes::{Node, nodes};
pub use noise::{match_noise, plate_noise};
pub use polygon::polygon_irradiance;
pub use quadrature::gauss_legendre;
pub(crate) use sky::sky_cells;
pub use sky::{SkyPiece, sky_pieces};
pub use surface::{match_light_tint, surface_color};
