//! Codecs: conversion between files and samples, and between samples and pixels.

pub(crate) mod channels;
pub(crate) mod codes;
pub(crate) mod exif;
pub(crate) mod exr;
pub(crate) mod hdr;
pub(crate) mod heif;
pub(crate) mod jpeg;
pub(crate) mod orient;
pub(crate) mod pixels;
pub(crate) mod png;
pub(crate) mod profile;
pub(crate) mod raster;
pub(crate) mod refusal;
pub(crate) mod tiff;

pub use pixels::FromFile;

pub(crate) use channels::Wanted;
