//! Light: area lights, ambient, and the exposure that makes rendered light match a plate.
//!
//! A light is asked three things: how bright it is ([`radiance`]), where it is sampled ([`nodes`]) and, where nothing is
//! in the way, what it does in closed form ([`polygon_irradiance`], [`irradiance`]). [`expose`] is the stage: it turns
//! [`Exposure::MatchPlate`](crate::scene::Exposure::MatchPlate) into a number.

mod ambient;
mod area;
mod expose;
mod nodes;
mod polygon;
mod sky;

pub use ambient::ambient_directions;
pub use area::{LightFrame, frame, irradiance, radiance};
pub use expose::{expose, plate_white};
pub use nodes::{Node, gauss_legendre, nodes};
pub use polygon::polygon_irradiance;
pub(crate) use sky::sky_cells;
pub use sky::{SkyPiece, sky_pieces};
