//! The renderer against its definition.

mod definition;
mod lens;
mod refraction;
