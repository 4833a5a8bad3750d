//! Tests of the renderer against its definition.

mod definition;
mod lens;
mod refraction;
